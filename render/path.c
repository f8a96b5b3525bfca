// SPDX-License-Identifier: Apache-2.0
// The path tracer.
#include "render/path.h"

#include <string.h>

#include "render/path_parts.h"
#include "render/sampling.h"
#include "render/shutter.h"

enum { ROULETTE_AFTER = 4 };

static bool reads_time(const Program *program) {
    return program_reads(program, IN_T) || program_reads(program, IN_FILM_T);
}

static bool shape_is_moving(const Shape *shape) {
    return shape->track || reads_time(shape->vertex) || reads_time(shape->geometry) ||
           reads_time(shape->transform) || reads_time(shape->visible) ||
           reads_time(shape->seen[RAY_CAMERA]) || reads_time(shape->seen[RAY_SHADOW]) ||
           reads_time(shape->seen[RAY_BOUNCE]);
}

static bool lights_are_moving(const Scene *scene) {
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        if (light_is_moving(&scene->lights[i])) {
            return true;
        }
    }
    return false;
}

bool path_scene_is_moving(const Scene *scene) {
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        if (shape_is_moving(&scene->shapes[i])) {
            return true;
        }
    }
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        if (reads_time(scene->materials[i].program) || reads_time(scene->materials[i].opacity) ||
            reads_time(scene->materials[i].height) || reads_time(scene->materials[i].normal)) {
            return true;
        }
    }
    return reads_time(scene->camera.program) || lights_are_moving(scene);
}

void path_scene_init(PathScene *paths, Arena *arena, const Scene *scene) {
    *paths = (PathScene){.scene = scene, .lights_move = lights_are_moving(scene)};
    filter_init(&paths->filter, scene->film.filter);
    paths->camera_moves = reads_time(scene->camera.program);
    paths->draws_time = !shutter_is_instant(&scene->shutter) && path_scene_is_moving(scene);
    materials_init(&paths->materials, arena, scene);
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        paths->is_selective |= shape_is_selective(&scene->shapes[i]);
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        paths->has_sky |= scene->lights[i].kind == LIGHT_SKY;
    }
}

static void evaluate_camera(PathTracer *tracer) {
    tracer->camera = camera_at(tracer->paths->scene, tracer->seconds);
    tracer->troubles.camera |= !tracer->camera.is_valid;
}

static void evaluate_lights(PathTracer *tracer) {
    light_set_at(tracer->paths->scene, tracer->seconds, &tracer->lights, tracer->troubles.lights);
}

void path_tracer_init(PathTracer *tracer, Arena *arena, const PathScene *paths, WorldView *view,
                      int64_t frame) {
    const Scene *scene = paths->scene;
    *tracer = (PathTracer){.paths = paths, .view = view, .frame = frame};
    tracer->lights.lights = ARENA_ARRAY(arena, scene->n_lights, LightAt);
    tracer->troubles.lights = ARENA_ARRAY(arena, scene->n_lights, bool);
    tracer->troubles.materials = ARENA_ARRAY(arena, scene->n_materials, bool);
    Instant middle = shutter_instant(&scene->shutter, frame, 0.5);
    tracer->seconds = instant_seconds(middle, scene->film.fps);
    world_view_time(view, middle);
    evaluate_camera(tracer);
    evaluate_lights(tracer);
}

static void set_time(PathTracer *tracer, double u) {
    const Scene *scene = tracer->paths->scene;
    Instant at = shutter_instant(&scene->shutter, tracer->frame, u);
    tracer->seconds = instant_seconds(at, scene->film.fps);
    world_view_time(tracer->view, at);
    if (tracer->paths->camera_moves) {
        evaluate_camera(tracer);
    }
    if (tracer->paths->lights_move) {
        evaluate_lights(tracer);
    }
}

static void add_scaled(double color[3], const double weight[3], const double light[3],
                       double scale) {
    for (int c = 0; c < 3; c++) {
        color[c] += weight[c] * light[c] * scale;
    }
}

