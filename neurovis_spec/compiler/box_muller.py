"""From uniform to normal numbers, the same bits on every machine.

In: pairs of uniform numbers, multiples of 2^-53 in [0, 1). Out: standard normal numbers. A platform's ``log`` and
``cos`` differ from the next one's in the last bit, and NumPy's from themselves where a vector unit takes over; a draw
must not (§5 of the language: draws are equal bit for bit everywhere). So both are computed here from operations that
IEEE 754 rounds exactly: + − × ÷ and the square root, none of them fused. Coefficients: fdlibm (Sun Microsystems, 1993),
e_log.c, k_sin.c and k_cos.c.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_LN2_HIGH, _LN2_LOW = float.fromhex("0x1.62e42feep-1"), float.fromhex("0x1.a39ef35793c76p-33")
_LOG = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860511658591e-01,
)
_SIN = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
_COS = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)


def log(x: FloatArray) -> FloatArray:
    """The natural logarithm of normal positive numbers, within 1 unit of the last place."""
    mantissa, exponent = np.frexp(x)
    low = mantissa < math.sqrt(0.5)
    f = np.where(low, 2.0 * mantissa, mantissa) - 1.0
    k = (exponent - low).astype(np.float64)
    s = f / (2.0 + f)
    z = s * s
    r = z * _polynomial(_LOG, z)
    half = 0.5 * f * f
    return k * _LN2_HIGH - ((half - (s * (half + r) + k * _LN2_LOW)) - f)


def cos_turns(u: FloatArray) -> FloatArray:
    """cos(2πu) for u in [0, 1]: 0 and ±1 exactly where they are, else within some 1e-16."""
    quarter = np.rint(4.0 * u)
    x = (u - 0.25 * quarter) * math.tau  # the difference is exact, and |x| is at most π/4
    z = x * x
    cosine = 1.0 - (0.5 * z - z * z * _polynomial(_COS, z))
    sine = x + x * z * _polynomial(_SIN, z)
    turn = np.mod(quarter, 4.0)
    value = np.where(np.mod(turn, 2.0) == 0.0, cosine, sine)
    return np.where((turn == 1.0) | (turn == 2.0), -value, value)


def normal(first: FloatArray, second: FloatArray) -> FloatArray:
    """Box and Muller's cosine branch (1958): √(−2 ln(1 − first)) · cos(2π second); 1 − first is never 0.

    >>> normal(np.array([0.0, 0.5]), np.array([0.3, 0.0])).round(6) + 0.0
    array([0.     , 1.17741])
    """
    return np.sqrt(-2.0 * log(1.0 - first)) * cos_turns(second)


def _polynomial(coefficients: tuple[float, ...], z: FloatArray) -> FloatArray:
    """c0 + z·(c1 + z·(c2 + …)), by Horner."""
    total = np.full_like(z, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total = coefficient + z * total
    return total
