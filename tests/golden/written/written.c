/* written: made by neurovis export, see written.h. */

#include "written.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#ifdef __cplusplus
#define WRITTEN_RESTRICT __restrict
#else
#define WRITTEN_RESTRICT restrict
#endif

const char *const written_neuron_names[9] = {
    "A1",
    "A2",
    "B1",
    "B2",
    "B3",
    "C1",
    "C2",
    "D",
    "T",
};

static double nv_min(double a, double b)
{
    return a <= b || a != a ? a : b;
}

static double nv_max(double a, double b)
{
    return a >= b || a != a ? a : b;
}

static void nv_philox(uint32_t k0, uint32_t k1, uint32_t i, uint32_t step, uint32_t draw, uint32_t w[4])
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
    return (double)(((uint64_t)(high >> 5) << 26) | (low >> 6))*1.1102230246251565e-16;
}

static double nv_uniform(uint32_t k0, uint32_t k1, uint32_t i, uint32_t step, uint32_t draw)
{
    uint32_t w[4];
    nv_philox(k0, k1, i, step, draw, w);
    return nv_fraction(w[0], w[1]);
}

static const uint16_t t0[7] = {
    5, 6, 7, 8, 9, 10, 3
};

static const double t1[19] = {
    0.5, 0.5, 0.25, 0.125, -0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.25, 0.25,
    0.25, 0.5, 0.5
};

static const double t2[12] = {
    0.5, 0.25, 0.0, 1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 0.25, 1.0, 3.0
};

static const double t3[12] = {
    0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
};

static const double t4[3] = {
    0.5, 0.25, 1.5
};

static const double t5[82] = {
    0.5, 2.5, 0.25, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.5, 0.5, 0.25, 0.125, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.5, 2.5,
    2.5, 2.5, 2.5, 2.5, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL,
    HUGE_VAL, -2.0, -2.0, -2.0, -2.0, -2.0, -2.0, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL,
    -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, 0.25, 0.5, 0.25, 0.5, 0.0625, 0.25, 0.25, 0.25, 0.25, 0.25, 0.0, 0.5,
    -0.25, 0.125
};

/* What neurons are held at. */
static void nv_hold(written_state *state)
{
    memset(state->held, 0, sizeof state->held);
    if (state->phase == 1) {
        double n1 = 0.5;
        for (int32_t i = 0; i < 1; i++) {
            state->held[3] = 1;
            state->holding[3] = n1;
        }
    }
    if (state->phase == 3) {
        double n2 = 0.0;
        for (int32_t i = 0; i < 1; i++) {
            state->held[0] = 1;
            state->holding[0] = n2;
        }
    }
}

/* What follows parameters that change: gives 0, and changes nothing, where it cannot be. */
static int nv_follow(written_state *state, double *parameters, unsigned char *changed)
{
    double *WRITTEN_RESTRICT const weights = state->weights;
    double *WRITTEN_RESTRICT const x = state->variables;
    if (changed[0]) {
        if (!isfinite(parameters[0]) || parameters[0] < 0.0 || parameters[0] > 2.0)
            return 0;
    }
    if (!changed[1] && !state->chosen[1] && changed[0]) {
        parameters[1] = parameters[0]/2.0;
        changed[1] = 1;
    }
    if (changed[1]) {
        if (!isfinite(parameters[1]))
            return 0;
    }
    if (changed[2]) {
        if (!isfinite(parameters[2]) || parameters[2] < 0.5 || parameters[2] > 4.0)
            return 0;
    }
    for (int write = 0; write < 2; write++) {
        if (changed[0]) {
            {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[0] = value;
            }
        }
        if (changed[1]) {
            {
                const double value = parameters[1];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[3] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = 2.0 + parameters[0];
                if (!isfinite(value) || value > 8.0)
                    return 0;
                if (write)
                    x[1] = value;
            }
        }
        if (changed[1]) {
            {
                const double value = parameters[1];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[68] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[71] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[49] = value;
            }
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[50] = value;
            }
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[51] = value;
            }
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[52] = value;
            }
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[53] = value;
            }
            {
                const double value = -2.0;
                if (!isfinite(value) || value > 2.0 + parameters[0])
                    return 0;
                if (write)
                    x[54] = value;
            }
        }
        if (changed[0]) {
            for (int32_t i = 0; i < 6; i++) {
                const double value = 2.0 + parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[30 + i] = value;
            }
        }
        if (changed[1]) {
            {
                const double value = parameters[1]/4.0;
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[72] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[18] = value;
            }
        }
        if (changed[1]) {
            for (int32_t i = 0; i < 2; i++) {
                const double value = parameters[1];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[73 + i] = value;
            }
        }
        if (changed[0]) {
            for (int32_t i = 0; i < 2; i++) {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    weights[17 + i] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = parameters[0];
                if (!isfinite(value))
                    return 0;
                if (write)
                    x[79] = value;
            }
        }
        if (changed[0]) {
            {
                const double value = 0.5*parameters[0] - 0.0;
                if (!isfinite(value) || value < 0.0)
                    return 0;
            }
        }
    }
    memcpy(state->parameters, parameters, 3*sizeof(parameters[0]));
    return 1;
}

