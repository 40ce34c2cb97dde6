"""How many steps of a body are one of the network.

In: the seconds of both, what the spec says of it. Out: a number of steps, or a BodyError that says what would fit.
"""

from __future__ import annotations

from typing import Final

from neurovis_spec.body import BodyError

#: a share of a step by which the two may differ: both are sums and products of decimal numbers
_NEAR: Final = 1e-9
#: steps of a body within one of the network
_MOST: Final = 1_000_000


def substeps_of(dt: float, given: int | None, own: float, whose: str) -> int:
    """How many steps of ``own`` seconds are one of ``dt``: those ``given``, if they fit. Raises BodyError.

    >>> substeps_of(0.05, None, 0.002, "the model")
    25
    """
    if not 0 < own < float("inf"):
        raise BodyError(f"a step of {whose} is {own:g} s, which leads nowhere", "give it a timestep above 0")
    fitting = round(min(dt / own, _MOST))
    fits = fitting >= 1 and abs(fitting * own - dt) <= _NEAR * dt
    if given is not None and abs(given * own - dt) <= _NEAR * dt:
        return given
    steps = f"a step of {whose} is {own:.12g} s"
    if given is None and fits:
        return fitting
    if fits:
        message = f"{given} substeps are {given * own:.12g} s, a step of the network is {dt:.12g} s; {steps}"  # type: ignore[operator]
        raise BodyError(message, f"write substeps: {fitting}", "substeps", (dt, fitting))
    taken = max(fitting, 1) if given is None else given
    message = f"no number of substeps makes a step of the network, which is {dt:.12g} s: {steps}"
    hint = f"write time: {{dt: {taken * own:.12g}}} and substeps: {taken}"
    raise BodyError(message, hint, "substeps", (taken * own, taken))
