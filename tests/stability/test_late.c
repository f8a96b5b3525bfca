// SPDX-License-Identifier: Apache-2.0
// Late and long: a shutter of a microsecond and less a million seconds into the film, a shutter
// that is open for a million seconds.
#include "render/shutter.h"
#include "tests/stability/solids.h"
#include "tests/stability/worlds.h"

#include <math.h>

void many_keys_of_accel(Run *run);

// ---- Late

// Two cubes, one flown by its transform, the other by a program of its vertices; t counts from
// `start`, so that a film that begins then shows the same.
typedef struct {
    Arena arena;
    Scene scene;
    Shape shapes[2];
    const Mesh *mesh;
    double start, speed;
} Flyby;

static uint32_t flown(Code *c, const Flyby *f) {
    uint32_t t = code_op(c, OP_SUB, code_input(c, IN_T), code_number(c, f->start));
    return code_op(c, OP_MUL, t, code_number(c, f->speed));
}

static void flyby_init(Flyby *f, double start, double speed, double fps, double open,
                       double length) {
    *f = (Flyby){.start = start, .speed = speed};
    f->mesh = mesh_cube(&f->arena, 1);
    f->shapes[0] = f->shapes[1] = hand_mesh(f->mesh);
    Code c = {.n = 0};
    uint32_t zero = code_number(&c, 0), one = code_number(&c, 1), x = flown(&c, f);
    const uint32_t out[12] = {one,  zero, zero, x,   zero, one, zero, code_number(&c, 3),
                              zero, zero, one,  zero};
    f->shapes[0].transform = code_done(&c, &f->arena, out, 12);
    Code v = {.n = 0};
    const uint32_t at[3] = {code_op(&v, OP_ADD, code_input(&v, IN_PX), flown(&v, f)),
                            code_input(&v, IN_PY), code_input(&v, IN_PZ)};
    f->shapes[1].vertex = code_done(&v, &f->arena, at, 3);
    f->scene = hand_scene(&f->arena, f->shapes, 2, 40, 5);
    f->scene.film.fps = fps;
    f->scene.film.last_frame = INT64_MAX / 2;
    f->scene.shutter = (ShutterSettings){.length = length, .open = open};
}

typedef struct {
    const Flyby *flyby;
    const Worlds *worlds;
    int64_t frame;
    double slack[2];
} Late;

enum { LATE_RAYS = 200 };

static void at_flyby(Run *run, void *context, uint64_t chunk, uint64_t *random) {
    const Late *c = context;
    const Scene *scene = &c->flyby->scene;
    WorldViews views = views_new(c->worlds);
    for (uint64_t k = 0; k < LATE_RAYS; k++) {
        double u = k % 16 ? test_uniform(random) : (double)(k / 16 % 2);
        Instant at = shutter_instant(&scene->shutter, c->frame, 0, u);
        // Seconds since the start, without ever forming late ones.
        double t = (scene->shutter.open + u * scene->shutter.length) / scene->film.fps;
        Flat flat[2];
        for (int i = 0; i < 2; i++) {
            flat[i] = (Flat){c->flyby->mesh, affine_identity(), c->slack[i]};
            flat[i].map.m[0][3] = c->flyby->speed * t;
            flat[i].map.m[1][3] = i ? 0 : 3;
        }
        int aim = (int)(k % 2);
        float d[3], e[3];
        random_direction(random, d);
        random_direction(random, e);
        Vec3 center = vec3(flat[aim].map.m[0][3], flat[aim].map.m[1][3], 0);
        Vec3 target = vec3_add(center, vec3(0.7 * d[0], 0.7 * d[1], 0.7 * d[2]));
        Vec3 origin = vec3_add(target, vec3(5 * e[0], 5 * e[1], 5 * e[2]));
        WorldHit hit;
        worlds_check(run, c->worlds, &views, at, origin, vec3_sub(target, origin), INFINITY, flat,
                     2, 0, chunk * LATE_RAYS + k, &hit);
    }
    views_free(c->worlds, &views);
}

