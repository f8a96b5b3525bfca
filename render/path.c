// SPDX-License-Identifier: Apache-2.0
// The path tracer.
#include "render/path_parts.h"

#include <string.h>

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
    bool has_many = paths->materials.has_glow || scene->n_lights > LIGHT_CHOICE_FEW;
    paths->n_sets = 1 + scene->n_lights + (has_many ? LIGHT_CHOICE_FEW + LIGHT_CHOICE_DRAWN : 0);
}

PathScene path_scene_frame(const PathScene *paths, Arena *arena, const World *world,
                           int64_t frame) {
    PathScene framed = *paths;
    LightChoiceInput input = {.scene = paths->scene,
                              .world = world,
                              .materials = &paths->materials,
                              .frame = frame,
                              .moves = paths->draws_time};
    framed.choice = light_choice_new(arena, &input);
    return framed;
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
    tracer->lights.only_far = paths->choice.draws_lights;
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

// Below the surface that the shading normal hides, a reflection is lifted back to it, and what
// passes through the surface is pressed down.
static Vec3 lift(const Vertex *vertex, Vec3 dir, bool is_through) {
    Vec3 outwards = is_through ? vec3_scale(vertex->Ng, -1) : vertex->Ng;
    double out = vec3_dot(dir, outwards);
    return out > 0 ? dir : vec3_normalize(vec3_madd(dir, 1e-4 - out, outwards));
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
    if (!path_leave(vertex, path->dir, is_through, &path->origin)) {
        return false;
    }
    path->medium = path_medium(path, vertex, is_through);
    path->facing = path_facing(vertex);
    path->emitter = vertex->emitter;
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
    // The camera does not see lights: its weight is specular in none.
    bool meets_lights = path->depth > 0 && path_may_meet_lights(tracer, max3(path->specular) > 0);
    tracer->counters.bounce_rays += path->depth > 0;
    path->shade = 1;
    if (!wants_surface(tracer, path) && !meets_lights && !path_goes_through(tracer)) {
        return world_occluded_of(tracer->view, path_ask_as(tracer, RAY_BOUNCE), path->origin,
                                 path->dir, 0, INFINITY);
    }
    bool is_hit = path_next_surface(tracer, path, vertex);
    if (meets_lights) {
        path_meet_lights(tracer, path, vertex->distance);
    }
    for (int c = 0; c < 3; c++) {
        path->weight[c] *= path_medium_left(&path->medium, c, vertex->distance);
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
        add_scaled(path->color, path->weight, bsdf->emission,
                   path_glow_share(tracer, path, vertex));
        return false;
    }
    if (path->depth > bounces) {
        return false;
    }
    for (int c = 0; c < 3; c++) {
        path->weight[c] *= path->shade;
    }
    bool sees_lights = path_may_meet_lights(tracer, bsdf_has_specular(bsdf));
    bool goes_on =
        path->depth < bounces || paths->has_sky || paths->materials.has_glow || sees_lights;
    if (bsdf_has_diffuse(bsdf) || !bsdf->is_mirror) {
        path_ask_lights(tracer, path, vertex, goes_on);
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
            sample->alpha = is_hit || !scene->film.transparent ? 1 : 1 - path->shade;
            if (is_hit) {
                Vec3 seen = vec3_sub(vertex.point.P, tracer->camera.from);
                sample->depth = vec3_dot(seen, tracer->camera.forward);
                sample->normal = vertex.N;
            }
        }
        if (!is_hit && (path->depth > 0 || !scene->film.transparent)) {
            add_scaled(path->color, path->weight, tracer->lights.sky, path->shade);
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
        Path path = {
            .sampler = sampler,
            .index = index,
            .weight = {1, 1, 1},
        };
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
