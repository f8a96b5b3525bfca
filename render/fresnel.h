// SPDX-License-Identifier: Apache-2.0
// Fresnel's equations for unpolarised light, without approximation (Born and Wolf, "Principles of
// Optics", 1.5 and 14.2). Cosines are in [0, 1], reflectances too.
#ifndef RENDER_FRESNEL_H
#define RENDER_FRESNEL_H

#include <math.h>

// From one clear medium into another. eta: index of refraction beyond the surface over that before
// it. 1: total internal reflection.
static inline double fresnel_dielectric(double cosine, double eta) {
    double g2 = eta * eta - 1 + cosine * cosine;
    if (!(g2 > 0)) {
        return 1;
    }
    double g = sqrt(g2), across = (g - cosine) / (g + cosine);
    double along = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1);
    double f = 0.5 * across * across * (1 + along * along);
    return f < 1 ? f : 1;
}

// The same surface with light at normal incidence.
static inline double fresnel_normal(double eta) {
    double ratio = (eta - 1) / (eta + 1);
    return ratio * ratio;
}

// A metal's index of refraction is complex, n + i k.
typedef struct {
    double n, k2; // k2: k squared
    double scale; // of the result
} FresnelMetal;

// Of a metal that reflects `normal` of the light that falls on it straight, and whose reflectance
// towards the edge rises steadily where `edge` is 1, as that of real metals, or dips first, the
// deeper the nearer it is to 0 (Gulbrandsen, "Artist friendly metallic Fresnel", JCGT 2014,
// equations 5 to 8). Both in [0, 1].
static inline FresnelMetal fresnel_metal(double normal, double edge) {
    // A perfect mirror is one whatever its n; beyond this what is missing is made up for.
    const double most = 0.9999;
    double r = normal < most ? normal : most, root = sqrt(r);
    double n = edge * (1 - r) / (1 + r) + (1 - edge) * (1 + root) / (1 - root);
    double k2 = (r * (n + 1) * (n + 1) - (n - 1) * (n - 1)) / (1 - r);
    return (FresnelMetal){n, k2 > 0 ? k2 : 0, r < normal ? normal / r : 1};
}

static inline double fresnel_conductor(double cosine, const FresnelMetal *metal) {
    double c2 = cosine * cosine, s2 = 1 - c2, n2 = metal->n * metal->n, k2 = metal->k2;
    double t = n2 - k2 - s2, ab = sqrt(t * t + 4 * n2 * k2);
    double a2 = 0.5 * (ab + t), a = a2 > 0 ? sqrt(a2) : 0, twice = 2 * cosine * a;
    double across = (ab + c2 - twice) / (ab + c2 + twice);
    double along = across * (c2 * ab + s2 * s2 - twice * s2) / (c2 * ab + s2 * s2 + twice * s2);
    double f = 0.5 * (across + along) * metal->scale;
    return f < 1 ? f > 0 ? f : 0 : 1; // 0/0 at grazing of a metal that is none: it reflects all
}

#endif
