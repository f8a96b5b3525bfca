// SPDX-License-Identifier: Apache-2.0
// The path tracer.
#include "render/path.h"

#include <float.h>
#include <string.h>

#include "render/sampling.h"
#include "render/shutter.h"

enum { ROULETTE_AFTER = 4 };

static bool reads_time(const Program *program) {
    return program_reads(program, IN_T) || program_reads(program, IN_FILM_T);
}

static bool shape_is_moving(const Shape *shape) {
    return shape->track || reads_time(shape->vertex) || reads_time(shape->geometry) ||
           reads_time(shape->transform) || reads_time(shape->visible);
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
        if (reads_time(scene->materials[i].program)) {
            return true;
        }
    }
    return reads_time(scene->camera.program) || lights_are_moving(scene);
}

void path_scene_init(PathScene *paths, Arena *arena, const Scene *scene) {
    *paths = (PathScene){.scene = scene, .lights_move = lights_are_moving(scene)};
    filter_init(&paths->filter, scene->film.filter, scene->film.filter_width);
    paths->camera_moves = reads_time(scene->camera.program);
    paths->draws_time = !shutter_is_instant(&scene->shutter) && path_scene_is_moving(scene);
    paths->material = arena_array(arena, scene->n_materials, sizeof *paths->material);
    paths->material_is_constant = ARENA_ARRAY(arena, scene->n_materials, bool);
    bool is_rough = false;
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        const Material *material = &scene->materials[i];
        paths->material_is_constant[i] = program_is_constant(material->program);
        if (paths->material_is_constant[i]) {
            const double in[IN_COUNT] = {0};
            program_run1(material->program, in, paths->material[i]);
        }
        is_rough |= material->kind == MATERIAL_METAL || material->kind == MATERIAL_GLOSS;
        paths->has_glow |= material->kind == MATERIAL_GLOW;
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        paths->has_sky |= scene->lights[i].kind == LIGHT_SKY;
    }
    paths->table = is_rough ? bsdf_table_new(arena) : NULL;
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

// What is known of a path at its present end.
typedef struct {
    const Sampler *sampler;
    uint32_t index;
    uint32_t depth;     // bounces so far
    Vec3 origin, dir;   // of the ray that is followed; unit
    double weight[3];   // of what it brings
    double specular[3]; // of what it brings from lights with an area
    double density;     // with which its direction was drawn; 0: a mirror
    double color[3];    // collected
    bool has_scattered; // by what is no mirror
} Path;

// A place on a surface, seen from the viewer's side.
typedef struct {
    SurfacePoint point;
    uint32_t object;
    Vec3 x, y, N, Ng; // the shading frame; both normals on the viewer's side
    Vec3 wo;          // towards the viewer, in the frame
    Vec3 start;       // where rays leave
    Bsdf bsdf;
} Vertex;

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

// Normals towards the viewer, and a start for rays beyond the error of the point.
static void orient(Vertex *vertex, Vec3 dir) {
    const SurfacePoint *point = &vertex->point;
    double side = vec3_dot(point->Ng, dir) > 0 ? -1 : 1;
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
    vertex->start = vec3_madd(P, point->error + 4 * DBL_EPSILON * largest, vertex->Ng);
}

