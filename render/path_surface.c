// SPDX-License-Identifier: Apache-2.0
// What rays meet: surfaces, holes in them, catchers.
#include <float.h>

#include "render/path_parts.h"
#include "render/sampling.h"

enum { MOST_LAYERS = 1024 }; // that one ray goes through

void path_orient(Vertex *vertex, Vec3 dir) {
    const SurfacePoint *point = &vertex->point;
    vertex->is_inside = vec3_dot(point->Ng, dir) > 0;
    double side = vertex->is_inside ? -1 : 1;
    vertex->Ng = vec3_scale(point->Ng, side);
    vertex->N = vec3_scale(point->N, side);
    const double least = 1e-6; // a view along the surface, as far as shading is concerned
    if (!(vec3_dot(vertex->N, dir) < -least)) {
        vertex->N = vertex->Ng;
    }
    sampling_frame(vertex->N, &vertex->x, &vertex->y);
    double cosine = -vec3_dot(vertex->N, dir);
    vertex->wo =
        vec3(-vec3_dot(vertex->x, dir), -vec3_dot(vertex->y, dir), cosine > least ? cosine : least);
    Vec3 P = point->P;
    double largest = fmax(fabs(P.x), fmax(fabs(P.y), fabs(P.z)));
    double away = point->error + 4 * DBL_EPSILON * largest;
    vertex->start = vec3_madd(P, away, vertex->Ng);
    vertex->through = vec3_madd(P, -away, vertex->Ng);
}

RayKind path_ask_as(const PathTracer *tracer, RayKind kind) {
    return tracer->paths->is_selective ? kind : RAY_ANY;
}

bool path_goes_through(const PathTracer *tracer) {
    return tracer->paths->materials.has_holes || tracer->paths->is_selective;
}

// The first thing on the way to an emitter may be the emitter itself: from afar a ray meets a small
// ball a little before or beside the point that was drawn.
double path_unhindered(PathTracer *tracer, Vec3 origin, Vec3 dir, double tmax,
                       const Emitter *emitter) {
    const Materials *materials = &tracer->paths->materials;
    RayKind kind = path_ask_as(tracer, emitter ? RAY_BOUNCE : RAY_SHADOW);
    tracer->counters.shadow_rays++;
    if (!materials->has_holes && !emitter) {
        return world_occluded_of(tracer->view, kind, origin, dir, 0, tmax) ? 0 : 1;
    }
    double left = 1;
    for (int i = 0; i < MOST_LAYERS && left > 0; i++) {
        WorldHit hit;
        Vertex vertex;
        if (!world_closest_of(tracer->view, kind, origin, dir, 0, tmax, &hit) ||
            (emitter && hit.body == emitter->body && hit.at == emitter->prim)) {
            return left;
        }
        if (!path_goes_through(tracer)) {
            return 0;
        }
        world_surface(tracer->view, origin, dir, &hit, &vertex.point);
        path_orient(&vertex, dir);
        const MaterialPlace place = {&vertex.point, NULL, tracer->seconds};
        if (!vertex.point.shape->is_catcher) {
            left *= 1 - material_opacity(materials, vertex.point.material, &place);
        }
        origin = vertex.through;
        tmax -= hit.t;
    }
    return 0;
}

// A number in [0, 1) that decides what a surface is.
static double draw_chance(Path *path) {
    double u[SAMPLE_DIMENSIONS];
    sampler_draw(path->sampler, path->index, SAMPLE_SET_CHANCE + path->n_chances++, u);
    return u[0];
}

static MaterialPlace place_of(const PathTracer *tracer, const Vertex *vertex) {
    return (MaterialPlace){&vertex->point, vertex->has_beside ? vertex->beside : NULL,
                           tracer->seconds};
}

