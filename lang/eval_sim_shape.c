// SPDX-License-Identifier: Apache-2.0
// Shapes of rigid bodies: those that the engine knows, and all others as triangles.
#include <math.h>
#include <string.h>

#include "lang/eval_sim_parts.h"
#include "lang/lower.h"
#include "render/sim_solid.h"

static void rotate(const double q[4], const double v[3], double out[3]) {
    double c[3] = {q[1] * v[2] - q[2] * v[1], q[2] * v[0] - q[0] * v[2], q[0] * v[1] - q[1] * v[0]};
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        out[k] = v[k] + 2 * (q[3] * c[k] + q[i] * c[j] - q[j] * c[i]);
    }
}

static void multiply(const double a[4], const double b[4], double out[4]) {
    const double q[4] = {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
                         a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                         a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
                         a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
    memcpy(out, q, sizeof q);
}

// ---- Shapes

// The turn from z to a direction.
static void turn_to(const double d[3], double length, double turn[4]) {
    double w = 1 + d[2] / length, x = -d[1] / length, y = d[0] / length;
    double norm = sqrt(w * w + x * x + y * y);
    const double about_x[4] = {1, 0, 0, 0};
    const double q[4] = {x / norm, y / norm, 0, w / norm};
    memcpy(turn, norm > 1e-9 ? q : about_x, sizeof q);
}

// A cylinder or a capsule, along z for the engine.
static bool rod_of(RigidBlock *b, const Object *object, RigidShape *shape) {
    bool is_round = object->kind == OBJECT_CAPSULE;
    double from[3], to[3], d[3];
    shape->kind = is_round ? RIGID_CAPSULE : RIGID_CYLINDER;
    if (!sim_rigid_numbers(b, object, is_round ? PROPERTY_CAPSULE_FROM : PROPERTY_CYLINDER_FROM,
                           from) ||
        !sim_rigid_numbers(b, object, is_round ? PROPERTY_CAPSULE_TO : PROPERTY_CYLINDER_TO, to) ||
        !sim_rigid_numbers(b, object, is_round ? PROPERTY_CAPSULE_RADIUS : PROPERTY_CYLINDER_RADIUS,
                           &shape->size[0])) {
        return false;
    }
    for (int k = 0; k < 3; k++) {
        d[k] = to[k] - from[k];
        shape->at[k] = (from[k] + to[k]) / 2;
    }
    shape->size[1] = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (shape->size[1] > 0) {
        turn_to(d, shape->size[1], shape->turn);
    }
    return true;
}

static bool plane_of(RigidBlock *b, const Object *object, const RigidPose *body,
                     RigidShape *shape) {
    double n[3], offset, turned[3];
    if (!sim_rigid_numbers(b, object, PROPERTY_PLANE_NORMAL, n) ||
        !sim_rigid_numbers(b, object, PROPERTY_PLANE_OFFSET, &offset)) {
        return false;
    }
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    rotate(body->turn, n, turned);
    shape->plane[3] = offset;
    for (int k = 0; k < 3; k++) {
        shape->plane[k] = turned[k] / length;
        shape->plane[3] += shape->plane[k] * body->at[k];
    }
    return true;
}

// ---- Shapes as triangles

static bool refuse(RigidBlock *b, const Object *object, const RigidOwner *owner, const char *hint,
                   const char *message) {
    eval_error_at(b->ev, object->where, hint, "%s.%s: at t = %.6g s %s",
                  symbol_text(b->ev->symbols, b->sim->name), owner->name, b->sim->rigid.low,
                  message);
    return sim_rigid_fail(b);
}

// What falls must enclose a volume, faces outwards; what stands may be open, as ground is.
static bool close_solid(RigidBlock *b, const Object *object, const RigidOwner *owner,
                        SimSolid *solid) {
    uint32_t n_open = sim_solid_n_open(solid);
    if (n_open && !owner->is_fixed) {
        return refuse(b, object, owner, "write convex = true in its body, or close it",
                      arena_printf(b->ev->arena,
                                   "its surface has holes: %u of its edges %s not between two "
                                   "faces that are turned the same way",
                                   n_open, n_open == 1 ? "is" : "are"));
    }
    double volume = n_open ? 1 : sim_solid_volume(solid);
    if (volume < 0) {
        sim_solid_turn_over(solid);
    }
    return volume != 0 || owner->is_fixed ||
           refuse(b, object, owner, NULL, "its surface encloses no volume");
}

// The engine wants the origin of a hull within it.
static void center_solid(SimSolid *solid, RigidShape *shape) {
    for (size_t i = 0; i < 3 * (size_t)solid->n_points; i++) {
        shape->at[i % 3] += solid->point[i] / solid->n_points;
    }
    for (size_t i = 0; i < 3 * (size_t)solid->n_points; i++) {
        solid->point[i] -= shape->at[i % 3];
    }
    shape->own = sim_solid_mass(solid);
}

static bool triangles_of(RigidBlock *b, const Object *object, const RigidOwner *owner,
                         RigidShape *shape) {
    Eval *ev = b->ev;
    Mesh mesh;
    SimSolid solid, hull;
    if (!lower_body_mesh(ev, object, b->sim->rigid.low, &mesh)) {
        return sim_rigid_fail(b);
    }
    if (!sim_solid_weld(ev->arena, &mesh, &solid)) {
        return refuse(b, object, owner, NULL, "a vertex of its shape is not finite");
    }
    if (solid.n_faces == 0) {
        return refuse(b, object, owner, NULL, "its shape has no faces");
    }
    shape->kind = owner->is_convex || object->kind == OBJECT_CONE ? RIGID_CONVEX : RIGID_MESH;
    if (shape->kind == RIGID_CONVEX) {
        if (!sim_solid_hull(ev->arena, &solid, &hull)) {
            return refuse(b, object, owner, NULL, "its shape is flat");
        }
        solid = hull;
    } else if (!close_solid(b, object, owner, &solid)) {
        return false;
    }
    SimSolid *kept = ARENA_NEW(ev->arena, SimSolid);
    *kept = solid;
    shape->solid = kept;
    center_solid(kept, shape);
    hash_add(&b->sim->key, solid.point, 3 * (size_t)solid.n_points * sizeof *solid.point);
    hash_add(&b->sim->key, solid.face, 3 * (size_t)solid.n_faces * sizeof *solid.face);
    return true;
}

// ---- All of them

// Whether its transforms stretch it, so that the engine does not know it.
static bool is_stretched(const RigidBlock *b, const Object *object) {
    Dag *dag = b->ev->dag;
    bool is = false;
    if (!object->is_identity) {
        RefParts parts = spatial_map_split(dag, &object->map);
        const Ref scale[3] = {parts.scale.x, parts.scale.y, parts.scale.z};
        for (int k = 0; k < 3; k++) {
            double x = 1;
            is = is || (dag_is_const(dag, scale[k], &x) && !(fabs(x - 1) < 1e-6));
        }
    }
    return is;
}

// What is convex as it is made is a hull when it is stretched.
static bool stretched_of(RigidBlock *b, const Object *object, const RigidOwner *owner,
                         RigidShape *shape) {
    RigidOwner as_hull = *owner;
    as_hull.is_convex = true;
    switch (object->kind) {
    case OBJECT_PLANE:
    case OBJECT_POINTS:
        eval_error_at(b->ev, object->where, NULL, "%s of a sim rigid can not be scaled",
                      object->kind == OBJECT_PLANE ? "a plane" : "points");
        return sim_rigid_fail(b);
    case OBJECT_BOX:
    case OBJECT_SPHERE:
    case OBJECT_CYLINDER:
    case OBJECT_CAPSULE:
        return triangles_of(b, object, &as_hull, shape);
    default:
        return triangles_of(b, object, owner, shape);
    }
}

static bool size_of(RigidBlock *b, const Object *object, const RigidOwner *owner,
                    RigidShape *shape) {
    if (is_stretched(b, object)) {
        return stretched_of(b, object, owner, shape);
    }
    switch (object->kind) {
    case OBJECT_BOX:
        shape->kind = RIGID_BOX;
        return sim_rigid_numbers(b, object, PROPERTY_BOX_SIZE, shape->size);
    case OBJECT_SPHERE:
        shape->kind = RIGID_SPHERE;
        return sim_rigid_numbers(b, object, PROPERTY_SPHERE_CENTER, shape->at) &&
               sim_rigid_numbers(b, object, PROPERTY_SPHERE_RADIUS, shape->size);
    case OBJECT_CYLINDER:
    case OBJECT_CAPSULE:
        return rod_of(b, object, shape);
    case OBJECT_PLANE:
        shape->kind = RIGID_PLANE;
        if (owner->is_fixed && !owner->moves && object->is_identity) {
            return plane_of(b, object, owner->pose, shape);
        }
        eval_error_at(b->ev, object->where, "write normal and offset, in a fixed body",
                      "a plane of a sim rigid stands still, without transforms of its own");
        return sim_rigid_fail(b);
    case OBJECT_POINTS:
        eval_error_at(b->ev, object->where, "write sphere { }",
                      "points are no shape of a rigid body");
        return sim_rigid_fail(b);
    default:
        return triangles_of(b, object, owner, shape);
    }
}

static bool is_solid(const RigidShape *shape) {
    const double *s = shape->size;
    switch (shape->kind) {
    case RIGID_PLANE:
        return isfinite(shape->plane[3]);
    case RIGID_SPHERE:
        return s[0] > 0;
    case RIGID_BOX:
        return s[0] > 0 && s[1] > 0 && s[2] > 0;
    case RIGID_CYLINDER:
    case RIGID_CAPSULE:
        return s[0] > 0 && s[1] > 0;
    default:
        return true;
    }
}

// Puts the shape where its own transforms say; those of triangles are in their points.
static bool place_shape(RigidBlock *b, const Object *object, RigidShape *shape) {
    RigidPose pose;
    double at[3];
    if (shape->solid) {
        return true;
    }
    if (!sim_rigid_pose(b, object, &pose, NULL, NULL)) {
        return false;
    }
    rotate(pose.turn, shape->at, at);
    for (int k = 0; k < 3; k++) {
        shape->at[k] = at[k] + pose.at[k];
    }
    multiply(pose.turn, shape->turn, shape->turn);
    return true;
}

static void keep(RigidBlock *b, const RigidShape *shape) {
    const double kind = shape->kind;
    b->shapes =
        arena_grow(b->ev->arena, b->shapes, b->n_shapes, &b->shapes_capacity, sizeof *b->shapes);
    b->shapes[b->n_shapes++] = *shape;
    sim_rigid_hash(b, &kind, 1);
    sim_rigid_hash(b, shape->size, 3);
    sim_rigid_hash(b, shape->at, 3);
    sim_rigid_hash(b, shape->turn, 4);
    sim_rigid_hash(b, shape->plane, 4);
}

static void add_shape(RigidBlock *b, const Object *object, const RigidOwner *owner) {
    RigidShape shape = {.turn = {0, 0, 0, 1}};
    bool is_fine = size_of(b, object, owner, &shape);
    if (is_fine && !is_solid(&shape)) {
        eval_error_at(b->ev, object->where, NULL, "a shape of a rigid body has a size above 0");
        is_fine = sim_rigid_fail(b);
    }
    if (is_fine && place_shape(b, object, &shape)) {
        keep(b, &shape);
    }
}

struct BodyShapes {
    RigidBlock *b;
    const RigidOwner *owner;
};

void eval_body_take(Eval *ev, const Object *object, const Place *place) {
    struct BodyShapes *shapes = ev->body;
    Object placed = *object;
    if (place->clock != REF_NONE) {
        eval_error_at(ev, object->where, "leave out instance",
                      "a shape of a rigid body has no clock of its own");
        sim_rigid_fail(shapes->b);
    } else if (node_infos[object->kind].class == NODE_CLASS_SHAPE) { // lights weigh nothing
        placed.is_identity = place->is_identity;
        placed.map = place->map;
        add_shape(shapes->b, &placed, shapes->owner);
    }
}

void sim_rigid_shapes(RigidBlock *b, const Env *env, NodeId block, const RigidOwner *owner) {
    Eval *ev = b->ev;
    struct BodyShapes shapes = {b, owner}, *outer = ev->body;
    const Place *playing = ev->playing;
    Loops *loops = ev->loops;
    const struct RunLoop *runs = ev->runs;
    const Place place = place_outermost(ev);
    unsigned n_errors = diag_n_errors(ev->diag);
    ev->body = &shapes;
    ev->playing = NULL;
    ev->loops = NULL;
    ev->runs = NULL;
    eval_emit(ev, env, &place, block, true, "body");
    ev->body = outer;
    ev->playing = playing;
    ev->loops = loops;
    ev->runs = runs;
    b->is_bad = b->is_bad || diag_n_errors(ev->diag) > n_errors;
}
