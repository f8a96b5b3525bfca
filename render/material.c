// SPDX-License-Identifier: Apache-2.0
// Programs of materials, run at points of surfaces.
#include "render/material.h"

#include <string.h>

#include "render/sampling.h"

static void set_ones(double out[BSDF_MAX_OUT]) {
    for (int i = 0; i < BSDF_MAX_OUT; i++) {
        out[i] = 1;
    }
}

// ---- At a point

enum { N_PLACES = 3 };

typedef double PlaceInputs[IN_COUNT][N_PLACES];

// Those that differ from place to place.
static const uint32_t point_inputs =
    3u << IN_U | 7u << IN_PX | 7u << IN_NX | 7u << IN_WX | 7u << IN_WNX;

static void set_point(const SurfacePoint *point, int k, PlaceInputs in) {
    in[IN_U][k] = point->u;
    in[IN_V][k] = point->v;
    const Vec3 values[4] = {point->p, point->n, point->P, point->N};
    static const Input first[4] = {IN_PX, IN_NX, IN_WX, IN_WNX};
    for (int i = 0; i < 4; i++) {
        in[first[i]][k] = values[i].x;
        in[first[i] + 1][k] = values[i].y;
        in[first[i] + 2][k] = values[i].z;
    }
}

// out[n][N_PLACES]; where there is nothing beside the place, it alone.
static void run_places(const Program *program, const MaterialPlace *place,
                       double (*out)[N_PLACES]) {
    PlaceInputs in;
    double *outs[BSDF_MAX_OUT];
    ProgramInputs inputs = {.varying = point_inputs, .are_neighbours = place->beside != NULL};
    memset(in, 0, sizeof in);
    in[IN_T][0] = in[IN_FILM_T][0] = place->seconds;
    for (int k = 0; k < (place->beside ? N_PLACES : 1); k++) {
        set_point(k ? &place->beside[k - 1] : place->point, k, in);
    }
    for (uint32_t i = 0; i < place->point->shape->n_loops; i++) {
        in[IN_LOOP0 + i][0] = place->point->loops[i];
    }
    for (int i = 0; i < IN_COUNT; i++) {
        inputs.at[i] = in[i];
    }
    for (uint32_t i = 0; i < program_n_out(program); i++) {
        outs[i] = out[i];
    }
    program_run(program, &inputs, place->beside ? N_PLACES : 1, outs);
}

// At the place itself.
static void run_program(const Program *program, const MaterialPlace *place, double *out) {
    double in[IN_COUNT] = {0};
    if (place->beside && program_has_images(program)) {
        double all[BSDF_MAX_OUT][N_PLACES];
        run_places(program, place, all);
        for (uint32_t i = 0; i < program_n_out(program); i++) {
            out[i] = all[i][0];
        }
        return;
    }
    PlaceInputs points = {{0}};
    set_point(place->point, 0, points);
    for (int i = 0; i < IN_COUNT; i++) {
        in[i] = points[i][0];
    }
    in[IN_T] = in[IN_FILM_T] = place->seconds;
    for (uint32_t i = 0; i < place->point->shape->n_loops; i++) {
        in[IN_LOOP0 + i] = place->point->loops[i];
    }
    program_run1(program, in, out);
}

void material_values(const Materials *materials, uint32_t material, const MaterialPlace *place,
                     double out[BSDF_MAX_OUT]) {
    if (materials->is_constant[material]) {
        memcpy(out, materials->values[material], BSDF_MAX_OUT * sizeof *out);
        return;
    }
    set_ones(out);
    run_program(materials->all[material].program, place, out);
}

static double clamp01(double x) {
    return x > 0 ? x < 1 ? x : 1 : 0; // NaN: 0
}

uint32_t material_choose(const Materials *materials, uint32_t material, const MaterialPlace *place,
                         double *u) {
    while (materials->all[material].kind == MATERIAL_MIX) {
        double out[BSDF_MAX_OUT];
        material_values(materials, material, place, out);
        double share = clamp01(out[0]);
        bool is_second = *u < share;
        *u = is_second ? *u / share : (*u - share) / (1 - share);
        material = materials->all[material].parts[is_second];
    }
    return material;
}

static double opacity_of(const Material *material, const MaterialPlace *place) {
    double opacity = 1;
    if (material->opacity) {
        run_program(material->opacity, place, &opacity);
    }
    return clamp01(opacity);
}

double material_opacity(const Materials *materials, uint32_t material, const MaterialPlace *place) {
    const Material *m = &materials->all[material];
    if (m->kind == MATERIAL_MIX) {
        double out[BSDF_MAX_OUT];
        material_values(materials, material, place, out);
        double share = clamp01(out[0]);
        return (1 - share) * material_opacity(materials, m->parts[0], place) +
               share * material_opacity(materials, m->parts[1], place);
    }
    return opacity_of(m, place);
}

