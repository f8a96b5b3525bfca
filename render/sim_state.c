// SPDX-License-Identifier: Apache-2.0
// Simulations by equations: members over time, their events, all of them together.
#include "render/sim_state.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/sim_system.h"

// What one member's or all members' run came to.
typedef struct {
    bool is_resting;
    double rest_time;
} Rest;

typedef struct {
    const SimState *sim;
    SimCourse *courses; // [n_members]
    double *birth, *end, *born, *dies;
    Rest *rests;
    SimFailure *failure;
    bool is_failed;
} Run;

// The instants of a member's latest events, in a ring.
typedef struct {
    double at[SIM_STATE_EVENTS];
    uint32_t n;
} Events;

// Of a system that is being followed.
typedef struct {
    Events *events;      // [n]
    uint32_t *first;     // [n] of the pieces of the arc at hand
    uint8_t *begins;     // [n] an arc begins with the next piece
    uint8_t *is_resting; // [n]
    uint8_t *fires;      // [n_whens][n]
    double *conditions;  // [2][n_whens][n]
    uint32_t n_resting;
} State;

// ---- Courses

static void add_pieces(Run *run, SimSystem *system, State *state, double from, double to) {
    uint32_t n_states = run->sim->n_states;
    for (uint32_t j = 0; j < system->n; j++) {
        SimCourse *course = &run->courses[system->first + j];
        double *c = sim_course_add(course, (SimPiece){from, to, state->begins[j]}, NULL);
        state->begins[j] = 0;
        for (uint32_t k = 0; c && k < n_states; k++) {
            memcpy(c + (size_t)k * SIM_COEFFICIENTS, sim_system_fit(system, k * system->n + j),
                   SIM_COEFFICIENTS * sizeof *c);
        }
    }
}

// Pieces from the time `from` to the system's: halves, where one is too far from the solution.
static bool add_step(Run *run, SimSystem *system, State *state, double from, double to, int depth) {
    enum { MAX_DEPTH = 20 };
    if (!sim_system_interpolate(system, from, to)) {
        return false;
    }
    if (depth >= MAX_DEPTH || sim_system_miss(system) <= 0.25 * run->sim->tolerance) {
        add_pieces(run, system, state, from, to);
        return true;
    }
    double middle = from + (to - from) / 2;
    return add_step(run, system, state, from, middle, depth + 1) &&
           add_step(run, system, state, middle, to, depth + 1);
}

static void add_still(Run *run, SimSystem *system, uint32_t j, double from, double to) {
    SimCourse *course = &run->courses[system->first + j];
    double *c = to > from ? sim_course_add(course, (SimPiece){from, to, true}, NULL) : NULL;
    for (uint32_t k = 0; c && k < run->sim->n_states; k++) {
        c[(size_t)k * SIM_COEFFICIENTS] = system->y[k * system->n + j];
    }
}

// The arc of member j has ended.
static void end_arc(Run *run, SimSystem *system, State *state, uint32_t j) {
    SimCourse *course = &run->courses[system->first + j];
    sim_course_merge(course, state->first[j], 0.5 * run->sim->tolerance);
    state->first[j] = course->n;
    state->begins[j] = 1;
}

// ---- Events

static bool is_too_many(const Run *run, Events *events, double t) {
    double window = fmin(1e-3, 1e-4 * (run->sim->high - run->sim->low));
    double *oldest = &events->at[events->n % SIM_STATE_EVENTS];
    bool is = events->n >= SIM_STATE_EVENTS && t - *oldest < window;
    *oldest = t;
    events->n++;
    return is;
}

static bool fail(Run *run, const SimSystem *system, double t, const char *message) {
#pragma omp critical(sim_state_failure)
    if (!run->is_failed || system->first < run->failure->member) { // the same one on any machine
        run->is_failed = true;
        run->failure->member = system->first + system->bad_member;
        run->failure->time = t;
        snprintf(run->failure->message, sizeof run->failure->message, "%s", message);
    }
    return false;
}

