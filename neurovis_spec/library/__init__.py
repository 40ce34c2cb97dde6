"""The built-in activations, models and rules, in YAML (they are data; nothing here is code)."""
