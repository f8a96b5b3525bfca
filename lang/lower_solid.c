// SPDX-License-Identifier: Apache-2.0
// Round solids: cylinder, capsule, cone, torus, disc, cut into triangles with the exact normals.
//
// Solids of one form share a mesh of unit size under a map of their own, so that thousands of them
// cost one tree, and motion of their ends and radii is exact at every ray's time. Only where the
// form itself changes (a cone's radii or a torus's against each other) do the vertices move.
#include "lang/lower_form.h"

#include <math.h>
#include <string.h>

enum { LEAST_STEPS = 24, MOST_STEPS = 1024 };

static double sine(double angle) {
    return program_fold(OP_SIN, angle, 0, 0);
}

static double cosine(double angle) {
    return program_fold(OP_COS, angle, 0, 0);
}

// Steps around a circle. With n of them the outline lies r (pi/n)^2 / 2 within that of a circle of
// r pixels: this keeps it within the tolerance for one whose radius is the picture's height.
static uint32_t steps_around(Eval *ev, const Place *place) {
    const double pi = 3.141592653589793;
    const Lowering *l = ev->lowering;
    if (place->steps) {
        return place->steps;
    }
    double tolerance = 0.25,
           height = l->overrides.height ? l->overrides.height : l->scene->film.height;
    if (place->tolerance && place->tolerance->value.n == 1) {
        dag_is_const(ev->dag, place->tolerance->value.ref[0], &tolerance);
    }
    double steps = ceil(pi * sqrt(height / (2 * tolerance)) / 4) * 4;
    return (uint32_t)fmax(LEAST_STEPS, fmin(MOST_STEPS, steps));
}

// ---- Meshes. u runs around y from z over x, so that it crosses the way up to point outwards.

typedef struct {
    double sin, cos; // the direction (sin, 0, cos)
} Around;

// Step i of n: exactly the first one at the end.
static Around around(uint32_t i, uint32_t n, double part) {
    double angle = 6.283185307179586 * ((i % n + part) / n);
    return (Around){sine(angle), cosine(angle)};
}

static void add_cap(Mesh *mesh, uint32_t n, double radius, double y, double side) {
    const double normal[3] = {0, side, 0}, middle[3] = {0, y, 0};
    uint32_t center = lower_mesh_vertex(mesh, middle, normal, 0.5, 0.5);
    for (uint32_t i = 0; i < n; i++) {
        Around a = around(i, n, 0);
        const double p[3] = {radius * a.sin, y, radius * a.cos};
        lower_mesh_vertex(mesh, p, normal, 0.5 + 0.5 * a.sin, 0.5 + 0.5 * a.cos);
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t p = center + 1 + i, q = center + 1 + (i + 1) % n;
        lower_mesh_triangle(mesh, center, side > 0 ? p : q, side > 0 ? q : p);
    }
}

// From radius `base` at y = 0 to `top` at y = 1. A tip has a vertex for each step, whose normal is
// that of the step's middle.
static void add_side(Mesh *mesh, uint32_t n, double base, double top) {
    uint32_t first = mesh->n_vertices;
    double out = 1 / sqrt(1 + (base - top) * (base - top)), up = (base - top) * out;
    for (uint32_t i = 0; i <= n; i++) {
        Around a = around(i, n, 0), m = around(i, n, top > 0 ? 0 : 0.5);
        const double low[3] = {base * a.sin, 0, base * a.cos};
        const double high[3] = {top * a.sin, 1, top * a.cos};
        const double normal[3] = {out * a.sin, up, out * a.cos};
        const double upper[3] = {out * m.sin, up, out * m.cos};
        lower_mesh_vertex(mesh, low, normal, (double)i / n, 0);
        lower_mesh_vertex(mesh, high, upper, (i + (top > 0 ? 0 : 0.5)) / n, 1);
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t a = first + 2 * i;
        lower_mesh_triangle(mesh, a, a + 2, top > 0 ? a + 3 : a + 1);
        if (top > 0) {
            lower_mesh_triangle(mesh, a, a + 3, a + 1);
        }
    }
}

