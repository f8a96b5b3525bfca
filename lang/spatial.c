// SPDX-License-Identifier: Apache-2.0
// Vectors and rotations as graphs.
#include "lang/spatial.h"

#include <math.h>

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static bool is_zero(const Dag *dag, Ref a) {
    double x;
    return dag_is_const(dag, a, &x) && x == 0;
}

static Ref times(Dag *dag, Ref a, Ref b) {
    if (is_zero(dag, a)) {
        return a;
    }
    return is_zero(dag, b) ? b : op2(dag, OP_MUL, a, b);
}

static Ref plus(Dag *dag, Ref a, Ref b) {
    return op2(dag, OP_ADD, a, b);
}

static Ref minus(Dag *dag, Ref a, Ref b) {
    return op2(dag, OP_SUB, a, b);
}

static Ref number(Dag *dag, double x) {
    return dag_const(dag, x);
}

// --- Vectors ---

Ref3 spatial_const(Dag *dag, double x, double y, double z) {
    return ref3(number(dag, x), number(dag, y), number(dag, z));
}

Ref3 spatial_add(Dag *dag, Ref3 a, Ref3 b) {
    return ref3(plus(dag, a.x, b.x), plus(dag, a.y, b.y), plus(dag, a.z, b.z));
}

Ref3 spatial_sub(Dag *dag, Ref3 a, Ref3 b) {
    return ref3(minus(dag, a.x, b.x), minus(dag, a.y, b.y), minus(dag, a.z, b.z));
}

Ref3 spatial_scale(Dag *dag, Ref3 a, Ref k) {
    return ref3(times(dag, a.x, k), times(dag, a.y, k), times(dag, a.z, k));
}

Ref spatial_dot(Dag *dag, Ref3 a, Ref3 b) {
    Ref xy = plus(dag, times(dag, a.x, b.x), times(dag, a.y, b.y));
    return plus(dag, xy, times(dag, a.z, b.z));
}

static Ref cross2(Dag *dag, Ref a, Ref b, Ref c, Ref d) {
    return minus(dag, times(dag, a, b), times(dag, c, d));
}

Ref3 spatial_cross(Dag *dag, Ref3 a, Ref3 b) {
    return ref3(cross2(dag, a.y, b.z, a.z, b.y), cross2(dag, a.z, b.x, a.x, b.z),
                cross2(dag, a.x, b.y, a.y, b.x));
}

Ref spatial_length(Dag *dag, Ref3 a) {
    const Ref part[3] = {a.x, a.y, a.z};
    for (int k = 0; k < 3; k++) { // along an axis: no square, no root
        if (is_zero(dag, part[(k + 1) % 3]) && is_zero(dag, part[(k + 2) % 3])) {
            return op1(dag, OP_ABS, part[k]);
        }
    }
    return op1(dag, OP_SQRT, spatial_dot(dag, a, a));
}

static Ref one_if_zero(Dag *dag, Ref a) {
    Ref condition = op2(dag, OP_EQ, a, number(dag, 0));
    return dag_op(dag, OP_SELECT, condition, number(dag, 1), a);
}

static Ref3 divided(Dag *dag, Ref3 a, Ref by) {
    return ref3(op2(dag, OP_DIV, a.x, by), op2(dag, OP_DIV, a.y, by), op2(dag, OP_DIV, a.z, by));
}

static bool is_const3(const Dag *dag, Ref3 a, double v[3]) {
    return dag_is_const(dag, a.x, &v[0]) && dag_is_const(dag, a.y, &v[1]) &&
           dag_is_const(dag, a.z, &v[2]);
}

// Constants are scaled by a power of two first, so that no square leaves the range.
static Ref3 tamed(Dag *dag, Ref3 a) {
    double v[3];
    if (!is_const3(dag, a, v)) {
        return a;
    }
    double most = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    int exponent;
    frexp(most, &exponent);
    if (!isfinite(most) || most == 0) {
        return a;
    }
    return spatial_const(dag, ldexp(v[0], -exponent), ldexp(v[1], -exponent),
                         ldexp(v[2], -exponent));
}

Ref3 spatial_normalize(Dag *dag, Ref3 a) {
    a = tamed(dag, a);
    return divided(dag, a, one_if_zero(dag, spatial_length(dag, a)));
}

