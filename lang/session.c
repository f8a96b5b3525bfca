// SPDX-License-Identifier: Apache-2.0
// What the commands that read a scene have in common: diagnostics, loading, the frames asked for.
#include "lang/session.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accel/clock.h"
#include "accel/cpu.h"
#include "lang/command.h"

static bool wants_color(const Options *options) {
    enum { AUTO, ALWAYS, NEVER };
    uint64_t choice = options->values[OPTION_COLOR].integer;
    const char *terminal = getenv("TERM"), *no_color = getenv("NO_COLOR");
    bool is_able = isatty(STDERR_FILENO) && terminal && strcmp(terminal, "dumb") != 0 &&
                   !(no_color && *no_color);
    return choice == ALWAYS || (choice == AUTO && is_able);
}

static bool refuse_warning(Diag *diag, const char *text) {
    const char *names[WARN_COUNT];
    for (int i = 0; i < WARN_COUNT; i++) {
        names[i] = warning_infos[i].name;
    }
    bool is_off = !strncmp(text, "no-", 3);
    const char *near = diag_nearest(is_off ? text + 3 : text, names, WARN_COUNT);
    diag_error(diag, (Span){0, 0}, NULL, "-W: there is no warning '%s'%s%s%s%s", text,
               near ? "; did you mean '" : "", near && is_off ? "no-" : "", near ? near : "",
               near ? "'?" : "");
    return false;
}

// Notes that are of use to some commands only: a let that nothing uses may be there for `eval`.
static void quiet_notes(Session *session) {
    Command command = session->options->command;
    if (command != COMMAND_RENDER && command != COMMAND_CHECK) {
        diag_set_warning(session->diag, "no-unused-let");
    }
    if (command != COMMAND_CHECK) {
        diag_set_warning(session->diag, "no-estimated-rate");
        diag_set_warning(session->diag, "no-sim-rests");
    }
}

// -q turns all warnings off, so that a -W after it or before it can turn one on again.
static bool set_warnings(Session *session) {
    quiet_notes(session);
    if (option_flag(session->options, OPTION_QUIET)) {
        for (int i = 0; i < WARN_COUNT; i++) {
            diag_set_warning(session->diag,
                             arena_printf(session->arena, "no-%s", warning_infos[i].name));
        }
    }
    size_t n;
    const char *const *list = options_list(session->arena, session->options, OPTION_WARNING, &n);
    for (size_t i = 0; i < n; i++) {
        if (!diag_set_warning(session->diag, list[i])) {
            return refuse_warning(session->diag, list[i]);
        }
    }
    return true;
}

static void emit(void *context, SourceRef where, const char *name, const char *message) {
    Session *session = context;
    diag_next_statement(session->diag);
    for (int i = 0; name && i < WARN_COUNT; i++) {
        if (!strcmp(name, warning_infos[i].name)) {
            diag_warn(session->diag, (Warning)i, scene_span(where), NULL, "%s", message);
            return;
        }
    }
    diag_error(session->diag, scene_span(where), NULL, "%s", message);
}

static void load(Session *session, LoadedScene *loaded) {
    const Options *options = session->options;
    const OptionValue *values = options->values;
    LoadOptions load = {
        .width = values[OPTION_SIZE].width,
        .height = values[OPTION_SIZE].height,
        .fps = values[OPTION_FPS].number,
        .shutter = values[OPTION_SHUTTER].text,
        .memory = values[OPTION_MEMORY].integer,
    };
    load.defines = options_list(session->arena, options, OPTION_DEFINE, &load.n_defines);
    bool is_quiet = option_flag(options, OPTION_QUIET);
    session->sims = (SimCache){
        .folder = sim_cache_folder(session->arena, values[OPTION_CACHE].text),
        .progress =
            !is_quiet && !values[OPTION_PROGRESS].is_set && isatty(STDERR_FILENO) ? stderr : NULL,
        .list = options->command == COMMAND_SIM && !is_quiet ? stdout : NULL,
        .reports = stderr,
    };
    session->simulator = sim_cache_simulator(&session->sims, options->command == COMMAND_SIM);
    load.simulator = &session->simulator;
    load.include_dirs = options_list(session->arena, options, OPTION_INCLUDE, &load.n_include_dirs);
    scene_load(session->arena, &session->sources, session->diag, options->operands[0], NULL, 0,
               &load, loaded);
    session->scene = loaded->scene;
}