static const Mesh *make_cone(Eval *ev, uint32_t n, double base, double top) {
    Mesh *mesh = lower_mesh_new(ev, 4 * n + 4, 4 * n, true);
    add_side(mesh, n, base, top);
    add_cap(mesh, n, base, 0, -1);
    if (top > 0) {
        add_cap(mesh, n, top, 1, 1);
    }
    return mesh;
}

// One circle of a capsule: `up` from the middle of its half sphere, where that is a unit wide.
static void add_circle(Mesh *mesh, uint32_t n, double ratio, double y, double out, double up,
                       double v) {
    double length =
        sqrt(ratio * ratio * out * out + up * up); // of the normal, under the map's scale
    for (uint32_t i = 0; i <= n; i++) {
        Around a = around(i, n, 0);
        const double p[3] = {out * a.sin, y + ratio * up, out * a.cos};
        const double normal[3] = {ratio * out * a.sin / length, up / length,
                                  ratio * out * a.cos / length};
        lower_mesh_vertex(mesh, p, normal, (double)i / n, v);
    }
}

// Of radius 1 across and half spheres of the height `ratio` below y = 0 and above y = 1.
static const Mesh *make_capsule(Eval *ev, uint32_t n, double ratio) {
    const double right = 1.5707963267948966;
    uint32_t m = n / 4, rows = 2 * m + 2;
    double whole = 2 * right * ratio + 1; // the way from tip to tip
    Mesh *mesh = lower_mesh_new(ev, rows * (n + 1), 2 * n * (rows - 1), true);
    for (uint32_t j = 0; j < rows; j++) {
        bool is_upper = j > m;
        uint32_t step = is_upper ? j - m - 1 : m - j; // from the widest circle to the tip
        double angle = right * step / m, way = ratio * angle;
        double up = step == m ? 1 : sine(angle), out = step == m ? 0 : cosine(angle);
        add_circle(mesh, n, ratio, is_upper, out, is_upper ? up : -up,
                   (right * ratio + (is_upper ? 1 + way : -way)) / whole);
    }
    for (uint32_t j = 0; j + 1 < rows; j++) {
        for (uint32_t i = 0; i < n; i++) {
            uint32_t a = j * (n + 1) + i, d = a + n + 1;
            if (j > 0) { // the vertices of the first and the last row are at one place
                lower_mesh_triangle(mesh, a, a + 1, d + 1);
            }
            if (j + 2 < rows) {
                lower_mesh_triangle(mesh, a, d + 1, d);
            }
        }
    }
    return mesh;
}

static const Mesh *make_disc(Eval *ev, uint32_t n) {
    Mesh *mesh = lower_mesh_new(ev, n + 1, n, true);
    add_cap(mesh, n, 1, 0, 1);
    return mesh;
}

static const Mesh *make_torus(Eval *ev, uint32_t n, double major, double minor) {
    // A smaller circle needs fewer steps for the same distance from it.
    double share = major + minor > 0 ? minor / (major + minor) : 1;
    uint32_t m = (uint32_t)fmax(LEAST_STEPS, ceil(n * sqrt(share) / 4) * 4);
    Mesh *mesh = lower_mesh_new(ev, (n + 1) * (m + 1), 2 * n * m, true);
    for (uint32_t j = 0; j <= m; j++) {
        for (uint32_t i = 0; i <= n; i++) {
            Around a = around(i, n, 0), b = around(j, m, 0);
            double ring = major + minor * b.cos;
            const double p[3] = {ring * a.sin, minor * b.sin, ring * a.cos};
            const double normal[3] = {b.cos * a.sin, b.sin, b.cos * a.cos};
            lower_mesh_vertex(mesh, p, normal, (double)i / n, (double)j / m);
        }
    }
    for (uint32_t j = 0; j < m; j++) {
        for (uint32_t i = 0; i < n; i++) {
            uint32_t a = j * (n + 1) + i, d = a + n + 1;
            lower_mesh_triangle(mesh, a, a + 1, d + 1);
            lower_mesh_triangle(mesh, a, d + 1, d);
        }
    }
    return mesh;
}

