// SPDX-License-Identifier: Apache-2.0
// Shapes: what each kind becomes, and what all of them have.
#include "lang/lower_parts.h"

#include <math.h>
#include <string.h>

#include "lang/loader.h"

// What a shape is before its place and looks are added.
typedef struct {
    ShapeKind kind;
    const Mesh *mesh;
    Ref vertex[3]; // REF_NONE: nothing moves them
    Ref geometry[4];
    uint32_t n_geometry;
    bool is_scaled; // the mesh is of unit size: scale makes the shape's own size of it
    Ref3 scale;
    bool faceted;
} Form;

// ---- Boxes and quads

static Mesh *new_mesh(Eval *ev, uint32_t n_vertices, uint32_t n_triangles) {
    Arena *arena = lower_arena(ev);
    Mesh *mesh = ARENA_NEW(arena, Mesh);
    mesh->n_vertices = n_vertices;
    mesh->n_triangles = n_triangles;
    mesh->position = ARENA_ARRAY(arena, (size_t)n_vertices * 3, double);
    mesh->uv = ARENA_ARRAY(arena, (size_t)n_vertices * 2, float);
    mesh->index = ARENA_ARRAY(arena, (size_t)n_triangles * 3, uint32_t);
    mesh->faceted = true;
    return mesh;
}

// One side of a box: its middle along `axis`, u and v along the two axes that follow it, so that u
// crossed with v points outwards.
static void add_side(Mesh *mesh, uint32_t side, const double size[3]) {
    int axis = (int)side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    double sign = side % 2 ? -1 : 1;
    for (uint32_t k = 0; k < 4; k++) {
        double x = k == 1 || k == 2 ? 0.5 : -0.5, y = k >= 2 ? 0.5 : -0.5;
        double *p = mesh->position + 3 * (size_t)(4 * side + k);
        p[axis] = sign * 0.5 * size[axis];
        p[u] = sign * x * size[u];
        p[v] = y * size[v];
        mesh->uv[2 * (size_t)(4 * side + k)] = (float)(x + 0.5);
        mesh->uv[2 * (size_t)(4 * side + k) + 1] = (float)(y + 0.5);
    }
    static const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
    for (int k = 0; k < 6; k++) {
        mesh->index[6 * (size_t)side + k] = 4 * side + corners[k];
    }
}

static const Mesh *make_box(Eval *ev, const double size[3]) {
    Mesh *mesh = new_mesh(ev, 24, 12);
    for (uint32_t side = 0; side < 6; side++) {
        add_side(mesh, side, size);
    }
    return mesh;
}

static const Mesh *make_quad(Eval *ev, const double size[3]) {
    Mesh *mesh = new_mesh(ev, 4, 2);
    static const double corner[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    static const uint32_t index[6] = {0, 1, 2, 0, 2, 3};
    for (int k = 0; k < 4; k++) {
        for (int c = 0; c < 2; c++) {
            mesh->position[3 * k + c] = corner[k][c] * size[c];
            mesh->uv[2 * k + c] = (float)(corner[k][c] + 0.5);
        }
    }
    memcpy(mesh->index, index, sizeof index);
    return mesh;
}

// All boxes share one mesh of unit size under their own scale; only one that is flat for good needs
// a mesh of its own, since nothing undoes its scale.
static bool sized_form(Eval *ev, const Object *object, PropertyId id, Form *form) {
    static const double unit[3] = {1, 1, 1};
    bool is_box = object->kind == OBJECT_BOX, is_flat = false;
    double size[3] = {1, 1, 1};
    Value value = object_value(ev, object, id);
    if (value.type != VALUE_VEC) {
        return false;
    }
    for (uint32_t i = 0; i < value.n; i++) {
        is_flat = is_flat || (dag_is_const(ev->dag, value.ref[i], &size[i]) && size[i] == 0);
    }
    form->faceted = true;
    if (is_flat) {
        for (uint32_t i = 0; i < value.n; i++) {
            if (!dag_is_const(ev->dag, value.ref[i], &size[i])) {
                eval_error_at(ev, object->where, NULL,
                              "not supported yet: a size of which one part is 0 and another moves");
                return false;
            }
        }
        form->mesh = is_box ? make_box(ev, size) : make_quad(ev, size);
        return true;
    }
    const Mesh **shared = is_box ? &ev->lowering->unit_box : &ev->lowering->unit_quad;
    if (!*shared) {
        *shared = is_box ? make_box(ev, unit) : make_quad(ev, unit);
    }
    Ref one = dag_const(ev->dag, 1);
    form->mesh = *shared;
    form->scale = ref3(value.ref[0], value.ref[1], is_box ? value.ref[2] : one);
    form->is_scaled = form->scale.x != one || form->scale.y != one || form->scale.z != one;
    return true;
}

// ---- Meshes from files

static void bounds(const Mesh *mesh, double lo[3], double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; i++) {
        if (isfinite(mesh->position[i])) {
            lo[i % 3] = fmin(lo[i % 3], mesh->position[i]);
            hi[i % 3] = fmax(hi[i % 3], mesh->position[i]);
        }
    }
}

