"""Random numbers in C, the same bits as ``compiler.draws`` and ``compiler.box_muller`` give.

In: the constants of these and of ``compiler.poisson``. Out: the text of functions: ``nv_uniform`` and ``nv_normal`` of
a key and a counter, ``nv_poisson`` of a mean and a uniform number.
"""

from __future__ import annotations

from neurovis_spec.compiler.values import box_muller, poisson

_TEXT = """static void nv_philox(uint32_t k0, uint32_t k1, uint32_t i, uint32_t step, uint32_t draw, uint32_t w[4])
{
    uint32_t c0 = i, c1 = 0, c2 = step, c3 = draw;
    for (int round = 0; round < 10; round++) {
        const uint64_t first = UINT64_C(0xD2511F53)*c0, second = UINT64_C(0xCD9E8D57)*c2;
        c0 = (uint32_t)(second >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)second;
        c2 = (uint32_t)(first >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)first;
        k0 += UINT32_C(0x9E3779B9);
        k1 += UINT32_C(0xBB67AE85);
    }
    w[0] = c0;
    w[1] = c1;
    w[2] = c2;
    w[3] = c3;
}

static double nv_fraction(uint32_t high, uint32_t low)
{
    return (double)(((uint64_t)(high >> 5) << 26) | (low >> 6))*TWO_TO_MINUS_53;
}
"""

_UNIFORM = """static double nv_uniform(uint32_t k0, uint32_t k1, uint32_t i, uint32_t step, uint32_t draw)
{
    uint32_t w[4];
    nv_philox(k0, k1, i, step, draw, w);
    return nv_fraction(w[0], w[1]);
}
"""

_LOGARITHM = """static double nv_polynomial(const double *c, int count, double z)
{
    double total = c[count - 1]*z;
    total += c[count - 2];
    for (int i = count - 3; i >= 0; i--) {
        total *= z;
        total += c[i];
    }
    return total;
}

static double nv_log(double x)
{
    static const double c[LOG_COUNT] = {LOG};
    int64_t bits, whole;
    uint64_t fraction;
    double f, s, r, half, k;
    memcpy(&bits, &x, sizeof bits);
    bits -= ROOT_HALF;
    whole = bits >= 0 ? bits >> 52 : -1 - ((-1 - bits) >> 52);
    fraction = ((uint64_t)bits & FRACTION) + (uint64_t)ROOT_HALF;
    memcpy(&f, &fraction, sizeof f);
    k = (double)whole;
    f -= 1.0;
    s = f/(2.0 + f);
    r = s*s;
    r *= nv_polynomial(c, LOG_COUNT, r);
    half = 0.5*f;
    half *= f;
    r += half;
    r *= s;
    r += k*LN2_LOW;
    half -= r;
    half -= f;
    k *= LN2_HIGH;
    k -= half;
    return k;
}
"""

_NORMAL = """static double nv_cos_turns(double u)
{
    static const double sines[SIN_COUNT] = {SIN};
    static const double cosines[COS_COUNT] = {COS};
    const double quarter = rint(4.0*u);
    const int turn = (int)quarter;
    const double x = (u - 0.25*quarter)*TAU;
    double z = x*x, sine, cosine, value;
    sine = nv_polynomial(sines, SIN_COUNT, z);
    sine *= x*z;
    sine += x;
    cosine = nv_polynomial(cosines, COS_COUNT, z);
    cosine *= z*z;
    z *= 0.5;
    z -= cosine;
    cosine = 1.0 - z;
    value = turn & 1 ? sine : cosine;
    return turn == 1 || turn == 2 ? -value : value;
}

static double nv_normal(uint32_t k0, uint32_t k1, uint32_t i, uint32_t step, uint32_t draw)
{
    uint32_t w[4];
    nv_philox(k0, k1, i, step, draw, w);
    return sqrt(-2.0*nv_log(1.0 - nv_fraction(w[0], w[1])))*nv_cos_turns(nv_fraction(w[2], w[3]));
}
"""


_POISSON = """static double nv_exp_below_zero(double x)
{
    static const double c[POISSON_EXP_COUNT] = {POISSON_EXP};
    const double whole = rint(x*POISSON_LN2_INVERSE);
    double r = x - whole*LN2_HIGH, total;
    r = r - whole*LN2_LOW;
    total = c[0]*r;
    for (int i = 1; i < POISSON_EXP_COUNT; i++)
        total = (total + c[i])*r;
    return ldexp((total + 1.0)*r + 1.0, (int)whole);
}

static double nv_most_probable(double mean)
{
    static const double c[4] = {POISSON_STIRLING};
    const double k = floor(mean);
    double e, series, apart;
    if (k < POISSON_FEW) {
        double made = nv_exp_below_zero(-mean);
        for (int i = 1; i <= (int)k; i++)
            made = made*(mean/i);
        return made;
    }
    e = (mean - k)/k;
    series = c[3]/(k*k);
    series = (series + c[2])/(k*k);
    series = (series + c[1])/(k*k);
    series = (series + c[0])/k;
    apart = k*(e - nv_log(1.0 + e));
    return nv_exp_below_zero(-(apart + series))/sqrt(TAU*k);
}

static double nv_poisson(double mean, double u)
{
    double high, low, up, down, rest;
    if (!(mean >= 0.0 && mean <= POISSON_LARGEST))
        return NAN;
    high = low = floor(mean);
    up = down = nv_most_probable(mean);
    rest = u - up;
    if (rest < 0.0)
        return high;
    do {
        high = high + 1.0;
        up = up*(mean/high);
        if (rest < up)
            return high;
        rest = rest - up;
        down = down*(low/mean);
        low = low - 1.0;
        if (rest < down)
            return low;
        rest = rest - down;
    } while (up >= POISSON_NOTHING || down >= POISSON_NOTHING);
    return floor(mean);
}
"""


def drawing(kinds: set[str]) -> str:
    """The functions that these kinds of draws (``normal``, ``uniform``, ``poisson``) need; one of ``poisson`` that is
    counted needs ``uniform``, too."""
    parts = [
        (_TEXT, {"normal", "uniform"}),
        (_UNIFORM, {"uniform"}),
        (_LOGARITHM, {"normal", "poisson"}),
        (_NORMAL, {"normal"}),
        (_POISSON, {"poisson"}),
    ]
    text = "\n".join(part for part, of in parts if not of.isdisjoint(kinds))
    for name, value in {**poisson.constants(), **box_muller.constants()}.items():
        text = text.replace(name, value)
    return text
