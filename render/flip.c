// SPDX-License-Identifier: Apache-2.0
// FLIP. All of its filters are products of one in x and one in y, or sums of two such products, so
// planes are filtered by rows and then by columns. Numbers of equations are those of the paper.
#include "render/flip.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "accel/arena.h"

// The radius is 3 sqrt(0.04 / (2 pi^2)) = 0.135 degrees.
enum { MOST_PER_DEGREE = 400, MAX_RADIUS = 64 };

static const double PI = 3.14159265358979323846;

// What an observer has of a picture: filtered colors in L*a*b*, lengths of features.
typedef struct {
    float *lab[3], *edge, *point;
} Seen;

typedef struct {
    uint32_t width, height;
    size_t n;           // pixels
    float *opponent[3]; // Y'y, C'x, C'z
    float *luminance, *gradient, *between;
    Seen test, reference;
    double pixels_per_degree;
} Work;

// One dimension of a filter.
typedef struct {
    int radius;
    double weight[2 * MAX_RADIUS + 1];
} Filter;

// ---- Color spaces (sRGB primaries, white of D65)

static const double WHITE[3] = {0.950428545, 1, 1.088900371};

static void xyz_from_rgb(const double rgb[3], double xyz[3]) {
    static const double m[3][3] = {
        {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
        {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
        {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
    for (int i = 0; i < 3; i++) {
        xyz[i] = (m[i][0] * rgb[0] + m[i][1] * rgb[1] + m[i][2] * rgb[2]) / WHITE[i];
    }
}

static void rgb_from_xyz(const double xyz[3], double rgb[3]) {
    static const double m[3][3] = {{3.241003275, -1.537398934, -0.498615861},
                                   {-0.969224334, 1.875930071, 0.041554224},
                                   {0.055639423, -0.204011202, 1.057148933}};
    for (int i = 0; i < 3; i++) {
        rgb[i] =
            m[i][0] * xyz[0] * WHITE[0] + m[i][1] * xyz[1] * WHITE[1] + m[i][2] * xyz[2] * WHITE[2];
    }
}

// CIELAB without its cube root; the paper's equation 1.
static void opponent_from_rgb(const double rgb[3], double out[3]) {
    double xyz[3];
    xyz_from_rgb(rgb, xyz);
    out[0] = 116 * xyz[1] - 16;
    out[1] = 500 * (xyz[0] - xyz[1]);
    out[2] = 200 * (xyz[1] - xyz[2]);
}

static void rgb_from_opponent(const double in[3], double rgb[3]) {
    double y = (in[0] + 16) / 116;
    const double xyz[3] = {y + in[1] / 500, y, y - in[2] / 200};
    rgb_from_xyz(xyz, rgb);
}

// L*a*b* with the Hunt effect, colors of dark pixels counting less: equation 4.
static void hunt_lab_from_rgb(const double rgb[3], double lab[3]) {
    const double delta = 6.0 / 29;
    double xyz[3];
    xyz_from_rgb(rgb, xyz);
    for (int i = 0; i < 3; i++) {
        xyz[i] =
            xyz[i] > delta * delta * delta ? cbrt(xyz[i]) : xyz[i] / (3 * delta * delta) + 4.0 / 29;
    }
    lab[0] = 116 * xyz[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (xyz[0] - xyz[1]);
    lab[2] = 0.01 * lab[0] * 200 * (xyz[1] - xyz[2]);
}

static double clip(double v) {
    return v > 0 ? fmin(v, 1) : 0;
}

// ---- Filters

// Weights of exp(-pi^2 x^2 / b), x in degrees, not normalized. Returns their sum.
static double gaussian(Filter *filter, int radius, double b, double pixels_per_degree) {
    double sum = 0;
    filter->radius = radius;
    for (int i = -radius; i <= radius; i++) {
        double x = i / pixels_per_degree;
        sum += filter->weight[i + radius] = exp(-PI * PI * x * x / b);
    }
    return sum;
}

static void scale(Filter *filter, double by) {
    for (int i = 0; i <= 2 * filter->radius; i++) {
        filter->weight[i] *= by;
    }
}

static uint32_t clamp_to(int64_t i, uint32_t n) {
    return i < 0 ? 0 : i >= (int64_t)n ? n - 1 : (uint32_t)i;
}

// to = from filtered by `across` in x and `down` in y, added where `adds`; `to` may be `from`.
static void filter_plane(const Work *work, const float *from, const Filter *across,
                         const Filter *down, float *to, bool adds) {
    float *between = work->between;
    const uint32_t width = work->width, height = work->height;
#pragma omp parallel for schedule(static)
    for (uint32_t y = 0; y < height; y++) {
        const float *row = from + (size_t)y * width;
        for (uint32_t x = 0; x < width; x++) {
            double sum = 0;
            for (int i = -across->radius; i <= across->radius; i++) {
                sum += across->weight[i + across->radius] *
                       (double)row[clamp_to((int64_t)x + i, width)];
            }
            between[(size_t)y * width + x] = (float)sum;
        }
    }
#pragma omp parallel for schedule(static)
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++) {
            double sum = 0;
            for (int i = -down->radius; i <= down->radius; i++) {
                sum += down->weight[i + down->radius] *
                       (double)between[(size_t)clamp_to((int64_t)y + i, height) * width + x];
            }
            float *value = &to[(size_t)y * width + x];
            *value = (float)(adds ? (double)*value + sum : sum);
        }
    }
}

// Contrast sensitivity: sums of a sqrt(pi / b) exp(-pi^2 x^2 / b) in two dimensions, normalized
// over the support that all of them share. Equations 2 and 3, table 1.
static void filter_colors(const Work *work, float *const filtered[3]) {
    static const double a[3][2] = {{1, 0}, {1, 0}, {34.1, 13.5}};
    static const double b[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
    double ppd = work->pixels_per_degree;
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * PI * PI)) * ppd);
    for (int c = 0; c < 3; c++) {
        Filter filter[2];
        double share[2], total = 0;
        for (int k = 0; k < 2; k++) {
            double sum = gaussian(&filter[k], radius, b[c][k], ppd);
            share[k] = a[c][k] * sqrt(PI / b[c][k]);
            total += share[k] * sum * sum;
        }
        for (int k = 0; k < 2 && share[k] > 0; k++) {
            Filter across = filter[k];
            scale(&across, share[k] / total);
            filter_plane(work, work->opponent[c], &across, &filter[k], filtered[c], k > 0);
        }
    }
}

// What edges (the first derivative of a Gaussian) and points (the second) are made of: across one
// axis; positive and negative weights add up to 1 and -1 each. Section 4.2.
static void make_feature(Filter *filter, const Filter *smooth, double sigma, bool is_point) {
    double positive = 0, negative = 0;
    filter->radius = smooth->radius;
    for (int i = -smooth->radius; i <= smooth->radius; i++) {
        double factor = is_point ? (double)i * i / (sigma * sigma) - 1 : -i;
        double w = factor * smooth->weight[i + smooth->radius];
        filter->weight[i + smooth->radius] = w;
        *(w > 0 ? &positive : &negative) += fabs(w);
    }
    for (int i = 0; i <= 2 * filter->radius; i++) {
        filter->weight[i] /= filter->weight[i] > 0 ? positive : negative;
    }
}

// The length of the feature's gradient, in `to`.
static void find_feature(const Work *work, bool is_point, float *to) {
    double sigma = 0.5 * 0.082 * work->pixels_per_degree, sum = 0;
    Filter smooth = {.radius = (int)ceil(3 * sigma)}, feature;
    for (int i = -smooth.radius; i <= smooth.radius; i++) {
        sum += smooth.weight[i + smooth.radius] = exp(-0.5 * i * i / (sigma * sigma));
    }
    scale(&smooth, 1 / sum);
    make_feature(&feature, &smooth, sigma, is_point);
    filter_plane(work, work->luminance, &feature, &smooth, to, false);
    filter_plane(work, work->luminance, &smooth, &feature, work->gradient, false);
    for (size_t i = 0; i < work->n; i++) {
        to[i] = hypotf(to[i], work->gradient[i]);
    }
}

// ---- One picture

typedef double Exposed(double value, double exposure);

static double as_shown(double value, double exposure) {
    (void)exposure;
    return clip(value);
}

// Krzysztof Narkowicz's fit of the ACES curve, without its exposure.
static const double CURVE[6] = {0.6 * 0.6 * 2.51, 0.6 * 0.03, 0,
                                0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14};

static double through_aces(double value, double exposure) {
    double x = fmin(value > 0 ? value * exp2(exposure) : 0, 1e9);
    double up = (CURVE[0] * x + CURVE[1]) * x + CURVE[2];
    return clip(up / ((CURVE[3] * x + CURVE[4]) * x + CURVE[5]));
}

static void look_at(const Work *work, const FlipImage *image, Exposed *expose, double exposure,
                    const Seen *seen) {
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < work->n; i++) {
        double rgb[3], out[3];
        for (int c = 0; c < 3; c++) {
            rgb[c] = expose((double)image->planes[c][i], exposure);
        }
        opponent_from_rgb(rgb, out);
        for (int c = 0; c < 3; c++) {
            work->opponent[c][i] = (float)out[c];
        }
        work->luminance[i] = (float)((out[0] + 16) / 116);
    }
    find_feature(work, false, seen->edge);
    find_feature(work, true, seen->point);
    filter_colors(work, seen->lab);
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < work->n; i++) {
        double rgb[3], lab[3];
        const double filtered[3] = {(double)seen->lab[0][i], (double)seen->lab[1][i],
                                    (double)seen->lab[2][i]};
        rgb_from_opponent(filtered, rgb);
        for (int c = 0; c < 3; c++) {
            rgb[c] = clip(rgb[c]);
        }
        hunt_lab_from_rgb(rgb, lab);
        for (int c = 0; c < 3; c++) {
            seen->lab[c][i] = (float)lab[c];
        }
    }
}

