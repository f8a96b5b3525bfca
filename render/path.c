// SPDX-License-Identifier: Apache-2.0
// The path tracer.
#include "render/path_parts.h"

#include <string.h>

#include "render/sampling.h"
#include "render/shutter.h"

enum { ROULETTE_AFTER = 4 };

static bool shape_is_moving(const Shape *shape) {
    return shape->track || program_reads_time(shape->vertex) ||
           program_reads_time(shape->geometry) || program_reads_time(shape->transform) ||
           program_reads_time(shape->visible) || program_reads_time(shape->seen[RAY_CAMERA]) ||
           program_reads_time(shape->seen[RAY_SHADOW]) ||
           program_reads_time(shape->seen[RAY_BOUNCE]);
}

static bool camera_is_moving(const CameraSettings *camera) {
    return program_reads_time(camera->program) || program_reads_time(camera->lens);
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
        if (program_reads_time(scene->materials[i].program) ||
            program_reads_time(scene->materials[i].opacity) ||
            program_reads_time(scene->materials[i].height) ||
            program_reads_time(scene->materials[i].normal)) {
            return true;
        }
    }
    return camera_is_moving(&scene->camera) || lights_are_moving(scene);
}

void path_scene_init(PathScene *paths, Arena *arena, const Scene *scene) {
    *paths = (PathScene){.scene = scene, .lights_move = lights_are_moving(scene), .instant = 0.5};
    filter_init(&paths->filter, scene->film.filter, scene->film.filter_width);
    paths->camera_moves = camera_is_moving(&scene->camera);
    bool moves = path_scene_is_moving(scene);
    paths->draws_time = moves && !shutter_is_instant(&scene->shutter);
    paths->is_delayed = moves && shutter_is_delayed(&scene->shutter);
    materials_init(&paths->materials, arena, scene);
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        paths->is_selective |= shape_is_selective(&scene->shapes[i]);
    }
    bool has_image = false;
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        paths->has_sky |= scene->lights[i].kind == LIGHT_SKY;
        has_image |= scene->lights[i].image != NULL;
    }
    bool has_chosen = paths->materials.has_glow || scene->n_lights > LIGHT_CHOICE_FEW || has_image;
    paths->n_sets = 1 + scene->n_lights + (has_chosen ? PATH_CHOSEN_SETS : 0);
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
    tracer->delay = shutter_delay(&scene->shutter, &scene->film, 0, 0);
    Instant middle = shutter_instant(&scene->shutter, frame, tracer->delay, 0.5);
    tracer->seconds = instant_seconds(middle, scene->film.fps);
    world_view_time(view, middle);
    evaluate_camera(tracer);
    evaluate_lights(tracer);
}

static void set_pixel(PathTracer *tracer, uint32_t x, uint32_t y) {
    const Scene *scene = tracer->paths->scene;
    if (tracer->paths->is_delayed && (tracer->x != x || tracer->y != y)) {
        tracer->delay = shutter_delay(&scene->shutter, &scene->film, x, y);
    }
    tracer->x = x;
    tracer->y = y;
}

