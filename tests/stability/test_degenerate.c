// SPDX-License-Identifier: Apache-2.0
// Triangles that hardly are any: slivers, points and lines, many in one place, not finite.
#include "accel/intersect.h"
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <float.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- Slivers

// Whole numbers of their own for each axis: the determinant of three points takes one coordinate of
// each axis in every term, so 25 + 25 + 65 bits and two for the sum are all it needs.
__extension__ typedef __int128 Int128;

typedef struct {
    const Subjects *subjects;
    int axis;   // that the slivers lie along
    int narrow; // 2^-narrow: how thin they are
    int bits[3];
} Slivers;

enum { LONG_BITS = 23 };

static void grid_bits(Slivers *s) {
    s->bits[s->axis] = LONG_BITS;
    s->bits[(s->axis + 1) % 3] = s->bits[(s->axis + 2) % 3] = LONG_BITS + s->narrow;
}

static float on_grid(uint64_t *random, int narrow) {
    return ldexpf((float)((int64_t)(test_random(random) % (1 << 23)) - (1 << 22)), -23 - narrow);
}

static int exact_sign(const Slivers *s, const float d[3], const Int128 a[3], const Int128 b[3]) {
    Int128 n[3], sum = 0;
    for (int k = 0; k < 3; k++) {
        n[k] = (Int128)ldexp(d[k], s->bits[k]);
    }
    for (int k = 0; k < 3; k++) {
        int x = (k + 1) % 3, y = (k + 2) % 3;
        sum += n[k] * (a[x] * b[y] - a[y] * b[x]);
    }
    return (sum > 0) - (sum < 0);
}

static bool exactly_inside(const Slivers *s, const AccelRay *ray, uint32_t prim) {
    const Geometry *g = s->subjects->geometry;
    Int128 a[3][3];
    for (int c = 0; c < 3; c++) {
        const float *p = g->position + 3 * (size_t)g->index[3 * (size_t)prim + (size_t)c];
        for (int k = 0; k < 3; k++) {
            a[c][k] = (Int128)ldexp(p[k], s->bits[k]) - (Int128)ldexp(ray->origin[k], s->bits[k]);
        }
    }
    int plus = 0, minus = 0;
    for (int c = 0; c < 3; c++) {
        int sign = exact_sign(s, ray->dir, a[c], a[(c + 1) % 3]);
        plus += sign >= 0;
        minus += sign <= 0;
    }
    return plus == 3 || minus == 3;
}

// What the kernel sees: vertices sheared in float. Products of floats are exact in double, so these
// signs are exact.
static bool inside_as_sheared(const Geometry *g, const RayState *r, uint32_t prim, bool *is_flat) {
    float x[3], y[3];
    for (int c = 0; c < 3; c++) {
        size_t v = 3 * (size_t)g->index[3 * (size_t)prim + (size_t)c];
        float px = r->a[v + (size_t)r->kx] - r->o[r->kx],
              py = r->a[v + (size_t)r->ky] - r->o[r->ky];
        float pz = r->a[v + (size_t)r->kz] - r->o[r->kz];
        x[c] = fmaf(-r->sx, pz, px);
        y[c] = fmaf(-r->sy, pz, py);
    }
    bool is_plus = true, is_minus = true;
    *is_flat = true;
    for (int c = 0; c < 3; c++) {
        int i = (c + 2) % 3, j = (c + 1) % 3;
        double left = (double)x[i] * y[j], right = (double)y[i] * x[j];
        is_plus = is_plus && left >= right;
        is_minus = is_minus && left <= right;
        *is_flat = *is_flat && left == right;
    }
    return is_plus || is_minus;
}

