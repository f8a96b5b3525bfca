// SPDX-License-Identifier: Apache-2.0
// Direct light: by shadow rays, and by the path's own rays that meet what shines.
#include "render/path_parts.h"

// ---- Lights that the path's ray meets

static void add_met_light(Path *path, const LightAt *light, double picked, double tmax) {
    double density;
    if (light_hit(light, path->origin, path->dir, tmax, &density)) {
        density *= picked;
        double share = path->density > 0 ? path->density / (path->density + density) : 1;
        share *= light_share(light, vec3_scale(path->dir, -1));
        add_scaled(path->color, light_is_near(light) ? path->weight : path->specular, light->color,
                   share);
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
        double picked = light_choice_light(choice, met->path->origin, met->path->normal, item);
        add_met_light(met->path, &at, picked, met->tmax);
    }
}

void path_meet_lights(PathTracer *tracer, Path *path, double tmax) {
    const LightChoice *choice = &tracer->paths->choice;
    for (uint32_t i = 0; i < tracer->lights.n; i++) {
        add_met_light(path, &tracer->lights.lights[i], 1, tmax);
    }
    if (choice->tree && choice->has_area) {
        MetLights met = {tracer, path, tmax};
        light_tree_visit(choice->tree, path->origin, path->dir, tmax, visit_met_light, &met);
    }
}

double path_glow_share(PathTracer *tracer, const Path *path, const Vertex *vertex) {
    const LightChoice *choice = &tracer->paths->choice;
    const WorldHit *hit = &vertex->hit;
    uint32_t i = emitter_of(&choice->emitters, hit);
    if (!(path->density > 0) || i == UINT32_MAX) {
        return 1;
    }
    double density =
        emitter_density(tracer->view, &choice->emitters.list[i], path->origin, path->dir, hit);
    density *= light_choice_emitter(choice, path->origin, path->normal, i);
    return path->density / (path->density + density);
}

