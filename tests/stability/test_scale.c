// SPDX-License-Identifier: Apache-2.0
// Scenes of all sizes and in all places: the way from doubles to the kernels' floats.
#include "accel/frame.h"
#include "tests/stability/oracle.h"
#include "tests/stability/solids.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Powers of two

typedef struct {
    const Subjects *one, *scaled;
    int k;
} Scaled;

static void same_bits(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Scaled *c = context;
    AccelRay ray = ray_random(c->one->geometry, random), scaled;
    ray.tmin = i % 3 ? 0 : (float)(test_uniform(random) - 0.5);
    ray.tmax = i % 5 ? INFINITY : ray.tmin + (float)test_uniform(random);
    scaled = ray;
    scaled.tmin = ldexpf(ray.tmin, c->k);
    scaled.tmax = ldexpf(ray.tmax, c->k);
    for (int j = 0; j < 3; j++) {
        scaled.origin[j] = ldexpf(ray.origin[j], c->k);
    }
    AccelHit a = {0}, b = {0};
    bool is_a = subjects_ask(run, c->one, &ray, i, &a);
    bool is_b = subjects_ask(run, c->scaled, &scaled, i, &b);
    a.t = ldexpf(a.t, c->k);
    if (is_a != is_b || memcmp(&a, &b, sizeof a) != 0) {
        run_fail(run, "%s, ray %llu: %s: %s; to be %s", c->scaled->label, (unsigned long long)i,
                 ray_text(&scaled), hit_text(is_b, &b), hit_text(is_a, &a));
    }
}

static void scale_scene(Run *run, const TestScene *scene, const char *label) {
    const Geometry *g = &scene->geometry;
    size_t n = (size_t)g->n_keys * g->n_vertices;
    Subjects *one = subjects_new(run, g, NULL, "%s", label);
    static const int powers[] = {-30, -20, -10, -3, -1, 1, 3, 10, 20, 30};
    for (size_t j = 0; j < sizeof powers / sizeof *powers; j++) {
        int k = powers[j];
        TestScene scaled = scene_new(g->kind, g->n_prims, g->n_vertices, g->n_keys);
        for (size_t i = 0; i < 3 * n; i++) {
            scaled.position[i] = ldexpf(scene->position[i], k);
        }
        if (scene->index) {
            memcpy(scaled.index, scene->index, 12 * (size_t)g->n_prims);
        }
        for (size_t i = 0; scene->radius && i < n; i++) {
            scaled.radius[i] = ldexpf(scene->radius[i], k);
        }
        Subjects *s = subjects_new(run, &scaled.geometry, NULL, "%s, times 2^%d", label, k);
        Scaled c = {one, s, k};
        run_rays(run, run_count(run, 1000, 5e5), same_bits, &c);
        subjects_free(s);
        scene_free(&scaled);
    }
    subjects_free(one);
}

// Through frames the kernels see the very same ray, whatever the power.
static void same_local_rays(Run *run) {
    uint64_t random = run->seed;
    for (int k = -30; k <= 30; k++) {
        Frame one = frame_from_box(vec3(-0.3, 0.1, 0.2), vec3(0.4, 0.3, 0.9)), scaled;
        double s = ldexp(1, k);
        scaled = frame_from_box(vec3(-0.3 * s, 0.1 * s, 0.2 * s), vec3(0.4 * s, 0.3 * s, 0.9 * s));
        for (int i = 0; i < 100; i++) {
            float f[6];
            for (int j = 0; j < 6; j++) {
                f[j] = (float)(10 * test_uniform(&random) - 5);
            }
            AccelRay a = {.key = 0}, b = {.key = 0};
            FrameDistance da, db;
            Vec3 o = vec3(f[0], f[1], f[2]), d = vec3(f[3], f[4], f[5]);
            bool is_a = frame_ray(&one, o, d, 0, 3, &a, &da);
            bool is_b = frame_ray(&scaled, vec3_scale(o, s), d, 0, 3 * s, &b, &db);
            run_expect(run,
                       is_a && is_b && memcmp(&a, &b, sizeof a) == 0 && db.unit == da.unit * s &&
                           db.base == da.base * s,
                       "2^%d: %s, to be %s", k, ray_text(&b), ray_text(&a));
        }
    }
}

