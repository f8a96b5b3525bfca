// SPDX-License-Identifier: Apache-2.0
// Rigid bodies: the parent's end. Steps become courses as they come in.
#include "render/sim_rigid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/child.h"
#include "render/plugin.h"
#include "render/sim_ode.h"

enum { AT_ONCE = 256 }; // pieces after which they are joined, to bound memory

// The latest steps of a member. A step's piece is made when the next one is there, whose velocity
// says how fast the body is in between.
typedef struct {
    RigidState state[4]; // step k at k % 4
    bool jumps[4];
    SimCourse course;
    uint32_t first; // of the pieces of the arc at hand
} Member;

typedef struct {
    const SimRigid *sim;
    Member *members;
    Child child;
} Run;

const char *sim_rigid_library(void) {
    return "ODE 0.16, driver 7";
}

// ---- Courses

static const RigidState *state_of(const Member *m, uint64_t step) {
    return &m->state[step % 4];
}

static double rate(const Member *m, uint64_t step, int k) { // columns 0..2: place, 3..5: spin
    const RigidState *s = state_of(m, step);
    return k < 3 ? s->velocity[k] : s->spin[k - 3];
}

static bool is_free(const Member *m, uint64_t step) {
    return !state_of(m, step)->touches;
}

// How fast at one end of step k, which is free: between it and the one beside it, after or before;
// where that one is not free, as fast as what is known on this side says.
static void rates_at_end(const Member *m, uint64_t k, uint64_t last, bool is_late, double out[6]) {
    uint64_t beside = is_late ? k + 1 : k - 1, other = is_late ? k - 1 : k + 1;
    bool has_beside = (is_late ? k < last : k > 1) && is_free(m, beside);
    bool has_other = (is_late ? k > 1 : k < last) && is_free(m, other);
    for (int i = 0; i < 6; i++) {
        double own = rate(m, k, i);
        out[i] = has_beside  ? (own + rate(m, beside, i)) / 2
                 : has_other ? own + (own - rate(m, other, i)) / 2
                             : own;
    }
}

// d q / dt = spin * q / 2
static void turn_rate(const double q[4], const double w[3], double out[4]) {
    out[0] = (w[0] * q[3] + w[1] * q[2] - w[2] * q[1]) / 2;
    out[1] = (w[1] * q[3] + w[2] * q[0] - w[0] * q[2]) / 2;
    out[2] = (w[2] * q[3] + w[0] * q[1] - w[1] * q[0]) / 2;
    out[3] = -(w[0] * q[0] + w[1] * q[1] + w[2] * q[2]) / 2;
}

static void node(const RigidState *s, double out[RIGID_COLUMNS]) {
    memcpy(out, s->at, sizeof s->at);
    memcpy(out + 3, s->turn, sizeof s->turn);
}

static double time_of(const Run *run, uint64_t step) {
    return fmin(run->sim->low + (double)step * run->sim->step, run->sim->high);
}

static void end_arc(const Run *run, Member *m) {
    sim_course_merge(&m->course, m->first, run->sim->tolerance);
    m->first = m->course.n;
}

static void add_piece(const Run *run, Member *m, uint64_t k, uint64_t last) {
    const RigidState *before = state_of(m, k - 1), *after = state_of(m, k);
    double h = run->sim->step, from[RIGID_COLUMNS], to[RIGID_COLUMNS];
    double rates[2][6], d_from[RIGID_COLUMNS], d_to[RIGID_COLUMNS];
    bool begins = k == 1 || m->jumps[k % 4] || m->jumps[(k - 1) % 4];
    if (begins || m->course.n - m->first >= AT_ONCE) {
        end_arc(run, m);
    }
    SimPiece piece = {time_of(run, k - 1), time_of(run, k), begins};
    double *c = piece.end > piece.start ? sim_course_add(&m->course, piece, NULL) : NULL;
    if (!c) {
        return;
    }
    node(before, from);
    node(after, to);
    bool is_curved = is_free(m, k) && !after->sleeps;
    if (is_curved) {
        rates_at_end(m, k, last, false, rates[0]);
        rates_at_end(m, k, last, true, rates[1]);
        memcpy(d_from, rates[0], 3 * sizeof *d_from);
        memcpy(d_to, rates[1], 3 * sizeof *d_to);
        turn_rate(before->turn, rates[0] + 3, d_from + 3);
        turn_rate(after->turn, rates[1] + 3, d_to + 3);
    }
    double part = (piece.end - piece.start) / h; // the last step may be cut off
    for (int i = 0; i < RIGID_COLUMNS; i++) {
        double rise = to[i] - from[i], a = is_curved ? d_from[i] * h : rise;
        double b = is_curved ? d_to[i] * h : rise;
        c[i * SIM_COEFFICIENTS] = from[i];
        c[i * SIM_COEFFICIENTS + 1] = a * part;
        c[i * SIM_COEFFICIENTS + 2] = (3 * rise - 2 * a - b) * part * part;
        c[i * SIM_COEFFICIENTS + 3] = (a + b - 2 * rise) * part * part * part;
    }
}

// A step has come in.
static void take(const Run *run, Member *m, uint64_t k, RigidState state) {
    const RigidState *before = state_of(m, k + 3);
    double dot = 0, jump = 0;
    for (int i = 0; i < 4 && k > 0; i++) {
        dot += state.turn[i] * before->turn[i];
    }
    for (int i = 0; i < 4 && dot < 0; i++) {
        state.turn[i] = -state.turn[i]; // the same rotation, the nearer quaternion
    }
    for (int i = 0; i < 3 && k > 1; i++) {
        double change =
            state.velocity[i] - before->velocity[i] - run->sim->gravity[i] * run->sim->step;
        jump += change * change;
    }
    m->state[k % 4] = state;
    m->jumps[k % 4] = k > 1 && state.touches && jump > RIGID_JUMP * RIGID_JUMP;
    if (k > 1) {
        add_piece(run, m, k - 1, k);
    }
}

