// SPDX-License-Identifier: Apache-2.0
// Matte, metal, gloss, glass and glow.
#include "render/bsdf.h"

#include "render/ggx.h"
#include "render/sampling.h"

static double clamp01(double x) {
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static double max3(const double *v) {
    double m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

int bsdf_n_out(MaterialKind kind) {
    static const int n[] = {[MATERIAL_MATTE] = 3, [MATERIAL_METAL] = 4, [MATERIAL_GLOSS] = 5,
                            [MATERIAL_GLOW] = 4,  [MATERIAL_GLASS] = 6, [MATERIAL_MIX] = 1};
    return n[kind];
}

// The share of light along one direction that a coat of reflectance f0 returns.
static double coat_returns(const Bsdf *bsdf, double cosine) {
    if (bsdf->is_mirror) {
        return bsdf->f0 + (1 - bsdf->f0) * ggx_schlick(cosine);
    }
    return bsdf->f0 * bsdf_table_at(bsdf->table->plain, bsdf->rough, cosine) +
           (1 - bsdf->f0) * bsdf_table_at(bsdf->table->grazing, bsdf->rough, cosine);
}

static double coat_mean(const Bsdf *bsdf) {
    if (bsdf->is_mirror) {
        return bsdf->f0 + (1 - bsdf->f0) / 21; // twice the integral of (1 - x)^5 x is 1/21
    }
    return bsdf->f0 * bsdf_table_mean(bsdf->table->mean_plain, bsdf->rough) +
           (1 - bsdf->f0) * bsdf_table_mean(bsdf->table->mean_grazing, bsdf->rough);
}

static void init_metal(Bsdf *bsdf, const double edge[3], double cosine) {
    bsdf->choose = 1;
    double loss = 0;
    if (!bsdf->is_mirror) {
        loss = 1 / bsdf_table_at(bsdf->table->plain, bsdf->rough, cosine) - 1;
        loss = loss > 0 ? loss : 0;
    }
    for (int c = 0; c < 3; c++) {
        bsdf->metal[c] = fresnel_metal(bsdf->color[c], clamp01(edge[c]));
        bsdf->boost[c] = 1 + bsdf->color[c] * loss;
    }
}

// A whole pane, two surfaces, tints by the color.
static void init_glass(Bsdf *bsdf, double ior, double depth, bool is_inside, double cosine) {
    ior = ior > 1 ? ior : 1;
    bsdf->eta = is_inside ? 1 / ior : ior;
    bsdf->is_mirror |= ior - 1 < 1e-4; // facets would not turn what passes
    double kept =
        bsdf->is_mirror ? 1 : bsdf_table_glass(bsdf->table, ior, is_inside, bsdf->rough, cosine);
    for (int c = 0; c < 3; c++) {
        bsdf->tint[c] = depth > 0 ? 1 : sqrt(bsdf->color[c]);
        bsdf->boost[c] = kept < 1 ? 1 / kept : 1;
    }
}

static void init_gloss(Bsdf *bsdf, double ior, double cosine) {
    bsdf->f0 = ior > 0 ? fresnel_normal(ior) : 1;
    bsdf->returned = coat_returns(bsdf, cosine);
    bsdf->mean_returned = coat_mean(bsdf);
    double base = (1 - bsdf->returned) * max3(bsdf->color);
    bsdf->choose = bsdf->returned + base > 0 ? bsdf->returned / (bsdf->returned + base) : 1;
}

static double rough_of(MaterialKind kind, const double *out, double least_rough) {
    double rough = out[kind == MATERIAL_GLASS ? 4 : 3];
    return clamp01(rough > least_rough ? rough : least_rough);
}

bool bsdf_init(Bsdf *bsdf, MaterialKind kind, const double out[BSDF_MAX_OUT], bool is_inside,
               double least_rough, double cosine, const BsdfTable *table) {
    int n = kind == MATERIAL_METAL ? BSDF_MAX_OUT : bsdf_n_out(kind);
    for (int i = 0; i < n; i++) {
        if (!isfinite(out[i])) {
            return false;
        }
    }
    *bsdf = (Bsdf){.kind = kind, .table = table};
    for (int c = 0; c < 3; c++) {
        bsdf->color[c] = clamp01(out[c]);
    }
    if (bsdf_has_specular(bsdf)) {
        bsdf->rough = rough_of(kind, out, least_rough);
        bsdf->is_mirror = bsdf->rough < BSDF_MIRROR_ROUGH;
        bsdf->alpha = bsdf->rough * bsdf->rough;
    }
    switch (kind) {
    case MATERIAL_GLOW:
        for (int c = 0; c < 3; c++) {
            bsdf->emission[c] = out[c] > 0 && out[3] > 0 ? out[c] * out[3] : 0;
        }
        break;
    case MATERIAL_METAL:
        init_metal(bsdf, out + 4, cosine);
        break;
    case MATERIAL_GLOSS:
        init_gloss(bsdf, out[4], cosine);
        break;
    case MATERIAL_GLASS:
        init_glass(bsdf, out[3], out[5], is_inside, cosine);
        break;
    case MATERIAL_MATTE:
    case MATERIAL_MIX:
        break;
    }
    return true;
}

bool bsdf_absorption(const double out[BSDF_MAX_OUT], double per_metre[3]) {
    const double least = 1e-30; // black glass takes all within a hundredth of its depth
    for (int c = 0; c < 3; c++) {
        double color = clamp01(out[c]);
        per_metre[c] = -program_fold(OP_LOG, color > least ? color : least, 0, 0) / out[5];
    }
    return out[5] > 0;
}

// What a facet reflects that is seen under this cosine.
static double fresnel(const Bsdf *bsdf, int c, double cosine) {
    return bsdf->kind == MATERIAL_METAL
               ? bsdf->boost[c] * fresnel_conductor(cosine, &bsdf->metal[c])
               : bsdf->f0 + (1 - bsdf->f0) * ggx_schlick(cosine);
}

// Times wi.z, divided by it: the base's light per pi.
static double base_passes(const Bsdf *bsdf, double cosine) {
    if (bsdf->kind == MATERIAL_MATTE) {
        return 1;
    }
    double rest = 1 - bsdf->mean_returned;
    return rest > 0 ? (1 - bsdf->returned) * (1 - coat_returns(bsdf, cosine)) / rest : 0;
}

// ---- Glass

// The facet that sends light from wi to wo; false: none does.
static bool glass_facet(const Bsdf *bsdf, Vec3 wo, Vec3 wi, Vec3 *h) {
    bool is_reflected = wi.z > 0;
    *h = vec3_normalize(vec3_madd(wo, is_reflected ? 1 : bsdf->eta, wi));
    *h = h->z < 0 ? vec3_scale(*h, -1) : *h;
    return vec3_dot(wo, *h) > 0 && (is_reflected || vec3_dot(wi, *h) < 0);
}

// The density of bsdf_sample, which the light is but for shadowing (Walter et al. 2007, equations
// 14 and 17).
static double glass_density(const Bsdf *bsdf, Vec3 wo, Vec3 wi, Vec3 h) {
    double cosine = vec3_dot(wo, h), f = fresnel_dielectric(cosine, bsdf->eta);
    double facets = ggx_d(h, bsdf->alpha) * ggx_g1(wo, bsdf->alpha) / wo.z;
    if (wi.z > 0) {
        return f * facets / 4;
    }
    double beyond = -vec3_dot(wi, h), sum = cosine - bsdf->eta * beyond;
    return (1 - f) * facets * cosine * bsdf->eta * bsdf->eta * beyond / (sum * sum);
}

static double glass_share(const Bsdf *bsdf, Vec3 wo, Vec3 wi) {
    return bsdf->boost[0] * ggx_g2(wo, wi, bsdf->alpha) / ggx_g1(wo, bsdf->alpha);
}

static void eval_glass(const Bsdf *bsdf, Vec3 wo, Vec3 wi, double specular[3], double *density) {
    Vec3 h;
    specular[0] = specular[1] = specular[2] = *density = 0;
    if (bsdf->is_mirror || wi.z == 0 || !glass_facet(bsdf, wo, wi, &h)) {
        return;
    }
    *density = glass_density(bsdf, wo, wi, h);
    double value = *density * glass_share(bsdf, wo, wi);
    for (int c = 0; c < 3; c++) {
        specular[c] = wi.z > 0 ? value : value * bsdf->tint[c];
    }
}

static bool sample_glass(const Bsdf *bsdf, Vec3 wo, const double u[3], BsdfSample *sample) {
    Vec3 h = bsdf->is_mirror ? vec3(0, 0, 1) : ggx_sample(wo, bsdf->alpha, u[0], u[1]);
    bool is_reflected = u[2] < fresnel_dielectric(vec3_dot(wo, h), bsdf->eta);
    if (is_reflected) {
        sample->wi = ggx_reflect(wo, h);
    } else if (!ggx_refract(wo, h, bsdf->eta, &sample->wi)) {
        return false;
    }
    if (is_reflected ? !(sample->wi.z > 0) : !(sample->wi.z < 0)) {
        return false;
    }
    sample->density = bsdf->is_mirror ? 0 : glass_density(bsdf, wo, sample->wi, h);
    double share = bsdf->is_mirror ? 1 : glass_share(bsdf, wo, sample->wi);
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = sample->specular[c] = is_reflected ? share : share * bsdf->tint[c];
    }
    return bsdf->is_mirror || sample->density > 0;
}

// ---- All kinds

void bsdf_eval(const Bsdf *bsdf, Vec3 wo, Vec3 wi, double diffuse[3], double specular[3],
               double *density) {
    double cosine = wi.z / SAMPLING_PI, passes = 0, share = 0, facing = 1;
    *density = 0;
    if (bsdf->kind == MATERIAL_GLASS) {
        diffuse[0] = diffuse[1] = diffuse[2] = 0;
        eval_glass(bsdf, wo, wi, specular, density);
        return;
    }
    if (bsdf_has_diffuse(bsdf) && wi.z > 0) {
        passes = base_passes(bsdf, wi.z) * cosine;
        *density += (1 - bsdf->choose) * cosine;
    }
    if (bsdf_has_specular(bsdf) && !bsdf->is_mirror && wi.z > 0) {
        Vec3 h = vec3_normalize(vec3_add(wo, wi));
        double facets = ggx_d(h, bsdf->alpha) / (4 * wo.z);
        share = facets * ggx_g2(wo, wi, bsdf->alpha);
        facing = vec3_dot(wo, h);
        *density += bsdf->choose * facets * ggx_g1(wo, bsdf->alpha);
    }
    for (int c = 0; c < 3; c++) {
        diffuse[c] = bsdf->color[c] * passes;
        specular[c] = share > 0 ? fresnel(bsdf, c, facing) * share : 0;
    }
}

static bool sample_mirror(const Bsdf *bsdf, Vec3 wo, BsdfSample *sample) {
    sample->wi = vec3(-wo.x, -wo.y, wo.z);
    sample->density = 0;
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = fresnel(bsdf, c, wo.z) / bsdf->choose;
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
    double facing = vec3_dot(wo, h);
    sample->density = ggx_d(h, bsdf->alpha) * g1 / (4 * wo.z);
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = sample->specular[c] = fresnel(bsdf, c, facing) * share;
    }
    return true;
}

bool bsdf_sample(const Bsdf *bsdf, Vec3 wo, const double u[3], BsdfSample *sample) {
    if (bsdf->kind == MATERIAL_GLOW) {
        return false;
    }
    if (bsdf->kind == MATERIAL_GLASS) {
        return sample_glass(bsdf, wo, u, sample);
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