// The mesh of a kind of solid with these two radii; one that was made lately is used again.
static const Mesh *shared_mesh(Eval *ev, ObjectKind kind, uint32_t steps, double a, double b) {
    Lowering *l = ev->lowering;
    for (uint32_t i = 0; i < LOWERING_SOLIDS; i++) {
        const SharedSolid *solid = &l->solids[i];
        if (solid->mesh && solid->kind == kind && solid->steps == steps && solid->a == a &&
            solid->b == b) {
            return solid->mesh;
        }
    }
    const Mesh *mesh = kind == OBJECT_DISC      ? make_disc(ev, steps)
                       : kind == OBJECT_TORUS   ? make_torus(ev, steps, a, b)
                       : kind == OBJECT_CAPSULE ? make_capsule(ev, steps, b)
                                                : make_cone(ev, steps, a, b);
    l->solids[l->next_solid++ % LOWERING_SOLIDS] = (SharedSolid){kind, steps, a, b, mesh};
    return mesh;
}

// ---- Maps

static Ref op2(Eval *ev, Op op, Ref a, Ref b) {
    return dag_op(ev->dag, op, a, b, REF_NONE);
}

// The shortest turn that takes y to the unit vector d = (x, y, z): its columns are (1 - axx, -x,
// -axz), d and (-axz, -z, 1 - azz) with a = 1/(1 + y). Near -y, where 1 + y has no digits left, a
// is (1 - y)/(xx + zz), the same number. To -y itself it is a half turn about x.
static void turn_from_y(Eval *ev, Ref3 d, Ref3 columns[3]) {
    Dag *dag = ev->dag;
    Ref one = dag_const(dag, 1), zero = dag_const(dag, 0);
    Ref xx = op2(ev, OP_MUL, d.x, d.x), zz = op2(ev, OP_MUL, d.z, d.z);
    Ref across = op2(ev, OP_ADD, xx, zz), is_down = op2(ev, OP_LT, d.y, zero);
    Ref is_pole = op2(ev, OP_AND, is_down, op2(ev, OP_EQ, across, zero));
    Ref below =
        op2(ev, OP_DIV, op2(ev, OP_SUB, one, d.y), dag_op(dag, OP_SELECT, is_pole, one, across));
    Ref above =
        op2(ev, OP_DIV, one, op2(ev, OP_ADD, one, dag_op(dag, OP_SELECT, is_down, zero, d.y)));
    Ref a = dag_op(dag, OP_SELECT, is_down, below, above);
    Ref xz = op2(ev, OP_MUL, a, op2(ev, OP_MUL, d.x, d.z));
    Ref z = op2(ev, OP_SUB, one, op2(ev, OP_MUL, a, zz));
    Ref minus_xz = dag_op(dag, OP_NEG, xz, REF_NONE, REF_NONE);
    columns[0] = ref3(op2(ev, OP_SUB, one, op2(ev, OP_MUL, a, xx)),
                      dag_op(dag, OP_NEG, d.x, REF_NONE, REF_NONE), minus_xz);
    columns[1] = d;
    columns[2] = ref3(minus_xz, dag_op(dag, OP_NEG, d.z, REF_NONE, REF_NONE),
                      dag_op(dag, OP_SELECT, is_pole, dag_const(dag, -1), z));
}

// Takes (x, y, z) to origin + x radius e0 + y up + z radius e2, with e0 and e2 across up.
static RefMap axis_map(Eval *ev, Ref3 origin, Ref3 up, Ref radius) {
    Ref3 columns[3];
    turn_from_y(ev, spatial_normalize(ev->dag, up), columns);
    columns[0] = spatial_scale(ev->dag, columns[0], radius);
    columns[1] = up;
    columns[2] = spatial_scale(ev->dag, columns[2], radius);
    return (RefMap){{{columns[0].x, columns[1].x, columns[2].x, origin.x},
                     {columns[0].y, columns[1].y, columns[2].y, origin.y},
                     {columns[0].z, columns[1].z, columns[2].z, origin.z}}};
}

static bool is_zero(Eval *ev, Ref3 v) {
    double x, y, z;
    return dag_is_const(ev->dag, v.x, &x) && dag_is_const(ev->dag, v.y, &y) &&
           dag_is_const(ev->dag, v.z, &z) && x == 0 && y == 0 && z == 0;
}

static Ref3 rest_inputs(Eval *ev) {
    return ref3(dag_input(ev->dag, IN_PX), dag_input(ev->dag, IN_PY), dag_input(ev->dag, IN_PZ));
}

