// SPDX-License-Identifier: Apache-2.0
// What the answer must not depend on: memory, threads, options, how motion is cut into keys, the
// processor's treatment of denormals; and that boxes hold what is in them.
#include "accel/cpu.h"
#include "accel/intersect.h"
#include "accel/segment.h"
#include "tests/stability/counted.h"
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

static void random_rays(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    AccelHit hit;
    subjects_ask(run, s, &ray, i, &hit);
}

// ---- Memory

typedef struct {
    Subjects subjects; // brute, and the structure in question
    const char *label;
} Bounded;

// One structure alone, under a bound; its rays against those of brute.
static void build_within(Run *run, Bounded *b, const AccelType *type, size_t bound) {
    Subjects *s = &b->subjects;
    AccelOptions options = accel_options_default();
    options.memory = bound;
    Subject *subject = &s->at[1];
    *subject = (Subject){.type = type, .cpu = "the best", .every = 1};
    omp_set_num_threads(1);
    counted_begin();
    subject->accel = type->build(s->geometry, &options, &subject->stats);
    Counted counted = counted_end();
    omp_set_num_threads(omp_get_num_procs());
    snprintf(s->label, sizeof s->label, "%s, %s within %zu bytes", b->label, type->name, bound);
    if (!run_expect(run, subject->accel, "%s: nothing was built", s->label)) {
        return;
    }
    char why[300] = "";
    size_t reported = subject->stats.peak_bytes, taken = counted.peak;
    run_expect(run, (bound == 0 || (taken <= bound && reported <= bound)) && taken <= reported,
               "%s: %zu bytes were taken, %zu reported", s->label, taken, reported);
    run_expect(run, subject->accel->type->validate(subject->accel, why, sizeof why),
               "%s: not valid: %s", s->label, why);
    s->n = 2;
    run_rays(run, run_count(run, 200, 2e4), random_rays, s);
    subject->accel->type->destroy(subject->accel);
    s->n = 1;
}

static void bound_each(Run *run, Bounded *b, const Geometry *g, const char *label) {
    static const double shares[] = {0.001, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 0.95, 1.01, 1.5, 4};
    AccelOptions options = accel_options_default();
    Subjects *s = &b->subjects;
    b->label = label;
    *s = (Subjects){.n = 1, .geometry = g};
    s->at[0] = (Subject){.type = accel_find("brute"), .cpu = "the best", .every = 1};
    s->at[0].accel = s->at[0].type->build(g, &options, &s->at[0].stats);
    for (const AccelType *type = accel_types; type->name; type++) {
        build_within(run, b, type, 0);
        size_t least = 1000, whole = s->at[1].stats.peak_bytes;
        for (size_t i = 0; i < sizeof shares / sizeof *shares; i++) {
            build_within(run, b, type, least + (size_t)(shares[i] * (double)whole));
        }
    }
    s->at[0].type->destroy(s->at[0].accel);
}

void test_memory_bound(Run *run) {
    Bounded b = {0};
    for (uint32_t n_keys = 1; n_keys <= 9; n_keys += 8) {
        Solid solid = solid_new(SOLID_SPHERE, 10, n_keys);
        solid_move(&solid, 0.3, 0.03, 2);
        bound_each(run, &b, &solid.scene.geometry, solid.label);
        solid_free(&solid);
    }
    TestScene scene = scene_soup(400, 3, 0.05, 0.3, 6);
    bound_each(run, &b, &scene.geometry, "scene_soup(400, 3, 0.05, 0.3, 6)");
    scene_free(&scene);
    scene = scene_spheres(400, 3, 0.05, 0.3, 6);
    bound_each(run, &b, &scene.geometry, "scene_spheres(400, 3, 0.05, 0.3, 6)");
    scene_free(&scene);
}

// ---- Options

typedef struct {
    const Subjects *a, *b;
    bool is_same_tree; // built alike, so even the work must be
} Pair;

static void alike(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Pair *p = context;
    AccelRay ray = ray_random(p->a->geometry, random);
    for (int k = 0; k < p->a->n; k++) {
        const Accel *x = p->a->at[k].accel, *y = p->b->at[k].accel;
        AccelHit hx = {0}, hy = {0};
        AccelCounters cx = {0}, cy = {0};
        bool is_x = x->type->closest(x, &ray, &hx, &cx), is_y = y->type->closest(y, &ray, &hy, &cy);
        bool is_work = !p->is_same_tree || memcmp(&cx, &cy, sizeof cx) == 0;
        if (is_x != is_y || memcmp(&hx, &hy, sizeof hx) != 0 || !is_work) {
            run_fail(run, "%s against %s, %s, ray %llu: %s: %s, %s%s", p->a->label, p->b->label,
                     p->a->at[k].type->name, (unsigned long long)i, ray_text(&ray),
                     hit_text(is_x, &hx), hit_text(is_y, &hy), is_work ? "" : ", other nodes met");
        }
    }
    count_queries(2 * (uint64_t)p->a->n);
}

