// SPDX-License-Identifier: Apache-2.0
// The run: blocks of frames, each sampled and built once, its frames traced and written one by one.
#include "render/render.h"

#include <string.h>
#include <unistd.h>

#include "accel/clock.h"
#include "render/accumulate.h"
#include "render/checkpoint.h"
#include "render/frame_lock.h"
#include "render/interrupt.h"
#include "render/output.h"
#include "render/rounds.h"
#include "render/survey.h"
#include "render/texture.h"
#include "render/tiles.h"

// Seconds, from which on a bound on time is worth knowing how long writing takes.
static const double REHEARSED = 2;

enum { STATUS_FINE = 0, STATUS_SCENE = 1, STATUS_FILES = 3, STATUS_INTERRUPTED = 130 };

typedef struct {
    const RenderOptions *options;
    const Reporter *reporter;
    RenderStats *stats;
    Scene scene; // with its camera in place
    PathScene paths;
    Film film;
    Checkpoint checkpoint;
    int64_t *frames, *held; // still to render; room for those that others have
    uint32_t n_frames;
    uint64_t frame_samples; // of all pixels; where they are allotted by need, as expected by now
    uint32_t n_ahead;       // frames still to be made, the one at work among them
    double block_end;       // of clock_seconds: what options->seconds leave the block at work
    uint32_t n_in_block;    // frames of it that are still to be made
    double began;           // of clock_seconds: the frame at work
    double write_seconds;   // of the last picture
    Progress progress;
    PathTroubles troubles, reported;
    Arena arena;
} Run;

static void warn_not_finite(const Run *run, SourceRef where, const char *what) {
    run->reporter->emit(run->reporter->context, where, "not-finite", what);
}

static bool is_new(bool trouble, bool *reported) {
    bool is_first = trouble && !*reported;
    *reported |= trouble;
    return is_first;
}

// Once for each thing, however many frames it is wrong in.
static void report_troubles(Run *run) {
    const Scene *scene = &run->scene;
    if (is_new(run->troubles.camera, &run->reported.camera)) {
        warn_not_finite(run, scene->camera.where,
                        "at some instant the camera is not finite, looks at where it stands, or "
                        "has an aperture below 0 or a focus that is not above it; it sees nothing "
                        "then");
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        if (is_new(run->troubles.lights[i], &run->reported.lights[i])) {
            warn_not_finite(run, scene->lights[i].where,
                            "the light is not finite at some instant; it is dark then");
        }
    }
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        if (is_new(run->troubles.materials[i], &run->reported.materials[i])) {
            warn_not_finite(
                run, scene->materials[i].where,
                "the material is not finite at some instant or place; it is black there");
        }
    }
}

static void troubles_init(PathTroubles *troubles, Arena *arena, const Scene *scene) {
    troubles->lights = ARENA_ARRAY(arena, scene->n_lights, bool);
    troubles->materials = ARENA_ARRAY(arena, scene->n_materials, bool);
}

// With the names of what the film has seen by now.
static bool save_checkpoint(Run *run, const char *picture, const FilmOrigin *origin) {
    Arena arena = {0};
    FilmOrigin named = *origin;
    if (run->options->is_adaptive) {
        named.milliseconds += (uint32_t)(1000 * fmin(clock_seconds() - run->began, 1e6));
    }
    film_names_find(&run->scene, &run->film, &arena, named.names);
    bool is_saved = checkpoint_save(&run->checkpoint, picture, &run->film, &named, run->reporter);
    arena_free(&arena);
    return is_saved;
}

static bool write_picture(const Run *run, const char *picture, const FilmOrigin *origin,
                          char *message, size_t n) {
    Arena arena = {0};
    FilmOrigin named = *origin;
    film_names_find(&run->scene, &run->film, &arena, named.names);
    bool is_written = output_write(picture, &run->film, &named, message, n);
    arena_free(&arena);
    return is_written;
}

