// SPDX-License-Identifier: Apache-2.0
// Vertex normals: which faces share them, their sums, their packing.
#include "render/smooth.h"

#include <stdlib.h>
#include <string.h>

#include "accel/arena.h"

typedef struct {
    uint64_t key[3];
    uint32_t vertex;
} Place;

// Equal places get equal keys; any total order does.
static uint64_t place_key(double x) {
    uint64_t bits;
    x += 0.0; // -0 is 0
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static int compare_places(const void *a, const void *b) {
    const Place *p = a, *q = b;
    for (int i = 0; i < 3; i++) {
        if (p->key[i] != q->key[i]) {
            return p->key[i] < q->key[i] ? -1 : 1;
        }
    }
    return (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

// weld[v]: the first of the vertices at v's place.
static uint32_t *weld_vertices(Arena *scratch, const Mesh *mesh) {
    size_t n = mesh->n_vertices;
    Place *places = ARENA_ARRAY(scratch, n, Place);
    for (size_t i = 0; i < n; i++) {
        places[i].vertex = (uint32_t)i;
        for (int k = 0; k < 3; k++) {
            places[i].key[k] = place_key(mesh->position[3 * i + k]);
        }
    }
    qsort(places, n, sizeof *places, compare_places);
    uint32_t *weld = ARENA_ARRAY(scratch, n, uint32_t), first = 0;
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || memcmp(places[i].key, places[i - 1].key, sizeof places[i].key) != 0) {
            first = places[i].vertex;
        }
        weld[places[i].vertex] = first;
    }
    return weld;
}

static Vec3 position_of(const Mesh *mesh, uint32_t vertex) {
    const double *p = &mesh->position[3 * (size_t)vertex];
    return vec3(p[0], p[1], p[2]);
}

// Unit normals of the rest pose's faces; zero where a face has none.
static Vec3 *face_normals(Arena *scratch, const Mesh *mesh) {
    Vec3 *normals = ARENA_ARRAY(scratch, mesh->n_triangles, Vec3);
    for (size_t f = 0; f < mesh->n_triangles; f++) {
        Vec3 a = position_of(mesh, mesh->index[3 * f]);
        Vec3 n = vec3_normalize(vec3_cross(vec3_sub(position_of(mesh, mesh->index[3 * f + 1]), a),
                                           vec3_sub(position_of(mesh, mesh->index[3 * f + 2]), a)));
        normals[f] = vec3_is_finite(n) ? n : vec3(0, 0, 0);
    }
    return normals;
}

// The corners (3 * face + k) around each place: corner[first[w] .. first[w + 1]).
typedef struct {
    uint32_t *first, *corner;
    uint32_t most; // at one place
} Corners;

static Corners gather_corners(Arena *scratch, const Mesh *mesh, const uint32_t *weld) {
    size_t n = mesh->n_vertices, n_corners = 3 * (size_t)mesh->n_triangles;
    Corners c = {ARENA_ARRAY(scratch, n + 2, uint32_t), ARENA_ARRAY(scratch, n_corners, uint32_t),
                 0};
    for (size_t i = 0; i < n_corners; i++) {
        c.first[weld[mesh->index[i]] + 2]++;
    }
    for (size_t i = 0; i < n; i++) {
        c.most = c.first[i + 2] > c.most ? c.first[i + 2] : c.most;
        c.first[i + 2] += c.first[i + 1];
    }
    for (size_t i = 0; i < n_corners; i++) {
        c.corner[c.first[weld[mesh->index[i]] + 1]++] = (uint32_t)i;
    }
    return c;
}

// An edge that leaves a place: where it goes, and which of the place's corners it bounds.
typedef struct {
    uint32_t to, slot;
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *e = a, *f = b;
    if (e->to != f->to) {
        return e->to < f->to ? -1 : 1;
    }
    return (e->slot > f->slot) - (e->slot < f->slot);
}

static uint32_t root_of(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

typedef struct {
    const Mesh *mesh;
    const uint32_t *weld;
    const Vec3 *face;
    double least_cosine;
    Edge *edges;
    uint32_t *parent;
} Grouping;

// Joins those of n corners whose faces meet in an edge that is smooth; faces without area, as at
// the poles of a surface, stay out of it, so that their neighbours meet.
static void join_corners(Grouping *g, const uint32_t *corner, uint32_t n) {
    uint32_t n_edges = 0;
    for (uint32_t i = 0; i < n; i++) {
        g->parent[i] = i;
        uint32_t f = corner[i] / 3, k = corner[i] % 3;
        if (vec3_dot(g->face[f], g->face[f]) > 0) {
            g->edges[n_edges++] = (Edge){g->weld[g->mesh->index[3 * f + (k + 1) % 3]], i};
            g->edges[n_edges++] = (Edge){g->weld[g->mesh->index[3 * f + (k + 2) % 3]], i};
        }
    }
    qsort(g->edges, n_edges, sizeof *g->edges, compare_edges);
    for (uint32_t i = 1; i < n_edges; i++) {
        const Edge *a = &g->edges[i - 1], *b = &g->edges[i];
        if (a->to == b->to && vec3_dot(g->face[corner[a->slot] / 3],
                                       g->face[corner[b->slot] / 3]) >= g->least_cosine) {
            g->parent[root_of(g->parent, a->slot)] = root_of(g->parent, b->slot);
        }
    }
}

static Smoothing group_corners(Arena *arena, const Mesh *mesh, double smooth) {
    Arena scratch = {0};
    const double pi = 3.141592653589793;
    Grouping g = {.mesh = mesh,
                  .weld = weld_vertices(&scratch, mesh),
                  .face = face_normals(&scratch, mesh),
                  // The last bits of a right angle should not decide.
                  .least_cosine = smooth >= pi ? -2 : cos(smooth) - 1e-9};
    Corners corners = gather_corners(&scratch, mesh, g.weld);
    g.edges = ARENA_ARRAY(&scratch, 2 * (size_t)corners.most, Edge);
    g.parent = ARENA_ARRAY(&scratch, corners.most, uint32_t);
    uint32_t *name = ARENA_ARRAY(&scratch, corners.most, uint32_t);
    uint32_t *index = ARENA_ARRAY(arena, 3 * (size_t)mesh->n_triangles, uint32_t), n_normals = 0;
    for (size_t w = 0; w < mesh->n_vertices; w++) {
        const uint32_t *corner = corners.corner + corners.first[w];
        uint32_t n = corners.first[w + 1] - corners.first[w];
        join_corners(&g, corner, n);
        for (uint32_t i = 0; i < n; i++) {
            name[i] = root_of(g.parent, i) == i ? n_normals++ : 0;
        }
        for (uint32_t i = 0; i < n; i++) {
            index[corner[i]] = name[root_of(g.parent, i)];
        }
    }
    arena_free(&scratch);
    return (Smoothing){.n_normals = n_normals, .index = index};
}

Smoothing smoothing_new(Arena *arena, const Mesh *mesh, double smooth, bool deforms) {
    if (smooth < 0 || mesh->faceted) {
        return (Smoothing){0};
    }
    if (!mesh->normal || deforms) {
        return group_corners(arena, mesh, smooth);
    }
    uint32_t *given = ARENA_ARRAY(arena, mesh->n_vertices, uint32_t);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const float *n = &mesh->normal[3 * i];
        given[i] = normal_pack(vec3(n[0], n[1], n[2]));
    }
    return (Smoothing){mesh->n_vertices, mesh->index, given};
}

void smoothing_run(const Smoothing *smoothing, const Mesh *mesh, const float *positions,
                   uint32_t *normal) {
    Arena scratch = {0};
    Vec3 *sum = ARENA_ARRAY(&scratch, smoothing->n_normals, Vec3);
    for (size_t f = 0; f < mesh->n_triangles; f++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const float *x = &positions[3 * (size_t)mesh->index[3 * f + k]];
            p[k] = vec3(x[0], x[1], x[2]);
        }
        Vec3 n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
        for (int k = 0; k < 3 && vec3_is_finite(n); k++) {
            uint32_t at = smoothing->index[3 * f + k];
            if (at != NORMAL_NONE) {
                sum[at] = vec3_add(sum[at], n);
            }
        }
    }
    for (size_t i = 0; i < smoothing->n_normals; i++) {
        normal[i] = normal_pack(sum[i]);
    }
    arena_free(&scratch);
}

