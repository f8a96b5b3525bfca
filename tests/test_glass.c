// SPDX-License-Identifier: Apache-2.0
// Glass, metals and what they obey: Snell's law, Fresnel's equations by complex arithmetic, the
// furnace, reciprocity, densities that integrate to one.
#include "render/bsdf.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "tests/near.h"

#include <complex.h>

static const double iors[] = {1.1, 1.33, 1.5, 2.4};
static const double roughs[] = {0, 0.05, 0.2, 0.5, 0.8, 1};
static const double cosines[] = {0.02, 0.1, 0.3, 0.6, 0.9, 1};
enum { N_IOR = 4, N_ROUGH = 6, N_COSINE = 6 };

static Vec3 view(double cosine) {
    return vec3(sqrt(1 - cosine * cosine), 0, cosine);
}

// The amplitudes by complex arithmetic, as textbooks have them: n1 cos1 against n2 cos2.
static double reflectance(double cosine, double complex n1, double complex n2) {
    double complex sine = n1 / n2 * sqrt(1 - cosine * cosine), c2 = csqrt(1 - sine * sine);
    double complex s = (n1 * cosine - n2 * c2) / (n1 * cosine + n2 * c2);
    double complex p = (n2 * cosine - n1 * c2) / (n2 * cosine + n1 * c2);
    return 0.5 * (creal(s * conj(s)) + creal(p * conj(p)));
}

static void fresnel_of_dielectrics(void **state) {
    (void)state;
    for (int i = 0; i < N_IOR; i++) {
        for (double c = 0.001; c <= 1; c += 0.001) {
            assert_near(fresnel_dielectric(c, iors[i]), reflectance(c, 1, iors[i]), 1e-12);
            assert_near(fresnel_dielectric(c, 1 / iors[i]), reflectance(c, iors[i], 1), 1e-7);
        }
        // Beyond the critical angle everything comes back; at Brewster's half of what is left.
        assert_near(fresnel_dielectric(0.9 * sqrt(1 - pow(iors[i], -2)), 1 / iors[i]), 1, 0);
        assert_near(fresnel_normal(iors[i]), fresnel_dielectric(1, iors[i]), 1e-15);
    }
    assert_near(fresnel_normal(1.5), 0.04, 1e-15);
}

// n and k as measured (gold, copper, aluminium, chromium, titanium at 580 nm) are found again from
// the reflectance at normal incidence and the edge, and give the same at all angles.
static void fresnel_of_metals(void **state) {
    (void)state;
    static const double measured[][2] = {
        {0.28, 2.88}, {0.67, 2.6}, {1.1, 6.8}, {3.2, 3.3}, {2.6, 3.4}};
    for (int i = 0; i < 5; i++) {
        double n = measured[i][0], k = measured[i][1];
        double r = ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
        double least = (1 - r) / (1 + r), most = (1 + sqrt(r)) / (1 - sqrt(r));
        FresnelMetal metal = fresnel_metal(r, (most - n) / (most - least));
        assert_near(metal.n, n, 1e-12);
        assert_near(metal.k2, k * k, 1e-9);
        for (double c = 0.001; c <= 1; c += 0.001) {
            assert_near(fresnel_conductor(c, &metal), reflectance(c, 1, n + I * k), 1e-12);
        }
    }
    // Any color and edge: what was asked for is what comes back straight; never more than all.
    for (int i = 0; i <= 20 * 20; i++) {
        double r = i % 20 / 19.0, edge = i / 20 / 20.0;
        FresnelMetal metal = fresnel_metal(r, edge);
        assert_near(fresnel_conductor(1, &metal), r, 1e-12);
        for (double c = 0; c <= 1; c += 0.01) {
            double f = fresnel_conductor(c, &metal);
            assert_true(f >= 0 && f <= 1 && (r < 1 || edge < 1 || f > 1 - 1e-4));
        }
    }
}

static BsdfTable *table_new(Arena *arena) {
    BsdfTable *table = bsdf_table_new(arena);
    bsdf_table_add_glass(table, arena, iors, N_IOR);
    return table;
}

static void glass_new(Bsdf *bsdf, const BsdfTable *table, double ior, double rough, bool is_inside,
                      double cosine) {
    const double out[BSDF_MAX_OUT] = {1, 1, 1, ior, rough, 0, 1};
    assert_true(bsdf_init(bsdf, MATERIAL_GLASS, out, is_inside, 0, cosine, table));
}

