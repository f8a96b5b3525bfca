// SPDX-License-Identifier: Apache-2.0
// The files of a run: that they can be written, and what their headers say.
#ifndef RENDER_OUTPUT_H
#define RENDER_OUTPUT_H

#include "render/film_file.h"
#include "render/render.h"

enum { OUTPUT_PATH_SIZE = 4096, OUTPUT_MESSAGE_SIZE = 512 };

// Checks every path before the first ray. On failure: false, one error through the reporter.
bool output_check(const RenderOptions *options, const Reporter *reporter);

// Whether a picture or a file of sums can be expected to be written there. False: a sentence.
bool output_check_path(const char *path, char *message, size_t n);

// The path of one frame's picture. On failure as above.
bool output_path(const RenderOptions *options, int64_t frame, const Reporter *reporter,
                 char path[OUTPUT_PATH_SIZE]);

// Says how a frame is made: nothing in it depends on the time of day, the threads or the other
// frames. From the arena; strings of the scene and the options are borrowed.
void output_describe(const Scene *scene, const RenderOptions *options, int64_t frame, Arena *arena,
                     FilmOrigin *origin);

// Whether the file under path is what would be written there, by what it says of itself. A picture
// of 8 bits says nothing.
bool output_is_made(const char *path, const FilmOrigin *origin);

// Writes the film by the path's ending: its sums, or a picture, whose header is the origin's
// attributes, "command" and "samples" with the number of samples; the origin has the names of what
// is in the film. A picture takes a film whose
// samples begin with the first. On failure: false, one sentence in message[n].
bool output_write(const char *path, const Film *film, const FilmOrigin *origin, char *message,
                  size_t n);

#endif