// fit: so tall, the middle of its box in the origin. ground: standing on y = 0.
static const Mesh *fitted(Eval *ev, const Object *object, const Mesh *mesh) {
    const Given *fit = object_given(object, PROPERTY_MESH_FIT);
    Value ground = object_value(ev, object, PROPERTY_MESH_GROUND);
    double height = 0, stands = 0, lo[3], hi[3], scale = 1, shift[3] = {0, 0, 0};
    bool is_fitted = fit && fit->value.n == 1 && dag_is_const(ev->dag, fit->value.ref[0], &height);
    bool is_grounded =
        ground.n == 1 && dag_is_const(ev->dag, ground.ref[0], &stands) && stands != 0;
    bounds(mesh, lo, hi);
    if ((!is_fitted && !is_grounded) || !(lo[0] <= hi[0])) {
        return mesh;
    }
    if (is_fitted) {
        if (hi[1] == lo[1]) {
            eval_error_at(ev, fit->name, "write scale", "this mesh has no height to fit");
            return NULL;
        }
        scale = height / (hi[1] - lo[1]);
        for (int k = 0; k < 3; k++) {
            shift[k] = -0.5 * (lo[k] + hi[k]) * scale;
        }
    }
    if (is_grounded) {
        shift[1] = -lo[1] * scale;
    }
    Mesh *copy = ARENA_NEW(lower_arena(ev), Mesh);
    *copy = *mesh;
    copy->position = ARENA_ARRAY(lower_arena(ev), 3 * (size_t)mesh->n_vertices, double);
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; i++) {
        copy->position[i] = mesh->position[i] * scale + shift[i % 3];
    }
    return copy;
}

static bool mesh_form(Eval *ev, const Object *object, Form *form) {
    const Given *file = object_given(object, PROPERTY_MESH_FILE);
    if (!file) {
        eval_error_at(ev, object->where, "write file = \"bunny.obj\"", "mesh needs 'file'");
        return false;
    }
    const Mesh *mesh = value_is(&file->value, VALUE_STRING) ? loader_mesh(ev, file) : NULL;
    form->mesh = mesh ? fitted(ev, object, mesh) : NULL;
    if (!form->mesh) {
        return false;
    }
    form->faceted = mesh->faceted;
    if (object_given(object, PROPERTY_MESH_DEFORM)) {
        Ref refs[3] = {dag_input(ev->dag, IN_PX), dag_input(ev->dag, IN_PY),
                       dag_input(ev->dag, IN_PZ)};
        Value rest = value_vec(VALUE_VEC, refs, 3);
        return lower_deform(ev, object, PROPERTY_MESH_DEFORM, &rest, VALUE_NUMBER, VALUE_NUMBER,
                            form->vertex);
    }
    return true;
}

// ---- Spheres and planes

static bool sphere_form(Eval *ev, const Object *object, Form *form) {
    Ref3 center;
    if (!lower_vec3(ev, object, PROPERTY_SPHERE_CENTER, &center) ||
        !lower_scalar(ev, object, PROPERTY_SPHERE_RADIUS, &form->geometry[3])) {
        return false;
    }
    form->kind = SHAPE_SPHERE;
    form->geometry[0] = center.x;
    form->geometry[1] = center.y;
    form->geometry[2] = center.z;
    form->n_geometry = 4;
    return true;
}

static bool plane_form(Eval *ev, const Object *object, Form *form) {
    Ref3 normal;
    double x[3];
    if (!lower_vec3(ev, object, PROPERTY_PLANE_NORMAL, &normal) ||
        !lower_scalar(ev, object, PROPERTY_PLANE_OFFSET, &form->geometry[3])) {
        return false;
    }
    if (dag_is_const(ev->dag, normal.x, &x[0]) && dag_is_const(ev->dag, normal.y, &x[1]) &&
        dag_is_const(ev->dag, normal.z, &x[2]) && x[0] == 0 && x[1] == 0 && x[2] == 0) {
        eval_error_at(ev, object->where, NULL, "the plane has no normal: it is <0, 0, 0>");
        return false;
    }
    form->kind = SHAPE_PLANE;
    form->geometry[0] = normal.x;
    form->geometry[1] = normal.y;
    form->geometry[2] = normal.z;
    form->n_geometry = 4;
    return true;
}

static bool make_form(Eval *ev, const Object *object, Form *form) {
    *form = (Form){.kind = SHAPE_MESH, .vertex = {REF_NONE, REF_NONE, REF_NONE}};
    switch (object->kind) {
    case OBJECT_SPHERE:
        return sphere_form(ev, object, form);
    case OBJECT_PLANE:
        return plane_form(ev, object, form);
    case OBJECT_BOX:
        return sized_form(ev, object, PROPERTY_BOX_SIZE, form);
    case OBJECT_QUAD:
        return sized_form(ev, object, PROPERTY_QUAD_SIZE, form);
    case OBJECT_SURFACE:
        form->mesh = lower_surface(ev, object, form->vertex);
        return form->mesh != NULL;
    default:
        return mesh_form(ev, object, form);
    }
}

