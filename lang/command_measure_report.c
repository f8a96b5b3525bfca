// SPDX-License-Identifier: Apache-2.0
// st4 measure: the summary on the terminal, and the files.
#include "lang/command_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "lang/json.h"
#include "render/outfile.h"

static const double errors[] = {0.01, 0.03, 0.10};
static const double times[] = {10, 60, 600};

static const MeasurePoint *find_default(const Measure *measure) {
    for (size_t i = 0; i < measure->n_points; i++) {
        if (measure->points[i].is_default) {
            return &measure->points[i];
        }
    }
    return NULL;
}

// Of those that beat it, the closest; NULL: none.
static const MeasurePoint *find_better(const Measure *measure, const MeasurePoint *than) {
    const MeasurePoint *best = NULL;
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        if (measure_beats(p, than) && (!best || p->error < best->error)) {
            best = p;
        }
    }
    return best;
}

static int by_seconds(const void *a, const void *b) {
    double x = measure_seconds(a), y = measure_seconds(b);
    return (x > y) - (x < y);
}

// ---- The terminal

// "1.2", or "<0.5" where nothing was found.
static void print_bias(const MeasurePoint *p) {
    char text[32];
    snprintf(text, sizeof text, p->bias > 0 ? "%.3f" : "<%.3f",
             100 * (p->bias > 0 ? p->bias : p->bias_most));
    printf(" %9s", text);
}

static void print_point(const MeasurePoint *p) {
    double seconds = measure_seconds(p);
    printf("%9.3f %6.1f %8.3f %8.3f", seconds, 50 * (p->most - p->least) / fmax(seconds, 1e-9),
           100 * p->error, 100 * p->noise);
    print_bias(p);
    printf("  %s%s\n", p->arguments, p->is_default ? "   (the default)" : "");
}

static void print_advice(const Measure *measure, const char *goal, const MeasureAdvice *advice) {
    if (!advice->base) {
        printf("  %-9s none of what was measured comes there\n", goal);
        return;
    }
    const char *arguments = measure_advice_arguments(measure->arena, advice);
    printf("  %-9s %s\n            %s%.3g s, %.3g %%\n", goal, measure_command(measure, arguments),
           advice->is_measured ? "measured: " : "reckoned: about ", advice->seconds,
           100 * advice->error);
}

static void print_reference(const Measure *measure) {
    const MeasureReference *r = &measure->reference;
    if (r->spp) {
        printf("Reference: %u samples per pixel in two halves, %.1f s; its own noise is %.3g %%.\n",
               r->spp, r->seconds, 100 * r->noise);
    } else if (r->n == 2) {
        printf("Reference: the mean of %s and %s; its own noise is %.3g %%.\n", r->paths[0],
               r->paths[1], 100 * r->noise);
    } else {
        printf("Reference: %s; one picture does not tell its own error.\n", r->paths[0]);
    }
    if (r->noise > 0.01) {
        printf("That is much: errors below it are not known. A larger --budget makes a better "
               "one.\n");
    }
}

static void print_default(const Measure *measure) {
    const MeasurePoint *p = find_default(measure);
    if (!p) {
        return;
    }
    printf("\nThe defaults (%s): %.3g s, error %.3g %%.\n", p->arguments, measure_seconds(p),
           100 * p->error);
    const MeasurePoint *better = find_better(measure, p);
    if (better) {
        printf("They are not on the front: %s takes %.3g s, error %.3g %%.\n", better->arguments,
               measure_seconds(better), 100 * better->error);
    } else {
        printf("They are on the front: nothing that was measured is both faster and closer.\n");
    }
}

void measure_print(Measure *measure) {
    char goal[32];
    printf("%s, frame %lld, %ux%u pixels, %u threads; %zu settings, each run %d times\n",
           measure->scene, (long long)measure->frame, measure->width, measure->height,
           measure->n_threads, measure->n_points, MEASURE_RUNS);
    print_reference(measure);
    printf("\nThe front: nothing that was measured is both faster and closer.\n");
    printf("%9s %6s %8s %8s %9s  %s\n", "seconds", "+-%", "error %", "noise %", "bias %",
           "settings");
    for (size_t i = 0; i < measure->n_points; i++) {
        if (measure->points[i].is_on_front) {
            print_point(&measure->points[i]);
        }
    }
    print_default(measure);
    printf("\nBest for an error, or for a time, of this frame at this size:\n");
    for (size_t i = 0; i < sizeof errors / sizeof *errors; i++) {
        MeasureAdvice advice = measure_for_error(measure, errors[i]);
        snprintf(goal, sizeof goal, "%g %%:", 100 * errors[i]);
        print_advice(measure, goal, &advice);
    }
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        MeasureAdvice advice = measure_for_seconds(measure, times[i]);
        snprintf(goal, sizeof goal,
                 times[i] < 60 ? "%g s:" : "%g min:", times[i] < 60 ? times[i] : times[i] / 60);
        print_advice(measure, goal, &advice);
    }
    printf("\nThe report is %s/report.html; numbers are in results.csv and results.json there.\n",
           measure->folder);
}