static bool find_frames(Session *session) {
    const FilmSettings *film = &session->scene->film;
    FrameSpan whole = {.first = film->first_frame, .last = film->last_frame, .step = 1};
    FrameList list = {.spans = &whole, .n_spans = 1};
    const OptionValue *asked = &session->options->values[OPTION_FRAMES];
    session->frames = frame_list_frames(session->arena, asked->is_set ? &asked->frames : &list,
                                        film->last_frame, &session->n_frames);
    if (session->n_frames) {
        return true;
    }
    const char *what = asked->is_set ? asked->text : "the film";
    if (session->frames) {
        diag_error(session->diag, (Span){0, 0}, NULL, "'%s' has no frame: the film ends with %lld",
                   what, (long long)film->last_frame);
    } else {
        diag_error(session->diag, (Span){0, 0}, "choose some of them by -f",
                   "%s has more than %d frames", what, FRAME_LIST_MAX);
    }
    return false;
}

static bool set_cpu(const Session *session) {
    const OptionValue *value = &session->options->values[OPTION_CPU];
    const char *name = value->is_set ? cpu_names[value->integer] : NULL;
    if (cpu_set(name)) {
        return true;
    }
    const char *names = "";
    for (int cpu = 0; cpu < CPU_COUNT; cpu++) {
        if (cpu_has((Cpu)cpu)) {
            names =
                arena_printf(session->arena, "%s%s %s", names, *names ? "," : "", cpu_names[cpu]);
        }
    }
    diag_error(session->diag, (Span){0, 0}, NULL, "--cpu: this processor has no %s, only%s", name,
               names);
    return false;
}

int session_begin(Session *session, Arena *arena, const Options *options) {
    enum { TEXT, JSON };
    *session = (Session){.arena = arena, .options = options, .began = clock_seconds()};
    session->sources = (Sources){.arena = arena, .end = 1};
    session->reporter = (Reporter){emit, session};
    session->diag = diag_new(arena, &session->sources, stderr,
                             options->values[OPTION_DIAG].integer == JSON, wants_color(options));
    if (!set_cpu(session)) {
        return STATUS_USAGE;
    }
    return set_warnings(session) ? STATUS_OK : STATUS_USAGE;
}

int session_load(Session *session, Arena *arena, const Options *options, LoadedScene *loaded) {
    *loaded = (LoadedScene){0};
    int status = session_begin(session, arena, options);
    if (status) {
        return status;
    }
    load(session, loaded);
    if (loaded->status || !session->scene || diag_n_errors(session->diag)) {
        session->scene = NULL;
        return session_close(session, loaded->status ? loaded->status : STATUS_SCENE);
    }
    return STATUS_OK;
}

int session_open(Session *session, Arena *arena, const Options *options) {
    LoadedScene loaded;
    int status = session_load(session, arena, options, &loaded);
    scene_load_free(&loaded);
    if (status || find_frames(session)) {
        return status;
    }
    return options->values[OPTION_FRAMES].is_set ? STATUS_USAGE : STATUS_SCENE;
}

static const AccelType *find_accel(const Session *session, const char *name) {
    const AccelType *found = name ? accel_find(name) : &accel_types[0];
    if (!found) {
        const char *names = "";
        for (const AccelType *type = accel_types; type->name; type++) {
            names = arena_printf(session->arena, "%s%s %s", names, *names ? "," : "", type->name);
        }
        diag_error(session->diag, (Span){0, 0}, NULL, "--accel: '%s' is none of%s", name, names);
    }
    return found;
}

// What the command line says of samples, noise and time, or, where it says nothing, the scene.
typedef struct {
    bool has_spp, has_noise;
    double spp, noise, seconds;
} Bounds;

static Bounds find_bounds(const Session *session) {
    const OptionValue *values = session->options->values;
    const OptionValue *spp = &values[OPTION_SPP], *noise = &values[OPTION_NOISE],
                      *time = &values[OPTION_TIME];
    const RenderSettings *scene = &session->scene->render;
    if (spp->is_set || noise->is_set || time->is_set) {
        return (Bounds){spp->is_set, noise->is_set, spp->number, noise->number, time->number};
    }
    // Only of pictures: what measures and what checks takes its samples itself.
    bool is_picture = session->options->command == COMMAND_RENDER;
    return (Bounds){.has_spp = scene->spp > 0,
                    .has_noise = is_picture && scene->has_noise,
                    .spp = scene->spp ? scene->spp : spp->number,
                    .noise = scene->noise,
                    .seconds = is_picture ? scene->seconds : 0};
}

static bool refuse_bounds(const Session *session, const char *message, const char *hint) {
    diag_error(session->diag, (Span){0, 0}, hint, "%s", message);
    return false;
}

