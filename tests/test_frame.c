// SPDX-License-Identifier: Apache-2.0
// Frames: powers of two, exact distances, origins from far away.
#include "accel/frame.h"
#include "tests/accel_scenes.h"
#include "tests/suite.h"

static void frame_scales_by_powers_of_two(void **state) {
    (void)state;
    for (int e = -60; e <= 60; e++) {
        double x = ldexp(0.7, e);
        Frame frame = frame_from_box(vec3(1, 2, 3), vec3(1 + x, 2 + x / 2, 3));
        double local = x * frame.scale;
        assert_true(e < -40 || (local >= 0.49 && local < 1.01));
        int unused;
        assert_true(frexp(frame.scale, &unused) == 0.5);
    }
    Frame empty = frame_from_box(vec3(1, 1, 1), vec3(-1, -1, -1));
    assert_true(empty.scale == 1);
    Frame point = frame_from_box(vec3(5, 6, 7), vec3(5, 6, 7));
    assert_true(point.scale == 1 && point.center[2] == 7);
    Frame bad = frame_from_box(vec3(NAN, 0, 0), vec3(1, INFINITY, 1));
    assert_true(bad.scale == 1 && bad.center[0] == 0);
    Frame tiny = frame_from_box(vec3(0, 0, 0), vec3(5e-324, 0, 0));
    assert_true(isfinite(tiny.scale));
    Frame huge = frame_from_box(vec3(0, 0, 0), vec3(1e308, 0, 0));
    assert_true(huge.scale > 0);
}

// A point of the object, seen from `away` times its size: after the frame the local ray passes the
// same place, and its distance turns back into the caller's.
static void expect_exact(double away, double size, double offset, uint64_t seed) {
    Vec3 lo = vec3(offset, offset / 3, -offset),
         hi = vec3_add(lo, vec3(size, size * 0.8, size * 0.6));
    Frame frame = frame_from_box(lo, hi);
    for (int i = 0; i < 500; i++) {
        Vec3 target =
            vec3(lo.x + size * test_uniform(&seed), lo.y + 0.8 * size * test_uniform(&seed),
                 lo.z + 0.6 * size * test_uniform(&seed));
        Vec3 dir = vec3_normalize(
            vec3(test_uniform(&seed) - 0.5, test_uniform(&seed) - 0.5, test_uniform(&seed) - 0.5));
        dir = vec3_scale(dir, 0.01 + 10 * test_uniform(&seed));
        double t = away * size / vec3_length(dir);
        Vec3 origin = vec3_madd(target, -t, dir);
        AccelRay ray;
        FrameDistance distance;
        assert_true(frame_ray(&frame, origin, dir, 0, 2 * t, &ray, &distance));
        double local_t = (t - distance.base) / distance.unit;
        double local[3] = {target.x, target.y, target.z};
        // The doubles of the ray themselves are this exact.
        double given = 4 * 0x1p-53 * (vec3_length(origin) + vec3_length(target)) * frame.scale;
        for (int k = 0; k < 3; k++) {
            double want = (local[k] - frame.center[k]) * frame.scale;
            double got = ray.origin[k] + local_t * ray.dir[k];
            assert_true(fabs(got - want) < 2e-6 + given);
        }
        assert_true(ray.tmin <= local_t && local_t <= ray.tmax);
        assert_true(fabs(distance.base + distance.unit * ray.tmin) < 1e-6 * t);
    }
}

static void frame_keeps_far_rays_exact(void **state) {
    (void)state;
    expect_exact(0.5, 1, 0, 1);
    expect_exact(100, 1, 0, 2);
    expect_exact(1e9, 1, 0, 3);
    expect_exact(1e9, 1e-6, 0, 4);
    expect_exact(3, 0.01, 1e9, 5);
    expect_exact(1e4, 1e12, -1e9, 6);
}

static void frame_refuses_what_is_no_ray(void **state) {
    (void)state;
    Frame frame = {{0, 0, 0}, 1};
    AccelRay ray;
    FrameDistance distance;
    Vec3 o = vec3(0, 0, 1), d = vec3(0, 1, 0);
    assert_true(frame_ray(&frame, o, d, 0, INFINITY, &ray, &distance));
    assert_true(ray.tmax >= 1e37f);
    assert_false(frame_ray(&frame, o, vec3(0, 0, 0), 0, 1, &ray, &distance));
    assert_false(frame_ray(&frame, vec3(NAN, 0, 0), d, 0, 1, &ray, &distance));
    assert_false(frame_ray(&frame, vec3(0, INFINITY, 0), d, 0, 1, &ray, &distance));
    assert_false(frame_ray(&frame, o, vec3(0, NAN, 0), 0, 1, &ray, &distance));
    assert_false(frame_ray(&frame, o, d, NAN, 1, &ray, &distance));
    assert_false(frame_ray(&frame, o, d, 0, NAN, &ray, &distance));
    assert_true(frame_ray(&frame, o, vec3(0, 1e-300, 0), 0, 1, &ray, &distance));
    assert_true(ray.dir[1] >= 0.5f && ray.dir[1] < 1);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(frame_scales_by_powers_of_two),
    cmocka_unit_test(frame_keeps_far_rays_exact),
    cmocka_unit_test(frame_refuses_what_is_no_ray),
};

SUITE(frame, tests)
