"""Neurons: from groups to structures of arrays."""
