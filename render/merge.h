// SPDX-License-Identifier: Apache-2.0
// Adding up slices: files of sums whose samples follow each other without a gap give the film that
// one run over all of them would have given, to the bit, whatever their order.
#ifndef RENDER_MERGE_H
#define RENDER_MERGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t first, last, spp; // samples first to last, from 1, of each pixel's spp
} MergedSamples;

// Reads n_parts >= 1 files of sums and writes each of outs: a picture, for which all samples have
// to be there, or a file of sums, by its ending. Nothing is written unless all parts are whole and
// belong together. Reads one part at a time: memory is that of two films. False: message has one
// sentence, with the names of the files that it is about.
bool merge_films(const char *const *parts, size_t n_parts, const char *const *outs, size_t n_outs,
                 MergedSamples *samples, char *message, size_t n);

#endif