// Adds its share of the light.
static bool add_glow(const Materials *materials, uint32_t material, const MaterialPlace *place,
                     double share, bool *bad, double radiance[3]) {
    const Material *m = &materials->all[material];
    double out[BSDF_MAX_OUT];
    if (!(share > 0) || (m->kind != MATERIAL_GLOW && m->kind != MATERIAL_MIX)) {
        return true;
    }
    material_values(materials, material, place, out);
    if (m->kind == MATERIAL_MIX) {
        double second = clamp01(out[0]);
        return add_glow(materials, m->parts[0], place, share * (1 - second), bad, radiance) &&
               add_glow(materials, m->parts[1], place, share * second, bad, radiance);
    }
    Bsdf bsdf;
    if (!bsdf_init(&bsdf, m->kind, out, false, 0, 1, NULL)) {
        if (bad) {
            bad[material] = true;
        }
        return false;
    }
    share *= opacity_of(m, place);
    for (int c = 0; c < 3; c++) {
        radiance[c] += share * bsdf.emission[c];
    }
    return true;
}

bool material_glow(const Materials *materials, uint32_t material, const MaterialPlace *place,
                   bool *bad, double radiance[3]) {
    bool is_even = materials->is_even[material];
    for (int c = 0; c < 3; c++) {
        radiance[c] = is_even ? materials->glow[material][c] : 0;
    }
    return is_even || add_glow(materials, material, place, 1, bad, radiance);
}

// ---- The table of a scene's rough materials

// Adds an index of refraction that is not among the n; false: there are too many.
static bool add_ior(double iors[BSDF_IORS], uint32_t *n, double ior) {
    ior = ior > 1 ? ior : 1;
    for (uint32_t i = 0; i < *n; i++) {
        if (iors[i] == ior) {
            return true;
        }
    }
    if (*n == BSDF_IORS || !isfinite(ior)) {
        return false;
    }
    iors[(*n)++] = ior;
    return true;
}

// Smooth glass too: beyond a rough surface it counts as rough (render/path.h).
static void make_table(Materials *materials, Arena *arena) {
    double iors[BSDF_IORS];
    uint32_t n_iors = 0;
    bool is_rough = false, is_glass = false, are_known = true;
    for (uint32_t i = 0; i < materials->n; i++) {
        MaterialKind kind = materials->all[i].kind;
        is_rough |= kind == MATERIAL_METAL || kind == MATERIAL_GLOSS || kind == MATERIAL_GLASS;
        if (kind == MATERIAL_GLASS) {
            is_glass = true;
            are_known = are_known && materials->is_constant[i] &&
                        add_ior(iors, &n_iors, materials->values[i][3]);
        }
    }
    if (is_rough) {
        BsdfTable *table = bsdf_table_new(arena);
        if (is_glass) {
            bsdf_table_add_glass(table, arena, iors, are_known ? n_iors : 0);
        }
        materials->table = table;
    }
}

static bool looks_around(const Materials *materials, const Material *material) {
    return material->height || material->normal || program_has_images(material->program) ||
           (material->opacity && program_has_images(material->opacity)) ||
           (material->kind == MATERIAL_MIX && (materials->looks_around[material->parts[0]] ||
                                               materials->looks_around[material->parts[1]]));
}

// Whether it gives light, and the same everywhere. Its parts, and its own values, are known.
static void find_glow(Materials *materials, uint32_t i) {
    const Material *material = &materials->all[i];
    const uint32_t *parts = material->parts;
    bool is_mix = material->kind == MATERIAL_MIX;
    materials->is_even[i] = is_mix ? materials->is_constant[i] && materials->is_even[parts[0]] &&
                                         materials->is_even[parts[1]]
                                   : material->kind != MATERIAL_GLOW ||
                                         (materials->is_constant[i] && !material->opacity);
    materials->glows[i] = is_mix ? materials->glows[parts[0]] || materials->glows[parts[1]]
                                 : material->kind == MATERIAL_GLOW;
    if (materials->is_even[i]) {
        double *glow = materials->glow[i];
        materials->glows[i] = add_glow(materials, i, NULL, 1, NULL, glow) &&
                              (glow[0] > 0 || glow[1] > 0 || glow[2] > 0);
    }
    materials->has_glow |= materials->glows[i];
}

void materials_init(Materials *materials, Arena *arena, const Scene *scene) {
    const double in[IN_COUNT] = {0};
    uint32_t n = scene->n_materials;
    *materials = (Materials){.all = scene->materials, .n = n};
    materials->values = arena_array(arena, n, sizeof *materials->values);
    materials->glow = arena_array(arena, n, sizeof *materials->glow);
    materials->is_constant = ARENA_ARRAY(arena, n, bool);
    materials->glows = ARENA_ARRAY(arena, n, bool);
    materials->is_even = ARENA_ARRAY(arena, n, bool);
    materials->looks_around = ARENA_ARRAY(arena, n, bool);
    for (uint32_t i = 0; i < n; i++) {
        const Material *material = &scene->materials[i];
        materials->has_holes |= material->opacity != NULL;
        materials->looks_around[i] = looks_around(materials, material);
        materials->needs_neighbours |= materials->looks_around[i];
        materials->is_constant[i] = program_is_constant(material->program);
        set_ones(materials->values[i]);
        if (materials->is_constant[i]) {
            program_run1(material->program, in, materials->values[i]);
        }
        find_glow(materials, i);
    }
    make_table(materials, arena);
}

