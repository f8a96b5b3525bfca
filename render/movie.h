// SPDX-License-Identifier: Apache-2.0
// Movies from rendered pictures, by the program `ffmpeg`, which is started with an argument vector
// and gets raw frames on a pipe. It writes a temporary file, which takes its name when it is whole.
#ifndef RENDER_MOVIE_H
#define RENDER_MOVIE_H

#include "render/render.h"

// Whether a movie can be made under this name: its ending is known, ffmpeg is found in $PATH, the
// folder takes files. To be asked before hours of rendering. False: one sentence in message[n].
bool movie_check(const char *path, char *message, size_t n);

// Makes a movie of the options' frames, in their order, from the EXR files of the pattern
// options->out, at the film's frames per second, by its view and exposure; on black where it is
// transparent. Sides of odd length get their last line or column twice, as video wants even ones.
// Returns an exit status: 0 fine; 3 with a sentence in message[n]; 130 interrupted. Nothing is left
// under the name then that was not there before.
int movie_make(const char *path, const Scene *scene, const RenderOptions *options, char *message,
               size_t n);

#endif
