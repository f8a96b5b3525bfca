// SPDX-License-Identifier: Apache-2.0
// Affine maps as graphs: composition, inverse, parts.
#include "lang/spatial.h"

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref3 row(const RefMap *map, int i) {
    return ref3(map->m[i][0], map->m[i][1], map->m[i][2]);
}

static Ref3 column(const RefMap *map, int j) {
    return ref3(map->m[0][j], map->m[1][j], map->m[2][j]);
}

static void set_column(RefMap *map, int j, Ref3 v) {
    map->m[0][j] = v.x;
    map->m[1][j] = v.y;
    map->m[2][j] = v.z;
}

static RefMap from_columns(Ref3 x, Ref3 y, Ref3 z, Ref3 translation) {
    RefMap map;
    set_column(&map, 0, x);
    set_column(&map, 1, y);
    set_column(&map, 2, z);
    set_column(&map, 3, translation);
    return map;
}

static Ref3 unit(Dag *dag, int k) {
    return spatial_const(dag, k == 0, k == 1, k == 2);
}

RefMap spatial_map_translate(Dag *dag, Ref3 by) {
    return from_columns(unit(dag, 0), unit(dag, 1), unit(dag, 2), by);
}

RefMap spatial_map_scale(Dag *dag, Ref3 by) {
    return from_columns(spatial_scale(dag, unit(dag, 0), by.x),
                        spatial_scale(dag, unit(dag, 1), by.y),
                        spatial_scale(dag, unit(dag, 2), by.z), spatial_const(dag, 0, 0, 0));
}

RefMap spatial_map_rotate(Dag *dag, Ref3 axis, Ref angle) {
    return from_columns(spatial_turned(dag, unit(dag, 0), axis, angle),
                        spatial_turned(dag, unit(dag, 1), axis, angle),
                        spatial_turned(dag, unit(dag, 2), axis, angle),
                        spatial_const(dag, 0, 0, 0));
}

RefMap spatial_map_quat(Dag *dag, RefQuat q) {
    return from_columns(spatial_quat_rotate(dag, q, unit(dag, 0)),
                        spatial_quat_rotate(dag, q, unit(dag, 1)),
                        spatial_quat_rotate(dag, q, unit(dag, 2)), spatial_const(dag, 0, 0, 0));
}

Ref3 spatial_map_vector(Dag *dag, const RefMap *map, Ref3 v) {
    return ref3(spatial_dot(dag, row(map, 0), v), spatial_dot(dag, row(map, 1), v),
                spatial_dot(dag, row(map, 2), v));
}

Ref3 spatial_map_point(Dag *dag, const RefMap *map, Ref3 p) {
    return spatial_add(dag, spatial_map_vector(dag, map, p), column(map, 3));
}

RefMap spatial_map_compose(Dag *dag, const RefMap *outer, const RefMap *inner) {
    return from_columns(spatial_map_vector(dag, outer, column(inner, 0)),
                        spatial_map_vector(dag, outer, column(inner, 1)),
                        spatial_map_vector(dag, outer, column(inner, 2)),
                        spatial_map_point(dag, outer, column(inner, 3)));
}

RefMap spatial_map_pivot(Dag *dag, const RefMap *map, Ref3 pivot) {
    RefMap result = *map;
    Ref3 moved = spatial_sub(dag, pivot, spatial_map_vector(dag, map, pivot));
    set_column(&result, 3, spatial_add(dag, column(map, 3), moved));
    return result;
}

// Columns of the matrix of cofactors: the inverse transposed, times the determinant.
static void cofactors(Dag *dag, const RefMap *map, Ref3 out[3]) {
    for (int j = 0; j < 3; j++) {
        out[j] = spatial_cross(dag, column(map, (j + 1) % 3), column(map, (j + 2) % 3));
    }
}

Ref spatial_map_determinant(Dag *dag, const RefMap *map) {
    Ref3 c[3];
    cofactors(dag, map, c);
    return spatial_dot(dag, column(map, 0), c[0]);
}

Ref3 spatial_map_normal(Dag *dag, const RefMap *map, Ref3 n) {
    Ref3 c[3];
    cofactors(dag, map, c);
    Ref3 sum = spatial_add(dag, spatial_scale(dag, c[0], n.x), spatial_scale(dag, c[1], n.y));
    return spatial_add(dag, sum, spatial_scale(dag, c[2], n.z));
}

static Ref over(Dag *dag, Ref a, Ref b) {
    double x;
    return dag_is_const(dag, a, &x) && x == 0 ? a : op2(dag, OP_DIV, a, b);
}

RefMap spatial_map_inverse(Dag *dag, const RefMap *map) {
    Ref3 c[3];
    cofactors(dag, map, c);
    Ref determinant = spatial_map_determinant(dag, map);
    RefMap inverse;
    for (int i = 0; i < 3; i++) { // the cofactors' columns are the inverse's rows
        const Ref part[3] = {c[i].x, c[i].y, c[i].z};
        for (int j = 0; j < 3; j++) {
            inverse.m[i][j] = over(dag, part[j], determinant);
        }
    }
    set_column(&inverse, 3, spatial_const(dag, 0, 0, 0));
    Ref3 moved = spatial_map_vector(dag, &inverse, column(map, 3));
    set_column(&inverse, 3, spatial_sub(dag, spatial_const(dag, 0, 0, 0), moved));
    return inverse;
}

