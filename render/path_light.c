// SPDX-License-Identifier: Apache-2.0
// Direct light: by shadow rays, and by the path's own rays that meet what shines.
#include "render/path_parts.h"
#include "render/sampling.h"

enum { NO_EMITTER = UINT32_MAX };

// ---- Lights that the path's ray meets

// By scattered light a lamp is seen as shadow rays see it, else the two ways would not add up.
static bool sees_by_shadow_rays(const PathTracer *tracer, const Path *path) {
    return path->density > 0 && tracer->paths->is_selective;
}

// Just short of a lamp's surface: what touches it does not shade it.
static double short_of(double distance) {
    return distance < INFINITY ? distance * (1 - 1e-9) : INFINITY;
}

static void add_met_light(PathTracer *tracer, Path *path, const LightAt *light, double picked,
                          double tmax) {
    LightHit hit;
    if (!light_hit(light, path->origin, path->dir, tmax, &hit)) {
        return;
    }
    double share = path->density > 0 ? path->density / (path->density + hit.density * picked) : 1;
    share *= light_share(light, vec3_scale(path->dir, -1));
    if (!sees_by_shadow_rays(tracer, path)) {
        share *= path->shade;
    } else if (share > 0) {
        share *= path_unhindered(tracer, path->origin, path->dir, short_of(hit.distance), NULL);
    }
    const double *weight = light_is_near(light) ? path->weight : path->specular;
    for (int c = 0; c < 3; c++) {
        path->color[c] +=
            weight[c] * light->color[c] * share * path_medium_left(&path->medium, c, hit.distance);
    }
}

typedef struct {
    PathTracer *tracer;
    Path *path;
    double tmax;
} MetLights;

static void visit_met_light(void *context, uint32_t item) {
    MetLights *met = context;
    PathTracer *tracer = met->tracer;
    const LightChoice *choice = &tracer->paths->choice;
    if (item >= choice->n_lights) {
        return; // an emitter: it is a surface
    }
    uint32_t light = choice->lights[item];
    LightAt at;
    if (light_at(&tracer->paths->scene->lights[light], tracer->seconds, &at,
                 &tracer->troubles.lights[light])) {
        double picked = light_choice_light(choice, met->path->origin, met->path->facing, item);
        add_met_light(tracer, met->path, &at, picked, met->tmax);
    }
}

void path_meet_lights(PathTracer *tracer, Path *path, double distance) {
    const LightChoice *choice = &tracer->paths->choice;
    double tmax = sees_by_shadow_rays(tracer, path) ? INFINITY : distance;
    for (uint32_t i = 0; i < tracer->lights.n; i++) {
        add_met_light(tracer, path, &tracer->lights.lights[i], 1, tmax);
    }
    if (choice->tree && choice->has_area) {
        MetLights met = {tracer, path, tmax};
        light_tree_visit(choice->tree, path->origin, path->dir, tmax, visit_met_light, &met);
    }
}

double path_glow_share(PathTracer *tracer, const Path *path, const Vertex *vertex) {
    const LightChoice *choice = &tracer->paths->choice;
    uint32_t i = vertex->emitter;
    if (!(path->density > 0) || i == NO_EMITTER || i == path->emitter) {
        return path->shade;
    }
    double density = emitter_density(tracer->view, &choice->emitters.list[i], path->origin,
                                     path->dir, vertex->distance);
    density *= light_choice_emitter(choice, path->origin, path->facing, i);
    return path->density / (path->density + density);
}

void path_meet_sky(PathTracer *tracer, Path *path) {
    const LightSet *lights = &tracer->lights;
    double rgb[3], share = path->shade;
    bool is_bad = false;
    light_sky(lights, tracer->seconds, path->dir, rgb, &is_bad);
    if (is_bad) {
        tracer->troubles.lights[lights->painted - tracer->paths->scene->lights] = true;
    }
    if (path->density > 0 && light_sky_is_sampled(lights)) {
        share = path->density / (path->density + light_sky_density(lights, path->dir));
    }
    add_scaled(path->color, path->weight, rgb, share);
}

bool path_may_meet_lights(const PathTracer *tracer, bool is_specular) {
    const LightSet *lights = &tracer->lights;
    const LightChoice *choice = &tracer->paths->choice;
    return lights->is_near || choice->is_near ||
           (is_specular && (lights->has_area || choice->has_area));
}

// ---- Lights that are asked by shadow rays

Vec3 path_facing(const Vertex *vertex) {
    return vertex->bsdf.kind == MATERIAL_GLASS ? vec3(0, 0, 0) : vertex->Ng;
}

