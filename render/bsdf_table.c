// SPDX-License-Identifier: Apache-2.0
// Integrals over facets, by quadrature over the points from which they are sampled.
#include "render/bsdf_table.h"

#include <stdlib.h>
#include <string.h>

#include "render/fresnel.h"
#include "render/ggx.h"

// Steps of the quadrature: half the azimuths are enough, the viewer lies in the plane of symmetry.
// Where refraction ends at the surface the integrand of glass jumps, which a lattice stands better
// than rows and columns.
enum { STEPS_U = 16, STEPS_V = 16, STEPS_GLASS = 512 };

static double clamp01(double x) {
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

// Row and column i of the tables stand for roughness and cosine; cosines lie densest at grazing.
static double node_rough(int i) {
    return BSDF_MIRROR_ROUGH + (1 - BSDF_MIRROR_ROUGH) * i / (BSDF_TABLE - 1);
}

static double node_cosine(int i) {
    double x = (i + 0.02) / (BSDF_TABLE - 1 + 0.02);
    return x * x;
}

static void integrate(double alpha, double cosine, double *plain, double *grazing) {
    Vec3 wo = vec3(sqrt(1 - cosine * cosine), 0, cosine);
    double sum = 0, sum_grazing = 0;
    for (int i = 0; i < STEPS_U * STEPS_V; i++) {
        double u = (i / STEPS_V + 0.5) / STEPS_U, v = (i % STEPS_V + 0.5) / (2 * STEPS_V);
        Vec3 h = ggx_sample(wo, alpha, u, v);
        Vec3 wi = ggx_reflect(wo, h);
        if (wi.z > 0) {
            double shadowing = ggx_g2(wo, wi, alpha) / ggx_g1(wo, alpha);
            sum += shadowing;
            sum_grazing += shadowing * ggx_schlick(vec3_dot(wo, h));
        }
    }
    *plain = sum / (STEPS_U * STEPS_V);
    *grazing = sum_grazing / (STEPS_U * STEPS_V);
}

// Twice the integral of value * cos over cos, the values linear between the nodes.
static double cosine_mean(const double *value) {
    double sum = value[0] * node_cosine(0) * node_cosine(0);
    for (int i = 0; i + 1 < BSDF_TABLE; i++) {
        double a = node_cosine(i), b = node_cosine(i + 1), va = value[i], vb = value[i + 1];
        sum += (b - a) / 3 * (va * a + vb * b + (va + vb) * (a + b));
    }
    return sum;
}

BsdfTable *bsdf_table_new(Arena *arena) {
    BsdfTable *table = ARENA_NEW(arena, BsdfTable);
    for (int i = 0; i < BSDF_TABLE; i++) {
        double alpha = node_rough(i) * node_rough(i);
        for (int j = 0; j < BSDF_TABLE; j++) {
            integrate(alpha, node_cosine(j), &table->plain[i][j], &table->grazing[i][j]);
        }
        table->mean_plain[i] = cosine_mean(table->plain[i]);
        table->mean_grazing[i] = cosine_mean(table->grazing[i]);
    }
    return table;
}

typedef struct {
    int i;
    double f;
} Cell;

static Cell cell_of(double x) {
    x = x > 0 ? x : 0;
    int i = x < BSDF_TABLE - 1 ? (int)x : BSDF_TABLE - 2;
    double f = x - i;
    return (Cell){i, f < 1 ? f : 1};
}

static Cell rough_cell(double rough) {
    return cell_of((rough - BSDF_MIRROR_ROUGH) / (1 - BSDF_MIRROR_ROUGH) * (BSDF_TABLE - 1));
}

double bsdf_table_at(const BsdfGrid grid, double rough, double cosine) {
    Cell r = rough_cell(rough);
    // The cell is found by the square root, in which the nodes are even, and the cosine
    // interpolated.
    Cell c = cell_of(sqrt(cosine) * (BSDF_TABLE - 1 + 0.02) - 0.02);
    double a = node_cosine(c.i), b = node_cosine(c.i + 1), f = clamp01((cosine - a) / (b - a));
    double lo = grid[r.i][c.i] * (1 - f) + grid[r.i][c.i + 1] * f;
    double hi = grid[r.i + 1][c.i] * (1 - f) + grid[r.i + 1][c.i + 1] * f;
    return lo * (1 - r.f) + hi * r.f;
}

double bsdf_table_mean(const double mean[BSDF_TABLE], double rough) {
    Cell r = rough_cell(rough);
    return mean[r.i] * (1 - r.f) + mean[r.i + 1] * r.f;
}

// ---- Glass

// What single facets return, reflected where the light stays on its side, refracted where it
// changes sides; the rest went to other facets.
static double integrate_glass(double alpha, double cosine, double eta) {
    Vec3 wo = vec3(sqrt(1 - cosine * cosine), 0, cosine);
    double sum = 0;
    const double golden = 0.6180339887498949;
    for (int i = 0; i < STEPS_GLASS; i++) {
        double v = i * golden - floor(i * golden);
        Vec3 h = ggx_sample(wo, alpha, (i + 0.5) / STEPS_GLASS, v / 2), wi = ggx_reflect(wo, h);
        double f = fresnel_dielectric(vec3_dot(wo, h), eta), g1 = ggx_g1(wo, alpha);
        sum += wi.z > 0 ? f * ggx_g2(wo, wi, alpha) / g1 : 0;
        if (f < 1 && ggx_refract(wo, h, eta, &wi) && wi.z < 0) {
            sum += (1 - f) * ggx_g2(wo, wi, alpha) / g1;
        }
    }
    return sum / STEPS_GLASS;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void bsdf_table_add_glass(BsdfTable *table, Arena *arena, const double *iors, uint32_t n) {
    static const double range[BSDF_IORS] = {1.001, 1.03, 1.07, 1.13, 1.2, 1.3,
                                            1.42,  1.57, 1.75, 2,    2.5, 3.5};
    table->n_iors = n ? n : BSDF_IORS;
    memcpy(table->iors, n ? iors : range, table->n_iors * sizeof *table->iors);
    qsort(table->iors, table->n_iors, sizeof *table->iors, by_value);
    for (int side = 0; side < 2; side++) {
        BsdfGrid *grids = arena_array(arena, table->n_iors, sizeof *grids);
        table->glass[side] = (const BsdfGrid *)grids;
        for (uint32_t k = 0; k < table->n_iors; k++) {
            double eta = side ? 1 / table->iors[k] : table->iors[k];
            for (int i = 0; i < BSDF_TABLE * BSDF_TABLE; i++) {
                int r = i / BSDF_TABLE, c = i % BSDF_TABLE;
                grids[k][r][c] =
                    integrate_glass(node_rough(r) * node_rough(r), node_cosine(c), eta);
            }
        }
    }
}

double bsdf_table_glass(const BsdfTable *table, double ior, bool is_inside, double rough,
                        double cosine) {
    uint32_t k = 0;
    while (k + 1 < table->n_iors && table->iors[k + 1] <= ior) {
        k++;
    }
    double at = bsdf_table_at(table->glass[is_inside][k], rough, cosine);
    if (k + 1 == table->n_iors || ior <= table->iors[k]) {
        return at;
    }
    double f = (ior - table->iors[k]) / (table->iors[k + 1] - table->iors[k]);
    return at * (1 - f) + f * bsdf_table_at(table->glass[is_inside][k + 1], rough, cosine);
}
