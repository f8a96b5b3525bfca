// SPDX-License-Identifier: Apache-2.0
// Simulations by equations: members over time, their events, all of them together.
#include "render/sim_state.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/sim_crowd.h"
#include "render/sim_system.h"

// Of a system that is being followed.
typedef struct {
    SimEvents *events;   // [n]
    uint32_t *first;     // [n] of the pieces of the arc at hand
    uint8_t *begins;     // [n] an arc begins with the next piece
    uint8_t *is_resting; // [n]
    uint8_t *is_there;   // [n]
    uint8_t *fires;      // [n_whens][n]
    double *conditions;  // [2][n_whens][n]
    double *rates;       // [2][n_states][n]
    uint32_t n_moving;   // there, and not resting
    uint64_t n_steps, n_tiny;
    double last_event;
} State;

// ---- Courses

static void add_pieces(SimRun *run, SimSystem *system, State *state, double from, double to) {
    uint32_t n_states = run->sim->n_states;
    for (uint32_t j = 0; j < system->n; j++) {
        SimCourse *course = &run->courses[system->first + j];
        if (!state->is_there[j]) {
            continue;
        }
        double *c = sim_course_add(course, (SimPiece){from, to, state->begins[j]}, NULL);
        state->begins[j] = 0;
        for (uint32_t k = 0; c && k < n_states; k++) {
            memcpy(c + (size_t)k * SIM_COEFFICIENTS, sim_system_fit(system, k * system->n + j),
                   SIM_COEFFICIENTS * sizeof *c);
        }
    }
}

// Times nearer to each other leave no room for a step between them.
static double least_span(const SimState *sim) {
    return 200 * DBL_EPSILON * fmax(fabs(sim->low), fabs(sim->high));
}

// Pieces from the time `from` to the system's: halves, where one is too far from the solution.
static bool add_step(SimRun *run, SimSystem *system, State *state, double from, double to,
                     int depth) {
    enum { MAX_DEPTH = 20 };
    if (!sim_system_interpolate(system, from, to)) {
        return false;
    }
    bool is_short = depth >= MAX_DEPTH || to - from < least_span(run->sim);
    if (is_short || sim_system_miss(system) <= 0.25 * run->sim->tolerance) {
        add_pieces(run, system, state, from, to);
        return true;
    }
    double middle = from + (to - from) / 2;
    return add_step(run, system, state, from, middle, depth + 1) &&
           add_step(run, system, state, middle, to, depth + 1);
}

void sim_run_add_still(SimRun *run, uint32_t member, const double *y, size_t stride, double from,
                       double to) {
    SimCourse *course = &run->courses[member];
    double *c = to > from ? sim_course_add(course, (SimPiece){from, to, true}, NULL) : NULL;
    for (uint32_t k = 0; c && k < run->sim->n_states; k++) {
        c[(size_t)k * SIM_COEFFICIENTS] = y[k * stride];
    }
}

static void add_still(SimRun *run, SimSystem *system, uint32_t j, double from, double to) {
    sim_run_add_still(run, system->first + j, system->y + j, system->n, from, to);
}

uint32_t sim_run_end_arc(SimRun *run, uint32_t member, uint32_t first) {
    sim_course_merge(&run->courses[member], first, 0.5 * run->sim->tolerance);
    return run->courses[member].n;
}

// The arc of member j has ended.
static void end_arc(SimRun *run, SimSystem *system, State *state, uint32_t j) {
    state->first[j] = sim_run_end_arc(run, system->first + j, state->first[j]);
    state->begins[j] = 1;
}

// ---- Events

bool sim_run_fail(SimRun *run, uint32_t member, double t, const char *message) {
#pragma omp critical(sim_state_failure)
    if (!run->is_failed || member < run->failure->member) {
        run->is_failed = true;
        run->failure->member = member;
        run->failure->time = t;
        snprintf(run->failure->message, sizeof run->failure->message, "%s", message);
    }
    return false;
}

