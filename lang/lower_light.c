// SPDX-License-Identifier: Apache-2.0
// Lowering of cameras and lights.
#include "lang/loader.h"
#include "lang/lower_parts.h"

#include <string.h>

static Ref3 placed_point(Eval *ev, const Place *place, Ref3 p) {
    return place->is_identity ? p : spatial_map_point(ev->dag, &place->map, p);
}

static Ref3 placed_vector(Eval *ev, const Place *place, Ref3 v) {
    return place->is_identity ? v : spatial_map_vector(ev->dag, &place->map, v);
}

static void append3(Ref *refs, uint32_t *n, Ref3 v) {
    refs[(*n)++] = v.x;
    refs[(*n)++] = v.y;
    refs[(*n)++] = v.z;
}

static void check_directions(Eval *ev, const Object *object, const Ref *refs) {
    double a[3], b[3];
    for (int i = 0; i < 3; i++) {
        if (!dag_is_const(ev->dag, refs[i], &a[i]) || !dag_is_const(ev->dag, refs[3 + i], &b[i])) {
            return;
        }
    }
    if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) {
        eval_error_at(ev, object->where, NULL,
                      "the camera looks nowhere: from and to are the same point");
    }
}

static CameraKind camera_kind(Eval *ev, const Object *object) {
    Value kind = object_value(ev, object, PROPERTY_CAMERA_KIND);
    const char *word = value_is(&kind, VALUE_STRING) ? symbol_text(ev->symbols, kind.symbol) : "";
    return strcmp(word, "orthographic") == 0 ? CAMERA_ORTHOGRAPHIC
           : strcmp(word, "spherical") == 0  ? CAMERA_SPHERICAL
                                             : CAMERA_PERSPECTIVE;
}

// Whether one of two properties is given that have no say there, which is reported then.
static bool refuse_given(Eval *ev, const Object *object, const PropertyId ids[2], const char *hint,
                         const char *why) {
    for (int i = 0; i < 2; i++) {
        const Given *given = object_given(object, ids[i]);
        if (given) {
            eval_error_at(ev, given->name, hint, "%s it has no %s", why,
                          property_infos[ids[i]].name);
            return true;
        }
    }
    return false;
}

// What frames a part of all directions has no say where all are seen.
static bool check_spherical(Eval *ev, const Object *object, CameraKind kind) {
    static const PropertyId framing[2] = {PROPERTY_CAMERA_FOV, PROPERTY_CAMERA_SHIFT};
    return kind != CAMERA_SPHERICAL || !refuse_given(ev, object, framing, "its middle looks at to",
                                                     "a spherical camera sees all directions,");
}

static bool check_blades(Eval *ev, const Object *object) {
    double n = lower_known(ev, object, PROPERTY_CAMERA_BLADES);
    if (n == 1 || n == 2) {
        eval_error_at(ev, object_given(object, PROPERTY_CAMERA_BLADES)->where,
                      "with blades = 0 it is round",
                      "an aperture has at least 3 blades, this is %g", n);
        return false;
    }
    return true;
}

// camera: from and to, in the world. *lens: NULL for a pinhole that is not shifted. False:
// reported.
static bool lower_lens(Eval *ev, const Object *object, const Ref camera[6], const Program **lens) {
    Dag *dag = ev->dag;
    Ref refs[4], square = dag_const(dag, 0);
    Value shift = object_value(ev, object, PROPERTY_CAMERA_SHIFT);
    double x[4] = {1, 0, 1, 1};
    if (!lower_scalar(ev, object, PROPERTY_CAMERA_APERTURE, &refs[0]) || shift.n != 2) {
        return false;
    }
    refs[2] = shift.ref[0];
    refs[3] = shift.ref[1];
    for (int i = 0; i < 4; i++) {
        if (i != 1) {
            dag_is_const(dag, refs[i], &x[i]);
        }
    }
    *lens = NULL;
    if (x[0] == 0 && x[2] == 0 && x[3] == 0) {
        return true;
    }
    if (x[0] == 0) { // with no lens, where it focuses is nobody's concern
        refs[1] = dag_const(dag, 1);
    } else if (object_given(object, PROPERTY_CAMERA_FOCUS)) {
        if (!lower_scalar(ev, object, PROPERTY_CAMERA_FOCUS, &refs[1])) {
            return false;
        }
    } else {
        for (int i = 0; i < 3; i++) {
            Ref along = dag_op(dag, OP_SUB, camera[3 + i], camera[i], REF_NONE);
            square =
                dag_op(dag, OP_ADD, square, dag_op(dag, OP_MUL, along, along, REF_NONE), REF_NONE);
        }
        refs[1] = dag_op(dag, OP_SQRT, square, REF_NONE, REF_NONE);
    }
    *lens = lower_program(ev, refs, 4);
    return true;
}

