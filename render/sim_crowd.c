// SPDX-License-Identifier: Apache-2.0
// Members that read each other, to whom something happens: their common steps.
#include "render/sim_crowd_parts.h"

#include <stdlib.h>
#include <string.h>

// ---- Steps

// The largest error of a step by what is allowed, whose it is being c->bad.
static double error_of(Crowd *c, const CrowdLevel *l, double step) {
    double most = 0;
    for (size_t i = 0; i < (size_t)c->sim->n_states * l->n; i++) {
        double error = fabs(runge_error(step, l->k, i)) / crowd_allowed(c, l->next[i]);
        if (!(error <= most)) {
            most = isfinite(error) ? error : INFINITY;
            c->bad = l->who[i % l->n];
        }
    }
    return most;
}

// How much longer the next step may be.
static double growth(double error) {
    const double least = 0.2, most = 5, safety = 0.9;
    double factor = error > 0 ? safety * program_fold(OP_POW, error, -1.0 / RUNGE_ORDER, 0) : most;
    return fmin(fmax(factor, least), most);
}

// From t towards `to`, *end being how far. False: reported.
static bool take_step(Crowd *c, uint32_t depth, double t, double to, double *end) {
    CrowdLevel *l = &c->levels[depth];
    const double shortest = 1e-9 * (c->sim->high - c->sim->low);
    bool is_finite = true;
    l->step = fmin(l->step, crowd_longest_step(c, l));
    for (double most = INFINITY;; most = 0) {
        bool is_last = t + 1.001 * l->step >= to; // no crumb is left over
        double step = (is_last ? to : t + l->step) - t, error = INFINITY;
        if (!(step > (most == 0 ? 16 * DBL_EPSILON * fabs(t) : 0))) {
            return sim_run_fail(c->run, c->bad, t, is_finite ? SIM_NO_LONGER : SIM_NOT_FINITE);
        }
        is_finite = true;
        for (uint32_t s = 1; s < RUNGE_STAGES && is_finite; s++) {
            double at = runge_time[s] < 1 ? t + runge_time[s] * step : t + step;
            runge_look(s, step, (size_t)c->sim->n_states * l->n, l->y, l->k, l->next);
            is_finite = crowd_rates(c, depth, at, l->next, l->k[s]);
        }
        if (is_finite) {
            error = error_of(c, l, step);
        }
        double longer = step * growth(error);
        if (error <= 1) {
            *end = is_last ? to : t + step;
            // One that was too long is not made longer at once; one cut short says little.
            longer = fmin(longer, fmax(step, most));
            l->step = is_last ? fmax(longer, l->step) : longer;
            c->n_tiny += !is_last && step < shortest;
            return c->n_tiny <= SIM_MOST_TINY || sim_run_fail(c->run, c->bad, t, SIM_TOO_TINY);
        }
        l->step = longer;
    }
}

// ---- The way of a level

// A step of the level from t towards `to`; *from is the first instant within it at which something
// happens, INFINITY: none does. False: reported.
static bool step_on(Crowd *c, uint32_t depth, double t, double to, double *from, double *end) {
    CrowdLevel *l = &c->levels[depth];
    if (l->n == 0) {
        *from = *end = fmin(to, c->run->birth[l->later[0]]);
        return true;
    }
    if (++c->n_steps > SIM_STATE_STEPS) {
        return sim_run_fail(c->run, l->who[0], t, SIM_TOO_MANY_STEPS);
    }
    crowd_set_there(c, l->among, t);
    if (depth == 0) { // those that are not of it have been moved in thought
        crowd_place_all(c, l->among, t);
        l->fastest = 0;
    }
    if (!take_step(c, depth, t, to, end)) {
        return false;
    }
    crowd_draft(c, l, t, *end);
    *from = crowd_look(c, depth, t, *end);
    return true;
}

// The step that the level made from t ends at `end`, where something happens. False: reported.
static bool cut(Crowd *c, uint32_t depth, double t, double end) {
    CrowdLevel *l = &c->levels[depth];
    for (uint32_t i = 0; i < l->n; i++) {
        crowd_cut_draft(c, l->who[i], end);
    }
    crowd_read_drafts(c, l, end, l->y);
    crowd_set_there(c, l->among, t);
    return crowd_strike(c, depth, end);
}

bool crowd_advance(Crowd *c, uint32_t depth, double t, double to) {
    CrowdLevel *l = &c->levels[depth];
    while (t < to && (l->n || l->n_later)) {
        double end, from;
        if (!step_on(c, depth, t, to, &from, &end)) {
            return false;
        }
        if (from == INFINITY) {
            crowd_swap(&l->y, &l->next);
            crowd_swap(&l->k[0], &l->k[RUNGE_STAGES - 1]);
        } else {
            CrowdOutcome outcome = l->n ? crowd_go_back(c, depth, t, &from, &end) : CROWD_CUT;
            end = outcome == CROWD_CUT ? from : end;
            if (outcome == CROWD_FAILED || (outcome == CROWD_CUT && !cut(c, depth, t, end))) {
                return false;
            }
        }
        t = end;
        if (depth == 0) {
            crowd_flush(c);
            sim_run_tell(c->run, t);
        }
    }
    return true;
}

