"""Renderers: each takes a Scene (or a Film) and gives back bytes."""