// ---- Errors

static double hyab(const double a[3], const double b[3]) {
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

// The greatest color difference there is, that of green and blue, to the power of q_c.
static double greatest_difference(void) {
    const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    double a[3], b[3];
    hunt_lab_from_rgb(green, a);
    hunt_lab_from_rgb(blue, b);
    return pow(hyab(a, b), 0.7);
}

// Large differences are squeezed into the last twentieth: equation 7.
static double redistribute(double difference, double greatest) {
    const double knee = 0.4 * greatest, at_knee = 0.95;
    return difference < knee ? at_knee / knee * difference
                             : at_knee + (difference - knee) / (greatest - knee) * (1 - at_knee);
}

// Equations 8 to 10.
static double error_of(double difference, double edges, double points) {
    double feature = sqrt(fmax(fabs(edges), fabs(points)) / sqrt(2));
    return pow(difference, 1 - fmin(feature, 1));
}

// map gets the larger of what it held and the error, for each pixel.
static void compare_exposed(const Work *work, const FlipImage *test, const FlipImage *reference,
                            Exposed *expose, double exposure, float *map) {
    const double greatest = greatest_difference();
    const Seen *s = &work->test, *r = &work->reference;
    look_at(work, test, expose, exposure, s);
    look_at(work, reference, expose, exposure, r);
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < work->n; i++) {
        const double a[3] = {(double)s->lab[0][i], (double)s->lab[1][i], (double)s->lab[2][i]};
        const double b[3] = {(double)r->lab[0][i], (double)r->lab[1][i], (double)r->lab[2][i]};
        double difference = redistribute(pow(hyab(a, b), 0.7), greatest);
        double error = error_of(difference, (double)s->edge[i] - (double)r->edge[i],
                                (double)s->point[i] - (double)r->point[i]);
        map[i] = fmaxf(map[i], (float)error);
    }
}

