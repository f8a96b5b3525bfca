// SPDX-License-Identifier: Apache-2.0
// Times that are known to break things: at keys and ticks, among very many keys, of what flies far.
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <math.h>
#include <stdlib.h>

// ---- At keys and ticks

// A tick's edge, or a key, or the unit in the last place before or behind it.
static float edge_time(uint64_t *random) {
    uint64_t r = test_random(random);
    float f = (float)(r % (TICKS_PER_SPAN + 1)) / TICKS_PER_SPAN;
    switch (r >> 8 & 3) {
    case 0:
        return fmaxf(nextafterf(f, -1), 0);
    case 1:
        return fminf(nextafterf(f, 2), 1);
    case 2:
        return r >> 16 & 1 ? 0x1p-149f : f; // the first instant that is not the key
    default:
        return f;
    }
}

static void at_edges(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    ray.f = edge_time(random);
    AccelHit hit;
    subjects_check(run, s, &ray, i, &hit);
}

typedef struct {
    const Solid *solid;
    const Subjects *subjects;
} Inside;

static void inside_at_edges(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Inside *in = context;
    const Geometry *g = &in->solid->scene.geometry;
    AccelRay ray = solid_ray(in->solid, random), other;
    ray.f = edge_time(random);
    other = ray;
    float p[3], q[3];
    vertex_at(g, &ray, (uint32_t)(test_random(random) % g->n_vertices), p);
    vertex_at(g, &ray, (uint32_t)(test_random(random) % g->n_vertices), q);
    AccelHit hit;
    for (int k = 0; k < 3; k++) {
        other.origin[k] = 3 * p[k] + 0.01f * q[k]; // from outside, through the middle
        other.dir[k] = q[k] - other.origin[k];
    }
    subjects_check(run, in->subjects, &ray, i, &hit);
    subjects_check(run, in->subjects, &other, i, &hit);
}

void test_time_edges(Run *run) {
    Solid solid = solid_new(SOLID_TORUS, 6, 5);
    solid_move(&solid, 0.4, 0.05, 3);
    Subjects *s = subjects_new(run, &solid.scene.geometry, NULL, "%s", solid.label);
    Inside in = {&solid, s};
    run_rays(run, run_count(run, 8e3, 1e6), inside_at_edges, &in);
    subjects_free(s);
    solid_free(&solid);
    for (uint32_t i = 0; i < 4; i++) { // fast, so that the trees cut in time
        TestScene scene =
            i % 2 ? scene_spheres(100, 5, 0.05, 0.3, i) : scene_soup(100, 5, 0.1, 0.3, i);
        if (i >= 2) { // spans of very different lengths
            for (uint32_t k = 0; k < 4; k++) {
                scene.share[k] = pow(10, -3.0 * k);
            }
        }
        s = subjects_new(run, &scene.geometry, NULL, "test_time_edges, scene %u", i);
        run_rays(run, run_count(run, 5e3, 1e6), at_edges, s);
        subjects_free(s);
        scene_free(&scene);
    }
}

// ---- Flying

typedef struct {
    const Subjects *subjects;
    double size;
    uint64_t *n_met; // of rays that surely meet what they are aimed at
} Flight;

static void at_flying(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Flight *f = context;
    const Geometry *g = f->subjects->geometry;
    AccelRay ray = ray_random(g, random);
    uint32_t prim = (uint32_t)(test_random(random) % g->n_prims);
    float p[3];
    for (uint32_t c = 0; c < 3; c++) {
        vertex_at(g, &ray, g->index ? 3 * prim + c : prim, p);
        for (int k = 0; k < 3; k++) {
            ray.dir[k] = (c == 0 ? -ray.origin[k] : ray.dir[k]) + p[k] / 3;
        }
    }
    // From close by: what is far away is smaller than the rounding of the ray.
    for (int k = 0; k < 3; k++) {
        float to = ray.origin[k] + ray.dir[k];
        ray.origin[k] = to - (float)(8 * f->size) * ray.dir[k];
    }
    AccelHit hit;
    subjects_check(run, f->subjects, &ray, i, &hit);
    if (meet_prim(g, &ray, prim).is_met == SURELY) {
#pragma omp atomic
        *f->n_met += 1;
    }
}

void test_fast(Run *run) {
    for (uint32_t i = 0; i < 8; i++) {
        double size = pow(10, -3.0 - i / 2);
        size = size < 1e-6 ? 1e-6 : size;
        TestScene scene =
            i % 2 ? scene_spheres(40, 3, size, 0.5, i) : scene_soup(40, 3, size, 0, i);
        for (uint32_t k = 0; k < 3 && i % 2 == 0; k++) { // whole triangles fly
            for (uint32_t v = 0; v < 120; v++) {
                uint64_t way = 1000 + v / 3 + 40 * k;
                for (uint32_t c = 0; c < 3; c++) {
                    scene.position[3 * (size_t)(120 * k + v) + c] +=
                        (float)(test_uniform(&way) - 0.5);
                }
            }
        }
        Subjects *s =
            subjects_new(run, &scene.geometry, NULL, "test_fast, scene %u, size %g", i, size);
        uint64_t n_met = 0, n = run_count(run, 5e3, 5e5);
        Flight f = {s, size, &n_met};
        run_rays(run, n, at_flying, &f);
        run_expect(run, size < 2e-6 || n_met > n / 20, "%s: %llu rays of %llu met anything",
                   s->label, (unsigned long long)n_met, (unsigned long long)n);
        subjects_free(s);
        scene_free(&scene);
    }
}

// ---- Instants of the same motion, cut into more keys

static void at_many_keys(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    const Geometry *g = s->geometry;
    AccelRay ray = ray_random(g, random);
    if (i % 3 == 0) {
        ray.f = edge_time(random);
    }
    if (i % 7 == 0) {
        ray.key = i % 2 ? g->n_keys - 2 : 0;
    }
    float p[3];
    vertex_at(g, &ray, (uint32_t)(test_random(random) % g->n_vertices), p);
    for (int k = 0; k < 3; k++) {
        ray.dir[k] = p[k] - ray.origin[k] + (float)(0.1 * (test_uniform(random) - 0.5));
    }
    AccelHit hit;
    subjects_check(run, s, &ray, i, &hit);
}

// Accel knows keys only; the shutter of 1e6 seconds is in tests/stability/test_late.c.
void many_keys_of_accel(Run *run);
void many_keys_of_accel(Run *run) {
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t n_keys = i < 2 ? 100000 : 10000, n_prims = i < 2 ? 2 : 20;
        TestScene scene = i % 2 ? scene_spheres(n_prims, n_keys, 0.1, 0.001, i)
                                : scene_soup(n_prims, n_keys, 0.2, 0.001, i);
        // A walk that stays about where it began.
        for (size_t k = 0; k < 3 * (size_t)n_keys * scene.geometry.n_vertices; k++) {
            scene.position[k] = (float)sin(2 * scene.position[k]) / 2;
        }
        Subjects *s =
            subjects_new(run, &scene.geometry, NULL, "%u primitives, %u keys", n_prims, n_keys);
        run_rays(run, run_count(run, 5e3, 1e6), at_many_keys, s);
        subjects_free(s);
        scene_free(&scene);
    }
}
