// SPDX-License-Identifier: Apache-2.0
// Sets of members that are moved together, and what is known of their courses.
#include "render/sim_crowd_parts.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_PIECES = 256 }; // of an arc, until fewer are made of them

// ---- Levels

static void free_level(CrowdLevel *l) {
    double *const columns[] = {l->y, l->next, l->old, l->spare, l->last, l->now, l->base, l->hit};
    for (size_t i = 0; i < sizeof columns / sizeof columns[0]; i++) {
        free(columns[i]);
    }
    for (int s = 0; s < RUNGE_STAGES; s++) {
        free(l->k[s]);
    }
    free(l->who);
    free(l->listed);
    free(l->wide);
    free(l->fires);
    free(l->chosen);
    free(l->is_hit);
    free(l->some);
    free(l->source);
    free(l->saved);
    *l = (CrowdLevel){0};
}

void crowd_free_levels(Crowd *c) {
    for (int depth = 0; depth < CROWD_LEVELS; depth++) {
        free_level(&c->levels[depth]);
    }
}

bool crowd_reserve(Crowd *c, uint32_t depth, uint32_t n) {
    CrowdLevel *l = &c->levels[depth];
    size_t n_states = (size_t)n * c->sim->n_states, n_whens = (size_t)n * c->sim->n_whens + 1;
    if (n <= l->capacity) {
        return true;
    }
    free_level(l);
    double **const of_states[] = {&l->y, &l->next, &l->old, &l->spare};
    double **const of_whens[] = {&l->last, &l->now, &l->base};
    bool is_fine = true;
    for (size_t i = 0; i < sizeof of_states / sizeof of_states[0]; i++) {
        *of_states[i] = malloc(n_states * sizeof(double));
        is_fine = is_fine && *of_states[i];
    }
    for (size_t i = 0; i < sizeof of_whens / sizeof of_whens[0]; i++) {
        *of_whens[i] = malloc(n_whens * sizeof(double));
        is_fine = is_fine && *of_whens[i];
    }
    for (int s = 0; s < RUNGE_STAGES; s++) {
        l->k[s] = malloc(n_states * sizeof(double));
        is_fine = is_fine && l->k[s];
    }
    l->who = malloc(n * sizeof *l->who);
    l->listed = malloc(c->sim->n_members * sizeof *l->listed);
    l->wide = malloc(c->sim->n_members * sizeof *l->wide);
    l->fires = calloc(n_whens, 1);
    l->chosen = calloc(n_whens, 1);
    l->is_hit = calloc(n, 1);
    l->hit = malloc(n * sizeof *l->hit);
    l->some = malloc(n * sizeof *l->some);
    l->source = malloc(n * sizeof *l->source);
    l->saved = malloc(n * sizeof *l->saved);
    l->capacity = n;
    return is_fine && l->who && l->listed && l->wide && l->fires && l->chosen && l->is_hit &&
           l->hit && l->some && l->source && l->saved;
}

void crowd_carry(const double *from, uint32_t n_from, const uint32_t *source, uint32_t n,
                 uint32_t n_columns, double *to) {
    for (uint32_t k = 0; k < n_columns; k++) {
        for (uint32_t i = 0; i < n; i++) {
            to[(size_t)k * n + i] =
                source[i] == CROWD_NO_ROW ? 0 : from[(size_t)k * n_from + source[i]];
        }
    }
}

// ---- Live tables

void crowd_set_there(Crowd *c, SimMembers members, double t) {
    for (uint32_t i = 0; i < members.n; i++) {
        uint32_t j = sim_member(members, i);
        c->sim->there[j] = c->run->birth[j] <= t && t < c->leaves[j];
    }
}

void crowd_place(Crowd *c, uint32_t j, double t) {
    const SimCourse *draft = &c->drafts[j];
    const size_t n_members = c->sim->n_members;
    uint32_t n_states = c->sim->n_states, i = draft->n;
    if (i == 0 || t > draft->pieces[i - 1].end) { // not born yet, at rest, or gone
        for (uint32_t k = 0; k < n_states; k++) {
            c->sim->live[k * n_members + j] = c->held[k * n_members + j];
        }
        return;
    }
    for (i--; i > 0 && t < draft->pieces[i].start; i--) {
    }
    const SimPiece *piece = &draft->pieces[i];
    const double *p = draft->coefficients + (size_t)i * n_states * SIM_COEFFICIENTS;
    double s = fmax(0, (t - piece->start) / (piece->end - piece->start));
    for (uint32_t k = 0; k < n_states; k++, p += SIM_COEFFICIENTS) {
        c->sim->live[k * n_members + j] = sim_polynomial(p, SIM_COEFFICIENTS, s);
    }
}