// What lies beside the point, along the path's ray.
static void look_around(PathTracer *tracer, const Path *path, Vertex *vertex, const WorldHit *hit) {
    const Materials *materials = &tracer->paths->materials;
    vertex->has_beside = materials->looks_around[vertex->point.material];
    if (vertex->has_beside) {
        world_surface_slope(tracer->view, hit, &vertex->point, &vertex->slope);
        material_beside(&vertex->point, &vertex->slope, path->dir,
                        path->width + path->spread * vertex->distance, vertex->beside);
    }
}

bool path_set_material(PathTracer *tracer, const Path *path, Vertex *vertex) {
    const Materials *materials = &tracer->paths->materials;
    uint32_t material = vertex->material;
    const MaterialPlace place = place_of(tracer, vertex);
    material_values(materials, material, &place, vertex->values);
    if (materials->all[material].height || materials->all[material].normal) {
        vertex->point.N = material_normal(materials, material, &place, &vertex->slope, path->dir);
        path_orient(vertex, path->dir);
    }
    if (!bsdf_init(&vertex->bsdf, materials->all[material].kind, vertex->values, vertex->is_inside,
                   path->has_scattered ? PATH_ROUGH : 0, vertex->wo.z, materials->table)) {
        tracer->troubles.materials[material] = true;
        return false;
    }
    return true;
}

// Whether the path goes on behind the surface as if that were not there; else vertex->material is
// what it is there.
static bool is_gone_through(PathTracer *tracer, Path *path, Vertex *vertex) {
    const Materials *materials = &tracer->paths->materials;
    const SurfacePoint *point = &vertex->point;
    vertex->material = point->material;
    if (point->shape->is_catcher) {
        path->shade *= path_lit_share(tracer, path, vertex);
        return true;
    }
    const Material *material = &materials->all[vertex->material];
    if (!material->opacity && material->kind != MATERIAL_MIX) {
        return false;
    }
    double u = draw_chance(path);
    const MaterialPlace place = place_of(tracer, vertex);
    vertex->material = material_choose(materials, point->material, &place, &u);
    return materials->all[vertex->material].opacity &&
           !(u < material_opacity(materials, vertex->material, &place));
}

bool path_next_surface(PathTracer *tracer, Path *path, Vertex *vertex) {
    RayKind kind = path_ask_as(tracer, path->depth == 0 ? RAY_CAMERA : RAY_BOUNCE);
    Vec3 origin = path->origin;
    WorldHit hit;
    vertex->distance = 0;
    for (int i = 0; i < MOST_LAYERS; i++) {
        if (!world_closest_of(tracer->view, kind, origin, path->dir, 0, INFINITY, &hit)) {
            vertex->distance = INFINITY;
            return false;
        }
        world_surface(tracer->view, origin, path->dir, &hit, &vertex->point);
        path_orient(vertex, path->dir);
        vertex->distance += hit.t;
        vertex->object = hit.object;
        vertex->emitter = emitter_of(&tracer->paths->choice.emitters, &hit);
        look_around(tracer, path, vertex, &hit);
        if (!is_gone_through(tracer, path, vertex)) {
            break;
        }
        origin = vertex->through;
    }
    return true;
}

bool path_leave(const Vertex *vertex, Vec3 dir, bool is_through, Vec3 *start) {
    double above = vec3_dot(dir, vertex->Ng);
    *start = is_through ? vertex->through : vertex->start;
    return is_through ? above < 0 : above > 0;
}

Medium path_medium(const Path *path, const Vertex *vertex, bool is_through) {
    if (!is_through) {
        return path->medium;
    }
    Medium medium = {.absorbs = false};
    medium.absorbs = vertex->bsdf.kind == MATERIAL_GLASS && !vertex->is_inside &&
                     bsdf_absorption(vertex->values, medium.per_metre);
    return medium;
}

double path_medium_left(const Medium *medium, int color, double distance) {
    return medium->absorbs && medium->per_metre[color] > 0
               ? program_fold(OP_EXP, -medium->per_metre[color] * distance, 0, 0)
               : 1;
}
