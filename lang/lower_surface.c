// SPDX-License-Identifier: Apache-2.0
// Surfaces: a grid over u and v, cut into triangles, closed where its edges meet.
//
// The rest pose is at(u, v) at t = 0. Where opposite edges of the grid meet, or an edge is a single
// point, their vertices get the same place to the bit: the renderer joins normals of vertices at
// one place, so neither seam nor pole shows, while each keeps the u and v of its side.
#include "lang/lower_parts.h"

#include <math.h>
#include <string.h>

enum {
    MOTION_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 15u << IN_LOOP0,
    POINT_INPUTS = 1u << IN_U | 1u << IN_V,
    REST_INPUTS = 7u << IN_PX | 7u << IN_NX | 1u << IN_I,
    MAX_VERTICES = 1 << 24
};

// Edges are one place where they come this near, in parts of the surface's extent.
static const double nearness = 1e-9;

typedef struct {
    uint32_t nu, nv; // steps
    double u[2], v[2];
    double *position; // [(nv + 1) * (nu + 1)][3]
} Grid;

static uint32_t at(const Grid *grid, uint32_t i, uint32_t j) {
    return j * (grid->nu + 1) + i;
}

// ---- Edges

static bool is_near(const double *a, const double *b, double bound) {
    return fabs(a[0] - b[0]) <= bound && fabs(a[1] - b[1]) <= bound && fabs(a[2] - b[2]) <= bound;
}

static double extent(const Grid *grid) {
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t k = 0; k < 3 * (size_t)(grid->nu + 1) * (grid->nv + 1); k++) {
        lo[k % 3] = fmin(lo[k % 3], grid->position[k]);
        hi[k % 3] = fmax(hi[k % 3], grid->position[k]);
    }
    return fmax(hi[0] - lo[0], fmax(hi[1] - lo[1], hi[2] - lo[2]));
}

// An edge of the grid: n + 1 vertices, from `first` on, `step` apart.
typedef struct {
    size_t first, step;
    uint32_t n;
} Edge;

static double *edge_vertex(const Grid *grid, Edge edge, uint32_t k) {
    return grid->position + 3 * (edge.first + k * edge.step);
}

static void close_to_point(const Grid *grid, Edge edge, double bound) {
    for (uint32_t k = 1; k <= edge.n; k++) {
        if (!is_near(edge_vertex(grid, edge, 0), edge_vertex(grid, edge, k), bound)) {
            return;
        }
    }
    for (uint32_t k = 1; k <= edge.n; k++) {
        memcpy(edge_vertex(grid, edge, k), edge_vertex(grid, edge, 0), 3 * sizeof(double));
    }
}

static void close_seam(const Grid *grid, Edge a, Edge b, double bound) {
    for (uint32_t k = 0; k <= a.n; k++) {
        if (!is_near(edge_vertex(grid, a, k), edge_vertex(grid, b, k), bound)) {
            return;
        }
    }
    for (uint32_t k = 0; k <= a.n; k++) {
        memcpy(edge_vertex(grid, b, k), edge_vertex(grid, a, k), 3 * sizeof(double));
    }
}

static void close_edges(const Grid *grid) {
    double bound = nearness * extent(grid);
    size_t width = grid->nu + 1;
    Edge low_u = {0, width, grid->nv}, high_u = {grid->nu, width, grid->nv};
    Edge low_v = {0, 1, grid->nu}, high_v = {width * grid->nv, 1, grid->nu};
    close_to_point(grid, low_u, bound);
    close_to_point(grid, high_u, bound);
    close_to_point(grid, low_v, bound);
    close_to_point(grid, high_v, bound);
    close_seam(grid, low_u, high_u, bound);
    close_seam(grid, low_v, high_v, bound);
}

// ---- Triangles

static bool same_place(const Grid *grid, uint32_t a, uint32_t b) {
    return memcmp(grid->position + 3 * (size_t)a, grid->position + 3 * (size_t)b,
                  3 * sizeof(double)) == 0;
}

// Those that a pole leaves without area are left out.
static void add_triangle(const Grid *grid, Mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
    if (!same_place(grid, a, b) && !same_place(grid, b, c) && !same_place(grid, c, a)) {
        uint32_t *index = mesh->index + 3 * (size_t)mesh->n_triangles++;
        index[0] = a;
        index[1] = b;
        index[2] = c;
    }
}

static void add_triangles(const Grid *grid, Mesh *mesh) {
    for (uint32_t j = 0; j < grid->nv; j++) {
        for (uint32_t i = 0; i < grid->nu; i++) {
            uint32_t a = at(grid, i, j), b = at(grid, i + 1, j);
            uint32_t c = at(grid, i + 1, j + 1), d = at(grid, i, j + 1);
            add_triangle(grid, mesh, a, b, c);
            add_triangle(grid, mesh, a, c, d);
        }
    }
}

// ---- The rest pose

