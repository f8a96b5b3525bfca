// SPDX-License-Identifier: Apache-2.0
// st4 measure: settings that were measured, kept in a file from which a later call goes on.
#include "lang/command_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_SIZE = 1024, N_COLUMNS = 22 };

static const char HEADER[] =
    "fingerprint,spp,subframes,tolerance,accel,kappa,leaf_size,cpu,update_seconds,build_seconds,"
    "trace_seconds,cpu_seconds,least_seconds,most_seconds,vertex_bytes,tree_bytes,rays,"
    "relative_rmse,noise,bias,bias_at_most,arguments\n";

static bool same_text(const char *a, const char *b) {
    return a == b || (a && b && strcmp(a, b) == 0);
}

static bool same_number(double a, double b) {
    return !(a < b) && !(a > b);
}

static bool same_setting(const MeasureSetting *a, const MeasureSetting *b) {
    return a->spp == b->spp && a->subframes == b->subframes && a->leaf_size == b->leaf_size &&
           same_number(a->tolerance, b->tolerance) && same_number(a->kappa, b->kappa) &&
           same_text(a->accel, b->accel) && same_text(a->cpu, b->cpu);
}

MeasurePoint *measure_known(const Measure *measure, const MeasureSetting *setting) {
    for (size_t i = 0; i < measure->n_points; i++) {
        if (same_setting(&measure->points[i].setting, setting)) {
            return &measure->points[i];
        }
    }
    return NULL;
}

static bool is_default(const Measure *measure, const MeasureSetting *s) {
    return s->spp == measure->spp && !s->subframes && !s->leaf_size && !(s->tolerance > 0) &&
           !(s->kappa > 0) && !s->accel && !s->cpu;
}

static void add(Measure *measure, MeasurePoint point) {
    point.arguments = measure_arguments(measure->arena, &point.setting);
    point.is_default = is_default(measure, &point.setting);
    measure->points = arena_grow(measure->arena, measure->points, measure->n_points,
                                 &measure->capacity, sizeof *measure->points);
    measure->points[measure->n_points++] = point;
}

// ---- The file

static void put_line(FILE *file, const Measure *measure, const MeasurePoint *p) {
    const MeasureSetting *s = &p->setting;
    const MeasureWork *w = &p->work;
    fprintf(
        file,
        "%s,%u,%u,%g,%s,%g,%u,%s,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.0f,%.0f,%.0f,%.9g,%.9g,%.9g,%.9g,"
        "%s\n",
        measure->fingerprint, s->spp, s->subframes, s->tolerance, s->accel ? s->accel : "",
        s->kappa, s->leaf_size, s->cpu ? s->cpu : "", w->update, w->build, w->trace, w->cpu,
        p->least, p->most, w->vertex_bytes, w->tree_bytes, w->rays, p->error, p->noise, p->bias,
        p->bias_most, p->arguments);
}

// At once, so that a stop loses one setting and no more.
static bool keep(const Measure *measure, const MeasurePoint *point) {
    const char *path = measure_path(measure, "results.csv");
    FILE *file = fopen(path, "a");
    if (!file) {
        perror(path);
        return false;
    }
    fseek(file, 0, SEEK_END);
    if (ftell(file) == 0) {
        fputs(HEADER, file);
    }
    put_line(file, measure, point);
    return fclose(file) == 0;
}

static const char *text_or_null(Arena *arena, const char *text) {
    return *text ? arena_string(arena, text, strlen(text)) : NULL;
}

// Cuts the line at its commas. False: it has less than all columns, as one cut off by a stop.
static bool cut(char *line, char *columns[N_COLUMNS]) {
    size_t n = 0;
    if (!strchr(line, '\n')) {
        return false;
    }
    for (char *at = line; at && n < N_COLUMNS; n++) {
        columns[n] = at;
        at = strchr(at, ',');
        if (at) {
            *at++ = '\0';
        }
    }
    return n == N_COLUMNS;
}

static MeasurePoint read_point(Measure *measure, char *const c[N_COLUMNS]) {
    double v[N_COLUMNS];
    for (int i = 0; i < N_COLUMNS; i++) {
        v[i] = strtod(c[i], NULL);
    }
    return (MeasurePoint){
        .setting = {.spp = (uint32_t)v[1],
                    .subframes = (uint32_t)v[2],
                    .tolerance = v[3],
                    .accel = text_or_null(measure->arena, c[4]),
                    .kappa = v[5],
                    .leaf_size = (uint32_t)v[6],
                    .cpu = text_or_null(measure->arena, c[7])},
        .work = {v[8], v[9], v[10], v[11], v[14], v[15], v[16]},
        .least = v[12],
        .most = v[13],
        .error = v[17],
        .noise = v[18],
        .bias = v[19],
        .bias_most = v[20],
    };
}

void measure_resume(Measure *measure) {
    char line[LINE_SIZE];
    char *columns[N_COLUMNS];
    FILE *file = fopen(measure_path(measure, "results.csv"), "r");
    while (file && fgets(line, sizeof line, file)) {
        if (cut(line, columns) && strcmp(columns[0], measure->fingerprint) == 0) {
            MeasurePoint point = read_point(measure, columns);
            if (!measure_known(measure, &point.setting)) {
                add(measure, point);
            }
        }
    }
    if (file) {
        fclose(file);
    }
}

