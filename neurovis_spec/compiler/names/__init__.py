"""What the names of a spec mean: scopes, references, modules."""
