// SPDX-License-Identifier: Apache-2.0
// EXR files: the streams and the bounded allocator behind OpenEXRCore.
#include "render/exr.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// No single buffer of the library passes this: the largest chunk of an honest file, 256 lines of
// 65,536 pixels in 16 channels, does not.
static const size_t buffer_limit = (size_t)1 << 30;

void exr_stream_complain(ExrStream *stream, const char *sentence) {
#pragma omp critical(exr_message)
    if (!stream->message[0]) {
        snprintf(stream->message, stream->n, "%s", sentence);
    }
}

static void on_error(exr_const_context_t context, exr_result_t code, const char *sentence) {
    void *stream = NULL;
    if (context && exr_get_user_data(context, &stream) == EXR_ERR_SUCCESS && stream) {
        exr_stream_complain(stream, sentence ? sentence : exr_get_default_error_message(code));
    }
}

static void *bounded_calloc(size_t size) {
    return size > buffer_limit ? NULL : calloc(1, size ? size : 1);
}

static int64_t stream_size(exr_const_context_t context, void *user) {
    (void)context;
    return ((ExrStream *)user)->size;
}

static int64_t stream_read(exr_const_context_t context, void *user, void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t report) {
    (void)context;
    (void)report;
    ExrStream *stream = user;
    uint64_t done = 0;
    while (done < size) {
        ssize_t got = pread(stream->fd, (char *)buffer + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            exr_stream_complain(stream, strerror(errno));
            return -1;
        }
        if (got == 0) {
            break;
        }
        done += (uint64_t)got;
    }
    return (int64_t)done;
}

static int64_t stream_write(exr_const_context_t context, void *user, const void *buffer,
                            uint64_t size, uint64_t offset, exr_stream_error_func_ptr_t report) {
    (void)context;
    (void)report;
    ExrStream *stream = user;
    uint64_t done = 0;
    while (done < size) {
        ssize_t put =
            pwrite(stream->fd, (const char *)buffer + done, size - done, (off_t)(offset + done));
        if (put < 0 && errno == EINTR) {
            continue;
        }
        if (put <= 0) {
            exr_stream_complain(stream, put < 0 ? strerror(errno) : "nothing could be written");
            return -1;
        }
        done += (uint64_t)put;
    }
    return (int64_t)done;
}

exr_context_initializer_t exr_stream_initializer(ExrStream *stream) {
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = on_error;
    init.alloc_fn = bounded_calloc;
    init.free_fn = free;
    init.user_data = stream;
    init.read_fn = stream_read;
    init.size_fn = stream_size;
    init.write_fn = stream_write;
    init.max_image_width = EXR_SIDE_LIMIT;
    init.max_image_height = EXR_SIDE_LIMIT;
    init.max_tile_width = EXR_SIDE_LIMIT;
    init.max_tile_height = EXR_SIDE_LIMIT;
    init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    return init;
}
