// SPDX-License-Identifier: Apache-2.0
// The scenes of the benchmark. Each is written by a formula at every key, then brought into the
// unit frame in which the structures work.
#include "tests/bench/scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/mesh.h"

static const double PI = 3.14159265358979323846;

typedef struct {
    double *rest; // [n_vertices][3]
    uint32_t *index;
    uint32_t n_vertices, n_triangles;
} Base;

typedef void Map(double u, double v, uint32_t id, double p[3]);
typedef void Deform(const double rest[3], double time, double out[3]);

static double hash(uint32_t k) {
    k ^= k >> 16;
    k *= 0x7feb352dU;
    k ^= k >> 15;
    k *= 0x846ca68bU;
    k ^= k >> 16;
    return k * 0x1p-32;
}

static uint32_t place(const double p[3], double scale) {
    return (uint32_t)(int32_t)floor(p[0] * scale + 100) * 73856093u ^
           (uint32_t)(int32_t)floor(p[1] * scale + 100) * 19349663u ^
           (uint32_t)(int32_t)floor(p[2] * scale + 100) * 83492791u;
}

// A grid of nu x nv quads under a map of the unit square.
static void add_grid(Base *base, uint32_t nu, uint32_t nv, Map *map, uint32_t id) {
    uint32_t first = base->n_vertices;
    base->rest = realloc(base->rest, (base->n_vertices + (size_t)(nu + 1) * (nv + 1)) * 24);
    base->index = realloc(base->index, (base->n_triangles + (size_t)nu * nv * 2) * 12);
    for (uint32_t j = 0; j <= nv; j++) {
        for (uint32_t i = 0; i <= nu; i++) {
            map((double)i / nu, (double)j / nv, id, base->rest + 3 * (size_t)base->n_vertices++);
        }
    }
    for (uint32_t j = 0; j < nv; j++) {
        for (uint32_t i = 0; i < nu; i++) {
            uint32_t a = first + j * (nu + 1) + i, b = a + 1, c = a + nu + 1, d = c + 1;
            uint32_t quad[6] = {a, b, d, a, d, c};
            memcpy(base->index + 3 * (size_t)base->n_triangles, quad, sizeof quad);
            base->n_triangles += 2;
        }
    }
}

static void turn(const double p[3], int axis, double angle, double out[3]) {
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    double c = cos(angle), s = sin(angle), x = p[i], y = p[j], z = p[axis];
    out[i] = c * x - s * y;
    out[j] = s * x + c * y;
    out[axis] = z;
}

static void ball(double u, double v, double r, double p[3]) {
    p[0] = r * sin(PI * v) * cos(2 * PI * u);
    p[1] = r * cos(PI * v);
    p[2] = r * sin(PI * v) * sin(2 * PI * u);
}

static void blade_map(double u, double v, uint32_t id, double p[3]) {
    double flat[3] = {(0.12 + 0.15 * sin(PI * u)) * (2 * v - 1), 0.1 + 1.3 * u, 0}, q[3];
    turn(flat, 1, (52 - 34 * u) * PI / 180, q);
    turn(q, 2, 2 * PI / 3 * id, p);
}

static void head_map(double u, double v, uint32_t id, double p[3]) {
    (void)id;
    ball(u, v, 1 + 0.15 * sin(10 * PI * u) * sin(4 * PI * v), p);
    p[1] *= 1.3;
}

static void figure_map(double u, double v, uint32_t id, double p[3]) {
    (void)id;
    double a = 2 * PI * u, b = PI * v;
    ball(u, v,
         0.8 + 0.25 * sin(3 * a) * sin(2 * b) + 0.05 * sin(23 * a) * sin(31 * b) +
             0.01 * sin(150 * a) * sin(140 * b),
         p);
    p[1] *= 1.5;
}

static void hair_map(double u, double v, uint32_t id, double p[3]) {
    double a = 2 * PI * hash(id * 5 + 1), b = acos(1 - 2 * hash(id * 5 + 2)), r = 1 + v;
    double curl = 0.3 * v * v * (hash(id * 5 + 3) - 0.5), w = 0.002 * (u - 0.5);
    p[0] = r * sin(b) * cos(a + curl) - w * sin(a);
    p[1] = r * cos(b);
    p[2] = r * sin(b) * sin(a + curl) + w * cos(a);
}

static void wall_map(double u, double v, uint32_t id, double p[3]) {
    int axis = (int)(id % 3);
    p[axis] = 2 * (id / 3 % 2 ? 1 : -1) + 0.05 * sin(20 * u) * sin(17 * v);
    p[(axis + 1) % 3] = 4 * u - 2;
    p[(axis + 2) % 3] = 4 * v - 2;
}

static void furniture_map(double u, double v, uint32_t id, double p[3]) {
    ball(u, v, 0.15 + 0.1 * hash(id), p);
    for (uint32_t a = 0; a < 3; a++) {
        p[a] += 3.2 * hash(id + 1000 * (a + 1)) - 1.6;
    }
}