// ---- All of it

typedef struct {
    double time;
    uint32_t member;
} Birth;

static int compare_births(const void *a, const void *b) {
    const Birth *x = a, *y = b;
    return x->time != y->time ? (x->time > y->time) - (x->time < y->time)
                              : (x->member > y->member) - (x->member < y->member);
}

// Who is ever there, in order of birth; false: no memory.
static bool find_births(Crowd *c, uint32_t *n) {
    const SimRun *run = c->run;
    Birth *births = malloc(c->sim->n_members * sizeof *births);
    *n = 0;
    for (uint32_t j = 0; births && j < c->sim->n_members; j++) {
        if (run->birth[j] < run->end[j]) {
            births[(*n)++] = (Birth){run->birth[j], j};
        }
        c->leaves[j] = run->end[j] < c->sim->high ? run->end[j] : INFINITY;
    }
    if (births) {
        qsort(births, *n, sizeof *births, compare_births);
    }
    for (uint32_t i = 0; i < *n; i++) {
        c->later[i] = births[i].member;
    }
    free(births);
    return births != NULL;
}

static bool start(Crowd *c) {
    const SimState *sim = c->sim;
    size_t n = (size_t)sim->n_states * sim->n_members;
    sim_equations_start(c->equations, (SimMembers){NULL, sim->n_members}, c->starts);
    size_t bad = sim_first_infinite(c->starts, n);
    if (bad < n) {
        return sim_run_fail(c->run, (uint32_t)(bad % sim->n_members), sim->low, SIM_NO_START);
    }
    memcpy(c->held, c->starts, n * sizeof *c->held);
    return true;
}

// The ends of all courses: those at rest stay as they are until they die.
static void finish(Crowd *c) {
    SimRun *run = c->run;
    for (uint32_t j = 0; j < c->sim->n_members; j++) {
        const CrowdMember *member = &c->members[j];
        const double *held = c->held + j;
        sim_run_end_arc(run, j, c->first[j]);
        if (member->rests) {
            run->rests[j] = (SimRest){true, member->rest_time};
            sim_run_add_still(run, j, held, c->sim->n_members, member->rest_time, run->end[j]);
        }
        if (run->courses[j].n == 0) {
            sim_run_add_still(run, j, held, c->sim->n_members, c->sim->low, c->sim->high);
        }
    }
}

static bool run_crowd(Crowd *c) {
    const SimState *sim = c->sim;
    CrowdLevel *all = &c->levels[0];
    uint32_t n_later;
    if (!start(c)) {
        return false;
    }
    if (!crowd_reserve(c, 0, sim->n_members) || !find_births(c, &n_later)) {
        return sim_run_fail(c->run, 0, sim->low, SIM_NO_MEMORY);
    }
    all->later = c->later;
    all->n_later = n_later;
    all->among = (SimMembers){NULL, sim->n_members};
    all->step = 1e-3 * (sim->high - sim->low);
    crowd_set_there(c, all->among, sim->low);
    if (!crowd_strike(c, 0, sim->low) || !crowd_advance(c, 0, sim->low, sim->high)) {
        return false;
    }
    finish(c);
    return true;
}

bool sim_crowd_run(SimRun *run) {
    const SimState *sim = run->sim;
    size_t n_members = sim->n_members, n = sim->n_states * n_members;
    Crowd *c = calloc(1, sizeof *c);
    bool is_fine = c != NULL;
    if (c) {
        c->run = run;
        c->sim = sim;
        c->is_local = sim->reads[SIM_CONDITIONS] == 0;
        c->is_by_places = !((sim->reads[SIM_RATES] | sim->reads[SIM_ASSIGNED]) & SIM_READS_OTHERS);
        c->around = crowd_around_new(sim);
        c->equations = sim_equations_new(sim);
        c->drafts = calloc(n_members, sizeof *c->drafts);
        c->starts = malloc(n * sizeof *c->starts);
        c->held = malloc(n * sizeof *c->held);
        c->members = calloc(n_members, sizeof *c->members);
        c->begins = calloc(n_members, 1);
        c->first = calloc(n_members, sizeof *c->first);
        c->later = malloc(n_members * sizeof *c->later);
        c->leaves = malloc(n_members * sizeof *c->leaves);
        is_fine = c->equations && c->around && c->drafts && c->starts && c->held && c->members &&
                  c->begins && c->first && c->later && c->leaves;
    }
    for (uint32_t j = 0; j < n_members && is_fine; j++) {
        c->drafts[j] = (SimCourse){.n_columns = sim->n_states, .n_coefficients = SIM_COEFFICIENTS};
    }
    is_fine = is_fine ? run_crowd(c) : sim_run_fail(run, 0, sim->low, SIM_NO_MEMORY);
    for (uint32_t j = 0; c && c->drafts && j < n_members; j++) {
        sim_course_free(&c->drafts[j]);
    }
    if (c) {
        crowd_free_levels(c);
        sim_equations_free(c->equations);
        crowd_around_free(c->around);
        free(c->drafts);
        free(c->starts);
        free(c->held);
        free(c->members);
        free(c->begins);
        free(c->first);
        free(c->later);
        free(c->leaves);
        free(c);
    }
    return is_fine;
}
