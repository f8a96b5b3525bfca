// SPDX-License-Identifier: Apache-2.0
// From programs to the texture system.
#include "render/texture.h"

#include <math.h>
#include <string.h>

#include "render/image_oiio.h"
#include "render/plugin.h"

#define LIBRARY "st4-image.so"

typedef struct {
    ProgramImage image; // first: programs hand it back
    const ImageOiio *library;
    ImageOiioTexture *file;
} Texture;

// Set while the scene is loaded; NULL: it has no textures.
static const ImageOiio *used_library;

// The last look-up of a thread: the channels of a color follow each other.
static _Thread_local struct {
    const ProgramImage *image;
    float at[6], rgba[4];
} latest;

static void look_up(const ProgramImage *image, const double st[2], const double dx[2],
                    const double dy[2], float rgba[4]) {
    const Texture *texture = (const Texture *)image;
    // Repeated in double: a float has no digits left far from 0.
    const float at[6] = {(float)(st[0] - floor(st[0])),
                         (float)(st[1] - floor(st[1])),
                         (float)dx[0],
                         (float)dx[1],
                         (float)dy[0],
                         (float)dy[1]};
    if (latest.image != image || memcmp(latest.at, at, sizeof at) != 0) {
        texture->library->look_up(texture->file, at, latest.rgba);
        for (int c = 0; c < 4; c++) {
            latest.rgba[c] = isfinite(latest.rgba[c]) ? latest.rgba[c] : 0;
        }
        latest.image = image;
        memcpy(latest.at, at, sizeof at);
    }
    memcpy(rgba, latest.rgba, sizeof latest.rgba);
}

const ProgramImage *texture_open(Arena *arena, const char *path, bool is_raw, char *message,
                                 size_t n) {
    const ImageOiio *library = plugin_symbol(LIBRARY, "image_oiio", message, n);
    ImageOiioTexture *file = library ? library->open_texture(path, is_raw, message, n) : NULL;
    if (!file) {
        return NULL;
    }
    used_library = library;
    Texture *texture = ARENA_NEW(arena, Texture);
    *texture = (Texture){{look_up}, library, file};
    return &texture->image;
}

void texture_set_memory(size_t bytes) {
    if (used_library) {
        used_library->set_texture_memory(bytes);
    }
}
