// SPDX-License-Identifier: Apache-2.0
// Programs of a simulation, run over its live tables.
#include "render/sim_equations.h"

#include <math.h>
#include <stdlib.h>

struct SimEquations {
    const SimState *sim;
    double *member;    // [n_members] IN_I
    double **out;      // room for pointers to outputs
    double *assigned;  // [n_assigned]
    SimNearGrid *near; // NULL: no sums over what is near
};

SimEquations *sim_equations_new(const SimState *sim) {
    SimEquations *e = calloc(1, sizeof *e);
    if (!e) {
        return NULL;
    }
    size_t n_out = (size_t)sim->n_states + sim->n_whens + 1;
    *e = (SimEquations){.sim = sim,
                        .member = malloc(sim->n_members * sizeof *e->member),
                        .out = malloc(n_out * sizeof *e->out),
                        .assigned = malloc((sim->n_assigned + 1) * sizeof *e->assigned),
                        .near = sim->n_nears ? sim_near_new(sim->nears, sim->n_nears) : NULL};
    if (!e->member || !e->out || !e->assigned || (sim->n_nears && !e->near)) {
        sim_equations_free(e);
        return NULL;
    }
    return e;
}

void sim_equations_free(SimEquations *e) {
    if (e) {
        free(e->member);
        free(e->out);
        free(e->assigned);
        sim_near_free(e->near);
        free(e);
    }
}

static void run(SimEquations *e, const Program *program, double t, SimMembers members,
                double *out) {
    uint32_t n_out = program_n_out(program);
    if (members.n == 1) {
        const double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t, [IN_I] = sim_member(members, 0)};
        program_run1(program, in, out);
        return;
    }
    ProgramInputs in = {.varying = 1u << IN_I};
    in.at[IN_T] = in.at[IN_FILM_T] = &t;
    in.at[IN_I] = e->member;
    for (uint32_t i = 0; i < members.n; i++) {
        e->member[i] = sim_member(members, i);
    }
    for (uint32_t k = 0; k < n_out; k++) {
        e->out[k] = out + (size_t)k * members.n;
    }
    program_run(program, &in, members.n, e->out);
}

static void find_sums(SimEquations *e, SimReader reader, double t, SimMembers members,
                      SimMembers among) {
    if (e->near && e->sim->reads[reader] & SIM_READS_SUMS) {
        sim_near_run(e->near, t, members, among);
    }
}

void sim_equations_start(SimEquations *e, SimMembers members, double *out) {
    run(e, e->sim->start, 0, members, out);
}

void sim_equations_rates(SimEquations *e, double t, SimMembers members, SimMembers among,
                         double *out) {
    find_sums(e, SIM_RATES, t, members, among);
    run(e, e->sim->rates, t, members, out);
}

void sim_equations_conditions(SimEquations *e, double t, SimMembers members, SimMembers among,
                              double *out) {
    if (e->sim->n_whens) {
        find_sums(e, SIM_CONDITIONS, t, members, among);
        run(e, e->sim->conditions, t, members, out);
        for (size_t i = 0; i < (size_t)e->sim->n_whens * members.n; i++) {
            out[i] = isnan(out[i]) ? 1 : out[i];
        }
    }
}

void sim_equations_assign(SimEquations *e, double t, SimMembers members, SimMembers among,
                          const uint8_t *fires, double *y) {
    const SimState *sim = e->sim;
    find_sums(e, SIM_ASSIGNED, t, members, among);
    for (uint32_t j = 0; j < members.n; j++) {
        const double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t, [IN_I] = sim_member(members, j)};
        bool is_run = false;
        for (uint32_t i = 0; i < sim->n_assigned; i++) {
            if (!fires[(size_t)sim->assigned_when[i] * members.n + j]) {
                continue;
            }
            if (!is_run) {
                program_run1(sim->assigned, in, e->assigned);
                is_run = true;
            }
            y[(size_t)sim->assigned_state[i] * members.n + j] = e->assigned[i];
        }
    }
}

size_t sim_first_infinite(const double *values, size_t n) {
    size_t i = 0;
    while (i < n && isfinite(values[i])) {
        i++;
    }
    return i;
}
