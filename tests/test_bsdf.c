// SPDX-License-Identifier: Apache-2.0
// Materials and lights: energy, densities that integrate to one, weights that agree with the
// values, irradiance in closed form.
#include "render/bsdf.h"
#include "render/light.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "tests/near.h"

#include <string.h>

static const double roughs[] = {0, 0.02, 0.1, 0.3, 0.6, 1};
static const double cosines[] = {0.02, 0.1, 0.3, 0.7, 1};
enum { N_ROUGH = 6, N_COSINE = 5 };

static void sampling_turns(void **state) {
    (void)state;
    for (int i = -5000; i < 5000; i++) {
        double u = i / 3777.0, s, c;
        sampling_turn(u, &s, &c);
        assert_near(s, sin(2 * SAMPLING_PI * u), 3e-15);
        assert_near(c, cos(2 * SAMPLING_PI * u), 3e-15);
    }
    double s, c;
    sampling_turn(0.25, &s, &c);
    assert_true(s == 1 && c == 0);
}

static void sampling_frames_are_orthonormal(void **state) {
    (void)state;
    for (int i = 0; i < 1000; i++) {
        Vec3 n = vec3_normalize(vec3(sin(i), cos(1.7 * i), i % 10 ? sin(3.1 * i) : -1e-20 * i)), x,
             y;
        sampling_frame(n, &x, &y);
        assert_near(vec3_dot(x, y), 0, 1e-14);
        assert_near(vec3_dot(x, n), 0, 1e-14);
        assert_near(vec3_dot(vec3_cross(x, y), n), 1, 1e-14);
    }
}

static Vec3 view(double cosine) {
    return vec3(sqrt(1 - cosine * cosine), 0, cosine);
}

// The mean weight under a sky of 1, by the sampler that the renderer uses.
static double albedo(const Bsdf *bsdf, Vec3 wo, uint32_t n) {
    Sampler sampler = sampler_pixel(1, false, 1, 0, 0);
    double sum = 0;
    for (uint32_t i = 0; i < n; i++) {
        double u[SAMPLE_DIMENSIONS];
        BsdfSample sample;
        sampler_draw(&sampler, i, 1, u);
        if (bsdf_sample(bsdf, wo, u, &sample)) {
            assert_near(vec3_length(sample.wi), 1, 1e-9);
            assert_true(sample.wi.z > 0);
            sum += sample.weight[0];
        }
    }
    return sum / n;
}

// White metal and a coat over a white base lose nothing, from any side, at any roughness.
static void bsdf_keeps_energy(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = bsdf_table_new(&arena);
    for (int r = 0; r < N_ROUGH; r++) {
        for (int c = 0; c < N_COSINE; c++) {
            Vec3 wo = view(cosines[c]);
            Bsdf bsdf;
            const double metal[BSDF_MAX_OUT] = {1, 1, 1, roughs[r], 1, 1, 1};
            assert_true(bsdf_init(&bsdf, MATERIAL_METAL, metal, false, 0, wo.z, table));
            assert_near(albedo(&bsdf, wo, 4096), 1, 0.01);
            const double gloss[BSDF_MAX_OUT] = {1, 1, 1, roughs[r], 1.5};
            assert_true(bsdf_init(&bsdf, MATERIAL_GLOSS, gloss, false, 0, wo.z, table));
            assert_near(albedo(&bsdf, wo, 4096), 1, 0.01);
            const double dark[BSDF_MAX_OUT] = {0, 0, 0, roughs[r], 1.5};
            assert_true(bsdf_init(&bsdf, MATERIAL_GLOSS, dark, false, 0, wo.z, table));
            assert_near(albedo(&bsdf, wo, 4096), bsdf.returned, 0.01);
        }
    }
    arena_free(&arena);
}