/* What events change at the step to come. */
static void nv_events(written_state *state)
{
    switch (state->k) {
    case 6: {
        double parameters[3];
        unsigned char changed[3];
        memcpy(parameters, state->parameters, sizeof parameters);
        memset(changed, 0, sizeof changed);
        parameters[0] = 0.75;
        changed[0] = 1;
        if (nv_follow(state, parameters, changed)) {
            state->chosen[0] = 1;
        }
        nv_hold(state);
        break;
    }
    case 8: {
        state->phase = 1;
        nv_hold(state);
        break;
    }
    case 12: {
        state->phase = 2;
        nv_hold(state);
        break;
    }
    case 15: {
        state->phase = 3;
        nv_hold(state);
        break;
    }
    case 20: {
        for (int32_t i = 0; i < 7; i++)
            state->signals[t0[i]] = 0.0;
        state->phase = 4;
        nv_hold(state);
        break;
    }
    default:
        break;
    }
}

/* The inputs and the noise of a step. */
static void nv_sense(written_state *state, const written_inputs *in)
{
    const int64_t k = state->k;
    double *WRITTEN_RESTRICT const x = state->variables;
    const double *const parameters = state->parameters;
    double *const v = state->vector;
    const double kd = (double)k;
    {
        const int32_t row = k < 4 ? (int32_t)k : 3;
        for (int32_t i = 0; i < 1; i++)
            v[0 + i] = x[78 + row*1 + i];
    }
    double n1 = 0.0625*kd*parameters[0];
    for (int32_t i = 0; i < 1; i++)
        v[1 + i] = n1;
    for (int32_t i = 0; i < 2; i++)
        v[2 + i] = in != NULL ? in->push[i] : 0.0;
    for (int32_t i = 0; i < 1; i++) {
        const double d2 = (0.0) + ((0.5*parameters[0]) - (0.0))*nv_uniform(UINT32_C(1631409953), UINT32_C(2619131899), (uint32_t)i, (uint32_t)k, 0);
        v[4 + i] = d2;
    }
}

