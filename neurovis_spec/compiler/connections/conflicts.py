"""Conflicts: keys of an entry of ``connections`` that exclude each other, or say nothing beside the others.

In: the body of an entry. Out: findings, at the later key of two.
"""

from __future__ import annotations

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.values import FileReference, Rows


def check_conflicts(body: ConnectionModel, findings: Findings) -> None:
    """What excludes each other: each pair is one finding, at the second key."""
    pairs = [
        ("matrix", "weight"),
        ("matrix", "edges"),
        ("matrix", "pattern"),
        ("edges", "weight"),
        ("edges", "pattern"),
    ]
    table = isinstance(body.centre, (Rows, FileReference))
    if table:
        pairs += [("edges", "centre"), ("centre", "pattern")]
    for first, second in pairs:
        one, other = body.source.entry(first), body.source.entry(second)
        if one is not None and other is not None:
            later = max(one, other, key=lambda entry: entry.key.span)
            message = f"'{second}' beside '{first}': the {first} says it already"
            findings.error("conflicting-keys", later.key.span, message, f"remove '{second}'")
    rows = body.source.entry("rows")
    if rows is not None and body.matrix is None and not table and body.lost_keys.isdisjoint(("matrix", "centre")):
        message = "'rows' says how a matrix is read; there is no matrix"
        findings.error("useless-key", rows.key.span, message)
    loops = body.source.entry("self")
    if loops is not None and (body.matrix is not None or body.edges is not None or table):
        message = "'self' says what a pattern may do; here every connection is written"
        findings.error("useless-key", loops.key.span, message)
