// SPDX-License-Identifier: Apache-2.0
// An object's frame: the way from the scene's doubles to the kernels' floats.
#include "accel/frame.h"

#include <string.h>

// Local units; origins within are used as they are.
static const double FAR_ORIGIN = 4;
// From within this one step to the object is exact enough.
static const double NEAR_ENOUGH = 0x1p20;
// Exponents of the scale are kept so far from double's own limits that products cannot overflow.
enum { EXPONENT_LIMIT = 500 };

static double power_below(double x) {
    int e;
    frexp(x, &e);
    e = e > EXPONENT_LIMIT ? EXPONENT_LIMIT : e < -EXPONENT_LIMIT ? -EXPONENT_LIMIT : e;
    return ldexp(1, -e);
}

static double largest_of(Vec3 a) {
    double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z), larger = x > y ? x : y;
    return z > larger ? z : larger;
}

// 2^-e for the e of frexp(): what is multiplied by it comes out as from ldexp(). False: x is tiny
// or huge. Without a call, since this is asked for every ray and every object.
static bool inverse_power(double x, double *factor) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int power = (int)(bits >> 52 & 0x7ff) - 1022;
    if (power < -EXPONENT_LIMIT || power > EXPONENT_LIMIT) {
        return false;
    }
    bits = (uint64_t)(1023 - power) << 52;
    memcpy(factor, &bits, sizeof *factor);
    return true;
}

Frame frame_from_box(Vec3 lo, Vec3 hi) {
    Vec3 extent = vec3_sub(hi, lo);
    Vec3 center = vec3_madd(lo, 0.5, extent);
    bool valid = extent.x >= 0 && extent.y >= 0 && extent.z >= 0 && vec3_is_finite(extent) &&
                 vec3_is_finite(center);
    if (!valid) {
        return (Frame){{0, 0, 0}, 1};
    }
    double largest = largest_of(extent);
    return (Frame){{center.x, center.y, center.z}, largest > 0 ? power_below(largest) : 1};
}

// Moves *o along d to where it is nearest to 0; the distance moved. The first step leaves an error
// of 2^-53 of the distance along the ray, which a second and a third take away; from near enough
// it is nothing beside the rounding to float.
static double advance(Vec3 *o, Vec3 d, double far) {
    double moved = 0, dd = vec3_dot(d, d);
    for (int i = 0; i < (far > NEAR_ENOUGH ? 3 : 1); i++) {
        double step = -vec3_dot(*o, d) / dd;
        *o = vec3(fma(step, d.x, o->x), fma(step, d.y, o->y), fma(step, d.z, o->z));
        moved += step;
    }
    return moved;
}

static float to_distance(double t, FrameDistance distance) {
    double local = (t - distance.base) / distance.unit;
    local = local > -1e37 ? local : -1e37;
    return (float)(local < 1e37 ? local : 1e37);
}

bool frame_ray(const Frame *frame, Vec3 origin, Vec3 dir, double tmin, double tmax, AccelRay *ray,
               FrameDistance *distance) {
    const double *c = frame->center;
    Vec3 o = vec3_scale(vec3_sub(origin, vec3(c[0], c[1], c[2])), frame->scale);
    double largest = largest_of(dir);
    if (!vec3_is_finite(o) || !vec3_is_finite(dir) || !(largest > 0) || isnan(tmin) ||
        isnan(tmax)) {
        return false;
    }
    // A power of two, so the direction keeps its bits and its largest component is in [0.5, 1).
    double factor, unit;
    Vec3 d;
    if (inverse_power(largest, &factor)) {
        d = vec3_scale(dir, factor);
        unit = factor / frame->scale;
    } else {
        int e;
        frexp(largest, &e);
        d = vec3(ldexp(dir.x, -e), ldexp(dir.y, -e), ldexp(dir.z, -e));
        unit = ldexp(1 / frame->scale, -e);
    }
    double far = largest_of(o), moved = far > FAR_ORIGIN ? advance(&o, d, far) : 0;
    *distance = (FrameDistance){moved * unit, unit};
    if (!isfinite(moved * unit) || !isfinite(unit) || !(unit > 0) || !vec3_is_finite(o)) {
        return false;
    }
    ray->origin[0] = (float)o.x, ray->origin[1] = (float)o.y, ray->origin[2] = (float)o.z;
    ray->dir[0] = (float)d.x, ray->dir[1] = (float)d.y, ray->dir[2] = (float)d.z;
    ray->tmin = to_distance(tmin, *distance);
    ray->tmax = to_distance(tmax, *distance);
    return true;
}