// --- Parts ---

static Ref is_zero3(Dag *dag, Ref3 v) {
    return op2(dag, OP_EQ, spatial_dot(dag, v, v), dag_const(dag, 0));
}

// The unit vector across a and b, or what stands in for it where they are parallel.
static Ref3 across(Dag *dag, Ref3 a, Ref3 b, Ref3 otherwise) {
    Ref3 v = spatial_normalize(dag, spatial_cross(dag, a, b));
    return spatial_select(dag, is_zero3(dag, v), otherwise, v);
}

// Orthonormal and right-handed: x as it is, y across it, z across both. Where columns vanish, by
// what remains and the nearest axes of the world: a map to a point has no rotation.
static void orthonormal(Dag *dag, const RefMap *map, Ref3 axis[3]) {
    Ref3 world[3], given[3];
    for (int k = 0; k < 3; k++) {
        world[k] = unit(dag, k);
        given[k] = spatial_normalize(dag, column(map, k));
    }
    Ref has_no_y = is_zero3(dag, given[1]), has_no_z = is_zero3(dag, given[2]);
    Ref3 y = spatial_select(dag, has_no_y, world[1], given[1]);
    Ref3 z = spatial_select(dag, has_no_z, world[2], given[2]);
    Ref3 x = across(dag, y, z, world[0]);
    x = spatial_select(dag, is_zero3(dag, given[0]), x, given[0]);

    Ref3 from_z = across(dag, z, x, world[1]);
    Ref3 inside = spatial_scale(dag, x, spatial_dot(dag, x, given[1]));
    y = spatial_normalize(dag, spatial_sub(dag, given[1], inside));
    y = spatial_select(dag, is_zero3(dag, y), from_z, y);
    axis[0] = x;
    axis[1] = y;
    axis[2] = spatial_cross(dag, x, y);
}

// Each of the four squares 4w^2, 4x^2... from the diagonal; the largest one rules (Shepperd,
// "Quaternion from Rotation Matrix", J. Guidance and Control 1(3), 1978).
static RefQuat quat_of_axes(Dag *dag, const Ref3 axis[3]) {
    Ref3 x = axis[0], y = axis[1], z = axis[2];
    Ref one = dag_const(dag, 1);
#define ADD(a, b) op2(dag, OP_ADD, a, b)
#define SUB(a, b) op2(dag, OP_SUB, a, b)
    Ref square[4] = {ADD(SUB(SUB(one, y.y), z.z), x.x), ADD(SUB(SUB(one, z.z), x.x), y.y),
                     ADD(SUB(SUB(one, x.x), y.y), z.z), ADD(ADD(ADD(one, x.x), y.y), z.z)};
    RefQuat candidate[4] = {
        {square[0], ADD(x.y, y.x), ADD(z.x, x.z), SUB(y.z, z.y)},
        {ADD(x.y, y.x), square[1], ADD(y.z, z.y), SUB(z.x, x.z)},
        {ADD(z.x, x.z), ADD(y.z, z.y), square[2], SUB(x.y, y.x)},
        {SUB(y.z, z.y), SUB(z.x, x.z), SUB(x.y, y.x), square[3]},
    };
#undef ADD
#undef SUB
    RefQuat best = candidate[3];
    Ref most = square[3];
    for (int k = 0; k < 3; k++) {
        Ref is_more = op2(dag, OP_LT, most, square[k]);
        Ref *to[4] = {&best.x, &best.y, &best.z, &best.w};
        const Ref part[4] = {candidate[k].x, candidate[k].y, candidate[k].z, candidate[k].w};
        for (int i = 0; i < 4; i++) {
            *to[i] = dag_op(dag, OP_SELECT, is_more, part[i], *to[i]);
        }
        most = dag_op(dag, OP_SELECT, is_more, square[k], most);
    }
    return spatial_quat_normalize(dag, best);
}

RefParts spatial_map_split(Dag *dag, const RefMap *map) {
    RefMap right = *map; // not mirrored
    Ref is_mirrored = op2(dag, OP_LT, spatial_map_determinant(dag, map), dag_const(dag, 0));
    Ref3 x = column(map, 0);
    Ref3 opposite = spatial_sub(dag, spatial_const(dag, 0, 0, 0), x);
    set_column(&right, 0, spatial_select(dag, is_mirrored, opposite, x));
    Ref3 axis[3];
    orthonormal(dag, &right, axis);
    RefParts parts = {.translation = column(map, 3), .rotation = quat_of_axes(dag, axis)};
    // Along the axes themselves, so that shear does not lengthen.
    parts.scale = ref3(spatial_dot(dag, axis[0], x), spatial_dot(dag, axis[1], column(map, 1)),
                       spatial_dot(dag, axis[2], column(map, 2)));
    return parts;
}

RefMap spatial_map_join(Dag *dag, const RefParts *parts) {
    RefMap map = spatial_map_quat(dag, parts->rotation);
    set_column(&map, 0, spatial_scale(dag, column(&map, 0), parts->scale.x));
    set_column(&map, 1, spatial_scale(dag, column(&map, 1), parts->scale.y));
    set_column(&map, 2, spatial_scale(dag, column(&map, 2), parts->scale.z));
    set_column(&map, 3, parts->translation);
    return map;
}
