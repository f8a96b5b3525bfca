// SPDX-License-Identifier: Apache-2.0
// The GGX distribution of microfacets (Walter et al., "Microfacet models for refraction through
// rough surfaces", 2007) with the height-correlated Smith shadowing (Heitz 2014). Frame as
// render/bsdf.h.
#ifndef RENDER_GGX_H
#define RENDER_GGX_H

#include <stdbool.h>

#include "render/sampling.h"

static inline double ggx_d(Vec3 h, double alpha) {
    double a2 = alpha * alpha;
    // cos^2 (a2 - 1) + 1, with the cancellation near the normal taken out.
    double q = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    return a2 / (SAMPLING_PI * q * q);
}

static inline double ggx_lambda(Vec3 w, double alpha) {
    double slope2 = alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5 * (sqrt(1 + slope2) - 1);
}

static inline double ggx_g1(Vec3 w, double alpha) {
    return 1 / (1 + ggx_lambda(w, alpha));
}

static inline double ggx_g2(Vec3 wo, Vec3 wi, double alpha) {
    return 1 / (1 + ggx_lambda(wo, alpha) + ggx_lambda(wi, alpha));
}

// A facet's normal with the density of those that wo sees (Dupuy and Benyoub, "Sampling visible GGX
// normals with spherical caps", 2023): as a density of wi it is D G1 / (4 wo.z).
static inline Vec3 ggx_sample(Vec3 wo, double alpha, double u, double v) {
    Vec3 w = vec3_normalize(vec3(wo.x * alpha, wo.y * alpha, wo.z));
    double sine, cosine, z = (1 - u) * (1 + w.z) - w.z, r2 = 1 - z * z, r = r2 > 0 ? sqrt(r2) : 0;
    sampling_turn(v, &sine, &cosine);
    Vec3 h = vec3(r * cosine + w.x, r * sine + w.y, z + w.z);
    return vec3_normalize(vec3(h.x * alpha, h.y * alpha, h.z > 0 ? h.z : 0));
}

// Schlick's s = (1 - cos)^5.
static inline double ggx_schlick(double cosine) {
    double m = cosine < 1 ? 1 - cosine : 0, m2 = m * m;
    return m2 * m2 * m;
}

static inline Vec3 ggx_reflect(Vec3 wo, Vec3 h) {
    return vec3_sub(vec3_scale(h, 2 * vec3_dot(wo, h)), wo);
}

// Where light comes from that a facet refracts towards wo. eta: index of refraction beyond the
// surface over that on wo's side; wo.h >= 0. False: it is reflected totally.
static inline bool ggx_refract(Vec3 wo, Vec3 h, double eta, Vec3 *wi) {
    double c = vec3_dot(wo, h), cos2 = 1 - (1 - c * c) / (eta * eta);
    if (!(cos2 > 0)) {
        return false;
    }
    *wi = vec3_normalize(vec3_madd(vec3_scale(wo, -1 / eta), c / eta - sqrt(cos2), h));
    return true;
}

#endif