void test_scale_power_of_two(Run *run) {
    TestScene scene = scene_soup(150, 3, 0.15, 0.1, 21);
    scale_scene(run, &scene, "scene_soup(150, 3, 0.15, 0.1, 21)");
    scene_free(&scene);
    scene = scene_spheres(150, 3, 0.1, 0.1, 22);
    scale_scene(run, &scene, "scene_spheres(150, 3, 0.1, 0.1, 22)");
    scene_free(&scene);
    same_local_rays(run);
}

// ---- Scenes in double

typedef struct {
    TestScene scene; // the floats of the frame
    double *position;
    Frame frame;
    double size, reach; // of the doubles; of the floats
    Vec3 center;
    Subjects *subjects;
} Object;

static void object_init(Object *o, Run *run, double size, Vec3 to, uint64_t seed) {
    *o = (Object){.scene = scene_soup(150, 3, 0.15, 0.05, seed), .size = size, .center = to};
    const Geometry *g = &o->scene.geometry;
    size_t n = 3 * (size_t)g->n_keys * g->n_vertices;
    o->position = malloc(n * sizeof *o->position);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    const double at[3] = {to.x, to.y, to.z};
    for (size_t i = 0; i < n; i++) {
        o->position[i] = at[i % 3] + size * o->scene.position[i];
        lo[i % 3] = fmin(lo[i % 3], o->position[i]);
        hi[i % 3] = fmax(hi[i % 3], o->position[i]);
    }
    o->frame = frame_from_box(vec3(lo[0], lo[1], lo[2]), vec3(hi[0], hi[1], hi[2]));
    for (size_t i = 0; i < n; i++) {
        o->scene.position[i] = (float)((o->position[i] - o->frame.center[i % 3]) * o->frame.scale);
        o->reach = fmax(o->reach, fabs(o->scene.position[i]));
    }
    o->subjects = subjects_new(run, g, NULL, "soup %llu of %g m at %g %g %g",
                               (unsigned long long)seed, size, to.x, to.y, to.z);
}

static void object_free(Object *o) {
    subjects_free(o->subjects);
    free(o->position);
    scene_free(&o->scene);
}

// The ray as it was given, begun anew at the point nearest to the object: s along it.
typedef struct {
    const Object *object;
    const AccelRay *time;
    long double o[3];
    double d[3], s, far, length;
} DoubleRay;

static Meeting meet_double(const void *context, uint32_t prim) {
    const DoubleRay *q = context;
    const Geometry *g = &q->object->scene.geometry;
    const double u = 0x1.01p-24;
    double error = u * (4 * q->object->reach + 8) / q->object->frame.scale + 0x1p-51 * q->far;
    Meet m;
    for (int k = 0; k < 3; k++) {
        m.d[k] = q->d[k];
        m.ed[k] = u * fabs(q->d[k]);
    }
    for (int c = 0; c < 3; c++) {
        size_t v = g->index[3 * (size_t)prim + (size_t)c];
        const double *a = q->object->position + 3 * ((size_t)g->n_vertices * q->time->key + v);
        const double *b = a + 3 * (size_t)g->n_vertices;
        for (int k = 0; k < 3; k++) {
            long double p = a[k] + (long double)q->time->f * ((long double)b[k] - a[k]);
            m.a[c][k] = (double)(p - q->o[k]);
            m.ea[c][k] = error;
        }
    }
    Meeting r = meet_triangle(&m);
    // From within some sizes of the object the kernels measure from the origin itself.
    double near = fmin(fabs(q->s), 8 / q->object->frame.scale / q->length);
    double off = 0x1p-50 * (fabs(q->s) + fmax(fabs(r.lo), fabs(r.hi))) + 16 * u * near;
    r.lo += q->s - off;
    r.hi += q->s + off;
    return r;
}

