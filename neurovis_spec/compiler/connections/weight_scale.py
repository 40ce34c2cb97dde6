"""Scale: the weights of an entry, scaled together when they are made.

In: the weights of an entry and where they go from and to, the ``scale`` of its body. Out: the scaled weights. The
matrix of an entry has its sources as rows and its targets as columns; parallel connections add up in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices
from neurovis_spec.compiler.events.settable import Assembled
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.language.located import Formula
from neurovis_spec.language.sections import ScaleModel
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown

#: Most neurons whose spectral radius is computed: all eigenvalues of a dense matrix are found.
MOST = 3000
#: A radius below this share of the norm is a rounding error of 0.
_NOTHING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Scaled:
    """Scaled weights that follow parameters of a run, by themselves or by what they are scaled to: the formula of one
    Part for all weights of an entry, as each depends on all others."""

    #: the weights before they are scaled
    weights: Assembled
    model: ScaleModel
    #: the neurons of both ends, and the positions in them of each connection's source and target
    ends: tuple[Indices, Indices]
    pairs: tuple[Indices, Indices]
    constants: Constants

    @property
    def slots(self) -> frozenset[int]:
        """The parameters that they read."""
        with self.constants.following() as parts:
            check_scale(self.model, self.constants)
        return self.weights.slots.union(*(part.formula.slots for part in parts))

    def values(self, parameters: FloatArray, by: Library = NUMPY) -> FloatArray:
        """The scaled weights with these parameters; NaN where there is nothing to scale."""
        constants = self.constants
        values = constants.parameters | {name: float(parameters[slot]) for name, slot in constants.settable.items()}
        quiet = Constants(Names(values), constants.dt, Findings())
        weights = self.weights.values(parameters, by)
        result = scaled(self.model, weights, self.ends, self.pairs, quiet) if np.isfinite(weights).all() else UNKNOWN
        return np.full(len(weights), np.nan) if result is UNKNOWN else result


def scaled(
    model: ScaleModel,
    weights: FloatArray,
    ends: tuple[Indices, Indices],
    pairs: tuple[Indices, Indices],
    constants: Constants,
) -> FloatArray | Unknown:
    """The weights (one a connection), scaled as the author asks; UNKNOWN where that cannot be, which is reported.

    ``ends`` are the neurons of both ends, ``pairs`` the positions in them of each connection's source and target.
    """
    wanted = check_scale(model, constants)
    i, j = pairs
    if model.indegree is not None and wanted is not UNKNOWN:
        return weights / np.bincount(j)[j] if wanted else weights
    exponent = _exponent(weights)
    scopes = _times(weights, -exponent)
    if model.norm is not None and wanted is not UNKNOWN:
        cells = i.astype(np.int64) * len(ends[1]) + j
        _, place = np.unique(cells, return_inverse=True)
        norm = float(np.linalg.norm(np.bincount(place, scopes)))
        return _to(model.norm, wanted, weights, (norm, exponent), "norm", constants)
    if model.spectral_radius is None or wanted is UNKNOWN:
        return UNKNOWN
    radius = _radius(model.spectral_radius, scopes, ends, pairs, constants)
    if radius is UNKNOWN:
        return UNKNOWN
    return _to(model.spectral_radius, wanted, weights, (radius, exponent), "spectral radius", constants)


def check_scale(model: ScaleModel, constants: Constants) -> float | Unknown:
    """The number that a ``scale`` asks for, whatever the weights are; UNKNOWN where it is invalid."""
    result: list[float | Unknown] = [] if model.indegree is None else [float(model.indegree.value)]
    for formula, what in ((model.spectral_radius, "spectral radius"), (model.norm, "norm")):
        if formula is None:
            continue
        value = constants.scalar(formula)
        if value is not UNKNOWN and value < 0:
            constants.findings.error("out-of-range", formula.span, f"a {what} is not negative, this is {value:g}")
            value = UNKNOWN
        result.append(value)
    if not model.sound or model.contradictory:  # without what is invalid in it, it would be another one
        return UNKNOWN
    return result[0] if result else UNKNOWN


def _exponent(weights: FloatArray) -> int:
    """The power of two that brings all weights to 1 at most: sums and squares of such neither overflow nor vanish."""
    return int(np.frexp(np.abs(weights).max(initial=0.0))[1])


def _times(weights: FloatArray, exponent: int) -> FloatArray:
    """Weights times a power of two, which leaves their digits as they are."""
    result: FloatArray = np.ldexp(weights, exponent)
    return result


def _to(
    wanted: Formula, value: float, weights: FloatArray, found: tuple[float, int], what: str, constants: Constants
) -> FloatArray | Unknown:
    """The weights times what makes a measure of theirs the wanted one; ``found`` is that of the weights times
    2^-exponent, and the exponent. Digits and exponents are computed apart, so that only the result may overflow."""
    measure, exponent = found
    if measure <= _NOTHING * float(np.abs(_times(weights, -exponent)).sum()):
        message = f"the {what} of these weights is 0: there is nothing to scale"
        constants.findings.error("out-of-range", wanted.span, message)
        return UNKNOWN
    (digits, power), (least, shift) = math.frexp(value), math.frexp(measure)
    mantissas, exponents = np.frexp(weights)
    with np.errstate(over="ignore", under="ignore"):
        result: FloatArray = np.ldexp(mantissas * (digits / least), exponents - exponent + power - shift)
    if not np.isfinite(result).all():
        message = f"with a {what} of {value:g} some of these weights are larger than any number"
        constants.findings.error("not-finite", wanted.span, message)
        return UNKNOWN
    return result


def _radius(
    wanted: Formula,
    weights: FloatArray,
    ends: tuple[Indices, Indices],
    pairs: tuple[Indices, Indices],
    constants: Constants,
) -> float | Unknown:
    """The largest magnitude of an eigenvalue of the matrix of the entry, whose ends must be the same neurons."""
    sources, targets = ends
    n = len(sources)
    if not np.array_equal(np.sort(sources), np.sort(targets)):
        message = "a spectral radius is that of a matrix from neurons to the same neurons; these ends differ"
        constants.findings.error("wrong-size", wanted.span, message, "use norm or indegree")
        return UNKNOWN
    if n > MOST:
        message = f"a spectral radius is computed for {MOST:,} neurons at most, these are {n:,}"
        constants.findings.error("too-many", wanted.span, message, "use norm or indegree")
        return UNKNOWN
    column = np.argsort(sources)[np.searchsorted(np.sort(sources), targets)]
    matrix = np.zeros((n, n))
    np.add.at(matrix, (pairs[0], column[pairs[1]]), weights)
    return float(np.abs(np.linalg.eigvals(matrix)).max())