static void bsdf_matte_is_exact(void **state) {
    (void)state;
    Bsdf bsdf;
    const double white[BSDF_MAX_OUT] = {1, 0.5, 2};
    assert_true(bsdf_init(&bsdf, MATERIAL_MATTE, white, false, 0, 0.5, NULL));
    assert_near(bsdf.color[2], 1, 0); // nothing returns more than it gets
    for (int i = 0; i < 100; i++) {
        const double u[3] = {i / 100.0, fmod(i * 0.37, 1), 0.5};
        BsdfSample sample;
        if (bsdf_sample(&bsdf, view(0.5), u, &sample)) {
            assert_true(sample.weight[0] == 1 && sample.weight[1] == 0.5);
        }
    }
}

// The share of samples that are not reflected below the surface.
static double accepted(const Bsdf *bsdf, Vec3 wo, uint32_t n) {
    Sampler sampler = sampler_pixel(4, false, 1, 0, 0);
    uint32_t n_accepted = 0;
    for (uint32_t i = 0; i < n; i++) {
        double u[SAMPLE_DIMENSIONS];
        BsdfSample sample;
        sampler_draw(&sampler, i, 1, u);
        n_accepted += bsdf_sample(bsdf, wo, u, &sample);
    }
    return (double)n_accepted / n;
}

// Values and densities over the hemisphere by quadrature: the density integrates to the share of
// directions that samples get, and values to the albedo that sampling finds.
static void bsdf_values_agree_with_samples(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = bsdf_table_new(&arena);
    for (int kind = 0; kind < 2; kind++) {
        for (int r = 3; r < N_ROUGH; r++) {
            for (int c = 1; c < N_COSINE; c++) {
                Vec3 wo = view(cosines[c]);
                const double out[BSDF_MAX_OUT] = {0.7, 0.7, 0.7, roughs[r], 1.5, 1, 1};
                Bsdf bsdf;
                bsdf_init(&bsdf, kind ? MATERIAL_GLOSS : MATERIAL_METAL, out, false, 0, wo.z,
                          table);
                enum { STEPS = 400 };
                double value = 0, total = 0;
                for (int i = 0; i < STEPS * STEPS; i++) {
                    // Uniform in solid angle: z and azimuth.
                    double z = (i / STEPS + 0.5) / STEPS, s, co, k = sqrt(1 - z * z);
                    sampling_turn((i % STEPS + 0.5) / STEPS, &s, &co);
                    double diffuse[3], specular[3], density;
                    bsdf_eval(&bsdf, wo, vec3(k * co, k * s, z), diffuse, specular, &density);
                    value += diffuse[0] + specular[0];
                    total += density;
                }
                double cell = 2 * SAMPLING_PI / (STEPS * STEPS);
                assert_near(total * cell, accepted(&bsdf, wo, 1 << 12), 0.02);
                assert_near(value * cell, albedo(&bsdf, wo, 1 << 14), 0.01);
            }
        }
    }
    arena_free(&arena);
}

static void bsdf_weights_are_value_over_density(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = bsdf_table_new(&arena);
    for (int kind = 0; kind < 3; kind++) {
        const MaterialKind kinds[] = {MATERIAL_MATTE, MATERIAL_METAL, MATERIAL_GLOSS};
        const double out[BSDF_MAX_OUT] = {0.7, 0.2, 0.5, 0.4, 1.5};
        Vec3 wo = view(0.6);
        Bsdf bsdf;
        bsdf_init(&bsdf, kinds[kind], out, false, 0, wo.z, table);
        for (int i = 0; i < 500; i++) {
            const double u[3] = {fmod(i * 0.618034, 1), fmod(i * 0.414214, 1),
                                 fmod(i * 0.23607, 1)};
            BsdfSample sample;
            if (!bsdf_sample(&bsdf, wo, u, &sample)) {
                continue;
            }
            double diffuse[3], specular[3], density;
            bsdf_eval(&bsdf, wo, sample.wi, diffuse, specular, &density);
            assert_near(sample.density / density, 1, 1e-6);
            for (int c = 0; c < 3; c++) {
                double weight = (diffuse[c] + specular[c]) / density;
                assert_near(sample.weight[c], weight, 1e-6 * weight);
                assert_near(sample.specular[c], specular[c] / density, 1e-6 * weight);
            }
        }
    }
    arena_free(&arena);
}