static void check_double(Run *run, const Object *object, uint64_t i, Vec3 origin, Vec3 dir,
                         const AccelRay *time) {
    AccelRay ray = *time;
    FrameDistance distance;
    AccelHit hit;
    char why[200];
    if (!run_expect(run, frame_ray(&object->frame, origin, dir, 0, INFINITY, &ray, &distance),
                    "%s: refused", object->subjects->label)) {
        return;
    }
    bool is_hit = subjects_ask(run, object->subjects, &ray, i, &hit);
    DoubleRay q = {.object = object, .time = &ray, .d = {dir.x, dir.y, dir.z}};
    const double o[3] = {origin.x, origin.y, origin.z};
    long double od = 0, dd = 0;
    for (int k = 0; k < 3; k++) {
        long double away = (long double)o[k] - object->frame.center[k];
        od += away * q.d[k];
        dd += (long double)q.d[k] * q.d[k];
        q.far = fmax(q.far, fabs((double)away));
    }
    q.s = (double)(-od / dd);
    q.length = sqrt((double)dd);
    for (int k = 0; k < 3; k++) {
        q.o[k] = o[k] + (long double)q.s * q.d[k];
    }
    double t = distance.base + hit.t * distance.unit;
    if (!oracle_allows(meet_double, &q, object->scene.geometry.n_prims, 0, INFINITY, is_hit, t,
                       (uint32_t)hit.prim, why, sizeof why)) {
        run_fail(run,
                 "%s, ray %llu: from %a %a %a, along %a %a %a, key %u, f %a: t %.17g, %s\n"
                 "  the oracle: %s",
                 object->subjects->label, (unsigned long long)i, origin.x, origin.y, origin.z,
                 dir.x, dir.y, dir.z, ray.key, ray.f, t, hit_text(is_hit, &hit), why);
    }
}

typedef struct {
    const Object *object;
    double away; // from how far, in sizes
} Aimed;

static void at_object(Run *run, void *context, uint64_t i, uint64_t *random) {
    const Aimed *c = context;
    const Object *object = c->object;
    AccelRay time = ray_random(&object->scene.geometry, random);
    float way[3];
    random_direction(random, way);
    Vec3 dir = vec3_scale(vec3(way[0], way[1], way[2]), pow(2, 20 * test_uniform(random) - 10));
    Vec3 to = vec3_add(object->center,
                       vec3_scale(vec3(test_uniform(random) - 0.5, test_uniform(random) - 0.5,
                                       test_uniform(random) - 0.5),
                                  0.8 * object->size));
    double away = i % 4 ? c->away : 0.3;
    Vec3 origin = vec3_madd(to, -away * object->size / vec3_length(dir), dir);
    check_double(run, object, i, origin, dir, &time);
}

void test_scale_any(Run *run) {
    for (int e = -9; e <= 9; e++) {
        double size = 1.37 * pow(10, e);
        Object object;
        object_init(&object, run, size, vec3(0.3 * size, -0.7 * size, 0.1 * size), 50);
        Aimed c = {.object = &object, .away = e % 2 ? 3 : 1000};
        run_rays(run, run_count(run, 1500, 3e5), at_object, &c);
        object_free(&object);
    }
}

void test_translation(Run *run) {
    for (int i = 0; i < 6; i++) {
        double size = i % 3 == 0 ? 1 : i % 3 == 1 ? 1000 : 0.001;
        Object object;
        object_init(&object, run, size, vec3(1e9, -1e9 / 3, i < 3 ? 7e8 : 0), 60);
        Aimed c = {.object = &object, .away = i % 3 == 2 ? 3 : 1e9 / size};
        run_rays(run, run_count(run, 3000, 6e5), at_object, &c);
        object_free(&object);
    }
    for (int i = 0; i < 2; i++) { // the same rays from 1e9 away, at the origin
        Object object;
        object_init(&object, run, i ? 100 : 1, vec3(0, 0, 0), 61);
        Aimed c = {.object = &object, .away = i ? 1e7 : 1e9};
        run_rays(run, run_count(run, 3000, 6e5), at_object, &c);
        object_free(&object);
    }
}
