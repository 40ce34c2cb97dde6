"""YAML with spans: from a text to a SourceDocument."""
