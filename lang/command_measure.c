// SPDX-License-Identifier: Apache-2.0
// st4 measure: what accuracy costs in a scene.
#include "lang/command_measure.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "accel/clock.h"
#include "lang/hash.h"
#include "lang/session.h"

// The scene's name without folder and ending: results lie where the command is run.
static const char *default_folder(Arena *arena, const char *scene) {
    const char *slash = strrchr(scene, '/'), *name = slash ? slash + 1 : scene;
    const char *dot = strrchr(name, '.');
    int n = (int)(dot && dot != name ? (size_t)(dot - name) : strlen(name));
    return arena_printf(arena, "%.*s.measure", n, name);
}

// Whatever pictures depend on beside the knobs; and the threads, on which the seconds do.
static const char *make_fingerprint(Measure *measure, const Scene *scene) {
    const Options *options = measure->options;
    const char *recipe =
        arena_printf(measure->arena, "%s %s %lld %u %u %u %g %g", ST4_VERSION, scene->hash,
                     (long long)measure->frame, measure->width, measure->height, measure->n_threads,
                     scene->film.fps, scene->shutter.length);
    Hash128 hash = {0};
    hash_add(&hash, recipe, strlen(recipe));
    for (size_t i = 0; i < options->n_uses; i++) {
        const OptionUse *use = &options->uses[i];
        if (use->text && (use->option == OPTION_DEFINE || use->option == OPTION_REF)) {
            hash_add(&hash, use->text, strlen(use->text));
        }
        if (use->option == OPTION_BAKE) {
            hash_add(&hash, "bake", 4);
        }
    }
    char *text = arena_string(measure->arena, recipe, 33);
    hash_text(&hash, text);
    return text;
}

// The frame in the middle of those asked for, or of the film.
static int open_scene(Measure *measure) {
    Session session;
    RenderOptions render;
    int status = session_open(&session, measure->arena, measure->options);
    if (status) {
        return status;
    }
    const Scene *scene = session.scene;
    status = session_render_options(&session, &render) ? STATUS_OK : STATUS_USAGE;
    measure->frame = session.frames[session.n_frames / 2];
    measure->width = scene->film.width;
    measure->height = scene->film.height;
    measure->n_threads = render.n_threads;
    measure->spp = render.spp;
    measure->moves = render_scene_blurs(scene);
    measure->fingerprint = make_fingerprint(measure, scene);
    return session_close(&session, status);
}

static bool make_folder(const Measure *measure) {
    if (mkdir(measure->folder, 0777) == 0 || errno == EEXIST) {
        if (access(measure->folder, W_OK | X_OK) == 0) {
            return true;
        }
    }
    fprintf(stderr, "st4: error: %s: cannot write there: %s\n", measure->folder, strerror(errno));
    return false;
}

// What an interrupted call has is written too.
static int finish(Measure *measure, int status) {
    if (measure->n_points == 0) {
        return status;
    }
    measure_mark_front(measure);
    int written = measure_write(measure);
    measure_print(measure);
    return status ? status : written;
}

static bool check_usage(const Options *options) {
    static const OptionId knobs[] = {OPTION_TOLERANCE, OPTION_ACCEL, OPTION_KAPPA,
                                     OPTION_LEAF_SIZE, OPTION_CPU,   OPTION_SEED};
    if (strcmp(options->operands[0], "-") == 0) {
        fprintf(stderr, "st4: error: not supported yet: measuring a scene from standard input, "
                        "which is read many times\n");
        return false;
    }
    for (size_t i = 0; i < sizeof knobs / sizeof *knobs; i++) {
        if (options->values[knobs[i]].is_set) {
            fprintf(stderr,
                    "st4: error: --%s is a knob that measure turns by itself; leave it out\n",
                    option_infos[knobs[i]].name);
            return false;
        }
    }
    return true;
}

int command_measure(Arena *arena, const Options *options) {
    const char *work = options->values[OPTION_WORK].text;
    Measure measure = {
        .arena = arena,
        .options = options,
        .scene = options->operands[0],
        .folder = work ? work : default_folder(arena, options->operands[0]),
        .budget = options->values[OPTION_BUDGET].number,
        .start = clock_seconds(),
        .is_quiet = option_flag(options, OPTION_QUIET),
    };
    if (!check_usage(options)) {
        return STATUS_USAGE;
    }
    int status = open_scene(&measure);
    if (status) {
        return status;
    }
    if (!make_folder(&measure)) {
        return STATUS_FILES;
    }
    status = measure_find_reference(&measure);
    if (status) {
        return status;
    }
    measure_resume(&measure);
    return finish(&measure, measure_turn_knobs(&measure));
}
