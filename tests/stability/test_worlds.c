// SPDX-License-Identifier: Apache-2.0
// Objects under transforms: of all sizes at once, turning, nested, mirrored, jumping, very many.
#include "tests/stability/solids.h"
#include "tests/stability/worlds.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 250 }; // rays that share views

static Vec3 any_direction(uint64_t *random) {
    float d[3];
    random_direction(random, d);
    return vec3_normalize(vec3(d[0], d[1], d[2]));
}

static Vec3 center_of(const Flat *flat) {
    return vec3(flat->map.m[0][3], flat->map.m[1][3], flat->map.m[2][3]);
}

// ---- A stadium with things in it down to a micrometre

enum { SIZES = 26 };

typedef struct {
    const Worlds *worlds;
    const Flat *flat;
    const double *sizes;
} Stadium;

static void in_stadium(Run *run, void *context, uint64_t chunk, uint64_t *random) {
    const Stadium *c = context;
    WorldViews views = views_new(c->worlds);
    for (uint64_t k = 0; k < CHUNK; k++) {
        int i = (int)(test_random(random) % SIZES);
        Vec3 center = center_of(&c->flat[i]);
        double size = c->sizes[i], away = size * 3;
        if (k % 3 == 1) { // seen from much farther away than it is large
            away = size * pow(10, 10 * test_uniform(random));
        } else if (k % 3 == 2) { // from within what is around it
            away = 0.4 * size;
        }
        Vec3 way = any_direction(random);
        Vec3 target = vec3_madd(center, 0.6 * size, any_direction(random));
        Vec3 origin = vec3_madd(target, -away, way);
        WorldHit hit;
        worlds_check(run, c->worlds, &views, (Instant){0, 0}, origin,
                     vec3_scale(way, pow(10, 6 * test_uniform(random) - 3)), INFINITY, c->flat,
                     SIZES, 0, chunk * CHUNK + k, &hit);
    }
    views_free(c->worlds, &views);
}

void test_mixed_sizes(Run *run) {
    Arena arena = {0};
    Mesh *mesh = mesh_cube(&arena, 1);
    uint64_t random = run->seed;
    Shape shapes[SIZES];
    Flat flat[SIZES];
    double sizes[SIZES];
    for (int i = 0; i < SIZES; i++) {
        sizes[i] = pow(10, 6 - i / 2);
        // Those of one size beside each other, within those that are larger.
        Vec3 to =
            i < 2 ? vec3(1e6 * i, 0, 0)
                  : vec3_madd(center_of(&flat[i - 2]), 0.2 * sizes[i - 2], any_direction(&random));
        flat[i] = (Flat){mesh, random_placement(&random, sizes[i], i & 1, to), 0};
        shapes[i] = hand_mesh(mesh);
        shapes[i].transform = program_affine(&arena, &flat[i].map);
    }
    Scene scene = hand_scene(&arena, shapes, SIZES, 40, 5);
    Worlds worlds;
    worlds_build(run, &worlds, &scene, 1, 1, true, "1e-6 to 1e6 m");
    Stadium c = {&worlds, flat, sizes};
    run_rays(run, run_count(run, 20, 2000), in_stadium, &c);
    worlds_free(&worlds);
    arena_free(&arena);
}

// ---- Placements over time

enum { STILL = 20, TURNING = 20, NESTED = 10, WRAPPING = 10, PLACED = 60 };

typedef struct {
    Vec3 to, velocity;
    double rate, scale; // of nested ones: `scale` and a shift within what turns
    Affine within;
} Placing;

typedef struct {
    const Worlds *worlds;
    const Mesh *mesh;
    const Placing *placings;
} Placements;

static Affine turned(double rate, Vec3 to, Vec3 velocity, double t) {
    double c = cos(rate * t), s = sin(rate * t);
    return (Affine){{{c, -s, 0, to.x + velocity.x * t},
                     {s, c, 0, to.y + velocity.y * t},
                     {0, 0, 1, to.z + velocity.z * t}}};
}

// To and fro: the phase is what the rate times the time has behind the point.
static double phase_of(double rate, double t) {
    return rate * t - floor(rate * t);
}

static Affine placed_at(const Placing *p, int i, double t) {
    if (i < STILL) {
        return p->within;
    }
    if (i < STILL + TURNING) {
        return turned(p->rate, p->to, p->velocity, t);
    }
    if (i < STILL + TURNING + NESTED) {
        Affine outer = turned(p->rate, p->to, p->velocity, t);
        return affine_mul(&outer, &p->within);
    }
    Affine map = affine_identity();
    map.m[0][3] = p->to.x + 10 * phase_of(p->rate, t);
    map.m[1][3] = p->to.y;
    map.m[2][3] = p->to.z;
    return map;
}

