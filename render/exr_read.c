// SPDX-License-Identifier: Apache-2.0
// Reading EXR by OpenEXRCore: the first part of any file that is not deep, scan lines or tiles (the
// finest level). Nothing that the header says is believed before it is checked.
#include "render/image.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/exr.h"
#include "render/half.h"

static const uint64_t image_limit = (uint64_t)1 << 34;

static uint32_t get_16(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8;
}

static uint32_t get_32(const uint8_t *at) {
    return get_16(at) | get_16(at + 2) << 16;
}

static const uint8_t *unpack_values(const uint8_t *at, uint16_t type, int32_t n, float *values) {
    for (int32_t x = 0; x < n; x++) {
        if (type == EXR_PIXEL_HALF) {
            values[x] = half_to_float((uint16_t)get_16(at));
            at += 2;
            continue;
        }
        uint32_t bits = get_32(at);
        if (type == EXR_PIXEL_FLOAT) {
            memcpy(&values[x], &bits, 4);
        } else {
            values[x] = (float)bits;
        }
        at += 4;
    }
    return at;
}

// The reverse of pack_chunk. The sizes come from the file, so they are checked again here.
static exr_result_t unpack_chunk(exr_decode_pipeline_t *pipe) {
    ExrPlanes *planes = pipe->decoding_user_data;
    const uint8_t *at = pipe->unpacked_buffer;
    int32_t width = pipe->chunk.width, height = pipe->chunk.height;
    uint64_t line = 0;
    for (int16_t c = 0; c < pipe->channel_count; c++) {
        line += (uint64_t)width * (uint64_t)pipe->channels[c].bytes_per_element;
    }
    if (!at || width < 0 || height < 0 || (uint32_t)width > planes->width - planes->x ||
        (uint32_t)height > planes->height - planes->y ||
        pipe->chunk.unpacked_size < line * (uint64_t)height) {
        return EXR_ERR_CORRUPT_CHUNK;
    }
    for (int32_t y = 0; y < height; y++) {
        size_t row = (size_t)(planes->y + (uint32_t)y) * planes->width + planes->x;
        for (int16_t c = 0; c < pipe->channel_count; c++) {
            at = unpack_values(at, pipe->channels[c].data_type, width, planes->values[c] + row);
        }
    }
    return EXR_ERR_SUCCESS;
}

static exr_result_t decode_chunk(exr_context_t context, ExrPlanes *planes,
                                 const exr_chunk_info_t *chunk, exr_decode_pipeline_t *pipe) {
    if (pipe->context) {
        exr_result_t r = exr_decoding_update(context, 0, chunk, pipe);
        return r ? r : exr_decoding_run(context, 0, pipe);
    }
    exr_result_t r = exr_decoding_initialize(context, 0, chunk, pipe);
    // With no channel asked for, the library reads and decompresses, which is all it is here for.
    r = r ? r : exr_decoding_choose_default_routines(context, 0, pipe);
    pipe->decoding_user_data = planes;
    pipe->unpack_and_convert_fn = unpack_chunk;
    return r ? r : exr_decoding_run(context, 0, pipe);
}

static exr_result_t get_lines(exr_context_t context, ExrPlanes *planes, int32_t first,
                              exr_decode_pipeline_t *pipe) {
    int32_t lines;
    exr_result_t r = exr_get_scanlines_per_chunk(context, 0, &lines);
    if (!r && lines < 1) {
        return EXR_ERR_FILE_BAD_HEADER;
    }
    for (planes->y = 0; !r && planes->y < planes->height; planes->y += (uint32_t)lines) {
        exr_chunk_info_t chunk;
        r = exr_read_scanline_chunk_info(context, 0, first + (int32_t)planes->y, &chunk);
        r = r ? r : decode_chunk(context, planes, &chunk, pipe);
    }
    return r;
}

static exr_result_t get_tiles(exr_context_t context, ExrPlanes *planes,
                              exr_decode_pipeline_t *pipe) {
    int32_t width, height;
    exr_result_t r = exr_get_tile_sizes(context, 0, 0, 0, &width, &height);
    if (!r && (width < 1 || height < 1)) {
        return EXR_ERR_FILE_BAD_HEADER;
    }
    for (int32_t i = 0; !r && (uint64_t)i * (uint64_t)height < planes->height; i++) {
        for (int32_t j = 0; !r && (uint64_t)j * (uint64_t)width < planes->width; j++) {
            exr_chunk_info_t chunk;
            planes->y = (uint32_t)i * (uint32_t)height;
            planes->x = (uint32_t)j * (uint32_t)width;
            r = exr_read_tile_chunk_info(context, 0, j, i, 0, 0, &chunk);
            r = r ? r : decode_chunk(context, planes, &chunk, pipe);
        }
    }
    return r;
}

// These describe the file, not the picture.
static bool is_structural(const char *name) {
    static const char *const names[] = {"pixelAspectRatio", "screenWindowWidth", "name", "type",
                                        "version",          "chunkCount"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(name, names[i]) == 0) {
            return true;
        }
    }
    return false;
}

