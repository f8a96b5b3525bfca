// SPDX-License-Identifier: Apache-2.0
// st4 measure: which settings are measured, in which order, and which of them are worth having.
#include "lang/command_measure.h"

#include <math.h>
#include <string.h>

#include "accel/accel.h"

// So many times the samples that were measured is how far results are taken to reach.
enum { MOST_RECKONED = 64 };

// What a setting would take, reckoned from the point next to it: seconds of all runs, and twice
// that for starting and comparing where the picture is small.
static double predict(const Measure *measure, const MeasureSetting *setting) {
    const MeasurePoint *near = NULL;
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        bool is_alike = (p->setting.subframes > 0) == (setting->subframes > 0);
        bool was_alike = near && (near->setting.subframes > 0) == (setting->subframes > 0);
        if (!near || (is_alike && !was_alike) ||
            (is_alike == was_alike && p->setting.spp <= setting->spp &&
             p->setting.spp > near->setting.spp)) {
            near = p;
        }
    }
    if (!near) {
        return 0;
    }
    double more = (double)setting->spp / near->setting.spp;
    double worlds = fmax(setting->subframes, 1) / fmax(near->setting.subframes, 1);
    return MEASURE_RUNS *
           ((near->work.update + near->work.build) * worlds + near->work.trace * more + 0.3);
}

// Measures it if there is time.
static int turn(Measure *measure, MeasureSetting setting) {
    if (measure_known(measure, &setting)) {
        return STATUS_OK;
    }
    double left = measure_left(measure);
    return left > 0 && predict(measure, &setting) < left ? measure_point(measure, setting)
                                                         : STATUS_OK;
}

static int turn_samples(Measure *measure, MeasureSetting setting, uint32_t least, uint32_t most) {
    int status = STATUS_OK;
    for (uint32_t spp = least; spp <= most && status == STATUS_OK; spp *= 4) {
        setting.spp = spp;
        status = turn(measure, setting);
    }
    return status;
}

// n subframes with 1, 4, 16 samples each.
static int turn_subframes(Measure *measure, MeasureSetting base) {
    static const uint32_t counts[] = {4, 16, 64};
    int status = STATUS_OK;
    for (uint32_t each = 1; each <= 16 && measure->moves; each *= 4) {
        for (size_t i = 0; i < sizeof counts / sizeof *counts && status == STATUS_OK; i++) {
            base.subframes = counts[i];
            base.spp = counts[i] * each;
            status = turn(measure, base);
        }
    }
    return status;
}

static int turn_tolerance(Measure *measure, MeasureSetting base) {
    static const double pixels[] = {1, 4, 16, 0.06};
    int status = STATUS_OK;
    for (size_t i = 0; i < sizeof pixels / sizeof *pixels && status == STATUS_OK; i++) {
        base.tolerance = pixels[i];
        status = turn(measure, base);
    }
    return status;
}

// Knobs that change no picture, with few samples: seconds and bytes are what they cost.
static int turn_structures(Measure *measure, MeasureSetting base) {
    static const double kappas[] = {1.5, 4, 8};
    static const uint32_t sizes[] = {2, 4, 16, 32};
    int status = STATUS_OK;
    for (const AccelType *type = accel_types + 1; type->name && status == STATUS_OK; type++) {
        base.accel = type->name;
        // Every ray against every primitive would take all the time and tell nothing.
        status = strcmp(type->name, "brute") != 0 ? turn(measure, base) : STATUS_OK;
    }
    base.accel = "kd4-thesis";
    for (size_t i = 0; i < sizeof kappas / sizeof *kappas && status == STATUS_OK; i++) {
        base.kappa = kappas[i];
        status = turn(measure, base);
    }
    base.kappa = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes && status == STATUS_OK; i++) {
        base.leaf_size = sizes[i];
        status = turn(measure, base);
    }
    return status;
}

int measure_turn_knobs(Measure *measure) {
    MeasureSetting base = {.spp = measure->spp}, few = {.spp = 16}, coarse = {.tolerance = 1};
    int status = turn_samples(measure, base, 1, 16);
    status = status ? status : turn(measure, base);
    status = status ? status : turn_samples(measure, base, 64, 256);
    status = status ? status : turn_subframes(measure, base);
    status = status ? status : turn_tolerance(measure, measure->moves ? few : base);
    MeasureSetting scalar = few;
    scalar.cpu = "scalar";
    status = status ? status : turn(measure, scalar);
    status = status ? status : turn_structures(measure, few);
    // Along the front: coarser motion with more and with fewer samples, then more of all.
    status = status ? status : turn_samples(measure, coarse, 4, 1024);
    coarse.tolerance = 4;
    status = status ? status : turn_samples(measure, coarse, 4, 1024);
    return status ? status : turn_samples(measure, base, 1024, 65536);
}

