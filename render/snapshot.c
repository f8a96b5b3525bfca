// SPDX-License-Identifier: Apache-2.0
// A snapshot: counted first, then filled in, object by object.
#include "render/snapshot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "render/local_time.h"
#include "render/mover.h"

// A sphere's mesh: circles between the poles, points on each.
enum { CIRCLES = 11, AROUND = 24 };
static const uint32_t SPHERE_VERTICES = 2 + CIRCLES * AROUND;
static const uint32_t SPHERE_TRIANGLES = 2 * CIRCLES * AROUND;

typedef struct {
    const Scene *scene;
    const char *label;
    double seconds;
    Mesh *mesh;
    Snapshot *snapshot;
} Taker;

// Whether `name` is the label asked for, or of something within.
static bool lies_within(const char *name, const char *label) {
    size_t n = strlen(label);
    for (const char *at = name; at; at = strchr(at, '/')) {
        at += *at == '/';
        if (strncmp(at, label, n) == 0 && (!at[n] || at[n] == '/' || at[n] == '[')) {
            return true;
        }
    }
    return false;
}

void shape_name(const Shape *shape, uint32_t instance, char *name, size_t size) {
    double in[IN_COUNT], number = instance;
    if (shape->number) {
        shape_inputs(shape, shape_loops(shape, instance), 0, in);
        program_run1(shape->number, in, &number);
    }
    if (shape->number || shape->n_instances > 1) {
        snprintf(name, size, shape->is_joined ? "%s%.15g" : "%s[%.15g]", shape->label, number);
    } else {
        snprintf(name, size, "%s", shape->label);
    }
}

static bool is_wanted(const Taker *taker, const Shape *shape, uint32_t instance) {
    char name[512];
    if (!taker->label || (!shape->is_joined && lies_within(shape->label, taker->label))) {
        return true;
    }
    shape_name(shape, instance, name, sizeof name);
    return lies_within(name, taker->label);
}

static bool is_there(const Shape *shape, const double in[IN_COUNT], Affine *map) {
    double visible = 1;
    if (shape->visible) {
        program_run1(shape->visible, in, &visible);
    }
    return affine_run(shape->transform, in, map) && visible != 0;
}

static void put_point(Mesh *mesh, const Affine *map, Vec3 p) {
    Vec3 world = affine_point(map, p);
    double *at = &mesh->position[3 * (size_t)mesh->n_vertices++];
    at[0] = world.x;
    at[1] = world.y;
    at[2] = world.z;
}

static void put_triangle(Mesh *mesh, uint32_t base, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *at = &mesh->index[3 * (size_t)mesh->n_triangles++];
    at[0] = base + a;
    at[1] = base + b;
    at[2] = base + c;
}

static void put_mesh(Taker *taker, const Shape *shape, const MoverPart *part, double seconds,
                     const Affine *map) {
    Mesh *mesh = taker->mesh;
    Arena scratch = {0};
    uint32_t n = shape->mesh->n_vertices, base = mesh->n_vertices;
    double *out[4] = {0};
    for (int k = 0; k < 3; k++) {
        out[k] = ARENA_ARRAY(&scratch, n, double);
    }
    MoverPart one = *part;
    Mover mover = {&one, 1, 3, n};
    mover_run(&mover, seconds, &scratch, out);
    if (mesh->uv && shape->mesh->uv) {
        memcpy(mesh->uv + 2 * (size_t)base, shape->mesh->uv, 2 * (size_t)n * sizeof(float));
    }
    for (uint32_t i = 0; i < n; i++) {
        put_point(mesh, map, vec3(out[0][i], out[1][i], out[2][i]));
    }
    for (uint32_t f = 0; f < shape->mesh->n_triangles; f++) {
        const uint32_t *v = &shape->mesh->index[3 * (size_t)f];
        put_triangle(mesh, base, v[0], v[1], v[2]);
    }
    arena_free(&scratch);
}

static void put_sphere(Taker *taker, const Shape *shape, const double in[IN_COUNT],
                       const Affine *map) {
    static const double pi = 3.141592653589793;
    Mesh *mesh = taker->mesh;
    uint32_t base = mesh->n_vertices, south = 1 + CIRCLES * AROUND;
    double s[4]; // centre, radius
    program_run1(shape->geometry, in, s);
    put_point(mesh, map, vec3(s[0], s[1] + s[3], s[2]));
    for (uint32_t i = 0; i < CIRCLES * AROUND; i++) {
        double down = pi * (1 + i / AROUND) / (CIRCLES + 1),
               around = 2 * pi * (i % AROUND) / AROUND;
        put_point(mesh, map,
                  vec3(s[0] + s[3] * sin(down) * cos(around), s[1] + s[3] * cos(down),
                       s[2] - s[3] * sin(down) * sin(around)));
    }
    put_point(mesh, map, vec3(s[0], s[1] - s[3], s[2]));
    for (uint32_t i = 0; i < AROUND; i++) {
        uint32_t next = (i + 1) % AROUND;
        put_triangle(mesh, base, 0, 1 + i, 1 + next);
        for (uint32_t c = 0; c + 1 < CIRCLES; c++) {
            uint32_t upper = 1 + c * AROUND, lower = upper + AROUND;
            put_triangle(mesh, base, upper + i, lower + i, lower + next);
            put_triangle(mesh, base, upper + i, lower + next, upper + next);
        }
        put_triangle(mesh, base, south, south - AROUND + next, south - AROUND + i);
    }
}

