// SPDX-License-Identifier: Apache-2.0
// The film: sums of samples, exact, so that they do not depend on the order of adding.
//
// Colour and coverage are summed in 64-bit fixed point, in units of 2^-28 (3.7e-9): a sample is
// rounded once, to the nearest unit, and sums are exact up to 2^35 = 3.4e10, where they stay (4096
// samples of 8 million each). All sums are of numbers >= 0, so that even this bound keeps the order
// out. The filter is in where samples are placed (render/filter.h): each counts in one pixel,
// fully. Depth and normal come from the one sample nearest the shutter's middle.
#ifndef RENDER_FILM_H
#define RENDER_FILM_H

#include "accel/vec.h"
#include "render/image.h"

typedef struct {
    double color[3]; // linear, >= 0
    double alpha;    // coverage, [0, 1]; color is premultiplied by it
    double depth;    // metres along the camera's axis; INFINITY: nothing there
    Vec3 normal;     // world, unit length, towards the viewer; 0 0 0: nothing there
} FilmSample;

typedef struct {
    int64_t sum[4];
    uint64_t rank; // of the sample that gave depth and normal: the least wins
    uint32_t n;
    float depth, normal[3];
} FilmPixel;

typedef struct {
    uint32_t width, height;
    FilmPixel *pixels; // [height][width], first row on top
} Film;

// width, height >= 1; cleared.
void film_init(Film *film, Arena *arena, uint32_t width, uint32_t height);
void film_clear(Film *film);

// u: the sample's place in the shutter, [0, 1]; index: of the sample in its pixel, each added once.
// A colour or alpha that is not finite counts as black and transparent: false. One thread at a time
// for each pixel.
bool film_add(Film *film, uint32_t x, uint32_t y, const FilmSample *sample, double u,
              uint32_t index);

// Channels R G B A Z normal.X normal.Y normal.Z samples, from the arena; n_attributes is 0. Pixels
// without samples are 0.
void film_image(const Film *film, Arena *arena, Image *image);

// ---- The state of a film, for files of sums (render/film_file.h) and for passes over it.
//
// A pixel takes its samples in the order of their indices, so its count says which one is next:
// the arrays are all there is to keep of a frame that is not finished.

// One of the film's arrays: [height][width] of `size` bytes, little-endian, without pointers.
typedef struct {
    const char *name;
    void *data;
    size_t size;
} FilmPlane;

// To be raised with each change of what the arrays hold, so that files of before are told apart.
enum { FILM_LAYOUT = 1, FILM_MAX_PLANES = 16 };

// All arrays of the film, into planes; returns how many.
uint32_t film_planes(const Film *film, FilmPlane planes[FILM_MAX_PLANES]);

// How many samples a pixel has.
uint32_t film_count(const Film *film, uint32_t x, uint32_t y);

// Adds other samples of the same size of film, exactly: the result is that of one film that was
// given them all.
void film_merge(Film *film, const Film *more);

#endif
