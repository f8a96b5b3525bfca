// SPDX-License-Identifier: Apache-2.0
// Triangles as solids.
#include "render/sim_solid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accel/vec.h"
#include "render/mesh_build.h"

static Vec3 point_of(const SimSolid *solid, uint32_t i) {
    const double *p = solid->point + 3 * (size_t)i;
    return vec3(p[0], p[1], p[2]);
}

// ---- Faces and edges

bool sim_solid_weld(Arena *arena, const Mesh *mesh, SimSolid *solid) {
    Arena scratch = {0};
    MeshWeld weld = {.arena = &scratch};
    *solid = (SimSolid){.point = ARENA_ARRAY(arena, 3 * (size_t)mesh->n_vertices, double),
                        .face = ARENA_ARRAY(arena, 3 * (size_t)mesh->n_triangles, uint32_t)};
    bool is_finite = true;
    for (size_t f = 0; f < mesh->n_triangles && is_finite; f++) {
        uint32_t corner[3];
        for (int k = 0; k < 3; k++) {
            double p[3];
            uint64_t key[3];
            for (int c = 0; c < 3; c++) {
                p[c] = mesh->position[3 * (size_t)mesh->index[3 * f + (size_t)k] + (size_t)c] + 0.0;
                is_finite = is_finite && isfinite(p[c]);
            }
            memcpy(key, p, sizeof key);
            corner[k] = mesh_weld_add(&weld, key);
            memcpy(solid->point + 3 * (size_t)corner[k], p, sizeof p);
        }
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0]) {
            memcpy(solid->face + 3 * (size_t)solid->n_faces++, corner, sizeof corner);
        }
    }
    solid->n_points = (uint32_t)weld.n;
    arena_free(&scratch);
    return is_finite;
}

// An edge from its lower vertex to its higher one; `turn` is 1 where the face goes that way.
typedef struct {
    uint32_t low, high;
    int32_t turn;
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *x = a, *y = b;
    return x->low != y->low     ? (x->low > y->low) - (x->low < y->low)
           : x->high != y->high ? (x->high > y->high) - (x->high < y->high)
                                : (x->turn > y->turn) - (x->turn < y->turn);
}

uint32_t sim_solid_n_open(const SimSolid *solid) {
    Arena scratch = {0};
    size_t n = 3 * (size_t)solid->n_faces;
    Edge *edges = ARENA_ARRAY(&scratch, n + 1, Edge);
    uint32_t n_open = 0;
    for (size_t i = 0; i < n; i++) {
        uint32_t a = solid->face[i], b = solid->face[i % 3 == 2 ? i - 2 : i + 1];
        edges[i] = a < b ? (Edge){a, b, 1} : (Edge){b, a, -1};
    }
    qsort(edges, n, sizeof *edges, compare_edges);
    for (size_t i = 0, end; i < n; i = end) {
        int32_t sum = 0;
        for (end = i; end < n && edges[end].low == edges[i].low && edges[end].high == edges[i].high;
             end++) {
            sum += edges[end].turn;
        }
        n_open += sum != 0;
    }
    arena_free(&scratch);
    return n_open;
}

double sim_solid_volume(const SimSolid *solid) {
    return sim_solid_mass(solid).mass;
}

void sim_solid_turn_over(SimSolid *solid) {
    for (size_t f = 0; f < solid->n_faces; f++) {
        uint32_t first = solid->face[3 * f];
        solid->face[3 * f] = solid->face[3 * f + 1];
        solid->face[3 * f + 1] = first;
    }
}

// ---- Mass

SimSolidMass sim_solid_mass(const SimSolid *solid) {
    double volume = 0, first[3] = {0}, second[3][3] = {{0}}; // integrals of 1, x, x x'
    for (size_t f = 0; f < solid->n_faces; f++) {
        double p[3][3], det;
        for (int k = 0; k < 3; k++) {
            memcpy(p[k], solid->point + 3 * (size_t)solid->face[3 * f + (size_t)k], sizeof p[k]);
        }
        det = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
              p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
              p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
        volume += det / 6;
        for (int i = 0; i < 3; i++) {
            double sum_i = p[0][i] + p[1][i] + p[2][i];
            first[i] += det / 24 * sum_i;
            for (int j = 0; j < 3; j++) {
                double sum_j = p[0][j] + p[1][j] + p[2][j];
                double own = p[0][i] * p[0][j] + p[1][i] * p[1][j] + p[2][i] * p[2][j];
                second[i][j] += det / 120 * (sum_i * sum_j + own);
            }
        }
    }
    SimSolidMass m = {.mass = volume};
    for (int i = 0; i < 3; i++) {
        m.center[i] = volume != 0 ? first[i] / volume : 0;
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            second[i][j] -= volume * m.center[i] * m.center[j];
        }
    }
    for (int i = 0; i < 3; i++) {
        m.moment[i] = second[(i + 1) % 3][(i + 1) % 3] + second[(i + 2) % 3][(i + 2) % 3];
    }
    m.moment[3] = -second[0][1];
    m.moment[4] = -second[0][2];
    m.moment[5] = -second[1][2];
    return m;
}