// Traces what the film lacks of a pass, with a checkpoint now and then.
static TilesOutcome trace_pass(Run *run, const World *world, TilePass *pass, const char *picture,
                               const FilmOrigin *origin) {
    TilesOutcome outcome;
    do {
        pass->due = run->checkpoint.due;
        outcome = tiles_trace(&run->paths, world, run->options, pass, &run->film, &run->progress,
                              run->stats, &run->troubles);
        if (outcome != TILES_DONE && world_is_sound(world, NULL)) {
            save_checkpoint(run, picture, origin);
        }
    } while (outcome == TILES_DUE);
    return outcome;
}

// How long writing the picture will take: an eighth of it is written, and removed again.
static double rehearse(Run *run, const char *picture, const FilmOrigin *origin) {
    char path[OUTPUT_PATH_SIZE + 32], message[OUTPUT_MESSAGE_SIZE];
    const char *dot = strrchr(picture, '.');
    const Film whole = run->film;
    FilmOrigin part = *origin;
    double start = clock_seconds();
    run->film.height = part.height = (whole.height + 7) / 8;
    snprintf(path, sizeof path, "%s.rehearsal%s", picture, dot ? dot : "");
    if (write_picture(run, path, &part, message, sizeof message)) {
        unlink(path);
    }
    run->film = whole;
    return (clock_seconds() - start) * whole.height / part.height;
}

// By when the frame is to be done. The frames of a block share its sampling and building, and its
// time; what an earlier run has spent on this one counts, and so does writing.
static double deadline_of(const Run *run, const FilmOrigin *origin) {
    double now = clock_seconds();
    if (!(run->options->seconds > 0)) {
        return INFINITY;
    }
    return now + fmax(0, run->block_end - now) / fmax(run->n_in_block, 1) -
           1e-3 * origin->milliseconds - run->write_seconds;
}

static void tell_round(Run *run, const Rounds *rounds) {
    run->frame_samples = rounds_expect(rounds);
    uint64_t done = film_totals(&run->film).total;
    uint64_t left = run->frame_samples > done ? run->frame_samples - done : 0;
    uint64_t after = run->n_ahead > 1 ? (run->n_ahead - 1) * run->frame_samples : 0;
    progress_judge(&run->progress, left + after, rounds->noise.estimate);
}

static void end_rounds(Run *run, const Rounds *rounds, FilmOrigin *origin) {
    RenderStats *stats = run->stats;
    origin->noise = rounds->noise.estimate;
    origin->stopped = origin->stops[rounds->stop];
    stats->noise_reached = fmax(stats->noise_reached, rounds->noise.estimate);
    stats->n_stopped[rounds->stop]++;
    double n = (double)(stats->n_stopped[0] + stats->n_stopped[1] + stats->n_stopped[2]);
    stats->mean_samples += ((double)rounds->level / LEVEL_SAMPLE - stats->mean_samples) / n;
}

// Rounds of samples, until the frame is good enough or a bound is reached.
static TilesOutcome trace_rounds(Run *run, const World *world, TilePass *pass, const char *picture,
                                 FilmOrigin *origin) {
    TilesOutcome outcome = TILES_DONE;
    Rounds rounds;
    rounds_begin(&rounds, run->options, &run->film, origin->level, deadline_of(run, origin));
    while (outcome == TILES_DONE && rounds_next(&rounds, pass)) {
        // Of the first picture nobody knows yet how long it takes to be written.
        bool is_new = origin->level > 0 && !(run->write_seconds > 0);
        if (run->options->seconds >= REHEARSED && is_new) {
            run->write_seconds = rehearse(run, picture, origin);
            rounds.deadline -= run->write_seconds;
        }
        origin->level = rounds.level;
        tell_round(run, &rounds);
        outcome = trace_pass(run, world, pass, picture, origin);
    }
    if (outcome == TILES_DONE) {
        end_rounds(run, &rounds, origin);
    }
    return outcome;
}

