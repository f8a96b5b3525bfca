// SPDX-License-Identifier: Apache-2.0
// Rays that are known to break things: along axes, within planes, with tiny and with no numbers.
#include "accel/kd4_accel.h"
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Cubes on a grid

enum { SIDE = 4, CUBES = SIDE * SIDE * SIDE, GRAIN = 128, GRID_RAYS = 26 * 729 * 3 * 2 };

static TestScene cubes(void) {
    static const uint32_t quads[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
    static const uint32_t corner[6] = {0, 1, 2, 0, 2, 3};
    TestScene s = scene_new(GEOMETRY_TRIANGLES, 12 * CUBES, 8 * CUBES, 2);
    for (uint32_t i = 0; i < 16 * CUBES; i++) {
        uint32_t k = i / (8 * CUBES), c = i / 8 % CUBES, v = i % 8;
        float *p = s.position + 3 * (size_t)i;
        p[0] = (float)(c % SIDE) / SIDE + (v & 1 ? 0.25f : 0) - 0.5f;
        p[1] = (float)(c / SIDE % SIDE) / SIDE + (v & 2 ? 0.125f : 0) - 0.5f;
        p[2] = (float)(c / SIDE / SIDE) / SIDE + (v & 4 ? 0.125f : 0) - 0.5f + (k ? 0.125f : 0);
    }
    for (uint32_t i = 0; i < 36 * CUBES; i++) {
        s.index[i] = 8 * (i / 36) + quads[i / 6 % 6][corner[i % 6]];
    }
    return s;
}

// Where and whether a ray meets an axis-aligned triangle, closed, in whole numbers. f2 is 2 f.
static bool meet_exactly(const Geometry *g, uint32_t prim, int f2, const int o[3], const int d[3],
                         int *t) {
    int p[3][3];
    for (int c = 0; c < 3; c++) {
        const float *a = g->position + 3 * (size_t)g->index[3 * (size_t)prim + (size_t)c];
        const float *b = a + 3 * (size_t)g->n_vertices;
        for (int k = 0; k < 3; k++) {
            p[c][k] = (int)(GRAIN / 2 * (a[k] * (float)(2 - f2) + b[k] * (float)f2));
        }
    }
    int n = 0;
    while (p[0][n] != p[1][n] || p[0][n] != p[2][n]) {
        n++;
    }
    if (d[n] == 0) {
        return false;
    }
    *t = (p[0][n] - o[n]) * d[n]; // d is -1 or 1
    int x = (n + 1) % 3, y = (n + 2) % 3, qx = o[x] + *t * d[x], qy = o[y] + *t * d[y];
    bool is_plus = true, is_minus = true;
    for (int c = 0; c < 3; c++) {
        const int *a = p[c], *b = p[(c + 1) % 3];
        int e = (a[x] - qx) * (b[y] - qy) - (a[y] - qy) * (b[x] - qx);
        is_plus = is_plus && e >= 0;
        is_minus = is_minus && e <= 0;
    }
    return *t > 0 && (is_plus || is_minus);
}

static void along_the_grid(Run *run, void *context, uint64_t i, uint64_t *random) {
    (void)random;
    const Subjects *s = context;
    i = i * 48271 % GRID_RAYS; // through all the cases, if not all are asked
    int way = (int)(i % 26), at = (int)(i / 26 % 729), f2 = (int)(i / 26 / 729 % 3);
    way += way > 12;
    const int d[3] = {way % 3 - 1, way / 3 % 3 - 1, way / 9 - 1};
    const int o[3] = {GRAIN / 8 * (at % 9) - GRAIN / 2, GRAIN / 8 * (at / 9 % 9) - GRAIN / 2,
                      GRAIN / 8 * (at / 81) - GRAIN / 2};
    bool from_outside = i / 26 / 729 / 3 % 2;
    AccelRay ray = {.tmax = INFINITY, .f = (float)f2 / 2};
    int start[3];
    for (int k = 0; k < 3; k++) {
        start[k] = o[k] - (from_outside ? 2 * GRAIN * d[k] : 0);
        ray.origin[k] = (float)start[k] / GRAIN;
        ray.dir[k] = (float)d[k];
    }
    int best_t = INT32_MAX, best_prim = -1;
    for (uint32_t prim = 0; prim < s->geometry->n_prims; prim++) {
        int t;
        if (meet_exactly(s->geometry, prim, f2, start, d, &t) && t < best_t) {
            best_t = t;
            best_prim = (int)prim;
        }
    }
    AccelHit hit;
    bool is_hit = subjects_ask(run, s, &ray, i, &hit);
    bool is_right =
        is_hit ? best_prim == hit.prim && hit.t == (float)best_t / GRAIN : best_prim < 0;
    if (!is_right) {
        run_fail(run, "cubes on a grid, ray %llu: %s\n  %s, exactly: t %d/%d, prim %d",
                 (unsigned long long)i, ray_text(&ray), hit_text(is_hit, &hit), best_t, GRAIN,
                 best_prim);
    }
}

void test_grid_directions(Run *run) {
    TestScene scene = cubes();
    Subjects *s = subjects_new(run, &scene.geometry, NULL, "cubes on a grid");
    uint64_t n = run_count(run, 3e4, GRID_RAYS);
    run_rays(run, n < GRID_RAYS ? n : GRID_RAYS, along_the_grid, s);
    subjects_free(s);
    scene_free(&scene);
}

// ---- In planes

typedef struct {
    float at;
    int axis;
} Plane;

typedef struct {
    const Subjects *subjects;
    Plane *planes;
    uint64_t n;
} Planes;

static void add_plane(Planes *p, int axis, float at) {
    if ((p->n & (p->n + 1)) == 0) {
        p->planes = realloc(p->planes, (2 * p->n + 2) * sizeof *p->planes);
    }
    p->planes[p->n++] = (Plane){at, axis};
}

static void add_kd_planes(Planes *p, const Kd4Tree *tree) {
    uint32_t stack[2 * KD4_STACK], top = 0;
    if (tree->nodes) {
        stack[top++] = KD4_ROOT;
    }
    while (top > 0) {
        Kd4Node node = tree->nodes[stack[--top]];
        if (kd4_tag(node) < KD4_TIME) {
            add_plane(p, (int)kd4_tag(node), node.split);
        }
        if (kd4_tag(node) != KD4_LEAF) {
            stack[top++] = kd4_index(node);
            stack[top++] = kd4_index(node) + 1;
        }
    }
}

static void within_planes(Run *run, void *context, uint64_t i, uint64_t *random) {
    static const float tiny[] = {0, -0.0f, 0x1p-149f, -0x1p-140f, 0x1p-126f, -1e-30f};
    const Planes *p = context;
    const Geometry *g = p->subjects->geometry;
    AccelRay ray = ray_random(g, random);
    Plane plane = p->planes[test_random(random) % p->n];
    if (i % 3 == 0) { // the plane of a vertex at that time, or of a box around it
        float at[3];
        vertex_at(g, &ray, (uint32_t)(test_random(random) % g->n_vertices), at);
        plane.axis = (int)(test_random(random) % 3);
        plane.at = at[plane.axis];
        int n_steps = (int)(test_random(random) % 24) - 12;
        for (int k = 0; k < abs(n_steps); k++) {
            plane.at = nextafterf(plane.at, n_steps < 0 ? -INFINITY : INFINITY);
        }
    }
    ray.origin[plane.axis] = plane.at;
    ray.dir[plane.axis] = tiny[test_random(random) % 6];
    if (i % 5 == 0) {
        ray.dir[(plane.axis + 1) % 3] = tiny[test_random(random) % 6];
    }
    AccelHit hit;
    subjects_check(run, p->subjects, &ray, i, &hit);
}

static void ask_planes(Run *run, const Geometry *g, const char *label, uint64_t n) {
    Planes p = {.subjects = subjects_new(run, g, NULL, "%s", label)};
    for (int i = 0; i < p.subjects->n; i++) {
        const Subject *s = &p.subjects->at[i];
        if (strncmp(s->type->name, "kd", 2) == 0 && strcmp(s->cpu, "scalar") == 0) {
            add_kd_planes(&p, &((const struct Kd4Accel *)s->accel)->tree);
        }
    }
    if (run_expect(run, p.n > 20, "%s: the trees have %llu planes", label,
                   (unsigned long long)p.n)) {
        run_rays(run, n, within_planes, &p);
    }
    free(p.planes);
    subjects_free((Subjects *)p.subjects);
}

void test_splitting_planes(Run *run) {
    TestScene scene = scene_soup(300, 3, 0.1, 0.03, 8);
    ask_planes(run, &scene.geometry, "scene_soup(300, 3, 0.1, 0.03, 8)", run_count(run, 1e4, 2e6));
    scene_free(&scene);
    scene = cubes();
    ask_planes(run, &scene.geometry, "cubes on a grid", run_count(run, 5e3, 5e5));
    scene_free(&scene);
}

// ---- Tiny and huge components

static void odd_components(Run *run, void *context, uint64_t i, uint64_t *random) {
    static const float values[] = {0,       -0.0f,  0x1p-149f, -0x1p-149f, 1e-40f, -1e-40f, 1e-38f,
                                   -1e-38f, 1e-20f, -1e-20f,   1,          -1,     1e38f,   -1e38f};
    enum { N = sizeof values / sizeof *values };
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    uint64_t way = i % (N * N * N);
    float p[3];
    ray.dir[0] = values[way % N], ray.dir[1] = values[way / N % N],
    ray.dir[2] = values[way / N / N];
    // Towards something: the large components are what decides.
    float most = fmaxf(fabsf(ray.dir[0]), fmaxf(fabsf(ray.dir[1]), fabsf(ray.dir[2])));
    vertex_at(s->geometry, &ray, (uint32_t)(test_random(random) % s->geometry->n_vertices), p);
    for (int k = 0; k < 3; k++) {
        float step = most > 0 ? ray.dir[k] / most : 0;
        ray.origin[k] = p[k] - 1.5f * step + (float)(0.05 * (test_uniform(random) - 0.5));
    }
    AccelHit hit;
    bool is_hit = subjects_check(run, s, &ray, i, &hit);
    if (most == 0 && is_hit) {
        run_fail(run, "a ray without direction hits: %s", ray_text(&ray));
    }
}

void test_small_components(Run *run) {
    TestScene scene = scene_soup(200, 3, 0.15, 0.05, 3);
    Subjects *s = subjects_new(run, &scene.geometry, NULL, "scene_soup(200, 3, 0.15, 0.05, 3)");
    run_rays(run, run_count(run, 14e3, 2e6), odd_components, s);
    subjects_free(s);
    scene_free(&scene);
    scene = scene_spheres(200, 3, 0.08, 0.05, 3);
    s = subjects_new(run, &scene.geometry, NULL, "scene_spheres(200, 3, 0.08, 0.05, 3)");
    run_rays(run, run_count(run, 6e3, 1e6), odd_components, s);
    subjects_free(s);
    scene_free(&scene);
}

// ---- No rays

enum { WAYS = 24 };

// Makes a ray invalid in one of WAYS ways.
static void spoil(AccelRay *ray, int way, uint32_t n_spans) {
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    switch (way) {
    default: // 0 to 17
        *(way < 9 ? &ray->origin[way / 3] : &ray->dir[way / 3 - 3]) = bad[way % 3];
        break;
    case 18:
        ray->tmin = NAN;
        break;
    case 19:
        ray->tmax = NAN;
        break;
    case 20:
        ray->f = ray->f < 0.5f ? nextafterf(0, -1) : nextafterf(1, 2);
        break;
    case 21:
        ray->f = NAN;
        break;
    case 22:
        ray->key = n_spans + (ray->f < 0.5f ? 0 : UINT32_MAX - n_spans);
        break;
    case 23:
        ray->tmax = ray->tmin - 0.5f;
        break;
    }
}

static void is_no_ray(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    const Geometry *g = s->geometry;
    AccelRay ray = ray_random(g, random);
    spoil(&ray, (int)(i % WAYS), g->n_keys > 1 ? g->n_keys - 1 : 1);
    if (i / WAYS % 4 == 3) {
        spoil(&ray, (int)(test_random(random) % WAYS), g->n_keys > 1 ? g->n_keys - 1 : 1);
    }
    for (int k = 0; k < s->n; k++) {
        const Subject *subject = &s->at[k];
        AccelHit hit = {.prim = 77};
        AccelCounters count = {0};
        bool is_hit = subject->type->closest(subject->accel, &ray, &hit, &count);
        bool is_occluded = subject->type->occluded(subject->accel, &ray, &count);
        uint64_t most = 8 * (subject->stats.n_nodes + 1);
        if (is_hit || hit.prim != ACCEL_NO_PRIM || is_occluded || count.nodes > most) {
            run_fail(run, "%s, %s on %s: %s: %s, %llu nodes", s->label, subject->type->name,
                     subject->cpu, ray_text(&ray), hit_text(is_hit, &hit),
                     (unsigned long long)count.nodes);
        }
    }
    count_queries(2 * (uint64_t)s->n);
}

// Rays with all numbers, from anywhere: no node is met more than a few times.
static void few_steps(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    int exponent = (int)(test_random(random) % 120) - 20;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = i % 2 ? ldexpf(ray.origin[k], exponent) : ray.origin[k];
    }
    ray.tmin = i % 3 ? 0 : -1e36f;
    for (int k = 0; k < s->n; k++) {
        const Subject *subject = &s->at[k];
        AccelHit hit;
        AccelCounters count = {0};
        subject->type->closest(subject->accel, &ray, &hit, &count);
        uint64_t most = 4 * (subject->stats.n_nodes + 1);
        if (count.nodes > most) {
            run_fail(run, "%s, %s on %s: %s: %llu of %llu nodes", s->label, subject->type->name,
                     subject->cpu, ray_text(&ray), (unsigned long long)count.nodes,
                     (unsigned long long)subject->stats.n_nodes);
        }
    }
    count_queries((uint64_t)s->n);
    AccelHit hit;
    subjects_check(run, s, &ray, i, &hit);
}

void test_bad_rays(Run *run) {
    for (int i = 0; i < 3; i++) {
        TestScene scene = i == 0   ? scene_soup(200, 4, 0.2, 0.1, 3)
                          : i == 1 ? scene_spheres(200, 4, 0.1, 0.1, 3)
                                   : scene_soup(200, 1, 0.2, 0.1, 3);
        Subjects *s = subjects_new(run, &scene.geometry, NULL,
                                   i == 0   ? "scene_soup(200, 4, 0.2, 0.1, 3)"
                                   : i == 1 ? "scene_spheres(200, 4, 0.1, 0.1, 3)"
                                            : "scene_soup(200, 1, 0.2, 0.1, 3)");
        run_rays(run, run_count(run, 5e3, 5e5), is_no_ray, s);
        run_rays(run, run_count(run, 2e3, 2e5), few_steps, s);
        subjects_free(s);
        scene_free(&scene);
    }
}