typedef struct Asking Asking;

// What one light sends. emitter: NULL: it is none. is_near: the diffuse part of a reflection too is
// found by rays that go on, as the specular part is.
typedef void TakeLight(Asking *asking, const LightSample *sample, const Emitter *emitter,
                       bool is_near);

// A place that asks all lights, or some of many.
struct Asking {
    PathTracer *tracer;
    Path *path;
    const Vertex *vertex;
    uint32_t first_set; // of sample dimensions
    Vec3 facing;        // where it sees lights; 0: everywhere
    TakeLight *take;
    bool is_followed;    // take_scattered: the path goes on
    double all, reached; // take_share: light
};

// One that was drawn so many times on the mean.
static void ask_light(Asking *a, const LightAt *light, const double u[2], double picked) {
    LightSample sample;
    a->tracer->counters.light_samples += light->has_area;
    if (light_sample(light, a->vertex->start, u[0], u[1], &sample)) {
        for (int c = 0; c < 3; c++) {
            sample.weight[c] /= picked;
        }
        sample.density *= picked;
        a->take(a, &sample, NULL, light_is_near(light));
    }
}

static void ask_emitter(Asking *a, uint32_t i, const double u[2], double picked) {
    PathTracer *tracer = a->tracer;
    const Materials *materials = &tracer->paths->materials;
    const Emitter *emitter = &tracer->paths->choice.emitters.list[i];
    EmitterSample drawn;
    SurfacePoint point;
    double radiance[3];
    if (i == a->vertex->emitter) {
        return; // its own light comes by bounces, if at all
    }
    tracer->counters.light_samples++;
    if (!emitter_sample(tracer->view, emitter, a->vertex->start, u[0], u[1], &drawn) ||
        vec3_dot(drawn.dir, a->facing) < 0) {
        return;
    }
    uint32_t material = emitter_material(tracer->view, emitter);
    if (!materials->is_even[material]) {
        world_surface(tracer->view, a->vertex->start, drawn.dir, &drawn.hit, &point);
    }
    const MaterialPlace place = {&point, NULL, tracer->seconds};
    if (material_glow(materials, material, &place, tracer->troubles.materials, radiance)) {
        LightSample sample = {
            .dir = drawn.dir, .distance = drawn.distance, .density = drawn.density * picked};
        for (int c = 0; c < 3; c++) {
            sample.weight[c] = radiance[c] / sample.density;
        }
        a->take(a, &sample, emitter, true);
    }
}

static void draw(const Asking *a, uint32_t set, double u[SAMPLE_DIMENSIONS]) {
    sampler_draw(a->path->sampler, a->path->index, a->first_set + set, u);
}

// Some of many.
static void ask_drawn(Asking *a, uint32_t first_set) {
    PathTracer *tracer = a->tracer;
    const LightChoice *choice = &tracer->paths->choice;
    for (uint32_t k = 0; k < LIGHT_CHOICE_DRAWN; k++) {
        double u[SAMPLE_DIMENSIONS], probability;
        draw(a, first_set + k, u);
        uint32_t item =
            light_tree_sample(choice->tree, a->vertex->start, a->facing, u[2], &probability);
        double picked = LIGHT_CHOICE_DRAWN * probability;
        if (item >= choice->n_lights) {
            ask_emitter(a, item - choice->n_lights, u, picked);
            continue;
        }
        uint32_t light = choice->lights[item];
        LightAt at;
        if (light_at(&tracer->paths->scene->lights[light], tracer->seconds, &at,
                     &tracer->troubles.lights[light])) {
            ask_light(a, &at, u, picked);
        }
    }
}

static void ask_all(Asking *a) {
    const PathTracer *tracer = a->tracer;
    const LightChoice *choice = &tracer->paths->choice;
    const uint32_t n_lights = tracer->paths->scene->n_lights;
    double u[SAMPLE_DIMENSIONS] = {0};
    for (uint32_t i = 0; i < tracer->lights.n; i++) {
        const LightAt *light = &tracer->lights.lights[i];
        if (light->has_area) {
            draw(a, i, u);
        }
        ask_light(a, light, u, 1);
    }
    for (uint32_t i = 0; i < choice->emitters.n && !choice->draws_emitters; i++) {
        draw(a, n_lights + i, u);
        ask_emitter(a, i, u, 1);
    }
    if (choice->tree) {
        ask_drawn(a, n_lights + LIGHT_CHOICE_FEW);
    }
    if (light_sky_is_sampled(&tracer->lights)) {
        LightSample sample;
        draw(a, n_lights + LIGHT_CHOICE_FEW + LIGHT_CHOICE_DRAWN, u);
        a->tracer->counters.light_samples++;
        if (light_sky_sample(&tracer->lights, u[0], u[1], &sample)) {
            a->take(a, &sample, NULL, true);
        }
    }
}