static double max3(const double v[3]) {
    double m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

// Lights with an area that the path's ray meets. Lights by shadow rays were counted with the other
// share at the surface before.
static void add_met_lights(const PathTracer *tracer, Path *path, double tmax) {
    for (uint32_t i = 0; i < tracer->lights.n; i++) {
        const LightAt *light = &tracer->lights.lights[i];
        double density;
        if (light_hit(light, path->origin, path->dir, tmax, &density)) {
            double share = path->density > 0 ? path->density / (path->density + density) : 1;
            add_scaled(path->color, path->specular, light->color, share);
        }
    }
}

// The set of sample dimensions of the path's present surface: 0 is its direction, 1 + i light i.
static uint32_t sample_set(const PathTracer *tracer, const Path *path, uint32_t which) {
    return SAMPLE_SET_PATH + path->depth * (tracer->paths->scene->n_lights + 1) + which;
}

// Where a ray towards wi leaves the surface. False: not where its frame has it, a shading normal
// tells of a side that is not there.
static bool leave(const Vertex *vertex, Vec3 dir, bool is_through, Vec3 *start) {
    double above = vec3_dot(dir, vertex->Ng);
    *start = is_through ? vertex->through : vertex->start;
    return is_through ? above < 0 : above > 0;
}

static void add_light(PathTracer *tracer, Path *path, const Vertex *vertex, uint32_t i,
                      bool follows_specular) {
    const LightAt *light = &tracer->lights.lights[i];
    double u[SAMPLE_DIMENSIONS] = {0};
    if (light->has_area) {
        sampler_draw(path->sampler, path->index, sample_set(tracer, path, 1 + i), u);
        tracer->counters.light_samples++;
    }
    LightSample sample;
    if (!light_sample(light, vertex->start, u[0], u[1], &sample)) {
        return;
    }
    Vec3 start, wi = vec3(vec3_dot(vertex->x, sample.dir), vec3_dot(vertex->y, sample.dir),
                          vec3_dot(vertex->N, sample.dir));
    if (!leave(vertex, sample.dir, wi.z < 0, &start)) {
        return;
    }
    double diffuse[3], specular[3], density, total[3];
    bsdf_eval(&vertex->bsdf, vertex->wo, wi, diffuse, specular, &density);
    double share =
        follows_specular && sample.density > 0 ? sample.density / (sample.density + density) : 1;
    for (int c = 0; c < 3; c++) {
        total[c] = (diffuse[c] + specular[c] * share) * path->weight[c];
    }
    if (!(max3(total) > 0)) {
        return;
    }
    tracer->counters.shadow_rays++;
    // Just short of a lamp's surface: what touches it does not shade it.
    double tmax = sample.distance < INFINITY ? sample.distance * (1 - 1e-9) : INFINITY;
    add_scaled(path->color, total, sample.weight, path_unhindered(tracer, start, sample.dir, tmax));
}

static bool has_area_light(const LightSet *lights) {
    for (uint32_t i = 0; i < lights->n; i++) {
        if (lights->lights[i].has_area) {
            return true;
        }
    }
    return false;
}

// Below the surface that the shading normal hides, a reflection is lifted back to it, and what
// passes through the surface is pressed down.
static Vec3 lift(const Vertex *vertex, Vec3 dir, bool is_through) {
    Vec3 outwards = is_through ? vec3_scale(vertex->Ng, -1) : vertex->Ng;
    double out = vec3_dot(dir, outwards);
    return out > 0 ? dir : vec3_normalize(vec3_madd(dir, 1e-4 - out, outwards));
}

// The ray goes on within glass, or leaves it.
static void pass(Path *path, const Vertex *vertex) {
    path->is_within = vertex->bsdf.kind == MATERIAL_GLASS && !vertex->is_inside &&
                      bsdf_absorption(vertex->values, path->absorbs);
}

static void absorb(Path *path, double distance) {
    for (int c = 0; c < 3; c++) {
        double left =
            path->absorbs[c] > 0 ? program_fold(OP_EXP, -path->absorbs[c] * distance, 0, 0) : 1;
        path->weight[c] *= left;
        path->specular[c] *= left;
    }
}

// The bundle of rays from there on (Akenine-Moeller et al., "Improved shader and texture level of
// detail using ray cones", JCGT 2021, with estimates for what is not smooth).
static void widen(Path *path, const Vertex *vertex, double density) {
    path->width += path->spread * vec3_length(vec3_sub(vertex->point.P, path->origin));
    if (density > 0) {
        double wide = bsdf_has_diffuse(&vertex->bsdf) ? 0.25 : 0.5 * vertex->bsdf.alpha;
        path->spread = fmax(path->spread, wide);
    }
}

// Draws the direction in which the path goes on. False: it ends here.
static bool bounce(PathTracer *tracer, Path *path, const Vertex *vertex) {
    double u[SAMPLE_DIMENSIONS];
    sampler_draw(path->sampler, path->index, sample_set(tracer, path, 0), u);
    BsdfSample sample;
    if (!bsdf_sample(&vertex->bsdf, vertex->wo, u, &sample)) {
        return false;
    }
    path->dir = vec3_normalize(sampling_to_world(vertex->x, vertex->y, vertex->N, sample.wi));
    bool is_through = sample.wi.z < 0;
    if (!(sample.density > 0)) {
        path->dir = lift(vertex, path->dir, is_through);
    }
    widen(path, vertex, sample.density);
    if (!leave(vertex, path->dir, is_through, &path->origin)) {
        return false;
    }
    if (is_through) {
        pass(path, vertex);
    }
    path->density = sample.density;
    path->has_scattered |= sample.density > 0;
    path->depth++;
    for (int c = 0; c < 3; c++) {
        path->specular[c] = path->weight[c] * sample.specular[c];
        path->weight[c] *= sample.weight[c];
    }
    double survives = max3(path->weight);
    if (path->depth > ROULETTE_AFTER && survives < 1) {
        if (!(u[SAMPLE_FREE] < survives)) {
            return false;
        }
        for (int c = 0; c < 3; c++) {
            path->specular[c] /= survives;
            path->weight[c] /= survives;
        }
    }
    return max3(path->weight) > 0;
}

// Whether surfaces at the end of the path's ray can still give light: else they only hide it.
static bool wants_surface(const PathTracer *tracer, const Path *path) {
    const PathScene *paths = tracer->paths;
    return paths->materials.has_glow || path->depth <= paths->scene->render.bounces;
}

// Follows the path's ray. True: it ends at a surface.
static bool follow(PathTracer *tracer, Path *path, Vertex *vertex) {
    bool meets_lights = max3(path->specular) > 0 && has_area_light(&tracer->lights);
    double distance;
    tracer->counters.bounce_rays += path->depth > 0;
    if (!wants_surface(tracer, path) && !meets_lights && !path_goes_through(tracer)) {
        return world_occluded_of(tracer->view, path_ask_as(tracer, RAY_BOUNCE), path->origin,
                                 path->dir, 0, INFINITY);
    }
    bool is_hit = path_next_surface(tracer, path, vertex, &distance);
    if (path->is_within) {
        absorb(path, distance);
    }
    if (meets_lights) {
        add_met_lights(tracer, path, distance);
    }
    return is_hit;
}

// Light that leaves the surface towards the viewer, and the ray that goes on. False: none does.
static bool scatter(PathTracer *tracer, Path *path, Vertex *vertex) {
    const PathScene *paths = tracer->paths;
    const uint32_t bounces = paths->scene->render.bounces;
    if (!path_set_material(tracer, path, vertex)) {
        return false;
    }
    const Bsdf *bsdf = &vertex->bsdf;
    if (bsdf->kind == MATERIAL_GLOW) {
        add_scaled(path->color, path->weight, bsdf->emission, 1);
        return false;
    }
    if (path->depth > bounces) {
        return false;
    }
    bool sees_lights = bsdf_has_specular(bsdf) && has_area_light(&tracer->lights);
    bool goes_on =
        path->depth < bounces || paths->has_sky || paths->materials.has_glow || sees_lights;
    if (bsdf_has_diffuse(bsdf) || !bsdf->is_mirror) {
        for (uint32_t i = 0; i < tracer->lights.n; i++) {
            add_light(tracer, path, vertex, i, goes_on);
        }
    }
    return goes_on && bounce(tracer, path, vertex);
}

static void trace_path(PathTracer *tracer, Path *path, FilmSample *sample) {
    const Scene *scene = tracer->paths->scene;
    Vertex vertex;
    bool goes_on = true;
    while (goes_on) {
        bool is_hit = follow(tracer, path, &vertex);
        if (path->depth == 0) {
            sample->alpha = is_hit || !scene->film.transparent ? 1 : 1 - path->clear;
            if (is_hit) {
                Vec3 seen = vec3_sub(vertex.point.P, tracer->camera.from);
                sample->depth = vec3_dot(seen, tracer->camera.forward);
                sample->normal = vertex.N;
            }
        }
        if (!is_hit && (path->depth > 0 || !scene->film.transparent)) {
            add_scaled(path->color, path->weight, tracer->lights.sky, 1);
        }
        goes_on = is_hit && wants_surface(tracer, path) && scatter(tracer, path, &vertex);
    }
}

void path_trace(PathTracer *tracer, const Sampler *sampler, uint32_t x, uint32_t y, uint32_t index,
                Film *film) {
    const PathScene *paths = tracer->paths;
    double u[SAMPLE_DIMENSIONS], time = 0.5;
    sampler_draw(sampler, index, SAMPLE_SET_PIXEL, u);
    if (paths->draws_time) {
        time = u[SAMPLE_TIME];
        tracer->counters.time_samples++;
        set_time(tracer, time);
    }
    FilmSample sample = {.depth = INFINITY};
    if (tracer->camera.is_valid) {
        Path path = {.sampler = sampler, .index = index, .weight = {1, 1, 1}, .clear = 1};
        bool spreads = tracer->camera.kind == CAMERA_PERSPECTIVE;
        *(spreads ? &path.spread : &path.width) = tracer->camera.pixel;
        camera_ray(&tracer->camera, x + 0.5 + filter_offset(&paths->filter, u[SAMPLE_X]),
                   y + 0.5 + filter_offset(&paths->filter, u[SAMPLE_Y]), &path.origin, &path.dir);
        tracer->counters.camera_rays++;
        trace_path(tracer, &path, &sample);
        memcpy(sample.color, path.color, sizeof sample.color);
    }
    tracer->counters.film_samples++;
    tracer->counters.dropped_samples += !film_add(film, x, y, &sample, time, index);
}
