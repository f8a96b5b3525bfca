// SPDX-License-Identifier: Apache-2.0
// Writing EXR by OpenEXRCore: one part, scan lines. Chunks are compressed by all threads and
// written in order, so the bytes do not depend on the threads.
#include "render/image.h"

#include <stdio.h>
#include <string.h>

#include "render/exr.h"
#include "render/half.h"
#include "render/outfile.h"

// Level 4 writes twice as fast as zlib's default 6 for files about 1 % larger.
enum { ZIP_LEVEL = 4 };

// Saturates, NaN gives 0: the conversion of what does not fit is undefined.
static int32_t integer_of(double number) {
    if (!(number > INT32_MIN)) {
        return number == number ? INT32_MIN : 0;
    }
    return number < INT32_MAX ? (int32_t)number : INT32_MAX;
}

static exr_result_t put_attribute(exr_context_t context, const ImageAttribute *a) {
    switch (a->kind) {
    case ATTRIBUTE_STRING:
        return exr_attr_set_string(context, 0, a->name, a->string ? a->string : "");
    case ATTRIBUTE_INT:
        return exr_attr_set_int(context, 0, a->name, integer_of(a->number));
    case ATTRIBUTE_FLOAT:
        return exr_attr_set_float(context, 0, a->name, (float)a->number);
    case ATTRIBUTE_RATIONAL: {
        exr_attr_rational_t ratio = {.num = a->numerator, .denom = a->denominator};
        return exr_attr_set_rational(context, 0, a->name, &ratio);
    }
    }
    return EXR_ERR_INVALID_ATTR;
}

static void find_windows(const Image *image, exr_attr_box2i_t *whole, exr_attr_box2i_t *part) {
    const ImageCrop *crop = &image->crop;
    bool is_crop = crop->width > 0;
    whole->min.x = whole->min.y = 0;
    whole->max.x = (int32_t)(is_crop ? crop->width : image->width) - 1;
    whole->max.y = (int32_t)(is_crop ? crop->height : image->height) - 1;
    part->min.x = crop->x;
    part->min.y = crop->y;
    part->max.x = crop->x + (int32_t)image->width - 1;
    part->max.y = crop->y + (int32_t)image->height - 1;
}

static const exr_compression_t compressions[] = {[COMPRESSION_ZIP] = EXR_COMPRESSION_ZIP,
                                                 [COMPRESSION_ZIPS] = EXR_COMPRESSION_ZIPS,
                                                 [COMPRESSION_PIZ] = EXR_COMPRESSION_PIZ,
                                                 [COMPRESSION_RLE] = EXR_COMPRESSION_RLE,
                                                 [COMPRESSION_NONE] = EXR_COMPRESSION_NONE};

static exr_result_t put_header(exr_context_t context, const Image *image) {
    int part;
    exr_result_t r = exr_set_longname_support(context, 1);
    r = r ? r : exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part);
    exr_attr_box2i_t whole, window;
    find_windows(image, &whole, &window);
    const exr_attr_v2f_t center = {.x = 0, .y = 0};
    r = r ? r
          : exr_initialize_required_attr(context, 0, &whole, &window, 1, &center, 1,
                                         EXR_LINEORDER_INCREASING_Y,
                                         compressions[image->compression]);
    r = r ? r : exr_set_zip_compression_level(context, 0, ZIP_LEVEL);
    for (uint32_t i = 0; !r && i < image->n_channels; i++) {
        const ImageChannel *c = &image->channels[i];
        r = exr_add_channel(context, 0, c->name, c->half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                            EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    }
    for (uint32_t i = 0; !r && i < image->n_attributes; i++) {
        r = put_attribute(context, &image->attributes[i]);
    }
    return r ? r : exr_write_header(context);
}

static uint8_t *put_16(uint8_t *at, uint16_t v) {
    at[0] = (uint8_t)v;
    at[1] = (uint8_t)(v >> 8);
    return at + 2;
}

static uint8_t *put_32(uint8_t *at, uint32_t v) {
    return put_16(put_16(at, (uint16_t)v), (uint16_t)(v >> 16));
}

// Line by line, in a line channel by channel, little-endian: the layout of a chunk.
static exr_result_t pack_chunk(exr_encode_pipeline_t *pipe) {
    const ExrPlanes *planes = pipe->encoding_user_data;
    uint8_t *start = pipe->packed_buffer, *at = start;
    for (int32_t y = 0; y < pipe->chunk.height; y++) {
        size_t row = (size_t)(pipe->chunk.start_y - planes->first + y) * planes->width;
        for (int16_t c = 0; c < pipe->channel_count; c++) {
            const float *values = planes->values[c] + row;
            bool half = pipe->channels[c].data_type == EXR_PIXEL_HALF;
            for (uint32_t x = 0; x < planes->width; x++) {
                uint32_t bits;
                memcpy(&bits, &values[x], 4);
                at = half ? put_16(at, half_from_float(values[x])) : put_32(at, bits);
            }
        }
    }
    pipe->packed_bytes = (uint64_t)(at - start);
    return EXR_ERR_SUCCESS;
}

