"""From uniform to normal numbers, the same bits on every machine.

In: pairs of uniform numbers, multiples of 2^-53 in [0, 1). Out: standard normal numbers. A platform's ``log`` and
``cos`` differ from the next one's in the last bit, and NumPy's from themselves where a vector scope takes over; a draw
must not, as draws are equal bit for bit everywhere. So both are computed here from operations that
IEEE 754 rounds exactly: + − × ÷ and the square root, none of them fused. Coefficients: fdlibm (Sun Microsystems, 1993),
e_log.c, k_sin.c and k_cos.c.
"""

from __future__ import annotations

import math

import numpy as np

from neurovis_spec.arrays import FloatArray

#: ln 2 in two parts, of which the first has zeros at its end
LN2_HIGH, LN2_LOW = float.fromhex("0x1.62e42feep-1"), float.fromhex("0x1.a39ef35793c76p-33")
#: the bits of √½, rounded, and those of a number's fraction
_ROOT_HALF, _FRACTION = int(np.float64(math.sqrt(0.5)).view(np.int64)), (1 << 52) - 1
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
    """The natural logarithm of normal positive numbers, within 1 ULP of the last place."""
    # x is (1 + f)·2^k with 1 + f from √½ to √2: k and f stand in the bits of the number
    bits = np.ravel(x).view(np.int64) - _ROOT_HALF
    k = (bits >> 52).astype(np.float64)
    f = ((bits & _FRACTION) + _ROOT_HALF).view(np.float64)
    f -= 1.0
    s = f / (2.0 + f)
    r = s * s
    r *= _polynomial(_LOG, r)
    half = 0.5 * f
    half *= f
    # k·ln 2 (high) − ((half − (s·(half + r) + k·ln 2 (low))) − f)
    r += half
    r *= s
    r += k * LN2_LOW
    half -= r
    half -= f
    k *= LN2_HIGH
    k -= half
    return k.reshape(np.shape(x))


def cos_turns(u: FloatArray) -> FloatArray:
    """cos(2πu) for u in [0, 1]: 0 and ±1 exactly where they are, else within some 1e-16."""
    flat = np.ravel(u)
    quarter = np.rint(4.0 * flat)
    x = flat - 0.25 * quarter  # the difference is exact, and |x| is at most π/4
    x *= math.tau
    z = x * x
    sine = _polynomial(_SIN, z)  # x + x·z·polynomial
    sine *= x * z
    sine += x
    cosine = _polynomial(_COS, z)  # 1 − (z/2 − z²·polynomial)
    cosine *= z * z
    z *= 0.5
    z -= cosine
    np.subtract(1.0, z, out=cosine)
    turn = quarter.astype(np.int8)
    value = np.where(turn & 1, sine, cosine)
    return np.negative(value, out=value, where=(turn == 1) | (turn == 2)).reshape(np.shape(u))


def normal(first: FloatArray, second: FloatArray) -> FloatArray:
    """Box and Muller's cosine branch (1958): √(−2 ln(1 − first)) · cos(2π second); 1 − first is never 0.

    >>> normal(np.array([0.0, 0.5]), np.array([0.3, 0.0])).round(6) + 0.0
    array([0.     , 1.17741])
    """
    return np.sqrt(-2.0 * log(1.0 - first)) * cos_turns(second)


def _polynomial(coefficients: tuple[float, ...], z: FloatArray) -> FloatArray:
    """c0 + z·(c1 + z·(c2 + …)), by Horner."""
    total = coefficients[-1] * z
    total += coefficients[-2]
    for coefficient in reversed(coefficients[:-2]):
        total *= z
        total += coefficient
    return total


def constants() -> dict[str, str]:
    """The numbers above as C, by the names that the text of ``runtime.c_draws`` has for them."""
    lists = {"LOG": _LOG, "SIN": _SIN, "COS": _COS}
    counts = {f"{name}_COUNT": str(len(values)) for name, values in lists.items()}
    texts = {f"{{{name}}}": f"{{{', '.join(map(repr, values))}}}" for name, values in lists.items()}
    numbers = {"LN2_LOW": LN2_LOW, "LN2_HIGH": LN2_HIGH, "TAU": math.tau, "TWO_TO_MINUS_53": 2.0**-53}
    integers = {"ROOT_HALF": f"INT64_C({_ROOT_HALF})", "FRACTION": f"UINT64_C({_FRACTION})"}
    return {**counts, **texts, **{name: repr(value) for name, value in numbers.items()}, **integers}
