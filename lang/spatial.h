// SPDX-License-Identifier: Apache-2.0
// Vectors, rotations and transforms of graph nodes (lang/dag.h): what motions in space are built
// of.
//
// Everything is built by dag_op, so constants fold, and what is built can be differentiated. A
// coefficient that is exactly 0 has no part in a product, whatever it is multiplied with: turning
// about a constant axis of the world costs one sine, one cosine and four products.
//
// Angles are in radians; a positive one turns counter-clockwise when the axis points at the viewer.
#ifndef LANG_SPATIAL_H
#define LANG_SPATIAL_H

#include "lang/dag.h"

typedef struct {
    Ref x, y, z;
} Ref3;

// A rotation: the unit quaternion w + xi + yj + zk. q and -q are one rotation.
typedef struct {
    Ref x, y, z, w;
} RefQuat;

// Rows of an affine map, as Affine of accel/vec.h: a point is mapped by m * (p, 1).
typedef struct {
    Ref m[3][4];
} RefMap;

static inline Ref3 ref3(Ref x, Ref y, Ref z) {
    return (Ref3){x, y, z};
}

Ref3 spatial_const(Dag *dag, double x, double y, double z);
Ref3 spatial_add(Dag *dag, Ref3 a, Ref3 b);
Ref3 spatial_sub(Dag *dag, Ref3 a, Ref3 b);
Ref3 spatial_scale(Dag *dag, Ref3 a, Ref k);
Ref spatial_dot(Dag *dag, Ref3 a, Ref3 b);
Ref3 spatial_cross(Dag *dag, Ref3 a, Ref3 b);
Ref spatial_length(Dag *dag, Ref3 a);
Ref3 spatial_normalize(Dag *dag, Ref3 a); // the zero vector stays zero
Ref3 spatial_select(Dag *dag, Ref condition, Ref3 then, Ref3 otherwise);

// v turned about an axis through the origin (Rodrigues). The axis needs not be unit; an axis that
// is zero turns nothing.
Ref3 spatial_turned(Dag *dag, Ref3 v, Ref3 axis, Ref angle);

RefQuat spatial_quat_identity(Dag *dag);
RefQuat spatial_quat(Dag *dag, Ref3 axis, Ref angle);
RefQuat spatial_quat_mul(Dag *dag, RefQuat a, RefQuat b); // b first, then a
RefQuat spatial_quat_inverse(Dag *dag, RefQuat q);
RefQuat spatial_quat_negate(Dag *dag, RefQuat q);
RefQuat spatial_quat_normalize(Dag *dag, RefQuat q); // zero becomes the identity
Ref spatial_quat_dot(Dag *dag, RefQuat a, RefQuat b);
Ref3 spatial_quat_rotate(Dag *dag, RefQuat q, Ref3 v);
// The axis times half the angle, and back, k times as far.
Ref3 spatial_quat_log(Dag *dag, RefQuat q);
RefQuat spatial_quat_exp(Dag *dag, Ref3 half, Ref k);

// From a (s = 0) to b (s = 1) with constant angular velocity, the shorter way round; goes on
// outside 0..1. Exactly a at s = 0; exactly b or -b at s = 1. Shoemake, "Animating Rotation with
// Quaternion Curves", SIGGRAPH 1985.
RefQuat spatial_slerp(Dag *dag, RefQuat a, RefQuat b, Ref s);

RefMap spatial_map_translate(Dag *dag, Ref3 by);
RefMap spatial_map_scale(Dag *dag, Ref3 by);
RefMap spatial_map_rotate(Dag *dag, Ref3 axis, Ref angle);
RefMap spatial_map_quat(Dag *dag, RefQuat q);
RefMap spatial_map_compose(Dag *dag, const RefMap *outer, const RefMap *inner); // inner first
RefMap spatial_map_pivot(Dag *dag, const RefMap *map,
                         Ref3 pivot);                    // that point's place is the origin
RefMap spatial_map_inverse(Dag *dag, const RefMap *map); // singular: not finite
Ref3 spatial_map_point(Dag *dag, const RefMap *map, Ref3 p);
Ref3 spatial_map_vector(Dag *dag, const RefMap *map, Ref3 v); // without the translation
// For normals: by the cofactors, the inverse transposed times the determinant; not normalised,
// turned to the right side under mirroring when divided by the determinant's sign.
Ref3 spatial_map_normal(Dag *dag, const RefMap *map, Ref3 n);
Ref spatial_map_determinant(Dag *dag, const RefMap *map);

// A map as translation * rotation * scale. Mirroring is a negative scale along x. Shear is lost;
// axes scaled to zero get directions that complete the rotation.
typedef struct {
    Ref3 translation;
    RefQuat rotation;
    Ref3 scale;
} RefParts;

RefParts spatial_map_split(Dag *dag, const RefMap *map);
RefMap spatial_map_join(Dag *dag, const RefParts *parts);

#endif