static bool get_attribute(Arena *arena, const exr_attribute_t *from, ImageAttribute *to) {
    switch (from->type) {
    case EXR_ATTR_STRING:
        *to = (ImageAttribute){.kind = ATTRIBUTE_STRING};
        to->string = arena_string(arena, from->string->str, (size_t)from->string->length);
        break;
    case EXR_ATTR_INT:
        *to = (ImageAttribute){.kind = ATTRIBUTE_INT, .number = from->i};
        break;
    case EXR_ATTR_FLOAT:
        *to = (ImageAttribute){.kind = ATTRIBUTE_FLOAT, .number = (double)from->f};
        break;
    case EXR_ATTR_DOUBLE:
        *to = (ImageAttribute){.kind = ATTRIBUTE_FLOAT, .number = from->d};
        break;
    case EXR_ATTR_RATIONAL:
        *to = (ImageAttribute){.kind = ATTRIBUTE_RATIONAL};
        to->numerator = from->rational->num;
        to->denominator = from->rational->denom;
        break;
    default:
        return false;
    }
    to->name = arena_string(arena, from->name, strlen(from->name));
    return true;
}

static exr_result_t get_attributes(exr_context_t context, Arena *arena, Image *image) {
    int32_t n;
    exr_result_t r = exr_get_attribute_count(context, 0, &n);
    if (r) {
        return r;
    }
    image->attributes = ARENA_ARRAY(arena, (size_t)(n > 0 ? n : 0), ImageAttribute);
    for (int32_t i = 0; i < n; i++) {
        const exr_attribute_t *a;
        r = exr_get_attribute_by_index(context, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a);
        if (r) {
            return r;
        }
        if (!is_structural(a->name) &&
            get_attribute(arena, a, &image->attributes[image->n_attributes])) {
            image->n_attributes++;
        }
    }
    return r;
}

// What a chunk can unfold to, per byte of the file: bounds how much memory a header can ask for.
static uint64_t expansion(exr_compression_t compression) {
    switch (compression) {
    case EXR_COMPRESSION_NONE:
    case EXR_COMPRESSION_B44:
    case EXR_COMPRESSION_B44A:
        return 16;
    case EXR_COMPRESSION_RLE:
        return 64;
    case EXR_COMPRESSION_ZIP:
    case EXR_COMPRESSION_ZIPS:
        return 1100;
    default:
        return 1 << 18;
    }
}

static bool refuse(ExrStream *stream, const char *sentence) {
    stream->is_refusal = !stream->message[0];
    exr_stream_complain(stream, sentence);
    return false;
}

static bool check_channels(ExrStream *stream, const exr_attr_chlist_t *list) {
    if (list->num_channels < 1 || list->num_channels > EXR_CHANNEL_LIMIT) {
        return refuse(stream, "the number of channels is not in 1 to 1024");
    }
    for (int i = 0; i < list->num_channels; i++) {
        const exr_attr_chlist_entry_t *c = &list->entries[i];
        if (c->x_sampling != 1 || c->y_sampling != 1) {
            return refuse(stream, "not supported yet: channels of lower resolution than the image");
        }
    }
    return true;
}

static bool check_size(ExrStream *stream, exr_context_t context, const exr_attr_box2i_t *window,
                       const exr_attr_chlist_t *list) {
    int64_t width = (int64_t)window->max.x - window->min.x + 1;
    int64_t height = (int64_t)window->max.y - window->min.y + 1;
    if (width < 1 || height < 1 || width > EXR_SIDE_LIMIT || height > EXR_SIDE_LIMIT) {
        return refuse(stream, "the image is not 1 to 65536 pixels a side");
    }
    uint64_t bytes = 0, pixels = (uint64_t)width * (uint64_t)height;
    for (int i = 0; i < list->num_channels; i++) {
        bytes += pixels * (list->entries[i].pixel_type == EXR_PIXEL_HALF ? 2 : 4);
    }
    exr_compression_t compression;
    if (exr_get_compression(context, 0, &compression) != EXR_ERR_SUCCESS) {
        return false;
    }
    if (pixels * (uint64_t)list->num_channels * 4 > image_limit) {
        return refuse(stream, "the image takes more than 16 GiB");
    }
    if (bytes / expansion(compression) > (uint64_t)stream->size) {
        return refuse(stream, "the header promises more pixels than the file can hold");
    }
    return true;
}

static bool get_header(ExrStream *stream, exr_context_t context, exr_storage_t *storage,
                       exr_attr_box2i_t *window, const exr_attr_chlist_t **list) {
    if (exr_get_storage(context, 0, storage) != EXR_ERR_SUCCESS) {
        return false;
    }
    if (*storage != EXR_STORAGE_SCANLINE && *storage != EXR_STORAGE_TILED) {
        return refuse(stream, "not supported yet: deep images");
    }
    return exr_get_data_window(context, 0, window) == EXR_ERR_SUCCESS &&
           exr_get_channels(context, 0, list) == EXR_ERR_SUCCESS && *list &&
           check_channels(stream, *list) && check_size(stream, context, window, *list);
}

