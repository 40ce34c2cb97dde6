"""Data files: tables of numbers and lists of edges."""