static const unsigned char nv_gone[2][19] = {
    {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0},
};
static const int32_t nv_gone_at[5] = {0, 0, 0, 1, 0};
static const int64_t nv_lost[2][19] = {
    {-3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3},
    {20, 20, 20, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3, -3},
};
static const int32_t nv_lost_at[5] = {0, 0, 0, 0, 1};
static const unsigned char nv_still[2][19] = {
    {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0},
};
static const int32_t nv_still_at[5] = {0, 0, 0, 1, 0};
/* What a step computes. */
static void nv_compute(written_state *state)
{
    const int64_t k = state->k;
    double *WRITTEN_RESTRICT const activity = state->activity;
    double *WRITTEN_RESTRICT const weights = state->weights;
    double *WRITTEN_RESTRICT const signals = state->signals;
    double *WRITTEN_RESTRICT const history = state->history;
    double *WRITTEN_RESTRICT const x = state->variables;
    const double *WRITTEN_RESTRICT const s = state->vector;
    const double *WRITTEN_RESTRICT const holding = state->holding;
    const unsigned char *WRITTEN_RESTRICT const held = state->held;
    double *WRITTEN_RESTRICT const cells1_0 = state->cells + 0;
    double *WRITTEN_RESTRICT const cells1_1 = state->cells + 3;
    double *WRITTEN_RESTRICT const cells1_2 = state->cells + 6;
    double *WRITTEN_RESTRICT const cells2_0 = state->cells + 9;
    double *WRITTEN_RESTRICT const cells2_1 = state->cells + 10;
    double *WRITTEN_RESTRICT const cells2_2 = state->cells + 11;
    double *WRITTEN_RESTRICT const traces0_0 = state->traces + 0;
    double *WRITTEN_RESTRICT const traces0_1 = state->traces + 6;
    const unsigned char *const gone = nv_gone[nv_gone_at[state->phase]];
    const int64_t *const lost = nv_lost[nv_lost_at[state->phase]];
    const unsigned char *const still = nv_still[nv_still_at[state->phase]];
    const int32_t r2 = (int32_t)(k % 2);
    const int ends = (k + 1) % 4 == 0;
    const int32_t r3 = (int32_t)(k % 3);
    const double *const h2 = history + (size_t)((k + 1) % 3)*9;
    const int first = k == 0;
    {
        const double u1 = 0.0 + x[2] + s[2];
        const double y2 = nv_min(nv_max(x[0]*u1 + x[0]*u1*fabs(x[0]*u1), -2.0), 2.0);
        activity[0] = y2;
        if (held[0])
            activity[0] = holding[0];
    }
    {
        const double u3 = 0.0 + x[3] + s[3];
        const double y4 = nv_min(nv_max(x[0]*u3 + x[0]*u3*fabs(x[0]*u3), -2.0), 2.0);
        activity[1] = y4;
        if (held[1])
            activity[1] = holding[1];
    }
    {
        double u5 = 0.0;
        if (!gone[0]) {
            u5 += signals[5 + r2];
        }
        if (!gone[3]) {
            u5 += signals[11 + r2];
        }
        if (!gone[14]) {
            u5 += signals[0];
        }
        const double u6 = u5 + x[4] + s[1];
        const double m7 = x[69]*u6 - x[68]*cells1_0[0];
        const double n8 = cells1_0[0] + m7;
        const double n9 = cells1_1[0] + 1.0;
        const double y10 = nv_min(nv_max(0.5*n8 + 0.5*n8*fabs(0.5*n8), -x[1]), x[1]);
        const double y11 = y10 + 0.125*cells1_2[0];
        double e12 = n8;
        double e13 = n9;
        double e14 = cells1_2[0];
        if (ends) {
            const double n15 = e12/2.0;
            e12 = n15;
        }
        cells1_0[0] = e12;
        cells1_1[0] = e13;
        cells1_2[0] = e14;
        activity[2] = y11;
        if (held[2])
            activity[2] = holding[2];
    }
    {
        double u16 = 0.0;
        if (!gone[1]) {
            u16 += signals[7 + r2];
        }
        if (!gone[4]) {
            u16 += signals[13 + r2];
        }
        if (!gone[15]) {
            u16 += signals[1];
        }
        const double u17 = u16 + x[5] + s[1];
        const double m18 = x[70]*u17 - x[68]*cells1_0[1];
        const double n19 = cells1_0[1] + m18;
        const double n20 = cells1_1[1] + 1.0;
        const double y21 = nv_min(nv_max(0.5*n19 + 0.5*n19*fabs(0.5*n19), -x[1]), x[1]);
        const double y22 = y21 + 0.125*cells1_2[1];
        double e23 = n19;
        double e24 = n20;
        double e25 = cells1_2[1];
        if (ends) {
            const double n26 = e23/2.0;
            e23 = n26;
        }
        cells1_0[1] = e23;
        cells1_1[1] = e24;
        cells1_2[1] = e25;
        activity[3] = y22;
        if (held[3])
            activity[3] = holding[3];
    }
    {
        double u27 = 0.0;
        if (!gone[2]) {
            u27 += signals[9 + r2];
        }
        if (!gone[5]) {
            u27 += signals[15 + r2];
        }
        if (!gone[16]) {
            u27 += signals[2];
        }
        const double u28 = u27 + x[6] + s[1];
        const double m29 = x[71]*u28 - x[68]*cells1_0[2];
        const double n30 = cells1_0[2] + m29;
        const double n31 = cells1_1[2] + 1.0;
        const double y32 = nv_min(nv_max(0.5*n30 + 0.5*n30*fabs(0.5*n30), -x[1]), x[1]);
        const double y33 = y32 + 0.125*cells1_2[2];
        double e34 = n30;
        double e35 = n31;
        double e36 = cells1_2[2];
        if (ends) {
            const double n37 = e34/2.0;
            e34 = n37;
        }
        cells1_0[2] = e34;
        cells1_1[2] = e35;
        cells1_2[2] = e36;
        activity[4] = y33;
        if (held[4])
            activity[4] = holding[4];
    }
    {
        double u38 = 1.0;
        if (!gone[12]) {
            u38 *= signals[17 + r3];
        }
        if (!gone[13]) {
            u38 *= signals[20 + r3];
        }
        if (!gone[17]) {
            u38 *= signals[3];
        }
        if (!gone[18]) {
            u38 *= signals[4];
        }
        const double u39 = u38 + x[9] + s[4];
        const double m40 = 0.125*u39 - 0.25*cells2_0[0];
        const double n41 = cells2_0[0] + m40;
        const double n42 = cells2_1[0] + 1.0;
        const double y43 = nv_min(nv_max(0.25/n41, -1.0), 1.0);
        const double y44 = y43 + 0.125*cells2_2[0];
        double e45 = n41;
        double e46 = n42;
        double e47 = cells2_2[0];
        if (ends) {
            const double n48 = e45/2.0;
            e45 = n48;
        }
        cells2_0[0] = e45;
        cells2_1[0] = e46;
        cells2_2[0] = e47;
        activity[7] = y44;
        if (held[7])
            activity[7] = holding[7];
    }
    {
        const double u49 = 0.0 + x[10] + s[0];
        activity[8] = u49;
        if (held[8])
            activity[8] = holding[8];
    }
    {
        if (first) {
            activity[5] = 0.5;
        } else {
            double u50 = 0.0;
            if (!gone[6]) {
                const double d51 = weights[6]*activity[2] - x[17];
                u50 += d51*d51;
            }
            if (!gone[8]) {
                const double d52 = weights[8]*activity[3] - x[19];
                u50 += d52*d52;
            }
            if (!gone[10]) {
                const double d53 = weights[10]*activity[4] - x[21];
                u50 += d53*d53;
            }
            const double u54 = sqrt(u50) + x[7];
            const double y55 = nv_min(nv_max(0.25/u54, -1.0), 1.0);
            activity[5] = y55;
        }
        if (held[5])
            activity[5] = holding[5];
    }
    {
        if (first) {
            activity[6] = 0.5;
        } else {
            double u56 = 0.0;
            if (!gone[7]) {
                const double d57 = weights[7]*activity[2] - x[18];
                u56 += d57*d57;
            }
            if (!gone[9]) {
                const double d58 = weights[9]*activity[3] - x[20];
                u56 += d58*d58;
            }
            if (!gone[11]) {
                const double d59 = weights[11]*activity[4] - x[22];
                u56 += d59*d59;
            }
            const double u60 = sqrt(u56) + x[8];
            const double y61 = nv_min(nv_max(0.25/u60, -1.0), 1.0);
            activity[6] = y61;
        }
        if (held[6])
            activity[6] = holding[6];
    }
    signals[0] = weights[14]*activity[2];
    signals[1] = weights[15]*activity[3];
    signals[2] = weights[16]*activity[4];
    signals[3] = weights[17]*activity[0];
    signals[4] = weights[18]*activity[1];
    signals[5 + r2] = weights[0]*activity[0];
    signals[7 + r2] = weights[1]*activity[0];
    signals[9 + r2] = weights[2]*activity[0];
    signals[11 + r2] = weights[3]*activity[1];
    signals[13 + r2] = weights[4]*activity[1];
    signals[15 + r2] = weights[5]*activity[1];
    signals[17 + r3] = weights[12]*activity[5];
    signals[20 + r3] = weights[13]*activity[6];
    memcpy(history + (size_t)(k % 3)*9, activity, 9*sizeof(activity[0]));
    {
        if (!still[0]) {
            const double a62 = k - (2) < lost[0] ? 0.0 : h2[0];
            const double m63 = activity[8] - activity[2];
            const double n64 = 0.5*traces0_0[0] + a62;
            const double n65 = nv_max(traces0_1[0], activity[2]);
            const double n66 = weights[0] + x[72]*m63*traces0_0[0];
            const double n67 = nv_min(nv_max(n66, x[49]), x[30]);
            double e68 = n64;
            double e69 = n65;
            double e70 = n67;
            if (ends) {
                const double n71 = e70*0.75;
                e69 = 0.0;
                e70 = n71;
                const double n72 = nv_min(nv_max(e70, x[49]), x[30]);
                e70 = n72;
            }
            traces0_0[0] = e68;
            traces0_1[0] = e69;
            weights[0] = e70;
        }
    }
    {
        if (!still[1]) {
            const double a73 = k - (2) < lost[1] ? 0.0 : h2[0];
            const double m74 = activity[8] - activity[3];
            const double n75 = 0.5*traces0_0[1] + a73;
            const double n76 = nv_max(traces0_1[1], activity[3]);
            const double n77 = weights[1] + x[72]*m74*traces0_0[1];
            const double n78 = nv_min(nv_max(n77, x[50]), x[31]);
            double e79 = n75;
            double e80 = n76;
            double e81 = n78;
            if (ends) {
                const double n82 = e81*0.75;
                e80 = 0.0;
                e81 = n82;
                const double n83 = nv_min(nv_max(e81, x[50]), x[31]);
                e81 = n83;
            }
            traces0_0[1] = e79;
            traces0_1[1] = e80;
            weights[1] = e81;
        }
    }
    {
        if (!still[2]) {
            const double a84 = k - (2) < lost[2] ? 0.0 : h2[0];
            const double m85 = activity[8] - activity[4];
            const double n86 = 0.5*traces0_0[2] + a84;
            const double n87 = nv_max(traces0_1[2], activity[4]);
            const double n88 = weights[2] + x[72]*m85*traces0_0[2];
            const double n89 = nv_min(nv_max(n88, x[51]), x[32]);
            double e90 = n86;
            double e91 = n87;
            double e92 = n89;
            if (ends) {
                const double n93 = e92*0.75;
                e91 = 0.0;
                e92 = n93;
                const double n94 = nv_min(nv_max(e92, x[51]), x[32]);
                e92 = n94;
            }
            traces0_0[2] = e90;
            traces0_1[2] = e91;
            weights[2] = e92;
        }
    }
    {
        if (!still[3]) {
            const double a95 = k - (2) < lost[3] ? 0.0 : h2[1];
            const double m96 = activity[8] - activity[2];
            const double n97 = 0.5*traces0_0[3] + a95;
            const double n98 = nv_max(traces0_1[3], activity[2]);
            const double n99 = weights[3] + x[72]*m96*traces0_0[3];
            const double n100 = nv_min(nv_max(n99, x[52]), x[33]);
            double e101 = n97;
            double e102 = n98;
            double e103 = n100;
            if (ends) {
                const double n104 = e103*0.75;
                e102 = 0.0;
                e103 = n104;
                const double n105 = nv_min(nv_max(e103, x[52]), x[33]);
                e103 = n105;
            }
            traces0_0[3] = e101;
            traces0_1[3] = e102;
            weights[3] = e103;
        }
    }
    {
        if (!still[4]) {
            const double a106 = k - (2) < lost[4] ? 0.0 : h2[1];
            const double m107 = activity[8] - activity[3];
            const double n108 = 0.5*traces0_0[4] + a106;
            const double n109 = nv_max(traces0_1[4], activity[3]);
            const double n110 = weights[4] + x[72]*m107*traces0_0[4];
            const double n111 = nv_min(nv_max(n110, x[53]), x[34]);
            double e112 = n108;
            double e113 = n109;
            double e114 = n111;
            if (ends) {
                const double n115 = e114*0.75;
                e113 = 0.0;
                e114 = n115;
                const double n116 = nv_min(nv_max(e114, x[53]), x[34]);
                e114 = n116;
            }
            traces0_0[4] = e112;
            traces0_1[4] = e113;
            weights[4] = e114;
        }
    }
    {
        if (!still[5]) {
            const double a117 = k - (2) < lost[5] ? 0.0 : h2[1];
            const double m118 = activity[8] - activity[4];
            const double n119 = 0.5*traces0_0[5] + a117;
            const double n120 = nv_max(traces0_1[5], activity[4]);
            const double n121 = weights[5] + x[72]*m118*traces0_0[5];
            const double n122 = nv_min(nv_max(n121, x[54]), x[35]);
            double e123 = n119;
            double e124 = n120;
            double e125 = n122;
            if (ends) {
                const double n126 = e125*0.75;
                e124 = 0.0;
                e125 = n126;
                const double n127 = nv_min(nv_max(e125, x[54]), x[35]);
                e125 = n127;
            }
            traces0_0[5] = e123;
            traces0_1[5] = e124;
            weights[5] = e125;
        }
    }
    {
        if (!still[12]) {
            const double n128 = weights[12] + x[73]*(activity[5] - weights[12]);
            const double n129 = nv_min(nv_max(n128, x[61]), x[42]);
            weights[12] = n129;
        }
    }
    {
        if (!still[13]) {
            const double n130 = weights[13] + x[74]*(activity[6] - weights[13]);
            const double n131 = nv_min(nv_max(n130, x[62]), x[43]);
            weights[13] = n131;
        }
    }
    {
        if (!still[14]) {
            const double n132 = weights[14] + x[75]*(activity[2] - weights[14]);
            const double n133 = nv_min(nv_max(n132, x[63]), x[44]);
            weights[14] = n133;
        }
    }
    {
        if (!still[15]) {
            const double n134 = weights[15] + x[76]*(activity[3] - weights[15]);
            const double n135 = nv_min(nv_max(n134, x[64]), x[45]);
            weights[15] = n135;
        }
    }
    {
        if (!still[16]) {
            const double n136 = weights[16] + x[77]*(activity[4] - weights[16]);
            const double n137 = nv_min(nv_max(n136, x[65]), x[46]);
            weights[16] = n137;
        }
    }
}

