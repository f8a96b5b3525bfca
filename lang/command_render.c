// SPDX-License-Identifier: Apache-2.0
// st4 render: from a script to pictures.
#include "lang/command.h"

#include <string.h>
#include <unistd.h>

#include "lang/session.h"
#include "render/film_file.h"
#include "render/image.h"
#include "render/movie.h"
#include "render/outfile.h"

enum { PATH_SIZE = 4096 };

// Where pictures go. The first pattern is rendered to; the others are made from its files.
typedef struct {
    const char **patterns;
    size_t n_patterns;
    bool is_numbered; // there are several frames
} Outputs;

// The script's name without folder and ending, with the frame's number where there are several:
// "propeller.####.exr".
static const char *default_out(Arena *arena, const char *script, bool many) {
    const char *slash = strrchr(script, '/');
    const char *name = slash ? slash + 1 : script;
    if (!strcmp(script, "-")) {
        name = "scene";
    }
    const char *dot = strrchr(name, '.');
    size_t length = dot && dot != name ? (size_t)(dot - name) : strlen(name);
    return arena_printf(arena, "%.*s%s.exr", (int)length, name, many ? ".####" : "");
}

static ProgressKind progress_kind(const Options *options) {
    static const ProgressKind kinds[] = {PROGRESS_BAR, PROGRESS_JSON, PROGRESS_NONE};
    const OptionValue *value = &options->values[OPTION_PROGRESS];
    if (value->is_set) {
        return kinds[value->integer];
    }
    bool is_watched = isatty(STDERR_FILENO) && !option_flag(options, OPTION_QUIET);
    return is_watched ? PROGRESS_BAR : PROGRESS_NONE;
}

// What pictures whose samples were allotted by need have reached.
static void print_reached(const RenderStats *stats) {
    static const char *const words[RENDER_STOPS] = {"noise", "samples", "time"};
    const char *before = "; ended by ";
    fprintf(stderr, "noise     %.3g%s, %.4g samples per pixel", stats->noise_reached,
            stats->n_frames > 1 ? " in the worst frame" : "", stats->mean_samples);
    for (int i = 0; i < RENDER_STOPS; i++) {
        if (stats->n_stopped[i]) {
            fprintf(stderr, "%s%s", before, words[i]);
            before = ", ";
        }
        if (stats->n_stopped[i] && stats->n_frames > 1) {
            fprintf(stderr, " (%llu)", (unsigned long long)stats->n_stopped[i]);
        }
    }
    fputc('\n', stderr);
}

static void print_result(const RenderOptions *render, const RenderStats *stats, bool is_verbose) {
    char first[PATH_SIZE], last[PATH_SIZE];
    bool many = render->n_frames > 1;
    double seconds = stats->sample_seconds + stats->segment_seconds + stats->build_seconds +
                     stats->trace_seconds + stats->write_seconds;
    if (!render_frame_path(render->out, render->frames[0], many, first, sizeof first) ||
        !render_frame_path(render->out, render->frames[render->n_frames - 1], many, last,
                           sizeof last)) {
        return;
    }
    if (stats->n_skipped_frames) {
        fprintf(stderr, "st4: wrote %llu frames of %s%s%s in %.1f s, left %llu\n",
                (unsigned long long)stats->n_frames, first, many ? " to " : "", many ? last : "",
                seconds, (unsigned long long)stats->n_skipped_frames);
    } else {
        fprintf(stderr, "st4: wrote %s%s%s in %.1f s\n", first, many ? " to " : "",
                many ? last : "", seconds);
    }
    if (render->is_adaptive && stats->n_frames) {
        print_reached(stats);
    }
    if (!is_verbose) {
        return;
    }
    fprintf(stderr,
            "seconds   sample %.2f, segment %.2f, build %.2f, trace %.2f, write %.2f\n"
            "scene     %llu objects, %llu triangles, %llu spheres, %llu sampled instants\n"
            "bytes     vertices %zu, segments %zu, tree %zu\n"
            "rays      camera %llu, shadow %llu, bounce %llu\n"
            "motion    within %.3g pixels of the true one\n",
            stats->sample_seconds, stats->segment_seconds, stats->build_seconds,
            stats->trace_seconds, stats->write_seconds, (unsigned long long)stats->n_objects,
            (unsigned long long)stats->n_triangles, (unsigned long long)stats->n_spheres,
            (unsigned long long)stats->n_keys, stats->vertex_bytes, stats->segment_bytes,
            stats->tree_bytes, (unsigned long long)stats->camera_rays,
            (unsigned long long)stats->shadow_rays, (unsigned long long)stats->bounce_rays,
            stats->tolerance_reached);
}