static void fly_late(Run *run, double start, double seconds, double speed, double fps,
                     double open) {
    char label[160];
    Flyby f;
    Worlds worlds;
    flyby_init(&f, start, speed, fps, open, seconds * fps);
    int64_t frame = (int64_t)(start * fps) + 1;
    snprintf(label, sizeof label, "at %g s, shutter %g s, %g m/s, %g frames a second, open at %g",
             start, seconds, speed, fps, open);
    worlds_build(run, &worlds, &f.scene, frame, 1, true, label);
    // A double of seconds is a step off; vertices are sampled at both ends of a frame period, where
    // they are as far away as they fly in it, and its fraction is a float.
    double step = nextafter(start, INFINITY) - start, way = speed / fps;
    Late c = {&f, &worlds, frame, {2 * step * speed, 2 * step * speed + 0x1p-22 * way}};
    run_note(run, "%s: within %.2g m under a transform, %.2g m by vertices", label, c.slack[0],
             c.slack[1]);
    run_rays(run, run_count(run, 10, 1000), at_flyby, &c);
    worlds_free(&worlds);
    arena_free(&f.arena);
}

void test_late_time(Run *run) {
    for (int i = 0; i < 2; i++) {
        double start = i ? 1e6 : 0;
        fly_late(run, start, 1e-6, 1e5, 24, 0);   // flies a tenth of its size
        fly_late(run, start, 1e-6, 1e5, 24, 0.5); // in the middle of the period
        fly_late(run, start, 1e-6, 1e6, 1e6, 0);  // its own size, which is the whole period
        fly_late(run, start, 1e-12, 1e3, 24, 0);  // an instant
        fly_late(run, start, 1e-12, 1e3, 1e12, 0);
    }
    run_note(run, "seconds are doubles: at 1e6 s their step is 1.2e-10 s, so a shutter of 1e-12 s "
                  "is one instant, and sees no motion");
}

// ---- Long

enum { PERIODS = 1000, SAMPLES = 100, SWING_SECONDS = 1000 };

typedef struct {
    const Scene *scene;
    const Mesh *mesh;
    const Worlds *worlds;
} Long;

static void at_swing(Run *run, void *context, uint64_t chunk, uint64_t *random) {
    const Long *c = context;
    const double rate = 2 * 3.14159265358979323846 / SWING_SECONDS;
    WorldViews views = views_new(c->worlds);
    for (uint64_t k = 0; k < LATE_RAYS; k++) {
        double u = k % 16 ? test_uniform(random) : (double)(k / 16 % 2);
        Instant at = shutter_instant(&c->scene->shutter, 1, 0, u);
        double x = sin(rate * instant_seconds(at, c->scene->film.fps));
        // Straight between instants that are h apart: h^2/8 times the acceleration.
        double h = 1 / c->scene->film.fps / SAMPLES;
        Flat flat = {c->mesh, affine_identity(), h * h / 8 * rate * rate + 1e-9};
        flat.map.m[0][3] = x;
        float d[3], e[3];
        random_direction(random, d);
        random_direction(random, e);
        Vec3 target = vec3(x + 0.7 * d[0], 0.7 * d[1], 0.7 * d[2]);
        Vec3 origin = vec3_add(target, vec3(5 * e[0], 5 * e[1], 5 * e[2]));
        WorldHit hit;
        worlds_check(run, c->worlds, &views, at, origin, vec3_sub(target, origin), INFINITY, &flat,
                     1, 0, chunk * LATE_RAYS + k, &hit);
    }
    views_free(c->worlds, &views);
}

static void open_for_long(Run *run) {
    Arena arena = {0};
    const Mesh *mesh = mesh_cube(&arena, 1);
    Shape shape = hand_mesh(mesh);
    Code c = {.n = 0};
    uint32_t rate = code_number(&c, 2 * 3.14159265358979323846 / SWING_SECONDS);
    uint32_t angle = code_op(&c, OP_MUL, code_input(&c, IN_T), rate);
    uint32_t way = code_op(&c, OP_SIN, angle, 0);
    const uint32_t at[3] = {code_op(&c, OP_ADD, code_input(&c, IN_PX), way), code_input(&c, IN_PY),
                            code_input(&c, IN_PZ)};
    shape.vertex = code_done(&c, &arena, at, 3);
    shape.samples = SAMPLES;
    Scene scene = hand_scene(&arena, &shape, 1, 40, 5);
    scene.film.fps = 1e-3;
    scene.shutter = (ShutterSettings){.length = PERIODS, .open = 0};
    Worlds worlds;
    worlds_build(run, &worlds, &scene, 1, 1, false, "a shutter of 1e6 s, 100,000 spans");
    Long l = {&scene, mesh, &worlds};
    run_rays(run, run_count(run, 20, 2000), at_swing, &l);
    worlds_free(&worlds);
    arena_free(&arena);
}

void test_many_keys(Run *run) {
    many_keys_of_accel(run);
    open_for_long(run);
}
