// SPDX-License-Identifier: Apache-2.0
// Prototypes: what programs make of the loop variables, compared.
#include "render/prototypes.h"

#include <string.h>

#include "render/mover.h"

enum { PROGRAMS = 3 };

typedef struct {
    const Shape *shape;
    const Program *programs[PROGRAMS]; // all that decides where vertices are; NULL: none
    uint32_t n_values;                 // kept by them
    double *registers;                 // of any of them
} Maker;

// All that tells the instance's vertices from another's.
static void take_values(const Maker *m, uint32_t instance, double *out) {
    double in[IN_COUNT];
    shape_inputs(m->shape, shape_loops(m->shape, instance), 0, in);
    for (int k = 0; k < PROGRAMS; k++) {
        if (m->programs[k]) {
            program_keep(m->programs[k], in, m->registers);
            out += program_kept(m->programs[k], m->registers, out);
        }
    }
}

static Maker maker_new(Arena *scratch, const Shape *shape) {
    Maker m = {.shape = shape, .programs = {shape->vertex, shape->fade, shape->breaks}};
    uint32_t most = 0;
    for (int k = 0; k < PROGRAMS; k++) {
        if (m.programs[k]) {
            uint32_t n = program_n_instr(m.programs[k]);
            m.n_values += program_kept(m.programs[k], NULL, NULL);
            most = n > most ? n : most;
        }
    }
    m.registers = ARENA_ARRAY(scratch, most, double);
    return m;
}

static uint64_t hash_values(const double *values, uint32_t n) {
    uint64_t hash = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
    }
    return hash;
}

// Numbers them; the values of each prototype are kept for those that follow.
static uint32_t number(const Maker *m, Arena *scratch, const uint32_t *which, uint32_t n,
                       uint32_t *of) {
    uint32_t n_found = 0;
    size_t n_slots = 2 * (size_t)n + 1, capacity = 0, size = m->n_values * sizeof(double);
    uint32_t *slots = ARENA_ARRAY(scratch, n_slots, uint32_t); // of prototypes, plus 1
    double **known = NULL, *values = ARENA_ARRAY(scratch, m->n_values, double);
    for (uint32_t i = 0; i < n; i++) {
        take_values(m, which[i], values);
        size_t at = hash_values(values, m->n_values) % n_slots;
        while (slots[at] && memcmp(known[slots[at] - 1], values, size) != 0) {
            at = (at + 1) % n_slots;
        }
        if (!slots[at]) {
            known = arena_grow(scratch, known, n_found, &capacity, sizeof *known);
            known[n_found++] = values;
            slots[at] = n_found;
            values = ARENA_ARRAY(scratch, m->n_values, double);
        }
        of[i] = slots[at] - 1;
    }
    return n_found;
}

static void gather(Arena *arena, Prototypes *p, const uint32_t *which, uint32_t n) {
    p->first = ARENA_ARRAY(arena, (size_t)p->n + 1, uint32_t);
    p->members = ARENA_ARRAY(arena, n, uint32_t);
    for (uint32_t i = 0; i < n; i++) {
        p->first[p->of[i] + 1]++;
    }
    for (uint32_t k = 0; k < p->n; k++) {
        p->first[k + 1] += p->first[k];
    }
    for (uint32_t i = 0; i < n; i++) {
        p->members[p->first[p->of[i]]++] = which[i];
    }
    memmove(p->first + 1, p->first, p->n * sizeof *p->first);
    p->first[0] = 0;
}

Prototypes prototypes_of(Arena *arena, const Shape *shape, const uint32_t *which, uint32_t n) {
    const Program *points = shape->kind == SHAPE_MESH ? shape->vertex : shape->geometry;
    Prototypes p = {.n = n > 0};
    // Where these read none, breaks that differ are those of transforms, which are not sampled.
    if (!program_reads_loops(points) && !program_reads_loops(shape->fade)) {
        return p;
    }
    p.of = ARENA_ARRAY(arena, n, uint32_t);
    if (shape->kind == SHAPE_MESH) {
        Arena scratch = {0};
        Maker maker = maker_new(&scratch, shape);
        p.n = number(&maker, &scratch, which, n, p.of);
        arena_free(&scratch);
    } else {
        for (p.n = 0; p.n < n; p.n++) {
            p.of[p.n] = p.n;
        }
    }
    gather(arena, &p, which, n);
    return p;
}

uint32_t *instances_seen(Arena *arena, const Shape *shape, uint32_t *n) {
    uint32_t *which = ARENA_ARRAY(arena, shape->n_instances, uint32_t);
    bool may_change = program_reads_time(shape->visible);
    *n = 0;
    for (uint32_t i = 0; i < shape->n_instances; i++) {
        if (may_change || shape_is_visible(shape, shape_loops(shape, i), 0)) {
            which[(*n)++] = i;
        }
    }
    return which;
}