// Marked by its place far to the right; one_moves() brings it into the room.
static void thing_map(double u, double v, uint32_t id, double p[3]) {
    (void)id;
    ball(u, v, 0.2, p);
    p[0] += 20;
}

static void cell_map(double u, double v, uint32_t id, double p[3]) {
    ball(u, v, 0.15, p);
    p[0] += 0.5 * (id % 10) - 2.25;
    p[1] += 0.5 * (id / 10 % 10) - 2.25;
    p[2] += 0.5 * (id / 100) - 2.25;
}

static double smooth(double x) {
    x = x < 0 ? 0 : x > 1 ? 1 : x;
    return x * x * (3 - 2 * x);
}

static void still(const double p[3], double t, double out[3]) {
    (void)t;
    memcpy(out, p, 3 * sizeof *out);
}

static void spin(const double p[3], double t, double out[3]) {
    turn(p, 2, 2 * PI * 5.0 / 12 * t, out);
}

static void twist(const double p[3], double t, double out[3]) {
    turn(p, 1, smooth(t) * 3 * PI * smooth((p[1] + 1.3) / 2.6), out);
}

static void bend(const double p[3], double t, double out[3]) {
    turn(p, 2, p[1] > 0 ? sin(t * PI / 3) * PI / 3 * p[1] / 1.3 : 0, out);
}

static void one_moves(const double p[3], double t, double out[3]) {
    memcpy(out, p, 3 * sizeof *out);
    if (p[0] > 10) {
        out[0] = p[0] - 20 - 1.5 + 3 * t;
        out[1] = p[1] + 0.5 * sin(PI * t);
    }
}

static void fly(const double p[3], double t, double out[3]) {
    memcpy(out, p, 3 * sizeof *out);
    out[0] += 60 * t;
}

static void explode(const double p[3], double t, double out[3]) {
    uint32_t k = place(p, 40);
    for (uint32_t a = 0; a < 3; a++) {
        out[a] = p[a] * (1 + t) + t * (hash(k + a * 7919u) - 0.5);
    }
}

static void drift_apart(const double p[3], double t, double out[3]) {
    double cell[3] = {p[0] + 0.25, p[1] + 0.25, p[2] + 0.25};
    uint32_t k = place(cell, 2);
    for (uint32_t a = 0; a < 3; a++) {
        out[a] = p[a] + t * 0.6 * (hash(k + a * 7919u) - 0.5);
    }
}

static void sway(const double p[3], double t, double out[3]) {
    double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1;
    turn(p, 1, 0.5 * r * sin(3 * t), out);
}

// Gives every triangle three vertices of its own, drawn together so that it flies as one.
static void unshare(Base *base) {
    size_t n = (size_t)base->n_triangles * 3;
    double *rest = malloc(n * 24);
    for (size_t i = 0; i < n; i++) {
        memcpy(rest + 3 * i, base->rest + 3 * (size_t)base->index[i], 24);
        base->index[i] = (uint32_t)i;
    }
    free(base->rest);
    base->rest = rest;
    base->n_vertices = (uint32_t)n;
}

static void read_point(const Mesh *mesh, const double lo[3], const double hi[3], size_t corner,
                       double p[3]) {
    for (int a = 0; a < 3; a++) {
        double x = mesh->position[3 * (size_t)mesh->index[corner] + (size_t)a];
        p[a] = (x - 0.5 * (lo[a] + hi[a])) * 2.6 / (hi[1] - lo[1]);
    }
}

// One midpoint subdivision; midpoints are not shared: the structures have to weld them.
static bool load_obj(const char *path, Base *base) {
    Arena arena = {0};
    Mesh mesh;
    char message[200];
    if (mesh_read(&arena, path, &mesh, message, sizeof message) != MESH_OK) {
        fprintf(stderr, "%s: %s; the procedural figure is used\n", path, message);
        return false;
    }
    base->n_triangles = mesh.n_triangles * 4;
    base->n_vertices = base->n_triangles * 3;
    base->rest = malloc(base->n_vertices * (size_t)24);
    base->index = malloc(base->n_vertices * (size_t)4);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < (size_t)mesh.n_vertices * 3; i++) {
        lo[i % 3] = fmin(lo[i % 3], mesh.position[i]);
        hi[i % 3] = fmax(hi[i % 3], mesh.position[i]);
    }
    for (size_t t = 0; t < mesh.n_triangles; t++) {
        double p[6][3];
        for (size_t c = 0; c < 3; c++) {
            read_point(&mesh, lo, hi, 3 * t + c, p[c]);
        }
        for (int c = 0; c < 3; c++) {
            for (int a = 0; a < 3; a++) {
                p[3 + c][a] = 0.5 * (p[c][a] + p[(c + 1) % 3][a]);
            }
        }
        static const int part[12] = {0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5};
        for (size_t k = 0; k < 12; k++) {
            memcpy(base->rest + 3 * (12 * t + k), p[part[k]], 24);
        }
    }
    for (uint32_t i = 0; i < base->n_vertices; i++) {
        base->index[i] = i;
    }
    arena_free(&arena);
    return true;
}

