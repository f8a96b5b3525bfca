// SPDX-License-Identifier: Apache-2.0
// Sampling of motion: halving spans of time until straight lines are near enough.
#include "render/sample.h"

#include <stdlib.h>
#include <string.h>

enum {
    SUBSET = 256,      // points on which errors are measured
    ALL_UP_TO = 384,   // so few points are all measured
    PROBES_FIRST = 16, // irregular times in a whole piece, which may hold many periods
    PROBES = 6,        // in what was halved before
    CHORDS = 8,        // of a span whose turning is measured
    VIEWS = 16,        // instances, of many, for which the error is measured
};

// What is measured on a subset at a few times must be under this share of the tolerance; the rest
// is for the points and times between.
static const double ACCEPT = 0.9;

// A shutter must be open for more than this (frame periods) of a span to see it.
static const double LEAST_OVERLAP = 1e-12;

typedef struct {
    double *c[4];
} Pose;

typedef struct {
    const Sampler *sampler;
    Opening open;
    Arena *arena;
    Arena scratch;
    SampleView views[VIEWS];
    uint32_t n_views;
    Pose pose[SAMPLE_DEPTH + 4]; // one for each level of halving, one for probes, two ends
    Span **spans;
    size_t *n, *capacity;
    SampleReport *report;
} Cell;

enum { POSE_PROBE = SAMPLE_DEPTH + 1, POSE_LO, POSE_HI };

// Steele, Lea, Flood 2014: splitmix64's output function.
static uint64_t scramble(uint64_t x) {
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

// In (0, 1), the k-th for the span [lo, hi] of a frame.
static double irregular(int64_t frame, double lo, double hi, uint64_t k) {
    uint64_t h = scramble((uint64_t)frame + 0x9e3779b97f4a7c15u);
    h = scramble(scramble(h ^ bits_of(lo)) + bits_of(hi) + k * 0x9e3779b97f4a7c15u);
    return ((double)(h >> 12) + 0.5) * 0x1p-52;
}

double sample_pixels(const Camera *camera, Vec3 point) {
    double x, y, scale;
    if (camera->kind == CAMERA_ORTHOGRAPHIC) {
        return 1 / camera->pixel;
    }
    double width = camera->width, height = camera->height;
    if (camera_project(camera, point, &x, &y, &scale) && x >= -width && x <= 2 * width &&
        y >= -height && y <= 2 * height) {
        return scale;
    }
    return 1 / (camera->pixel * vec3_length(vec3_sub(point, camera->from)));
}

static Pose pose_new(Arena *arena, const Mover *mover) {
    Pose pose = {{NULL}};
    for (uint32_t c = 0; c < mover->width; c++) {
        pose.c[c] = ARENA_ARRAY(arena, mover->n, double);
    }
    return pose;
}

// Directions in which the outermost points are always part of the subset.
static const Vec3 OUTWARD[] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 1},
                               {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};
enum { N_OUTWARD = sizeof OUTWARD / sizeof OUTWARD[0] };

