"""Expressions: the author's formulas, parsed into a typed tree that is evaluated or turned into code."""