static void finish(BenchScene *scene, Base *base, uint32_t n_keys, Deform *deform) {
    size_t n = base->n_vertices;
    double *all = malloc(n_keys * n * 24);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t k = 0; k < n_keys; k++) {
        double time = n_keys > 1 ? (double)k / (n_keys - 1) : 0.37;
        for (size_t v = 0; v < n; v++) {
            double *p = all + 3 * (k * n + v);
            deform(base->rest + 3 * v, time, p);
            for (int a = 0; a < 3; a++) {
                lo[a] = fmin(lo[a], p[a]);
                hi[a] = fmax(hi[a], p[a]);
            }
        }
    }
    double extent = fmax(hi[0] - lo[0], fmax(hi[1] - lo[1], hi[2] - lo[2]));
    scene->position = malloc(n_keys * n * 12);
    for (size_t i = 0; i < n_keys * n * 3; i++) {
        scene->position[i] = (float)((all[i] - 0.5 * (lo[i % 3] + hi[i % 3])) / extent);
    }
    scene->index = base->index;
    scene->geometry = (Geometry){.kind = GEOMETRY_TRIANGLES,
                                 .n_prims = base->n_triangles,
                                 .n_vertices = base->n_vertices,
                                 .n_keys = n_keys,
                                 .index = scene->index,
                                 .position = scene->position};
    free(all);
    free(base->rest);
}

static void make_room(Base *base, BenchScene *scene) {
    for (uint32_t k = 0; k < 6; k++) {
        add_grid(base, 60, 60, wall_map, k);
    }
    for (uint32_t k = 0; k < 40; k++) {
        add_grid(base, 24, 16, furniture_map, k);
    }
    scene->eye[0] = scene->eye[1] = 0.01f;
    scene->eye[2] = 0.2f;
    scene->window = 1;
}

static void make_many(Base *base, uint32_t n, uint32_t nu, uint32_t nv, Map *map) {
    for (uint32_t k = 0; k < n; k++) {
        add_grid(base, nu, nv, map, k);
    }
}

typedef enum { PROPELLER, HEAD, FIGURE, ROOM, ROOM_AND_THING, HAIR, TRIANGLES, OBJECTS } Shape;

static const struct {
    const char *name;
    Shape shape;
    uint32_t n_keys;
    Deform *deform;
} table[BENCH_N_SCENES] = {
    {"propeller, 9 keys", PROPELLER, 9, spin},
    {"head, 81 keys", HEAD, 81, twist},
    {"armadillo, 33 keys", FIGURE, 33, bend},
    {"armadillo, 5 keys", FIGURE, 5, bend},
    {"propeller, static", PROPELLER, 1, still},
    {"head, static", HEAD, 1, still},
    {"armadillo, static", FIGURE, 1, still},
    {"interior", ROOM, 1, still},
    {"hair", HAIR, 9, sway},
    {"still room", ROOM_AND_THING, 9, one_moves},
    {"long flight", HEAD, 2, fly},
    {"explosion", TRIANGLES, 5, explode},
    {"1000 objects", OBJECTS, 5, drift_apart},
};

bool bench_scene(int i, const char *obj, BenchScene *scene) {
    if (i < 0 || i >= BENCH_N_SCENES) {
        return false;
    }
    *scene = (BenchScene){.name = table[i].name, .eye = {0.3f, 0.2f, 1.6f}, .window = 0.42f};
    Base base = {0};
    switch (table[i].shape) {
    case PROPELLER:
        make_many(&base, 3, 16, 10, blade_map);
        break;
    case HEAD:
        add_grid(&base, 100, 50, head_map, 0);
        break;
    case FIGURE:
        if (!obj || !load_obj(obj, &base)) {
            add_grid(&base, 416, 416, figure_map, 0); // 346,112 triangles
        }
        break;
    case ROOM:
    case ROOM_AND_THING:
        make_room(&base, scene);
        if (table[i].shape == ROOM_AND_THING) {
            add_grid(&base, 24, 16, thing_map, 0);
        }
        break;
    case HAIR:
        make_many(&base, 20000, 1, 8, hair_map);
        break;
    case TRIANGLES:
        add_grid(&base, 150, 100, head_map, 0);
        unshare(&base);
        break;
    case OBJECTS:
        make_many(&base, 1000, 12, 8, cell_map);
        break;
    }
    finish(scene, &base, table[i].n_keys, table[i].deform);
    return true;
}

void bench_scene_free(BenchScene *scene) {
    free(scene->position);
    free(scene->index);
}