static void expect_signs(Run *run, const Slivers *s, const AccelRay *ray, uint64_t i, bool is_hit,
                         const AccelHit *hit) {
    const Geometry *g = s->subjects->geometry;
    RayState state;
    bool is_seen = false;
    if (!ray_prepare(g, ray, &state)) {
        return;
    }
    for (uint32_t prim = 0; prim < g->n_prims; prim++) {
        Meeting m = meet_prim(g, ray, prim);
        bool is_flat, is_inside = inside_as_sheared(g, &state, prim, &is_flat);
        bool is_exactly = exactly_inside(s, ray, prim);
        is_seen = is_seen || (is_inside && !is_flat && m.hi > ray->tmin);
        if ((m.is_met == SURELY && !is_exactly) || (m.is_met == SURELY_NOT && is_exactly)) {
            run_fail(run, "%s, ray %llu: %s: the oracle is wrong of %u", s->subjects->label,
                     (unsigned long long)i, ray_text(ray), prim);
        }
        if (is_hit && (uint32_t)hit->prim == prim && !(is_inside && !is_flat)) {
            run_fail(run, "%s, ray %llu: %s: %s, but the exact signs of what is sheared differ",
                     s->subjects->label, (unsigned long long)i, ray_text(ray),
                     hit_text(is_hit, hit));
        }
    }
    if (is_seen && !is_hit && ray->tmin < -1) {
        run_fail(run, "%s, ray %llu: %s: missed what exact signs say is hit", s->subjects->label,
                 (unsigned long long)i, ray_text(ray));
    }
}

static void at_slivers(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Slivers *s = context;
    const Geometry *g = s->subjects->geometry;
    AccelRay ray = {.tmin = i % 2 ? -100 : 0, .tmax = INFINITY};
    // From the side, within the plane that is as thin as the slivers, at a point of one of them.
    const float *p = g->position + 9 * (test_random(random) % g->n_prims);
    int x = s->axis, y = (x + 1 + (int)(i % 2)) % 3, z = 3 - x - y;
    float along = ldexpf((float)((test_random(random) % 1024)), -10);
    float at = p[x] + along * (p[3 + x] - p[x]);
    ray.origin[z] = i % 4 < 2 ? -0.5f : 0.5f;
    ray.dir[z] = i % 4 < 2 ? 1 : -1;
    ray.origin[y] = i % 3 ? p[y] + along * (p[3 + y] - p[y]) : on_grid(random, s->narrow);
    ray.origin[y] = ldexpf(rintf(ldexpf(ray.origin[y], s->bits[y])), -s->bits[y]);
    ray.dir[y] = i % 5 ? 0 : on_grid(random, s->narrow);
    float slope = i % 7 ? (float)((int)(test_random(random) % 17) - 8) / 16 : 0;
    ray.dir[x] = slope;
    ray.origin[x] = at - 0.5f * slope;
    ray.origin[x] = ldexpf(rintf(ldexpf(ray.origin[x], LONG_BITS)), -LONG_BITS);
    AccelHit hit;
    bool is_hit = subjects_check(run, s->subjects, &ray, i, &hit);
    expect_signs(run, s, &ray, i, is_hit, &hit);
}

void test_slivers(Run *run) {
    static const int narrow[] = {10, 16, 22, 28, 34, 39};
    for (int i = 0; i < 18; i++) {
        Slivers s = {.axis = i % 3, .narrow = narrow[i / 3]};
        TestScene scene = scene_new(GEOMETRY_TRIANGLES, 60, 180, 1);
        uint64_t random = 100u + (uint64_t)i;
        for (uint32_t v = 0; v < 180; v++) {
            scene.index[v] = v;
            for (int k = 0; k < 3; k++) {
                scene.position[3 * v + (uint32_t)k] = on_grid(&random, k == s.axis ? 0 : s.narrow);
            }
            if (v % 3 == 0) { // from one side to the other
                scene.position[3 * v + (uint32_t)s.axis] = -0.5f;
            } else if (v % 3 == 1) {
                scene.position[3 * v + (uint32_t)s.axis] = 0.5f;
            }
        }
        grid_bits(&s);
        Subjects *subjects = subjects_new(run, &scene.geometry, NULL,
                                          "slivers along axis %d, 2^-%d thin", s.axis, s.narrow);
        s.subjects = subjects;
        run_rays(run, run_count(run, 1000, 2e5), at_slivers, &s);
        subjects_free(subjects);
        scene_free(&scene);
    }
}