static bool fail(SimRun *run, const SimSystem *system, double t, const char *message) {
    return sim_run_fail(run, system->first + system->bad_member, t, message);
}

// Members to whom something happens at t begin a new arc; one of too many events rests.
static void interrupt(SimRun *run, SimSystem *system, State *state, double t) {
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
        if (events_are_too_many(run->sim, &state->events[j], t)) {
            state->is_resting[j] = 1;
            state->n_moving--;
            run->rests[system->first + j] = (SimRest){true, t};
            sim_system_rest(system, j);
        }
    }
}

// What is marked in fires happens at t, then what that brings about. What goes round in circles
// comes to rest, since each round counts. False: reported.
static bool happen(SimRun *run, SimSystem *system, State *state, double t) {
    size_t n = (size_t)run->sim->n_whens * system->n;
    double *before = state->conditions, *after = before + n;
    bool fires_again = true;
    while (fires_again) {
        interrupt(run, system, state, t);
        for (size_t i = 0; i < n; i++) {
            state->fires[i] = state->fires[i] && !state->is_resting[i % system->n];
        }
        sim_system_conditions(system, t, before);
        if (!sim_system_assign(system, t, state->fires)) {
            return fail(run, system, t, SIM_BAD_EVENT);
        }
        sim_system_conditions(system, t, after);
        fires_again = false;
        for (size_t i = 0; i < n; i++) {
            state->fires[i] = !state->fires[i] && before[i] >= 0 && after[i] < 0;
            fires_again = fires_again || state->fires[i];
        }
    }
    return true;
}

// Up to the time `to`, which *t becomes.
static bool follow(SimRun *run, SimSystem *system, State *state, double *t, double to) {
    double span = run->sim->high - run->sim->low;
    sim_system_restart(system, *t, to, INFINITY);
    while (to - *t > least_span(run->sim) && state->n_moving) {
        double before = *t;
        SimStep step = sim_system_step(system, t);
        if (step == SIM_STEP_FAILED) {
            return fail(run, system, *t, system->message);
        }
        state->n_tiny += *t - before < 1e-9 * span && step == SIM_STEP_ON;
        if (state->n_tiny > SIM_MOST_TINY) {
            return fail(run, system, *t, SIM_TOO_TINY);
        }
        if (++state->n_steps > SIM_STATE_STEPS) {
            return fail(run, system, *t, SIM_TOO_MANY_STEPS);
        }
        if (*t > before && !add_step(run, system, state, before, *t, 0)) {
            return fail(run, system, *t, "its course cannot be followed");
        }
        if (step == SIM_STEP_EVENT) {
            for (size_t i = 0; i < (size_t)run->sim->n_whens * system->n; i++) {
                state->fires[i] = system->roots[i] != 0;
            }
            if (!happen(run, system, state, *t)) {
                return false;
            }
            sim_system_restart(system, *t, to, (*t - state->last_event) / 16);
            state->last_event = *t;
        }
    }
    for (uint32_t j = 0; j < system->n && *t < to; j++) {
        if (state->is_there[j]) { // all rest, or there is no room for a step
            end_arc(run, system, state, j);
            add_still(run, system, j, *t, to);
            state->first[j] = run->courses[system->first + j].n;
        }
    }
    *t = to;
    return true;
}

// ---- Coming and going

// Members are there from their birth to before their end.
static void come_and_go(SimRun *run, SimSystem *system, State *state, double t) {
    for (uint32_t j = 0; j < system->n; j++) {
        bool is = run->birth[system->first + j] <= t && t < run->end[system->first + j];
        if (is == (state->is_there[j] != 0)) {
            continue;
        }
        if (!is) {
            end_arc(run, system, state, j);
        }
        state->is_there[j] = is;
        state->n_moving += state->is_resting[j] ? 0 : is ? 1 : -1;
        sim_system_be_there(system, j, is);
    }
}