void lower_camera(Eval *ev, const Object *object, const Place *place) {
    Lowering *l = ev->lowering;
    if (!lower_once(ev, &l->camera, object)) {
        return;
    }
    CameraKind kind = camera_kind(ev, object);
    const Program *lens;
    Ref refs[10];
    Ref3 from, to, up;
    uint32_t n = 0;
    if (!lower_vec3(ev, object, PROPERTY_CAMERA_FROM, &from) ||
        !lower_vec3(ev, object, PROPERTY_CAMERA_TO, &to) ||
        !lower_vec3(ev, object, PROPERTY_CAMERA_UP, &up) ||
        !lower_scalar(ev, object, PROPERTY_CAMERA_FOV, &refs[9]) ||
        !check_spherical(ev, object, kind) || !check_blades(ev, object)) {
        return;
    }
    append3(refs, &n, placed_point(ev, place, from));
    append3(refs, &n, placed_point(ev, place, to));
    append3(refs, &n, placed_vector(ev, place, up));
    check_directions(ev, object, refs);
    if (lower_lens(ev, object, refs, &lens)) {
        l->scene->camera = (CameraSettings){
            .kind = kind,
            .program = lower_program(ev, refs, 10),
            .lens = lens,
            .blades = (uint32_t)lower_known(ev, object, PROPERTY_CAMERA_BLADES),
            .where = scene_source_ref(object->where),
        };
    }
}

static bool is_zero(Eval *ev, Ref3 v) {
    double x[3];
    return dag_is_const(ev->dag, v.x, &x[0]) && dag_is_const(ev->dag, v.y, &x[1]) &&
           dag_is_const(ev->dag, v.z, &x[2]) && x[0] == 0 && x[1] == 0 && x[2] == 0;
}

// Of what is known; see render/survey.h for the rest. refs: power and color are 3 to 6.
static void warn_of_darkness(Eval *ev, LightKind kind, const Object *object, const Place *place,
                             const Ref *refs) {
    double x;
    const char *why = NULL;
    if (dag_is_const(ev->dag, place->visible, &x) && x == 0) {
        why = "is never visible";
    } else if (kind != LIGHT_SKY && dag_is_const(ev->dag, refs[3], &x) && x == 0) {
        why = "gives no light: its power is 0";
    } else if (kind != LIGHT_SKY && is_zero(ev, ref3(refs[4], refs[5], refs[6]))) {
        why = "gives no light: its color is black";
    }
    if (why) {
        diag_warn(ev->diag, WARN_LIGHT_NEVER_VISIBLE, object->where, NULL, "this %s %s",
                  object->name, why);
    }
}

static void add_light(Eval *ev, LightKind kind, const Object *object, const Place *place,
                      const Ref *refs, uint32_t n) {
    Lowering *l = ev->lowering;
    l->lights =
        arena_grow(l->arena, l->lights, l->n_lights, &l->lights_capacity, sizeof *l->lights);
    l->lights[l->n_lights++] = (Light){.kind = kind,
                                       .program = lower_program(ev, refs, n),
                                       .visible = lower_visible(ev, place),
                                       .where = scene_source_ref(object->where)};
    warn_of_darkness(ev, kind, object, place, refs);
}

void lower_sun(Eval *ev, const Object *object, const Place *place) {
    Ref refs[8];
    Ref3 dir, color;
    uint32_t n = 0;
    if (!lower_vec3(ev, object, PROPERTY_SUN_DIR, &dir) ||
        !lower_scalar(ev, object, PROPERTY_SUN_POWER, &refs[3]) ||
        !lower_vec3(ev, object, PROPERTY_SUN_COLOR, &color) ||
        !lower_scalar(ev, object, PROPERTY_SUN_ANGLE, &refs[7])) {
        return;
    }
    append3(refs, &n, placed_vector(ev, place, dir));
    n++;
    append3(refs, &n, color);
    if (is_zero(ev, ref3(refs[0], refs[1], refs[2]))) {
        eval_error_at(ev, object->where, "dir points towards the sun",
                      "the sun has no direction: dir is <0, 0, 0>");
        return;
    }
    add_light(ev, LIGHT_SUN, object, place, refs, 8);
}