static bool set_bounds(const Session *session, RenderOptions *render) {
    const OptionValue *values = session->options->values;
    Bounds bounds = find_bounds(session);
    render->is_adaptive = bounds.has_noise || bounds.seconds > 0;
    render->noise = bounds.noise;
    render->seconds = bounds.seconds;
    render->began = session->began;
    render->mean_spp = bounds.has_spp || !render->is_adaptive ? bounds.spp : RENDER_SPP_UNBOUNDED;
    render->spp = (uint32_t)ceil(render->mean_spp);
    if (!render->is_adaptive) {
        return bounds.spp == floor(bounds.spp) ||
               refuse_bounds(session, "--spp is a whole number without --noise and --time", NULL);
    }
    if (!(bounds.noise > 0) && !(bounds.seconds > 0) && !bounds.has_spp) {
        return refuse_bounds(session, "a noise of 0 is never reached", "give --spp or --time too");
    }
    if (values[OPTION_SAMPLES].is_set) {
        return refuse_bounds(session,
                             "--samples are of a number that is the same for all pixels, which "
                             "--noise and --time do not know",
                             "give --spp alone");
    }
    if (render->subframes > 0) {
        return refuse_bounds(session,
                             "--method accumulate shares out a number of samples, which --noise "
                             "and --time do not know",
                             "give --spp alone");
    }
    return true;
}

static bool check_subframes(const Session *session, const RenderOptions *render) {
    const OptionValue *asked = &session->options->values[OPTION_SUBFRAMES];
    uint32_t n = render->subframes;
    if (asked->is_set && n == 0) {
        diag_error(session->diag, (Span){0, 0}, NULL, "--subframes is for --method accumulate");
        return false;
    }
    if (n > 0 && render->spp % n != 0) {
        diag_error(session->diag, (Span){0, 0}, NULL,
                   "%u samples per pixel cannot be shared among %u subframes evenly; --spp %u can",
                   render->spp, n, (render->spp / n + 1) * n);
        return false;
    }
    return true;
}

static bool set_crop(const Session *session, RenderOptions *render) {
    const OptionValue *value = &session->options->values[OPTION_CROP];
    const FilmSettings *film = &session->scene->film;
    if (!value->is_set) {
        return true;
    }
    const uint32_t *crop = value->crop;
    if (crop[1] > film->width || crop[3] > film->height) {
        diag_error(session->diag, (Span){0, 0}, NULL,
                   "--crop: '%s' reaches beyond the picture of %ux%u pixels", value->text,
                   film->width, film->height);
        return false;
    }
    render->crop_x0 = crop[0];
    render->crop_x1 = crop[1];
    render->crop_y0 = crop[2];
    render->crop_y1 = crop[3];
    return true;
}

bool session_render_options(const Session *session, RenderOptions *render) {
    const OptionValue *values = session->options->values;
    const RenderSettings *settings = &session->scene->render;
    uint64_t n_threads = values[OPTION_THREADS].integer;
    *render = (RenderOptions){
        .frames = session->frames,
        .n_frames = session->n_frames,
        .subframes = values[OPTION_METHOD].integer ? (uint32_t)values[OPTION_SUBFRAMES].integer : 0,
        .seed = values[OPTION_SEED].is_set ? values[OPTION_SEED].integer : settings->seed,
        .tolerance = values[OPTION_TOLERANCE].number,
        .first_sample = values[OPTION_SAMPLES].first,
        .last_sample = values[OPTION_SAMPLES].last,
        .checkpoint = values[OPTION_CHECKPOINT].number,
        .resume = option_flag(session->options, OPTION_RESUME),
        .skip_existing = option_flag(session->options, OPTION_SKIP_EXISTING),
        .has_layers = values[OPTION_AOV].is_set,
        .layers = (uint32_t)values[OPTION_AOV].integer,
        .n_threads = n_threads ? (uint32_t)n_threads : (uint32_t)omp_get_num_procs(),
        .memory = values[OPTION_MEMORY].integer,
        .accel = find_accel(session, values[OPTION_ACCEL].text),
        .accel_options = accel_options_default(),
        .bake = option_flag(session->options, OPTION_BAKE),
        .validate = option_flag(session->options, OPTION_VALIDATE),
        .software = "st4 " ST4_VERSION,
        .command_line = session->options->recipe,
    };
    if (!set_bounds(session, render) || !set_crop(session, render)) {
        return false;
    }
    AccelOptions *accel = &render->accel_options;
    accel->kappa = values[OPTION_KAPPA].number;
    accel->leaf_size = (uint32_t)values[OPTION_LEAF_SIZE].integer;
    accel->max_depth = (uint32_t)values[OPTION_MAX_DEPTH].integer;
    accel->n_threads = render->n_threads;
    return render->accel != NULL && check_subframes(session, render);
}

int session_refuse(const Session *session, int status, const char *path, const char *message) {
    diag_next_statement(session->diag);
    diag_error(session->diag, (Span){0, 0}, NULL, "%s: %s", path, message);
    return status;
}

int session_close(Session *session, int status) {
    diag_finish(session->diag);
    return status == STATUS_OK && diag_n_errors(session->diag) ? STATUS_SCENE : status;
}