static Work work_new(Arena *arena, const FlipImage *image, double pixels_per_degree) {
    Work work = {.width = image->width,
                 .height = image->height,
                 .n = (size_t)image->width * image->height,
                 .pixels_per_degree = fmin(pixels_per_degree, MOST_PER_DEGREE)};
    float **const planes[] = {
        &work.opponent[0],      &work.opponent[1],      &work.opponent[2],
        &work.luminance,        &work.gradient,         &work.between,
        &work.test.lab[0],      &work.test.lab[1],      &work.test.lab[2],
        &work.test.edge,        &work.test.point,       &work.reference.lab[0],
        &work.reference.lab[1], &work.reference.lab[2], &work.reference.edge,
        &work.reference.point};
    for (size_t i = 0; i < sizeof planes / sizeof planes[0]; i++) {
        *planes[i] = ARENA_ARRAY(arena, work.n, float);
    }
    return work;
}

// Row by row, so that small errors do not drown in a large sum.
static double map_mean(const float *map, uint32_t width, uint32_t height) {
    double sum = 0;
    for (uint32_t y = 0; y < height; y++) {
        double row = 0;
        for (uint32_t x = 0; x < width; x++) {
            row += (double)map[(size_t)y * width + x];
        }
        sum += row;
    }
    return sum / ((double)width * height);
}

