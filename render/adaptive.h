// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling: how large the noise is, and where samples go, from the samples themselves.
//
// The film is made of two halves that are independent of each other (sampler_pixel_halves), with
// the same number of samples in each pixel. The square of half their difference is an estimate
// without bias of the variance of their mean, which is the picture. The variance among a pixel's
// samples is none: they are stratified, so that their mean is better than it would tell. Samples
// count in one pixel only (render/filter.h), so errors of pixels are independent, and their squares
// add up.
//
// Every pixel gets ADAPTIVE_PILOT samples before anything is decided. Then each gets a weight by
// the noise that its surroundings have by then, and the mean number of samples of the whole
// picture, the level, rises until the picture is good enough. At each level samples are in
// proportion to weights, about as makes the mean square error least (Jerzy Neyman, On the Two
// Different Aspects of the Representative Method, 1934), but no less than the pilot and a third of
// the mean.
//
// Why that is without bias: a pixel whose own samples decided on whether it gets more of them would
// be left alone where they have missed something, and be too dark on the average. So pixels are of
// two kinds, one of each in every pair of neighbours, by chance, and the weight of a pixel is
// decided by pixels of the other kind alone: at a given level the number of its samples does not
// depend on any of them, and the mean of so many samples is right on the average. When the level is
// high enough is one decision for all pixels, in which a pixel has a say as large as its share in
// the square error of the whole picture; and the difference of the halves that decides it is
// independent of their mean as far as the noise is symmetric. A picture whose level is given
// (--noise 0 --spp) has no such decision in it.
//
// What is small and fast is found by the pilot, whose samples are spread evenly over the shutter,
// in one pixel or another around it. What the pilot has missed everywhere still gets a third of
// the samples that it would have if they were the same everywhere.
//
// All of this follows from the film, in a fixed order: neither threads nor checkpoints have a say.
#ifndef RENDER_ADAPTIVE_H
#define RENDER_ADAPTIVE_H

#include "render/film.h"

// Samples per pixel in the mean, in units of 1/64: 64 is one sample. At a level up to the pilot's
// all pixels have the same, as nearly as pairs of samples allow.
typedef uint32_t Level;
enum {
    LEVEL_SAMPLE = 64,
    ADAPTIVE_LEAST = 2,     // samples per pixel: one in each half
    ADAPTIVE_PILOT = 32,    // samples per pixel, before weights are known
    ADAPTIVE_MOST = 1 << 22 // samples of a pixel
};

// The relative RMSE of the picture against what it would be with infinitely many samples, as
// Comparison.relative_rmse: root of the mean of the estimated variances of red, green and blue,
// over their mean; and what it is taken to be at most, one standard deviation above in its square:
// where few pixels have most of the error, the estimate is itself uncertain.
typedef struct {
    double estimate, at_most;
} AdaptiveNoise;

// The film has FILM_HALVES. 0 of a black picture.
AdaptiveNoise adaptive_noise(const Film *film);

// The level from which on the noise is believed: the pilot's, in small pictures as much more as
// makes a million samples in all, but at most 16 times. What one path in 100,000 finds, such as a
// mirrored sun, is most of the error where it is, and no estimate knows of it before it is found in
// some pixel or other.
Level adaptive_believed(uint32_t width, uint32_t height);

// Decides the weights of all pixels. The film has the pilot, and nothing more.
void adaptive_weigh(Film *film);

// How many samples the pixels are to have at a level: a table over their kind and weight.
typedef struct {
    double half[2][256]; // samples of each half, before they are rounded
} Allocation;

// level >= ADAPTIVE_LEAST samples. Above the pilot's the film has its weights.
void allocation_find(Allocation *allocation, const Film *film, Level level);

// x, y: of the picture. A power of two, so that each half is spread as evenly as can be: one of the
// two next to what it should be, by chance, so that the mean over all pixels is the level. It does
// not fall where the level rises.
uint32_t allocation_count(const Allocation *allocation, const Film *film, uint32_t x, uint32_t y);

#endif