// Everything but the seconds.
static bool same_stats(AccelStats a, AccelStats b) {
    a.segment_seconds = a.build_seconds = b.segment_seconds = b.build_seconds = 0;
    return memcmp(&a, &b, sizeof a) == 0;
}

static void vary_threads(Run *run, const Geometry *g, const char *label) {
    AccelOptions options = accel_options_default();
    omp_set_num_threads(1);
    Subjects *one = subjects_new(run, g, &options, "%s, 1 thread", label);
    for (uint32_t n = 2; n <= 5; n += n) {
        options.n_threads = n;
        omp_set_num_threads((int)n);
        Subjects *s = subjects_new(run, g, &options, "%s, %u threads", label, n);
        omp_set_num_threads(omp_get_num_procs());
        for (int k = 0; k < s->n; k++) {
            run_expect(run, same_stats(s->at[k].stats, one->at[k].stats),
                       "%s: %s differs from that of one thread", s->label, s->at[k].type->name);
        }
        Pair pair = {one, s, true};
        run_rays(run, run_count(run, 1000, 1e5), alike, &pair);
        subjects_free(s);
    }
    omp_set_num_threads(omp_get_num_procs());
    subjects_free(one);
}

static void vary_options(Run *run, const Geometry *g, const char *label) {
    static const double kappas[] = {1.1, 1.5, 4, 10, 100};
    static const uint32_t leaf_sizes[] = {0, 1, 4, 30, 1000}, depths[] = {0, 1, 8, 60, 20};
    Subjects *plain = subjects_new(run, g, NULL, "%s", label);
    for (int i = 0; i < 5; i++) {
        AccelOptions options = accel_options_default();
        options.kappa = kappas[i];
        options.leaf_size = leaf_sizes[i];
        options.max_depth = depths[i];
        Subjects *s = subjects_new(run, g, &options, "%s, kappa %g, leaf size %u, depth %u", label,
                                   options.kappa, options.leaf_size, options.max_depth);
        Pair pair = {plain, s, false};
        run_rays(run, run_count(run, 1000, 1e5), alike, &pair);
        subjects_free(s);
    }
    subjects_free(plain);
}

// ---- The same motion with more keys: coordinates of few bits, so that every key is exact, and a
// vertex is at fma(f, b - a, a) to the last bit however its way is cut.

enum { CUT_PRIMS = 60 };

static TestScene cut_scene(uint32_t n_spans) {
    TestScene two = scene_soup(CUT_PRIMS, 2, 0.2, 0.3, 12);
    TestScene s = scene_soup(CUT_PRIMS, n_spans + 1, 0.2, 0, 12);
    size_t n = 9 * CUT_PRIMS;
    for (size_t i = 0; i < n * (n_spans + 1); i++) {
        float a = rintf(two.position[i % n] * 1024), b = rintf(two.position[n + i % n] * 1024);
        s.position[i] = (a + (b - a) * (float)(i / n) / (float)n_spans) / 1024;
    }
    scene_free(&two);
    return s;
}

typedef struct {
    const Subjects *one, *many;
    uint32_t n_spans;
} Cuts;

static void same_motion(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Cuts *c = context;
    AccelRay ray = ray_random(c->one->geometry, random), cut;
    ray.f = (float)(test_random(random) % (1 << 20)) / (1 << 20);
    cut = ray;
    cut.key = (uint32_t)(ray.f * (float)c->n_spans);
    cut.f = ray.f * (float)c->n_spans - (float)cut.key;
    AccelHit a = {0}, b = {0};
    bool is_a = subjects_ask(run, c->one, &ray, i, &a);
    bool is_b = subjects_ask(run, c->many, &cut, i, &b);
    if (is_a != is_b || memcmp(&a, &b, sizeof a) != 0) {
        run_fail(run, "cut_scene(%u), ray %llu: %s: %s; 1 span: %s", c->n_spans,
                 (unsigned long long)i, ray_text(&cut), hit_text(is_b, &b), hit_text(is_a, &a));
    }
}

