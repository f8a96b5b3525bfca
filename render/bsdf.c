// SPDX-License-Identifier: Apache-2.0
// Matte, metal, gloss and glow.
#include "render/bsdf.h"

#include "render/ggx.h"
#include "render/sampling.h"

// Schlick's s = (1 - cos)^5.
static double schlick(double cosine) {
    double m = cosine < 1 ? 1 - cosine : 0, m2 = m * m;
    return m2 * m2 * m;
}

static double clamp01(double x) {
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static double max3(const double *v) {
    double m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

int bsdf_n_out(MaterialKind kind) {
    static const int n[] = {
        [MATERIAL_MATTE] = 3, [MATERIAL_METAL] = 4, [MATERIAL_GLOSS] = 5, [MATERIAL_GLOW] = 4};
    return n[kind];
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
    enum { STEPS_U = 16, STEPS_V = 16 };
    Vec3 wo = vec3(sqrt(1 - cosine * cosine), 0, cosine);
    double sum = 0, sum_grazing = 0;
    for (int i = 0; i < STEPS_U * STEPS_V; i++) {
        // Half the azimuths are enough: wo lies in the plane of symmetry.
        double u = (i / STEPS_V + 0.5) / STEPS_U, v = (i % STEPS_V + 0.5) / (2 * STEPS_V);
        Vec3 h = ggx_sample(wo, alpha, u, v);
        Vec3 wi = ggx_reflect(wo, h);
        if (wi.z > 0) {
            double shadowing = ggx_g2(wo, wi, alpha) / ggx_g1(wo, alpha);
            sum += shadowing;
            sum_grazing += shadowing * schlick(vec3_dot(wo, h));
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

const BsdfTable *bsdf_table_new(Arena *arena) {
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

static double bilinear(const double table[BSDF_TABLE][BSDF_TABLE], double rough, double cosine) {
    Cell r = rough_cell(rough);
    // The cell is found by the square root, in which the nodes are even, and the cosine
    // interpolated.
    Cell c = cell_of(sqrt(cosine) * (BSDF_TABLE - 1 + 0.02) - 0.02);
    double a = node_cosine(c.i), b = node_cosine(c.i + 1), f = clamp01((cosine - a) / (b - a));
    double lo = table[r.i][c.i] * (1 - f) + table[r.i][c.i + 1] * f;
    double hi = table[r.i + 1][c.i] * (1 - f) + table[r.i + 1][c.i + 1] * f;
    return lo * (1 - r.f) + hi * r.f;
}

static double linear(const double *table, double rough) {
    Cell r = rough_cell(rough);
    return table[r.i] * (1 - r.f) + table[r.i + 1] * r.f;
}

// The share of light along one direction that a coat of reflectance f0 returns.
static double coat_returns(const Bsdf *bsdf, double cosine) {
    if (bsdf->is_mirror) {
        return bsdf->f0 + (1 - bsdf->f0) * schlick(cosine);
    }
    return bsdf->f0 * bilinear(bsdf->table->plain, bsdf->rough, cosine) +
           (1 - bsdf->f0) * bilinear(bsdf->table->grazing, bsdf->rough, cosine);
}

static double coat_mean(const Bsdf *bsdf) {
    if (bsdf->is_mirror) {
        return bsdf->f0 + (1 - bsdf->f0) / 21; // twice the integral of (1 - x)^5 x is 1/21
    }
    return bsdf->f0 * linear(bsdf->table->mean_plain, bsdf->rough) +
           (1 - bsdf->f0) * linear(bsdf->table->mean_grazing, bsdf->rough);
}

static void init_metal(Bsdf *bsdf, double cosine) {
    bsdf->choose = 1;
    double loss = 0;
    if (!bsdf->is_mirror) {
        loss = 1 / bilinear(bsdf->table->plain, bsdf->rough, cosine) - 1;
        loss = loss > 0 ? loss : 0;
    }
    for (int c = 0; c < 3; c++) {
        bsdf->boost[c] = 1 + bsdf->color[c] * loss;
    }
}

static void init_gloss(Bsdf *bsdf, double ior, double cosine) {
    double ratio = (ior - 1) / (ior + 1);
    bsdf->f0 = ior > 0 ? ratio * ratio : 1;
    bsdf->returned = coat_returns(bsdf, cosine);
    bsdf->mean_returned = coat_mean(bsdf);
    double base = (1 - bsdf->returned) * max3(bsdf->color);
    bsdf->choose = bsdf->returned + base > 0 ? bsdf->returned / (bsdf->returned + base) : 1;
}

bool bsdf_init(Bsdf *bsdf, MaterialKind kind, const double *out, double least_rough, double cosine,
               const BsdfTable *table) {
    for (int i = 0; i < bsdf_n_out(kind); i++) {
        if (!isfinite(out[i])) {
            return false;
        }
    }
    *bsdf = (Bsdf){.kind = kind, .table = table};
    for (int c = 0; c < 3; c++) {
        bsdf->color[c] = clamp01(out[c]);
    }
    if (kind == MATERIAL_GLOW) {
        for (int c = 0; c < 3; c++) {
            bsdf->emission[c] = out[c] > 0 && out[3] > 0 ? out[c] * out[3] : 0;
        }
    } else if (bsdf_has_specular(bsdf)) {
        bsdf->rough = clamp01(out[3] > least_rough ? out[3] : least_rough);
        bsdf->is_mirror = bsdf->rough < BSDF_MIRROR_ROUGH;
        bsdf->alpha = bsdf->rough * bsdf->rough;
        if (kind == MATERIAL_METAL) {
            init_metal(bsdf, cosine);
        } else {
            init_gloss(bsdf, out[4], cosine);
        }
    }
    return true;
}

static double fresnel(const Bsdf *bsdf, int c, double s) {
    double f0 = bsdf->kind == MATERIAL_METAL ? bsdf->color[c] : bsdf->f0;
    double f = f0 + (1 - f0) * s;
    return bsdf->kind == MATERIAL_METAL ? f * bsdf->boost[c] : f;
}

// Times wi.z, divided by it: the base's light per pi.
static double base_passes(const Bsdf *bsdf, double cosine) {
    if (bsdf->kind == MATERIAL_MATTE) {
        return 1;
    }
    double rest = 1 - bsdf->mean_returned;
    return rest > 0 ? (1 - bsdf->returned) * (1 - coat_returns(bsdf, cosine)) / rest : 0;
}

void bsdf_eval(const Bsdf *bsdf, Vec3 wo, Vec3 wi, double diffuse[3], double specular[3],
               double *density) {
    double cosine = wi.z / SAMPLING_PI, passes = 0, share = 0, s = 0;
    *density = 0;
    if (bsdf_has_diffuse(bsdf) && wi.z > 0) {
        passes = base_passes(bsdf, wi.z) * cosine;
        *density += (1 - bsdf->choose) * cosine;
    }
    if (bsdf_has_specular(bsdf) && !bsdf->is_mirror && wi.z > 0) {
        Vec3 h = vec3_normalize(vec3_add(wo, wi));
        double facets = ggx_d(h, bsdf->alpha) / (4 * wo.z);
        share = facets * ggx_g2(wo, wi, bsdf->alpha);
        s = schlick(vec3_dot(wo, h));
        *density += bsdf->choose * facets * ggx_g1(wo, bsdf->alpha);
    }
    for (int c = 0; c < 3; c++) {
        diffuse[c] = bsdf->color[c] * passes;
        specular[c] = share > 0 ? fresnel(bsdf, c, s) * share : 0;
    }
}

static bool sample_mirror(const Bsdf *bsdf, Vec3 wo, BsdfSample *sample) {
    sample->wi = vec3(-wo.x, -wo.y, wo.z);
    sample->density = 0;
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = fresnel(bsdf, c, schlick(wo.z)) / bsdf->choose;
        sample->specular[c] = sample->weight[c];
    }
    return true;
}

// A single lobe has closed forms, in which what is nearly 0/0 cancels: white matte returns all.
static bool sample_matte(const Bsdf *bsdf, BsdfSample *sample) {
    sample->density = sample->wi.z / SAMPLING_PI;
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = bsdf->color[c];
        sample->specular[c] = 0;
    }
    return sample->wi.z > 0;
}

static bool sample_metal(const Bsdf *bsdf, Vec3 wo, Vec3 h, BsdfSample *sample) {
    double g1 = ggx_g1(wo, bsdf->alpha), share = ggx_g2(wo, sample->wi, bsdf->alpha) / g1;
    double s = schlick(vec3_dot(wo, h));
    sample->density = ggx_d(h, bsdf->alpha) * g1 / (4 * wo.z);
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = sample->specular[c] = fresnel(bsdf, c, s) * share;
    }
    return true;
}

bool bsdf_sample(const Bsdf *bsdf, Vec3 wo, const double u[3], BsdfSample *sample) {
    if (bsdf->kind == MATERIAL_GLOW) {
        return false;
    }
    bool is_specular = u[2] < bsdf->choose;
    if (is_specular && bsdf->is_mirror) {
        return sample_mirror(bsdf, wo, sample);
    }
    Vec3 h = vec3(0, 0, 1);
    if (is_specular) {
        h = ggx_sample(wo, bsdf->alpha, u[0], u[1]);
        sample->wi = ggx_reflect(wo, h);
    } else {
        sample->wi = sampling_cosine(u[0], u[1]);
    }
    if (!(sample->wi.z > 0)) {
        return false;
    }
    if (bsdf->kind == MATERIAL_MATTE) {
        return sample_matte(bsdf, sample);
    }
    if (bsdf->kind == MATERIAL_METAL) {
        return sample_metal(bsdf, wo, h, sample);
    }
    double diffuse[3];
    bsdf_eval(bsdf, wo, sample->wi, diffuse, sample->specular, &sample->density);
    if (!(sample->density > 0)) {
        return false;
    }
    for (int c = 0; c < 3; c++) {
        sample->specular[c] /= sample->density;
        sample->weight[c] = diffuse[c] / sample->density + sample->specular[c];
    }
    return true;
}