// The product of a turning map and a fixed one.
static Program *program_nested(Arena *arena, const Placing *p) {
    Code c = {.n = 0};
    uint32_t t = code_input(&c, IN_T), out[12];
    uint32_t angle = code_op(&c, OP_MUL, t, code_number(&c, p->rate));
    uint32_t cosine = code_op(&c, OP_COS, angle, 0), sine = code_op(&c, OP_SIN, angle, 0);
    const double to[3] = {p->to.x, p->to.y, p->to.z};
    const double velocity[3] = {p->velocity.x, p->velocity.y, p->velocity.z};
    for (int j = 0; j < 4; j++) {
        uint32_t x = code_number(&c, p->within.m[0][j]), y = code_number(&c, p->within.m[1][j]);
        uint32_t xc = code_op(&c, OP_MUL, x, cosine), ys = code_op(&c, OP_MUL, y, sine);
        uint32_t xs = code_op(&c, OP_MUL, x, sine), yc = code_op(&c, OP_MUL, y, cosine);
        out[j] = code_op(&c, OP_SUB, xc, ys);
        out[4 + j] = code_op(&c, OP_ADD, xs, yc);
        out[8 + j] = code_number(&c, p->within.m[2][j]);
    }
    for (int k = 0; k < 3; k++) {
        uint32_t way = code_op(&c, OP_MUL, t, code_number(&c, velocity[k]));
        uint32_t at = code_op(&c, OP_ADD, way, code_number(&c, to[k]));
        out[4 * k + 3] = code_op(&c, OP_ADD, out[4 * k + 3], at);
    }
    return code_done(&c, arena, out, 12);
}

static void make_wrapping(Arena *arena, const Placing *p, Shape *shape) {
    Code c = {.n = 0};
    uint32_t zero = code_number(&c, 0), one = code_number(&c, 1);
    uint32_t turns = code_op(&c, OP_MUL, code_input(&c, IN_T), code_number(&c, p->rate));
    uint32_t phase = code_op(&c, OP_SUB, turns, code_op(&c, OP_FLOOR, turns, 0));
    uint32_t way = code_op(&c, OP_MUL, phase, code_number(&c, 10));
    uint32_t x = code_op(&c, OP_ADD, way, code_number(&c, p->to.x));
    const uint32_t out[12] = {one,  zero, zero, x,
                              zero, one,  zero, code_number(&c, p->to.y),
                              zero, zero, one,  code_number(&c, p->to.z)};
    shape->transform = code_done(&c, arena, out, 12);
    Code b = {.n = 0};
    uint32_t jumps = code_op(&b, OP_MUL, code_input(&b, IN_T), code_number(&b, p->rate));
    shape->breaks = code_done(&b, arena, &jumps, 1);
}

static void make_placement(Arena *arena, uint64_t *random, int i, Placing *p, Shape *shape) {
    Vec3 a = any_direction(random);
    *p = (Placing){.to = vec3_scale(any_direction(random), 15 * test_uniform(random)),
                   .velocity = vec3_scale(a, 40),
                   .rate = 600 * (test_uniform(random) - 0.5)};
    if (i < STILL) {
        p->within = random_placement(random, pow(10, 2 * test_uniform(random) - 1), i & 1, p->to);
        shape->transform = program_affine(arena, &p->within);
    } else if (i < STILL + TURNING) {
        shape->transform = program_turning(arena, p->rate, p->to, p->velocity);
    } else if (i < STILL + TURNING + NESTED) {
        double scale = pow(10, 12 * test_uniform(random) - 6);
        p->within = random_placement(random, scale, i & 1, vec3_scale(a, 2));
        shape->transform = program_nested(arena, p);
    } else {
        p->rate = 24 * (1 + 5 * test_uniform(random));
        make_wrapping(arena, p, shape);
    }
}

// At and beside the instant at which a phase wraps, as far as seconds can tell.
static Instant beside_wrap(const Placing *p, uint64_t *random) {
    double turns = floor(p->rate * (2 + 2 * test_uniform(random)) / 24) + 1;
    double periods = turns / p->rate * 24;
    int n_steps = (int)(test_random(random) % 9) - 4;
    for (int k = 0; k < abs(n_steps); k++) {
        periods = nextafter(periods, n_steps < 0 ? -INFINITY : INFINITY);
    }
    return instant_at(0, fmin(fmax(periods, 2), 3.99));
}

static void at_placements(Run *run, void *context, uint64_t chunk, uint64_t *random) {
    const Placements *c = context;
    WorldViews views = views_new(c->worlds);
    for (uint64_t k = 0; k < CHUNK; k++) {
        int aim = (int)(test_random(random) % PLACED);
        Instant at = instant_at(2 + (int64_t)(k & 1), test_uniform(random));
        if (aim >= STILL + TURNING + NESTED && k % 3) {
            at = beside_wrap(&c->placings[aim], random);
        }
        Flat flat[PLACED];
        double t = instant_seconds(at, 24), longest = 0;
        for (int i = 0; i < PLACED; i++) {
            flat[i] = (Flat){c->mesh, placed_at(&c->placings[i], i, t), 1e-12};
        }
        for (int i = 0; i < 3; i++) {
            longest = fmax(longest, fabs(flat[aim].map.m[i][0]));
        }
        Vec3 way = any_direction(random);
        Vec3 target = vec3_madd(center_of(&flat[aim]), 0.7 * longest, any_direction(random));
        double away = k % 2 ? 30 * test_uniform(random) : 3 * longest;
        WorldHit hit;
        worlds_check(run, c->worlds, &views, at, vec3_madd(target, -away, way),
                     vec3_scale(way, 0.01 + 3 * test_uniform(random)), INFINITY, flat, PLACED, 0,
                     chunk * CHUNK + k, &hit);
    }
    views_free(c->worlds, &views);
}