// Exactly the end at the end, so that closed surfaces close.
static double grid_value(const double range[2], uint32_t i, uint32_t n) {
    return i == n ? range[1] : range[0] + (range[1] - range[0]) * ((double)i / n);
}

static void run_rest(Eval *ev, const Ref rest[3], Grid *grid, double *u, double *v) {
    const Program *program = lower_program(ev, rest, 3);
    size_t n = (size_t)(grid->nu + 1) * (grid->nv + 1);
    static const double zero = 0;
    ProgramInputs in = {.varying = POINT_INPUTS};
    double *out[3];
    for (int k = 0; k < 3; k++) {
        out[k] = ARENA_ARRAY(ev->arena, n, double);
    }
    in.at[IN_U] = u;
    in.at[IN_V] = v;
    in.at[IN_T] = in.at[IN_FILM_T] = &zero;
    for (const Loops *loops = ev->loops; loops; loops = loops->parent) {
        in.at[IN_LOOP0 + loops->depth] = &loops->values[0];
    }
    program_run(program, &in, n, out);
    for (size_t i = 0; i < 3 * n; i++) {
        grid->position[i] = out[i % 3][i / 3];
    }
}

static Mesh *make_mesh(Eval *ev, Grid *grid, const Ref rest[3]) {
    Arena *arena = lower_arena(ev);
    size_t n = (size_t)(grid->nu + 1) * (grid->nv + 1);
    Mesh *mesh = ARENA_NEW(arena, Mesh);
    mesh->n_vertices = (uint32_t)n;
    mesh->position = grid->position = ARENA_ARRAY(arena, 3 * n, double);
    mesh->uv = ARENA_ARRAY(arena, 2 * n, float);
    mesh->index = ARENA_ARRAY(arena, 6 * (size_t)grid->nu * grid->nv, uint32_t);
    double *u = ARENA_ARRAY(ev->arena, n, double), *v = ARENA_ARRAY(ev->arena, n, double);
    for (uint32_t j = 0; j <= grid->nv; j++) {
        for (uint32_t i = 0; i <= grid->nu; i++) {
            uint32_t k = at(grid, i, j);
            u[k] = grid_value(grid->u, i, grid->nu);
            v[k] = grid_value(grid->v, j, grid->nv);
            mesh->uv[2 * (size_t)k] = (float)u[k];
            mesh->uv[2 * (size_t)k + 1] = (float)v[k];
        }
    }
    run_rest(ev, rest, grid, u, v);
    close_edges(grid);
    add_triangles(grid, mesh);
    return mesh;
}

// ---- One mesh for all copies

static CachedSurface *surface_slot(Lowering *l, const SurfaceKey *key) {
    Hash128 hash = {0, 0};
    hash_add(&hash, key, sizeof *key);
    size_t slot = hash.a & (l->n_surface_slots - 1);
    while (l->surfaces[slot].mesh && memcmp(&l->surfaces[slot].key, key, sizeof *key) != 0) {
        slot = (slot + 1) & (l->n_surface_slots - 1);
    }
    return &l->surfaces[slot];
}

static void grow_surfaces(Lowering *l) {
    CachedSurface *old = l->surfaces;
    size_t n = l->n_surface_slots;
    l->n_surface_slots = n ? 2 * n : 16;
    l->surfaces = ARENA_ARRAY(l->scratch, l->n_surface_slots, CachedSurface);
    for (size_t i = 0; i < n; i++) {
        if (old[i].mesh) {
            *surface_slot(l, &old[i].key) = old[i];
        }
    }
}

static const Mesh *shared_mesh(Eval *ev, Grid *grid, const Ref rest[3]) {
    Lowering *l = ev->lowering;
    uint32_t inputs = 0;
    for (int k = 0; k < 3; k++) {
        inputs |= dag_inputs(ev->dag, rest[k]);
    }
    if (inputs & 15u << IN_LOOP0) {
        return make_mesh(ev, grid, rest); // its rest pose is that of this loop's first values
    }
    SurfaceKey key = {{grid->u[0], grid->u[1]},
                      {grid->v[0], grid->v[1]},
                      {rest[0], rest[1], rest[2], 0},
                      grid->nu,
                      grid->nv};
    if (2 * l->n_surfaces >= l->n_surface_slots) {
        grow_surfaces(l);
    }
    CachedSurface *slot = surface_slot(l, &key);
    if (!slot->mesh) {
        *slot = (CachedSurface){key, make_mesh(ev, grid, rest)};
        l->n_surfaces++;
    }
    return slot->mesh;
}

// ---- Properties