// ---- Hulls

// A face of the hull under construction: neighbor k is beyond the edge from corner k to k + 1; the
// points outside of it are a list.
typedef struct {
    uint32_t corner[3], neighbor[3];
    Vec3 normal;
    double offset;
    uint32_t outside; // the first of the points outside, NONE: there is none
    bool is_gone;
} Face;

enum { NONE = UINT32_MAX };

typedef struct {
    const SimSolid *solid;
    Arena *arena; // scratch
    Face *faces;
    size_t n_faces, capacity;
    uint32_t *next; // [n_points] in the lists of points outside
    double thickness;
    uint32_t *visible, *stack; // faces seen from the point at hand
    size_t n_visible, visible_capacity, stack_capacity;
    uint32_t (*horizon)[2]; // a face that stays, and its edge
    size_t n_horizon, horizon_capacity;
} Hull;

static double distance(const Hull *h, const Face *face, uint32_t point) {
    return vec3_dot(face->normal, point_of(h->solid, point)) - face->offset;
}

static uint32_t add_face(Hull *h, uint32_t a, uint32_t b, uint32_t c) {
    Vec3 p = point_of(h->solid, a), q = point_of(h->solid, b), r = point_of(h->solid, c);
    Vec3 normal = vec3_normalize(vec3_cross(vec3_sub(q, p), vec3_sub(r, p)));
    h->faces = arena_grow(h->arena, h->faces, h->n_faces, &h->capacity, sizeof *h->faces);
    h->faces[h->n_faces] = (Face){.corner = {a, b, c},
                                  .neighbor = {NONE, NONE, NONE},
                                  .normal = normal,
                                  .offset = vec3_dot(normal, p),
                                  .outside = NONE};
    return (uint32_t)h->n_faces++;
}

// Gives a point to the first face that it lies outside of.
static void assign(Hull *h, uint32_t point, size_t first_face) {
    for (size_t f = first_face; f < h->n_faces; f++) {
        Face *face = &h->faces[f];
        if (!face->is_gone && distance(h, face, point) > h->thickness) {
            h->next[point] = face->outside;
            face->outside = point;
            return;
        }
    }
}