static void flip(Mesh *mesh, uint32_t first) {
    for (size_t f = first; f < mesh->n_triangles; f++) {
        uint32_t *v = &mesh->index[3 * f], b = v[1];
        v[1] = v[2];
        v[2] = b;
    }
}

static bool is_mirrored(const Affine *map) {
    Vec3 x = affine_vector(map, vec3(1, 0, 0)), y = affine_vector(map, vec3(0, 1, 0)),
         z = affine_vector(map, vec3(0, 0, 1));
    return vec3_dot(vec3_cross(x, y), z) < 0;
}

static void put_instance(Taker *taker, const Shape *shape, MoverPart *part, uint32_t instance) {
    double in[IN_COUNT];
    Affine map;
    shape_inputs(shape, shape_loops(shape, instance), taker->seconds, in);
    if (shape->kind == SHAPE_PLANE) {
        taker->snapshot->n_planes++;
        return;
    }
    if (!is_there(shape, in, &map)) {
        taker->snapshot->n_absent += !shape->is_other_form;
        return;
    }
    taker->snapshot->n_objects++;
    taker->snapshot->n_absent -= shape->is_other_form; // which it was in the form before
    uint32_t first = taker->mesh->n_triangles;
    if (shape->kind == SHAPE_SPHERE) {
        put_sphere(taker, shape, in, &map);
    } else {
        mover_set_loops(&part->in, shape, instance);
        double shown = shape_seconds(shape, shape_loops(shape, instance), taker->seconds);
        put_mesh(taker, shape, part, shown, &map);
    }
    if (is_mirrored(&map)) {
        flip(taker->mesh, first);
    }
}

static void put_shape(Taker *taker, const Shape *shape) {
    Arena scratch = {0};
    MoverPart part = {0};
    if (shape->kind == SHAPE_MESH) {
        part = mover_mesh(&scratch, shape, 0);
    }
    for (uint32_t i = 0; i < shape->n_instances; i++) {
        if (is_wanted(taker, shape, i)) {
            put_instance(taker, shape, &part, i);
        }
    }
    arena_free(&scratch);
}

// At most so many: those that are not there at the instant are counted too.
static void count(const Taker *taker, uint64_t *n_vertices, uint64_t *n_triangles, bool *has_uv) {
    for (uint32_t s = 0; s < taker->scene->n_shapes; s++) {
        const Shape *shape = &taker->scene->shapes[s];
        uint64_t n = 0;
        for (uint32_t i = 0; i < shape->n_instances; i++) {
            n += is_wanted(taker, shape, i);
        }
        if (shape->kind == SHAPE_SPHERE) {
            *n_vertices += n * SPHERE_VERTICES;
            *n_triangles += n * SPHERE_TRIANGLES;
        } else if (shape->mesh) {
            *n_vertices += n * shape->mesh->n_vertices;
            *n_triangles += n * shape->mesh->n_triangles;
            *has_uv |= n && shape->mesh->uv;
        }
    }
}

bool snapshot_take(Arena *arena, const Scene *scene, const char *label, double seconds, Mesh *mesh,
                   Snapshot *snapshot) {
    const uint64_t most = UINT64_C(1) << 31;
    Taker taker = {scene, label, seconds, mesh, snapshot};
    uint64_t n_vertices = 0, n_triangles = 0;
    bool has_uv = false;
    *mesh = (Mesh){0};
    *snapshot = (Snapshot){0};
    count(&taker, &n_vertices, &n_triangles, &has_uv);
    if (n_vertices > most || n_triangles > most) {
        return false;
    }
    mesh->position = ARENA_ARRAY(arena, (size_t)n_vertices * 3, double);
    mesh->index = ARENA_ARRAY(arena, (size_t)n_triangles * 3, uint32_t);
    mesh->uv = has_uv ? ARENA_ARRAY(arena, (size_t)n_vertices * 2, float) : NULL;
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        put_shape(&taker, &scene->shapes[s]);
    }
    return true;
}
