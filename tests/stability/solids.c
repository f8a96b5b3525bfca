// SPDX-License-Identifier: Apache-2.0
// Closed moving meshes.
#include "tests/stability/solids.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

const char *const solid_names[SOLIDS] = {"sphere", "torus", "box"};

static float *position(const Solid *s, uint32_t key, uint32_t vertex) {
    return s->scene.position + 3 * ((size_t)key * s->scene.geometry.n_vertices + vertex);
}

static void set(float *p, double x, double y, double z) {
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}

static void quad(uint32_t **to, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const uint32_t corners[6] = {a, b, c, a, c, d};
    memcpy(*to, corners, sizeof corners);
    *to += 6;
}

static Solid allocate(uint32_t n_prims, uint32_t n_vertices, uint32_t n_keys, uint32_t n_inside) {
    Solid s = {.scene = scene_new(GEOMETRY_TRIANGLES, n_prims, n_vertices, n_keys)};
    s.n_inside = n_inside;
    s.inside = calloc(3 * (size_t)n_inside * n_keys, sizeof *s.inside);
    return s;
}

static Solid new_sphere(uint32_t n, uint32_t n_keys) {
    TestScene head = scene_head(n, 1, 0, 0);
    Solid s = allocate(head.geometry.n_prims, head.geometry.n_vertices, n_keys, 64);
    memcpy(s.scene.index, head.index, 3 * (size_t)head.geometry.n_prims * sizeof *head.index);
    memcpy(s.scene.position, head.position,
           3 * (size_t)head.geometry.n_vertices * sizeof *head.position);
    scene_free(&head);
    uint64_t seed = 1;
    for (uint32_t i = 1; i < s.n_inside; i++) { // the first is the centre
        for (int k = 0; k < 3; k++) {
            s.inside[3 * i + (uint32_t)k] = (float)(0.3 * (test_uniform(&seed) - 0.5));
        }
    }
    return s;
}

static Solid new_torus(uint32_t n, uint32_t n_keys) {
    uint32_t around = 4 * n, ring = n;
    Solid s = allocate(2 * around * ring, around * ring, n_keys, around);
    uint32_t *to = s.scene.index;
    for (uint32_t i = 0; i < around; i++) {
        double a = 2 * PI * i / around;
        set(&s.inside[3 * i], 0.35 * cos(a), 0, 0.35 * sin(a));
        for (uint32_t j = 0; j < ring; j++) {
            double b = 2 * PI * j / ring, r = 0.35 + 0.12 * cos(b);
            set(position(&s, 0, i * ring + j), r * cos(a), 0.12 * sin(b), r * sin(a));
            uint32_t i1 = (i + 1) % around, j1 = (j + 1) % ring;
            quad(&to, i * ring + j, i1 * ring + j, i1 * ring + j1, i * ring + j1);
        }
    }
    return s;
}

// Faces of n by n squares. Vertices on the edges of the box are not shared between its faces: the
// same bits must do.
static Solid new_box(uint32_t n, uint32_t n_keys) {
    uint32_t row = n + 1;
    Solid s = allocate(12 * n * n, 6 * row * row, n_keys, 64);
    uint32_t *to = s.scene.index;
    for (uint32_t face = 0; face < 6; face++) {
        uint32_t axis = face / 2, first = face * row * row;
        for (uint32_t i = 0; i < row * row; i++) {
            float *p = position(&s, 0, first + i);
            p[axis] = face % 2 ? 0.375f : -0.375f;
            p[(axis + 1) % 3] = -0.375f + 0.75f * (float)(i % row) / (float)n;
            p[(axis + 2) % 3] = -0.375f + 0.75f * (float)(i / row) / (float)n;
        }
        for (uint32_t i = 0; i < n * n; i++) {
            uint32_t a = first + i / n * row + i % n;
            quad(&to, a, a + 1, a + row + 1, a + row);
        }
    }
    uint64_t seed = 3;
    for (uint32_t i = 1; i < s.n_inside; i++) {
        for (int k = 0; k < 3; k++) {
            s.inside[3 * i + (uint32_t)k] = (float)(0.5 * (test_uniform(&seed) - 0.5));
        }
    }
    return s;
}