Ref3 spatial_select(Dag *dag, Ref condition, Ref3 then, Ref3 otherwise) {
    return ref3(dag_op(dag, OP_SELECT, condition, then.x, otherwise.x),
                dag_op(dag, OP_SELECT, condition, then.y, otherwise.y),
                dag_op(dag, OP_SELECT, condition, then.z, otherwise.z));
}

// --- Turning ---

// The index of the only part of a constant axis that is not zero, its sign in *sign; -1: none such.
static int world_axis(const Dag *dag, Ref3 axis, double *sign) {
    double v[3];
    int found = -1;
    if (!is_const3(dag, axis, v)) {
        return -1;
    }
    for (int k = 0; k < 3; k++) {
        if (v[k] != 0) {
            if (found >= 0 || isnan(v[k])) {
                return -1;
            }
            found = k;
            *sign = v[k] < 0 ? -1 : 1;
        }
    }
    return found;
}

static Ref3 turned_about_world_axis(Dag *dag, Ref3 v, int k, Ref sine, Ref cosine) {
    Ref out[3] = {v.x, v.y, v.z};
    Ref a = out[(k + 1) % 3], b = out[(k + 2) % 3];
    out[(k + 1) % 3] = minus(dag, times(dag, a, cosine), times(dag, b, sine));
    out[(k + 2) % 3] = plus(dag, times(dag, a, sine), times(dag, b, cosine));
    return ref3(out[0], out[1], out[2]);
}

Ref3 spatial_turned(Dag *dag, Ref3 v, Ref3 axis, Ref angle) {
    Ref sine = op1(dag, OP_SIN, angle), cosine = op1(dag, OP_COS, angle);
    double sign;
    int k = world_axis(dag, axis, &sign);
    if (k >= 0) {
        sine = sign < 0 ? op1(dag, OP_NEG, sine) : sine;
        return turned_about_world_axis(dag, v, k, sine, cosine);
    }
    Ref3 unit = spatial_normalize(dag, axis);
    Ref3 along = spatial_scale(dag, unit, spatial_dot(dag, unit, v));
    Ref3 across = spatial_sub(dag, v, along);
    Ref3 swept = spatial_scale(dag, spatial_cross(dag, unit, v), sine);
    Ref3 turned = spatial_add(dag, along, spatial_scale(dag, across, cosine));
    turned = spatial_add(dag, turned, swept);
    Ref is_null = op2(dag, OP_EQ, spatial_dot(dag, unit, unit), number(dag, 0));
    return spatial_select(dag, is_null, v, turned);
}

// --- Quaternions ---

RefQuat spatial_quat_identity(Dag *dag) {
    Ref zero = number(dag, 0);
    return (RefQuat){zero, zero, zero, number(dag, 1)};
}

static RefQuat quat_of(Ref3 v, Ref w) {
    return (RefQuat){v.x, v.y, v.z, w};
}

static Ref3 vector_of(RefQuat q) {
    return ref3(q.x, q.y, q.z);
}

RefQuat spatial_quat(Dag *dag, Ref3 axis, Ref angle) {
    Ref half = op2(dag, OP_MUL, angle, number(dag, 0.5));
    Ref3 unit = spatial_normalize(dag, axis);
    Ref is_null = op2(dag, OP_EQ, spatial_dot(dag, unit, unit), number(dag, 0));
    Ref w = dag_op(dag, OP_SELECT, is_null, number(dag, 1), op1(dag, OP_COS, half));
    return quat_of(spatial_scale(dag, unit, op1(dag, OP_SIN, half)), w);
}

RefQuat spatial_quat_mul(Dag *dag, RefQuat a, RefQuat b) {
    Ref3 va = vector_of(a), vb = vector_of(b);
    Ref3 sum = spatial_add(dag, spatial_scale(dag, vb, a.w), spatial_scale(dag, va, b.w));
    Ref w = minus(dag, times(dag, a.w, b.w), spatial_dot(dag, va, vb));
    return quat_of(spatial_add(dag, sum, spatial_cross(dag, va, vb)), w);
}

RefQuat spatial_quat_inverse(Dag *dag, RefQuat q) {
    return (RefQuat){op1(dag, OP_NEG, q.x), op1(dag, OP_NEG, q.y), op1(dag, OP_NEG, q.z), q.w};
}

