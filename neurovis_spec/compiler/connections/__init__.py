"""Connections: from entries to structures of arrays."""
