// SPDX-License-Identifier: Apache-2.0
// Files of exact sums, *.st4film: a film with what it was made from. Checkpoints are such files,
// and so are slices, which `st4 merge` adds up.
//
// Not EXR with the sums in its channels: EXR has no 64-bit integers, so that each sum would be two
// channels that no other program makes sense of, and no checksum over the whole; a checkpoint is
// written every minute and read perhaps once, so it is to be written at the speed of the disk.
//
// All numbers are little-endian. Strings: uint32 length, bytes. Attributes: uint32 kind
// (AttributeKind), name, string, double number, int32 numerator, uint32 denominator.
//
//     magic     8 bytes, "ST4FILM\n"
//     version   uint32, FILM_FILE_VERSION
//     length    uint32, bytes of the header that follows
//     header    uint32: layout (FILM_LAYOUT), width, height, x, y, full width, full height,
//               layers, first, n, spp, level, milliseconds, n_attributes, n_settings; attributes,
//               settings;
//               uint32: n_planes; for each plane its name and uint32 bytes of a pixel;
//               uint64: words of ids, bytes of names
//     checksum  uint32, CRC-32 of all before
//     planes    one after the other, [height][width]
//     ids       uint32 words of film_save_ids
//     names     of objects and of materials: uint32 how many; for each its number and its name
//     checksum  uint32, CRC-32 of planes, ids and names
#ifndef RENDER_FILM_FILE_H
#define RENDER_FILM_FILE_H

#include "render/film_names.h"
#include "render/render.h"

enum { FILM_FILE_VERSION = 3 };

// What a film was made from, and which samples are in it.
typedef struct {
    uint32_t width, height;           // of the film
    uint32_t x, y;                    // its corner in the picture
    uint32_t full_width, full_height; // of the picture
    uint32_t layers;                  // a set, perhaps with FILM_HALVES
    uint32_t first; // index of the first sample of each pixel; 0 is the first of all
    uint32_t n;     // samples of each pixel once it is finished
    uint32_t spp;   // of the picture that this is a part of, >= first + n
    // Of a film in halves: the level at work (render/adaptive.h), and for how long it has been
    uint32_t level, milliseconds;
    // Of one that is finished, no part of files: the noise, and what ended it; what may end it, by
    // RenderStop, as the header says it.
    double noise;
    const char *stopped;
    const char *stops[RENDER_STOPS];
    uint32_t n_attributes, n_settings;
    ImageAttribute *attributes;  // [n_attributes] of the picture's header
    ImageAttribute *settings;    // [n_settings] more of what samples and pictures depend on
    FilmNames names[N_FILM_IDS]; // of what is in the film; no part of what is compared
} FilmOrigin;

bool film_file_has_ending(const char *path);

// Where path is one; what cannot be read is none.
bool film_file_is(const char *path);

// As image.h: false with one sentence in message[n], without the file's name; there whole or not
// at all.
bool film_file_write(const char *path, const Film *film, const FilmOrigin *origin, char *message,
                     size_t n);

// What the file says of itself, but for names; its size and the header's checksum are right then.
bool film_file_read_origin(Arena *arena, const char *path, FilmOrigin *origin, char *message,
                           size_t n);

// With the sums, into film, which is initialised here from the arena. Nothing is believed before
// both checksums are found to be right.
bool film_file_read(Arena *arena, const char *path, Film *film, FilmOrigin *origin, char *message,
                    size_t n);

// "10,30,20,48 of 64x48", as --crop has it; NULL: the whole picture.
const char *film_origin_crop(Arena *arena, const FilmOrigin *origin);

// "z,normal", as --aov has it.
const char *film_origin_layers(Arena *arena, const FilmOrigin *origin);

// What differs, as text.
typedef struct {
    const char *name, *a, *b;
} FilmDifference;

// Whether both are of the same samples: size, crop, layers, attributes (but for those of the run,
// such as "command", which say nothing of a sample) and settings. False: the first difference, from
// the arena.
bool film_origin_agrees(Arena *arena, const FilmOrigin *a, const FilmOrigin *b,
                        FilmDifference *difference);

// The same of lists of attributes; with is_strict those of the run count as well.
bool film_attributes_agree(Arena *arena, const ImageAttribute *a, uint32_t n_a,
                           const ImageAttribute *b, uint32_t n_b, bool is_strict,
                           FilmDifference *difference);

#endif