void crowd_place_all(Crowd *c, SimMembers members, double t) {
    for (uint32_t i = 0; i < members.n; i++) {
        crowd_place(c, sim_member(members, i), t);
    }
}

void crowd_read_drafts(Crowd *c, const CrowdLevel *l, double t, double *out) {
    for (uint32_t i = 0; i < l->n; i++) {
        crowd_place(c, l->who[i], t);
        for (uint32_t k = 0; k < c->sim->n_states; k++) {
            out[(size_t)k * l->n + i] = c->sim->live[(size_t)k * c->sim->n_members + l->who[i]];
        }
    }
}

void crowd_put(Crowd *c, const CrowdLevel *l, const double *y) {
    for (uint32_t k = 0; k < c->sim->n_states; k++) {
        double *live = c->sim->live + (size_t)k * c->sim->n_members;
        for (uint32_t i = 0; i < l->n; i++) {
            live[l->who[i]] = y[(size_t)k * l->n + i];
        }
    }
}

bool crowd_rates(Crowd *c, uint32_t depth, double t, const double *y, double *out) {
    const CrowdLevel *l = &c->levels[depth];
    size_t n = (size_t)c->sim->n_states * l->n;
    if (n == 0) {
        return true;
    }
    c->work += l->n + l->among.n;
    if (depth > 0) { // those outside of the first level keep what they are
        crowd_place_all(c, l->among, t);
    }
    crowd_put(c, l, y);
    sim_equations_rates(c->equations, t, (SimMembers){l->who, l->n}, l->among, out);
    size_t bad = sim_first_infinite(out, n);
    c->bad = bad < n ? l->who[bad % l->n] : c->bad;
    return bad == n;
}

// ---- Drafts

void crowd_draft(Crowd *c, const CrowdLevel *l, double t, double end) {
    double *const *k = l->k;
    for (uint32_t i = 0; i < l->n; i++) {
        uint32_t j = l->who[i];
        double *p = sim_course_add(&c->drafts[j], (SimPiece){t, end, c->begins[j]}, NULL);
        c->begins[j] = 0;
        for (uint32_t s = 0; s < c->sim->n_states && p; s++, p += SIM_COEFFICIENTS) {
            size_t at = (size_t)s * l->n + i;
            runge_way(end - t, l->y[at], l->next[at], k, at, p);
        }
    }
}

void crowd_cut_draft(Crowd *c, uint32_t j, double t) {
    SimCourse *draft = &c->drafts[j];
    c->begins[j] = 0;
    while (draft->n > 0 && draft->pieces[draft->n - 1].start >= t) {
        const SimPiece *last = &draft->pieces[--draft->n];
        c->begins[j] = last->start == t && last->begins_arc;
    }
    SimPiece *last = draft->n ? &draft->pieces[draft->n - 1] : NULL;
    if (!last || last->end <= t) {
        return;
    }
    double *p = draft->coefficients + (size_t)(draft->n - 1) * c->sim->n_states * SIM_COEFFICIENTS;
    double part = (t - last->start) / (last->end - last->start);
    for (uint32_t s = 0; s < c->sim->n_states; s++) {
        for (double power = part, *end = p++ + SIM_COEFFICIENTS; p < end; p++, power *= part) {
            *p *= power;
        }
    }
    last->end = t;
}

static void settle(Crowd *c, uint32_t j) {
    SimCourse *draft = &c->drafts[j], *course = &c->run->courses[j];
    size_t width = (size_t)c->sim->n_states * SIM_COEFFICIENTS;
    for (uint32_t i = 0; i < draft->n; i++) {
        if (draft->pieces[i].begins_arc) {
            c->first[j] = sim_run_end_arc(c->run, j, c->first[j]);
        }
        sim_course_add(course, draft->pieces[i], draft->coefficients + i * width);
    }
    if (course->n - c->first[j] > MOST_PIECES) {
        c->first[j] = sim_run_end_arc(c->run, j, c->first[j]);
    }
    course->is_failed = course->is_failed || draft->is_failed;
    draft->n = 0;
}

void crowd_flush(Crowd *c) {
    for (uint32_t j = 0; j < c->sim->n_members; j++) {
        if (c->drafts[j].n > 0) {
            settle(c, j);
        }
    }
}