// Where a member's rates jump it begins a new arc, so that its bend stays a corner.
static void bend(SimRun *run, SimSystem *system, State *state) {
    size_t n = (size_t)run->sim->n_states * system->n;
    enum { MOST_PIECES = 256 }; // until fewer are made of them
    for (uint32_t j = 0; j < system->n; j++) {
        bool jumps = false;
        for (size_t i = j; i < n; i += system->n) {
            double before = state->rates[i], after = state->rates[i + n];
            jumps = jumps || !(fabs(after - before) <= run->sim->tolerance * fmax(1, fabs(before)));
        }
        SimCourse *course = &run->courses[system->first + j];
        if (!state->is_there[j] || state->begins[j]) {
            continue;
        }
        if (jumps) {
            end_arc(run, system, state, j);
        } else if (course->n - state->first[j] > MOST_PIECES) {
            sim_course_merge(course, state->first[j], 0.5 * run->sim->tolerance);
            state->first[j] = course->n;
        }
    }
}

// Members come or go at t. What that makes true of those that stay happens to them. False:
// reported.
static bool change(SimRun *run, SimSystem *system, State *state, double t) {
    size_t n = (size_t)run->sim->n_whens * system->n;
    double *before = state->conditions, *after = before + n;
    sim_system_rates(system, t, state->rates);
    sim_system_conditions(system, t, before);
    come_and_go(run, system, state, t); // conditions of those that are not there do not hold
    sim_system_conditions(system, t, after);
    bool fires = false;
    for (size_t i = 0; i < n; i++) {
        // Not to one that has just been born: nothing has become true for it.
        bool is_new = run->birth[system->first + i % system->n] == t;
        state->fires[i] = !is_new && before[i] >= 0 && after[i] < 0;
        fires = fires || state->fires[i];
    }
    if (fires && !happen(run, system, state, t)) {
        return false;
    }
    sim_system_rates(system, t, state->rates + (size_t)run->sim->n_states * system->n);
    bend(run, system, state);
    return true;
}

static bool follow_all(SimRun *run, SimSystem *system, State *state) {
    bool is_coupled = run->sim->is_coupled;
    double t = is_coupled ? run->sim->low : run->birth[system->first];
    uint32_t n_stops = is_coupled ? run->n_stops : 1;
    state->last_event = t;
    for (uint32_t j = 0; j < system->n; j++) {
        sim_system_be_there(system, j, false);
    }
    come_and_go(run, system, state, t);
    for (uint32_t i = 0; i < n_stops; i++) {
        if (i > 0 && !change(run, system, state, t)) {
            return false;
        }
        if (!follow(run, system, state, &t, is_coupled ? run->stops[i] : run->end[system->first])) {
            return false;
        }
    }
    for (uint32_t j = 0; j < system->n; j++) {
        if (state->is_there[j]) {
            end_arc(run, system, state, j);
        }
        if (run->courses[system->first + j].n == 0) { // it is never there
            add_still(run, system, j, run->sim->low, run->sim->high);
        }
    }
    return true;
}

// ---- Members

static bool run_system(SimRun *run, SimSystem *system) {
    const SimState *sim = run->sim;
    double from = sim->is_coupled ? sim->low : run->birth[system->first];
    double to = sim->is_coupled ? sim->high : run->end[system->first];
    if (!sim_system_start(system)) {
        return fail(run, system, from, system->message);
    }
    if (!(from < to)) { // it is never there within the span
        add_still(run, system, 0, sim->low, sim->high);
        return true;
    }
    size_t n_conditions = (size_t)sim->n_whens * system->n;
    State state = {.events = calloc(system->n, sizeof(SimEvents)),
                   .first = calloc(system->n, sizeof(uint32_t)),
                   .begins = malloc(system->n),
                   .is_resting = calloc(system->n, 1),
                   .is_there = calloc(system->n, 1),
                   .fires = calloc(n_conditions + 1, 1),
                   .conditions = calloc(2 * n_conditions + 1, sizeof(double)),
                   .rates = calloc(2 * (size_t)sim->n_states * system->n, sizeof(double))};
    bool is_fine = state.events && state.first && state.begins && state.is_resting &&
                   state.is_there && state.fires && state.conditions && state.rates;
    if (state.begins) {
        memset(state.begins, 1, system->n);
    }
    is_fine = is_fine ? follow_all(run, system, &state)
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
    free(state.is_there);
    free(state.fires);
    free(state.conditions);
    free(state.rates);
    return is_fine;
}