// An exit status.
static int trace_frame(Run *run, const World *world, int64_t frame, const char *picture,
                       FilmOrigin *origin) {
    double start = clock_seconds(), waited = world_waited(world);
    TilePass pass = {.frame = frame, .first = origin->first, .n = origin->n};
    TilesOutcome outcome = run->options->is_adaptive
                               ? trace_rounds(run, world, &pass, picture, origin)
                               : trace_pass(run, world, &pass, picture, origin);
    run->stats->trace_seconds +=
        clock_seconds() - start - (world_waited(world) - waited) / run->options->n_threads;
    return !world_is_sound(world, run->reporter) ? STATUS_SCENE
           : outcome == TILES_DONE               ? STATUS_FINE
                                                 : STATUS_INTERRUPTED;
}

// World NULL: the frame is summed up from worlds of its own, without checkpoints.
static int trace(Run *run, const World *world, int64_t frame, const char *picture,
                 FilmOrigin *origin) {
    return world ? trace_frame(run, world, frame, picture, origin)
                 : accumulate_trace(&run->scene, run->options, frame, run->reporter, &run->film,
                                    &run->progress, run->stats, &run->troubles);
}

// Whatever is in the way of the picture may be cleared away: the sums are kept if they can be.
static int refuse_picture(Run *run, const char *picture, const FilmOrigin *origin,
                          const char *why) {
    bool is_kept = save_checkpoint(run, picture, origin);
    Arena arena = {0};
    const char *kept = is_kept ? "; its checkpoint is kept, --resume writes it again" : "";
    run->reporter->emit(run->reporter->context, 0, NULL,
                        arena_printf(&arena, "cannot write '%s': %s%s", picture, why, kept));
    arena_free(&arena);
    return STATUS_FILES;
}

// The film gets what is there of the frame already. False: reported.
static bool begin_film(Run *run, const char *picture, FilmOrigin *origin) {
    run->began = clock_seconds();
    bool is_fine = checkpoint_begin(&run->checkpoint, run->options, picture, &run->film, origin,
                                    run->reporter);
    progress_skip(&run->progress, film_totals(&run->film).total);
    return is_fine;
}

static int finish(const Run *run, int64_t frame, bool was_there) {
    const RenderOptions *options = run->options;
    return options->finished ? options->finished(options->finished_context, frame, was_there)
                             : STATUS_FINE;
}

static int make_picture(Run *run, const World *world, int64_t frame, const char *picture,
                        FilmOrigin *origin) {
    char message[OUTPUT_MESSAGE_SIZE];
    if (!begin_film(run, picture, origin)) {
        return STATUS_FILES;
    }
    progress_frame(&run->progress, frame);
    int status = trace(run, world, frame, picture, origin);
    progress_pause(&run->progress);
    report_troubles(run);
    if (status != STATUS_FINE) {
        return status;
    }
    double traced = clock_seconds();
    bool is_written = write_picture(run, picture, origin, message, sizeof message);
    run->write_seconds = clock_seconds() - traced;
    run->stats->write_seconds += run->write_seconds;
    if (!is_written) {
        return refuse_picture(run, picture, origin, message);
    }
    run->stats->n_frames++;
    run->n_ahead -= run->n_ahead > 0;
    checkpoint_remove(picture);
    progress_written(&run->progress, frame);
    return finish(run, frame, false);
}

static int make_described(Run *run, const World *world, int64_t frame, const char *picture) {
    Arena arena = {0};
    FilmOrigin origin;
    output_describe(&run->scene, run->options, frame, &arena, &origin);
    int status = make_picture(run, world, frame, picture, &origin);
    arena_free(&arena);
    return status;
}

static bool is_there(const char *picture) {
    return access(picture, F_OK) == 0;
}

// Of a frame that other processes may be at: it is made unless one of them has it or had it.
static int make_locked(Run *run, const World *world, int64_t frame, const char *picture) {
    char message[OUTPUT_PATH_SIZE + OUTPUT_MESSAGE_SIZE];
    FrameLock lock;
    FrameLockOutcome outcome = frame_lock_take(&lock, picture, message, sizeof message);
    int status = STATUS_FINE;
    if (outcome == FRAME_LOCK_FAILED) {
        run->reporter->emit(run->reporter->context, 0, NULL, message);
        return STATUS_FILES;
    }
    // Whoever made the picture had the lock until it was there.
    if (outcome == FRAME_LOCK_TAKEN && !is_there(picture)) {
        status = make_described(run, world, frame, picture);
    }
    frame_lock_release(&lock);
    return status;
}