// Roughness and direction beyond any reason: finite, never more than comes in.
static void bsdf_survives_extremes(void **state) {
    (void)state;
    Arena arena = {0};
    const BsdfTable *table = bsdf_table_new(&arena);
    const double values[] = {-1e300, -1, 0, 1e-300, 0.0199999, 0.02, 0.5, 1, 1e300};
    const double slopes[] = {1e-6, 1e-3, 0.999999999, 1};
    for (int i = 0; i < 9 * 9 * 9; i++) {
        double v = values[i % 9];
        const double out[BSDF_MAX_OUT] = {v, v, v, values[i / 9 % 9], values[i / 81], v, v};
        for (int k = 0; k < 4; k++) {
            Vec3 wo = view(slopes[k]);
            for (int kind = MATERIAL_MATTE; kind <= MATERIAL_GLOSS; kind++) {
                Bsdf bsdf;
                assert_true(bsdf_init(&bsdf, (MaterialKind)kind, out, false, 0, wo.z, table));
                for (int s = 0; s < 5; s++) {
                    const double u[3] = {s / 5.0, 1 - 0x1p-33, fmod(s * 0.7, 1)};
                    BsdfSample sample;
                    if (bsdf_sample(&bsdf, wo, u, &sample)) {
                        assert_true(isfinite(sample.weight[0]) && sample.weight[0] >= 0);
                        assert_true(vec3_is_finite(sample.wi));
                    }
                }
            }
        }
    }
    const double bad[BSDF_MAX_OUT] = {0.5, NAN, 0.5, 0.5, 1.5};
    Bsdf bsdf;
    assert_false(bsdf_init(&bsdf, MATERIAL_GLOSS, bad, false, 0, 1, table));
    arena_free(&arena);
}

// One light of constants.
static bool light_of(LightKind kind, const double *values, uint32_t n, LightAt *at, double sky[3]) {
    Arena arena = {0};
    Instr code[8] = {{0}};
    uint32_t out[8];
    for (uint32_t i = 0; i < n; i++) {
        code[i] = (Instr){.op = OP_CONST, .value = values[i]};
        out[i] = i;
    }
    Light light = {.kind = kind, .program = program_new(&arena, code, n, out, n, NULL, 0)};
    Scene scene = {.lights = &light, .n_lights = 1};
    LightSet set = {.lights = at};
    bool bad = false;
    assert_false(light_is_moving(&light));
    light_set_at(&scene, 0, &set, &bad);
    memcpy(sky, set.sky, sizeof set.sky);
    arena_free(&arena);
    return set.n == 1 && !bad;
}

// The irradiance of a surface at the origin with normal (0, 1, 0).
static double irradiance(const LightAt *light, bool *meets_itself) {
    enum { N = 1 << 14 };
    Sampler sampler = sampler_pixel(2, false, 1, 0, 0);
    double sum = 0;
    *meets_itself = true;
    for (uint32_t i = 0; i < N; i++) {
        double u[SAMPLE_DIMENSIONS];
        LightHit hit;
        LightSample s;
        sampler_draw(&sampler, i, 1, u);
        if (!light_sample(light, vec3(0, 0, 0), u[0], u[1], &s)) {
            continue;
        }
        sum += s.dir.y > 0 ? s.dir.y * s.weight[0] : 0;
        if (light->has_area && u[0] < 0.999) {
            bool is_hit = light_hit(light, vec3(0, 0, 0), s.dir, INFINITY, &hit);
            *meets_itself &= is_hit && fabs(hit.density / s.density - 1) < 1e-6;
        }
    }
    return sum / N;
}

