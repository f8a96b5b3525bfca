// SPDX-License-Identifier: Apache-2.0
// In place of CVODE and ODE, which take seconds for what the language has to say in microseconds:
// whether blocks are read and members are looked up as they should does not depend on the courses.
#include "tests/fuzz/fuzz_simulator.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 64 };

typedef struct {
    uint32_t n_members, n_columns;
    double low, high;
    double from[MOST][MOST], rate[MOST][MOST]; // [members][columns]
    double born[MOST], dies[MOST];
} Plan;

static bool refuse(SimFailure *failure, uint32_t member, double time, const char *message) {
    *failure = (SimFailure){.member = member, .time = time};
    snprintf(failure->message, sizeof failure->message, "%s", message);
    return false;
}

static void run(const Program *program, uint32_t member, double time, double *out) {
    double in[IN_COUNT] = {[IN_I] = member, [IN_T] = time, [IN_FILM_T] = time};
    if (program) {
        program_run1(program, in, out);
    }
}

static bool plan_state(const SimState *sim, Plan *plan, SimFailure *failure) {
    double unused[MOST], life[2] = {-INFINITY, INFINITY};
    *plan = (Plan){sim->n_members, sim->n_states, sim->low, sim->high, {{0}}, {{0}}, {0}, {0}};
    if (sim->n_members > MOST || sim->n_states > MOST || sim->n_whens > MOST ||
        sim->n_assigned > MOST) {
        return refuse(failure, 0, sim->low, "there is too much");
    }
    for (uint32_t m = 0; m < sim->n_members; m++) {
        run(sim->start, m, sim->low, plan->from[m]);
        run(sim->life, m, sim->low, life);
        plan->born[m] = life[0];
        plan->dies[m] = life[1];
        for (uint32_t i = 0; i < sim->n_states; i++) {
            sim->live[(size_t)i * sim->n_members + m] = plan->from[m][i];
        }
    }
    for (uint32_t m = 0; m < sim->n_members; m++) {
        run(sim->rates, m, sim->low, plan->rate[m]);
        run(sim->conditions, m, sim->low, unused);
        run(sim->assigned, m, sim->low, unused);
    }
    return true;
}

static bool plan_rigid(const SimRigid *sim, Plan *plan, SimFailure *failure) {
    double unused[MOST];
    *plan = (Plan){sim->n_members, RIGID_COLUMNS, sim->low, sim->high, {{0}}, {{0}}, {0}, {0}};
    if (sim->n_members > MOST) {
        return refuse(failure, UINT32_MAX, sim->low, "there is too much");
    }
    for (uint32_t b = 0; b < sim->n_bodies; b++) {
        run(sim->bodies[b].motion, b, sim->low, unused);
        run(sim->bodies[b].force, b, sim->low, unused);
    }
    for (uint32_t m = 0; m < sim->n_members; m++) {
        const RigidBody *body = &sim->bodies[sim->members[m]];
        memcpy(plan->from[m], body->at, sizeof body->at);
        memcpy(plan->from[m] + 3, body->turn, sizeof body->turn);
        memcpy(plan->rate[m], body->velocity, sizeof body->velocity);
        plan->born[m] = -INFINITY;
        plan->dies[m] = INFINITY;
    }
    return true;
}

static bool add_course(const Plan *plan, uint32_t m, SimCourse *course) {
    double middle = plan->low + (plan->high - plan->low) / 2, c[2 * MOST];
    *course = (SimCourse){.n_columns = plan->n_columns, .n_coefficients = 2};
    for (int half = 0; half < 2; half++) {
        SimPiece piece = {half ? middle : plan->low, half ? plan->high : middle,
                          half == 0 || m % 2};
        for (uint32_t i = 0; i < plan->n_columns; i++) {
            c[2 * i] = plan->from[m][i] + plan->rate[m][i] * (piece.start - plan->low);
            c[2 * i + 1] = plan->rate[m][i] * (piece.end - piece.start);
            if (!isfinite(c[2 * i]) || !isfinite(c[2 * i + 1])) {
                return false;
            }
        }
        if (!(piece.end > piece.start) || !sim_course_add(course, piece, c)) {
            return false;
        }
    }
    return true;
}

static double *copy(Arena *arena, const Plan *plan, const double *values) {
    double *to = ARENA_ARRAY(arena, plan->n_members, double);
    for (uint32_t m = 0; m < plan->n_members; m++) {
        to[m] = values ? values[m] : 0;
    }
    return to;
}

static bool simulate(void *context, Arena *arena, const SimJob *job, SimTracks *tracks,
                     SimFailure *failure) {
    static Plan plan;
    SimCourse courses[MOST] = {{0}};
    double low[MOST], high[MOST];
    uint32_t n = 0;
    (void)context;
    if (!(job->state ? plan_state(job->state, &plan, failure)
                     : plan_rigid(job->rigid, &plan, failure))) {
        return false;
    }
    for (uint32_t m = 0; m < plan.n_members; m++) {
        low[m] = plan.low;
        high[m] = plan.high;
    }
    while (n < plan.n_members && add_course(&plan, n, &courses[n])) {
        n++;
    }
    *tracks = (SimTracks){.n_members = plan.n_members, .low = plan.low, .high = plan.high};
    tracks->birth = copy(arena, &plan, low);
    tracks->end = copy(arena, &plan, high);
    tracks->born = copy(arena, &plan, plan.born);
    tracks->dies = copy(arena, &plan, plan.dies);
    bool is_done = n == plan.n_members && n > 0 && sim_tracks_join(arena, courses, tracks);
    for (uint32_t m = 0; m < plan.n_members; m++) {
        sim_course_free(&courses[m]);
    }
    return is_done || refuse(failure, n < plan.n_members ? n : 0, plan.low, "it is not finite");
}

const Simulator fuzz_simulator = {.run = simulate};
