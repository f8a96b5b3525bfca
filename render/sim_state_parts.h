// SPDX-License-Identifier: Apache-2.0
// Inside of simulations by equations, shared by their files (render/sim_state.c,
// render/sim_crowd.c).
#ifndef RENDER_SIM_STATE_PARTS_H
#define RENDER_SIM_STATE_PARTS_H

#include <float.h>
#include <math.h>

#include "render/sim_state.h"

// What one member's run came to.
typedef struct {
    bool is_resting;
    double rest_time;
} SimRest;

// What the runs of all members come to.
typedef struct {
    const SimState *sim;
    SimCourse *courses; // [n_members]
    double *birth, *end, *born, *dies;
    double *stops; // [n_stops] where a stiff coupled system stops, in order; NULL: there is none
    uint32_t n_stops;
    SimRest *rests;
    SimProgress *progress;
    void *context;
    SimFailure *failure;
    bool is_failed;
} SimRun;

// The instants of a member's latest events, in a ring.
typedef struct {
    double at[SIM_STATE_EVENTS];
    uint32_t n;
} SimEvents;

// Adds an event; whether there are too many of them in too short a time.
static inline bool events_are_too_many(const SimState *sim, SimEvents *events, double t) {
    double window = fmin(1e-3, 1e-4 * (sim->high - sim->low));
    double *oldest = &events->at[events->n % SIM_STATE_EVENTS];
    bool is = events->n >= SIM_STATE_EVENTS && t - *oldest < window;
    *oldest = t;
    events->n++;
    return is;
}

// Each of the failures of a run is that of the first member, on any machine. Returns false.
bool sim_run_fail(SimRun *run, uint32_t member, double t, const char *message);

// What is done, by the time that a common run has come to.
static inline void sim_run_tell(const SimRun *run, double t) {
    if (run->progress) {
        run->progress(run->context, (t - run->sim->low) / (run->sim->high - run->sim->low));
    }
}

// A piece in which a member's states are y[0], y[stride]...: nothing, where it has no length.
void sim_run_add_still(SimRun *run, uint32_t member, const double *y, size_t stride, double from,
                       double to);

// The pieces of a member from `first` on, which are an arc, become fewer; returns where those of
// the next one begin.
uint32_t sim_run_end_arc(SimRun *run, uint32_t member, uint32_t first);

// Whether a rate jumps, so that the course has a corner.
static inline bool sim_run_bends(const SimState *sim, double before, double after) {
    return !(fabs(after - before) <= sim->tolerance * fmax(1, fabs(before)));
}

// What is told to who wrote the equations.
#define SIM_NO_START   "its start values are not finite numbers"
#define SIM_NOT_FINITE "its rates are not finite numbers"
#define SIM_BAD_EVENT  "an event gives it values that are not finite numbers"
#define SIM_NO_LONGER                                                                              \
    "its equations cannot be integrated any further: they grow without bound, or change too fast"
#define SIM_TOO_TINY "its equations grow without bound, or change too fast to be followed"
#define SIM_TOO_MANY_STEPS                                                                         \
    "it takes more than four million steps: a larger tolerance, or stiff = true, may help"
#define SIM_NO_MEMORY "there is no memory for it"
enum { SIM_MOST_TINY = 20000 }; // steps of less than a billionth of the span

#endif
