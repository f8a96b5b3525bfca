// SPDX-License-Identifier: Apache-2.0
// Sample points: a pure function of (seed, frame, pixel, index, set), in any order, without state.
//
// Points come in sets of four dimensions. Each set is the Sobol sequence (directions of Joe and
// Kuo, "Constructing Sobol sequences with better two-dimensional projections", 2008),
// Owen-scrambled in base 2 by hashing, with a shuffled index and scrambles of its own for each
// pixel, frame and set (Burley, "Practical hash-based Owen scrambling", JCGT 2020; the mixing
// constants are those of Vegdahl, "Building a better LK hash", 2021).
//
// So within a set the first 2^k samples of a pixel are stratified: dimensions 0 and 1 are a
// (0,k,2)-net, and each single dimension puts one sample into each of 2^k equal intervals. Between
// sets they are independent. Dimensions of the first set have fixed uses: x and y in the pixel and
// time; it is the one in which pixel and time are stratified together.
#ifndef RENDER_SAMPLER_H
#define RENDER_SAMPLER_H

#include <stdbool.h>
#include <stdint.h>

enum { SAMPLE_X, SAMPLE_Y, SAMPLE_TIME, SAMPLE_FREE, SAMPLE_DIMENSIONS };

// The sets of a path: the first, then for each bounce one for the choice of lobe and direction, and
// one for each light. Those from SAMPLE_SET_CHANCE on decide what surfaces are, one after the
// other; far behind them is that of the lens.
enum {
    SAMPLE_SET_PIXEL = 0,
    SAMPLE_SET_PATH = 1,
    SAMPLE_SET_CHANCE = 1 << 30,
    SAMPLE_SET_LENS = INT32_MAX
};

// Where a pixel is in the space of all random numbers.
typedef struct {
    uint64_t key[2];
    uint32_t n_halves; // 1: the first key has all samples; 2: it has the even, the second the odd
} Sampler;

// x, y: the pixel, from the picture's corner (not the crop's). With freeze the frame's number has
// no say, and the noise stands still over the film.
Sampler sampler_pixel(uint64_t seed, bool freeze, int64_t frame, uint32_t x, uint32_t y);

// The same in two halves that are independent of each other, each a sequence as above: samples 0,
// 2, 4... are the samples 0, 1, 2... of sampler_pixel, samples 1, 3, 5... are others.
Sampler sampler_pixel_halves(uint64_t seed, bool freeze, int64_t frame, uint32_t x, uint32_t y);

// Sample `index` of a set. Each value in (0, 1): never 0, never 1, a multiple of 2^-33.
void sampler_draw(const Sampler *sampler, uint32_t index, uint32_t set,
                  double out[SAMPLE_DIMENSIONS]);

#endif