void path_meet_sky(PathTracer *tracer, Path *path) {
    const LightSet *lights = &tracer->lights;
    double rgb[3], share = 1;
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

// ---- Lights that are asked by shadow rays

static uint32_t chosen_set(const PathTracer *tracer, const Path *path, uint32_t which) {
    return sample_set(tracer, path, 1 + tracer->paths->scene->n_lights + which);
}

// Whether nothing lies between the vertex and a light, or an emitter (else NULL). The first thing
// on the way may be the emitter itself: from afar a ray meets a small ball a little before or
// beside the point that was drawn.
static bool is_lit(PathTracer *tracer, const Vertex *vertex, const LightSample *sample,
                   const Emitter *emitter) {
    tracer->counters.shadow_rays++;
    if (emitter) {
        WorldHit hit;
        return !world_closest(tracer->view, vertex->start, sample->dir, 0, sample->distance,
                              &hit) ||
               (hit.body == emitter->body && hit.at == emitter->prim);
    }
    // Just short of a lamp's surface: what touches it does not shade it.
    double tmax = sample->distance < INFINITY ? sample->distance * (1 - 1e-9) : INFINITY;
    return !world_occluded(tracer->view, vertex->start, sample->dir, 0, tmax);
}

// Light from where it was drawn, unless something is in between. is_near: the diffuse part too is
// found by rays that go on (is_followed), as the specular part is.
static void add_sample(PathTracer *tracer, Path *path, const Vertex *vertex,
                       const LightSample *sample, const Emitter *emitter, bool is_near,
                       bool is_followed) {
    if (!(vec3_dot(sample->dir, vertex->Ng) > 0) || !(max3(sample->weight) > 0)) {
        return;
    }
    Vec3 wi = vec3(vec3_dot(vertex->x, sample->dir), vec3_dot(vertex->y, sample->dir),
                   vec3_dot(vertex->N, sample->dir));
    double diffuse[3], specular[3], density, total[3];
    bsdf_eval(&vertex->bsdf, vertex->wo, wi, diffuse, specular, &density);
    double share =
        is_followed && sample->density > 0 ? sample->density / (sample->density + density) : 1;
    double share_diffuse = is_near ? share : 1;
    for (int c = 0; c < 3; c++) {
        total[c] = (diffuse[c] * share_diffuse + specular[c] * share) * path->weight[c];
    }
    if (max3(total) > 0 && is_lit(tracer, vertex, sample, emitter)) {
        add_scaled(path->color, total, sample->weight, 1);
    }
}

// One that was drawn so many times on the mean.
static void add_light(PathTracer *tracer, Path *path, const Vertex *vertex, const LightAt *light,
                      const double u[2], double picked, bool is_followed) {
    LightSample sample;
    tracer->counters.light_samples += light->has_area;
    if (light_sample(light, vertex->start, u[0], u[1], &sample)) {
        for (int c = 0; c < 3; c++) {
            sample.weight[c] /= picked;
        }
        sample.density *= picked;
        add_sample(tracer, path, vertex, &sample, NULL, light_is_near(light), is_followed);
    }
}

static void add_emitter(PathTracer *tracer, Path *path, const Vertex *vertex, uint32_t i,
                        const double u[2], double picked) {
    const Emitter *emitter = &tracer->paths->choice.emitters.list[i];
    EmitterSample drawn;
    Vertex there = {.wo = {0, 0, 1}};
    tracer->counters.light_samples++;
    if (!emitter_sample(tracer->view, emitter, vertex->start, u[0], u[1], &drawn) ||
        !(vec3_dot(drawn.dir, vertex->Ng) > 0)) {
        return;
    }
    there.point.material = emitter_material(tracer->view, emitter);
    if (!tracer->paths->material_is_constant[there.point.material]) {
        world_surface(tracer->view, vertex->start, drawn.dir, &drawn.hit, &there.point);
    }
    if (!path_emission(tracer, &there, drawn.dir)) {
        return;
    }
    LightSample sample = {
        .dir = drawn.dir, .distance = drawn.distance, .density = drawn.density * picked};
    for (int c = 0; c < 3; c++) {
        sample.weight[c] = there.bsdf.emission[c] / sample.density;
    }
    add_sample(tracer, path, vertex, &sample, emitter, true, true);
}

// Some of many.
static void add_drawn(PathTracer *tracer, Path *path, const Vertex *vertex, bool is_followed) {
    const LightChoice *choice = &tracer->paths->choice;
    for (uint32_t k = 0; k < LIGHT_CHOICE_DRAWN; k++) {
        double u[SAMPLE_DIMENSIONS], probability;
        sampler_draw(path->sampler, path->index, chosen_set(tracer, path, LIGHT_CHOICE_FEW + k), u);
        uint32_t item =
            light_tree_sample(choice->tree, vertex->start, vertex->Ng, u[2], &probability);
        double picked = LIGHT_CHOICE_DRAWN * probability;
        if (item >= choice->n_lights) {
            add_emitter(tracer, path, vertex, item - choice->n_lights, u, picked);
            continue;
        }
        uint32_t light = choice->lights[item];
        LightAt at;
        if (light_at(&tracer->paths->scene->lights[light], tracer->seconds, &at,
                     &tracer->troubles.lights[light])) {
            add_light(tracer, path, vertex, &at, u, picked, is_followed);
        }
    }
}

void path_ask_lights(PathTracer *tracer, Path *path, const Vertex *vertex, bool is_followed) {
    const LightChoice *choice = &tracer->paths->choice;
    double u[SAMPLE_DIMENSIONS] = {0};
    for (uint32_t i = 0; i < tracer->lights.n; i++) {
        const LightAt *light = &tracer->lights.lights[i];
        if (light->has_area) {
            sampler_draw(path->sampler, path->index, sample_set(tracer, path, 1 + i), u);
        }
        add_light(tracer, path, vertex, light, u, 1, is_followed);
    }
    for (uint32_t i = 0; i < choice->emitters.n && !choice->draws_emitters; i++) {
        sampler_draw(path->sampler, path->index, chosen_set(tracer, path, i), u);
        add_emitter(tracer, path, vertex, i, u, 1);
    }
    if (choice->tree) {
        add_drawn(tracer, path, vertex, is_followed);
    }
    LightSample sample;
    if (light_sky_is_sampled(&tracer->lights)) {
        sampler_draw(path->sampler, path->index,
                     chosen_set(tracer, path, LIGHT_CHOICE_FEW + LIGHT_CHOICE_DRAWN), u);
        tracer->counters.light_samples++;
        if (light_sky_sample(&tracer->lights, u[0], u[1], &sample)) {
            add_sample(tracer, path, vertex, &sample, NULL, true, true);
        }
    }
}

bool path_may_meet_lights(const PathTracer *tracer, bool is_specular) {
    const LightSet *lights = &tracer->lights;
    const LightChoice *choice = &tracer->paths->choice;
    return lights->is_near || choice->is_near ||
           (is_specular && (lights->has_area || choice->has_area));
}