static void set_inputs(const PathTracer *tracer, const SurfacePoint *point, Vec3 N,
                       double in[IN_COUNT]) {
    memset(in, 0, IN_COUNT * sizeof *in);
    in[IN_T] = in[IN_FILM_T] = tracer->seconds;
    in[IN_U] = point->u;
    in[IN_V] = point->v;
    const Vec3 values[4] = {point->p, point->n, point->P, N};
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

static bool set_material(PathTracer *tracer, Vertex *vertex, double least_rough) {
    const PathScene *paths = tracer->paths;
    uint32_t material = vertex->point.material;
    const Material *m = &paths->scene->materials[material];
    const double *out = paths->material[material];
    double values[BSDF_MAX_OUT], in[IN_COUNT];
    if (!paths->material_is_constant[material]) {
        set_inputs(tracer, &vertex->point, vertex->point.N, in);
        program_run1(m->program, in, values);
        out = values;
    }
    if (!bsdf_init(&vertex->bsdf, m->kind, out, least_rough, vertex->wo.z, paths->table)) {
        tracer->troubles.materials[material] = true;
        return false;
    }
    return true;
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

static void add_light(PathTracer *tracer, Path *path, const Vertex *vertex, uint32_t i,
                      bool follows_specular) {
    const LightAt *light = &tracer->lights.lights[i];
    double u[SAMPLE_DIMENSIONS] = {0};
    if (light->has_area) {
        sampler_draw(path->sampler, path->index, sample_set(tracer, path, 1 + i), u);
        tracer->counters.light_samples++;
    }
    LightSample sample;
    if (!light_sample(light, vertex->start, u[0], u[1], &sample) ||
        !(vec3_dot(sample.dir, vertex->Ng) > 0)) {
        return;
    }
    Vec3 wi = vec3(vec3_dot(vertex->x, sample.dir), vec3_dot(vertex->y, sample.dir),
                   vec3_dot(vertex->N, sample.dir));
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
    if (!world_occluded(tracer->view, vertex->start, sample.dir, 0, tmax)) {
        add_scaled(path->color, total, sample.weight, 1);
    }
}

static bool has_area_light(const LightSet *lights) {
    for (uint32_t i = 0; i < lights->n; i++) {
        if (lights->lights[i].has_area) {
            return true;
        }
    }
    return false;
}

// Below the surface that the shading normal hides, a reflection is lifted back to it.
static Vec3 lift(const Vertex *vertex, Vec3 dir) {
    double below = vec3_dot(dir, vertex->Ng);
    return below > 0 ? dir : vec3_normalize(vec3_madd(dir, 1e-4 - below, vertex->Ng));
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
    if (!(sample.density > 0)) {
        path->dir = lift(vertex, path->dir);
    } else if (!(vec3_dot(path->dir, vertex->Ng) > 0)) {
        return false;
    }
    path->origin = vertex->start;
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
    return paths->has_glow || path->depth <= paths->scene->render.bounces;
}

// Follows the path's ray. True: it ends at a surface.
static bool follow(PathTracer *tracer, Path *path, Vertex *vertex) {
    WorldView *view = tracer->view;
    bool meets_lights = max3(path->specular) > 0 && has_area_light(&tracer->lights);
    tracer->counters.bounce_rays += path->depth > 0;
    if (!wants_surface(tracer, path) && !meets_lights) {
        return world_occluded(view, path->origin, path->dir, 0, INFINITY);
    }
    WorldHit hit;
    bool is_hit = world_closest(view, path->origin, path->dir, 0, INFINITY, &hit);
    if (meets_lights) {
        add_met_lights(tracer, path, is_hit ? hit.t : INFINITY);
    }
    if (is_hit && wants_surface(tracer, path)) {
        world_surface(view, path->origin, path->dir, &hit, &vertex->point);
        vertex->object = hit.object;
        orient(vertex, path->dir);
    }
    return is_hit;
}

// Light that leaves the surface towards the viewer, and the ray that goes on. False: none does.
static bool scatter(PathTracer *tracer, Path *path, Vertex *vertex) {
    const PathScene *paths = tracer->paths;
    const uint32_t bounces = paths->scene->render.bounces;
    if (!set_material(tracer, vertex, path->has_scattered ? PATH_ROUGH : 0)) {
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
    bool goes_on = path->depth < bounces || paths->has_sky || paths->has_glow || sees_lights;
    if (bsdf_has_diffuse(bsdf) || !bsdf->is_mirror) {
        for (uint32_t i = 0; i < tracer->lights.n; i++) {
            add_light(tracer, path, vertex, i, goes_on);
        }
    }
    return goes_on && bounce(tracer, path, vertex);
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
    for (int i = 0; i < 2; i++) {
        motion[i] = (after[i] - before[i]) / (2 * MOTION_STEP);
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
    sample->depth = vec3_dot(vec3_sub(met->point.P, tracer->camera.from), tracer->camera.forward);
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
        bool is_hit = follow(tracer, path, &vertex), is_first = path->depth == 0;
        if (is_first) {
            sample->alpha = is_hit || !scene->film.transparent;
            describe(tracer, is_hit ? &vertex : NULL, path->dir, sample);
        }
        if (!is_hit && (path->depth > 0 || !scene->film.transparent)) {
            add_scaled(path->color, path->weight, tracer->lights.sky, 1);
        }
        goes_on = is_hit && wants_surface(tracer, path) && scatter(tracer, path, &vertex);
        if (is_first && vertex.bsdf.kind != MATERIAL_GLOW) {
            memcpy(sample->albedo, vertex.bsdf.color, sizeof sample->albedo);
        }
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
    FilmSample sample = {.u = time,
                         .dx = filter_offset(&paths->filter, u[SAMPLE_X]),
                         .dy = filter_offset(&paths->filter, u[SAMPLE_Y]),
                         .index = index,
                         .depth = INFINITY};
    if (tracer->camera.is_valid) {
        Path path = {.sampler = sampler, .index = index, .weight = {1, 1, 1}};
        camera_ray(&tracer->camera, x + 0.5 + sample.dx, y + 0.5 + sample.dy, &path.origin,
                   &path.dir);
        tracer->counters.camera_rays++;
        trace_path(tracer, &path, &sample);
        memcpy(sample.color, path.color, sizeof sample.color);
    }
    tracer->counters.film_samples++;
    tracer->counters.dropped_samples += !film_add(film, x, y, &sample);
}