// ---- What it is worth

bool measure_beats(const MeasurePoint *a, const MeasurePoint *b) {
    bool is_closer = a->error < b->error && measure_seconds(a) <= measure_seconds(b);
    return is_closer || (a->error <= b->error && a->most < b->least);
}

void measure_mark_front(Measure *measure) {
    for (size_t i = 0; i < measure->n_points; i++) {
        MeasurePoint *point = &measure->points[i];
        point->is_on_front = true;
        for (size_t k = 0; k < measure->n_points; k++) {
            point->is_on_front &= !measure_beats(&measure->points[k], point);
        }
    }
}

static bool is_same_but_samples(const MeasureSetting *a, MeasureSetting b, Arena *arena) {
    b.spp = a->spp;
    return strcmp(measure_arguments(arena, a), measure_arguments(arena, &b)) == 0;
}

// What more samples do to a setting.
typedef struct {
    double decline; // the noise goes with samples^-decline
    double bias;    // stays; from the point with the most samples, which knows it best
} Trend;

// The decline is that between the points with the fewest and the most samples; 1/2, which
// independent samples would have, where there is one alone.
static Trend find_trend(const Measure *measure, const MeasurePoint *base) {
    const MeasurePoint *few = base, *many = base;
    Arena arena = {0};
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        if (is_same_but_samples(&p->setting, base->setting, &arena)) {
            few = p->setting.spp < few->setting.spp ? p : few;
            many = p->setting.spp > many->setting.spp ? p : many;
        }
    }
    arena_free(&arena);
    Trend trend = {0.5, many->bias};
    if (few != many && few->noise > 0 && many->noise > 0) {
        double p = log(few->noise / many->noise) /
                   log((double)many->setting.spp / (double)few->setting.spp);
        trend.decline = fmin(fmax(p, 0.3), 1);
    }
    return trend;
}

// The setting with other samples.
static MeasureAdvice reckon(const MeasurePoint *base, Trend trend, double spp) {
    uint32_t step = base->setting.subframes ? base->setting.subframes : 1;
    double n = fmax(ceil(spp / step), 1) * step;
    MeasureAdvice advice = {.base = base, .spp = (uint32_t)fmin(n, 1 << 24)};
    double more = advice.spp / (double)base->setting.spp;
    advice.is_measured = advice.spp == base->setting.spp;
    advice.seconds = base->work.update + base->work.build + base->work.trace * more;
    advice.error = advice.is_measured ? base->error
                                      : hypot(base->noise * pow(more, -trend.decline), trend.bias);
    return advice;
}

MeasureAdvice measure_for_error(const Measure *measure, double error) {
    MeasureAdvice best = {.seconds = INFINITY};
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *base = &measure->points[i];
        Trend trend = find_trend(measure, base);
        if (!(trend.bias < error)) { // more samples do not help
            continue;
        }
        double noise = sqrt(error * error - trend.bias * trend.bias);
        double spp = base->setting.spp * pow(base->noise / noise, 1 / trend.decline);
        MeasureAdvice advice = reckon(base, trend, fmin(spp, 1e9));
        bool is_near = advice.spp <= (double)MOST_RECKONED * base->setting.spp;
        if (is_near && advice.seconds < best.seconds) {
            best = advice;
        }
    }
    return best;
}

MeasureAdvice measure_for_seconds(const Measure *measure, double seconds) {
    MeasureAdvice best = {.error = INFINITY};
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *base = &measure->points[i];
        double fixed = base->work.update + base->work.build;
        double each = base->work.trace / base->setting.spp, spp = floor((seconds - fixed) / each);
        uint32_t step = base->setting.subframes ? base->setting.subframes : 1;
        if (!(spp >= step)) {
            continue;
        }
        spp = fmin(floor(spp / step) * step, (double)MOST_RECKONED * base->setting.spp);
        MeasureAdvice advice = reckon(base, find_trend(measure, base), spp);
        if (advice.error < best.error) {
            best = advice;
        }
    }
    return best;
}

const char *measure_advice_arguments(Arena *arena, const MeasureAdvice *advice) {
    MeasureSetting setting = advice->base->setting;
    setting.spp = advice->spp;
    return measure_arguments(arena, &setting);
}
