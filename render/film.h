// SPDX-License-Identifier: Apache-2.0
// The film: sums of samples, exact, so that they do not depend on the order of adding.
//
// Colour and coverage are summed in 64-bit fixed point, in units of 2^-28 (3.7e-9): a sample is
// rounded once, to the nearest unit, and sums are exact up to 2^35 = 3.4e10, where they stay (4096
// samples of 8 million each). All sums are of numbers >= 0, so that even this bound keeps the order
// out; squares are summed in 128 bits; times, which have signs, are bounded so that 2^24 samples
// can not overflow. Objects and materials are counted, all of them: none is left out for another.
//
// The filter is in where samples are placed (render/filter.h): each counts in one pixel, fully.
// Depth, normal, position and motion come from one sample: among those within the pixel's square
// the one nearest the shutter's middle, of several the one nearest the pixel's centre.
//
// A layer that is not asked for takes no memory and no time.
#ifndef RENDER_FILM_H
#define RENDER_FILM_H

#include "accel/vec.h"
#include "render/image.h"
#include "render/scene.h"

#define FILM_UNITS      0x1p28
#define FILM_TIME_UNITS 0x1p19

typedef struct {
    double color[3]; // linear, >= 0
    double alpha;    // coverage, [0, 1]; color is premultiplied by it
    double u;        // its place in the shutter, [0, 1]
    double dx, dy;   // from its pixel's centre, pixels
    uint32_t index;  // in its pixel, below 2^24, each added once
    bool is_hit;     // it met a surface: what follows belongs to that, else is 0
    uint32_t object, material;
    double depth;     // metres along the camera's axis; INFINITY: nothing there
    Vec3 normal;      // world, unit length, towards the viewer
    Vec3 position;    // world, metres
    double albedo[3]; // [0, 1]
    double motion[2]; // pixels per frame period, x right, y down; also of what is not hit
    double film_time; // frame periods since the frame's beginning
} FilmSample;

enum { FILM_IDS = 6, N_FILM_IDS = 2 };

// Of a set of layers: the film is one of two halves, for adaptive sampling (render/adaptive.h).
enum { FILM_HALVES = 1 << LAYER_COUNT };

// How often things were seen in a pixel, in the order of their first sample.
typedef struct FilmIds FilmIds;
struct FilmIds {
    uint32_t id[FILM_IDS], n[FILM_IDS]; // n: 0 from the first free place on
    FilmIds *more;
};

// Arrays are [height][width], first row on top; NULL where no layer needs them.
typedef struct {
    uint32_t width, height;
    uint32_t x, y;   // its corner within the picture: pixels are named by their place in that
    uint32_t layers; // a set, perhaps with FILM_HALVES
    int64_t (*sum)[4];
    uint32_t *n;    // samples
    uint64_t *rank; // of the sample that gave what comes from one: the least wins
    float *depth;
    float (*normal)[3], (*position)[3], (*motion)[2];
    int64_t (*albedo)[3];
    uint64_t (*square)[3][2]; // sums of squares of the colour, low and high half
    int64_t *time;
    uint32_t *n_hits;         // summands of time
    int64_t (*half)[3];       // of sum, the colour of the samples with even index
    uint8_t *weight;          // how many samples a pixel is to get; 0: not known yet
    FilmIds *ids[N_FILM_IDS]; // of LAYER_OBJECT, LAYER_MATERIAL
    Arena *arena;
    FilmIds *spare;
} Film;

// layers: a set, perhaps with FILM_HALVES; width, height >= 1; cleared. Its corner is that of the
// picture; x and y may be set to another one. The arena is used by film_add too, under a lock.
void film_init(Film *film, Arena *arena, uint32_t layers, uint32_t width, uint32_t height);
void film_clear(Film *film);

// x, y: of the picture; the film holds them. A colour, alpha or albedo that is not finite counts as
// black and transparent: false. One thread at a time for each pixel.
bool film_add(Film *film, uint32_t x, uint32_t y, const FilmSample *sample);

typedef struct {
    uint32_t id, n;
} FilmCount;
// Room that is used again from pixel to pixel; zero at first.
typedef struct {
    FilmCount *counts;
    size_t capacity;
} FilmCounts;

// What is seen in a pixel, by falling counts, at equal ones by rising id; returns how many. layer:
// LAYER_OBJECT or LAYER_MATERIAL. The room grows in the arena.
uint32_t film_counts(const Film *film, Layer layer, size_t pixel, Arena *arena, FilmCounts *out);

// Channels R G B A and those of the layers but objects and materials, from the arena;
// n_attributes is 0. Pixels without samples are 0.
void film_image(const Film *film, Arena *arena, Image *image);

// ---- The state of a film, for files of sums (render/film_file.h) and for passes over it.
//
// A pixel takes its samples in the order of their indices, so its count says which one is next:
// the arrays and the ids are all there is to keep of a frame that is not finished.

// One of the film's arrays: [height][width] of `size` bytes, little-endian, without pointers.
typedef struct {
    const char *name;
    void *data;
    size_t size;
} FilmPlane;

// To be raised with each change of what the arrays hold, so that files of before are told apart.
enum { FILM_LAYOUT = 2, FILM_MAX_PLANES = 16 };

// All arrays of the film but the ids, into planes; returns how many.
uint32_t film_planes(const Film *film, FilmPlane planes[FILM_MAX_PLANES]);

// The ids, from the arena: of objects and then of materials, where the film has them, for each
// pixel how many there are and, in the order of film_counts, each with its count. *n: words.
uint32_t *film_save_ids(const Film *film, Arena *arena, size_t *n);
// The reverse, into a film that has none yet: false where the words are not of such a film.
bool film_restore_ids(Film *film, const uint32_t *words, size_t n);

// How many samples a pixel has; x, y: of the picture.
uint32_t film_count(const Film *film, uint32_t x, uint32_t y);

typedef struct {
    uint32_t least, most; // samples of a pixel
    uint64_t total;       // samples of all pixels
} FilmTotals;

FilmTotals film_totals(const Film *film);

// Adds other samples of a film of the same size and layers, exactly: the result is that of one film
// that was given them all.
void film_merge(Film *film, const Film *more);

#endif
