// SPDX-License-Identifier: Apache-2.0
// Shutters: curves put into tables, and the delays of pixels.
#include "render/shutter.h"

#include <float.h>
#include <string.h>

enum {
    FIRST = 1024,      // intervals to begin with: what is narrower may be missed
    MOST = 1 << 16,    // points
    PASSES = 32,       // of halving: 1e-13 wide
    DELAY_BLOCK = 1024 // pixels of a row at once
};

// What an interval may be off by, in parts of the whole integral, before it is halved.
static const double ENOUGH = 1e-9;

// Rounding of a curve that should come to 0, in parts of its largest value.
static const double ROUNDING = 1e-9;

// ---- Curves

// The curve as known so far: n points, and what it is halfway between them.
typedef struct {
    const Program *program;
    double *at, *w, *middle; // [n], [n], [n - 1]
    uint32_t n;
} Table;

static void run_at(const Program *program, const double *at, double *w, size_t n) {
    ProgramInputs in = {.varying = 1u << IN_X};
    in.at[IN_X] = at;
    program_run(program, &in, n, &w);
}

static void find_middles(const Table *table, double *scratch) {
    for (uint32_t i = 0; i + 1 < table->n; i++) {
        scratch[i] = table->at[i] + (table->at[i + 1] - table->at[i]) / 2;
    }
    run_at(table->program, scratch, table->middle, table->n - 1);
}

static double trapezium(const Table *table, uint32_t i) {
    return (table->at[i + 1] - table->at[i]) * (table->w[i] + table->w[i + 1]) / 2;
}

static double integral(const Table *table) {
    double sum = 0;
    for (uint32_t i = 0; i + 1 < table->n; i++) {
        sum += trapezium(table, i);
    }
    return sum;
}

// By how much the area of an interval is off: Simpson's rule against the trapezium.
static double error_of(const Table *table, uint32_t i) {
    double width = table->at[i + 1] - table->at[i];
    return fabs(table->middle[i] - (table->w[i] + table->w[i + 1]) / 2) * width * 2 / 3;
}

static bool is_bad(double w, double at, double most, CurveReport *report) {
    if (!isfinite(w)) {
        *report = (CurveReport){CURVE_NOT_FINITE, at, w};
        return true;
    }
    if (w < -ROUNDING * most) {
        *report = (CurveReport){CURVE_NEGATIVE, at, w};
        return true;
    }
    return false;
}

static bool check(const Table *table, CurveReport *report) {
    double most = 0;
    for (uint32_t i = 0; i < table->n; i++) {
        most = fmax(most, table->w[i]);
    }
    for (uint32_t i = 0; i < table->n; i++) {
        bool has_next = i + 1 < table->n;
        double next = has_next ? table->at[i] + (table->at[i + 1] - table->at[i]) / 2 : 1;
        if (is_bad(table->w[i], table->at[i], most, report) ||
            (has_next && is_bad(table->middle[i], next, most, report))) {
            return false;
        }
        table->w[i] = fmax(table->w[i], 0);
    }
    return true;
}

// Halves what is not straight enough. False: nothing is, or there is no room.
static bool halve(Table *table, Table *next) {
    double bound = ENOUGH * integral(table);
    next->n = 0;
    for (uint32_t i = 0; i < table->n; i++) {
        if (next->n + 2 > MOST) {
            return false;
        }
        next->at[next->n] = table->at[i];
        next->w[next->n++] = table->w[i];
        if (i + 1 < table->n && error_of(table, i) > bound) {
            next->at[next->n] = table->at[i] + (table->at[i + 1] - table->at[i]) / 2;
            next->w[next->n++] = table->middle[i];
        }
    }
    return next->n > table->n;
}

static Table table_new(Arena *arena, const Program *program) {
    return (Table){program, ARENA_ARRAY(arena, MOST, double), ARENA_ARRAY(arena, MOST, double),
                   ARENA_ARRAY(arena, MOST, double), 0};
}

static const ShutterCurve *store(Arena *arena, const Table *table, CurveReport *report) {
    double whole = integral(table), error = 0, sum = 0;
    if (!(whole > 0)) {
        *report = (CurveReport){CURVE_ZERO, 0, 0};
        return NULL;
    }
    for (uint32_t i = 0; i + 1 < table->n; i++) {
        error += error_of(table, i) / whole;
    }
    if (error > SHUTTER_CURVE_ERROR) {
        *report = (CurveReport){CURVE_ROUGH, 0, error};
        return NULL;
    }
    double *at = ARENA_ARRAY(arena, table->n, double), *w = ARENA_ARRAY(arena, table->n, double);
    double *sums = ARENA_ARRAY(arena, table->n, double);
    for (uint32_t i = 0; i < table->n; i++) {
        at[i] = table->at[i];
        w[i] = table->w[i] / whole;
        sums[i] = fmin(sum / whole, 1);
        sum += i + 1 < table->n ? trapezium(table, i) : 0;
    }
    sums[table->n - 1] = 1;
    ShutterCurve *curve = ARENA_NEW(arena, ShutterCurve);
    *curve = (ShutterCurve){table->n, at, w, sums, error};
    return curve;
}

