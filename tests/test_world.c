// SPDX-License-Identifier: Apache-2.0
// Worlds: rays against a flattened model in long double, surfaces, counts, independence of blocks.
#include "render/world.h"
#include "tests/hand_scene.h"
#include "tests/near.h"

#include <string.h>

static World *build(const Scene *scene, const RenderOptions *options, int64_t first, uint32_t n,
                    RenderStats *stats) {
    int64_t frames[64];
    uint32_t taken;
    for (uint32_t i = 0; i < n; i++) {
        frames[i] = first + i;
    }
    Reports reports;
    Reporter reporter = hand_reporter(&reports);
    *stats = (RenderStats){0};
    World *world = world_build(scene, options, frames, n, &reporter, &taken, stats);
    assert_non_null(world);
    assert_int_equal(taken, n);
    return world;
}

// ---- The oracle: triangles in the world in long double, Moeller and Trumbore.

typedef struct {
    long double x, y, z;
} Long3;

static Long3 sub(Long3 a, Long3 b) {
    return (Long3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static long double dot(Long3 a, Long3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static Long3 cross(Long3 a, Long3 b) {
    return (Long3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static Long3 long3(Vec3 a) {
    return (Long3){a.x, a.y, a.z};
}

static Long3 apply(const Affine *m, const double *p) {
    Long3 r;
    r.x = (long double)m->m[0][0] * p[0] + (long double)m->m[0][1] * p[1] +
          (long double)m->m[0][2] * p[2] + m->m[0][3];
    r.y = (long double)m->m[1][0] * p[0] + (long double)m->m[1][1] * p[1] +
          (long double)m->m[1][2] * p[2] + m->m[1][3];
    r.z = (long double)m->m[2][0] * p[0] + (long double)m->m[2][1] * p[1] +
          (long double)m->m[2][2] * p[2] + m->m[2][3];
    return r;
}

typedef struct {
    long double t, second, margin; // margin: of the nearest hit, or how near a miss came to a hit
    uint32_t object;
    int32_t prim;
} Answer;

static void ask_triangle(const Long3 v[3], Long3 o, Long3 d, uint32_t object, int32_t prim,
                         Answer *best) {
    Long3 e1 = sub(v[1], v[0]), e2 = sub(v[2], v[0]), p = cross(d, e2), s = sub(o, v[0]);
    long double det = dot(e1, p);
    if (det == 0) {
        return;
    }
    long double u = dot(s, p) / det, w = dot(d, cross(s, e1)) / det,
                t = dot(e2, cross(s, e1)) / det;
    long double margin = fminl(fminl(u, w), 1 - u - w);
    if (t > 0 && margin > -0.001L) {
        if (margin < 0) {
            best->margin = fminl(best->margin, -margin);
        } else if (t < best->t) {
            *best = (Answer){t, best->t, fminl(best->margin, margin), object, prim};
        } else {
            best->second = fminl(best->second, t);
        }
    }
}

typedef struct {
    const Mesh *mesh;
    Affine map;
} Placed;

static Answer ask_all(const Placed *placed, uint32_t n, Vec3 origin, Vec3 dir) {
    Answer best = {INFINITY, INFINITY, INFINITY, 0, -1};
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t f = 0; f < placed[i].mesh->n_triangles; f++) {
            Long3 v[3];
            for (int k = 0; k < 3; k++) {
                uint32_t vertex = placed[i].mesh->index[3 * f + (uint32_t)k];
                v[k] = apply(&placed[i].map, &placed[i].mesh->position[3 * vertex]);
            }
            ask_triangle(v, long3(origin), long3(dir), i, (int32_t)f, &best);
        }
    }
    return best;
}

// ---- Random placements

static Vec3 random_direction(uint64_t *state) {
    Vec3 d;
    do {
        d = vec3(2 * hand_random(state) - 1, 2 * hand_random(state) - 1,
                 2 * hand_random(state) - 1);
    } while (vec3_length(d) > 1 || vec3_length(d) < 0.1);
    return vec3_normalize(d);
}

static Affine random_map(uint64_t *state, double scale, bool is_mirrored, Vec3 to) {
    Vec3 x = random_direction(state), y = vec3_normalize(vec3_cross(x, random_direction(state)));
    Vec3 z = vec3_scale(vec3_cross(x, y), is_mirrored ? -1 : 1);
    double s[3] = {scale, scale * (0.5 + hand_random(state)), scale * (0.5 + hand_random(state))};
    return (Affine){{{s[0] * x.x, s[1] * y.x, s[2] * z.x, to.x},
                     {s[0] * x.y, s[1] * y.y, s[2] * z.y, to.y},
                     {s[0] * x.z, s[1] * y.z, s[2] * z.z, to.z}}};
}

static Affine turned(double rate, Vec3 to, Vec3 velocity, double t) {
    double c = cos(rate * t), s = sin(rate * t);
    return (Affine){{{c, -s, 0, to.x + velocity.x * t},
                     {s, c, 0, to.y + velocity.y * t},
                     {0, 0, 1, to.z + velocity.z * t}}};
}

// Compares one ray; where the oracle says that it was close the answers may differ.
static bool agrees(WorldView *view, const Placed *placed, uint32_t n, Vec3 o, Vec3 d,
                   double scale) {
    WorldHit hit;
    Answer expected = ask_all(placed, n, o, d);
    bool is_hit = world_closest(view, o, d, 0, INFINITY, &hit);
    bool is_occluded = world_occluded(view, o, d, 0, INFINITY);
    if (is_hit != is_occluded) {
        return false;
    }
    if (expected.margin < 1e-5L) {
        return true;
    }
    if (is_hit != (expected.prim >= 0)) {
        return false;
    }
    double bound = 1e-5 * scale + 1e-12 * fabs((double)expected.t);
    return !is_hit || (fabs(hit.t - (double)expected.t) <= bound &&
                       ((hit.object == expected.object && hit.prim == expected.prim) ||
                        (double)(expected.second - expected.t) <= 2 * bound));
}

static void rays_agree_with_flattened(void **state) {
    (void)state;
    enum { STILL = 40, MOVING = 20, ALL = STILL + MOVING };
    static const char *const names[] = {"brute", "kd4-thesis", "kd3", NULL};
    uint64_t random = 7;
    for (int run = 0; names[run]; run++) {
        Arena arena = {0};
        Mesh *mesh = mesh_cube(&arena, 1);
        Shape shapes[ALL];
        Placed placed[ALL];
        Vec3 to[ALL], velocity[ALL];
        double rate[ALL];
        for (int i = 0; i < ALL; i++) {
            to[i] = vec3(20 * hand_random(&random) - 10, 20 * hand_random(&random) - 10,
                         20 * hand_random(&random) - 10);
            velocity[i] = vec3_scale(random_direction(&random), 40);
            rate[i] = 600 * (hand_random(&random) - 0.5);
            shapes[i] = hand_mesh(mesh);
            placed[i] = (Placed){mesh, random_map(&random, 1 + hand_random(&random), i & 1, to[i])};
            shapes[i].transform = i < STILL ? program_affine(&arena, &placed[i].map)
                                            : program_turning(&arena, rate[i], to[i], velocity[i]);
        }
        Scene scene = hand_scene(&arena, shapes, ALL, 40, 5);
        RenderOptions options = hand_options();
        options.accel = accel_find(names[run]);
        RenderStats stats;
        World *world = build(&scene, &options, 3, 2, &stats);
        WorldView *view = world_view_new(world);
        int n_hits = 0;
        for (int k = 0; k < 3000; k++) {
            Instant at = instant_at(2 + (k & 1), hand_random(&random));
            world_view_time(view, at);
            for (int i = STILL; i < ALL; i++) {
                double t = ((double)at.frame + at.frac) / 24;
                placed[i] = (Placed){mesh, turned(rate[i], to[i], velocity[i], t)};
            }
            Vec3 o = vec3_scale(random_direction(&random), 30 * hand_random(&random));
            int aim = (int)(hand_random(&random) * ALL);
            Vec3 target =
                vec3(placed[aim].map.m[0][3], placed[aim].map.m[1][3], placed[aim].map.m[2][3]);
            target = vec3_madd(target, 0.6, random_direction(&random));
            Vec3 d = vec3_scale(vec3_sub(target, o), 0.01 + 3 * hand_random(&random));
            WorldHit hit;
            n_hits += world_closest(view, o, d, 0, INFINITY, &hit);
            assert_true(agrees(view, placed, ALL, o, d, 1 / vec3_length(d)));
        }
        assert_true(n_hits > 1500);
        world_view_destroy(view, NULL);
        world_destroy(world);
        arena_free(&arena);
    }
}

// Cubes from a micrometre to a thousand kilometres, each met by rays at its own scale.
static void scales_and_mirrors(void **state) {
    (void)state;
    enum { N = 13 };
    Arena arena = {0};
    uint64_t random = 11;
    Mesh *mesh = mesh_cube(&arena, 1);
    Shape shapes[N];
    Placed placed[N];
    for (int i = 0; i < N; i++) {
        double scale = pow(10, i - 6);
        Vec3 to = vec3(3e6 * i, -5 * scale, 2 * scale);
        placed[i] = (Placed){mesh, random_map(&random, scale, i & 1, to)};
        shapes[i] = hand_mesh(mesh);
        shapes[i].transform = program_affine(&arena, &placed[i].map);
    }
    Scene scene = hand_scene(&arena, shapes, N, 40, 5);
    RenderOptions options = hand_options();
    RenderStats stats;
    World *world = build(&scene, &options, 1, 1, &stats);
    WorldView *view = world_view_new(world);
    for (int k = 0; k < 2000; k++) {
        int i = k % N;
        double scale = pow(10, i - 6);
        Vec3 center = {placed[i].map.m[0][3], placed[i].map.m[1][3], placed[i].map.m[2][3]};
        Vec3 o = vec3_madd(center, 3 * scale, random_direction(&random));
        Vec3 target = vec3_madd(center, 0.5 * scale, random_direction(&random));
        Vec3 d = vec3_sub(target, o);
        // The rounding of coordinates of 4e7 metres is what the smallest cubes can be met with.
        double size = fmax(1, 4e7 * 1e-15 / scale * 1e5);
        assert_true(agrees(view, placed, N, o, d, size));
        WorldHit hit;
        SurfacePoint point;
        if (world_closest(view, o, d, 0, INFINITY, &hit)) {
            world_surface(view, o, d, &hit, &point);
            Vec3 out = vec3_sub(point.P, center);
            assert_true(vec3_dot(out, point.Ng) > 0); // outside, mirrored or not
            Vec3 start = vec3_madd(point.P, point.error, point.Ng);
            WorldHit again;
            bool is_in = world_closest(view, start, point.Ng, 0, INFINITY, &again);
            assert_true(!is_in || again.object != hit.object); // the cube is convex
        }
    }
    world_view_destroy(view, NULL);
    world_destroy(world);
    arena_free(&arena);
}

// A world around the origin and the same 1e9 metres away give the same hits.
static void far_away(void **state) {
    (void)state;
    Arena arena = {0};
    uint64_t random = 5;
    Mesh *mesh = mesh_cube(&arena, 1);
    const double away = 1 << 30;
    Affine map = random_map(&random, 1, false, vec3(0, 0, 0)), moved = map;
    moved.m[0][3] += away;
    Shape near_shape = hand_mesh(mesh), far_shape = hand_mesh(mesh);
    near_shape.transform = program_affine(&arena, &map);
    far_shape.transform = program_affine(&arena, &moved);
    Scene near_scene = hand_scene(&arena, &near_shape, 1, 40, 5);
    Scene far_scene = hand_scene(&arena, &far_shape, 1, 40, 5);
    RenderOptions options = hand_options();
    RenderStats stats;
    World *a = build(&near_scene, &options, 1, 1, &stats);
    World *b = build(&far_scene, &options, 1, 1, &stats);
    WorldView *va = world_view_new(a), *vb = world_view_new(b);
    for (int k = 0; k < 1000; k++) {
        Vec3 o = vec3_scale(random_direction(&random), 3);
        // Coordinates that survive the addition: a multiple of its rounding.
        o = vec3(ldexp(rint(ldexp(o.x, 20)), -20), o.y, o.z);
        Vec3 d = vec3_sub(vec3_scale(random_direction(&random), 0.5), o);
        WorldHit ha = {0}, hb = {0};
        bool is_hit = world_closest(va, o, d, 0, INFINITY, &ha);
        assert_true(is_hit == world_closest(vb, vec3(o.x + away, o.y, o.z), d, 0, INFINITY, &hb));
        assert_memory_equal(&ha, &hb, sizeof ha);
    }
    world_view_destroy(va, NULL);
    world_view_destroy(vb, NULL);
    world_destroy(a);
    world_destroy(b);
    arena_free(&arena);
}

static void still_things_are_sampled_once(void **state) {
    (void)state;
    Arena arena = {0};
    Shape shapes[2] = {hand_mesh(mesh_cube(&arena, 1)), hand_mesh(mesh_cube(&arena, 2))};
    shapes[1].transform = program_turning(&arena, 100, vec3(5, 0, 0), vec3(0, 0, 0));
    Scene scene = hand_scene(&arena, shapes, 2, 40, 5);
    RenderOptions options = hand_options();
    RenderStats stats;
    World *world = build(&scene, &options, 1, 10, &stats);
    assert_int_equal(stats.n_keys, 2);
    assert_int_equal(stats.vertex_evaluations, 16);
    assert_int_equal(stats.vertex_bytes, 16 * 3 * sizeof(float));
    world_destroy(world);
    arena_free(&arena);
}

static void sphere_surface(void **state) {
    (void)state;
    Arena arena = {0};
    uint64_t random = 3;
    // An ellipsoid: a sphere under a stretched map that moves.
    Shape shape = hand_sphere(&arena, vec3(0.5, 0, 0), 2);
    shape.transform = program_turning(&arena, 30, vec3(1, 2, 3), vec3(4, 0, 0));
    Scene scene = hand_scene(&arena, &shape, 1, 40, 5);
    RenderOptions options = hand_options();
    RenderStats stats;
    World *world = build(&scene, &options, 1, 1, &stats);
    WorldView *view = world_view_new(world);
    for (int k = 0; k < 500; k++) {
        double frac = hand_random(&random), t = frac / 24;
        world_view_time(view, (Instant){0, frac});
        Affine map = turned(30, vec3(1, 2, 3), vec3(4, 0, 0), t);
        Vec3 center = affine_point(&map, vec3(0.5, 0, 0));
        Vec3 o = vec3_scale(random_direction(&random), 20), d = vec3_sub(center, o);
        WorldHit hit;
        SurfacePoint point;
        assert_true(world_closest(view, o, d, 0, INFINITY, &hit));
        assert_near(hit.t, 1 - 2 / vec3_length(d), 1e-6);
        world_surface(view, o, d, &hit, &point);
        assert_near(vec3_length(vec3_sub(point.P, center)), 2, 1e-6);
        assert_near(vec3_dot(point.Ng, vec3_normalize(d)), -1, 1e-6);
        // v = velocity + rate * z x (P - axis)
        Vec3 arm = vec3(point.P.x - map.m[0][3], point.P.y - map.m[1][3], 0);
        assert_near(point.velocity.x, 4 - 30 * arm.y, 1e-4);
        assert_near(point.velocity.y, 30 * arm.x, 1e-4);
        assert_near(point.velocity.z, 0, 1e-4);
    }
    world_view_destroy(view, NULL);
    world_destroy(world);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(rays_agree_with_flattened),
    cmocka_unit_test(scales_and_mirrors),
    cmocka_unit_test(far_away),
    cmocka_unit_test(still_things_are_sampled_once),
    cmocka_unit_test(sphere_surface),
};

SUITE(world, tests)