// ---- What all shapes have

static double inherited(Eval *ev, const Given *given, PropertyId id) {
    Value value = given ? given->value : eval_default(ev, id);
    double x = 0;
    if (value.n == 1 && value_is_numeric(&value)) {
        dag_is_const(ev->dag, value.ref[0], &x);
    }
    return x;
}

// p in a material is the rest position in the shape's own block: where the mesh is of unit size,
// that is p times the size at t = 0.
static const MaterialValue *at_own_size(Eval *ev, const MaterialValue *material, const Form *form) {
    static const Input inputs[3] = {IN_PX, IN_PY, IN_PZ};
    const Ref scale[3] = {form->scale.x, form->scale.y, form->scale.z};
    Ref with[3], start = dag_const(ev->dag, 0);
    for (int k = 0; k < 3; k++) {
        Ref rest = dag_substitute(ev->dag, scale[k], IN_T, start);
        rest = dag_substitute(ev->dag, rest, IN_FILM_T, start);
        with[k] = dag_op(ev->dag, OP_MUL, dag_input(ev->dag, inputs[k]), rest, REF_NONE);
    }
    MaterialValue *own = ARENA_NEW(ev->arena, MaterialValue);
    *own = *material;
    for (uint32_t i = 0; i < own->n; i++) {
        own->ref[i] = dag_substitute_all(ev->dag, own->ref[i], inputs, with, 3);
    }
    return own;
}

static uint32_t shape_material(Eval *ev, const Object *object, const Place *place,
                               const Form *form) {
    Value value =
        place->material ? place->material->value : eval_default(ev, PROPERTY_OBJECT_MATERIAL);
    if (!value_is(&value, VALUE_MATERIAL)) { // an error was reported
        value = eval_default(ev, PROPERTY_OBJECT_MATERIAL);
    }
    const MaterialValue *material =
        form->is_scaled ? at_own_size(ev, value.material, form) : value.material;
    Span where = place->material ? place->material->where : object->where;
    return lower_material(ev, material, scene_source_ref(where));
}

// The map to the world, the form's own scale first. False: it stays where it is.
static bool shape_map(Eval *ev, const Place *place, const Form *form, RefMap *map) {
    if (!form->is_scaled) {
        *map = place->map;
        return !place->is_identity;
    }
    RefMap scale = spatial_map_scale(ev->dag, form->scale);
    *map = place->is_identity ? scale : spatial_map_compose(ev->dag, &place->map, &scale);
    return true;
}

// Everything that moves the shape, for its breaks.
static const Program *shape_breaks(Eval *ev, const Form *form, const RefMap *map) {
    Ref refs[12 + 4 + 3];
    uint32_t n = 0;
    if (map) {
        memcpy(refs, map->m, sizeof map->m);
        n = 12;
    }
    memcpy(refs + n, form->geometry, form->n_geometry * sizeof *refs);
    n += form->n_geometry;
    if (form->vertex[0] != REF_NONE) {
        memcpy(refs + n, form->vertex, sizeof form->vertex);
        n += 3;
    }
    return lower_breaks(ev, refs, n);
}

void lower_shape(Eval *ev, const Object *object, const Place *place, const char *label) {
    Form form;
    RefMap map;
    double x;
    if (dag_is_const(ev->dag, place->visible, &x) && x == 0) {
        return; // it is never there
    }
    if (!make_form(ev, object, &form)) {
        return;
    }
    bool is_moved = shape_map(ev, place, &form, &map);
    Shape *shape = lower_new_shape(ev);
    shape->kind = form.kind;
    shape->where = scene_source_ref(object->where);
    shape->label = arena_string(lower_arena(ev), label, strlen(label));
    shape->mesh = form.mesh;
    shape->vertex = form.vertex[0] == REF_NONE ? NULL : lower_program(ev, form.vertex, 3);
    shape->geometry = form.n_geometry ? lower_program(ev, form.geometry, form.n_geometry) : NULL;
    shape->transform = is_moved ? lower_program(ev, &map.m[0][0], 12) : NULL;
    shape->visible = lower_visible(ev, place);
    shape->breaks = shape_breaks(ev, &form, is_moved ? &map : NULL);
    shape->tolerance = inherited(ev, place->tolerance, PROPERTY_INHERITED_TOLERANCE);
    shape->smooth = form.faceted ? -1 : inherited(ev, place->smooth, PROPERTY_INHERITED_SMOOTH);
    shape->samples = (uint32_t)inherited(ev, place->samples, PROPERTY_INHERITED_SAMPLES);
    shape->bake = inherited(ev, place->bake, PROPERTY_OBJECT_BAKE) != 0;
    shape->material = shape_material(ev, object, place, &form);
    lower_loops(ev, shape);
}
