// SPDX-License-Identifier: Apache-2.0
// Rays made ready for the kernels: checked, scaled, sheared.
#include "accel/ray_state.h"

#include <math.h>

// Beyond this nothing is hit: it keeps products of distances clear of infinity.
static const float T_LIMIT = 1e37f;

static bool is_valid(const Geometry *geometry, const AccelRay *ray) {
    uint32_t n_spans = geometry->n_keys > 1 ? geometry->n_keys - 1 : 1;
    bool finite = isfinite(ray->tmin);
    for (int i = 0; i < 3; i++) {
        finite = finite && isfinite(ray->origin[i]) && isfinite(ray->dir[i]);
    }
    return finite && ray->tmin <= ray->tmax && ray->f >= 0 && ray->f <= 1 && ray->key < n_spans;
}

static float clamp_distance(float t) {
    return t > T_LIMIT ? T_LIMIT : t < -T_LIMIT ? -T_LIMIT : t;
}

// Directions from 2^-20 to 2^20 are taken as they are; others by a power of two, which is exact,
// so that nothing overflows or gets lost. Denormal ones are scaled by 2^127 only, which leaves them
// a little shorter and keeps the power back a float.
static bool scale_direction(const AccelRay *ray, RayState *state) {
    float largest = fmaxf(fabsf(ray->dir[0]), fmaxf(fabsf(ray->dir[1]), fabsf(ray->dir[2])));
    if (!(largest > 0)) {
        return false;
    }
    int e = 0;
    if (largest < 0x1p-20f || largest > 0x1p20f) {
        frexpf(largest, &e);
        e = e < -127 ? -127 : e;
    }
    for (int i = 0; i < 3; i++) {
        state->o[i] = ray->origin[i];
        state->d[i] = e ? ldexpf(ray->dir[i], -e) : ray->dir[i];
    }
    // Clamped before as well: distances along the caller's ray must not overflow either.
    float tn = clamp_distance(ray->tmin), tf = clamp_distance(ray->tmax);
    state->tn = e ? clamp_distance(ldexpf(tn, e)) : tn;
    state->tf = e ? clamp_distance(ldexpf(tf, e)) : tf;
    state->unscale = e ? ldexpf(1, -e) : 1;
    return true;
}

bool ray_prepare(const Geometry *geometry, const AccelRay *ray, RayState *state) {
    if (!is_valid(geometry, ray) || !scale_direction(ray, state)) {
        return false;
    }
    state->f = ray->f;
    state->tick = accel_tick(ray->key, ray->f);
    ray_set_shear(state);
    ray_set_keys(state, geometry, ray->key);
    return true;
}