// What only a spot has, where there is no cone. True: reported.
static bool lacks_cone(Eval *ev, const Object *object) {
    static const PropertyId of_spots[2] = {PROPERTY_LAMP_DIR, PROPERTY_LAMP_EDGE};
    return refuse_given(ev, object, of_spots, "write cone = 40deg too",
                        "a lamp without a cone shines to all sides:");
}

void lower_lamp(Eval *ev, const Object *object, const Place *place) {
    Ref refs[13];
    Ref3 from, color, dir;
    uint32_t n = 0;
    if (!lower_vec3(ev, object, PROPERTY_LAMP_FROM, &from) ||
        !lower_scalar(ev, object, PROPERTY_LAMP_POWER, &refs[3]) ||
        !lower_vec3(ev, object, PROPERTY_LAMP_COLOR, &color) ||
        !lower_scalar(ev, object, PROPERTY_LAMP_RADIUS, &refs[7])) {
        return;
    }
    append3(refs, &n, placed_point(ev, place, from));
    n++;
    append3(refs, &n, color);
    if (!object_given(object, PROPERTY_LAMP_CONE)) {
        if (!lacks_cone(ev, object)) {
            add_light(ev, LIGHT_LAMP, object, place, refs, 8);
        }
        return;
    }
    if (!lower_vec3(ev, object, PROPERTY_LAMP_DIR, &dir) ||
        !lower_scalar(ev, object, PROPERTY_LAMP_CONE, &refs[11]) ||
        !lower_scalar(ev, object, PROPERTY_LAMP_EDGE, &refs[12])) {
        return;
    }
    if (is_zero(ev, dir)) {
        eval_error_at(ev, object->where, "dir says where the spot points",
                      "the spot points nowhere: dir is <0, 0, 0>");
        return;
    }
    n++;
    append3(refs, &n, placed_vector(ev, place, dir));
    add_light(ev, LIGHT_SPOT, object, place, refs, 13);
}

// Half the edges of a rectangle that faces `normal`: the width lies level, or along x where it
// faces up or down.
static void half_edges(Eval *ev, Ref3 normal, Ref width, Ref height, Ref3 *u, Ref3 *v) {
    Dag *dag = ev->dag;
    Ref half = dag_const(dag, 0.5);
    normal = spatial_normalize(dag, normal);
    Ref3 level = spatial_cross(dag, spatial_const(dag, 0, 1, 0), normal);
    Ref is_steep =
        dag_op(dag, OP_LT, spatial_dot(dag, level, level), dag_const(dag, 1e-12), REF_NONE);
    level =
        spatial_normalize(dag, spatial_select(dag, is_steep, spatial_const(dag, 1, 0, 0), level));
    *u = spatial_scale(dag, level, dag_op(dag, OP_MUL, width, half, REF_NONE));
    *v = spatial_scale(dag, spatial_cross(dag, normal, level),
                       dag_op(dag, OP_MUL, height, half, REF_NONE));
}

void lower_area(Eval *ev, const Object *object, const Place *place) {
    Ref refs[14];
    Ref3 from, to, color, u, v;
    uint32_t n = 0;
    Value size = object_value(ev, object, PROPERTY_AREA_SIZE);
    if (!lower_vec3(ev, object, PROPERTY_AREA_FROM, &from) ||
        !lower_vec3(ev, object, PROPERTY_AREA_TO, &to) || !value_is(&size, VALUE_VEC) ||
        !lower_scalar(ev, object, PROPERTY_AREA_POWER, &refs[3]) ||
        !lower_vec3(ev, object, PROPERTY_AREA_COLOR, &color) ||
        !lower_scalar(ev, object, PROPERTY_AREA_TWO_SIDED, &refs[7])) {
        return;
    }
    Ref3 normal = spatial_sub(ev->dag, to, from);
    if (is_zero(ev, normal)) {
        eval_error_at(ev, object->where, "to is what it shines at",
                      "the area faces nowhere: from and to are the same point");
        return;
    }
    half_edges(ev, normal, size.ref[0], size.ref[1], &u, &v);
    if (!place->is_identity) { // a mirror does not change which side shines
        Ref side = dag_op(ev->dag, OP_SIGN, spatial_map_determinant(ev->dag, &place->map), REF_NONE,
                          REF_NONE);
        u = spatial_scale(ev->dag, u, side);
    }
    append3(refs, &n, placed_point(ev, place, from));
    n++;
    append3(refs, &n, color);
    n++;
    append3(refs, &n, placed_vector(ev, place, u));
    append3(refs, &n, placed_vector(ev, place, v));
    add_light(ev, LIGHT_AREA, object, place, refs, 14);
}