RefQuat spatial_quat_negate(Dag *dag, RefQuat q) {
    RefQuat r = spatial_quat_inverse(dag, q);
    r.w = op1(dag, OP_NEG, q.w);
    return r;
}

Ref spatial_quat_dot(Dag *dag, RefQuat a, RefQuat b) {
    return plus(dag, spatial_dot(dag, vector_of(a), vector_of(b)), times(dag, a.w, b.w));
}

static Ref quat_length(Dag *dag, RefQuat q) {
    return op1(dag, OP_SQRT, spatial_quat_dot(dag, q, q));
}

RefQuat spatial_quat_normalize(Dag *dag, RefQuat q) {
    Ref length = quat_length(dag, q);
    Ref is_null = op2(dag, OP_EQ, length, number(dag, 0));
    length = one_if_zero(dag, length);
    Ref w = dag_op(dag, OP_SELECT, is_null, number(dag, 1), op2(dag, OP_DIV, q.w, length));
    return quat_of(divided(dag, vector_of(q), length), w);
}

// v + w t + u x t, where u + w is q and t = 2 u x v.
Ref3 spatial_quat_rotate(Dag *dag, RefQuat q, Ref3 v) {
    Ref3 u = vector_of(q);
    Ref3 t = spatial_scale(dag, spatial_cross(dag, u, v), number(dag, 2));
    Ref3 sum = spatial_add(dag, v, spatial_scale(dag, t, q.w));
    return spatial_add(dag, sum, spatial_cross(dag, u, t));
}

Ref3 spatial_quat_log(Dag *dag, RefQuat q) {
    Ref sine = spatial_length(dag, vector_of(q));
    Ref half = op2(dag, OP_ATAN2, sine, q.w);
    Ref3 unit = divided(dag, vector_of(q), one_if_zero(dag, sine));
    return spatial_scale(dag, unit, half);
}

RefQuat spatial_quat_exp(Dag *dag, Ref3 half, Ref k) {
    Ref size = spatial_length(dag, half);
    Ref3 unit = divided(dag, half, one_if_zero(dag, size));
    Ref angle = op2(dag, OP_MUL, size, k);
    return quat_of(spatial_scale(dag, unit, op1(dag, OP_SIN, angle)), op1(dag, OP_COS, angle));
}

static RefQuat quat_combine(Dag *dag, RefQuat a, Ref ka, RefQuat b, Ref kb) {
    Ref3 v = spatial_add(dag, spatial_scale(dag, vector_of(a), ka),
                         spatial_scale(dag, vector_of(b), kb));
    return quat_of(v, plus(dag, times(dag, a.w, ka), times(dag, b.w, kb)));
}

// The weights sin((1-s)x)/sin(x) and sin(sx)/sin(x) depend on the angle x only from its square on:
// a hair added to x in quadrature keeps them finite at x = 0 and changes no digit elsewhere.
static const double hair = 1e-8;

static RefQuat slerp(Dag *dag, RefQuat a, RefQuat b, Ref s) {
    Ref one = number(dag, 1), minus_one = number(dag, -1);
    // Between unit vectors; accurate at both ends, unlike the arc cosine of the product.
    Ref apart = quat_length(dag, quat_combine(dag, a, one, b, minus_one));
    Ref together = quat_length(dag, quat_combine(dag, a, one, b, one));
    Ref angle = times(dag, number(dag, 2), op2(dag, OP_ATAN2, apart, together));
    angle = op2(dag, OP_HYPOT, angle, number(dag, hair));
    Ref sine = op1(dag, OP_SIN, angle);
    Ref ka = op1(dag, OP_SIN, times(dag, minus(dag, one, s), angle));
    Ref kb = op1(dag, OP_SIN, times(dag, s, angle));
    return quat_combine(dag, a, op2(dag, OP_DIV, ka, sine), b, op2(dag, OP_DIV, kb, sine));
}

RefQuat spatial_slerp(Dag *dag, RefQuat a, RefQuat b, Ref s) {
    Ref is_far = op2(dag, OP_LT, spatial_quat_dot(dag, a, b), number(dag, 0));
    RefQuat other = spatial_quat_negate(dag, b);
    Ref3 v = spatial_select(dag, is_far, vector_of(other), vector_of(b));
    Ref w = dag_op(dag, OP_SELECT, is_far, other.w, b.w);
    return slerp(dag, a, quat_of(v, w), s);
}