// Members to whom something happens at t begin a new arc; one of too many events rests.
static void interrupt(Run *run, SimSystem *system, State *state, double t) {
    for (uint32_t j = 0; j < system->n; j++) {
        bool is_hit = false;
        for (uint32_t w = 0; w < run->sim->n_whens; w++) {
            is_hit = is_hit || state->fires[(size_t)w * system->n + j];
        }
        if (!is_hit || state->is_resting[j]) {
            continue;
        }
        if (!state->begins[j]) {
            end_arc(run, system, state, j);
        }
        if (is_too_many(run, &state->events[j], t)) {
            state->is_resting[j] = 1;
            state->n_resting++;
            run->rests[system->first + j] = (Rest){true, t};
            sim_system_rest(system, j);
        }
    }
}

// What happened at t, then what that brings about. What goes round in circles comes to rest, since
// each round counts.
static void happen(Run *run, SimSystem *system, State *state, double t) {
    size_t n = (size_t)run->sim->n_whens * system->n;
    double *before = state->conditions, *after = before + n;
    bool fires_again = true;
    for (size_t i = 0; i < n; i++) {
        state->fires[i] = system->roots[i] != 0;
    }
    while (fires_again) {
        interrupt(run, system, state, t);
        for (size_t i = 0; i < n; i++) {
            state->fires[i] = state->fires[i] && !state->is_resting[i % system->n];
        }
        sim_system_conditions(system, t, before);
        sim_system_assign(system, t, state->fires);
        sim_system_conditions(system, t, after);
        fires_again = false;
        for (size_t i = 0; i < n; i++) {
            state->fires[i] = !state->fires[i] && before[i] >= 0 && after[i] < 0;
            fires_again = fires_again || state->fires[i];
        }
    }
}

// From the system's birth to its end.
static bool follow(Run *run, SimSystem *system, State *state, double from, double to) {
    enum { MOST_TINY = 20000 }; // steps of less than a billionth of the span
    double t = from;
    double span = run->sim->high - run->sim->low, last_event = from;
    uint64_t n_steps = 0, n_tiny = 0;
    sim_system_restart(system, t, to, INFINITY);
    while (t < to && state->n_resting < system->n) {
        double before = t;
        SimStep step = sim_system_step(system, &t);
        if (step == SIM_STEP_FAILED) {
            return fail(run, system, t, system->message);
        }
        n_tiny += t - before < 1e-9 * span && step == SIM_STEP_ON;
        if (n_tiny > MOST_TINY) {
            return fail(run, system, t,
                        "its equations grow without bound, or change too fast to be followed");
        }
        if (++n_steps > SIM_STATE_STEPS) {
            return fail(run, system, t,
                        "it takes more than four million steps: a longer tolerance, or "
                        "stiff = true, may help");
        }
        if (t > before && !add_step(run, system, state, before, t, 0)) {
            return fail(run, system, t, "its course cannot be followed");
        }
        if (step == SIM_STEP_EVENT) {
            happen(run, system, state, t);
            sim_system_restart(system, t, to, (t - last_event) / 16);
            last_event = t;
        }
    }
    for (uint32_t j = 0; j < system->n; j++) {
        end_arc(run, system, state, j);
        add_still(run, system, j, t, to);
    }
    return true;
}

// ---- Members

static bool run_system(Run *run, SimSystem *system) {
    const SimState *sim = run->sim;
    double from = run->birth[system->first], to = run->end[system->first];
    for (uint32_t j = 0; j < system->n; j++) {
        run->courses[system->first + j] =
            (SimCourse){.n_columns = sim->n_states, .n_coefficients = SIM_COEFFICIENTS};
    }
    if (!sim_system_start(system)) {
        return fail(run, system, from, system->message);
    }
    if (!(from < to)) { // it is never there within the span
        add_still(run, system, 0, sim->low, sim->high);
        return true;
    }
    size_t n_conditions = (size_t)sim->n_whens * system->n;
    State state = {.events = calloc(system->n, sizeof(Events)),
                   .first = calloc(system->n, sizeof(uint32_t)),
                   .begins = malloc(system->n),
                   .is_resting = calloc(system->n, 1),
                   .fires = calloc(n_conditions + 1, 1),
                   .conditions = calloc(2 * n_conditions + 1, sizeof(double))};
    bool is_fine = state.events && state.first && state.begins && state.is_resting && state.fires &&
                   state.conditions;
    if (state.begins) {
        memset(state.begins, 1, system->n);
    }
    is_fine = is_fine ? follow(run, system, &state, from, to)
                      : fail(run, system, from, "there is no memory for it");
    for (uint32_t j = 0; j < system->n && is_fine; j++) {
        if (run->courses[system->first + j].is_failed) {
            is_fine = fail(run, system, from, "there is no memory for its course");
        }
    }
    free(state.events);
    free(state.first);
    free(state.begins);
    free(state.is_resting);
    free(state.fires);
    free(state.conditions);
    return is_fine;
}

