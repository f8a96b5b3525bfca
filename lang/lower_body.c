// SPDX-License-Identifier: Apache-2.0
// Shapes of rigid bodies as triangles: what would be rendered, at one instant.
#include "lang/lower_form.h"

#include "render/snapshot.h"

enum {
    STEPS = 48, // around circles, whatever the size of the picture
    POINT_INPUTS = 1u << IN_U | 1u << IN_V | 7u << IN_PX | 7u << IN_NX | 1u << IN_I
};

// What the refs read must not change; false: reported, or asked for.
static bool stands_still(Eval *ev, const Object *object, const Ref *refs, uint32_t n) {
    uint32_t read = 0;
    for (uint32_t i = 0; i < n; i++) {
        read |= refs[i] == REF_NONE ? 0 : dag_inputs(ev->dag, refs[i]);
    }
    if (read & LOOP_INPUTS) {
        ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        return false;
    }
    if (read & ~(uint32_t)POINT_INPUTS) {
        eval_error_at(ev, object->where, NULL,
                      "the shape of a rigid body keeps its form: it can not depend on %s",
                      eval_input_name(read & ~(uint32_t)POINT_INPUTS));
        return false;
    }
    return true;
}

bool lower_body_mesh(Eval *ev, const Object *object, double seconds, Mesh *mesh) {
    Place place = place_outermost(ev);
    place.is_identity = object->is_identity;
    place.map = object->map;
    place.steps = STEPS;
    unsigned n_errors = diag_n_errors(ev->diag);
    Form form;
    if (!lower_form(ev, object, &place, &form)) {
        if (diag_n_errors(ev->diag) == n_errors && !ev->unroll) {
            eval_error_at(ev, object->where, NULL, "a shape of a rigid body has a size above 0");
        }
        return false;
    }
    if (form.track) {
        eval_error_at(ev, object->where, "leave out cache, frames and clip",
                      "the shape of a rigid body keeps its form");
        return false;
    }
    RefMap map = form.is_mapped && !place.is_identity
                     ? spatial_map_compose(ev->dag, &place.map, &form.own)
                 : form.is_mapped ? form.own
                                  : place.map;
    bool is_moved = form.is_mapped || !place.is_identity;
    if (!stands_still(ev, object, form.vertex, 3) ||
        !stands_still(ev, object, form.geometry, form.n_geometry) ||
        (is_moved && !stands_still(ev, object, &map.m[0][0], 12))) {
        return false;
    }
    Shape shape = {.kind = form.kind, .label = "", .mesh = form.mesh, .n_instances = 1};
    shape.vertex = form.vertex[0] == REF_NONE ? NULL : lower_program(ev, form.vertex, 3);
    shape.geometry = form.n_geometry ? lower_program(ev, form.geometry, form.n_geometry) : NULL;
    shape.transform = is_moved ? lower_program(ev, &map.m[0][0], 12) : NULL;
    const Scene scene = {.shapes = &shape, .n_shapes = 1};
    Snapshot snapshot;
    if (!snapshot_take(ev->arena, &scene, NULL, seconds, mesh, &snapshot)) {
        eval_error_at(ev, object->where, NULL, "this shape has more than 2^31 triangles");
        return false;
    }
    return true;
}