// ---- Cylinders and cones

// The two radii of a frustum and its ends; false: there was a mistake.
typedef struct {
    Ref3 from, to;
    Ref base, top;
} Frustum;

static bool read_frustum(Eval *ev, const Object *object, Frustum *f) {
    bool is_cone = object->kind == OBJECT_CONE;
    if (!lower_vec3(ev, object, is_cone ? PROPERTY_CONE_FROM : PROPERTY_CYLINDER_FROM, &f->from) ||
        !lower_vec3(ev, object, is_cone ? PROPERTY_CONE_TO : PROPERTY_CYLINDER_TO, &f->to) ||
        !lower_scalar(ev, object, is_cone ? PROPERTY_CONE_RADIUS : PROPERTY_CYLINDER_RADIUS,
                      &f->base)) {
        return false;
    }
    f->top = f->base;
    if (is_cone && !lower_scalar(ev, object, PROPERTY_CONE_TOP, &f->top)) {
        return false;
    }
    if (is_zero(ev, spatial_sub(ev->dag, f->to, f->from))) {
        eval_error_at(ev, object->where, NULL, "from and to are the same point");
        return false;
    }
    return true;
}

// The wider end becomes the base of unit radius; false: the radii move against each other.
static bool wider_base(Eval *ev, Frustum *f, double *ratio) {
    double base = 0, top = 0;
    bool is_base = dag_is_const(ev->dag, f->base, &base),
         is_top = dag_is_const(ev->dag, f->top, &top);
    if ((is_base && is_top && top > base) || (is_base && base == 0 && !is_top)) {
        *f = (Frustum){f->to, f->from, f->top, f->base};
        *ratio = base / (is_top ? top : 1);
        return true;
    }
    if (f->base == f->top) {
        *ratio = 1;
        return true;
    }
    *ratio = is_base && base > 0 ? top / base : 0;
    return is_top && (is_base || top == 0);
}

static bool frustum_form(Eval *ev, const Object *object, uint32_t steps, Form *form) {
    Frustum f;
    double ratio, base;
    if (!read_frustum(ev, object, &f)) {
        return false;
    }
    bool is_rigid = wider_base(ev, &f, &ratio);
    if (dag_is_const(ev->dag, f.base, &base) && base == 0 && is_rigid) {
        return lower_nothing_seen(ev, object); // a line
    }
    Ref3 up = spatial_sub(ev->dag, f.to, f.from), p = rest_inputs(ev);
    form->mesh = shared_mesh(ev, OBJECT_CONE, steps, 1, is_rigid ? ratio : 1);
    form->own = axis_map(ev, f.from, up, is_rigid ? f.base : dag_const(ev->dag, 1));
    if (!is_rigid) {
        Ref grow = op2(ev, OP_MUL, p.y, op2(ev, OP_SUB, f.top, f.base));
        Ref radius = op2(ev, OP_ADD, f.base, grow);
        form->vertex[0] = op2(ev, OP_MUL, p.x, radius);
        form->vertex[1] = p.y;
        form->vertex[2] = op2(ev, OP_MUL, p.z, radius);
    }
    return true;
}

// ---- Capsules

static bool capsule_form(Eval *ev, const Object *object, uint32_t steps, Form *form) {
    Ref3 from, to;
    Ref radius, one = dag_const(ev->dag, 1), p_y = dag_input(ev->dag, IN_PY);
    double r, l;
    if (!lower_vec3(ev, object, PROPERTY_CAPSULE_FROM, &from) ||
        !lower_vec3(ev, object, PROPERTY_CAPSULE_TO, &to) ||
        !lower_scalar(ev, object, PROPERTY_CAPSULE_RADIUS, &radius)) {
        return false;
    }
    Ref3 up = spatial_sub(ev->dag, to, from);
    if (is_zero(ev, up)) {
        eval_error_at(ev, object->where, "write sphere { }", "from and to are the same point");
        return false;
    }
    Ref length = spatial_length(ev->dag, up);
    bool is_known = dag_is_const(ev->dag, radius, &r) && dag_is_const(ev->dag, length, &l);
    form->own = axis_map(ev, from, up, radius);
    form->mesh = shared_mesh(ev, OBJECT_CAPSULE, steps, 1, is_known ? r / l : 1);
    if (!is_known) { // the half spheres, a unit high, get their height
        Ref over = op2(ev, OP_MAX, op2(ev, OP_SUB, p_y, one), dag_const(ev->dag, 0));
        Ref under = op2(ev, OP_MIN, p_y, dag_const(ev->dag, 0));
        Ref within = op2(ev, OP_SUB, op2(ev, OP_SUB, p_y, over), under);
        Ref ends = op2(ev, OP_MUL, op2(ev, OP_ADD, over, under), op2(ev, OP_DIV, radius, length));
        form->vertex[0] = dag_input(ev->dag, IN_PX);
        form->vertex[1] = op2(ev, OP_ADD, within, ends);
        form->vertex[2] = dag_input(ev->dag, IN_PZ);
    }
    return !is_known || r > 0;
}

