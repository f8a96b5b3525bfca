// SPDX-License-Identifier: Apache-2.0
// Closed meshes: a ray from inside hits, whatever it is aimed at and whatever the mesh does.
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// What a ray from inside is aimed at.
typedef enum { AIM_ANYWHERE, AIM_VERTEX, AIM_MIDDLE, AIM_EDGE, AIMS } Aim;

typedef struct {
    const Solid *solid;
    const Subjects *subjects;
    bool is_aimed;
    float flat; // with 2 keys, mirrored at the second: nearer than that to the middle all is flat
} Escape;

static void aim_at(const Geometry *g, AccelRay *ray, Aim aim, uint64_t *random) {
    float p[3], q[3], s = aim == AIM_EDGE ? (float)test_uniform(random) : 0.5f;
    const uint32_t *index = g->index + 3 * (test_random(random) % g->n_prims);
    uint32_t corner = (uint32_t)(test_random(random) % 3);
    vertex_at(g, ray, index[corner], p);
    vertex_at(g, ray, index[(corner + 1) % 3], q);
    for (int k = 0; k < 3; k++) {
        float to = aim == AIM_VERTEX ? p[k] : fmaf(s, q[k] - p[k], p[k]);
        ray->dir[k] = to - ray->origin[k];
    }
}

static void must_not_escape(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Escape *e = context;
    AccelRay ray = solid_ray(e->solid, random);
    if (e->is_aimed) {
        aim_at(&e->solid->scene.geometry, &ray, (Aim)(1 + i % (AIMS - 1)), random);
    }
    AccelHit hit;
    bool is_hit = i % 64 ? subjects_ask(run, e->subjects, &ray, i, &hit)
                         : subjects_check(run, e->subjects, &ray, i, &hit);
    bool is_flat = fabsf(ray.f - 0.5f) < e->flat;
    if (!is_hit && !is_flat) {
        run_fail(run, "%s: ray %llu escapes: %s", e->subjects->label, (unsigned long long)i,
                 ray_text(&ray));
    }
}

static void none_escapes(Run *run, const Solid *solid, uint64_t n, bool is_aimed, float flat) {
    Subjects *s = subjects_new(run, &solid->scene.geometry, NULL, "%s", solid->label);
    Escape e = {solid, s, is_aimed, flat};
    run_rays(run, n, must_not_escape, &e);
    subjects_free(s);
}

static Solid small_solid(SolidShape shape, uint32_t n_keys) {
    static const uint32_t sizes[SOLIDS] = {12, 8, 6}; // about 500 triangles each
    return solid_new(shape, sizes[shape], n_keys);
}

void test_closed_static(Run *run) {
    for (int shape = 0; shape < SOLIDS; shape++) {
        Solid solid = small_solid((SolidShape)shape, 1);
        none_escapes(run, &solid, run_count(run, 2e4, 2e6), false, 0);
        solid_free(&solid);
        solid = solid_new((SolidShape)shape, 40, 1);
        none_escapes(run, &solid, run_count(run, 1e4, 1e6), false, 0);
        solid_free(&solid);
    }
}

static void each_moving(Run *run, double quick, double stress, bool is_aimed) {
    for (int shape = 0; shape < SOLIDS; shape++) {
        for (uint32_t n_keys = 2; n_keys <= 9; n_keys += 7) {
            Solid solid = small_solid((SolidShape)shape, n_keys);
            solid_move(&solid, n_keys == 2 ? 1.2 : 0.3, 0.02, 7u + n_keys);
            none_escapes(run, &solid, run_count(run, quick, stress), is_aimed, 0);
            solid_free(&solid);
        }
    }
}

void test_closed_moving(Run *run) {
    each_moving(run, 2.5e4, 2.5e6, false);
}

void test_closed_aimed(Run *run) {
    each_moving(run, 1.5e4, 1.5e6, true);
    for (int shape = 0; shape < SOLIDS; shape++) {
        Solid solid = small_solid((SolidShape)shape, 1);
        none_escapes(run, &solid, run_count(run, 2e4, 2e6), true, 0);
        solid_free(&solid);
    }
}