static int compare_index(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static size_t extremes(const Pose *pose, size_t n, uint32_t *which) {
    double least[N_OUTWARD], most[N_OUTWARD];
    for (int k = 0; k < N_OUTWARD; k++) {
        least[k] = INFINITY;
        most[k] = -INFINITY;
        which[2 * k] = which[2 * k + 1] = 0;
    }
    for (size_t i = 0; i < n; i++) {
        Vec3 p = vec3(pose->c[0][i], pose->c[1][i], pose->c[2][i]);
        for (int k = 0; k < N_OUTWARD; k++) {
            double along = vec3_dot(p, OUTWARD[k]);
            if (along < least[k]) {
                least[k] = along;
                which[2 * k] = (uint32_t)i;
            }
            if (along > most[k]) {
                most[k] = along;
                which[2 * k + 1] = (uint32_t)i;
            }
        }
    }
    return 2 * N_OUTWARD;
}

Mover sample_choose(Arena *arena, const Mover *all, double seconds) {
    size_t n = all->n;
    if (n <= ALL_UP_TO) {
        return *all;
    }
    Arena scratch = {0};
    Pose pose = pose_new(&scratch, all);
    mover_run(all, seconds, &scratch, pose.c);
    uint32_t which[SUBSET + 2 * N_OUTWARD];
    size_t taken = extremes(&pose, n, which);
    for (size_t i = 0; i < SUBSET; i++) {
        double jitter = irregular(0, 0, 1, i);
        which[taken++] = (uint32_t)(((double)i + jitter) / SUBSET * (double)n);
    }
    qsort(which, taken, sizeof *which, compare_index);
    size_t kept = 0;
    for (size_t i = 0; i < taken; i++) {
        if (kept == 0 || which[i] != which[kept - 1]) {
            which[kept++] = which[i];
        }
    }
    arena_free(&scratch);
    return mover_subset(arena, all, which, kept);
}

static double cell_seconds(const Cell *cell, double frac) {
    return instant_seconds((Instant){cell->open.frame, frac}, cell->sampler->scene->film.fps);
}

static void evaluate(Cell *cell, double frac, Pose *pose) {
    Arena scratch = {0};
    mover_run(&cell->sampler->probe, cell_seconds(cell, frac), &scratch, pose->c);
    arena_free(&scratch);
    cell->report->evaluations += cell->sampler->probe.n;
}

// The part of a pixel's error that one point contributes, in the space of its points: its distance
// from the straight line plus its radius' from the linear one.
typedef struct {
    Vec3 position, off;
    double radius_off;
    bool is_finite, is_mixed; // mixed: finite at some of the three instants only
} Deviation;

static bool point_is_finite(const Pose *p, uint32_t width, size_t i) {
    double sum = p->c[0][i] * 0 + p->c[1][i] * 0 + p->c[2][i] * 0;
    return (width > 3 ? sum + p->c[3][i] * 0 : sum) == 0;
}

static double off_line(const Pose *a, const Pose *b, const Pose *x, double s, uint32_t c,
                       size_t i) {
    return x->c[c][i] - ((1 - s) * a->c[c][i] + s * b->c[c][i]);
}

// What has no radius at an end comes or goes there: in the shortest of spans its size is no error.
static bool comes_or_goes(const Pose *a, const Pose *b, size_t i) {
    return (a->c[3][i] == 0) != (b->c[3][i] == 0);
}

static Deviation deviation(const Cell *cell, const Pose *a, const Pose *b, const Pose *x, double s,
                           size_t i, bool is_shortest) {
    uint32_t width = cell->sampler->probe.width;
    bool has_size = width > 3 && !(is_shortest && comes_or_goes(a, b, i));
    int n_finite =
        point_is_finite(a, width, i) + point_is_finite(b, width, i) + point_is_finite(x, width, i);
    return (Deviation){
        .position = vec3(x->c[0][i], x->c[1][i], x->c[2][i]),
        .off = vec3(off_line(a, b, x, s, 0, i), off_line(a, b, x, s, 1, i),
                    off_line(a, b, x, s, 2, i)),
        .radius_off = has_size ? fabs(off_line(a, b, x, s, 3, i)) : 0,
        .is_finite = n_finite == 3,
        .is_mixed = n_finite == 1 || n_finite == 2,
    };
}

static double pixels_off(const Camera *camera, const Affine *map, const Deviation *d) {
    double off = vec3_length(affine_vector(map, d->off)) + d->radius_off * affine_stretch(map);
    if (off == 0) {
        return 0;
    }
    double pixels = off * sample_pixels(camera, affine_point(map, d->position));
    return isnan(pixels) ? INFINITY : pixels;
}

// A camera that cannot see counts as one that holds the rest pose in a picture's height.
static double pixels_blind(const Cell *cell, const Deviation *d) {
    return (vec3_length(d->off) + d->radius_off) * cell->sampler->frame.scale *
           cell->sampler->scene->film.height;
}

// False: it has no place at that time.
static bool view_map(const SampleView *view, double seconds, Affine *map) {
    *map = affine_identity();
    if (!view->transform) {
        return true;
    }
    double in[IN_COUNT];
    shape_inputs(view->shape, view->loops, seconds, in);
    return affine_run(view->transform, in, map);
}

// Of the sampler's views those VIEWS that look largest from the camera in the cell's middle, in
// order of size.
static void choose_views(Cell *cell) {
    const Sampler *sampler = cell->sampler;
    double size[VIEWS + 1], seconds = cell_seconds(cell, 0.5);
    Camera camera = camera_at(sampler->scene, seconds);
    const double *c = sampler->frame.center;
    for (uint32_t v = 0; v < sampler->n_views; v++) {
        Affine map;
        double s = 0;
        if (sampler->n_views > VIEWS && view_map(&sampler->views[v], seconds, &map)) {
            Vec3 place = affine_point(&map, vec3(c[0], c[1], c[2]));
            s = affine_stretch(&map) * (camera.is_valid ? sample_pixels(&camera, place) : 1);
        }
        uint32_t at = cell->n_views < VIEWS ? cell->n_views++ : VIEWS;
        for (; at > 0 && s > size[at - 1]; at--) {
            size[at] = size[at - 1];
            if (at < VIEWS) {
                cell->views[at] = cell->views[at - 1];
            }
        }
        if (at < VIEWS) {
            size[at] = s;
            cell->views[at] = sampler->views[v];
        }
    }
}

typedef struct {
    double error;  // pixels
    bool is_mixed; // some point is not finite at some of the instants
} Measure;

// The views of a cell that have a place at that time; returns how many.
static uint32_t view_maps(const Cell *cell, double seconds, Affine maps[VIEWS]) {
    uint32_t n = 0;
    for (uint32_t v = 0; v < cell->n_views; v++) {
        n += view_map(&cell->views[v], seconds, &maps[n]);
    }
    return n;
}

static bool is_shortest(double lo, double hi) {
    return hi - lo <= 1.0 / SAMPLE_MAX_CUTS;
}

// The error at one time: s of the way from lo to hi.
static Measure measure_at(Cell *cell, double lo, double hi, const Pose *a, const Pose *b,
                          double s) {
    const Sampler *sampler = cell->sampler;
    double frac = lo + s * (hi - lo), seconds = cell_seconds(cell, frac);
    Pose *x = &cell->pose[POSE_PROBE];
    evaluate(cell, frac, x);
    Camera camera = camera_at(sampler->scene, seconds);
    Affine maps[VIEWS];
    uint32_t n_maps = view_maps(cell, seconds, maps);
    Measure m = {0};
    bool is_fixed = sampler->pixels > 0;
    for (size_t i = 0; (n_maps > 0 || is_fixed) && i < sampler->probe.n; i++) {
        Deviation d = deviation(cell, a, b, x, s, i, is_shortest(lo, hi));
        m.is_mixed |= d.is_mixed;
        if (is_fixed && d.is_finite) {
            m.error = fmax(m.error, (vec3_length(d.off) + d.radius_off) * sampler->pixels);
        }
        for (uint32_t v = 0; d.is_finite && v < n_maps; v++) {
            m.error = fmax(m.error, camera.is_valid ? pixels_off(&camera, &maps[v], &d)
                                                    : pixels_blind(cell, &d));
        }
    }
    return m;
}

static Measure measure(Cell *cell, double lo, double hi, const Pose *a, const Pose *b,
                       bool is_first, double enough) {
    int n = is_first ? PROBES_FIRST : PROBES;
    Measure worst = measure_at(cell, lo, hi, a, b, 0.5);
    for (int k = 0; k < n && worst.error <= enough && !worst.is_mixed; k++) {
        double s = (k + irregular(cell->open.frame, lo, hi, (uint64_t)k)) / n;
        Measure m = measure_at(cell, lo, hi, a, b, s);
        worst.error = fmax(worst.error, m.error);
        worst.is_mixed |= m.is_mixed;
    }
    return worst;
}

static bool is_seen(const Cell *cell, double lo, double hi) {
    const Opening *open = &cell->open;
    if (open->lo == open->hi) {
        return lo <= open->lo && open->lo < hi;
    }
    return fmin(hi, open->hi) - fmax(lo, open->lo) > LEAST_OVERLAP;
}

static void keep(Cell *cell, Span span, double error) {
    *cell->spans = arena_grow(cell->arena, *cell->spans, *cell->n, cell->capacity, sizeof span);
    (*cell->spans)[(*cell->n)++] = span;
    cell->report->error = fmax(cell->report->error, error);
}

static void refine(Cell *cell, Span span, const Pose *a, const Pose *b, int depth) {
    if (!is_seen(cell, span.lo, span.hi)) {
        return;
    }
    double tolerance = cell->sampler->tolerance;
    bool is_last = is_shortest(span.lo, span.hi) || depth > SAMPLE_DEPTH;
    Measure m =
        measure(cell, span.lo, span.hi, a, b, depth == 0, is_last ? INFINITY : ACCEPT * tolerance);
    if (is_last || (m.error <= ACCEPT * tolerance && !m.is_mixed)) {
        cell->report->is_missed |= m.error > tolerance;
        keep(cell, span, m.error);
        return;
    }
    Pose *middle = &cell->pose[depth];
    double mid = span.lo + (span.hi - span.lo) / 2;
    evaluate(cell, mid, middle);
    refine(cell, (Span){span.frame, span.lo, mid, mid}, a, middle, depth + 1);
    refine(cell, (Span){span.frame, mid, span.hi, span.hi_at}, middle, b, depth + 1);
}

// How far the velocity of the point that turns most does so within a span, in radians.
static double turning(Cell *cell, Span span) {
    const Mover *probe = &cell->sampler->probe;
    Arena scratch = {0};
    Vec3 *last = ARENA_ARRAY(&scratch, probe->n, Vec3),
         *way = ARENA_ARRAY(&scratch, probe->n, Vec3);
    double *turned = ARENA_ARRAY(&scratch, probe->n, double), most = 0;
    Pose *x = &cell->pose[POSE_PROBE];
    for (int k = 0; k <= CHORDS; k++) {
        evaluate(cell, k < CHORDS ? span.lo + (span.hi - span.lo) * k / CHORDS : span.hi_at, x);
        for (size_t i = 0; i < probe->n; i++) {
            Vec3 p = vec3(x->c[0][i], x->c[1][i], x->c[2][i]), step = vec3_sub(p, last[i]);
            // What moves less than rounding does not turn.
            bool is_still = !(vec3_length(step) * cell->sampler->frame.scale > 1e-9);
            if (k > 1 && !is_still && vec3_length(way[i]) > 0) {
                turned[i] += atan2(vec3_length(vec3_cross(way[i], step)), vec3_dot(way[i], step));
                most = fmax(most, turned[i]);
            }
            way[i] = k > 0 && !is_still ? step : way[i];
            last[i] = p;
        }
    }
    arena_free(&scratch);
    return most;
}

// A piece of the user's own grid: kept as it is, its error reported.
static void keep_fixed(Cell *cell, Span span, const Pose *a, const Pose *b) {
    if (!is_seen(cell, span.lo, span.hi)) {
        return;
    }
    // Seven of eight chords' turning are seen between the first and the last chord's middle.
    const double quarter = 1.5707963267948966 * (CHORDS - 1) / CHORDS;
    Measure m = measure(cell, span.lo, span.hi, a, b, true, INFINITY);
    cell->report->is_missed |= m.error > cell->sampler->tolerance;
    cell->report->is_fast_rotation |= turning(cell, span) > quarter * (1 + 1e-6);
    keep(cell, span, m.error);
}

// True where the points differ on the two sides of a cut by more than rounding and an instant's
// motion: two sets of points are needed there.
static bool jumps(const Cell *cell, Cut cut) {
    const Sampler *sampler = cell->sampler;
    Arena scratch = {0};
    Pose a = pose_new(&scratch, &sampler->all), b = pose_new(&scratch, &sampler->all);
    mover_run(&sampler->all, cell_seconds(cell, cut.below), &scratch, a.c);
    mover_run(&sampler->all, cell_seconds(cell, cut.at), &scratch, b.c);
    cell->report->evaluations += 2 * sampler->all.n;
    bool found = false;
    for (uint32_t c = 0; c < sampler->all.width && !found; c++) {
        double center = c < 3 ? sampler->frame.center[c] : 0;
        for (size_t i = 0; i < sampler->all.n && !found; i++) {
            double x = a.c[c][i], y = b.c[c][i], scale = sampler->frame.scale;
            double size = fmax(1, fabs(x - center) * scale);
            found = isfinite(x) != isfinite(y) || fabs(x - y) * scale > 0x1p-22 * size;
        }
    }
    arena_free(&scratch);
    return found;
}

// A break before an instant of the grid at the same place: of the two, it has something to say.
static int cut_compare(const void *a, const void *b) {
    const Cut *x = a, *y = b;
    if (x->at != y->at) {
        return x->at < y->at ? -1 : 1;
    }
    return (x->below > y->below) - (x->below < y->below);
}

static size_t uniform_cuts(uint32_t samples, Cut *cuts) {
    size_t n = 0;
    for (uint32_t k = 1; k < samples; k++) {
        double at = (double)k / samples;
        cuts[n++] = (Cut){at, at};
    }
    return n;
}

// The cell's own cuts, without the ends: breaks, and the user's grid. below == at: no break.
static size_t cut_cell(Cell *cell, Cut *cuts) {
    const Sampler *sampler = cell->sampler;
    bool has_more = false;
    size_t n = 0;
    if (sampler->n_breaks > 0) {
        n = breaks_find(sampler->breaks, sampler->n_breaks, sampler->scene->film.fps,
                        cell->open.frame, &cell->scratch, cuts, &has_more);
    }
    if (has_more) {
        cell->report->has_too_many_breaks = true;
        return uniform_cuts(SAMPLE_MAX_CUTS, cuts);
    }
    for (size_t i = 0; i < n; i++) {
        bool matters = cuts[i].at >= cell->open.lo && cuts[i].below <= cell->open.hi;
        if (!matters || !jumps(cell, cuts[i])) {
            cuts[i].below = cuts[i].at;
        }
    }
    if (sampler->samples > 1) {
        n += uniform_cuts(sampler->samples, cuts + n);
        qsort(cuts, n, sizeof *cuts, cut_compare);
    }
    return n;
}

static void sample_piece(Cell *cell, Span span) {
    if (!is_seen(cell, span.lo, span.hi)) {
        return;
    }
    Pose *a = &cell->pose[POSE_LO], *b = &cell->pose[POSE_HI];
    evaluate(cell, span.lo, a);
    evaluate(cell, span.hi_at, b);
    if (cell->sampler->samples > 0) {
        keep_fixed(cell, span, a, b);
    } else {
        refine(cell, span, a, b, 0);
    }
}

void sample_cell(const Sampler *sampler, Opening open, Arena *arena, Span **spans, size_t *n,
                 size_t *capacity, SampleReport *report) {
    Cell cell = {.sampler = sampler,
                 .open = open,
                 .arena = arena,
                 .spans = spans,
                 .n = n,
                 .capacity = capacity,
                 .report = report};
    for (size_t i = 0; i < sizeof cell.pose / sizeof *cell.pose; i++) {
        cell.pose[i] = pose_new(&cell.scratch, &sampler->probe);
    }
    if (!(sampler->pixels > 0)) {
        choose_views(&cell);
    }
    Cut *cuts = ARENA_ARRAY(&cell.scratch, SAMPLE_MAX_CUTS + sampler->samples + 1, Cut);
    size_t n_cuts = cut_cell(&cell, cuts);
    double lo = 0;
    for (size_t i = 0; i <= n_cuts; i++) {
        // A break at the very end of the cell leaves nothing behind it.
        Cut end = i < n_cuts ? cuts[i] : (Cut){1, 1};
        if (end.at > lo) {
            sample_piece(&cell, (Span){open.frame, lo, end.at, end.below});
        }
        lo = end.at;
    }
    arena_free(&cell.scratch);
}