// What an interrupted run has left to go on from.
static void print_interrupted(const RenderOptions *render) {
    char picture[PATH_SIZE], path[PATH_SIZE + 16];
    for (uint32_t i = 0; i < render->n_frames; i++) {
        if (render_frame_path(render->out, render->frames[i], render->n_frames > 1, picture,
                              sizeof picture) &&
            render_checkpoint_path(picture, path, sizeof path) && access(path, F_OK) == 0) {
            fprintf(stderr, "st4: interrupted; --resume goes on from '%s'\n", path);
            return;
        }
    }
    fprintf(stderr, "st4: interrupted; finished pictures stay\n");
}

// An .exr comes first, as the only format that the others can be made from without loss.
static void put_exr_first(Outputs *outputs) {
    for (size_t i = 0; i < outputs->n_patterns; i++) {
        if (image_is_exr(outputs->patterns[i])) {
            const char *first = outputs->patterns[0];
            outputs->patterns[0] = outputs->patterns[i];
            outputs->patterns[i] = first;
            return;
        }
    }
}

// Patterns from the command line, else from the film, else from the script's name.
static void find_outputs(const Session *session, Outputs *outputs) {
    const Options *options = session->options;
    const char *film = session->scene->film.out;
    outputs->is_numbered = session->n_frames > 1;
    const char *const *asked =
        options_list(session->arena, options, OPTION_OUT, &outputs->n_patterns);
    size_t n = outputs->n_patterns ? outputs->n_patterns : 1;
    outputs->patterns = ARENA_ARRAY(session->arena, n, const char *);
    for (size_t i = 0; i < outputs->n_patterns; i++) {
        outputs->patterns[i] = asked[i];
    }
    if (!outputs->n_patterns) {
        outputs->n_patterns = 1;
        outputs->patterns[0] =
            film ? film : default_out(session->arena, options->operands[0], outputs->is_numbered);
    }
    put_exr_first(outputs);
}

// What can be known to go wrong before the first ray.
static int check_stats(const Session *session) {
    const char *path = session->options->values[OPTION_STATS].text;
    char message[256];
    OutFile file;
    if (!path) {
        return STATUS_OK;
    }
    if (!outfile_open(&file, path, message, sizeof message)) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    outfile_abandon(&file);
    return STATUS_OK;
}

// Sums are what slices are for; pictures cannot be made from one, and nothing else from sums.
static int check_sums(const Session *session, const RenderOptions *render, const Outputs *outputs) {
    const OptionValue *samples = &session->options->values[OPTION_SAMPLES];
    size_t n_films = 0;
    for (size_t i = 0; i < outputs->n_patterns; i++) {
        n_films += film_file_has_ending(outputs->patterns[i]);
    }
    if (n_films && outputs->n_patterns > 1) {
        return session_refuse(session, STATUS_USAGE, outputs->patterns[0],
                              "a file of sums (" RENDER_FILM_ENDING
                              ") is the only output of a run; "
                              "'st4 merge' makes pictures from it");
    }
    if (n_films && render->is_adaptive) {
        return session_refuse(session, STATUS_USAGE, outputs->patterns[0],
                              "a file of sums has a number of samples that is the same for all "
                              "pixels, which --noise and --time do not know; give --spp alone");
    }
    if (samples->is_set && !n_films) {
        return session_refuse(
            session, STATUS_USAGE, outputs->patterns[0],
            "--samples makes files of sums: a name such as part.####" RENDER_FILM_ENDING
            " is expected");
    }
    if (samples->is_set && samples->last > render->spp) {
        diag_error(session->diag, (Span){0, 0}, NULL,
                   "--samples: '%s' goes beyond the %u samples per pixel; see --spp", samples->text,
                   render->spp);
        return STATUS_USAGE;
    }
    return STATUS_OK;
}

static int check_movie(const Session *session, const Outputs *outputs) {
    const char *path = session->options->values[OPTION_MOVIE].text;
    char message[512];
    if (path && !image_is_exr(outputs->patterns[0])) {
        return session_refuse(session, STATUS_USAGE, path,
                              "a movie is made from pictures with the ending .exr: -o a.####.exr");
    }
    return path && !movie_check(path, message, sizeof message)
               ? session_refuse(session, STATUS_FILES, path, message)
               : STATUS_OK;
}

static int make_movie(const Session *session, const RenderOptions *render) {
    const char *path = session->options->values[OPTION_MOVIE].text;
    char message[PATH_SIZE + 512];
    int status =
        path ? movie_make(path, session->scene, render, message, sizeof message) : STATUS_OK;
    return status == STATUS_FILES ? session_refuse(session, status, path, message) : status;
}

