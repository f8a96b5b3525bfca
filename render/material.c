// SPDX-License-Identifier: Apache-2.0
// Programs of materials, run at points of surfaces.
#include "render/material.h"

#include <string.h>

static void set_ones(double out[BSDF_MAX_OUT]) {
    for (int i = 0; i < BSDF_MAX_OUT; i++) {
        out[i] = 1;
    }
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

void materials_init(Materials *materials, Arena *arena, const Scene *scene) {
    const double in[IN_COUNT] = {0};
    uint32_t n = scene->n_materials;
    *materials = (Materials){.all = scene->materials, .n = n};
    materials->values = arena_array(arena, n, sizeof *materials->values);
    materials->is_constant = ARENA_ARRAY(arena, n, bool);
    for (uint32_t i = 0; i < n; i++) {
        const Material *material = &scene->materials[i];
        materials->has_glow |= material->kind == MATERIAL_GLOW;
        materials->has_holes |= material->opacity != NULL;
        materials->is_constant[i] = program_is_constant(material->program);
        set_ones(materials->values[i]);
        if (materials->is_constant[i]) {
            program_run1(material->program, in, materials->values[i]);
        }
    }
    make_table(materials, arena);
}

// ---- At a point

static void set_inputs(const SurfacePoint *point, double seconds, double in[IN_COUNT]) {
    memset(in, 0, IN_COUNT * sizeof *in);
    in[IN_T] = in[IN_FILM_T] = seconds;
    in[IN_U] = point->u;
    in[IN_V] = point->v;
    const Vec3 values[4] = {point->p, point->n, point->P, point->N};
    static const Input first[4] = {IN_PX, IN_NX, IN_WX, IN_WNX};
    for (int i = 0; i < 4; i++) {
        in[first[i]] = values[i].x;
        in[first[i] + 1] = values[i].y;
        in[first[i] + 2] = values[i].z;
    }
    for (uint32_t i = 0; i < point->shape->n_loops; i++) {
        in[IN_LOOP0 + i] = point->loops[i];
    }
}

void material_values(const Materials *materials, uint32_t material, const SurfacePoint *point,
                     double seconds, double out[BSDF_MAX_OUT]) {
    if (materials->is_constant[material]) {
        memcpy(out, materials->values[material], BSDF_MAX_OUT * sizeof *out);
        return;
    }
    double in[IN_COUNT];
    set_ones(out);
    set_inputs(point, seconds, in);
    program_run1(materials->all[material].program, in, out);
}

static double clamp01(double x) {
    return x > 0 ? x < 1 ? x : 1 : 0; // NaN: 0
}

uint32_t material_choose(const Materials *materials, uint32_t material, const SurfacePoint *point,
                         double seconds, double *u) {
    while (materials->all[material].kind == MATERIAL_MIX) {
        double out[BSDF_MAX_OUT];
        material_values(materials, material, point, seconds, out);
        double share = clamp01(out[0]);
        bool is_second = *u < share;
        *u = is_second ? *u / share : (*u - share) / (1 - share);
        material = materials->all[material].parts[is_second];
    }
    return material;
}

double material_opacity(const Materials *materials, uint32_t material, const SurfacePoint *point,
                        double seconds) {
    const Material *m = &materials->all[material];
    if (m->kind == MATERIAL_MIX) {
        double out[BSDF_MAX_OUT];
        material_values(materials, material, point, seconds, out);
        double share = clamp01(out[0]);
        return (1 - share) * material_opacity(materials, m->parts[0], point, seconds) +
               share * material_opacity(materials, m->parts[1], point, seconds);
    }
    double in[IN_COUNT], opacity = 1;
    if (m->opacity) {
        set_inputs(point, seconds, in);
        program_run1(m->opacity, in, &opacity);
    }
    return clamp01(opacity);
}
