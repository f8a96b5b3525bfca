// SPDX-License-Identifier: Apache-2.0
// Moving geometry and rays for the tests of accel/.
#include "tests/accel_scenes.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

uint64_t test_random(uint64_t *seed) {
    uint64_t z = *seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double test_uniform(uint64_t *seed) {
    return (double)(test_random(seed) >> 11) * 0x1p-53;
}

TestScene scene_new(GeometryKind kind, uint32_t n_prims, uint32_t n_vertices, uint32_t n_keys) {
    TestScene s = {0};
    size_t places = (size_t)n_keys * n_vertices;
    bool triangles = kind == GEOMETRY_TRIANGLES;
    s.index = triangles ? calloc(3 * (size_t)n_prims + 1, sizeof *s.index) : NULL;
    s.radius = triangles ? NULL : calloc(places + 1, sizeof *s.radius);
    // Exactly as long as it must be, so that the sanitizers see a read past its end.
    s.position = malloc(places ? 3 * places * sizeof *s.position : 1);
    s.share = malloc((n_keys + 1) * sizeof *s.share);
    for (uint32_t i = 0; i <= n_keys; i++) {
        s.share[i] = 1;
    }
    for (size_t i = 0; i < 3 * places; i++) {
        s.position[i] = 0;
    }
    s.geometry =
        (Geometry){kind, n_prims, n_vertices, n_keys, s.index, s.position, s.radius, s.share};
    return s;
}

void scene_free(TestScene *scene) {
    free(scene->index);
    free(scene->position);
    free(scene->radius);
    free(scene->share);
}

static void set(TestScene *s, uint32_t key, uint32_t vertex, double x, double y, double z) {
    float *p = s->position + 3 * ((size_t)s->geometry.n_vertices * key + vertex);
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}

static double key_time(const TestScene *s, uint32_t key) {
    return s->geometry.n_keys > 1 ? key / (s->geometry.n_keys - 1.0) : 0;
}

static void triangle(TestScene *s, uint32_t *n, uint32_t a, uint32_t b, uint32_t c) {
    s->index[3 * *n] = a;
    s->index[3 * *n + 1] = b;
    s->index[3 * *n + 2] = c;
    ++*n;
}

enum { BLADES = 4, BLADE_CUTS = 30 };

TestScene scene_propeller(uint32_t n_keys, double turns) {
    uint32_t per_blade = 4 * (BLADE_CUTS + 1), n = 0;
    TestScene s =
        scene_new(GEOMETRY_TRIANGLES, BLADES * BLADE_CUTS * 8, BLADES * per_blade, n_keys);
    for (uint32_t b = 0; b < BLADES; b++) {
        for (uint32_t i = 0; i < BLADE_CUTS; i++) {
            for (uint32_t j = 0; j < 4; j++) {
                uint32_t at = b * per_blade + 4 * i;
                triangle(&s, &n, at + j, at + (j + 1) % 4, at + 4 + j);
                triangle(&s, &n, at + 4 + j, at + (j + 1) % 4, at + 4 + (j + 1) % 4);
            }
        }
    }
    for (uint32_t k = 0; k < n_keys; k++) {
        for (uint32_t v = 0; v < BLADES * per_blade; v++) {
            double turn = 2 * PI * (turns * key_time(&s, k) + v / per_blade / (double)BLADES);
            double r = 0.05 + 0.45 * (v % per_blade / 4) / BLADE_CUTS, pitch = 0.9 - r;
            double side = v % 4 == 1 || v % 4 == 2 ? 0.05 : -0.05, up = v % 4 > 1 ? 0.01 : -0.01;
            double w = side * cos(pitch) - up * sin(pitch), z = side * sin(pitch) + up * cos(pitch);
            set(&s, k, v, r * cos(turn) - w * sin(turn), r * sin(turn) + w * cos(turn), z);
        }
    }
    return s;
}

static double ease(double x) {
    return x * x * (3 - 2 * x);
}

TestScene scene_head(uint32_t n, uint32_t n_keys, double bump, double twist) {
    uint32_t around = 2 * n, rings = n - 1, n_out = 0;
    TestScene s = scene_new(GEOMETRY_TRIANGLES, 2 * around * rings, around * rings + 2, n_keys);
    uint32_t bottom = around * rings, top = bottom + 1;
    for (uint32_t i = 0; i < around; i++) {
        uint32_t j = (i + 1) % around, last = around * (rings - 1);
        triangle(&s, &n_out, bottom, j, i);
        triangle(&s, &n_out, top, last + i, last + j);
        for (uint32_t r = 0; r + 1 < rings; r++) {
            triangle(&s, &n_out, around * r + i, around * r + j, around * (r + 1) + i);
            triangle(&s, &n_out, around * (r + 1) + i, around * r + j, around * (r + 1) + j);
        }
    }
    for (uint32_t k = 0; k < n_keys; k++) {
        double turn = twist * ease(key_time(&s, k));
        set(&s, k, bottom, 0, -0.45, 0);
        set(&s, k, top, 0, 0.45, 0);
        for (uint32_t v = 0; v < around * rings; v++) {
            double theta = PI * (v / around + 1) / n, phi = 2 * PI * (v % around) / around;
            double r = 0.45 * (1 + bump * sin(9 * theta) * sin(7 * phi));
            double y = -r * cos(theta), angle = phi + turn * (y + 0.45);
            set(&s, k, v, r * sin(theta) * cos(angle), y, r * sin(theta) * sin(angle));
        }
    }
    return s;
}

static double around_zero(uint64_t *seed, double size) {
    return size * (2 * test_uniform(seed) - 1);
}

TestScene scene_soup(uint32_t n_prims, uint32_t n_keys, double size, double wander, uint64_t seed) {
    TestScene s = scene_new(GEOMETRY_TRIANGLES, n_prims, 3 * n_prims, n_keys);
    for (uint32_t i = 0, n = 0; i < n_prims; i++) {
        triangle(&s, &n, 3 * i, 3 * i + 1, 3 * i + 2);
        double x = around_zero(&seed, 0.45), y = around_zero(&seed, 0.45),
               z = around_zero(&seed, 0.45);
        for (uint32_t v = 3 * i; v < 3 * i + 3; v++) {
            double vx = x + around_zero(&seed, size), vy = y + around_zero(&seed, size),
                   vz = z + around_zero(&seed, size);
            for (uint32_t k = 0; k < n_keys; k++) {
                set(&s, k, v, vx, vy, vz);
                vx += around_zero(&seed, wander);
                vy += around_zero(&seed, wander);
                vz += around_zero(&seed, wander);
            }
        }
    }
    return s;
}

TestScene scene_spheres(uint32_t n_prims, uint32_t n_keys, double size, double wander,
                        uint64_t seed) {
    TestScene s = scene_new(GEOMETRY_SPHERES, n_prims, n_prims, n_keys);
    for (uint32_t v = 0; v < n_prims; v++) {
        double x = around_zero(&seed, 0.45), y = around_zero(&seed, 0.45),
               z = around_zero(&seed, 0.45), r = size * (0.2 + test_uniform(&seed));
        for (uint32_t k = 0; k < n_keys; k++) {
            set(&s, k, v, x, y, z);
            s.radius[(size_t)n_prims * k + v] = (float)r;
            x += around_zero(&seed, wander);
            y += around_zero(&seed, wander);
            z += around_zero(&seed, wander);
            r += around_zero(&seed, wander * size);
        }
    }
    return s;
}

AccelRay ray_random(const Geometry *geometry, uint64_t *seed) {
    AccelRay ray = {.tmin = 0, .tmax = INFINITY, .f = (float)test_uniform(seed)};
    ray.key = geometry->n_keys > 1 ? (uint32_t)(test_random(seed) % (geometry->n_keys - 1)) : 0;
    double reach = test_random(seed) % 3 ? 2 : 0.2;
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = (float)around_zero(seed, reach);
        ray.dir[i] = (float)(around_zero(seed, 0.45) - (reach > 1 ? ray.origin[i] : 0));
    }
    return ray;
}