// ---- No area

enum { FLAT_KINDS = 4, FLATS = 80 };

// Points, two vertices in one place, lines along an axis, lines in any direction.
static TestScene flat_scene(uint32_t n_keys) {
    TestScene s = scene_soup(FLATS, n_keys, 0.3, 0.1, 5);
    for (uint32_t i = 0; i < FLATS * n_keys; i++) {
        float *p = s.position + 9 * (size_t)i;
        uint32_t kind = i % FLATS % FLAT_KINDS;
        for (int k = 0; k < 9; k++) { // few bits, so that sums are exact
            p[k] = rintf(p[k] * 1024) / 1024;
        }
        if (kind == 0) {
            memcpy(p + 3, p, 12);
        }
        if (kind < 2) {
            memcpy(p + 6, p + 3, 12);
        }
        for (int k = 0; k < 3 && kind >= 2; k++) {
            float step = kind == 3 || k == (int)(i % FLATS / FLAT_KINDS % 3) ? p[3 + k] - p[k] : 0;
            p[3 + k] = p[k] + step;
            p[6 + k] = p[k] + 2 * step;
        }
    }
    return s;
}

static void at_flat(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    const Geometry *g = s->geometry;
    AccelRay ray = ray_random(g, random);
    uint32_t prim = (uint32_t)(test_random(random) % g->n_prims);
    float a[3], b[3], along = (float)(test_random(random) % 17) / 8;
    vertex_at(g, &ray, 3 * prim, a);
    vertex_at(g, &ray, 3 * prim + 1, b);
    for (int k = 0; k < 3; k++) {
        float to = a[k] + along * (b[k] - a[k]);
        ray.dir[k] = i % 4 ? to - ray.origin[k] : b[k] - a[k];
        ray.origin[k] = i % 4 ? ray.origin[k] : a[k] - 3 * ray.dir[k];
    }
    AccelHit hit;
    bool is_hit = subjects_check(run, s, &ray, i, &hit);
    // A line may get an area where its vertices are rounded, and may then be hit within that
    // rounding, which the oracle has seen to. Its other coordinates are not rounded apart where it
    // lies along an axis across the ray.
    int kz = fabsf(ray.dir[0]) > fabsf(ray.dir[1]) ? 0 : 1;
    kz = fabsf(ray.dir[2]) > fabsf(ray.dir[kz]) ? 2 : kz;
    int kind = hit.prim % FLAT_KINDS, axis = hit.prim / FLAT_KINDS % 3;
    if (is_hit && (kind < 2 || (kind == 2 && axis != kz))) {
        run_fail(run, "%s, ray %llu: %s hits what has no area: %s", s->label, (unsigned long long)i,
                 ray_text(&ray), hit_text(is_hit, &hit));
    }
}

void test_zero_area(Run *run) {
    for (uint32_t n_keys = 1; n_keys < 4; n_keys++) {
        TestScene scene = flat_scene(n_keys);
        Subjects *s = subjects_new(run, &scene.geometry, NULL, "flat_scene(%u)", n_keys);
        run_rays(run, run_count(run, 6e3, 1e6), at_flat, s);
        subjects_free(s);
        scene_free(&scene);
    }
}

// ---- In one place