static bool same_place(const float *a, const float *b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

// Moves to a place whatever rests in another.
static void move_place(Solid *s, bool *is_used, const float *from, const float *to) {
    const Geometry *g = &s->scene.geometry;
    float *middle = s->scene.position + 3 * (size_t)g->n_vertices;
    for (uint32_t v = 0; v < g->n_vertices; v++) {
        if (same_place(s->scene.position + 3 * (size_t)v, from)) {
            memcpy(middle + 3 * (size_t)v, to, 3 * sizeof *to);
            is_used[v] = true;
        }
    }
}

// The middle key: every n-th triangle shrinks to its first vertex, or (every other) to an edge. No
// place is moved twice, so that what was inside stays inside.
static uint32_t close_triangles(Solid *s, uint32_t n) {
    const Geometry *g = &s->scene.geometry;
    const float *rest = s->scene.position;
    bool *is_used = calloc(g->n_vertices, sizeof *is_used);
    uint32_t n_closed = 0;
    for (uint32_t prim = 0; prim < g->n_prims; prim += n) {
        const uint32_t *index = g->index + 3 * (size_t)prim;
        if (is_used[index[0]] || is_used[index[1]] || is_used[index[2]]) {
            continue;
        }
        const float *to = rest + 3 * (size_t)index[0];
        move_place(s, is_used, to, to);
        for (uint32_t c = 1; c <= 2; c++) {
            const float *from = rest + 3 * (size_t)index[c];
            move_place(s, is_used, from, c <= 1 + n_closed % 2 ? to : from);
        }
        n_closed++;
    }
    free(is_used);
    return n_closed;
}

// At the collapsed triangles, at and beside the instant.
static void near_the_instant(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Escape *e = context;
    AccelRay ray = solid_ray(e->solid, random);
    float off = i % 3 ? ldexpf(1, -(int)(test_random(random) % 24) - 1) : 0;
    ray.f = ray.key == 0 ? 1 - off : off;
    aim_at(&e->solid->scene.geometry, &ray, (Aim)(1 + test_random(random) % (AIMS - 1)), random);
    AccelHit hit;
    if (!subjects_ask(run, e->subjects, &ray, i, &hit)) {
        run_fail(run, "%s: ray %llu escapes: %s", e->subjects->label, (unsigned long long)i,
                 ray_text(&ray));
    }
}

void test_collapse(Run *run) {
    for (int shape = 0; shape < SOLIDS; shape++) {
        for (uint32_t n = 5; n < 40; n = 2 * n + 1) {
            Solid solid = small_solid((SolidShape)shape, 3);
            uint32_t n_closed = close_triangles(&solid, n);
            run_expect(run, n_closed > 5, "%s: %u triangles close", solid.label, n_closed);
            Subjects *s = subjects_new(run, &solid.scene.geometry, NULL,
                                       "%s, every %u. closes at key 1", solid.label, n);
            Escape e = {&solid, s, true, 0};
            run_rays(run, run_count(run, 2e4, 2e6), near_the_instant, &e);
            subjects_free(s);
            solid_free(&solid);
        }
    }
}

// From a point that stays inside, and from outside: what the mesh is at that time is what is hit.
static void while_turning(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Escape *e = context;
    AccelRay ray = solid_ray(e->solid, random);
    bool is_inside = i % 2;
    int at = (int)(test_random(random) % 3);
    if (i % 4 < 2) { // close to the instant at which all is flat, or there
        float off = ldexpf(1, -(int)(test_random(random) % 25) - 1);
        ray.f = at == 0 ? 0.5f : at == 1 ? 0.5f - off : 0.5f + off;
    }
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = is_inside ? 0 : (float)(test_uniform(random) - 0.5) - 2 * ray.dir[k];
    }
    AccelHit hit;
    bool is_hit = subjects_check(run, e->subjects, &ray, i, &hit);
    if (is_inside && !is_hit && fabsf(ray.f - 0.5f) > e->flat) {
        run_fail(run, "%s: ray %llu escapes: %s", e->subjects->label, (unsigned long long)i,
                 ray_text(&ray));
    }
}

void test_inside_out(Run *run) {
    static const Affine maps[] = {{{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}},
                                  {{{-1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}}},
                                  {{{-1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, 1, 0}}},
                                  {{{-0.8, -0.6, 0, 0}, {-0.6, 0.8, 0, 0}, {0, 0, 1, 0}}}};
    for (int shape = 0; shape < SOLIDS; shape++) {
        for (int m = 0; m < 4 && shape != SOLID_TORUS; m++) {
            Solid solid = small_solid((SolidShape)shape, 2);
            solid_map(&solid, 1, &maps[m]);
            Subjects *s = subjects_new(run, &solid.scene.geometry, NULL, "%s, turned out by map %d",
                                       solid.label, m);
            // The centre of 0 stays inside as long as the rest is thicker than its roundings.
            Escape e = {&solid, s, false, 1e-5f};
            run_rays(run, run_count(run, 2000, 2e5), while_turning, &e);
            subjects_free(s);
            solid_free(&solid);
        }
    }
}