static void vary_keys(Run *run) {
    TestScene one = cut_scene(1);
    Subjects *first = subjects_new(run, &one.geometry, NULL, "cut_scene(1)");
    for (uint32_t n = 2; n <= 256; n *= 2) {
        TestScene scene = cut_scene(n);
        Subjects *s = subjects_new(run, &scene.geometry, NULL, "cut_scene(%u)", n);
        Cuts c = {first, s, n};
        run_rays(run, run_count(run, 1000, 1e5), same_motion, &c);
        subjects_free(s);
        scene_free(&scene);
    }
    subjects_free(first);
    scene_free(&one);
}

// ---- Denormals taken for 0

#ifdef __SSE__
enum { FLUSH_TO_ZERO = 0x8000, DENORMALS_ARE_ZERO = 0x0040 };

// The same bits; where the direction itself has denormals, which are 0 then, what is allowed.
static void flushed(Run *run, void *context, uint64_t i, uint64_t *random) {
    static const float tiny[] = {0, -0.0f, 1e-20f, -1e-29f, 0x1p-149f, -0x1p-140f, 1e-38f};
    const Subjects *s = context;
    AccelRay ray = ray_random(s->geometry, random);
    int way = i % 2 ? (int)(test_random(random) % 7) : 0;
    bool has_denormals = way >= 4;
    if (i % 2) {
        ray.dir[test_random(random) % 3] = tiny[way];
        ray.dir[test_random(random) % 3] = tiny[way ? way - 1 : 0];
    }
    if (i % 3 == 0) {
        vertex_at(s->geometry, &ray, (uint32_t)(test_random(random) % s->geometry->n_vertices),
                  ray.origin);
        for (int k = 0; k < 3; k++) {
            ray.origin[k] -= ray.dir[k];
        }
    }
    unsigned csr = _mm_getcsr();
    for (int k = 0; k < s->n; k++) {
        const Accel *x = s->at[k].accel;
        AccelHit a = {0}, b = {0};
        char why[200] = "other bits";
        bool is_a = x->type->closest(x, &ray, &a, NULL);
        _mm_setcsr(csr | FLUSH_TO_ZERO | DENORMALS_ARE_ZERO);
        bool is_b = x->type->closest(x, &ray, &b, NULL);
        bool is_occluded = x->type->occluded(x, &ray, NULL);
        _mm_setcsr(csr);
        bool is_right = is_b == is_occluded;
        if (has_denormals) {
            is_right &= oracle_allows_hit(s->geometry, &ray, is_b, &b, why, sizeof why);
        } else {
            is_right &= is_a == is_b && memcmp(&a, &b, sizeof a) == 0;
        }
        if (!is_right) {
            run_fail(run, "%s, %s on %s, ray %llu: %s: %s; denormals flushed: %s, %s", s->label,
                     s->at[k].type->name, s->at[k].cpu, (unsigned long long)i, ray_text(&ray),
                     hit_text(is_a, &a), hit_text(is_b, &b), why);
        }
    }
    count_queries(3 * (uint64_t)s->n);
}
#endif

static void vary_denormals(Run *run, const Geometry *g, const char *label) {
#ifdef __SSE__
    Subjects *s = subjects_new(run, g, NULL, "%s", label);
    run_rays(run, run_count(run, 4e3, 1e6), flushed, s);
    subjects_free(s);
#else
    (void)g, (void)label;
    run_note(run, "flush-to-zero: only for x86");
#endif
}

void test_invariance(Run *run) {
    run_note(run, "packets and lazy builds do not exist yet, so are not varied");
    if (!cpu_has(CPU_AVX512)) {
        run_note(run, "AVX-512 is not in this machine");
    }
    Solid solid = solid_new(SOLID_SPHERE, 14, 5);
    solid_move(&solid, 0.3, 0.03, 2);
    TestScene soup = scene_soup(200, 3, 0.1, 0.2, 6), spheres = scene_spheres(200, 3, 0.05, 0.2, 6);
    const Geometry *all[] = {&solid.scene.geometry, &soup.geometry, &spheres.geometry};
    const char *labels[] = {solid.label, "scene_soup(200, 3, 0.1, 0.2, 6)",
                            "scene_spheres(200, 3, 0.05, 0.2, 6)"};
    for (int i = 0; i < 3; i++) {
        vary_threads(run, all[i], labels[i]);
        vary_options(run, all[i], labels[i]);
        vary_denormals(run, all[i], labels[i]);
    }
    vary_keys(run);
    scene_free(&soup);
    scene_free(&spheres);
    solid_free(&solid);
}

// ---- Bounds