Solid solid_new(SolidShape shape, uint32_t n, uint32_t n_keys) {
    Solid s = shape == SOLID_SPHERE  ? new_sphere(n, n_keys)
              : shape == SOLID_TORUS ? new_torus(n, n_keys)
                                     : new_box(n, n_keys);
    size_t n_key = 3 * (size_t)s.scene.geometry.n_vertices;
    for (uint32_t k = 1; k < n_keys; k++) {
        memcpy(position(&s, k, 0), s.scene.position, n_key * sizeof(float));
        memcpy(s.inside + 3 * (size_t)s.n_inside * k, s.inside, 12 * (size_t)s.n_inside);
    }
    snprintf(s.label, sizeof s.label, "solid_new(%s, %u, %u)", solid_names[shape], n, n_keys);
    return s;
}

void solid_free(Solid *solid) {
    free(solid->inside);
    scene_free(&solid->scene);
}

static void map_points(float *points, uint32_t n, const Affine *map) {
    for (uint32_t i = 0; i < n; i++) {
        float *p = points + 3 * (size_t)i;
        Vec3 q = affine_point(map, vec3(p[0], p[1], p[2]));
        set(p, q.x, q.y, q.z);
    }
}

void solid_map(Solid *s, uint32_t key, const Affine *map) {
    map_points(position(s, key, 0), s->scene.geometry.n_vertices, map);
    map_points(s->inside + 3 * (size_t)s->n_inside * key, s->n_inside, map);
}

// The same for the same place in the rest pose, whichever vertex it is: what is closed stays so.
static double tremor(const float *rest, uint32_t key, int axis, uint64_t seed) {
    uint32_t bits[3];
    memcpy(bits, rest, sizeof bits);
    uint64_t h = seed + bits[0] * 0x9e3779b97f4a7c15u + bits[1] * 0xbf58476d1ce4e5b9u +
                 bits[2] * 0x94d049bb133111ebu + key * 3u + (uint64_t)axis;
    return test_uniform(&h) - 0.5;
}

void solid_move(Solid *s, double angle, double tremble, uint64_t seed) {
    const Geometry *g = &s->scene.geometry;
    size_t size = 3 * (size_t)g->n_vertices * sizeof(float);
    float *rest = malloc(size);
    memcpy(rest, position(s, 0, 0), size);
    for (size_t i = 0; i < 3 * (size_t)g->n_vertices; i++) {
        rest[i] += 0.0f; // -0 and 0 are one place
    }
    for (uint32_t k = 0; k < g->n_keys; k++) {
        double a = angle * k, c = cos(a), n = sin(a), e = 1 + 0.25 * sin(2.1 * k), b = 0.2 * n;
        Affine map = {{{c * e, -n, b, 0.05 * n}, {n * e, c, 0, 0.03 * k}, {0, b, 1, -0.02 * k}}};
        for (uint32_t v = 0; v < g->n_vertices; v++) {
            for (int i = 0; i < 3; i++) {
                position(s, k, v)[i] += (float)(tremble * tremor(rest + 3 * (size_t)v, k, i, seed));
            }
        }
        solid_map(s, k, &map);
    }
    free(rest);
    size_t used = strlen(s->label);
    snprintf(s->label + used, sizeof s->label - used, ", solid_move(%g, %g, %llu)", angle, tremble,
             (unsigned long long)seed);
}

AccelRay solid_ray(const Solid *s, uint64_t *random) {
    const Geometry *g = &s->scene.geometry;
    AccelRay ray = {.tmax = INFINITY, .f = (float)test_uniform(random)};
    uint32_t n_spans = g->n_keys > 1 ? g->n_keys - 1 : 1;
    ray.key = (uint32_t)(test_random(random) % n_spans);
    if (test_random(random) % 8 == 0) {
        ray.f = (float)(test_random(random) % 17) / 16;
    }
    size_t i = (size_t)(test_random(random) % s->n_inside);
    const float *a = s->inside + 3 * (i + (size_t)s->n_inside * ray.key);
    const float *b = g->n_keys > 1 ? a + 3 * (size_t)s->n_inside : a;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = fmaf(ray.f, b[k] - a[k], a[k]);
    }
    random_direction(random, ray.dir);
    return ray;
}

void vertex_at(const Geometry *g, const AccelRay *ray, uint32_t vertex, float p[3]) {
    const float *a = g->position + 3 * ((size_t)g->n_vertices * ray->key + vertex);
    const float *b = g->n_keys > 1 ? a + 3 * (size_t)g->n_vertices : a;
    for (int k = 0; k < 3; k++) {
        p[k] = fmaf(ray->f, b[k] - a[k], a[k]);
    }
}

void random_direction(uint64_t *random, float d[3]) {
    double length;
    do {
        length = 0;
        for (int k = 0; k < 3; k++) {
            d[k] = (float)(2 * test_uniform(random) - 1);
            length += (double)d[k] * d[k];
        }
    } while (length > 1 || length < 0.01);
}
