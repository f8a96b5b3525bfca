// SPDX-License-Identifier: Apache-2.0
// Shapes: what each kind becomes, and what all of them have.
#include "lang/lower_form.h"

#include <math.h>
#include <string.h>

#include "lang/eval_clip.h"

bool lower_nothing_seen(Eval *ev, const Object *object) {
    diag_warn(ev->diag, WARN_DEGENERATE, object->where, NULL,
              "%s has no surface: nothing of it is seen", object->name);
    return false;
}

// ---- Boxes and quads

Mesh *lower_mesh_new(Eval *ev, uint32_t n_vertices, uint32_t n_triangles, bool has_normals) {
    Arena *arena = lower_arena(ev);
    Mesh *mesh = ARENA_NEW(arena, Mesh);
    mesh->position = ARENA_ARRAY(arena, (size_t)n_vertices * 3, double);
    mesh->uv = ARENA_ARRAY(arena, (size_t)n_vertices * 2, float);
    mesh->index = ARENA_ARRAY(arena, (size_t)n_triangles * 3, uint32_t);
    mesh->normal = has_normals ? ARENA_ARRAY(arena, (size_t)n_vertices * 3, float) : NULL;
    mesh->faceted = !has_normals;
    return mesh;
}

uint32_t lower_mesh_vertex(Mesh *mesh, const double p[3], const double normal[3], double u,
                           double v) {
    size_t i = mesh->n_vertices++;
    memcpy(mesh->position + 3 * i, p, 3 * sizeof *p);
    mesh->uv[2 * i] = (float)u;
    mesh->uv[2 * i + 1] = (float)v;
    for (size_t c = 0; normal && c < 3; c++) {
        mesh->normal[3 * i + c] = (float)normal[c];
    }
    return (uint32_t)i;
}

void lower_mesh_triangle(Mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *index = mesh->index + 3 * (size_t)mesh->n_triangles++;
    index[0] = a;
    index[1] = b;
    index[2] = c;
}

// One side of a box: its middle along `axis`, u and v along the two axes that follow it, so that u
// crossed with v points outwards.
static void add_side(Mesh *mesh, uint32_t side, const double size[3]) {
    int axis = (int)side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    double sign = side % 2 ? -1 : 1;
    for (uint32_t k = 0; k < 4; k++) {
        double x = k == 1 || k == 2 ? 0.5 : -0.5, y = k >= 2 ? 0.5 : -0.5, p[3];
        p[axis] = sign * 0.5 * size[axis];
        p[u] = sign * x * size[u];
        p[v] = y * size[v];
        lower_mesh_vertex(mesh, p, NULL, x + 0.5, y + 0.5);
    }
    lower_mesh_triangle(mesh, 4 * side, 4 * side + 1, 4 * side + 2);
    lower_mesh_triangle(mesh, 4 * side, 4 * side + 2, 4 * side + 3);
}

static const Mesh *make_box(Eval *ev, const double size[3]) {
    Mesh *mesh = lower_mesh_new(ev, 24, 12, false);
    for (uint32_t side = 0; side < 6; side++) {
        add_side(mesh, side, size);
    }
    return mesh;
}