static void place_each(Run *run) {
    Arena arena = {0};
    Mesh *mesh = mesh_cube(&arena, 1);
    uint64_t random = run->seed;
    Shape shapes[PLACED];
    Placing placings[PLACED];
    for (int i = 0; i < PLACED; i++) {
        shapes[i] = hand_mesh(mesh);
        make_placement(&arena, &random, i, &placings[i], &shapes[i]);
    }
    Scene scene = hand_scene(&arena, shapes, PLACED, 40, 5);
    Worlds worlds;
    worlds_build(run, &worlds, &scene, 3, 2, true, "placements");
    Placements c = {&worlds, mesh, placings};
    run_rays(run, run_count(run, 24, 2400), at_placements, &c);
    worlds_free(&worlds);
    arena_free(&arena);
}

// ---- Very many instances, each turning at a rate of its own

typedef struct {
    const Worlds *worlds;
    const Mesh *mesh;
    const double *loops; // [n][4]: place, rate
    uint32_t n;
} Crowd;

static void in_crowd(Run *run, void *context, uint64_t chunk, uint64_t *random) {
    const Crowd *c = context;
    WorldViews views = views_new(c->worlds);
    for (uint64_t k = 0; k < CHUNK; k++) {
        uint32_t i = (uint32_t)(test_random(random) % c->n);
        const double *l = c->loops + 4 * (size_t)i;
        Instant at = instant_at(0, test_uniform(random));
        Flat flat = {c->mesh,
                     turned(l[3], vec3(l[0], l[1], l[2]), vec3(0, 0, 0), instant_seconds(at, 24)),
                     1e-12};
        // Begins beside this one and ends before the next.
        Vec3 origin = vec3_madd(center_of(&flat), 1.2, any_direction(random));
        Vec3 target = vec3_madd(center_of(&flat), 0.6, any_direction(random));
        WorldHit hit;
        worlds_check(run, c->worlds, &views, at, origin, vec3_normalize(vec3_sub(target, origin)),
                     2, &flat, 1, i, chunk * CHUNK + k, &hit);
    }
    views_free(c->worlds, &views);
}

static void many_instances(Run *run) {
    uint32_t side = run->is_stress ? 100 : 25, n = side * side * side;
    Arena arena = {0};
    Mesh *mesh = mesh_cube(&arena, 1);
    uint64_t random = run->seed;
    double *loops = ARENA_ARRAY(&arena, 4 * (size_t)n, double);
    for (uint32_t i = 0; i < n; i++) {
        loops[4 * (size_t)i] = 8.0 * (i % side);
        loops[4 * (size_t)i + 1] = 8.0 * (i / side % side);
        loops[4 * (size_t)i + 2] = 8.0 * (i / side / side);
        loops[4 * (size_t)i + 3] = 100 * (test_uniform(&random) - 0.5);
    }
    Code c = {.n = 0};
    uint32_t zero = code_number(&c, 0), one = code_number(&c, 1);
    uint32_t angle = code_op(&c, OP_MUL, code_input(&c, IN_T), code_input(&c, IN_LOOP3));
    uint32_t cosine = code_op(&c, OP_COS, angle, 0), sine = code_op(&c, OP_SIN, angle, 0);
    uint32_t back = code_op(&c, OP_NEG, sine, 0), x = code_input(&c, IN_LOOP0),
             y = code_input(&c, IN_LOOP1), z = code_input(&c, IN_LOOP2);
    const uint32_t out[12] = {cosine, back, zero, x, sine, cosine, zero, y, zero, zero, one, z};
    Shape shape = hand_mesh(mesh);
    shape.transform = code_done(&c, &arena, out, 12);
    shape.n_instances = n;
    shape.n_loops = 4;
    shape.loops = loops;
    Scene scene = hand_scene(&arena, &shape, 1, 40, 5);
    Worlds worlds;
    worlds_build(run, &worlds, &scene, 1, 1, false, "very many instances");
    Crowd crowd = {&worlds, mesh, loops, n};
    run_rays(run, run_count(run, 24, 2400), in_crowd, &crowd);
    run_note(run, "%u instances", n);
    worlds_free(&worlds);
    arena_free(&arena);
}

void test_placements(Run *run) {
    run_note(run, "frames that turn with their object, and clocks of instances, do not exist in "
                  "accel/ yet: transforms are evaluated at the ray's time");
    place_each(run);
    many_instances(run);
}
