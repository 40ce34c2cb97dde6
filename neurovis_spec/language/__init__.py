"""The language: YAML with spans, the shape of a spec, expressions, data files."""
