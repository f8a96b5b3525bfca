// SPDX-License-Identifier: Apache-2.0
// What the parts of st4 compare share: the numbers of one layer of one pair of pictures, and the
// pictures of a film.
#ifndef LANG_COMMAND_COMPARE_H
#define LANG_COMMAND_COMPARE_H

#include "lang/command.h"
#include "render/compare.h"

// In the order of --metric's words.
typedef enum {
    METRIC_MSE,
    METRIC_RMSE,
    METRIC_RELMSE,
    METRIC_PSNR,
    METRIC_MAX,
    METRIC_RELRMSE,
    METRIC_SSIM,
    METRIC_FLIP,
    METRIC_HDRFLIP,
    METRIC_FLICKER
} Metric;

typedef struct {
    int64_t frame; // of a film
    const char *a_path, *b_path;
    const char *layer; // "": R, G, B
    Comparison numbers;
    Perceived seen;       // NaN: not there
    const char *not_seen; // why, else NULL
    double change;        // of the error since the frame before; NaN: the first, or no film
} CompareRecord;

typedef struct {
    bool is_film;
    Flicker flicker; // of the film's layer, deviation NaN where there is none
    CompareRecord *records;
    size_t n_records;
} CompareReport;

// NaN where the record does not have it.
double compare_metric(const CompareReport *report, const CompareRecord *record, Metric metric);

void compare_print_text(const CompareReport *report);
void compare_print_json(const CompareReport *report, const char *a, const char *b);

// Whether the name stands for many, by a run of # or %04d.
bool compare_is_pattern(const char *path);

// Numbers of the frames that both patterns have files for, ascending, in the arena. NULL with one
// sentence in message[n]: there are none, a frame has but one picture, or no folder can be read.
const int64_t *compare_find_frames(Arena *arena, const char *a, const char *b, size_t *n_frames,
                                   char *message, size_t n);

#endif