void written_init(written_state *state)
{
    memset(state->activity, 0, sizeof state->activity);
    memcpy(state->weights, t1, sizeof state->weights);
    memset(state->signals, 0, sizeof state->signals);
    memset(state->history, 0, sizeof state->history);
    memcpy(state->cells, t2, sizeof state->cells);
    memcpy(state->traces, t3, sizeof state->traces);
    memcpy(state->parameters, t4, sizeof state->parameters);
    memcpy(state->variables, t5, sizeof state->variables);
    memset(state->vector, 0, sizeof state->vector);
    memset(state->holding, 0, sizeof state->holding);
    state->k = 0;
    memset(state->chosen, 0, sizeof state->chosen);
    state->phase = 0;
    nv_hold(state);
    nv_events(state);
}

void written_step(written_state *state, const written_inputs *in, written_outputs *out)
{
    nv_sense(state, in);
    nv_compute(state);
    state->k++;
    nv_events(state);
    if (out != NULL) {
        for (int32_t i = 0; i < 2; i++)
            out->all[i] = state->activity[5 + i];
        for (int32_t i = 0; i < 3; i++)
            out->levels[i] = state->cells[i];
        for (int32_t i = 0; i < 6; i++)
            out->fading[i] = state->traces[i];
    }
}

int written_set_gain(written_state *state, double value)
{
    double parameters[3];
    unsigned char changed[3];
    memcpy(parameters, state->parameters, sizeof parameters);
    memset(changed, 0, sizeof changed);
    parameters[0] = value;
    changed[0] = 1;
    if (!nv_follow(state, parameters, changed))
        return 0;
    state->chosen[0] = 1;
    nv_hold(state);
    return 1;
}

int written_set_half(written_state *state, double value)
{
    double parameters[3];
    unsigned char changed[3];
    memcpy(parameters, state->parameters, sizeof parameters);
    memset(changed, 0, sizeof changed);
    parameters[1] = value;
    changed[1] = 1;
    if (!nv_follow(state, parameters, changed))
        return 0;
    state->chosen[1] = 1;
    nv_hold(state);
    return 1;
}

int written_set_reach(written_state *state, double value)
{
    double parameters[3];
    unsigned char changed[3];
    memcpy(parameters, state->parameters, sizeof parameters);
    memset(changed, 0, sizeof changed);
    parameters[2] = value;
    changed[2] = 1;
    if (!nv_follow(state, parameters, changed))
        return 0;
    state->chosen[2] = 1;
    nv_hold(state);
    return 1;
}
