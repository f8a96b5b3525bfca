// SPDX-License-Identifier: Apache-2.0
// A survey: programs of one frame after the other, at many instants, until something shows.
#include "render/survey.h"

#include <math.h>

#include "render/mover.h"
#include "render/report.h"
#include "render/shutter.h"

enum {
    INSTANTS = 256, // of one opening of the shutter
    MOST_OUT = 14,  // outputs of a light's program
    SHAPES = 4096,  // that are looked at; with more, some are taken to be visible
    COLORS = 4096,  // times frames that are looked at; with more, some are taken to be fine
};

// Instants that a frame sees, the ends included.
static void find_instants(const Scene *scene, int64_t frame, double seconds[INSTANTS]) {
    const ShutterSpan seen = shutter_seen(&scene->shutter, frame);
    for (int i = 0; i < INSTANTS; i++) {
        double offset = seen.start.frac + seen.length * i / (INSTANTS - 1);
        seconds[i] = instant_seconds(instant_at(seen.start.frame, offset), scene->film.fps);
    }
}

static void run(const Program *program, const double *seconds, const Shape *shape,
                double out[][INSTANTS]) {
    ProgramInputs in = {.varying = 1u << IN_T | 1u << IN_FILM_T};
    double *columns[MOST_OUT];
    in.at[IN_T] = in.at[IN_FILM_T] = seconds;
    if (shape) {
        mover_set_loops(&in, shape, 0);
    }
    for (uint32_t k = 0; k < program_n_out(program); k++) {
        columns[k] = out[k];
    }
    program_run(program, &in, INSTANTS, columns);
}

// Power and color of a light, where its program has them.
static bool shines(LightKind kind, double out[][INSTANTS], int i) {
    int power = 3, color = kind == LIGHT_SKY ? 0 : 4;
    return out[power][i] > 0 &&
           (out[color][i] > 0 || out[color + 1][i] > 0 || out[color + 2][i] > 0);
}

static bool light_shines_in(const Scene *scene, const Light *light, int64_t frame) {
    double seconds[INSTANTS], out[MOST_OUT][INSTANTS], visible[1][INSTANTS];
    find_instants(scene, frame, seconds);
    bool is_even = !program_reads_time(light->program);
    run(light->program, seconds, NULL, out);
    if (light->visible) {
        run(light->visible, seconds, NULL, visible);
    }
    for (int i = 0; i < INSTANTS; i++) {
        // What is not finite is reported elsewhere.
        if ((!light->visible || visible[0][i] != 0) && (is_even || shines(light->kind, out, i))) {
            return true;
        }
    }
    return false;
}

static void survey_light(const Scene *scene, const RenderOptions *options, const Light *light,
                         const Reporter *reporter) {
    static const char *const names[] = {"sun", "lamp", "sky", "lamp", "area"};
    bool is_still = !program_reads_time(light->program) && !program_reads_time(light->visible);
    bool is_seen = is_still;
    for (uint32_t f = 0; f < options->n_frames && !is_seen; f++) {
        is_seen = light_shines_in(scene, light, options->frames[f]);
    }
    if (!is_seen) {
        report_warning(reporter, light->where, "light-never-visible",
                       "this %s gives no light at any instant at which the shutter is open",
                       names[light->kind]);
    }
}

static bool shape_is_there_in(const Scene *scene, const Shape *shape, int64_t frame) {
    double seconds[INSTANTS], visible[1][INSTANTS];
    find_instants(scene, frame, seconds);
    run(shape->visible, seconds, shape, visible);
    for (int i = 0; i < INSTANTS; i++) {
        if (visible[0][i] != 0) {
            return true;
        }
    }
    return false;
}

// A color that depends on nothing but time, in some frame.
static bool color_exceeds_one(const Scene *scene, const Material *material, int64_t frame) {
    double seconds[INSTANTS], out[MOST_OUT][INSTANTS];
    find_instants(scene, frame, seconds);
    run(material->program, seconds, NULL, out);
    for (int i = 0; i < INSTANTS; i++) {
        if (out[0][i] > 1 || out[1][i] > 1 || out[2][i] > 1) {
            return true;
        }
    }
    return false;
}

static void survey_material(const Scene *scene, const RenderOptions *options,
                            const Material *material, const Reporter *reporter, uint32_t *n_left) {
    const uint32_t time = 1u << IN_T | 1u << IN_FILM_T;
    uint32_t inputs = program_inputs(material->program);
    if (!material_reflects(material->kind) || !inputs || inputs & ~time) {
        return;
    }
    uint32_t n = options->n_frames < *n_left ? options->n_frames : *n_left;
    for (uint32_t f = 0; f < n; f++, --*n_left) {
        if (color_exceeds_one(scene, material, options->frames[f])) {
            report_warning(reporter, material->where, "albedo-above-one",
                           "this color is above 1 at some instant at which the shutter is open: "
                           "the surface sends back more light than falls on it");
            return;
        }
    }
}

// Of shapes in loops whose visibility differs, whether the first is there says nothing of the
// others: they are taken to be.
static bool anything_is_there(const Scene *scene, const RenderOptions *options) {
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        const Shape *shape = &scene->shapes[s];
        if (!shape->visible || program_reads_loops(shape->visible) || s >= SHAPES) {
            return true;
        }
        bool is_still = !program_reads_time(shape->visible);
        for (uint32_t f = 0; f < (is_still ? 1 : options->n_frames); f++) {
            if (shape_is_there_in(scene, shape, options->frames[f])) {
                return true;
            }
        }
    }
    return scene->n_shapes == 0;
}

void survey_scene(const Scene *scene, const RenderOptions *options, const Reporter *reporter) {
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        if (scene->lights[i].where) {
            survey_light(scene, options, &scene->lights[i], reporter);
        }
    }
    for (uint32_t i = 0, n_left = COLORS; i < scene->n_materials && n_left > 0; i++) {
        survey_material(scene, options, &scene->materials[i], reporter, &n_left);
    }
    if (!anything_is_there(scene, options)) {
        report_warning(reporter, 0, "empty",
                       "no shape is visible at any instant at which the shutter is open");
    }
}
