// SPDX-License-Identifier: Apache-2.0
// Bounds of lights over a shutter, and the tree over them.
#include "render/light_choice.h"

#include "render/sampling.h"
#include "render/shutter.h"

#include <string.h>

enum { INSTANTS = 17 }; // at which moving lights are bounded

// What an emitter is taken to give at least, in parts of the brightest of its material: it may
// glow where and when it was not asked.
static const double FAINTEST = 0.05;

typedef struct {
    const LightChoiceInput *input;
    LightBounds *bounds; // [n]: joined over the instants
    Vec3 *last;          // [n]: middle at the last instant
    double *step;        // [n]: the most that it moved between two of them
    double *glow;        // [n emitters]: the brightest that was found
    uint32_t *material;  // [n emitters]: of those that were there
    uint32_t n;
} Work;

static Vec3 middle(const LightBounds *b) {
    return vec3_scale(vec3_add(b->lo, b->hi), 0.5);
}

// The narrowest cone around one axis: enough for what turns a little.
static void join_cone(LightBounds *sum, const LightBounds *more) {
    Vec3 axis = more->axis;
    double cosine = vec3_dot(sum->axis, axis);
    if (sum->two_sided && cosine < 0) {
        cosine = -cosine;
    }
    // cos(apart + half angle of `more`)
    double sines =
        sqrt(fmax(1 - cosine * cosine, 0)) * sqrt(fmax(1 - more->cos_o * more->cos_o, 0));
    double joined = more->cos_o <= -1 || cosine < -more->cos_o ? -1 : cosine * more->cos_o - sines;
    sum->cos_o = fmin(sum->cos_o, joined);
    sum->cos_e = fmin(sum->cos_e, more->cos_e);
}

static void join_instant(Work *w, uint32_t i, const LightBounds *now) {
    LightBounds *sum = &w->bounds[i];
    if (!(now->power > 0) || !vec3_is_finite(now->lo) || !vec3_is_finite(now->hi)) {
        return;
    }
    if (!(sum->power > 0)) {
        *sum = *now;
    } else {
        sum->lo = vec3(fmin(sum->lo.x, now->lo.x), fmin(sum->lo.y, now->lo.y),
                       fmin(sum->lo.z, now->lo.z));
        sum->hi = vec3(fmax(sum->hi.x, now->hi.x), fmax(sum->hi.y, now->hi.y),
                       fmax(sum->hi.z, now->hi.z));
        sum->power = fmax(sum->power, now->power);
        join_cone(sum, now);
        w->step[i] = fmax(w->step[i], vec3_length(vec3_sub(middle(now), w->last[i])));
    }
    w->last[i] = middle(now);
}

// ---- Lamps, spots, areas

static bool is_local(const Light *light) {
    return light->kind == LIGHT_LAMP || light->kind == LIGHT_SPOT || light->kind == LIGHT_AREA;
}

static LightBounds light_bounds(const LightAt *light) {
    Vec3 reach = vec3(light->radius, light->radius, light->radius);
    double mean = (light->color[0] + light->color[1] + light->color[2]) / 3;
    LightBounds b = {.axis = vec3(0, 0, 1), .cos_o = -1, .cos_e = 0};
    if (light->kind == LIGHT_AREA) {
        Vec3 u = light->half_u, v = light->half_v;
        reach = vec3(fabs(u.x) + fabs(v.x), fabs(u.y) + fabs(v.y), fabs(u.z) + fabs(v.z));
        b.axis = light->axis;
        b.cos_o = 1;
        b.two_sided = light->two_sided;
        b.power = mean * SAMPLING_PI * light->size * (light->two_sided ? 2 : 1);
    } else {
        double area = light->has_area ? SAMPLING_PI * light->radius * light->radius : 1;
        b.power = mean * area * 4 * SAMPLING_PI;
    }
    if (light->kind == LIGHT_SPOT) {
        b.axis = light->axis;
        b.cos_o = 1;
        b.cos_e = light->cos_outer;
    }
    b.lo = vec3_sub(light->at, reach);
    b.hi = vec3_add(light->at, reach);
    return b;
}

static void bound_lights(Work *w, LightChoice *choice, double seconds) {
    for (uint32_t i = 0; i < choice->n_lights; i++) {
        LightAt at;
        bool is_bad;
        if (light_at(&w->input->scene->lights[choice->lights[i]], seconds, &at, &is_bad)) {
            LightBounds now = light_bounds(&at);
            choice->has_area |= at.has_area;
            choice->is_near |= light_is_near(&at);
            join_instant(w, i, &now);
        }
    }
}

// ---- Emitters

static void bound_emitters(Work *w, const LightChoice *choice, WorldView *view, double seconds,
                           uint32_t instant, uint32_t first) {
    const LightChoiceInput *in = w->input;
    for (uint32_t i = 0; i < choice->emitters.n; i++) {
        const Emitter *emitter = &choice->emitters.list[i];
        LightBounds now;
        if (!emitter_bounds(view, emitter, &now)) {
            continue;
        }
        join_instant(w, first + i, &now);
        uint32_t material = emitter_material(view, emitter);
        w->material[i] = material;
        bool is_even = in->materials->is_even[material];
        SurfacePoint point;
        for (uint32_t k = 0; k < (is_even ? 1 : EMITTER_POINTS); k++) {
            // Over time all of its points are asked, each instant asks one.
            if (in->moves && !is_even && k != instant % EMITTER_POINTS) {
                continue;
            }
            if (!is_even) {
                emitter_point(view, emitter, k, &point);
            }
            double rgb[3];
            const MaterialPlace place = {&point, NULL, seconds};
            if (material_glow(in->materials, material, &place, NULL, rgb)) {
                w->glow[i] = fmax(w->glow[i], (rgb[0] + rgb[1] + rgb[2]) / 3);
            }
        }
    }
}

