// SPDX-License-Identifier: Apache-2.0
// Vectors and affine maps: Vec3 (double) for scenes, Vec3f (float) for the kernels.
#ifndef ACCEL_VEC_H
#define ACCEL_VEC_H

#include <math.h>
#include <stdbool.h>

typedef struct {
    double x, y, z;
} Vec3;

typedef struct {
    float x, y, z;
} Vec3f;

// Rows of a 3x4 matrix: a point is mapped by m * (p, 1), a direction by the 3x3 part alone.
typedef struct {
    double m[3][4];
} Affine;

static inline Vec3 vec3(double x, double y, double z) {
    return (Vec3){x, y, z};
}

static inline Vec3 vec3_add(Vec3 a, Vec3 b) {
    return (Vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vec3 vec3_sub(Vec3 a, Vec3 b) {
    return (Vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vec3 vec3_mul(Vec3 a, Vec3 b) {
    return (Vec3){a.x * b.x, a.y * b.y, a.z * b.z};
}

static inline Vec3 vec3_scale(Vec3 a, double s) {
    return (Vec3){a.x * s, a.y * s, a.z * s};
}

// a + s*b
static inline Vec3 vec3_madd(Vec3 a, double s, Vec3 b) {
    return (Vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline double vec3_dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec3 vec3_cross(Vec3 a, Vec3 b) {
    return (Vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_length(Vec3 a) {
    return sqrt(vec3_dot(a, a));
}

// The zero vector stays zero.
static inline Vec3 vec3_normalize(Vec3 a) {
    double l = vec3_length(a);
    return l > 0 ? vec3_scale(a, 1 / l) : a;
}

static inline bool vec3_is_finite(Vec3 a) {
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline Affine affine_identity(void) {
    return (Affine){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
}

static inline Vec3 affine_point(const Affine *a, Vec3 p) {
    return (Vec3){a->m[0][0] * p.x + a->m[0][1] * p.y + a->m[0][2] * p.z + a->m[0][3],
                  a->m[1][0] * p.x + a->m[1][1] * p.y + a->m[1][2] * p.z + a->m[1][3],
                  a->m[2][0] * p.x + a->m[2][1] * p.y + a->m[2][2] * p.z + a->m[2][3]};
}

static inline Vec3 affine_vector(const Affine *a, Vec3 v) {
    return (Vec3){a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
                  a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
                  a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z};
}

// Maps a normal by the transpose of the 3x3 part of inv, the inverse of the points' map.
static inline Vec3 affine_normal(const Affine *inv, Vec3 n) {
    return (Vec3){inv->m[0][0] * n.x + inv->m[1][0] * n.y + inv->m[2][0] * n.z,
                  inv->m[0][1] * n.x + inv->m[1][1] * n.y + inv->m[2][1] * n.z,
                  inv->m[0][2] * n.x + inv->m[1][2] * n.y + inv->m[2][2] * n.z};
}

static inline double affine_det(const Affine *a) {
    return a->m[0][0] * (a->m[1][1] * a->m[2][2] - a->m[1][2] * a->m[2][1]) -
           a->m[0][1] * (a->m[1][0] * a->m[2][2] - a->m[1][2] * a->m[2][0]) +
           a->m[0][2] * (a->m[1][0] * a->m[2][1] - a->m[1][1] * a->m[2][0]);
}

// a after b
// Largest stretch of a map, from above: its Frobenius norm.
static inline double affine_stretch(const Affine *a) {
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            sum += a->m[i][j] * a->m[i][j];
        }
    }
    return sqrt(sum);
}

static inline Affine affine_mul(const Affine *a, const Affine *b) {
    Affine r;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            r.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] +
                        a->m[i][2] * b->m[2][j] + (j == 3 ? a->m[i][3] : 0);
        }
    }
    return r;
}

// False (and *out untouched) where the map is singular or not finite.
static inline bool affine_invert(const Affine *a, Affine *out) {
    double det = affine_det(a), r = 1 / det;
    if (!isfinite(r) || det == 0) {
        return false;
    }
    const double(*m)[4] = a->m;
    Affine v = {
        {{(m[1][1] * m[2][2] - m[1][2] * m[2][1]) * r, (m[0][2] * m[2][1] - m[0][1] * m[2][2]) * r,
          (m[0][1] * m[1][2] - m[0][2] * m[1][1]) * r, 0},
         {(m[1][2] * m[2][0] - m[1][0] * m[2][2]) * r, (m[0][0] * m[2][2] - m[0][2] * m[2][0]) * r,
          (m[0][2] * m[1][0] - m[0][0] * m[1][2]) * r, 0},
         {(m[1][0] * m[2][1] - m[1][1] * m[2][0]) * r, (m[0][1] * m[2][0] - m[0][0] * m[2][1]) * r,
          (m[0][0] * m[1][1] - m[0][1] * m[1][0]) * r, 0}}};
    for (int i = 0; i < 3; i++) {
        v.m[i][3] = -(v.m[i][0] * m[0][3] + v.m[i][1] * m[1][3] + v.m[i][2] * m[2][3]);
    }
    *out = v;
    return true;
}

#endif