// Four points far from each other, then all of a plane; false: there are no such.
static bool begin(Hull *h) {
    const SimSolid *s = h->solid;
    uint32_t corner[4] = {0, 0, 0, 0};
    double most, extent = 0;
    for (uint32_t k = 1; k < 4; k++) {
        most = 0;
        Vec3 o = point_of(s, corner[0]), a = vec3_sub(point_of(s, corner[1]), o);
        Vec3 n = vec3_cross(a, vec3_sub(point_of(s, corner[2]), o));
        for (uint32_t i = 0; i < s->n_points; i++) {
            Vec3 d = vec3_sub(point_of(s, i), o);
            double far = k == 1   ? vec3_length(d)
                         : k == 2 ? vec3_length(vec3_cross(a, d)) / vec3_length(a)
                                  : fabs(vec3_dot(n, d)) / vec3_length(n);
            if (far > most) {
                most = far;
                corner[k] = i;
            }
        }
        extent = k == 1 ? most : extent;
        h->thickness = 1e-9 * extent;
        if (!(most > 100 * h->thickness)) {
            return false;
        }
    }
    Vec3 o = point_of(s, corner[0]);
    Vec3 n = vec3_cross(vec3_sub(point_of(s, corner[1]), o), vec3_sub(point_of(s, corner[2]), o));
    if (vec3_dot(n, vec3_sub(point_of(s, corner[3]), o)) > 0) {
        uint32_t swap = corner[1];
        corner[1] = corner[2];
        corner[2] = swap;
    }
    add_face(h, corner[0], corner[1], corner[2]); // 0; seen from the fourth they turn the other way
    add_face(h, corner[0], corner[3], corner[1]);
    add_face(h, corner[1], corner[3], corner[2]);
    add_face(h, corner[2], corner[3], corner[0]);
    static const uint32_t neighbors[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
    for (int f = 0; f < 4; f++) {
        memcpy(h->faces[f].neighbor, neighbors[f], sizeof neighbors[f]);
    }
    for (uint32_t i = 0; i < s->n_points; i++) {
        assign(h, i, 0);
    }
    return true;
}

static uint32_t edge_towards(const Face *face, uint32_t neighbor) {
    return face->neighbor[0] == neighbor ? 0 : face->neighbor[1] == neighbor ? 1 : 2;
}

// From `first` on, over edges: which faces the point sees, and the edges around them.
static void find_visible(Hull *h, uint32_t first, uint32_t point) {
    size_t n = 0;
    h->n_visible = h->n_horizon = 0;
    h->stack = arena_grow(h->arena, h->stack, n, &h->stack_capacity, sizeof *h->stack);
    h->stack[n++] = first;
    h->faces[first].is_gone = true;
    while (n > 0) {
        uint32_t f = h->stack[--n];
        h->visible = arena_grow(h->arena, h->visible, h->n_visible, &h->visible_capacity,
                                sizeof *h->visible);
        h->visible[h->n_visible++] = f;
        for (int k = 0; k < 3; k++) {
            uint32_t beside = h->faces[f].neighbor[k];
            Face *other = &h->faces[beside];
            if (!other->is_gone && distance(h, other, point) > h->thickness) {
                other->is_gone = true;
                h->stack = arena_grow(h->arena, h->stack, n, &h->stack_capacity, sizeof *h->stack);
                h->stack[n++] = beside;
            }
        }
    }
    for (size_t i = 0; i < h->n_visible; i++) {
        for (int k = 0; k < 3; k++) {
            uint32_t beside = h->faces[h->visible[i]].neighbor[k];
            if (!h->faces[beside].is_gone) {
                h->horizon = arena_grow(h->arena, h->horizon, h->n_horizon, &h->horizon_capacity,
                                        sizeof *h->horizon);
                h->horizon[h->n_horizon][0] = beside;
                h->horizon[h->n_horizon++][1] = edge_towards(&h->faces[beside], h->visible[i]);
            }
        }
    }
}

// A face from each edge of the horizon to the point; they are neighbors where they share a corner.
// False: the edges do not go round once.
static bool close_up(Hull *h, uint32_t point) {
    size_t first = h->n_faces;
    for (size_t i = 0; i < h->n_horizon; i++) {
        uint32_t beside = h->horizon[i][0], edge = h->horizon[i][1];
        uint32_t a = h->faces[beside].corner[(edge + 1) % 3], b = h->faces[beside].corner[edge];
        uint32_t f = add_face(h, a, b, point);
        h->faces[f].neighbor[0] = beside;
        h->faces[beside].neighbor[edge] = f;
    }
    for (size_t f = first; f < h->n_faces; f++) {
        for (size_t g = first; g < h->n_faces; g++) {
            if (h->faces[g].corner[0] == h->faces[f].corner[1]) {
                h->faces[f].neighbor[1] = (uint32_t)g;
                h->faces[g].neighbor[2] = (uint32_t)f;
            }
        }
    }
    for (size_t f = first; f < h->n_faces; f++) {
        if (h->faces[f].neighbor[1] == NONE || h->faces[f].neighbor[2] == NONE) {
            return false;
        }
    }
    for (size_t i = 0; i < h->n_visible; i++) {
        for (uint32_t p = h->faces[h->visible[i]].outside, next; p != NONE; p = next) {
            next = h->next[p];
            if (p != point) {
                assign(h, p, first);
            }
        }
    }
    return true;
}

static bool grow(Hull *h) {
    for (uint32_t f = 0; f < h->n_faces; f++) {
        if (h->faces[f].is_gone || h->faces[f].outside == NONE) {
            continue;
        }
        uint32_t farthest = h->faces[f].outside;
        for (uint32_t p = farthest; p != NONE; p = h->next[p]) {
            if (distance(h, &h->faces[f], p) > distance(h, &h->faces[f], farthest)) {
                farthest = p;
            }
        }
        find_visible(h, f, farthest);
        if (!close_up(h, farthest)) {
            return false;
        }
    }
    return true;
}

bool sim_solid_hull(Arena *arena, const SimSolid *solid, SimSolid *hull) {
    Arena scratch = {0};
    Hull h = {.solid = solid, .arena = &scratch};
    h.next = ARENA_ARRAY(&scratch, (size_t)solid->n_points + 1, uint32_t);
    bool is_fine = solid->n_points >= 4 && begin(&h) && grow(&h);
    if (is_fine) {
        uint32_t *number = ARENA_ARRAY(&scratch, solid->n_points, uint32_t); // + 1; 0: not yet
        *hull = (SimSolid){.point = ARENA_ARRAY(arena, 3 * (size_t)solid->n_points, double),
                           .face = ARENA_ARRAY(arena, 3 * h.n_faces, uint32_t)};
        for (size_t f = 0; f < h.n_faces; f++) {
            for (int k = 0; k < 3 && !h.faces[f].is_gone; k++) {
                uint32_t p = h.faces[f].corner[k];
                if (!number[p]) {
                    memcpy(hull->point + 3 * (size_t)hull->n_points, solid->point + 3 * (size_t)p,
                           3 * sizeof *hull->point);
                    number[p] = ++hull->n_points;
                }
                hull->face[3 * (size_t)hull->n_faces + (size_t)k] = number[p] - 1;
            }
            hull->n_faces += !h.faces[f].is_gone;
        }
    }
    arena_free(&scratch);
    return is_fine;
}