// ---- Normals

void material_beside(const SurfacePoint *point, const SurfaceSlope *slope, Vec3 dir, double width,
                     SurfacePoint beside[2]) {
    const double least_cosine = 0.02; // at grazing what falls into a pixel has no end
    double cosine = vec3_dot(dir, point->Ng);
    Vec3 x, y, along = vec3_madd(dir, -cosine, point->Ng);
    sampling_frame(point->Ng, &x, &y);
    if (vec3_dot(along, along) > 1e-12) {
        x = vec3_normalize(along);
        y = vec3_cross(point->Ng, x);
    }
    const Vec3 side[2] = {vec3_scale(x, width / fmax(fabs(cosine), least_cosine)),
                          vec3_scale(y, width)};
    double e = vec3_dot(slope->P[0], slope->P[0]), f = vec3_dot(slope->P[0], slope->P[1]);
    double g = vec3_dot(slope->P[1], slope->P[1]), det = e * g - f * f;
    for (int k = 0; k < 2; k++) {
        double s = vec3_dot(slope->P[0], side[k]), t = vec3_dot(slope->P[1], side[k]);
        double a = det > 0 ? (g * s - f * t) / det : 0, b = det > 0 ? (e * t - f * s) / det : 0;
        SurfacePoint *q = &beside[k];
        *q = *point;
        q->P = vec3_madd(vec3_madd(q->P, a, slope->P[0]), b, slope->P[1]);
        q->p = vec3_madd(vec3_madd(q->p, a, slope->p[0]), b, slope->p[1]);
        q->n = vec3_normalize(vec3_madd(vec3_madd(q->n, a, slope->n[0]), b, slope->n[1]));
        q->u += a * slope->u[0] + b * slope->u[1];
        q->v += a * slope->v[0] + b * slope->v[1];
    }
}

// The normal of the surface raised by a height, from its differences (Mikkelsen, "Bump mapping
// unparametrized surfaces on the GPU", 2010): those beside lie at right angles.
static Vec3 bumped(const Program *height, const MaterialPlace *place, Vec3 n) {
    double h[1][N_PLACES];
    run_places(height, place, h);
    for (int k = 0; k < 2; k++) {
        Vec3 side = vec3_sub(place->beside[k].P, place->point->P);
        double rise = (h[0][k + 1] - h[0][0]) / vec3_dot(side, side);
        n = isfinite(rise) ? vec3_madd(n, -rise, side) : n;
    }
    return vec3_normalize(n);
}

static Vec3 mapped(const Program *normal, const MaterialPlace *place, const SurfaceSlope *slope,
                   Vec3 n) {
    double out[3];
    run_program(normal, place, out);
    double det = slope->u[0] * slope->v[1] - slope->u[1] * slope->v[0];
    // Where u grows, and v.
    Vec3 u = vec3_scale(vec3_madd(vec3_scale(slope->P[0], slope->v[1]), -slope->v[0], slope->P[1]),
                        1 / det);
    Vec3 v = vec3_scale(vec3_madd(vec3_scale(slope->P[1], slope->u[0]), -slope->u[1], slope->P[0]),
                        1 / det);
    Vec3 x = vec3_normalize(vec3_madd(u, -vec3_dot(u, n), n)), y = vec3_cross(n, x);
    y = vec3_dot(y, v) < 0 ? vec3_scale(y, -1) : y;
    Vec3 bent = vec3_normalize(
        sampling_to_world(x, y, n, vec3(2 * out[0] - 1, 2 * out[1] - 1, 2 * out[2] - 1)));
    return vec3_is_finite(bent) && vec3_dot(bent, bent) > 0 ? bent : n;
}

Vec3 material_normal(const Materials *materials, uint32_t material, const MaterialPlace *place,
                     const SurfaceSlope *slope, Vec3 dir) {
    const Material *m = &materials->all[material];
    const SurfacePoint *point = place->point;
    const double least = 0.01; // cosine: so far in sight at least
    Vec3 n = m->normal ? mapped(m->normal, place, slope, point->N) : point->N;
    n = m->height ? bumped(m->height, place, n) : n;
    double side = vec3_dot(point->Ng, dir) > 0 ? 1 : -1, seen = side * vec3_dot(n, dir);
    return seen >= least ? n : vec3_normalize(vec3_madd(n, side * (least - seen), dir));
}
