// SPDX-License-Identifier: Apache-2.0
// What reading and writing EXR share: the stream and allocator that OpenEXRCore gets to see, so
// that its messages end in the caller's sentence, and a hostile header cannot make it take all
// memory.
#ifndef RENDER_EXR_H
#define RENDER_EXR_H

#include <OpenEXR/openexr.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { EXR_SIDE_LIMIT = 65536, EXR_CHANNEL_LIMIT = 1024, EXR_NAME_LIMIT = 255 };

// The library's callbacks get this as their user data.
typedef struct {
    int fd;
    int64_t size; // of the file that is read
    char *message;
    size_t n;
    bool is_refusal; // message is a whole sentence, not a detail of the library's
} ExrStream;

// An image on its way, channels in the file's order (sorted by name).
typedef struct {
    uint32_t width, height;
    uint32_t x, y; // when reading: where the present chunk begins
    int32_t first; // when writing: number of the first line
    float *values[EXR_CHANNEL_LIMIT];
} ExrPlanes;

// For exr_start_read and exr_start_write.
exr_context_initializer_t exr_stream_initializer(ExrStream *stream);

// Only the first complaint about a stream is kept: later ones follow from it. From any thread.
void exr_stream_complain(ExrStream *stream, const char *sentence);

#endif