// A coordinate of the octahedral square in [-1, 1] as 1..65535; 0 is left for "none".
static uint32_t pack_coordinate(double x) {
    return 1 + (uint32_t)((x * 0.5 + 0.5) * 65534 + 0.5);
}

static double unpack_coordinate(uint32_t bits) {
    return ((double)bits - 1) / 65534 * 2 - 1;
}

uint32_t normal_pack(Vec3 n) {
    double size = fabs(n.x) + fabs(n.y) + fabs(n.z);
    if (!(size > 0) || !isfinite(size)) {
        return 0;
    }
    double x = n.x / size, y = n.y / size;
    if (n.z < 0) {
        double folded = (1 - fabs(y)) * (x < 0 ? -1 : 1);
        y = (1 - fabs(x)) * (y < 0 ? -1 : 1);
        x = folded;
    }
    return pack_coordinate(x) | pack_coordinate(y) << 16;
}

Vec3 normal_unpack(uint32_t bits) {
    if (bits == 0) {
        return vec3(0, 0, 0);
    }
    double x = unpack_coordinate(bits & 0xffff), y = unpack_coordinate(bits >> 16);
    Vec3 n = {x, y, 1 - fabs(x) - fabs(y)};
    if (n.z < 0) {
        n.x = (1 - fabs(y)) * (x < 0 ? -1 : 1);
        n.y = (1 - fabs(x)) * (y < 0 ? -1 : 1);
    }
    return vec3_normalize(n);
}