// Packs and compresses; the file is written afterwards, in order.
static exr_result_t compress_chunk(exr_context_t context, ExrPlanes *planes, int y,
                                   exr_encode_pipeline_t *pipe) {
    exr_chunk_info_t chunk;
    exr_result_t r = exr_write_scanline_chunk_info(context, 0, y, &chunk);
    if (!r && !pipe->context) {
        r = exr_encoding_initialize(context, 0, &chunk, pipe);
        for (int16_t c = 0; !r && c < pipe->channel_count; c++) {
            pipe->channels[c].encode_from_ptr = (const uint8_t *)planes->values[c];
            pipe->channels[c].user_pixel_stride = 4;
            pipe->channels[c].user_line_stride = (int32_t)planes->width * 4;
        }
        r = r ? r : exr_encoding_choose_default_routines(context, 0, pipe);
        pipe->encoding_user_data = planes;
        pipe->convert_and_pack_fn = pack_chunk;
        pipe->yield_until_ready_fn = NULL;
        pipe->write_fn = NULL;
    } else if (!r) {
        r = exr_encoding_update(context, 0, &chunk, pipe);
    }
    return r ? r : exr_encoding_run(context, 0, pipe);
}

static exr_result_t put_pixels(exr_context_t context, ExrPlanes *planes) {
    int32_t lines;
    exr_result_t result = exr_get_scanlines_per_chunk(context, 0, &lines);
    if (result) {
        return result;
    }
    int n_chunks = ((int)planes->height + lines - 1) / lines;
#pragma omp parallel
    {
        exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
#pragma omp for ordered schedule(static, 1)
        for (int i = 0; i < n_chunks; i++) {
            int y = planes->first + i * lines;
            exr_result_t r = compress_chunk(context, planes, y, &pipe);
#pragma omp ordered
            {
                if (!result && !r) {
                    r = exr_write_scanline_chunk(context, 0, y, pipe.compressed_buffer,
                                                 pipe.compressed_bytes);
                }
                result = result ? result : r;
            }
        }
        exr_encoding_destroy(context, &pipe);
    }
    return result;
}

// The file sorts its channels by name, so ours are found by the names it gives.
static exr_result_t collect_planes(exr_context_t context, const Image *image, ExrPlanes *planes) {
    const exr_attr_chlist_t *list;
    exr_result_t r = exr_get_channels(context, 0, &list);
    for (int i = 0; !r && i < list->num_channels; i++) {
        const ImageChannel *c = image_channel(image, list->entries[i].name.str);
        if (!c) {
            return EXR_ERR_INVALID_ARGUMENT;
        }
        planes->values[i] = c->values;
    }
    planes->width = image->width;
    planes->height = image->height;
    planes->first = image->crop.y;
    return r;
}

static bool check_image(const Image *image, char *message, size_t n) {
    if (!image->width || !image->height || image->width > EXR_SIDE_LIMIT ||
        image->height > EXR_SIDE_LIMIT) {
        snprintf(message, n, "an image of %ux%u pixels cannot be written: 1 to %d a side",
                 image->width, image->height, EXR_SIDE_LIMIT);
        return false;
    }
    if (!image->n_channels || image->n_channels > EXR_CHANNEL_LIMIT) {
        snprintf(message, n, "an image of %u channels cannot be written: 1 to %d",
                 image->n_channels, EXR_CHANNEL_LIMIT);
        return false;
    }
    for (uint32_t i = 0; i < image->n_channels; i++) {
        const ImageChannel *c = &image->channels[i];
        size_t length = strlen(c->name);
        if (length == 0 || length > EXR_NAME_LIMIT) {
            snprintf(message, n, "a channel's name has 1 to %d bytes", EXR_NAME_LIMIT);
            return false;
        }
        if (image_channel(image, c->name) != c) {
            snprintf(message, n, "two channels are called \"%s\"", c->name);
            return false;
        }
    }
    return true;
}

static exr_result_t write_stream(ExrStream *stream, const Image *image) {
    exr_context_t context = NULL;
    exr_context_initializer_t init = exr_stream_initializer(stream);
    ExrPlanes planes;
    exr_result_t r = exr_start_write(&context, "image", EXR_WRITE_FILE_DIRECTLY, &init);
    r = r ? r : put_header(context, image);
    r = r ? r : collect_planes(context, image, &planes);
    r = r ? r : put_pixels(context, &planes);
    // exr_finish writes the table of chunks, so its failure counts too.
    exr_result_t finished = exr_finish(&context);
    return r ? r : finished;
}

bool image_write_exr(const char *path, const Image *image, char *message, size_t n) {
    char why[256] = "";
    OutFile file;
    if (!check_image(image, message, n) || !outfile_open(&file, path, message, n)) {
        return false;
    }
    ExrStream stream = {.fd = file.fd, .message = why, .n = sizeof why};
    exr_result_t r = write_stream(&stream, image);
    if (r) {
        snprintf(message, n, "cannot write: %s", why[0] ? why : exr_get_default_error_message(r));
        outfile_abandon(&file);
        return false;
    }
    return outfile_commit(&file, message, n);
}
