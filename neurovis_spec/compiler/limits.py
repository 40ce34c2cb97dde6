"""Limits: how large a network may become, checked before memory is taken."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Most neurons and most connections (§3)."""

    neurons: int = 1_000_000
    connections: int = 10_000_000