// Power is area times radiance, the faintest of a material not too far below the brightest.
static void weigh_emitters(Work *w, Arena *arena, const LightChoice *choice, uint32_t first) {
    const LightChoiceInput *in = w->input;
    double *most = ARENA_ARRAY(arena, in->scene->n_materials, double);
    for (uint32_t i = 0; i < choice->emitters.n; i++) {
        uint32_t m = w->material[i];
        most[m] = fmax(most[m], w->glow[i]);
    }
    for (uint32_t i = 0; i < choice->emitters.n; i++) {
        uint32_t m = w->material[i];
        double least = in->materials->is_even[m] ? 0 : most[m] > 0 ? FAINTEST * most[m] : 1;
        w->bounds[first + i].power *= SAMPLING_PI * fmax(w->glow[i], least);
    }
}

// ---- The tree

static void bound_all(Work *w, LightChoice *choice, uint32_t first_emitter) {
    const LightChoiceInput *in = w->input;
    WorldView *view = world_view_new(in->world);
    uint32_t n = in->moves ? INSTANTS : 1;
    for (uint32_t k = 0; k < n; k++) {
        double u = n > 1 ? (double)k / (n - 1) : 0.5;
        // Over all that any pixel sees.
        const ShutterSettings *shutter = &in->scene->shutter;
        double delay = shutter->first_delay + u * (shutter->last_delay - shutter->first_delay);
        Instant at = shutter_instant(shutter, in->frame, delay, u);
        double seconds = instant_seconds(at, in->scene->film.fps);
        world_view_time(view, at);
        bound_lights(w, choice, seconds);
        if (choice->draws_emitters) {
            bound_emitters(w, choice, view, seconds, k, first_emitter);
        }
    }
    world_view_destroy(view, NULL);
}

static const LightTree *build(Arena *arena, const LightChoiceInput *input, LightChoice *choice) {
    Arena scratch = {0};
    uint32_t n_emitters = choice->draws_emitters ? choice->emitters.n : 0;
    Work w = {.input = input, .n = choice->n_lights + n_emitters};
    w.bounds = ARENA_ARRAY(&scratch, w.n, LightBounds);
    w.last = ARENA_ARRAY(&scratch, w.n, Vec3);
    w.step = ARENA_ARRAY(&scratch, w.n, double);
    w.glow = ARENA_ARRAY(&scratch, n_emitters, double);
    w.material = ARENA_ARRAY(&scratch, n_emitters, uint32_t);
    bound_all(&w, choice, choice->n_lights);
    if (choice->draws_emitters) {
        weigh_emitters(&w, &scratch, choice, choice->n_lights);
    }
    for (uint32_t i = 0; i < w.n; i++) { // for the way between two instants
        Vec3 by = vec3(w.step[i] / 2, w.step[i] / 2, w.step[i] / 2);
        w.bounds[i].lo = vec3_sub(w.bounds[i].lo, by);
        w.bounds[i].hi = vec3_add(w.bounds[i].hi, by);
    }
    const LightTree *tree = light_tree_build(arena, w.bounds, w.n);
    arena_free(&scratch);
    return tree;
}

LightChoice light_choice_new(Arena *arena, const LightChoiceInput *input) {
    const Scene *scene = input->scene;
    LightChoice choice = {.tree = NULL};
    bool any_glows = false;
    uint32_t n_local = 0;
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        any_glows |= input->materials->glows[i];
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        n_local += is_local(&scene->lights[i]);
    }
    if (any_glows) {
        choice.emitters = emitters_find(arena, input->world, input->materials->glows);
    }
    choice.draws_emitters = choice.emitters.n > LIGHT_CHOICE_FEW;
    choice.draws_lights = n_local > LIGHT_CHOICE_FEW;
    if (choice.draws_lights) {
        uint32_t *lights = ARENA_ARRAY(arena, n_local, uint32_t);
        for (uint32_t i = 0; i < scene->n_lights; i++) {
            if (is_local(&scene->lights[i])) {
                lights[choice.n_lights++] = i;
            }
        }
        choice.lights = lights;
    }
    if (choice.draws_lights || choice.draws_emitters) {
        choice.tree = build(arena, input, &choice);
    }
    return choice;
}

double light_choice_emitter(const LightChoice *choice, Vec3 from, Vec3 normal, uint32_t emitter) {
    if (!choice->draws_emitters) {
        return 1;
    }
    uint32_t item = choice->n_lights + emitter;
    return choice->tree
               ? LIGHT_CHOICE_DRAWN * light_tree_probability(choice->tree, from, normal, item)
               : 0;
}

double light_choice_light(const LightChoice *choice, Vec3 from, Vec3 normal, uint32_t light) {
    return choice->tree
               ? LIGHT_CHOICE_DRAWN * light_tree_probability(choice->tree, from, normal, light)
               : 0;
}