static const Mesh *make_quad(Eval *ev, const double size[3]) {
    Mesh *mesh = lower_mesh_new(ev, 4, 2, false);
    static const double corner[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    for (int k = 0; k < 4; k++) {
        const double p[3] = {corner[k][0] * size[0], corner[k][1] * size[1], 0};
        lower_mesh_vertex(mesh, p, NULL, corner[k][0] + 0.5, corner[k][1] + 0.5);
    }
    lower_mesh_triangle(mesh, 0, 1, 2);
    lower_mesh_triangle(mesh, 0, 2, 3);
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
    Ref3 scale = ref3(value.ref[0], value.ref[1], is_box ? value.ref[2] : one);
    form->own = spatial_map_scale(ev->dag, scale);
    form->is_mapped = scale.x != one || scale.y != one || scale.z != one;
    return true;
}

// ---- Spheres and planes

static bool sphere_form(Eval *ev, const Object *object, Form *form) {
    Ref3 center;
    if (!lower_vec3(ev, object, PROPERTY_SPHERE_CENTER, &center) ||
        !lower_scalar(ev, object, PROPERTY_SPHERE_RADIUS, &form->geometry[3])) {
        return false;
    }
    double radius;
    if (dag_is_const(ev->dag, form->geometry[3], &radius) && radius == 0) {
        return lower_nothing_seen(ev, object);
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

bool lower_form(Eval *ev, const Object *object, const Place *place, Form *form) {
    *form = (Form){.kind = SHAPE_MESH,
                   .vertex = {REF_NONE, REF_NONE, REF_NONE},
                   .rest = {REF_NONE, REF_NONE, REF_NONE},
                   .color = {REF_NONE, REF_NONE, REF_NONE}};
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
    case OBJECT_MESH:
        return lower_mesh_form(ev, object, place, form);
    default:
        return lower_solid_form(ev, object, place, form);
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

// As it is at t = 0.
static Ref at_start(Eval *ev, Ref ref) {
    Ref start = dag_const(ev->dag, 0);
    return dag_substitute(ev->dag, dag_substitute(ev->dag, ref, IN_T, start), IN_FILM_T, start);
}

static const Input rest_inputs[6] = {IN_PX, IN_PY, IN_PZ, IN_NX, IN_NY, IN_NZ};

typedef struct {
    Eval *ev;
    Ref with[6]; // in place of rest_inputs
} Resting;

static Ref change_resting(void *context, Ref ref) {
    const Resting *resting = context;
    return dag_substitute_all(resting->ev->dag, ref, rest_inputs, resting->with, 6);
}

// p and n in a material are the rest position and normal in the shape's own block: where the mesh
// has a map of its own, that is where this puts them at t = 0.
static const MaterialValue *at_own_size(Eval *ev, const MaterialValue *material, const Form *form) {
    Ref in[6], rest[3];
    RefMap own;
    for (int k = 0; k < 6; k++) {
        in[k] = dag_input(ev->dag, rest_inputs[k]);
    }
    for (int k = 0; k < 12; k++) {
        own.m[k / 4][k % 4] = at_start(ev, form->own.m[k / 4][k % 4]);
    }
    for (int k = 0; k < 3; k++) {
        rest[k] = form->rest[k] == REF_NONE ? in[k] : at_start(ev, form->rest[k]);
    }
    Ref3 p = spatial_map_point(ev->dag, &own, ref3(rest[0], rest[1], rest[2]));
    Ref3 n =
        spatial_normalize(ev->dag, spatial_map_normal(ev->dag, &own, ref3(in[3], in[4], in[5])));
    Resting resting = {ev, {p.x, p.y, p.z, n.x, n.y, n.z}};
    return material_change(ev->arena, material, change_resting, &resting);
}

// The material with the points' own colors in place of its own; of a mix, of all its parts.
static const MaterialValue *colored(Eval *ev, const MaterialValue *material, const Ref rgb[3]) {
    MaterialValue *own = ARENA_NEW(ev->arena, MaterialValue);
    *own = *material;
    if (own->kind != MATERIAL_MIX) {
        memcpy(own->ref + MATERIAL_OWN, rgb, 3 * sizeof *rgb);
        return own;
    }
    for (int k = 0; k < 2; k++) {
        own->parts[k] = colored(ev, own->parts[k], rgb);
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
    const MaterialValue *material = value.material;
    if (form->is_mapped) {
        material = at_own_size(ev, material, form);
    }
    if (form->color[0] != REF_NONE) {
        material = colored(ev, material, form->color);
    }
    return lower_material(ev, material, object, place->material);
}

// The map to the world, the form's own first. False: it stays where it is.
static bool shape_map(Eval *ev, const Place *place, const Form *form, RefMap *map) {
    if (!form->is_mapped) {
        *map = place->map;
        return !place->is_identity;
    }
    *map = place->is_identity ? form->own : spatial_map_compose(ev->dag, &place->map, &form->own);
    return true;
}

// What the vertices of a mesh move by, where it is not the film's clock.
typedef struct {
    Ref clock;        // what they have for t; REF_NONE: the film's
    const Ref *times; // of a fade (ClipFade): then t is the time since it began; NULL: no fade
    Ref is_there;     // besides what the place says; REF_NONE: always
} Pace;

// Everything that moves the shape, for its breaks. Within a fade vertices are at two moments.
static const Program *shape_breaks(Eval *ev, const Form *form, const RefMap *map,
                                   const Pace *pace) {
    Ref refs[12 + 4 + 3 + 1 + 4 + 3];
    uint32_t n = 0;
    if (map) {
        memcpy(refs, map->m, sizeof map->m);
        n = 12;
    }
    memcpy(refs + n, form->geometry, form->n_geometry * sizeof *refs);
    n += form->n_geometry;
    uint32_t first = n;
    if (form->vertex[0] != REF_NONE) {
        memcpy(refs + n, form->vertex, sizeof form->vertex);
        n += 3;
    }
    if (form->track) {
        refs[n++] = form->track_key;
    }
    if (pace->times) {
        for (uint32_t k = first, end = n; k < end; k++) {
            Ref ref = refs[k];
            refs[k] = dag_substitute(ev->dag, ref, IN_T, pace->times[0]);
            refs[n++] = dag_substitute(ev->dag, ref, IN_T, pace->times[1]);
        }
        memcpy(refs + n, pace->times, 3 * sizeof *refs);
        n += 3;
    }
    return lower_breaks(ev, refs, n);
}

// Whether the moments that vertices are at while clips fade depend on the film's clock: those of an
// instance in a def that plays clips may, if its clock does.
static bool fades_by_film(Eval *ev, const Clips *clips) {
    uint32_t inputs = 0;
    for (uint32_t k = 0; clips && k < clips->n; k++) {
        const Ref *times = clips->fades[k].times;
        inputs |= dag_inputs(ev->dag, times[0]) | dag_inputs(ev->dag, times[1]);
    }
    return inputs >> IN_FILM_T & 1;
}

// Whether a mesh moves by the clock of the instance around it. False in *is_right: reported.
static bool moves_by_clock(Eval *ev, const Object *object, const Place *place, const Form *form,
                           bool *is_right) {
    uint32_t inputs = form->track ? 1u << IN_T : 0;
    for (int k = 0; k < 3 && form->vertex[0] != REF_NONE; k++) {
        inputs |= dag_inputs(ev->dag, form->vertex[k]);
    }
    if (form->is_solid) { // what the language makes itself is by the film's clock already
        *is_right = true;
        return false;
    }
    bool moves = inputs >> IN_T & 1, by_film = inputs >> IN_FILM_T & 1;
    bool by_clock = moves && fades_by_film(ev, place->clips);
    *is_right = place->clock == REF_NONE || !(by_film || by_clock);
    if (!*is_right) {
        eval_error_at(ev, object->where,
                      by_film ? "t is the instance's own clock; what is to differ can be a "
                                "transform, a material, or a parameter of the def"
                              : "let the clock of the instance around it go by t, the time of the "
                                "clips that fade",
                      "the vertices of this %s, which instances share, move by T, the film's clock",
                      object->name);
    }
    return place->clock != REF_NONE && moves;
}

enum { TIMES = 1u << IN_T | 1u << IN_FILM_T };

static uint32_t map_inputs(Eval *ev, const RefMap *map) {
    uint32_t inputs = 0;
    for (int k = 0; map && k < 12; k++) {
        inputs |= dag_inputs(ev->dag, map->m[k / 4][k % 4]);
    }
    return inputs;
}

// speed, offset and cycle (0: none) of a clock that is a line in the film's; false: it is not.
static bool clock_pace(Eval *ev, const Place *place, Ref pace[3]) {
    Dag *dag = ev->dag;
    Ref bend, zero = dag_const(dag, 0);
    bool is_opaque = false;
    pace[0] = dag_diff(dag, place->unwound, IN_FILM_T, 1, &is_opaque);
    pace[1] = dag_substitute(dag, place->unwound, IN_FILM_T, zero);
    pace[2] = place->cycle == REF_NONE ? zero : place->cycle;
    uint32_t inputs = dag_inputs(dag, pace[0]) | dag_inputs(dag, pace[2]);
    return !is_opaque && !(inputs & TIMES) && dag_breaks(dag, &place->unwound, 1, &bend, 1) == 0;
}

// Where instances differ by where they stand and by the line that their clocks run along, what is
// theirs and what is common are told apart.
static void part_shape(Eval *ev, const Place *place, const Form *form, Shape *shape) {
    Ref pace[3];
    const uint32_t others = ~(1u << IN_T);
    uint32_t own = form->is_mapped ? map_inputs(ev, &form->own) : 0;
    uint32_t outer = place->outer_is_identity ? 0 : map_inputs(ev, &place->outer);
    if (place->clock == REF_NONE || place->clips || (outer & TIMES) ||
        (map_inputs(ev, place->inner) & others) || own || !clock_pace(ev, place, pace)) {
        return;
    }
    RefMap inner = place->inner ? *place->inner : form->own;
    if (place->inner && form->is_mapped) {
        inner = spatial_map_compose(ev->dag, place->inner, &form->own);
    }
    bool has_inner = place->inner || form->is_mapped;
    shape->inner = has_inner ? lower_program(ev, &inner.m[0][0], 12) : NULL;
    shape->outer = place->outer_is_identity ? NULL : lower_program(ev, &place->outer.m[0][0], 12);
    shape->pace = lower_program(ev, pace, 3);
}

// The edges of solids are what they are; elsewhere `smooth` says which are sharp.
static double shape_smooth(Eval *ev, const Place *place, const Form *form) {
    return form->faceted
               ? -1
               : inherited(ev, form->is_solid ? NULL : place->smooth, PROPERTY_INHERITED_SMOOTH);
}

// NULL: always.
static const Program *seen_by(Eval *ev, const Given *given) {
    double x;
    bool is_given = given && value_is(&given->value, VALUE_BOOL);
    bool is_always = !is_given || (dag_is_const(ev->dag, given->value.ref[0], &x) && x != 0);
    return is_always ? NULL : lower_program(ev, given->value.ref, 1);
}

static void emit_at_pace(Eval *ev, const Object *object, const Place *place, const char *label,
                         const Form *form, const Pace *pace) {
    RefMap map;
    bool is_moved = shape_map(ev, place, form, &map), has_clock = pace->clock != REF_NONE;
    Place here = *place;
    if (pace->is_there != REF_NONE) {
        here.visible = dag_op(ev->dag, OP_AND, place->visible, pace->is_there, REF_NONE);
    }
    Shape *shape = lower_new_shape(ev);
    shape->kind = form->kind;
    shape->where = scene_source_ref(object->where);
    shape->label = arena_string(lower_arena(ev), label, strlen(label));
    shape->number = place->has_number ? lower_program(ev, &place->number, 1) : NULL;
    shape->is_joined = place->is_joined;
    shape->mesh = form->mesh;
    shape->track = form->track;
    shape->vertex = form->vertex[0] == REF_NONE ? NULL : lower_program(ev, form->vertex, 3);
    shape->geometry = form->n_geometry ? lower_program(ev, form->geometry, form->n_geometry) : NULL;
    shape->transform = is_moved ? lower_program(ev, &map.m[0][0], 12) : NULL;
    shape->visible = lower_visible(ev, &here);
    for (int k = 0; k < RAY_KINDS; k++) {
        shape->seen[k] = seen_by(ev, place->seen[k]);
    }
    shape->is_catcher = inherited(ev, place->catcher, PROPERTY_OBJECT_CATCHER) != 0;
    shape->clock = has_clock ? lower_program(ev, &pace->clock, 1) : NULL;
    shape->is_other_form = pace->times != NULL;
    shape->fade = pace->times ? lower_program(ev, pace->times, 3) : NULL;
    part_shape(ev, place, form, shape);
    shape->breaks = shape_breaks(ev, form, is_moved && !has_clock ? &map : NULL, pace);
    shape->tolerance = inherited(ev, place->tolerance, PROPERTY_INHERITED_TOLERANCE);
    shape->smooth = shape_smooth(ev, place, form);
    shape->samples = (uint32_t)inherited(ev, place->samples, PROPERTY_INHERITED_SAMPLES);
    shape->bake = inherited(ev, place->bake, PROPERTY_OBJECT_BAKE) != 0;
    shape->material = shape_material(ev, object, place, form);
    lower_loops(ev, shape);
}

// Where clips play, vertices that move are of one form while a clip plays alone, and of another in
// each fade.
static void emit_shape(Eval *ev, const Object *object, const Place *place, const char *label,
                       const Form *form) {
    bool is_right, is_own = moves_by_clock(ev, object, place, form, &is_right);
    const Clips *clips = is_own ? place->clips : NULL;
    Pace pace = {is_own ? place->clock : REF_NONE, NULL, REF_NONE};
    if (!is_right) {
        return;
    }
    if (clips && clips->n > 0) {
        pace.is_there = dag_op(ev->dag, OP_NOT, clips->is_fading, REF_NONE, REF_NONE);
    }
    emit_at_pace(ev, object, place, label, form, &pace);
    for (uint32_t k = 0; clips && k < clips->n; k++) {
        const ClipFade *fade = &clips->fades[k];
        double on;
        if (!dag_is_const(ev->dag, fade->is_on, &on) || on != 0) {
            pace = (Pace){fade->clock, fade->times, fade->is_on};
            emit_at_pace(ev, object, place, label, form, &pace);
        }
    }
}

void lower_shape(Eval *ev, const Object *object, const Place *place, const char *label) {
    Form form;
    double x;
    if (dag_is_const(ev->dag, place->visible, &x) && x == 0) {
        return; // it is never there
    }
    if (object->kind == OBJECT_POINTS) {
        lower_points(ev, object, place, label, emit_shape);
    } else if (lower_form(ev, object, place, &form)) {
        emit_shape(ev, object, place, label, &form);
    }
}