static void make_channels(Arena *arena, const exr_attr_chlist_t *list, Image *image,
                          ExrPlanes *planes) {
    image->n_channels = (uint32_t)list->num_channels;
    image->channels = ARENA_ARRAY(arena, image->n_channels, ImageChannel);
    for (uint32_t i = 0; i < image->n_channels; i++) {
        const exr_attr_chlist_entry_t *c = &list->entries[i];
        planes->values[i] = ARENA_ARRAY(arena, (size_t)image->width * image->height, float);
        image->channels[i] = (ImageChannel){
            .name = arena_string(arena, c->name.str, (size_t)c->name.length),
            .values = planes->values[i],
            .half = c->pixel_type == EXR_PIXEL_HALF,
        };
    }
}

static exr_result_t read_pixels(exr_context_t context, exr_storage_t storage,
                                const exr_attr_box2i_t *window, ExrPlanes *planes) {
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t r = storage == EXR_STORAGE_SCANLINE
                         ? get_lines(context, planes, window->min.y, &pipe)
                         : get_tiles(context, planes, &pipe);
    exr_decoding_destroy(context, &pipe);
    return r;
}

static void note_crop(const exr_attr_box2i_t *part, const exr_attr_box2i_t *whole,
                      ImageCrop *crop) {
    int64_t width = (int64_t)whole->max.x - whole->min.x + 1;
    int64_t height = (int64_t)whole->max.y - whole->min.y + 1;
    int64_t x = (int64_t)part->min.x - whole->min.x, y = (int64_t)part->min.y - whole->min.y;
    bool is_whole = x == 0 && y == 0 && part->max.x == whole->max.x && part->max.y == whole->max.y;
    bool is_sane = width > 0 && height > 0 && width <= EXR_SIDE_LIMIT && height <= EXR_SIDE_LIMIT &&
                   x >= INT32_MIN && x <= INT32_MAX && y >= INT32_MIN && y <= INT32_MAX;
    if (!is_whole && is_sane) {
        *crop = (ImageCrop){(int32_t)x, (int32_t)y, (uint32_t)width, (uint32_t)height};
    }
}

static bool read_part(ExrStream *stream, exr_context_t context, Arena *arena, bool has_pixels,
                      Image *image) {
    exr_storage_t storage;
    exr_attr_box2i_t window;
    const exr_attr_chlist_t *list = NULL;
    if (!get_header(stream, context, &storage, &window, &list)) {
        return false;
    }
    image->width = (uint32_t)(window.max.x - window.min.x + 1);
    image->height = (uint32_t)(window.max.y - window.min.y + 1);
    exr_attr_box2i_t whole;
    if (exr_get_display_window(context, 0, &whole) == EXR_ERR_SUCCESS) {
        note_crop(&window, &whole, &image->crop);
    }
    exr_result_t r = get_attributes(context, arena, image);
    if (has_pixels) {
        ExrPlanes planes = {.width = image->width, .height = image->height};
        make_channels(arena, list, image, &planes);
        r = r ? r : read_pixels(context, storage, &window, &planes);
    }
    if (r) {
        exr_stream_complain(stream, exr_get_default_error_message(r));
    }
    return r == EXR_ERR_SUCCESS;
}

// O_NONBLOCK: a pipe that nobody writes to must not hold the program.
static bool open_stream(ExrStream *stream, const char *path, char *message, size_t n) {
    static const char magic[4] = {0x76, 0x2f, 0x31, 0x01};
    struct stat s;
    stream->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (stream->fd < 0 || fstat(stream->fd, &s) != 0) {
        snprintf(message, n, "cannot read: %s", strerror(errno));
        return false;
    }
    char start[4];
    if (!S_ISREG(s.st_mode)) {
        snprintf(message, n, "cannot read: not a regular file");
        return false;
    }
    if (pread(stream->fd, start, 4, 0) != 4 || memcmp(start, magic, 4) != 0) {
        snprintf(message, n, "not an EXR file");
        return false;
    }
    stream->size = s.st_size;
    return true;
}

static bool read_exr(Arena *arena, const char *path, bool has_pixels, Image *image, char *message,
                     size_t n) {
    char why[256] = "";
    ExrStream stream = {.fd = -1, .message = why, .n = sizeof why};
    *image = (Image){0};
    bool done = open_stream(&stream, path, message, n);
    if (done) {
        exr_context_t context = NULL;
        exr_context_initializer_t init = exr_stream_initializer(&stream);
        exr_result_t r = exr_start_read(&context, "image", &init);
        done = !r && read_part(&stream, context, arena, has_pixels, image);
        if (r) {
            exr_stream_complain(&stream, exr_get_default_error_message(r));
        }
        exr_finish(&context);
        if (!done) {
            snprintf(message, n, "%s%s", stream.is_refusal ? "" : "damaged EXR file: ", why);
        }
    }
    if (stream.fd >= 0) {
        close(stream.fd);
    }
    return done;
}

bool image_read_exr(Arena *arena, const char *path, Image *image, char *message, size_t n) {
    return read_exr(arena, path, true, image, message, n);
}

bool image_read_exr_header(Arena *arena, const char *path, Image *image, char *message, size_t n) {
    return read_exr(arena, path, false, image, message, n);
}
