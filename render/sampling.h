// SPDX-License-Identifier: Apache-2.0
// Directions from pairs of uniform numbers, with the same bits on every processor.
#ifndef RENDER_SAMPLING_H
#define RENDER_SAMPLING_H

#include "accel/vec.h"

#define SAMPLING_PI 3.141592653589793

// Sine and cosine of u turns, |u| < 2^20, by their Taylor series within an eighth of a turn: good
// to
// 2 ulp of 1. Not libm's, whose last bits depend on the processor.
static inline void sampling_turn(double u, double *sine, double *cosine) {
    double quarter = rint(4 * u);
    double x = (4 * u - quarter) * (SAMPLING_PI / 2), x2 = x * x;
    double s = -1.0 / 1307674368000, c = 1.0 / 20922789888000;
    s = s * x2 + 1.0 / 6227020800;
    s = s * x2 - 1.0 / 39916800;
    s = s * x2 + 1.0 / 362880;
    s = s * x2 - 1.0 / 5040;
    s = s * x2 + 1.0 / 120;
    s = s * x2 - 1.0 / 6;
    s = x + x * x2 * s;
    c = c * x2 - 1.0 / 87178291200;
    c = c * x2 + 1.0 / 479001600;
    c = c * x2 - 1.0 / 3628800;
    c = c * x2 + 1.0 / 40320;
    c = c * x2 - 1.0 / 720;
    c = c * x2 + 1.0 / 24;
    c = c * x2 - 0.5;
    c = 1 + c * x2;
    int turn = (int)quarter & 3;
    *sine = turn == 0 ? s : turn == 1 ? c : turn == 2 ? -s : -c;
    *cosine = turn == 0 ? c : turn == 1 ? -s : turn == 2 ? -c : s;
}

// Two axes that make a right-handed frame with the unit vector n (Duff et al., "Building an
// orthonormal basis, revisited", JCGT 2017).
static inline void sampling_frame(Vec3 n, Vec3 *x, Vec3 *y) {
    double sign = copysign(1, n.z);
    double a = -1 / (sign + n.z), b = n.x * n.y * a;
    *x = vec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    *y = vec3(b, sign + n.y * n.y * a, -n.y);
}

static inline Vec3 sampling_to_world(Vec3 x, Vec3 y, Vec3 z, Vec3 local) {
    return vec3_madd(vec3_madd(vec3_scale(x, local.x), local.y, y), local.z, z);
}

// With density cos / pi around +z.
static inline Vec3 sampling_cosine(double u, double v) {
    double sine, cosine, r = sqrt(u);
    sampling_turn(v, &sine, &cosine);
    return vec3(r * cosine, r * sine, sqrt(1 - u));
}

// Uniform in the cone around +z whose half angle has 1 - cos = spread: density 1 / (2 pi spread).
// Right for cones of any width.
static inline Vec3 sampling_cone(double spread, double u, double v) {
    double sine, cosine, down = u * spread, r = sqrt(down * (2 - down));
    sampling_turn(v, &sine, &cosine);
    return vec3(r * cosine, r * sine, 1 - down);
}

#endif
