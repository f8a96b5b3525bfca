// SPDX-License-Identifier: Apache-2.0
// Checkpoints: writing now and then, going on from one that is proved to fit.
#include "render/checkpoint.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "accel/clock.h"
#include "render/adaptive.h"
#include "render/output.h"
#include "render/progress.h"
#include "render/report.h"

enum { COST = 50, PATH_SIZE = OUTPUT_PATH_SIZE + 16 };

bool render_checkpoint_path(const char *picture, char *path, size_t size) {
    int n = snprintf(path, size, "%s.checkpoint", picture);
    return n >= 0 && (size_t)n < size;
}

bool checkpoint_save(Checkpoint *checkpoint, const char *picture, const Film *film,
                     const FilmOrigin *origin, const Reporter *reporter) {
    char path[PATH_SIZE], message[OUTPUT_MESSAGE_SIZE];
    if (!(checkpoint->seconds > 0) || !render_checkpoint_path(picture, path, sizeof path)) {
        return false;
    }
    double start = clock_seconds();
    if (film_totals(film).total < checkpoint->n_replaced) {
        checkpoint->due = start + checkpoint->seconds;
        return false;
    }
    bool is_saved = film_file_write(path, film, origin, message, sizeof message);
    if (!is_saved && !checkpoint->has_failed) {
        checkpoint->has_failed = true;
        report_warning(reporter, 0, "checkpoint-not-saved",
                       "cannot save the checkpoint '%s': %s; the run goes on without", path,
                       message);
    }
    double now = clock_seconds();
    checkpoint->due = now + fmax(checkpoint->seconds, COST * (now - start));
    return is_saved;
}

static bool refuse(const Reporter *reporter, const char *path, const char *why) {
    Arena arena = {0};
    report_error(reporter, 0,
                 arena_printf(&arena,
                              "cannot resume from '%s': %s; remove it, or render without "
                              "--resume, to begin anew",
                              path, why));
    arena_free(&arena);
    return false;
}

// NULL, or why not, from the arena.
static const char *misfit(Arena *arena, const Film *film, const FilmOrigin *found,
                          const FilmOrigin *origin) {
    FilmDifference is;
    if (!film_origin_agrees(arena, found, origin, &is)) {
        return arena_printf(arena, "it is of another run: its %s is %s, where %s is asked for",
                            is.name, is.a, is.b);
    }
    if (found->first != origin->first) {
        return arena_printf(arena, "it begins with sample %u, where sample %u is asked for",
                            found->first + 1, origin->first + 1);
    }
    if (origin->layers & FILM_HALVES) {
        double level = (double)found->level / LEVEL_SAMPLE;
        return level > origin->n
                   ? arena_printf(arena,
                                  "it has up to %.15g samples per pixel, where %u are asked for",
                                  level, origin->n)
                   : NULL;
    }
    uint32_t most = film_totals(film).most;
    return most > origin->n
               ? arena_printf(arena, "it has up to %u samples per pixel, where %u are asked for",
                              most, origin->n)
               : NULL;
}

// The samples of one that would fit, were it asked for; a warning says that it is there.
static uint64_t keep(const char *path, const Film *found, const Reporter *reporter) {
    report_warning(reporter, 0, "checkpoint-not-used",
                   "'%s' holds this picture, unfinished; --resume goes on from there", path);
    return film_totals(found).total;
}

bool checkpoint_begin(Checkpoint *checkpoint, const RenderOptions *options, const char *picture,
                      Film *film, FilmOrigin *origin, const Reporter *reporter) {
    char path[PATH_SIZE], message[OUTPUT_MESSAGE_SIZE];
    struct stat s;
    double seconds = options->checkpoint;
    *checkpoint =
        (Checkpoint){.seconds = seconds, .due = seconds > 0 ? clock_seconds() + seconds : INFINITY};
    film_clear(film);
    if (!render_checkpoint_path(picture, path, sizeof path) ||
        (stat(path, &s) != 0 && errno == ENOENT)) {
        return true;
    }
    Arena arena = {0};
    Film found;
    FilmOrigin of;
    const char *why = message;
    if (film_file_read(&arena, path, &found, &of, message, sizeof message)) {
        why = misfit(&arena, &found, &of, origin);
    }
    if (!options->resume) {
        checkpoint->n_replaced = why ? 0 : keep(path, &found, reporter);
    } else if (why) {
        refuse(reporter, path, why);
    } else {
        film_merge(film, &found);
        origin->level = of.level;
        origin->milliseconds = of.milliseconds;
    }
    bool is_fine = !why || !options->resume;
    arena_free(&arena);
    return is_fine;
}

void checkpoint_remove(const char *picture) {
    char path[PATH_SIZE];
    if (render_checkpoint_path(picture, path, sizeof path)) {
        unlink(path);
    }
}