static int render_frame(Run *run, const World *world, int64_t frame) {
    char picture[OUTPUT_PATH_SIZE];
    if (!output_path(run->options, frame, run->reporter, picture)) {
        return STATUS_FILES;
    }
    return run->options->skip_existing ? make_locked(run, world, frame, picture)
                                       : make_described(run, world, frame, picture);
}

// Renders a block that begins with frames[0], of n; *n_taken gets its length.
static int render_block(Run *run, const int64_t *frames, uint32_t n, uint32_t *n_taken) {
    if (accumulate_applies(&run->scene, run->options)) {
        *n_taken = 1;
        return render_frame(run, NULL, frames[0]);
    }
    const double began = clock_seconds();
    World *world =
        world_build(&run->scene, run->options, frames, n, run->reporter, n_taken, run->stats);
    if (!world) {
        return interrupt_is_asked() ? STATUS_INTERRUPTED : STATUS_SCENE;
    }
    bool is_first = run->stats->n_frames == 0 && run->options->began > 0;
    run->block_end = (is_first ? run->options->began : began) + *n_taken * run->options->seconds;
    int status = STATUS_FINE;
    for (uint32_t i = 0; i < *n_taken && status == STATUS_FINE; i++) {
        run->n_in_block = *n_taken - i;
        status = interrupt_is_asked() ? STATUS_INTERRUPTED : render_frame(run, world, frames[i]);
    }
    world_count(world, run->stats);
    world_destroy(world);
    return status;
}

// Whether the run has nothing to do for a frame. What a process that was killed after its picture
// was there has left beside it is removed.
static bool is_made(const Run *run, int64_t frame, const char *picture) {
    char message[OUTPUT_PATH_SIZE + OUTPUT_MESSAGE_SIZE];
    bool is_left = run->options->skip_existing && is_there(picture);
    if (is_left) {
        frame_lock_is_held(picture, message, sizeof message);
    }
    Arena arena = {0};
    FilmOrigin origin;
    output_describe(&run->scene, run->options, frame, &arena, &origin);
    bool found = run->options->resume && output_is_made(picture, &origin);
    arena_free(&arena);
    if (found) {
        checkpoint_remove(picture);
    }
    return found || is_left;
}

// Takes frames out of those that are still to render: for good where their pictures are there,
// for this time where another process has them; those are put last, from *n on.
static int sort_out(Run *run, uint32_t *n) {
    char picture[OUTPUT_PATH_SIZE], message[OUTPUT_PATH_SIZE + OUTPUT_MESSAGE_SIZE];
    int64_t *frames = run->frames, *held = run->held;
    uint32_t n_left = 0, n_held = 0;
    int status = STATUS_FINE;
    for (uint32_t i = 0; i < run->n_frames && status == STATUS_FINE; i++) {
        int64_t frame = frames[i];
        if (!output_path(run->options, frame, run->reporter, picture)) {
            status = STATUS_FILES;
        } else if (is_made(run, frame, picture)) {
            status = finish(run, frame, true);
        } else if (run->options->skip_existing &&
                   frame_lock_is_held(picture, message, sizeof message)) {
            held[n_held++] = frame;
        } else {
            frames[n_left++] = frame;
        }
    }
    memcpy(frames + n_left, held, n_held * sizeof *held);
    run->n_frames = n_left + n_held;
    run->n_ahead = run->n_frames;
    progress_left(&run->progress, run->n_frames * run->frame_samples);
    *n = n_left;
    return status;
}