static int check_outputs(const Session *session, const Outputs *outputs) {
    int usage = session->options->values[OPTION_OUT].is_set ? STATUS_USAGE : STATUS_SCENE;
    for (size_t i = 0; i < outputs->n_patterns; i++) {
        const char *pattern = outputs->patterns[i];
        char path[PATH_SIZE], message[256];
        if (!strcmp(pattern, "-")) {
            return session_refuse(session, usage, pattern,
                                  "not supported yet: pictures on standard output");
        }
        if (!render_frame_path(pattern, session->frames[0], outputs->is_numbered, path,
                               sizeof path)) {
            return session_refuse(session, usage, pattern,
                                  "not a pattern: one run of #, or one %04d is expected");
        }
        if (i && !image_is_exr(outputs->patterns[0])) {
            return session_refuse(session, usage, pattern,
                                  "several kinds of pictures need an .exr among them");
        }
        if (i && !image_write_check(path, message, sizeof message)) {
            return session_refuse(session, STATUS_FILES, path, message);
        }
    }
    int status = check_movie(session, outputs);
    return status ? status : check_stats(session);
}

// What the other pictures are made with.
typedef struct {
    const Session *session;
    const Outputs *outputs;
} Conversion;

// Whether one of a frame's other pictures is missing.
static bool lacks_picture(const Outputs *outputs, int64_t frame) {
    char path[PATH_SIZE];
    for (size_t i = 1; i < outputs->n_patterns; i++) {
        if (render_frame_path(outputs->patterns[i], frame, outputs->is_numbered, path,
                              sizeof path) &&
            access(path, F_OK) != 0) {
            return true;
        }
    }
    return false;
}

// Makes the other pictures of one frame from its .exr.
static int convert_frame(void *context, int64_t frame, bool was_there) {
    const Conversion *conversion = context;
    const Session *session = conversion->session;
    const Outputs *outputs = conversion->outputs;
    const FilmSettings *film = &session->scene->film;
    char from[PATH_SIZE], to[PATH_SIZE], message[256] = "the name is too long";
    Arena arena = {0};
    Image image;
    int status = STATUS_OK;
    if (outputs->n_patterns < 2 || (was_there && !lacks_picture(outputs, frame))) {
        return STATUS_OK;
    }
    if (!render_frame_path(outputs->patterns[0], frame, outputs->is_numbered, from, sizeof from) ||
        !image_read_exr(&arena, from, &image, message, sizeof message)) {
        status = session_refuse(session, STATUS_FILES, from, message);
    }
    for (size_t i = 1; i < outputs->n_patterns && status == STATUS_OK; i++) {
        if (!render_frame_path(outputs->patterns[i], frame, outputs->is_numbered, to, sizeof to) ||
            !image_write(to, &image, film, message, sizeof message)) {
            status = session_refuse(session, STATUS_FILES, to, message);
        }
    }
    arena_free(&arena);
    return status;
}

static int write_stats(const Session *session, const RenderStats *stats) {
    const char *path = session->options->values[OPTION_STATS].text;
    char message[256];
    if (!path || render_write_stats(path, stats, message, sizeof message)) {
        return STATUS_OK;
    }
    return session_refuse(session, STATUS_FILES, path, message);
}

static int render(const Session *session, RenderOptions *render) {
    const Options *options = session->options;
    Outputs outputs;
    find_outputs(session, &outputs);
    int status = check_sums(session, render, &outputs);
    status = status ? status : check_outputs(session, &outputs);
    if (status) {
        return status;
    }
    RenderStats stats = {0};
    render->out = outputs.patterns[0];
    render->progress = progress_kind(options);
    Conversion conversion = {session, &outputs};
    render->finished = convert_frame;
    render->finished_context = &conversion;
    status = render_frames(session->scene, render, &session->reporter, &stats);
    status = status ? status : make_movie(session, render);
    if (status == STATUS_OK && !option_flag(options, OPTION_QUIET)) {
        print_result(render, &stats, option_flag(options, OPTION_VERBOSE));
    }
    if (status == STATUS_INTERRUPTED && !option_flag(options, OPTION_QUIET)) {
        print_interrupted(render);
    }
    int written = write_stats(session, &stats);
    return status ? status : written;
}

int command_render(Arena *arena, const Options *options) {
    Session session;
    int status = session_open(&session, arena, options);
    if (status) {
        return status;
    }
    RenderOptions settings;
    status =
        session_render_options(&session, &settings) ? render(&session, &settings) : STATUS_USAGE;
    return session_close(&session, status);
}