// Members that read each other, to whom something happens, are moved by Runge-Kutta.
static bool is_crowd(const SimState *sim) {
    return sim->is_coupled && !sim->is_stiff;
}

static bool run_systems(SimRun *run) {
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
            if (run->progress) {
                run->progress(run->context, (double)++n_done / n_systems);
            }
        }
        sim_system_free(system);
    }
    return !run->is_failed;
}

// When each member is there, and for which part of the span it is followed.
static bool find_lives(SimRun *run) {
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

static int compare_times(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Where a coupled system stops: each time that is too near to the one before counts as that one.
static void find_stops(SimRun *run) {
    const SimState *sim = run->sim;
    const double least = least_span(sim);
    size_t n = 0;
    for (uint32_t m = 0; m < sim->n_members; m++) {
        run->stops[n++] = run->birth[m];
        run->stops[n++] = run->end[m];
    }
    qsort(run->stops, n, sizeof *run->stops, compare_times);
    double last = sim->low;
    for (size_t i = 0; i < n; i++) {
        double stop = run->stops[i];
        if (stop - last > least && sim->high - stop > least) {
            run->stops[run->n_stops++] = last = stop;
        }
    }
    run->stops[run->n_stops++] = sim->high;
}

// The stop that a time counts as; low is one too.
static double stop_of(const SimRun *run, double t) {
    uint32_t first = 0, n = run->n_stops; // the stops up to t are those before `first`
    if (run->sim->high - t <= least_span(run->sim)) {
        return run->sim->high;
    }
    while (n > 0) {
        uint32_t half = n / 2;
        bool is_before = run->stops[first + half] <= t;
        first = is_before ? first + half + 1 : first;
        n = is_before ? n - half - 1 : half;
    }
    return first ? run->stops[first - 1] : run->sim->low;
}

static bool stop_at_lives(SimRun *run) {
    const SimState *sim = run->sim;
    run->stops = malloc((2 * (size_t)sim->n_members + 1) * sizeof *run->stops);
    if (!run->stops) {
        return false;
    }
    find_stops(run);
    for (uint32_t m = 0; m < sim->n_members; m++) {
        run->birth[m] = stop_of(run, run->birth[m]);
        run->end[m] = stop_of(run, run->end[m]);
        if (!(run->birth[m] < run->end[m])) {
            run->birth[m] = run->end[m] = sim->low;
        }
    }
    return true;
}

static bool join(Arena *arena, SimRun *run, SimTracks *tracks) {
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
    SimRun run = {.sim = sim, .progress = progress, .context = context, .failure = failure};
    run.courses = calloc(n, sizeof *run.courses);
    run.rests = calloc(n, sizeof *run.rests);
    run.birth = ARENA_ARRAY(arena, n, double);
    run.end = ARENA_ARRAY(arena, n, double);
    run.born = ARENA_ARRAY(arena, n, double);
    run.dies = ARENA_ARRAY(arena, n, double);
    for (uint32_t m = 0; run.courses && m < n; m++) {
        run.courses[m] =
            (SimCourse){.n_columns = sim->n_states, .n_coefficients = SIM_COEFFICIENTS};
    }
    *failure = (SimFailure){0, sim->low, SIM_NO_MEMORY};
    bool is_fine =
        run.courses && run.rests && find_lives(&run) &&
        (is_crowd(sim) ? sim_crowd_run(&run)
                       : (!sim->is_coupled || stop_at_lives(&run)) && run_systems(&run)) &&
        join(arena, &run, tracks);
    for (uint32_t m = 0; run.courses && m < n; m++) {
        sim_course_free(&run.courses[m]);
    }
    free(run.courses);
    free(run.stops);
    free(run.rests);
    return is_fine;
}