// Smooth glass sends light where Snell says, as often as Fresnel says.
static void glass_bends_light(void **state) {
    (void)state;
    enum { N = 1 << 14 };
    for (int i = 0; i < N_IOR * N_COSINE * 2; i++) {
        double ior = iors[i % N_IOR], cosine = cosines[i / 2 / N_IOR];
        bool is_inside = i / N_IOR % 2;
        double sine = sqrt(1 - cosine * cosine) * (is_inside ? ior : 1 / ior);
        Bsdf bsdf;
        glass_new(&bsdf, NULL, ior, 0, is_inside, cosine);
        uint32_t n_reflected = 0;
        for (uint32_t k = 0; k < N; k++) {
            const double u[3] = {0.3, 0.7, (k + 0.5) / N};
            BsdfSample sample;
            assert_true(bsdf_sample(&bsdf, view(cosine), u, &sample));
            assert_true(sample.density == 0 && sample.weight[1] == 1);
            n_reflected += sample.wi.z > 0;
            assert_near(sample.wi.x, sample.wi.z > 0 ? -sqrt(1 - cosine * cosine) : -sine, 1e-12);
            assert_near(sample.wi.y, 0, 0);
            assert_near(vec3_length(sample.wi), 1, 1e-12);
        }
        double complex from = is_inside ? ior : 1, to = is_inside ? 1 : ior;
        assert_near((double)n_reflected / N, reflectance(cosine, from, to), 1.0 / N + 1e-7);
    }
}

// Of so many samples; what is absorbed weighs nothing.
static double mean_weight(const Bsdf *bsdf, double cosine, const Sampler *sampler, uint32_t n) {
    double sum = 0;
    for (uint32_t k = 0; k < n; k++) {
        double u[SAMPLE_DIMENSIONS];
        BsdfSample sample;
        sampler_draw(sampler, k, 1, u);
        sum += bsdf_sample(bsdf, view(cosine), u, &sample) ? sample.weight[2] : 0;
    }
    return sum / n;
}

// White glass of any roughness, from both sides: all light comes back or through.
static void glass_keeps_energy(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = table_new(&arena);
    Sampler sampler = sampler_pixel(1, false, 1, 0, 0);
    enum { N = 1 << 12 };
    for (int i = 0; i < N_IOR * N_ROUGH * N_COSINE * 2; i++) {
        double ior = iors[i % N_IOR], rough = roughs[i / N_IOR % N_ROUGH];
        double cosine = cosines[i / N_IOR / N_ROUGH % N_COSINE];
        Bsdf bsdf;
        glass_new(&bsdf, table, ior, rough, i >= N_IOR * N_ROUGH * N_COSINE, cosine);
        assert_near(mean_weight(&bsdf, cosine, &sampler, N), 1, 0.01);
    }
    arena_free(&arena);
}

// Between the tables' indices and roughnesses too.
static void glass_keeps_energy_between(void **state) {
    (void)state;
    Arena arena = {0};
    BsdfTable *table = bsdf_table_new(&arena);
    bsdf_table_add_glass(table, &arena, NULL, 0);
    Sampler sampler = sampler_pixel(2, false, 1, 0, 0);
    enum { N = 1 << 14 };
    for (int i = 0; i < 60; i++) {
        double ior = 1.05 + fmod(i * 0.618034, 1) * 1.5, rough = 0.03 + 0.97 * fmod(i * 0.41421, 1);
        double cosine = 0.03 + 0.97 * fmod(i * 0.2360679, 1);
        Bsdf bsdf;
        glass_new(&bsdf, table, ior, rough, i % 2, cosine);
        assert_near(mean_weight(&bsdf, cosine, &sampler, N), 1, 0.01);
    }
    arena_free(&arena);
}

// By quadrature over the sphere: the density integrates to the share of samples that are accepted,
// the value to one.
static void glass_values_agree_with_samples(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = table_new(&arena);
    Sampler sampler = sampler_pixel(3, false, 1, 0, 0);
    for (int i = 0; i < 3 * 2 * 4; i++) {
        double rough = roughs[3 + i % 3], cosine = cosines[2 + i / 6], value = 0, total = 0;
        Vec3 wo = view(cosine);
        Bsdf bsdf;
        glass_new(&bsdf, table, 1.5, rough, i / 3 % 2, cosine);
        enum { STEPS = 700, N = 1 << 13 };
        for (int k = 0; k < STEPS * STEPS; k++) {
            double down = SAMPLING_PI * (k / STEPS + 0.5) / STEPS, z = cos(down), r = sin(down);
            double s, c;
            sampling_turn((k % STEPS + 0.5) / STEPS, &s, &c);
            double diffuse[3], specular[3], density;
            bsdf_eval(&bsdf, wo, vec3(r * c, r * s, z), diffuse, specular, &density);
            assert_true(diffuse[0] == 0 && density >= 0);
            value += specular[0] * r;
            total += density * r;
        }
        uint32_t n_accepted = 0;
        for (uint32_t k = 0; k < N; k++) {
            double u[SAMPLE_DIMENSIONS], diffuse[3], specular[3], density;
            BsdfSample sample;
            sampler_draw(&sampler, k, 1, u);
            if (bsdf_sample(&bsdf, wo, u, &sample)) {
                n_accepted++;
                bsdf_eval(&bsdf, wo, sample.wi, diffuse, specular, &density);
                assert_near(density / sample.density, 1, 1e-6);
                assert_near(specular[1] / density, sample.weight[1], 1e-6);
            }
        }
        double cell = 2 * SAMPLING_PI * SAMPLING_PI / (STEPS * STEPS);
        assert_near(total * cell, (double)n_accepted / N, 0.005);
        assert_near(value * cell, 1, 0.005);
    }
    arena_free(&arena);
}

