// SPDX-License-Identifier: Apache-2.0
// Rays made ready for the kernels (accel/intersect.h).
#ifndef ACCEL_RAY_STATE_H
#define ACCEL_RAY_STATE_H

#include <stddef.h>

#include "accel/accel.h"

// A ray made ready: direction scaled by a power of two into the range of the kernels, the shear
// along its dominant axis, the two keys that it lies between.
typedef struct {
    float o[3], d[3];
    float sx, sy, sz; // shear of axes kx, ky along kz, and 1 / d[kz]
    int kx, ky, kz;
    float tn, tf; // the interval asked for, open at tn; scaled like d
    float f;
    float unscale; // distances along the caller's ray are t * unscale
    uint32_t tick;
    const float *a, *b;   // positions at the keys before and after
    const float *ra, *rb; // radii, spheres only
} RayState;

// False: the ray is not valid, hits nothing.
bool ray_prepare(const Geometry *geometry, const AccelRay *ray, RayState *state);

// What triangles ask of a ray, from its direction.
static inline void ray_set_shear(RayState *state) {
    static const uint8_t next[3] = {1, 2, 0}, last[3] = {2, 0, 1};
    const float *d = state->d;
    float x = __builtin_fabsf(d[0]), y = __builtin_fabsf(d[1]), z = __builtin_fabsf(d[2]);
    float larger = x > y ? x : y;
    int kz = (int)(z > larger) << 1 | (int)((x <= y) & (z <= larger));
    state->kz = kz;
    state->kx = next[kz];
    state->ky = last[kz];
    state->sx = d[state->kx] / d[kz];
    state->sy = d[state->ky] / d[kz];
    state->sz = 1 / d[kz];
}

// Where positions and radii at its two keys are.
static inline void ray_set_keys(RayState *state, const Geometry *geometry, uint32_t key) {
    size_t n = geometry->n_vertices, before = n * key;
    size_t after = geometry->n_keys > 1 ? before + n : before;
    state->a = geometry->position + 3 * before;
    state->b = geometry->position + 3 * after;
    state->ra = geometry->radius ? geometry->radius + before : NULL;
    state->rb = geometry->radius ? geometry->radius + after : NULL;
}

#endif