// ---- Measuring

static int compare_numbers(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double values[MEASURE_RUNS]) {
    qsort(values, MEASURE_RUNS, sizeof *values, compare_numbers);
    return values[MEASURE_RUNS / 2];
}

// Of each kind of work by itself.
static MeasureWork median_work(const MeasureWork runs[MEASURE_RUNS]) {
    enum { N_KINDS = sizeof(MeasureWork) / sizeof(double) };
    double of[N_KINDS], values[MEASURE_RUNS];
    for (size_t k = 0; k < N_KINDS; k++) {
        for (int i = 0; i < MEASURE_RUNS; i++) {
            memcpy(&values[i], (const char *)&runs[i] + k * sizeof(double), sizeof(double));
        }
        of[k] = median(values);
    }
    MeasureWork work;
    memcpy(&work, of, sizeof work);
    return work;
}

static void sum_up(MeasurePoint *point, const MeasureWork runs[MEASURE_RUNS]) {
    point->work = median_work(runs);
    point->least = INFINITY;
    for (int i = 0; i < MEASURE_RUNS; i++) {
        double seconds = runs[i].update + runs[i].build + runs[i].trace;
        point->least = fmin(point->least, seconds);
        point->most = fmax(point->most, seconds);
    }
}

// What the pictures of all runs say.
static bool find_errors(Measure *measure, const Image pictures[MEASURE_RUNS], MeasurePoint *point) {
    const MeasureReference *reference = &measure->reference;
    double errors[MEASURE_RUNS];
    char message[512];
    ErrorParts parts;
    for (int i = 0; i < MEASURE_RUNS; i++) {
        Comparison numbers;
        if (!compare_images(&pictures[i], &reference->mean, NULL, &numbers, message,
                            sizeof message)) {
            fprintf(stderr, "st4: error: %s: %s\n", point->arguments, message);
            return false;
        }
        errors[i] = numbers.relative_rmse;
    }
    if (!compare_parts(pictures, MEASURE_RUNS, reference->halves, reference->n, NULL, &parts,
                       message, sizeof message)) {
        fprintf(stderr, "st4: error: %s: %s\n", point->arguments, message);
        return false;
    }
    double mean = fabs(parts.mean);
    point->error = median(errors);
    point->noise = parts.noise / mean;
    double doubt = 2 * parts.bias_error;
    point->bias = parts.bias_square > doubt ? sqrt(parts.bias_square) / mean : 0;
    point->bias_most = sqrt(fmax(parts.bias_square, 0) + doubt) / mean;
    return true;
}

static void say_failed(const Measure *measure, int failure, const char *arguments) {
    char line[512] = "";
    if (failure == STATUS_LATE) {
        fprintf(stderr, "st4: warning: %s is left out: it would take too long\n", arguments);
        return;
    }
    FILE *log = fopen(measure_path(measure, "log"), "r");
    if (log && fgets(line, sizeof line, log)) {
        line[strcspn(line, "\n")] = '\0';
    }
    if (log) {
        fclose(log);
    }
    fprintf(stderr, "st4: warning: %s is left out: %s\n", arguments, line);
}

int measure_point(Measure *measure, MeasureSetting setting) {
    if (measure_known(measure, &setting)) {
        return STATUS_OK;
    }
    MeasurePoint point = {.setting = setting,
                          .arguments = measure_arguments(measure->arena, &setting)};
    MeasureWork runs[MEASURE_RUNS] = {{0}};
    Image pictures[MEASURE_RUNS];
    Arena arena = {0};
    int status = STATUS_OK;
    if (!measure->is_quiet) {
        fprintf(stderr, "st4: %4.0f s left: %s\n", measure_left(measure), point.arguments);
    }
    measure->run_limit = fmax(measure_left(measure), 10);
    for (uint32_t i = 0; i < MEASURE_RUNS && status == STATUS_OK; i++) {
        char message[512];
        status = measure_render(measure, "run", &setting, 1 + i, &runs[i]);
        const char *path = measure_path(measure, "run.exr");
        if (status == STATUS_OK &&
            !image_read_exr(&arena, path, &pictures[i], message, sizeof message)) {
            fprintf(stderr, "st4: error: %s: %s\n", path, message);
            arena_free(&arena);
            return STATUS_FILES;
        }
    }
    if (status == STATUS_OK) {
        sum_up(&point, runs);
        bool is_fine = find_errors(measure, pictures, &point) && keep(measure, &point);
        status = is_fine ? STATUS_OK : STATUS_FILES;
    } else if (status != STATUS_INTERRUPTED) {
        say_failed(measure, status, point.arguments);
        status = STATUS_OK;
        arena_free(&arena);
        return status;
    }
    if (status == STATUS_OK) {
        add(measure, point);
    }
    arena_free(&arena);
    return status;
}