// Says of the frames that others have who that is. False: one of them has been given up.
static bool report_held(const Run *run) {
    char picture[OUTPUT_PATH_SIZE], holder[OUTPUT_PATH_SIZE + OUTPUT_MESSAGE_SIZE];
    Arena arena = {0};
    bool are_held = true;
    for (uint32_t i = 0; i < run->n_frames && are_held; i++) {
        output_path(run->options, run->frames[i], run->reporter, picture);
        bool is_held = frame_lock_holder(picture, holder, sizeof holder);
        are_held = is_held || is_there(picture);
        if (is_held) {
            run->reporter->emit(run->reporter->context, 0, "frame-locked",
                                arena_printf(&arena,
                                             "frame %lld is left to %s; if that process is no "
                                             "more, remove the file",
                                             (long long)run->frames[i], holder));
        }
    }
    arena_free(&arena);
    return are_held;
}

// Other processes take frames too, so what there is to do is looked at anew before each block.
static int share_frames(Run *run) {
    uint32_t n, n_taken;
    int status;
    do {
        status = sort_out(run, &n);
        if (status == STATUS_FINE && n > 0) {
            status = render_block(run, run->frames, n, &n_taken);
        }
    } while (status == STATUS_FINE && (n > 0 || !report_held(run)));
    return status;
}

static int render_all(Run *run) {
    uint32_t n_left, n = 0;
    int status = sort_out(run, &n_left);
    for (uint32_t i = 0; i < n_left && status == STATUS_FINE; i += n) {
        status = render_block(run, run->frames + i, n_left - i, &n);
    }
    return status;
}

static void make_film(Run *run) {
    const RenderOptions *options = run->options;
    const FilmSettings *settings = &run->scene.film;
    bool is_crop = options->crop_x1 > 0;
    uint32_t halves = options->is_adaptive ? FILM_HALVES : 0;
    film_init(&run->film, &run->arena, settings->layers | halves,
              is_crop ? options->crop_x1 - options->crop_x0 : settings->width,
              is_crop ? options->crop_y1 - options->crop_y0 : settings->height);
    run->film.x = options->crop_x0;
    run->film.y = options->crop_y0;
}

static int render_blocks(Run *run) {
    const RenderOptions *options = run->options;
    world_place_camera(&run->arena, &run->scene);
    survey_scene(&run->scene, options, run->reporter);
    path_scene_init(&run->paths, &run->arena, &run->scene);
    make_film(run);
    troubles_init(&run->troubles, &run->arena, &run->scene);
    troubles_init(&run->reported, &run->arena, &run->scene);
    uint64_t spp =
        options->last_sample ? options->last_sample - options->first_sample + 1 : options->spp;
    spp = options->is_adaptive && spp > ADAPTIVE_PILOT ? ADAPTIVE_PILOT : spp;
    run->frame_samples = (uint64_t)run->film.width * run->film.height * spp;
    progress_begin(&run->progress, options->progress, options->n_frames,
                   run->frame_samples * options->n_frames);
    run->n_frames = options->n_frames;
    run->frames = ARENA_ARRAY(&run->arena, run->n_frames, int64_t);
    run->held = ARENA_ARRAY(&run->arena, run->n_frames, int64_t);
    memcpy(run->frames, options->frames, run->n_frames * sizeof *run->frames);
    int status = options->skip_existing ? share_frames(run) : render_all(run);
    run->stats->n_skipped_frames = options->n_frames - run->stats->n_frames;
    progress_end(&run->progress);
    return status;
}

bool render_scene_blurs(const Scene *scene) {
    return scene->shutter.length > 0 && path_scene_is_moving(scene);
}

int render_frames(const Scene *scene, const RenderOptions *options, const Reporter *reporter,
                  RenderStats *stats) {
    if (!output_check(options, reporter)) {
        return STATUS_FILES;
    }
    // A quarter for pictures; vertex arrays and trees take what they need.
    texture_set_memory((options->memory ? options->memory : (size_t)4 << 30) / 4);
    Run run = {.options = options, .reporter = reporter, .stats = stats, .scene = *scene};
    if (options->has_layers) {
        run.scene.film.layers = options->layers;
    }
    interrupt_begin();
    int status = render_blocks(&run);
    interrupt_end();
    arena_free(&run.arena);
    return status;
}
