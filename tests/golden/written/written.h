/*
 * written
 *
 * A network of 9 neurons and 19 connections, made by neurovis export. C99 and C++17; needs libm.
 */
#ifndef WRITTEN_H
#define WRITTEN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define WRITTEN_NEURONS 9
#define WRITTEN_CONNECTIONS 19
#define WRITTEN_SPEC_HASH "c825af31b4e48347a0405e0f46857923dcd95d8bd6def1f9246c02866b307c7e"

/* The names of the neurons, in order. */
extern const char *const written_neuron_names[9];

/* All that changes. Copy it to keep a state, and copy it back to go on from there. */
typedef struct written_state {
    double activity[9]; /* a[k - 1] of all neurons */
    double weights[19]; /* w[k] of all connections */
    double signals[23]; /* what is under way on delayed connections */
    double history[27]; /* past activities, for rules */
    double cells[12]; /* states of models */
    double traces[12]; /* states of rules */
    double parameters[3]; /* parameters of the spec and of its instances */
    double variables[82]; /* numbers that follow parameters */
    double vector[5]; /* the inputs and the noise of a step */
    double holding[9]; /* what neurons are held at */
    int64_t k; /* the step to come */
    unsigned char chosen[3]; /* parameters that were set */
    int32_t phase; /* events that have happened */
    unsigned char held[9]; /* neurons that are held */
} written_state;

/* The inputs of a step that have no source of their own. */
typedef struct written_inputs {
    double push[2];
} written_inputs;

/* The outputs of a step. */
typedef struct written_outputs {
    double all[2];
    double levels[3];
    double fading[6];
} written_outputs;

/* Make a state ready for step 0, whatever its memory holds. */
void written_init(written_state *state);

/* Make one step. in may be NULL: its inputs are 0. out may be NULL. */
void written_step(written_state *state, const written_inputs *in, written_outputs *out);

/* Set the parameter gain from the next step on, and what follows it. Gives 1; or
   0, and nothing has changed, where a number would not be finite or leave its bounds. */
int written_set_gain(written_state *state, double value);

/* Set the parameter half from the next step on, and what follows it. Gives 1; or
   0, and nothing has changed, where a number would not be finite or leave its bounds. */
int written_set_half(written_state *state, double value);

/* Set the parameter reach from the next step on, and what follows it. Gives 1; or
   0, and nothing has changed, where a number would not be finite or leave its bounds. */
int written_set_reach(written_state *state, double value);

#ifdef __cplusplus
}
#endif

#endif