static void light_suns_give_their_irradiance(void **state) {
    (void)state;
    const double angles[] = {0, 1e-7, 0.00925, 0.5, 2, 3.14159265358979};
    for (int i = 0; i < 6; i++) {
        // Facing it: all of its power whatever its angle.
        const double facing[] = {0, 3, 0, 5, 1, 0.5, 0, angles[i]};
        LightAt light;
        double sky[3];
        bool meets_itself;
        assert_true(light_of(LIGHT_SUN, facing, 8, &light, sky));
        assert_near(irradiance(&light, &meets_itself), 5, 0.005);
        assert_true(meets_itself);
        assert_true(light.has_area == (angles[i] > 0));
        assert_near(light.color[1] / light.color[0], 0.5, 1e-12);
    }
}

// An unoccluded ball above the horizon gives I cos / d^2 whatever its radius.
static void light_lamps_give_their_power(void **state) {
    (void)state;
    const double radii[] = {0, 1e-5, 0.1, 1, 2};
    for (int i = 0; i < 5; i++) {
        const double values[] = {3, 4, 0, 100, 1, 1, 1, radii[i]};
        LightAt light;
        double sky[3];
        bool meets_itself;
        assert_true(light_of(LIGHT_LAMP, values, 8, &light, sky));
        double expected = 100 / (4 * SAMPLING_PI) / 25 * 0.8;
        assert_near(irradiance(&light, &meets_itself), expected, 1e-3 * expected);
        assert_true(meets_itself);
    }
    // Inside the ball there is nothing; behind a nearer surface neither.
    const double around[] = {0, 0.5, 0, 100, 1, 1, 1, 1};
    LightAt light;
    LightSample sample;
    double sky[3];
    LightHit hit;
    assert_true(light_of(LIGHT_LAMP, around, 8, &light, sky));
    assert_false(light_sample(&light, vec3(0, 0, 0), 0.5, 0.5, &sample));
    assert_false(light_hit(&light, vec3(0, 0, 0), vec3(0, 1, 0), INFINITY, &hit));
    assert_true(light_hit(&light, vec3(0, 9, 0), vec3(0, -1, 0), INFINITY, &hit));
    assert_true(light_hit(&light, vec3(0, 9, 0), vec3(0, -1, 0), 7.6, &hit));
    assert_false(light_hit(&light, vec3(0, 9, 0), vec3(0, -1, 0), 7.4, &hit));
}

static void light_skies_and_darkness(void **state) {
    (void)state;
    LightAt light;
    double sky[3];
    const double blue[] = {0.1, 0.2, 0.4, 2};
    assert_false(light_of(LIGHT_SKY, blue, 4, &light, sky));
    assert_near(sky[0], 0.2, 1e-15);
    assert_near(sky[2], 0.8, 1e-15);
    const double bad[][8] = {{0, 0, 0, 1, 1, 1, 1, 0},   // a direction of no length
                             {0, NAN, 0, 1, 1, 1, 1, 0}, // not a number
                             {0, 1, 0, 0, 1, 1, 1, 0},   // dark
                             {0, 1, 0, -1, 1, 1, 1, 0}}; // darker than dark
    for (int i = 0; i < 4; i++) {
        assert_false(light_of(LIGHT_SUN, bad[i], 8, &light, sky));
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(sampling_turns),
    cmocka_unit_test(sampling_frames_are_orthonormal),
    cmocka_unit_test(bsdf_keeps_energy),
    cmocka_unit_test(bsdf_matte_is_exact),
    cmocka_unit_test(bsdf_values_agree_with_samples),
    cmocka_unit_test(bsdf_weights_are_value_over_density),
    cmocka_unit_test(bsdf_survives_extremes),
    cmocka_unit_test(light_suns_give_their_irradiance),
    cmocka_unit_test(light_lamps_give_their_power),
    cmocka_unit_test(light_skies_and_darkness),
};

SUITE(bsdf, tests)
