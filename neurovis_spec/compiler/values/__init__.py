"""Numbers of a spec: formulas, parameters, definitions, draws, tables."""
