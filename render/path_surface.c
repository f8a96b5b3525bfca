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

double path_unhindered(PathTracer *tracer, Vec3 origin, Vec3 dir, double tmax) {
    const Materials *materials = &tracer->paths->materials;
    RayKind kind = path_ask_as(tracer, RAY_SHADOW);
    if (!materials->has_holes) {
        return world_occluded_of(tracer->view, kind, origin, dir, 0, tmax) ? 0 : 1;
    }
    double left = 1;
    for (int i = 0; i < MOST_LAYERS && left > 0; i++) {
        WorldHit hit;
        Vertex vertex;
        if (!world_closest_of(tracer->view, kind, origin, dir, 0, tmax, &hit)) {
            return left;
        }
        world_surface(tracer->view, origin, dir, &hit, &vertex.point);
        path_orient(&vertex, dir);
        const MaterialPlace place = {&vertex.point, NULL, tracer->seconds};
        left *= 1 - material_opacity(materials, vertex.point.material, &place);
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

// What lies beside the point, distance metres along the path's ray.
static void look_around(PathTracer *tracer, const Path *path, Vertex *vertex, const WorldHit *hit,
                        double distance) {
    const Materials *materials = &tracer->paths->materials;
    vertex->has_beside = materials->looks_around[vertex->point.material];
    if (vertex->has_beside) {
        world_surface_slope(tracer->view, hit, &vertex->point, &vertex->slope);
        material_beside(&vertex->point, &vertex->slope, path->dir,
                        path->width + path->spread * distance, vertex->beside);
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

bool path_goes_through(const PathTracer *tracer) {
    return tracer->paths->materials.has_holes || tracer->paths->is_selective;
}

static double luminance(const double color[3]) {
    return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
}

// The share of the light that reaches a catcher, of what would without anything in between.
static double lit_share(PathTracer *tracer, Path *path, const Vertex *vertex) {
    double u[SAMPLE_DIMENSIONS], all = 0, reached = 0;
    for (uint32_t i = 0; i <= tracer->lights.n; i++) {
        bool is_sky = i == tracer->lights.n;
        LightSample sample = {.distance = INFINITY};
        sampler_draw(path->sampler, path->index, SAMPLE_SET_CHANCE + path->n_chances++, u);
        if (is_sky) {
            Vec3 up = sampling_cosine(u[0], u[1]);
            sample.dir = sampling_to_world(vertex->x, vertex->y, vertex->N, up);
        } else if (!light_sample(&tracer->lights.lights[i], vertex->start, u[0], u[1], &sample)) {
            continue;
        }
        double weight = is_sky ? luminance(tracer->lights.sky) * SAMPLING_PI
                               : luminance(sample.weight) * vec3_dot(vertex->N, sample.dir);
        if (weight > 0 && vec3_dot(vertex->Ng, sample.dir) > 0) {
            double tmax = is_sky ? INFINITY : sample.distance * (1 - 1e-9);
            all += weight;
            tracer->counters.shadow_rays++;
            reached += weight * path_unhindered(tracer, vertex->start, sample.dir, tmax);
        }
    }
    return all > 0 ? reached / all : 1;
}

// Whether the path goes on behind the surface as if that were not there; else vertex->material is
// what it is there.
static bool is_gone_through(PathTracer *tracer, Path *path, Vertex *vertex) {
    const Materials *materials = &tracer->paths->materials;
    const SurfacePoint *point = &vertex->point;
    vertex->material = point->material;
    if (point->shape->is_catcher) {
        double share = lit_share(tracer, path, vertex);
        path->clear *= share;
        for (int c = 0; c < 3; c++) {
            path->weight[c] *= share;
            path->specular[c] *= share;
        }
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

bool path_next_surface(PathTracer *tracer, Path *path, Vertex *vertex, double *distance) {
    RayKind kind = path_ask_as(tracer, path->depth == 0 ? RAY_CAMERA : RAY_BOUNCE);
    Vec3 origin = path->origin;
    WorldHit hit;
    *distance = 0;
    for (int i = 0; i < MOST_LAYERS; i++) {
        if (!world_closest_of(tracer->view, kind, origin, path->dir, 0, INFINITY, &hit)) {
            *distance = INFINITY;
            return false;
        }
        world_surface(tracer->view, origin, path->dir, &hit, &vertex->point);
        path_orient(vertex, path->dir);
        *distance += hit.t;
        look_around(tracer, path, vertex, &hit, *distance);
        if (!is_gone_through(tracer, path, vertex)) {
            break;
        }
        origin = vertex->through;
    }
    return true;
}