uint64_t sim_rigid_steps(const SimRigid *sim) {
    return (uint64_t)fmax(2, ceil((sim->high - sim->low) / sim->step - 1e-9));
}

// ---- The child

static void simulate(const void *argument, int fd) {
    const SimRigid *sim = argument;
    char message[SIM_MESSAGE];
    int (*send)(const SimRigid *, uint64_t, RigidEvaluate *, int);
    void *symbol = plugin_symbol("st4-ode.so", "sim_ode_send", message, sizeof message);
    if (!symbol) {
        RigidStep refusal = {.magic = RIGID_STREAM_MAGIC, .is_bad = 1, .member = UINT32_MAX};
        snprintf(refusal.message, sizeof refusal.message, "%.90s", message);
        ssize_t put = write(fd, &refusal, sizeof refusal);
        (void)put;
        return;
    }
    // POSIX: a pointer from dlsym may be copied into one to a function.
    memcpy(&send, &symbol, sizeof symbol);
    send(sim, sim_rigid_steps(sim), program_run1, fd);
}

// It ended early: where the members were last tells whose fault it is.
static void explain(const Run *run, uint64_t step, SimFailure *failure) {
    double most = -1;
    *failure = (SimFailure){.member = UINT32_MAX, .time = time_of(run, step)};
    for (uint32_t m = 0; m < run->sim->n_members && step > 0; m++) {
        const double *v = state_of(&run->members[m], step - 1)->velocity;
        double speed = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        if (!(speed <= most)) {
            most = speed;
            failure->member = m;
        }
    }
    snprintf(failure->message, sizeof failure->message,
             "the engine gives up, or takes too long, where this body is the fastest: a shorter "
             "step may help");
}

// All steps; false: *failure says why.
static bool follow(Run *run, SimProgress *progress, void *context, SimFailure *failure) {
    const SimRigid *sim = run->sim;
    const uint64_t n_steps = sim_rigid_steps(sim);
    for (uint64_t k = 0; k <= n_steps; k++) {
        RigidStep step;
        bool is_fine = child_receive(&run->child, &step, sizeof step);
        if (is_fine && (step.magic != RIGID_STREAM_MAGIC || step.is_bad)) {
            step.message[sizeof step.message - 1] = '\0';
            *failure = (SimFailure){.member = step.member, .time = step.time};
            snprintf(failure->message, sizeof failure->message, "%s", step.message);
            return false;
        }
        for (uint32_t m = 0; is_fine && m < sim->n_members; m++) {
            RigidState state;
            is_fine = child_receive(&run->child, &state, sizeof state);
            if (is_fine) {
                take(run, &run->members[m], k, state);
            }
        }
        if (!is_fine) {
            explain(run, k, failure);
            return false;
        }
        if (progress) {
            progress(context, (double)k / (double)n_steps);
        }
    }
    for (uint32_t m = 0; m < sim->n_members; m++) {
        add_piece(run, &run->members[m], n_steps, n_steps);
        end_arc(run, &run->members[m]);
    }
    return true;
}

static bool join(Arena *arena, Run *run, SimTracks *tracks, SimFailure *failure) {
    uint32_t n = run->sim->n_members;
    double *times[4];
    const double value[4] = {run->sim->low, run->sim->high, -INFINITY, INFINITY};
    SimCourse *courses = ARENA_ARRAY(arena, n, SimCourse);
    bool is_fine = true;
    for (int i = 0; i < 4; i++) {
        times[i] = ARENA_ARRAY(arena, n, double);
        for (uint32_t m = 0; m < n; m++) {
            times[i][m] = value[i];
        }
    }
    for (uint32_t m = 0; m < n; m++) {
        courses[m] = run->members[m].course;
        is_fine = is_fine && !courses[m].is_failed;
    }
    *tracks = (SimTracks){.n_members = n,
                          .low = run->sim->low,
                          .high = run->sim->high,
                          .birth = times[0],
                          .end = times[1],
                          .born = times[2],
                          .dies = times[3]};
    if (!is_fine || !sim_tracks_join(arena, courses, tracks)) {
        *failure = (SimFailure){UINT32_MAX, run->sim->low, "there is no memory for its courses"};
        return false;
    }
    return true;
}

bool sim_rigid_run(Arena *arena, const SimRigid *sim, SimProgress *progress, void *context,
                   SimTracks *tracks, SimFailure *failure) {
    Run run = {.sim = sim, .members = calloc(sim->n_members, sizeof(Member))};
    *failure = (SimFailure){UINT32_MAX, sim->low, "it cannot be started"};
    for (uint32_t m = 0; run.members && m < sim->n_members; m++) {
        run.members[m].course =
            (SimCourse){.n_columns = RIGID_COLUMNS, .n_coefficients = SIM_COEFFICIENTS};
    }
    const ChildLimits limits = {.memory = (size_t)2 << 30, .seconds = sim->limit};
    bool is_started = run.members && child_start(&run.child, simulate, sim, &limits);
    bool is_fine = is_started && follow(&run, progress, context, failure);
    if (is_started) {
        child_stop(&run.child, is_fine);
    }
    is_fine = is_fine && join(arena, &run, tracks, failure);
    for (uint32_t m = 0; run.members && m < sim->n_members; m++) {
        sim_course_free(&run.members[m].course);
    }
    free(run.members);
    return is_fine;
}