// What single facets do is the same in both directions: as much light goes from wi to wo as from wo
// to wi, of radiance over the square of the index.
static void rough_facets_are_reciprocal(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = table_new(&arena);
    int n_through = 0;
    for (int i = 0; i < 2000; i++) {
        double z1 = 0.05 + 0.9 * fmod(i * 0.618034, 1), z2 = 1.9 * fmod(i * 0.41421356, 1) - 0.95;
        double s, c, r = sqrt(1 - z2 * z2), rough = 0.2 + 0.8 * fmod(i * 0.2360679, 1);
        sampling_turn(fmod(i * 0.7320508, 1), &s, &c);
        Vec3 wo = view(z1), wi = vec3(r * c, r * s, z2), up = vec3(1, 1, z2 > 0 ? 1 : -1);
        double diffuse[3], there[3], back[3], density, ior = 1.5;
        Bsdf bsdf, other;
        bool is_metal = i % 3 == 0 && z2 > 0;
        const double out[BSDF_MAX_OUT] = {
            0.8, 0.8, 0.8, is_metal ? rough : ior, is_metal ? 0.3 : rough, is_metal, 1};
        MaterialKind kind = is_metal ? MATERIAL_METAL : MATERIAL_GLASS;
        bsdf_init(&bsdf, kind, out, false, 0, wo.z, table);
        bsdf_init(&other, kind, out, z2 < 0, 0, fabs(z2), table);
        bsdf_eval(&bsdf, wo, wi, diffuse, there, &density);
        // Where the light leaves below, the frame of the other side is upside down.
        bsdf_eval(&other, vec3(wi.x * up.x, wi.y * up.y, wi.z * up.z),
                  vec3(wo.x * up.x, wo.y * up.y, wo.z * up.z), diffuse, back, &density);
        double f = there[0] / bsdf.boost[0] / fabs(wi.z), g = back[0] / other.boost[0] / wo.z;
        g *= z2 < 0 ? ior * ior : 1;
        assert_near(f, g, 1e-9 * (1 + f));
        n_through += z2 < 0 && f > 0;
    }
    assert_true(n_through > 100);
    arena_free(&arena);
}

// Roughness, index and direction beyond any reason.
static void glass_survives_extremes(void **state) {
    (void)state;
    Arena arena = {0};
    BsdfTable *table = bsdf_table_new(&arena);
    bsdf_table_add_glass(table, &arena, NULL, 0);
    const double values[] = {-1e300, -1, 0, 1e-300, 0.02, 0.5, 1, 1.00001, 1.5, 1e300};
    const double slopes[] = {1e-6, 1e-3, 0.999999999, 1};
    for (int i = 0; i < 10 * 10 * 10 * 4; i++) {
        double v = values[i % 10], cosine = slopes[i / 1000];
        const double out[BSDF_MAX_OUT] = {v, v, v, values[i / 10 % 10], values[i / 100 % 10], v, 1};
        for (int s = 0; s < 6; s++) {
            const double u[3] = {s / 6.0, 1 - 0x1p-33, fmod(s * 0.7, 1)};
            Bsdf bsdf;
            BsdfSample sample;
            assert_true(bsdf_init(&bsdf, MATERIAL_GLASS, out, s % 2, 0, cosine, table));
            if (bsdf_sample(&bsdf, view(cosine), u, &sample)) {
                assert_true(isfinite(sample.weight[0]) && sample.weight[0] >= 0);
                assert_near(vec3_length(sample.wi), 1, 1e-9);
            }
        }
    }
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(fresnel_of_dielectrics),
    cmocka_unit_test(fresnel_of_metals),
    cmocka_unit_test(glass_bends_light),
    cmocka_unit_test(glass_keeps_energy),
    cmocka_unit_test(glass_keeps_energy_between),
    cmocka_unit_test(glass_values_agree_with_samples),
    cmocka_unit_test(rough_facets_are_reciprocal),
    cmocka_unit_test(glass_survives_extremes),
};

SUITE(glass, tests)