static bool read_range(Eval *ev, const Object *object, PropertyId id, double range[2],
                       ValueType *type) {
    Value value = object_value(ev, object, id);
    if (!value_is(&value, VALUE_RANGE)) {
        return false;
    }
    *type = value.range->is_angle ? VALUE_ANGLE : VALUE_NUMBER;
    if (value.range->step != REF_NONE) {
        eval_error_at(ev, object_given(object, id)->where,
                      "res = <nu, nv> says how many steps there are",
                      "%s goes from here to there without a step", property_infos[id].name);
        return false;
    }
    return dag_is_const(ev->dag, value.range->low, &range[0]) &&
           dag_is_const(ev->dag, value.range->high, &range[1]);
}

static bool read_grid(Eval *ev, const Object *object, Grid *grid, ValueType types[2]) {
    Value res = object_value(ev, object, PROPERTY_SURFACE_RES);
    double nu, nv;
    if (!value_is(&res, VALUE_VEC) || !dag_is_const(ev->dag, res.ref[0], &nu) ||
        !dag_is_const(ev->dag, res.ref[1], &nv) ||
        !read_range(ev, object, PROPERTY_SURFACE_U, grid->u, &types[0]) ||
        !read_range(ev, object, PROPERTY_SURFACE_V, grid->v, &types[1])) {
        return false;
    }
    if (nu != floor(nu) || nv != floor(nv) || (nu + 1) * (nv + 1) > MAX_VERTICES) {
        eval_error_at(ev, object_given(object, PROPERTY_SURFACE_RES)->where, NULL,
                      "res is two whole numbers, not more than %d vertices together", MAX_VERTICES);
        return false;
    }
    grid->nu = (uint32_t)nu;
    grid->nv = (uint32_t)nv;
    return true;
}

static Symbol name_of(Eval *ev, const char *name) {
    return symbol_of(ev->symbols, name, strlen(name));
}

static Value scalar_input(Eval *ev, ValueType type, Input input) {
    return value_scalar(type, dag_input(ev->dag, input));
}

static Value vector_input(Eval *ev, Input first, uint32_t n) {
    Ref refs[3];
    for (uint32_t i = 0; i < n; i++) {
        refs[i] = dag_input(ev->dag, (Input)(first + i));
    }
    return value_vec(VALUE_VEC, refs, n);
}

bool lower_deform(Eval *ev, const Object *object, PropertyId id, const Value *rest,
                  ValueType type_u, ValueType type_v, Ref out[3]) {
    const Given *deform = object_given(object, id);
    if (value_is_poison(&deform->value)) {
        return false;
    }
    Symbol names[6] = {name_of(ev, "p"), name_of(ev, "n"), name_of(ev, "u"),
                       name_of(ev, "v"), name_of(ev, "i"), name_of(ev, "uv")};
    Value values[6] = {*rest,
                       vector_input(ev, IN_NX, 3),
                       scalar_input(ev, type_u, IN_U),
                       scalar_input(ev, type_v, IN_V),
                       scalar_input(ev, VALUE_NUMBER, IN_I),
                       vector_input(ev, IN_U, 2)};
    Value moved =
        eval_apply(ev, deform->value.closure, names, values, 6, &deform->env, deform->node);
    if (!eval_check_vec3(ev, deform->name, "deform", &moved,
                         MOTION_INPUTS | POINT_INPUTS | REST_INPUTS)) {
        return false;
    }
    memcpy(out, moved.ref, 3 * sizeof *out);
    return true;
}

const Mesh *lower_surface(Eval *ev, const Object *object, Ref vertex[3]) {
    Grid grid;
    ValueType types[2];
    const Given *function = object_given(object, PROPERTY_SURFACE_AT);
    if (!function) {
        eval_error_at(ev, object->where, "write fn at(u, v) = <x, y, z>", "surface needs 'at'");
        return NULL;
    }
    if (value_is_poison(&function->value) || !read_grid(ev, object, &grid, types)) {
        return NULL;
    }
    Symbol names[2] = {name_of(ev, "u"), name_of(ev, "v")};
    Value uv[2] = {scalar_input(ev, types[0], IN_U), scalar_input(ev, types[1], IN_V)};
    Value point =
        eval_apply(ev, function->value.closure, names, uv, 2, &function->env, function->node);
    if (!eval_check_vec3(ev, function->name, "at", &point, MOTION_INPUTS | POINT_INPUTS)) {
        return NULL;
    }
    bool moves = (value_inputs(ev->dag, &point) & MOTION_INPUTS) != 0;
    const Mesh *mesh = shared_mesh(ev, &grid, point.ref);
    vertex[0] = REF_NONE;
    if (object_given(object, PROPERTY_SURFACE_DEFORM)) {
        // What stays is looked up; only what moves is computed again at each instant.
        Value rest = moves ? point : vector_input(ev, IN_PX, 3);
        return lower_deform(ev, object, PROPERTY_SURFACE_DEFORM, &rest, types[0], types[1], vertex)
                   ? mesh
                   : NULL;
    }
    if (moves) {
        memcpy(vertex, point.ref, 3 * sizeof *vertex);
    }
    return mesh;
}