// ---- Rings and discs

static bool torus_form(Eval *ev, const Object *object, uint32_t steps, Form *form) {
    Ref major, minor, one = dag_const(ev->dag, 1);
    double x = 0, y = 0;
    if (!lower_scalar(ev, object, PROPERTY_TORUS_MAJOR, &major) ||
        !lower_scalar(ev, object, PROPERTY_TORUS_MINOR, &minor)) {
        return false;
    }
    bool is_known = dag_is_const(ev->dag, major, &x) && dag_is_const(ev->dag, minor, &y);
    Ref scale = is_known ? dag_const(ev->dag, x > 0 ? x : y) : one;
    form->own = spatial_map_scale(ev->dag, ref3(scale, scale, scale));
    if (is_known && y == 0) {
        return lower_nothing_seen(ev, object); // a circle
    }
    if (is_known) {
        form->mesh = shared_mesh(ev, OBJECT_TORUS, steps, x > 0, x > 0 ? y / x : 1);
        return true;
    }
    // From the ring with radii 1 and 1/2: its tube is at (q - 1, y) where q is the distance from
    // the axis; both are scaled, and q moves along.
    form->mesh = shared_mesh(ev, OBJECT_TORUS, steps, 1, 0.5);
    Ref3 p = rest_inputs(ev);
    Ref q = op2(ev, OP_HYPOT, p.x, p.z), two = op2(ev, OP_MUL, dag_const(ev->dag, 2), minor);
    Ref tube = op2(ev, OP_MUL, op2(ev, OP_SUB, q, one), two);
    Ref grow = op2(ev, OP_DIV, op2(ev, OP_ADD, major, tube), q);
    form->vertex[0] = op2(ev, OP_MUL, p.x, grow);
    form->vertex[1] = op2(ev, OP_MUL, p.y, two);
    form->vertex[2] = op2(ev, OP_MUL, p.z, grow);
    return true;
}

static bool disc_form(Eval *ev, const Object *object, uint32_t steps, Form *form) {
    Ref3 normal;
    Ref radius;
    double r;
    if (!lower_vec3(ev, object, PROPERTY_DISC_NORMAL, &normal) ||
        !lower_scalar(ev, object, PROPERTY_DISC_RADIUS, &radius)) {
        return false;
    }
    if (is_zero(ev, normal)) {
        eval_error_at(ev, object->where, NULL, "the disc has no normal: it is <0, 0, 0>");
        return false;
    }
    form->mesh = shared_mesh(ev, OBJECT_DISC, steps, 1, 0);
    form->own =
        axis_map(ev, spatial_const(ev->dag, 0, 0, 0), spatial_normalize(ev->dag, normal), radius);
    return !dag_is_const(ev->dag, radius, &r) || r > 0 || lower_nothing_seen(ev, object);
}

bool lower_solid_form(Eval *ev, const Object *object, const Place *place, Form *form) {
    uint32_t steps = steps_around(ev, place);
    form->is_mapped = form->is_solid = true;
    bool is_there = object->kind == OBJECT_TORUS     ? torus_form(ev, object, steps, form)
                    : object->kind == OBJECT_DISC    ? disc_form(ev, object, steps, form)
                    : object->kind == OBJECT_CAPSULE ? capsule_form(ev, object, steps, form)
                                                     : frustum_form(ev, object, steps, form);
    memcpy(form->rest, form->vertex, sizeof form->rest);
    return is_there;
}