// ---- Files

static void put_number(FILE *out, const char *name, double value) {
    fprintf(out, ", \"%s\": ", name);
    json_number(out, value);
}

static void put_advice(FILE *out, const Measure *measure, const char *kind, double goal,
                       const MeasureAdvice *advice) {
    fprintf(out, "    {\"%s\": %g, \"arguments\": ", kind, goal);
    if (!advice->base) {
        fprintf(out, "null}");
        return;
    }
    json_string(out, measure_advice_arguments(measure->arena, advice));
    put_number(out, "seconds", advice->seconds);
    put_number(out, "error", advice->error);
    fprintf(out, ", \"measured\": %s}", advice->is_measured ? "true" : "false");
}

static void put_point(FILE *out, const MeasurePoint *p) {
    const MeasureSetting *s = &p->setting;
    fprintf(out, "    {\"arguments\": ");
    json_string(out, p->arguments);
    fprintf(out, ", \"spp\": %u, \"subframes\": %u", s->spp, s->subframes);
    put_number(out, "update_seconds", p->work.update);
    put_number(out, "build_seconds", p->work.build);
    put_number(out, "trace_seconds", p->work.trace);
    put_number(out, "cpu_seconds", p->work.cpu);
    put_number(out, "least_seconds", p->least);
    put_number(out, "most_seconds", p->most);
    put_number(out, "vertex_bytes", p->work.vertex_bytes);
    put_number(out, "tree_bytes", p->work.tree_bytes);
    put_number(out, "rays", p->work.rays);
    put_number(out, "relative_rmse", p->error);
    put_number(out, "noise", p->noise);
    put_number(out, s->subframes ? "strobing" : "representation", p->bias);
    put_number(out, "bias_at_most", p->bias_most);
    fprintf(out, ", \"default\": %s, \"front\": %s}", p->is_default ? "true" : "false",
            p->is_on_front ? "true" : "false");
}

static void write_json(const Measure *measure, FILE *out) {
    fprintf(out, "{\n  \"version\": 1,\n  \"scene\": ");
    json_string(out, measure->scene);
    fprintf(out, ",\n  \"frame\": %lld, \"width\": %u, \"height\": %u, \"threads\": %u,\n",
            (long long)measure->frame, measure->width, measure->height, measure->n_threads);
    fprintf(out, "  \"reference\": {\"spp\": %u", measure->reference.spp);
    put_number(out, "seconds", measure->reference.seconds);
    put_number(out, "noise", measure->reference.noise);
    fprintf(out, "},\n  \"points\": [\n");
    for (size_t i = 0; i < measure->n_points; i++) {
        put_point(out, &measure->points[i]);
        fputs(i + 1 < measure->n_points ? ",\n" : "\n", out);
    }
    fprintf(out, "  ],\n  \"best\": [\n");
    for (size_t i = 0; i < sizeof errors / sizeof *errors; i++) {
        MeasureAdvice advice = measure_for_error(measure, errors[i]);
        put_advice(out, measure, "for_error", errors[i], &advice);
        fputs(",\n", out);
    }
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        MeasureAdvice advice = measure_for_seconds(measure, times[i]);
        put_advice(out, measure, "for_seconds", times[i], &advice);
        fputs(i + 1 < sizeof times / sizeof *times ? ",\n" : "\n", out);
    }
    fprintf(out, "  ]\n}\n");
}

static int write_file(const Measure *measure, const char *name,
                      void (*put)(const Measure *, FILE *)) {
    const char *path = measure_path(measure, name);
    char message[256];
    OutFile file;
    if (!outfile_open(&file, path, message, sizeof message)) {
        fprintf(stderr, "st4: error: %s: %s\n", path, message);
        return STATUS_FILES;
    }
    FILE *out = fdopen(dup(file.fd), "w");
    bool is_written = out != NULL;
    if (out) {
        put(measure, out);
        is_written = !ferror(out);
        is_written &= fclose(out) == 0;
    }
    if (!is_written) {
        perror(path);
        outfile_abandon(&file);
    } else if (!outfile_commit(&file, message, sizeof message)) {
        fprintf(stderr, "st4: error: %s: %s\n", path, message);
        is_written = false;
    }
    return is_written ? STATUS_OK : STATUS_FILES;
}

int measure_write(Measure *measure) {
    qsort(measure->points, measure->n_points, sizeof *measure->points, by_seconds);
    int status = write_file(measure, "results.json", write_json);
    return status ? status : write_file(measure, "report.html", measure_write_html);
}