// A ray that one primitive's kernel hits must be hit, no farther away, by all that hold it; with
// the end of the interval at the hit nothing but the boxes on the way decides.
static void held(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Subjects *s = context;
    const Geometry *g = s->geometry;
    AccelRay ray = ray_random(g, random);
    uint32_t prim = (uint32_t)(test_random(random) % g->n_prims);
    float p[3], way[3], far = ldexpf(1, (int)(test_random(random) % 12) - 6);
    float w[3] = {(float)test_uniform(random), (float)test_uniform(random), 0};
    w[0] = i % 4 ? w[0] : 0; // an edge, a vertex
    w[1] = i % 8 ? w[1] * (1 - w[0]) : 0;
    w[2] = 1 - w[0] - w[1];
    random_direction(random, way);
    if (i % 16 == 7) {
        way[i / 16 % 3] = 0;
    }
    for (uint32_t c = 0; c < (g->index ? 3u : 1u); c++) {
        vertex_at(g, &ray, g->index ? g->index[3 * prim + c] : prim, p);
        for (int k = 0; k < 3; k++) {
            float share = (g->index ? w[c] : 1) * p[k];
            ray.origin[k] = c == 0 ? share - far * way[k] : ray.origin[k] + share;
            ray.dir[k] = way[k];
        }
    }
    RayState state;
    AccelHit hit;
    if (!ray_prepare(g, &ray, &state)) {
        return;
    }
    Nearest nearest = {state.tf, INT32_MAX, 0, 0};
    intersect_prim(g, &state, (int32_t)prim, &nearest);
    if (nearest.prim == INT32_MAX) {
        subjects_ask(run, s, &ray, i, &hit);
        return;
    }
    float t = nearest.t * state.unscale;
    ray.tmax = t;
    bool is_hit = subjects_ask(run, s, &ray, i, &hit);
    if (!is_hit || hit.t > t || (hit.t == t && hit.prim > (int32_t)prim)) {
        run_fail(run, "%s, ray %llu: %s: %s; the kernel hits primitive %u at %a", s->label,
                 (unsigned long long)i, ray_text(&ray), hit_text(is_hit, &hit), prim, t);
    }
}

// A segment's box holds its primitive at any time, as the kernels round it.
static void in_segment_box(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Geometry *g = context;
    uint32_t n_ticks = (g->n_keys - 1) * TICKS_PER_SPAN;
    uint32_t t0 = (uint32_t)(test_random(random) % n_ticks);
    uint32_t t1 = t0 + 1 + (uint32_t)(test_random(random) % (n_ticks - t0));
    uint32_t tick = t0 + (uint32_t)(test_random(random) % (t1 - t0));
    uint32_t prim = (uint32_t)(test_random(random) % g->n_prims);
    AccelRay at = {.key = tick / TICKS_PER_SPAN};
    at.f = (float)((tick % TICKS_PER_SPAN + test_uniform(random)) / TICKS_PER_SPAN);
    float lo[3], hi[3], p[3];
    segment_box(g, prim, t0, t1, lo, hi);
    for (uint32_t c = 0; c < (g->index ? 3u : 1u); c++) {
        vertex_at(g, &at, g->index ? g->index[3 * prim + c] : prim, p);
        for (int k = 0; k < 3; k++) {
            if (!(lo[k] <= p[k] && p[k] <= hi[k])) {
                run_fail(run,
                         "box %llu: primitive %u, ticks %u to %u, axis %d: %a is not in %a, %a",
                         (unsigned long long)i, prim, t0, t1, k, p[k], lo[k], hi[k]);
            }
        }
    }
    count_queries(1);
}

void test_bounds(Run *run) {
    for (uint32_t i = 0; i < 6; i++) {
        double size = i < 3 ? 0.1 : 0.003;
        TestScene scene = i % 3 == 0   ? scene_soup(500, 5, size, 0.3 * size, i)
                          : i % 3 == 1 ? scene_soup(100, 3, size, 0.4, i)
                                       : scene_spheres(300, 4, size, size, i);
        run_rays(run, run_count(run, 1e5, 1e7), in_segment_box, &scene.geometry);
        Subjects *s = subjects_new(run, &scene.geometry, NULL, "test_bounds, scene %u", i);
        run_rays(run, run_count(run, 1.5e4, 1.5e6), held, s);
        subjects_free(s);
        scene_free(&scene);
    }
    Solid solid = solid_new(SOLID_TORUS, 30, 17); // beyond what the slow trees are given
    solid_move(&solid, 0.3, 0.01, 4);
    Subjects *s = subjects_new(run, &solid.scene.geometry, NULL, "%s", solid.label);
    run_rays(run, run_count(run, 1e5, 1e7), held, s);
    subjects_free(s);
    solid_free(&solid);
}