// At most one thing paints the sky. True: more do (reported).
static bool is_painted_twice(Eval *ev, const Object *object) {
    static const PropertyId paints[] = {PROPERTY_SKY_COLOR, PROPERTY_SKY_GRADIENT,
                                        PROPERTY_SKY_IMAGE};
    const Given *first = NULL;
    for (int i = 0; i < 3; i++) {
        const Given *given = object_given(object, paints[i]);
        if (given && first) {
            eval_error_at(ev, given->name, "power scales any of them",
                          "a sky has a color, a gradient or an image, not two of them");
            diag_note(ev->diag, first->name, "the other is here");
            return true;
        }
        first = given ? given : first;
    }
    return false;
}

// What gradient(dir, height) gives; NULL: reported.
static const Program *lower_gradient(Eval *ev, const Given *given) {
    const uint32_t may_read = 1u << IN_T | 1u << IN_FILM_T | 7u << IN_PX | 15u << IN_LOOP0;
    Ref dir[3];
    for (int i = 0; i < 3; i++) {
        dir[i] = dag_input(ev->dag, (Input)(IN_PX + i));
    }
    Symbol names[2] = {symbol_of(ev->symbols, "dir", 3), symbol_of(ev->symbols, "height", 6)};
    Value values[2] = {value_vec(VALUE_VEC, dir, 3), value_scalar(VALUE_NUMBER, dir[1])};
    if (value_is_poison(&given->value)) {
        return NULL;
    }
    Value color = eval_apply(ev, given->value.closure, names, values, 2, &given->env, given->node);
    return eval_check_vec3(ev, given->name, "gradient", &color, may_read)
               ? lower_program(ev, color.ref, 3)
               : NULL;
}

// NULL: reported.
static const SkyImage *read_image(Eval *ev, const Given *given) {
    const char *path = loader_file(ev, &given->env, given->node, &given->value);
    SkyImage *image = ARENA_NEW(lower_arena(ev), SkyImage);
    char message[512];
    if (!path) {
        return NULL;
    }
    if (!sky_image_read(lower_arena(ev), path, image, message, sizeof message)) {
        eval_error(ev, &given->env, given->node, NULL, "cannot take '%s' for a sky: %s", path,
                   message);
        ev->has_failed_file = true;
        return NULL;
    }
    loader_hash_add(ev, image->rgb, 3 * (size_t)image->width * image->height * sizeof *image->rgb);
    return image;
}

void lower_sky(Eval *ev, const Object *object, const Place *place) {
    Lowering *l = ev->lowering;
    const Given *gradient = object_given(object, PROPERTY_SKY_GRADIENT);
    const Given *image = object_given(object, PROPERTY_SKY_IMAGE);
    const Program *painted = NULL;
    const SkyImage *picture = NULL;
    Ref refs[5];
    Ref3 color = spatial_const(ev->dag, 1, 1, 1);
    uint32_t n = 0;
    if (!lower_once(ev, &l->sky, object) || is_painted_twice(ev, object) ||
        (!gradient && !image && !lower_vec3(ev, object, PROPERTY_SKY_COLOR, &color)) ||
        !lower_scalar(ev, object, PROPERTY_SKY_POWER, &refs[3]) ||
        !lower_scalar(ev, object, PROPERTY_SKY_ROTATE, &refs[4]) ||
        (gradient && !(painted = lower_gradient(ev, gradient))) ||
        (image && !(picture = read_image(ev, image)))) {
        return;
    }
    append3(refs, &n, color);
    add_light(ev, LIGHT_SKY, object, place, refs, image ? 5 : 4);
    l->lights[l->n_lights - 1].gradient = painted;
    l->lights[l->n_lights - 1].image = picture;
}