// ---- What surfaces scatter of it

static double unhindered(PathTracer *tracer, Vec3 start, const LightSample *sample,
                         const Emitter *emitter) {
    return path_unhindered(tracer, start, sample->dir,
                           emitter ? sample->distance : short_of(sample->distance), emitter);
}

static void take_scattered(Asking *a, const LightSample *sample, const Emitter *emitter,
                           bool is_near) {
    const Vertex *vertex = a->vertex;
    Path *path = a->path;
    Vec3 start, wi = vec3(vec3_dot(vertex->x, sample->dir), vec3_dot(vertex->y, sample->dir),
                          vec3_dot(vertex->N, sample->dir));
    bool is_through = wi.z < 0;
    if ((is_through && vertex->bsdf.kind != MATERIAL_GLASS) || !(max3(sample->weight) > 0) ||
        !path_leave(vertex, sample->dir, is_through, &start)) {
        return;
    }
    // What lies between the places where rays leave is not on the other side.
    double apart = is_through ? vec3_dot(vec3_sub(vertex->start, start), vertex->Ng) : 0;
    if (!(sample->distance * fabs(vec3_dot(sample->dir, vertex->Ng)) > apart)) {
        return;
    }
    double diffuse[3], specular[3], density, total[3];
    bsdf_eval(&vertex->bsdf, vertex->wo, wi, diffuse, specular, &density);
    double share =
        a->is_followed && sample->density > 0 ? sample->density / (sample->density + density) : 1;
    double share_diffuse = is_near ? share : 1;
    const Medium medium = path_medium(path, vertex, is_through);
    for (int c = 0; c < 3; c++) {
        total[c] = (diffuse[c] * share_diffuse + specular[c] * share) * path->weight[c] *
                   path_medium_left(&medium, c, sample->distance);
    }
    if (max3(total) > 0) {
        add_scaled(path->color, total, sample->weight,
                   unhindered(a->tracer, start, sample, emitter));
    }
}

void path_ask_lights(PathTracer *tracer, Path *path, const Vertex *vertex, bool is_followed) {
    Asking asking = {.tracer = tracer,
                     .path = path,
                     .vertex = vertex,
                     .first_set = sample_set(tracer, path, 1),
                     .facing = path_facing(vertex),
                     .take = take_scattered,
                     .is_followed = is_followed};
    ask_all(&asking);
}

// ---- What reaches catchers

static double luminance(const double color[3]) {
    return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
}

static void take_share(Asking *a, const LightSample *sample, const Emitter *emitter, bool is_near) {
    const Vertex *vertex = a->vertex;
    double weight = luminance(sample->weight) * vec3_dot(vertex->N, sample->dir);
    (void)is_near;
    if (weight > 0 && vec3_dot(vertex->Ng, sample->dir) > 0) {
        a->all += weight;
        a->reached += weight * unhindered(a->tracer, vertex->start, sample, emitter);
    }
}

double path_lit_share(PathTracer *tracer, Path *path, const Vertex *vertex) {
    const double *sky = tracer->lights.sky;
    double u[SAMPLE_DIMENSIONS];
    Asking asking = {.tracer = tracer,
                     .path = path,
                     .vertex = vertex,
                     .first_set = SAMPLE_SET_CHANCE + path->n_chances,
                     .facing = vertex->Ng,
                     .take = take_share};
    path->n_chances += tracer->paths->n_sets;
    ask_all(&asking);
    if (max3(sky) > 0 && !light_sky_is_sampled(&tracer->lights)) {
        bool is_bad;
        draw(&asking, tracer->paths->n_sets - 1, u);
        Vec3 up = sampling_cosine(u[0], u[1]);
        LightSample sample = {.dir = sampling_to_world(vertex->x, vertex->y, vertex->N, up),
                              .distance = INFINITY};
        light_sky(&tracer->lights, tracer->seconds, sample.dir, sample.weight, &is_bad);
        for (int c = 0; c < 3; c++) {
            sample.weight[c] *= SAMPLING_PI / up.z;
        }
        take_share(&asking, &sample, NULL, false);
    }
    return asking.all > 0 ? asking.reached / asking.all : 1;
}
