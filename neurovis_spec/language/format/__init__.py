"""Canonical formatting, and editing that keeps every comment."""