static bool run_all(Run *run, SimProgress *progress, void *context) {
    const SimState *sim = run->sim;
    uint32_t n_systems = sim->is_coupled ? 1 : sim->n_members, n_done = 0;
#pragma omp parallel if (n_systems > 1)
    {
        SimSystem *system = sim_system_new(sim, sim->is_coupled ? sim->n_members : 1);
#pragma omp for schedule(dynamic, 1)
        for (uint32_t i = 0; i < n_systems; i++) {
            bool is_off;
#pragma omp atomic read
            is_off = run->is_failed;
            if (!system) {
                SimSystem none = {.first = i};
                fail(run, &none, sim->low, "there is no memory for it");
            } else if (!is_off) {
                system->first = i;
                run_system(run, system);
            }
#pragma omp critical(sim_state_progress)
            if (progress) {
                progress(context, (double)++n_done / n_systems);
            }
        }
        sim_system_free(system);
    }
    return !run->is_failed;
}

// When each member is there, and for which part of the span it is followed.
static bool find_lives(Run *run) {
    const SimState *sim = run->sim;
    for (uint32_t m = 0; m < sim->n_members; m++) {
        double life[2] = {-INFINITY, INFINITY}, in[IN_COUNT] = {[IN_I] = m};
        if (sim->life) {
            program_run1(sim->life, in, life);
        }
        if (isnan(life[0]) || isnan(life[1])) {
            *run->failure = (SimFailure){m, sim->low, "born or dies is not a number"};
            return false;
        }
        run->born[m] = life[0];
        run->dies[m] = life[1];
        run->birth[m] = fmax(life[0], sim->low);
        run->end[m] = fmin(life[1], sim->high);
        if (!(run->birth[m] < run->end[m])) {
            run->birth[m] = sim->low;
            run->end[m] = sim->low;
        }
    }
    return true;
}

static bool join(Arena *arena, Run *run, SimTracks *tracks) {
    const SimState *sim = run->sim;
    *tracks = (SimTracks){.n_members = sim->n_members,
                          .low = sim->low,
                          .high = sim->high,
                          .birth = run->birth,
                          .end = run->end,
                          .born = run->born,
                          .dies = run->dies};
    for (uint32_t m = sim->n_members; m-- > 0;) {
        if (run->rests[m].is_resting) {
            tracks->n_resting++;
            tracks->first_resting = m;
            tracks->rest_time = run->rests[m].rest_time;
        }
    }
    if (!sim_tracks_join(arena, run->courses, tracks)) {
        *run->failure = (SimFailure){0, sim->low, "all courses together are too long"};
        return false;
    }
    return true;
}

bool sim_state_run(Arena *arena, const SimState *sim, SimProgress *progress, void *context,
                   SimTracks *tracks, SimFailure *failure) {
    uint32_t n = sim->n_members;
    Run run = {.sim = sim, .failure = failure};
    run.courses = calloc(n, sizeof *run.courses);
    run.rests = calloc(n, sizeof *run.rests);
    run.birth = ARENA_ARRAY(arena, n, double);
    run.end = ARENA_ARRAY(arena, n, double);
    run.born = ARENA_ARRAY(arena, n, double);
    run.dies = ARENA_ARRAY(arena, n, double);
    *failure = (SimFailure){0, sim->low, "there is no memory for it"};
    bool is_fine = run.courses && run.rests && find_lives(&run) &&
                   run_all(&run, progress, context) && join(arena, &run, tracks);
    for (uint32_t m = 0; run.courses && m < n; m++) {
        sim_course_free(&run.courses[m]);
    }
    free(run.courses);
    free(run.rests);
    return is_fine;
}