static void set_time(PathTracer *tracer, double fraction) {
    const Scene *scene = tracer->paths->scene;
    Instant at = shutter_instant(&scene->shutter, tracer->frame, tracer->delay, fraction);
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

// Scales what came to a path's color since it was `before` to no more than the scene's clamp: with
// that bias rare paths of enormous weight are no specks. Direct light is left as it is.
static void clamp_added(const PathTracer *tracer, const double before[3], double color[3]) {
    double most = tracer->paths->scene->render.clamp;
    const double added[3] = {color[0] - before[0], color[1] - before[1], color[2] - before[2]};
    double largest = max3(added);
    for (int c = 0; c < 3 && most > 0 && largest > most; c++) {
        color[c] = before[c] + added[c] * (most / largest);
    }
}

// Where the camera's clock is differenced for the motion layer: so much of a frame period before
// and after. The error is (angular velocity * step)^2 / 6 of the motion.
static const double MOTION_STEP = 0x1p-12;

// The picture point of what is at P and moves with `velocity`, seconds after the sample's time.
// What nothing was met of is as far as can be, along `dir` (unit length).
static bool project_later(const PathTracer *tracer, const Vertex *met, Vec3 dir, double seconds,
                          double out[2]) {
    const PathScene *paths = tracer->paths;
    Camera camera =
        paths->camera_moves ? camera_at(paths->scene, tracer->seconds + seconds) : tracer->camera;
    double scale;
    Vec3 P =
        met ? vec3_madd(met->point.P, seconds, met->point.velocity) : vec3_add(camera.from, dir);
    return camera.is_valid && camera_project(&camera, P, &out[0], &out[1], &scale);
}

static void find_motion(const PathTracer *tracer, const Vertex *met, Vec3 dir, double motion[2]) {
    double step = MOTION_STEP / tracer->paths->scene->film.fps, before[2], after[2];
    bool is_far = !met && tracer->camera.kind == CAMERA_ORTHOGRAPHIC;
    if (is_far || !project_later(tracer, met, dir, -step, before) ||
        !project_later(tracer, met, dir, step, after)) {
        return;
    }
    double moved[2] = {after[0] - before[0], after[1] - before[1]};
    if (tracer->camera.kind == CAMERA_SPHERICAL) { // across the edge, not around the world
        moved[0] -= tracer->camera.width * rint(moved[0] / tracer->camera.width);
    }
    for (int i = 0; i < 2; i++) {
        motion[i] = moved[i] / (2 * MOTION_STEP);
    }
}

// What the layers want to know of what the camera's ray met; NULL: nothing.
static void describe(const PathTracer *tracer, const Vertex *met, Vec3 dir, FilmSample *sample) {
    const FilmSettings *film = &tracer->paths->scene->film;
    if (film->layers & 1u << LAYER_MOTION) {
        find_motion(tracer, met, dir, sample->motion);
    }
    if (!met) {
        return;
    }
    sample->is_hit = true;
    sample->depth = camera_depth(&tracer->camera, met->point.P);
    sample->normal = met->N;
    sample->position = met->point.P;
    sample->object = met->object;
    sample->material = met->point.material;
    sample->film_time = tracer->seconds * film->fps - (double)(tracer->frame - 1);
}

static void trace_path(PathTracer *tracer, Path *path, FilmSample *sample) {
    const Scene *scene = tracer->paths->scene;
    Vertex vertex = {.bsdf = {.kind = MATERIAL_GLOW}};
    bool goes_on = true;
    while (goes_on) {
        const uint32_t depth = path->depth;
        double before[3];
        memcpy(before, path->color, sizeof before);
        bool is_hit = follow(tracer, path, &vertex);
        if (depth == 0) {
            sample->alpha = is_hit || !scene->film.transparent ? 1 : 1 - path->shade;
            describe(tracer, is_hit ? &vertex : NULL, path->dir, sample);
        }
        if (!is_hit && (path->depth > 0 || !scene->film.transparent)) {
            path_meet_sky(tracer, path);
        }
        if (depth == 1) { // what the ray met by now is direct light
            memcpy(before, path->color, sizeof before);
        }
        goes_on = is_hit && wants_surface(tracer, path) && scatter(tracer, path, &vertex);
        bool is_direct = depth == 1 && vertex.bsdf.kind == MATERIAL_GLOW;
        if (depth > 0 && !is_direct) {
            clamp_added(tracer, before, path->color);
        }
        if (depth == 0 && vertex.bsdf.kind != MATERIAL_GLOW) {
            memcpy(sample->albedo, vertex.bsdf.color, sizeof sample->albedo);
        }
    }
}

// The camera's ray through a point of the picture.
static void start_path(PathTracer *tracer, Path *path, double px, double py) {
    const Camera *camera = &tracer->camera;
    tracer->counters.camera_rays++;
    *(camera->kind == CAMERA_ORTHOGRAPHIC ? &path->width : &path->spread) = camera->pixel;
    if (!(camera->radius > 0)) {
        camera_ray(camera, px, py, &path->origin, &path->dir);
        return;
    }
    double lens[SAMPLE_DIMENSIONS];
    sampler_draw(path->sampler, path->index, SAMPLE_SET_LENS, lens);
    tracer->counters.lens_samples++;
    camera_lens_ray(camera, px, py, lens[0], lens[1], &path->origin, &path->dir);
}

void path_trace(PathTracer *tracer, const Sampler *sampler, uint32_t x, uint32_t y, uint32_t index,
                Film *film) {
    const PathScene *paths = tracer->paths;
    double u[SAMPLE_DIMENSIONS], time = paths->instant;
    sampler_draw(sampler, index, SAMPLE_SET_PIXEL, u);
    set_pixel(tracer, x, y);
    if (paths->draws_time) {
        time = shutter_fraction(&paths->scene->shutter, u[SAMPLE_TIME]);
        tracer->counters.time_samples++;
    }
    if (paths->draws_time || paths->is_delayed) {
        set_time(tracer, time);
    }
    FilmSample sample = {.u = time,
                         .dx = filter_offset(&paths->filter, u[SAMPLE_X]),
                         .dy = filter_offset(&paths->filter, u[SAMPLE_Y]),
                         .index = index,
                         .depth = INFINITY};
    if (tracer->camera.is_valid) {
        Path path = {.sampler = sampler, .index = index, .weight = {1, 1, 1}};
        start_path(tracer, &path, x + 0.5 + sample.dx, y + 0.5 + sample.dy);
        trace_path(tracer, &path, &sample);
        memcpy(sample.color, path.color, sizeof sample.color);
    }
    tracer->counters.film_samples++;
    tracer->counters.dropped_samples += !film_add(film, x, y, &sample);
}