const ShutterCurve *shutter_curve_new(Arena *arena, const Program *program, CurveReport *report) {
    Arena scratch = {0};
    Table a = table_new(&scratch, program), b = table_new(&scratch, program);
    double *middles = ARENA_ARRAY(&scratch, MOST, double);
    *report = (CurveReport){CURVE_FINE, 0, 0};
    for (a.n = 0; a.n <= FIRST; a.n++) {
        a.at[a.n] = (double)a.n / FIRST;
    }
    run_at(program, a.at, a.w, a.n);
    find_middles(&a, middles);
    bool is_fine = check(&a, report);
    for (int pass = 0; pass < PASSES && is_fine && halve(&a, &b); pass++) {
        Table last = a;
        a = b;
        b = last;
        find_middles(&a, middles);
        is_fine = check(&a, report);
    }
    const ShutterCurve *curve = is_fine ? store(arena, &a, report) : NULL;
    arena_free(&scratch);
    return curve;
}

double shutter_fraction(const ShutterSettings *shutter, double u) {
    const ShutterCurve *curve = shutter->curve;
    if (!curve) {
        return u;
    }
    uint32_t lo = 0, hi = curve->n - 1; // sum[lo] <= u < sum[hi], but at the very end
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        *(curve->sum[mid] <= u ? &lo : &hi) = mid;
    }
    double share = curve->sum[hi] - curve->sum[lo];
    double part = share > 0 ? fmin((u - curve->sum[lo]) / share, 1) : 0;
    // The part of a trapezium's area up to s is (a s + (b - a) s^2 / 2) / ((a + b) / 2).
    double a = curve->w[lo], b = curve->w[hi];
    double root = a + sqrt(a * a + part * (b - a) * (b + a));
    double s = root > 0 ? part * (a + b) / root : part;
    return curve->at[lo] + fmin(s, 1) * (curve->at[hi] - curve->at[lo]);
}

// ---- Delays

// How far a pixel's line is from the one that is read out first, 0..1.
static double line_of(RollKind roll, const FilmSettings *film, uint32_t x, uint32_t y) {
    bool is_row = roll == ROLL_DOWN || roll == ROLL_UP;
    uint32_t n = is_row ? film->height : film->width, line = is_row ? y : x;
    if (roll == ROLL_NONE || n < 2) {
        return 0;
    }
    line = roll == ROLL_UP || roll == ROLL_LEFT ? n - 1 - line : line;
    return (double)line / (n - 1);
}

static double joined(const ShutterSettings *shutter, const FilmSettings *film, uint32_t x,
                     uint32_t y, double seconds) {
    return line_of(shutter->roll, film, x, y) * shutter->readout + seconds * film->fps;
}

double shutter_delay(const ShutterSettings *shutter, const FilmSettings *film, uint32_t x,
                     uint32_t y) {
    double in[IN_COUNT] = {0}, seconds = 0;
    if (shutter->delay) {
        in[IN_U] = (x + 0.5) / film->width;
        in[IN_V] = (y + 0.5) / film->height;
        program_run1(shutter->delay, in, &seconds);
    }
    return joined(shutter, film, x, y, seconds);
}

// Of n <= DELAY_BLOCK pixels of a row; false: *x is not finite.
static bool add_delays(ShutterSettings *shutter, const FilmSettings *film, uint32_t first,
                       uint32_t n, uint32_t y, uint32_t *x) {
    double u[DELAY_BLOCK], seconds[DELAY_BLOCK], v = (y + 0.5) / film->height, *out = seconds;
    ProgramInputs in = {.varying = 1u << IN_U};
    in.at[IN_U] = u;
    in.at[IN_V] = &v;
    for (uint32_t i = 0; i < n; i++) {
        u[i] = (first + i + 0.5) / film->width;
    }
    program_run(shutter->delay, &in, n, &out);
    for (uint32_t i = 0; i < n; i++) {
        double delay = joined(shutter, film, first + i, y, seconds[i]);
        if (!(fabs(delay) <= SHUTTER_MOST_DELAY)) {
            *x = first + i;
            return false;
        }
        shutter->first_delay = fmin(shutter->first_delay, delay);
        shutter->last_delay = fmax(shutter->last_delay, delay);
    }
    return true;
}

bool shutter_find_delays(ShutterSettings *shutter, const FilmSettings *film, uint32_t *x,
                         uint32_t *y) {
    uint32_t width = film->width, height = film->height;
    double corner = shutter_delay(shutter, film, 0, 0);
    shutter->first_delay = shutter->last_delay = corner;
    if (!shutter->delay) {
        double other = shutter_delay(shutter, film, width - 1, height - 1);
        shutter->first_delay = fmin(corner, other);
        shutter->last_delay = fmax(corner, other);
        return true;
    }
    for (*y = 0; *y < height; ++*y) {
        for (uint32_t first = 0; first < width; first += DELAY_BLOCK) {
            uint32_t n = width - first < DELAY_BLOCK ? width - first : DELAY_BLOCK;
            if (!add_delays(shutter, film, first, n, *y, x)) {
                return false;
            }
        }
    }
    return true;
}

ShutterSpan shutter_seen(const ShutterSettings *shutter, int64_t frame) {
    if (!shutter_is_delayed(shutter)) {
        return shutter_span(frame, shutter->open, shutter->length);
    }
    double reach = shutter->last_delay - shutter->first_delay + shutter->length;
    double margin = 8 * DBL_EPSILON *
                    (1 + fabs(shutter->first_delay) + fabs(shutter->last_delay) +
                     fabs(shutter->open) + shutter->length);
    Instant start = shutter_instant(shutter, frame, shutter->first_delay, 0);
    return shutter_span(start.frame + 1, start.frac - margin, reach + 2 * margin);
}
