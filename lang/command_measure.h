// SPDX-License-Identifier: Apache-2.0
// st4 measure: what its parts share. Each setting is rendered by this program itself, in a process
// of its own, so that one that runs out of memory costs one line of the table; several times with
// different seeds, so that times have a spread and errors can be split (render/compare.h). man page
// st4-measure(7) describes the method.
#ifndef LANG_COMMAND_MEASURE_H
#define LANG_COMMAND_MEASURE_H

#include "lang/command.h"
#include "render/compare.h"

enum { MEASURE_RUNS = 3, STATUS_LATE = 100 };

// The knobs. 0, NULL: as without the option.
typedef struct {
    uint32_t spp, subframes, leaf_size;
    double tolerance, kappa;
    const char *accel, *cpu;
} MeasureSetting;

// One run's work, seconds by the clock but for cpu.
typedef struct {
    double update, build, trace, cpu; // sampling of vertices; segments and structure; rays; all
    double vertex_bytes, tree_bytes, rays;
} MeasureWork;

// A setting that was measured. Errors are relative to the reference's mean.
typedef struct {
    MeasureSetting setting;
    const char *arguments; // as on a command line
    MeasureWork work;      // medians
    double least, most;    // seconds of update, build and trace together
    double error;          // median relative RMSE, as st4 compare prints it
    double noise, bias;    // its parts; bias 0: less than two standard errors from nothing
    double bias_most;      // two standard errors above the estimate
    bool is_default, is_on_front;
} MeasurePoint;

typedef struct {
    const char *paths[2];
    uint32_t n;
    Image halves[2], mean;
    double noise; // relative, of the mean of the halves; NaN: one file alone, not known
    uint32_t spp; // of both halves; 0: given
    double seconds;
} MeasureReference;

typedef struct {
    Arena *arena;
    const Options *options;
    const char *scene, *folder;
    const char *fingerprint; // of all that the results depend on, beside the knobs
    int64_t frame;
    uint32_t width, height, n_threads, spp; // spp: the default
    bool moves;                             // and blurs
    double budget, start;                   // seconds
    double run_limit;                       // seconds that a run may take; 0: as long as it likes
    bool is_quiet;
    MeasureReference reference;
    MeasurePoint *points;
    size_t n_points, capacity;
} Measure;

static inline double measure_seconds(const MeasurePoint *point) {
    return point->work.update + point->work.build + point->work.trace;
}

double measure_left(const Measure *measure); // of the budget, seconds

// "-s 16 --accel kd3", in the arena.
const char *measure_arguments(Arena *arena, const MeasureSetting *setting);

// The whole command, to be pasted into a shell: with what measure was told of the scene.
const char *measure_command(const Measure *measure, const char *arguments);

// Renders the measured frame to folder/name.exr. An exit status; what the renderer said is in
// folder/log then. 130: interrupted; STATUS_LATE: it took longer than run_limit.
int measure_render(Measure *measure, const char *name, const MeasureSetting *setting, uint64_t seed,
                   MeasureWork *work);
const char *measure_path(const Measure *measure, const char *name); // folder/name

// Makes, takes or finds again the reference. An exit status.
int measure_find_reference(Measure *measure);

// Measures a setting unless it was already; the point joins the measure's. An exit status: one that
// could not be rendered is told and left out.
int measure_point(Measure *measure, MeasureSetting setting);
MeasurePoint *measure_known(const Measure *measure, const MeasureSetting *setting); // NULL: not yet
// Reads what an earlier call left in folder/results.csv.
void measure_resume(Measure *measure);

// Turns the knobs until the budget is spent. An exit status.
int measure_turn_knobs(Measure *measure);

// Whether a is closer than b and no slower, or no farther and faster beyond the spread of both.
bool measure_beats(const MeasurePoint *a, const MeasurePoint *b);
// Marks the points that no other beats.
void measure_mark_front(Measure *measure);

// The settings that reach an error, or that are best in a time, with as many samples as it takes.
typedef struct {
    const MeasurePoint *base; // NULL: none reaches it
    uint32_t spp;
    double seconds, error;
    bool is_measured; // else reckoned from base: seconds by samples, noise by its measured decline
} MeasureAdvice;
MeasureAdvice measure_for_error(const Measure *measure, double error);
MeasureAdvice measure_for_seconds(const Measure *measure, double seconds);
const char *measure_advice_arguments(Arena *arena, const MeasureAdvice *advice);

// results.csv, results.json and report.html in the folder; an exit status.
int measure_write(Measure *measure);
void measure_print(Measure *measure);
void measure_write_html(const Measure *measure, FILE *out);

#endif