static void lowest_wins(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    float p[3], w = (float)test_uniform(random);
    for (uint32_t v = 0; v < 3; v++) {
        vertex_at(s->geometry, &ray, v, p);
        float part = v == 2 ? 1 - w : w * 0.5f;
        for (int k = 0; k < 3; k++) {
            ray.dir[k] = (v == 0 ? -ray.origin[k] : ray.dir[k]) + part * p[k];
        }
    }
    AccelHit hit;
    bool is_hit = subjects_ask(run, s, &ray, i, &hit);
    if (!is_hit || hit.prim != 0) {
        run_fail(run, "%s, ray %llu: %s: %s", s->label, (unsigned long long)i, ray_text(&ray),
                 hit_text(is_hit, &hit));
    }
}

void test_coincident(Run *run) {
    static const uint32_t orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                          {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    enum { COPIES = 10000, MOST_SECONDS = 60, MOST_DEPTH = 136 };
    for (uint32_t n_keys = 1; n_keys <= 3; n_keys += 2) {
        TestScene one = scene_soup(1, n_keys, 0.4, 0.1, 5);
        TestScene scene = scene_new(GEOMETRY_TRIANGLES, COPIES, 3, n_keys);
        memcpy(scene.position, one.position, 9 * n_keys * sizeof(float));
        for (uint32_t i = 0; i < 3 * COPIES; i++) {
            scene.index[i] = orders[i / 3 % 6][i % 3];
        }
        double start = omp_get_wtime();
        Subjects *s =
            subjects_new(run, &scene.geometry, NULL, "%d in one place, %u keys", COPIES, n_keys);
        double seconds = omp_get_wtime() - start;
        run_expect(run, seconds < MOST_SECONDS, "the builds took %.1f s", seconds);
        for (int k = 0; k < s->n; k++) {
            run_expect(run, s->at[k].stats.n_depth <= MOST_DEPTH, "%s is %llu deep",
                       s->at[k].type->name, (unsigned long long)s->at[k].stats.n_depth);
        }
        run_rays(run, run_count(run, 200, 20000), lowest_wins, s);
        subjects_free(s);
        scene_free(&scene);
        scene_free(&one);
    }
}

// ---- Not finite

static void around_bad_vertices(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    const Geometry *g = s->geometry;
    AccelRay ray = ray_random(g, random);
    if (i % 2) { // at one of the primitives, where it is
        float p[3];
        uint32_t prim = (uint32_t)(test_random(random) % g->n_prims);
        vertex_at(g, &ray, g->index ? g->index[3 * prim] : prim, p);
        for (int k = 0; k < 3 && isfinite(p[0] + p[1] + p[2]); k++) {
            ray.dir[k] = p[k] - ray.origin[k] + (float)(0.02 * (test_uniform(random) - 0.5));
        }
    }
    ray.f = i % 5 ? ray.f : (float)(i / 5 % 2);
    AccelHit hit;
    subjects_check(run, s, &ray, i, &hit);
}

void test_bad_vertices(Run *run) {
    static const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    enum { PRIMS = 60, KEYS = 6 };
    for (int i = 0; i < 6; i++) {
        bool is_spheres = i % 2;
        uint64_t random = 40u + (uint64_t)i;
        TestScene scene = is_spheres ? scene_spheres(PRIMS, KEYS, 0.1, 0.1, random)
                                     : scene_soup(PRIMS, KEYS, 0.15, 0.1, random);
        for (uint32_t k = 0; k < 30; k++) {
            uint64_t n = (uint64_t)scene.geometry.n_vertices * KEYS, at = test_random(&random) % n;
            scene.position[3 * at + k % 3] = bad[k % (i < 4 ? 3 : 5)];
            if (is_spheres && k % 4 == 0) {
                scene.radius[test_random(&random) % n] = k % 8 ? bad[k % 3] : -1;
            }
        }
        AccelOptions options = accel_options_default();
        options.leaf_size = i < 2 ? 1 : 8;
        Subjects *s =
            subjects_new(run, &scene.geometry, &options, "test_bad_vertices, scene %d", i);
        run_rays(run, run_count(run, 3e3, 5e5), around_bad_vertices, s);
        subjects_free(s);
        scene_free(&scene);
    }
}
