// SPDX-License-Identifier: Apache-2.0
// Every structure on every instruction set over one geometry, and the comparison of their answers.
#include "tests/stability/oracle.h"

#include "accel/cpu.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Trees that need long for many primitives in many spans: how much they are given, and one ray in
// how many they are asked. A structure that is not named here gets everything.
static const struct {
    const char *name;
    double most_work; // primitives times spans
    uint64_t every;
} slow[] = {
    {"kd4-thesis", 30000, 1},
    {"kd3", 30000, 4}, // a leaf holds what passes through it at any time
    {NULL, INFINITY, 1},
};

enum { BRUTE_SIZE = 256 }; // a ray against so many primitives takes as long as one through a tree

static double work_of(const Geometry *g) {
    return (double)g->n_prims * (g->n_keys > 1 ? g->n_keys - 1 : 1);
}

static void add_subject(Run *run, Subjects *s, const AccelType *type, const char *cpu,
                        const AccelOptions *options) {
    int k = 0;
    while (slow[k].name && strcmp(slow[k].name, type->name) != 0) {
        k++;
    }
    if (work_of(s->geometry) > slow[k].most_work) {
        if (strcmp(cpu, "scalar") == 0) {
            run_note(run, "%s is left out of %s: its build takes long", type->name, s->label);
        }
        return;
    }
    Subject *subject = &s->at[s->n];
    *subject = (Subject){.type = type, .cpu = cpu, .every = slow[k].every};
    if (strcmp(type->name, "brute") == 0) {
        subject->every = 1 + s->geometry->n_prims / BRUTE_SIZE;
    }
    cpu_set(cpu);
    subject->accel = type->build(s->geometry, options, &subject->stats);
    cpu_set(NULL);
    if (!run_expect(run, subject->accel, "%s on %s: no %s", s->label, cpu, type->name)) {
        return;
    }
    s->n++;
    char why[300] = "";
    run_expect(run, subject->accel->type->validate(subject->accel, why, sizeof why),
               "%s: %s on %s is not valid: %s", s->label, type->name, cpu, why);
}

Subjects *subjects_new(Run *run, const Geometry *geometry, const AccelOptions *options,
                       const char *label, ...) {
    AccelOptions plain = accel_options_default();
    Subjects *s = calloc(1, sizeof *s);
    s->geometry = geometry;
    va_list args;
    va_start(args, label);
    vsnprintf(s->label, sizeof s->label, label, args);
    va_end(args);
    for (const AccelType *type = accel_types; type->name; type++) {
        for (int cpu = 0; cpu < CPU_COUNT && s->n < MAX_SUBJECTS; cpu++) {
            if (cpu_has((Cpu)cpu)) {
                add_subject(run, s, type, cpu_names[cpu], options ? options : &plain);
            }
        }
    }
    return s;
}

void subjects_free(Subjects *s) {
    for (int i = 0; i < s->n; i++) {
        s->at[i].accel->type->destroy(s->at[i].accel);
    }
    free(s);
}

const char *ray_text(const AccelRay *r) {
    static _Thread_local char text[400];
    snprintf(text, sizeof text,
             "(AccelRay){.origin = {%a, %a, %a}, .dir = {%a, %a, %a}, .tmin = %a, .tmax = %a, "
             ".f = %a, .key = %u}",
             r->origin[0], r->origin[1], r->origin[2], r->dir[0], r->dir[1], r->dir[2], r->tmin,
             r->tmax, r->f, r->key);
    return text;
}

const char *hit_text(bool is_hit, const AccelHit *hit) {
    enum { TEXTS = 4 }; // several in one message
    static _Thread_local char texts[TEXTS][160];
    static _Thread_local unsigned next;
    char *text = texts[next++ % TEXTS];
    if (is_hit) {
        snprintf(text, sizeof texts[0], "{t %a (%.9g), prim %d, u %a, v %a}", hit->t, hit->t,
                 hit->prim, hit->u, hit->v);
    } else {
        snprintf(text, sizeof texts[0], "a miss (prim %d)", hit->prim);
    }
    return text;
}

static bool is_same(bool is_hit, const AccelHit *a, const AccelHit *b) {
    return is_hit ? memcmp(a, b, sizeof *a) == 0 : a->prim == b->prim;
}

bool subjects_ask(Run *run, const Subjects *s, const AccelRay *ray, uint64_t index, AccelHit *hit) {
    const Subject *first = &s->at[0];
    bool is_hit = false;
    uint64_t n = 0;
    for (int i = 0; i < s->n; i++) {
        const Subject *subject = &s->at[i];
        if (index % subject->every != 0) {
            continue;
        }
        AccelHit own = {0};
        const AccelType *type = subject->accel->type;
        bool is_own = type->closest(subject->accel, ray, &own, NULL);
        bool is_occluded = type->occluded(subject->accel, ray, NULL);
        n += 2;
        if (i == 0) {
            is_hit = is_own;
            *hit = own;
        }
        if (is_own != is_hit || !is_same(is_hit, &own, hit) || is_occluded != is_hit) {
            run_fail(run, "%s, ray %llu: %s\n  %s on %s: %s\n  %s on %s: %s, %s", s->label,
                     (unsigned long long)index, ray_text(ray), first->type->name, first->cpu,
                     hit_text(is_hit, hit), subject->type->name, subject->cpu,
                     hit_text(is_own, &own), is_occluded ? "occluded" : "not occluded");
        }
    }
    count_queries(n);
    return is_hit;
}

bool subjects_check(Run *run, const Subjects *s, const AccelRay *ray, uint64_t index,
                    AccelHit *hit) {
    char why[200] = "";
    bool is_hit = subjects_ask(run, s, ray, index, hit);
    if (!oracle_allows_hit(s->geometry, ray, is_hit, hit, why, sizeof why)) {
        run_fail(run, "%s, ray %llu: %s\n  %s: %s\n  the oracle: %s", s->label,
                 (unsigned long long)index, ray_text(ray), s->at[0].type->name,
                 hit_text(is_hit, hit), why);
    }
    return is_hit;
}
