// SPDX-License-Identifier: Apache-2.0
// Rays against one moving primitive in float: the kernels that all structures share.
//
// This text is compiled once per instruction set (accel/trace_body.h). Operations round once, in
// the same order everywhere (FMA only where __builtin_fmaf says so): all give the same bits.
//
// Triangles: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013), with the edge
// functions by Kahan's difference of products, whose relative error is at most 2u (Jeannerod and
// others 2013): signs are exact as long as nothing underflows, down to a projected area of about
// 2^-100 local units, and a shared edge is seen alike from both its triangles.
// Spheres: Haines, Guenther, Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection"
// (Ray Tracing Gems, 2019, chapter 7), in double from the float centre and radius.
#ifndef ACCEL_INTERSECT_H
#define ACCEL_INTERSECT_H

#include "accel/ray_state.h"

// The nearest hit so far. Starts as {state->tf, INT32_MAX}; the distance is scaled like state->d.
typedef struct {
    float t;
    int32_t prim;
    float u, v;
} Nearest;

static inline float lerp(float f, float a, float b) {
    return __builtin_fmaf(f, b - a, a);
}

// a*b - c*d
static inline float product_difference(float a, float b, float c, float d) {
    float w = c * d, e = __builtin_fmaf(-c, d, w);
    return __builtin_fmaf(a, b, -w) + e;
}

static inline bool is_nearer(float t, int32_t prim, const RayState *ray, const Nearest *nearest) {
    return t > ray->tn && (t < nearest->t || (t == nearest->t && prim < nearest->prim));
}

static inline bool all_one_sign(double u, double v, double w) {
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

// The sum of three numbers, the same in whatever order they come.
static inline double sum_of_three(double a, double b, double c) {
    double lo = a < b ? a : b, hi = a > b ? a : b;
    double low = lo < c ? lo : c, high = hi > c ? hi : c;
    double between = hi < c ? hi : c, middle = lo > between ? lo : between;
    return (low + high) + middle;
}

// The distance of a triangle that the ray passes through. In double: products of floats are exact,
// so edge functions and sums come out the same, but for their sign, in whatever order the vertices
// are given. Coincident triangles are at bit-equal distances, and the lowest of them wins.
static inline void accept_triangle(const RayState *ray, const float x[3], const float y[3],
                                   const float z[3], int32_t prim, Nearest *nearest) {
    double u = (double)x[2] * y[1] - (double)y[2] * x[1];
    double v = (double)x[0] * y[2] - (double)y[0] * x[2];
    double w = (double)x[1] * y[0] - (double)y[1] * x[0];
    // All have one sign, so the sum cannot cancel; where it is 0 what follows is NaN, and no hit.
    double r = 1 / sum_of_three(u, v, w);
    float t = (float)(sum_of_three(u * z[0], v * z[1], w * z[2]) * r);
    bool is_through = all_one_sign(u, v, w);
    if (is_through & is_nearer(t, prim, ray, nearest)) {
        *nearest = (Nearest){t, prim, (float)(v * r), (float)(w * r)};
    }
}

static inline void intersect_triangle(const Geometry *geometry, const RayState *ray, int32_t prim,
                                      Nearest *nearest) {
    const uint32_t *index = geometry->index + 3 * (size_t)prim;
    float x[3], y[3], z[3];
    for (int i = 0; i < 3; i++) {
        const float *a = ray->a + 3 * (size_t)index[i], *b = ray->b + 3 * (size_t)index[i];
        float px = lerp(ray->f, a[ray->kx], b[ray->kx]) - ray->o[ray->kx];
        float py = lerp(ray->f, a[ray->ky], b[ray->ky]) - ray->o[ray->ky];
        float pz = lerp(ray->f, a[ray->kz], b[ray->kz]) - ray->o[ray->kz];
        x[i] = __builtin_fmaf(-ray->sx, pz, px);
        y[i] = __builtin_fmaf(-ray->sy, pz, py);
        z[i] = ray->sz * pz;
    }
    float u = product_difference(x[2], y[1], y[2], x[1]);
    float v = product_difference(x[0], y[2], y[0], x[2]);
    float w = product_difference(x[1], y[0], y[1], x[0]);
    // By ordered compares, never by sign bits: -0 is on the edge, NaN is outside.
    if (all_one_sign(u, v, w)) {
        accept_triangle(ray, x, y, z, prim, nearest);
    }
}

static inline void intersect_sphere(const RayState *ray, int32_t prim, Nearest *nearest) {
    const float *a = ray->a + 3 * (size_t)prim, *b = ray->b + 3 * (size_t)prim;
    double radius = lerp(ray->f, ray->ra[prim], ray->rb[prim]);
    double g[3], dd = 0, gd = 0, gg = 0;
    for (int i = 0; i < 3; i++) {
        double d = ray->d[i];
        g[i] = (double)ray->o[i] - (double)lerp(ray->f, a[i], b[i]);
        dd = __builtin_fma(d, d, dd);
        gd = __builtin_fma(g[i], d, gd);
        gg = __builtin_fma(g[i], g[i], gg);
    }
    double nearest_point = -gd / dd, ll = 0, rr = radius * radius;
    for (int i = 0; i < 3; i++) {
        double l = __builtin_fma(nearest_point, (double)ray->d[i], g[i]);
        ll = __builtin_fma(l, l, ll);
    }
    if (!(radius > 0 && ll <= rr)) {
        return;
    }
    double root = __builtin_sqrt(dd * (rr - ll)), q = gd > 0 ? -gd - root : root - gd;
    // Both are roots; q = 0 (the ray starts at the centre of nothing) gives NaN, and no hit.
    double t0 = (gg - rr) / q, t1 = q / dd;
    float lower = (float)(t0 < t1 ? t0 : t1), upper = (float)(t0 < t1 ? t1 : t0);
    float t = lower > ray->tn ? lower : upper;
    if (is_nearer(t, prim, ray, nearest)) {
        *nearest = (Nearest){t, prim, 0, 0};
    }
}

static inline void intersect_prim(const Geometry *geometry, const RayState *ray, int32_t prim,
                                  Nearest *nearest) {
    if (geometry->kind == GEOMETRY_TRIANGLES) {
        intersect_triangle(geometry, ray, prim, nearest);
    } else {
        intersect_sphere(ray, prim, nearest);
    }
}

#endif
