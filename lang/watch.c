// SPDX-License-Identifier: Apache-2.0
// Watches: keys and reads, compared with the time in which the film's shutters are open.
#include "lang/watch.h"

#include <math.h>

enum {
    MOST = 1 << 14,    // watches: a table in a function is noted at every call
    PER_FRAME = 16,    // instants at which a read is looked at
    INSTANTS = 1 << 14 // of the whole film
};

typedef struct {
    Span where;
    const char *what; // NULL: keys
    Ref at;
    double low, high;
    bool is_clock; // at is the time of the place
} Watch;

struct Watches {
    Arena *arena;
    Watch *list;
    size_t n, capacity;
    bool has_other_times;
};

Watches *watches_new(Arena *arena) {
    Watches *watches = ARENA_NEW(arena, Watches);
    watches->arena = arena;
    return watches;
}

static void note(Watches *watches, Watch watch) {
    if (watches->n < MOST) {
        watches->list = arena_grow(watches->arena, watches->list, watches->n, &watches->capacity,
                                   sizeof *watches->list);
        watches->list[watches->n++] = watch;
    }
}

void watch_keys(Eval *ev, Span where, double first, double last) {
    note(ev->watches, (Watch){.where = where, .low = first, .high = last});
}

void watch_other_times(Eval *ev) {
    ev->watches->has_other_times = true;
}

void watch_read(Eval *ev, Span where, const char *what, Ref at, double low, double high) {
    uint32_t inputs = dag_inputs(ev->dag, at), time = 1u << IN_T | 1u << IN_FILM_T;
    if ((inputs & time) && !(inputs & ~time)) {
        note(ev->watches, (Watch){where, what, at, low, high, false});
    }
}

void watch_end(Eval *ev, Span where, const char *what, double high) {
    note(ev->watches, (Watch){where, what, dag_input(ev->dag, IN_T), -INFINITY, high, true});
}

// ---- Reports

// The film's own time, from the first opening of its shutter to the last.
typedef struct {
    double from, to; // seconds
    double *seconds; // [n]
    size_t n;
} FilmTime;

static FilmTime film_time(Arena *arena, const Scene *scene) {
    const FilmSettings *film = &scene->film;
    const ShutterSettings *shutter = &scene->shutter;
    double first = (double)(film->first_frame - 1) + shutter->open + shutter->first_delay;
    double close = shutter->open + shutter->length + shutter->last_delay;
    double last = (double)(film->last_frame - 1) + close;
    FilmTime time = {.from = first / film->fps, .to = last / film->fps};
    double wanted = ceil((last - first) * PER_FRAME) + 1;
    time.n = wanted < INSTANTS ? (size_t)wanted : INSTANTS;
    time.seconds = ARENA_ARRAY(arena, time.n, double);
    for (size_t i = 0; i < time.n; i++) {
        double part = time.n > 1 ? (double)i / (double)(time.n - 1) : 0;
        time.seconds[i] = (first + (last - first) * part) / film->fps;
    }
    return time;
}

static void report_keys(Eval *ev, const Watch *watch, const FilmTime *time) {
    bool is_before = watch->high < time->from;
    if (is_before || watch->low > time->to) {
        diag_warn(ev->diag, WARN_KEYS_OUTSIDE, watch->where, NULL,
                  "all keys lie %s the film, which goes from %.9g s to %.9g s",
                  is_before ? "before" : "after", time->from, time->to);
    }
}

static void report_read(Eval *ev, const Watch *watch, const FilmTime *time) {
    Arena scratch = {0};
    const Program *program = dag_compile(ev->dag, &scratch, &watch->at, 1);
    double *values = ARENA_ARRAY(&scratch, time->n, double);
    ProgramInputs in = {.varying = 1u << IN_T | 1u << IN_FILM_T};
    in.at[IN_T] = in.at[IN_FILM_T] = time->seconds;
    program_run(program, &in, time->n, &values);
    for (size_t i = 0; i < time->n; i++) {
        if (values[i] < watch->low || values[i] > watch->high) {
            if (watch->is_clock) {
                diag_warn(ev->diag, WARN_READ_OUTSIDE, watch->where, NULL,
                          "%s is read at t = %.6g s, but ends at %.6g s: its end is held",
                          watch->what, values[i], watch->high);
                break;
            }
            diag_warn(ev->diag, WARN_READ_OUTSIDE, watch->where, NULL,
                      "%s is read at %.6g when t = %.6g s, but goes from %.6g to %.6g: its ends "
                      "are held",
                      watch->what, values[i], time->seconds[i], watch->low, watch->high);
            break;
        }
    }
    arena_free(&scratch);
}

void watches_report(Eval *ev, const Scene *scene) {
    const Watches *watches = ev->watches;
    if (!watches->n) {
        return;
    }
    FilmTime time = film_time(ev->arena, scene);
    for (size_t i = 0; i < watches->n; i++) {
        const Watch *watch = &watches->list[i];
        if (watch->what && watch->is_clock && watches->has_other_times) {
            continue;
        }
        if (watch->what) {
            report_read(ev, watch, &time);
        } else if (!watches->has_other_times) {
            report_keys(ev, watch, &time);
        }
    }
}