// The caller's map, or one of the arena where it wants none; no error yet.
static float *cleared_map(Arena *arena, const Work *work, float *map) {
    map = map ? map : ARENA_ARRAY(arena, work->n, float);
    memset(map, 0, work->n * sizeof *map);
    return map;
}

double flip_ldr(const FlipImage *test, const FlipImage *reference, double pixels_per_degree,
                float *map) {
    Arena arena = {0};
    Work work = work_new(&arena, test, pixels_per_degree);
    map = cleared_map(&arena, &work, map);
    compare_exposed(&work, test, reference, as_shown, 0, map);
    double mean = map_mean(map, work.width, work.height);
    arena_free(&arena);
    return mean;
}

// ---- Exposures

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The exposures that bring the reference's brightest and its median pixel to 0.85. False: black.
static bool find_exposures(const FlipImage *reference, float *luminance, double *first,
                           double *last) {
    size_t n = (size_t)reference->width * reference->height;
    for (size_t i = 0; i < n; i++) {
        luminance[i] = (float)(0.2126 * (double)reference->planes[0][i] +
                               0.7152 * (double)reference->planes[1][i] +
                               0.0722 * (double)reference->planes[2][i]);
    }
    qsort(luminance, n, sizeof *luminance, compare_floats);
    double most = (double)luminance[n - 1];
    double median = 0.5 * ((double)luminance[(n - 1) / 2] + (double)luminance[n / 2]);
    if (!(most > 0)) {
        return false;
    }
    double a = CURVE[0] - 0.85 * CURVE[3], b = CURVE[1] - 0.85 * CURVE[4],
           c = CURVE[2] - 0.85 * CURVE[5];
    double half = 0.5 * b / a, bright = -half + sqrt(half * half - c / a);
    *first = log2(bright / most);
    *last = log2(bright / fmax(median, most * 0x1p-16));
    return true;
}

double flip_hdr(const FlipImage *test, const FlipImage *reference, double pixels_per_degree,
                float *map) {
    Arena arena = {0};
    Work work = work_new(&arena, test, pixels_per_degree);
    map = cleared_map(&arena, &work, map);
    double first = 0, last = 0;
    int n = 1;
    if (find_exposures(reference, work.luminance, &first, &last)) {
        n = (int)fmax(2, ceil(last - first));
    }
    for (int i = 0; i < n; i++) {
        double exposure = first + (n > 1 ? (last - first) * i / (n - 1) : 0);
        compare_exposed(&work, test, reference, through_aces, exposure, map);
    }
    double mean = map_mean(map, work.width, work.height);
    arena_free(&arena);
    return mean;
}
