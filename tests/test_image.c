// SPDX-License-Identifier: Apache-2.0
// Image files: bits and attributes survive the round trip, damage ends in a message, nothing is
// left behind, and what needs no OpenImageIO does not load it.
#include "render/image.h"
#include "tests/suite.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/half.h"

// Each test has a folder of its own, which must hold nothing but the named file at its end.
typedef struct {
    char folder[64], path[128], message[256];
    Arena arena;
} Fixture;

static int set_up(void **state) {
    Fixture *f = calloc(1, sizeof *f);
    snprintf(f->folder, sizeof f->folder, "/tmp/st4-image-XXXXXX");
    *state = f;
    return mkdtemp(f->folder) == NULL;
}

static int count_files(const char *folder) {
    int n = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));) {
        n += strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0;
    }
    closedir(d);
    return n;
}

static int tear_down(void **state) {
    Fixture *f = *state;
    unlink(f->path);
    int left = rmdir(f->folder);
    arena_free(&f->arena);
    free(f);
    return left;
}

static void name(Fixture *f, const char *base) {
    snprintf(f->path, sizeof f->path, "%s/%s", f->folder, base);
}

static float from_bits(uint32_t bits) {
    float v;
    memcpy(&v, &bits, 4);
    return v;
}

static uint32_t to_bits(float v) {
    uint32_t bits;
    memcpy(&bits, &v, 4);
    return bits;
}

enum { WIDTH = 67, HEIGHT = 41, PIXELS = WIDTH * HEIGHT };

static float halves[PIXELS], floats[PIXELS], depth[PIXELS];

static ImageChannel channels[] = {
    {"R", halves, true}, {"normal.X", floats, false}, {"A", halves, true}, {"Z", depth, false}};

static ImageAttribute attributes[] = {
    {"st4/command", ATTRIBUTE_STRING, .string = "st4 render \"a b\" -o \xc3\xa4.exr"},
    {"st4/empty", ATTRIBUTE_STRING, .string = ""},
    {"seed", ATTRIBUTE_INT, .number = -2147483647},
    {"expTime", ATTRIBUTE_FLOAT, .number = 0.020833334},
    {"framesPerSecond", ATTRIBUTE_RATIONAL, .numerator = 24000, .denominator = 1001},
    {"a name of more than the thirty-one bytes of old", ATTRIBUTE_INT, .number = 7},
};

static Image sample_image(void) {
    for (uint32_t i = 0; i < PIXELS; i++) {
        halves[i] = half_to_float((uint16_t)(i * 40503u));
        floats[i] = from_bits(i * 2654435761u);
        depth[i] = 3.0f;
    }
    static const uint32_t special[] = {0x7f800000, 0xff800000, 0x7fc00000, 0x7f800001, 0xffc12345,
                                       0x00000001, 0x80000001, 0x80000000, 0x007fffff, 0x7f7fffff};
    for (size_t i = 0; i < sizeof special / sizeof special[0]; i++) {
        depth[i] = from_bits(special[i]);
    }
    return (Image){.width = WIDTH,
                   .height = HEIGHT,
                   .n_channels = 4,
                   .n_attributes = sizeof attributes / sizeof attributes[0],
                   .channels = channels,
                   .attributes = attributes};
}

static void assert_same_bits(const float *a, const float *b) {
    for (int i = 0; i < PIXELS; i++) {
        assert_int_equal(to_bits(a[i]), to_bits(b[i]));
    }
}

static void exr_keeps_the_bits(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    for (int compression = COMPRESSION_ZIP; compression <= COMPRESSION_NONE; compression++) {
        Image image = sample_image(), back;
        image.compression = (Compression)compression;
        assert_true(image_write_exr(f->path, &image, f->message, sizeof f->message));
        assert_int_equal(count_files(f->folder), 1);
        assert_true(image_read_exr(&f->arena, f->path, &back, f->message, sizeof f->message));
        assert_int_equal(back.width, WIDTH);
        assert_int_equal(back.height, HEIGHT);
        assert_int_equal(back.n_channels, 4);
        for (int c = 0; c < 4; c++) {
            const ImageChannel *channel = image_channel(&back, channels[c].name);
            assert_non_null(channel);
            assert_int_equal(channel->half, channels[c].half);
            assert_same_bits(channel->values, channels[c].values);
        }
        assert_null(image_channel(&back, "B"));
    }
}

static const ImageAttribute *find_attribute(const Image *image, const char *called) {
    for (uint32_t i = 0; i < image->n_attributes; i++) {
        if (strcmp(image->attributes[i].name, called) == 0) {
            return &image->attributes[i];
        }
    }
    return NULL;
}

static void exr_keeps_the_attributes(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    Image image = sample_image(), back;
    assert_true(image_write_exr(f->path, &image, f->message, sizeof f->message));
    assert_true(image_read_exr(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_int_equal(back.n_attributes, image.n_attributes);
    for (uint32_t i = 0; i < image.n_attributes; i++) {
        const ImageAttribute *a = &attributes[i], *b = find_attribute(&back, a->name);
        assert_non_null(b);
        assert_int_equal(a->kind, b->kind);
        if (a->kind == ATTRIBUTE_STRING) {
            assert_string_equal(a->string, b->string);
        }
        assert_true((float)a->number == (float)b->number);
        assert_int_equal(a->numerator, b->numerator);
        assert_int_equal(a->denominator, b->denominator);
    }
}

// ---- a tiled file, written byte by byte

typedef struct {
    unsigned char bytes[2048];
    size_t n;
} Bytes;

static void put(Bytes *b, uint64_t value, size_t size) {
    for (size_t i = 0; i < size; i++) {
        b->bytes[b->n++] = (unsigned char)(value >> (8 * i));
    }
}

static void put_text(Bytes *b, const char *text) {
    memcpy(b->bytes + b->n, text, strlen(text) + 1);
    b->n += strlen(text) + 1;
}

static void put_attribute(Bytes *b, const char *called, const char *type, uint32_t size) {
    put_text(b, called);
    put_text(b, type);
    put(b, size, 4);
}

static void put_channel(Bytes *b, const char *called, uint32_t type) {
    put_text(b, called);
    put(b, type, 4);
    put(b, 0, 4);
    put(b, 1, 4);
    put(b, 1, 4);
}

enum { TILED_X = -2, TILED_Y = 7, TILED_WIDTH = 5, TILED_HEIGHT = 3, TILE = 2, N_TILES = 6 };

static void put_header(Bytes *b) {
    put(b, 0x01312f76, 4);
    put(b, 2 | 0x200, 4);
    put_attribute(b, "channels", "chlist", 2 * 18 + 1);
    put_channel(b, "U", 0);
    put_channel(b, "V", 1);
    put(b, 0, 1);
    put_attribute(b, "compression", "compression", 1);
    put(b, 0, 1);
    static const char *const windows[] = {"dataWindow", "displayWindow"};
    for (int i = 0; i < 2; i++) {
        put_attribute(b, windows[i], "box2i", 16);
        put(b, (uint32_t)TILED_X, 4);
        put(b, TILED_Y, 4);
        put(b, TILED_X + TILED_WIDTH - 1, 4);
        put(b, TILED_Y + TILED_HEIGHT - 1, 4);
    }
    put_attribute(b, "lineOrder", "lineOrder", 1);
    put(b, 0, 1);
    put_attribute(b, "pixelAspectRatio", "float", 4);
    put(b, to_bits(1), 4);
    put_attribute(b, "screenWindowCenter", "v2f", 8);
    put(b, 0, 8);
    put_attribute(b, "screenWindowWidth", "float", 4);
    put(b, to_bits(1), 4);
    put_attribute(b, "tiles", "tiledesc", 9);
    put(b, TILE, 4);
    put(b, TILE, 4);
    put(b, 0, 1);
    put(b, 0, 1);
}

static uint32_t tiled_u(int x, int y) {
    return (uint32_t)(1000 * y + x) << 8;
}

static uint16_t tiled_v(int x, int y) {
    return (uint16_t)(0x3c00 + 16 * y + x); // 1 + (16 y + x) / 1024
}

static void put_tile(Bytes *b, int i, int j) {
    int width = TILE * (j + 1) > TILED_WIDTH ? TILED_WIDTH - TILE * j : TILE;
    int height = TILE * (i + 1) > TILED_HEIGHT ? TILED_HEIGHT - TILE * i : TILE;
    put(b, (uint32_t)j, 4);
    put(b, (uint32_t)i, 4);
    put(b, 0, 8);
    put(b, (uint32_t)(width * height * 6), 4);
    for (int y = TILE * i; y < TILE * i + height; y++) {
        for (int x = TILE * j; x < TILE * j + width; x++) {
            put(b, tiled_u(x, y), 4);
        }
        for (int x = TILE * j; x < TILE * j + width; x++) {
            put(b, tiled_v(x, y), 2);
        }
    }
}

static void make_tiled(Bytes *b) {
    *b = (Bytes){.n = 0};
    put_header(b);
    size_t table = b->n;
    b->n += N_TILES * 8;
    for (int tile = 0; tile < N_TILES; tile++) {
        size_t start = b->n;
        b->n = table + (size_t)tile * 8;
        put(b, start, 8);
        b->n = start;
        put_tile(b, tile / 3, tile % 3);
    }
}

static void put_file(const Fixture *f, const void *bytes, size_t n) {
    FILE *file = fopen(f->path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, n, file), n);
    fclose(file);
}

static void exr_reads_tiles(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    Bytes b;
    make_tiled(&b);
    put_file(f, b.bytes, b.n);
    Image image;
    if (!image_read_exr(&f->arena, f->path, &image, f->message, sizeof f->message)) {
        fail_msg("%s", f->message);
    }
    assert_int_equal(image.width, TILED_WIDTH);
    assert_int_equal(image.height, TILED_HEIGHT);
    const ImageChannel *u = image_channel(&image, "U"), *v = image_channel(&image, "V");
    for (int y = 0; y < TILED_HEIGHT; y++) {
        for (int x = 0; x < TILED_WIDTH; x++) {
            assert_true((double)u->values[y * TILED_WIDTH + x] == tiled_u(x, y));
            assert_true((double)v->values[y * TILED_WIDTH + x] == 1 + (16 * y + x) / 1024.0);
        }
    }
    assert_true(!u->half && v->half);
}

// ---- damage

static void damage(Fixture *f, const unsigned char *bytes, size_t n, int times, uint64_t seed) {
    unsigned char *copy = malloc(n);
    for (int i = 0; i < times; i++) {
        memcpy(copy, bytes, n);
        size_t length = n;
        for (int k = 0; k <= i % 3; k++) {
            seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
            // Half of the damage goes to the header, which is a small part of the file.
            size_t reach = seed >> 63 && n > 700 ? 700 : n, at = (size_t)(seed >> 33) % reach;
            switch (seed >> 20 & 7) {
            case 0:
                length = at;
                break;
            case 1:
                copy[at] = 0xff;
                break;
            case 2:
                copy[at] = (unsigned char)(seed >> 24);
                break;
            default:
                copy[at] ^= (unsigned char)(1u << (seed >> 24 & 7));
            }
        }
        put_file(f, copy, length);
        Arena arena = {0};
        Image image;
        f->message[0] = '\0';
        if (image_read_exr(&arena, f->path, &image, f->message, sizeof f->message)) {
            // What was read is there in full.
            const ImageChannel *last = &image.channels[image.n_channels - 1];
            volatile float v = last->values[(size_t)image.width * image.height - 1];
            (void)v;
        } else {
            assert_true(f->message[0]);
        }
        arena_free(&arena);
    }
    free(copy);
}

static unsigned char *read_whole(const char *path, size_t *n) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *n = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*n);
    assert_int_equal(fread(bytes, 1, *n, file), *n);
    fclose(file);
    return bytes;
}

static void exr_damage_never_crashes(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    Bytes b;
    make_tiled(&b);
    damage(f, b.bytes, b.n, 1000, 1);
    Image image = sample_image();
    assert_true(image_write_exr(f->path, &image, f->message, sizeof f->message));
    size_t n;
    unsigned char *bytes = read_whole(f->path, &n);
    damage(f, bytes, n, 1000, 2);
    free(bytes);
}

// Cut at any length, the file is refused: no pixel is missing unnoticed.
static void exr_notices_each_cut(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    Image image = sample_image();
    assert_true(image_write_exr(f->path, &image, f->message, sizeof f->message));
    size_t n;
    unsigned char *bytes = read_whole(f->path, &n);
    for (size_t cut = 0; cut < n; cut += 1 + n / 97) {
        put_file(f, bytes, cut);
        assert_false(image_read_exr(&f->arena, f->path, &image, f->message, sizeof f->message));
    }
    free(bytes);
}

static void assert_unreadable(Fixture *f, const char *path, const char *expected) {
    Image image;
    assert_false(image_read(&f->arena, path, &image, f->message, sizeof f->message));
    assert_string_equal(f->message, expected);
}

static void exr_refuses(void **state) {
    Fixture *f = *state;
    assert_unreadable(f, "/nonexistent.exr", "cannot read: No such file or directory");
    assert_unreadable(f, f->folder, "cannot read: not a regular file");
    name(f, "a.exr");
    put_file(f, "not this", 8);
    assert_unreadable(f, f->path, "not an EXR file");
    Bytes b;
    make_tiled(&b);
    // A data window of 20,000 x 20,000 pixels, in a file of half a kilobyte.
    static const char window[] = "dataWindow\0box2i\0\x10\0\0";
    for (size_t at = 0; at < b.n; at++) {
        if (memcmp(b.bytes + at, window, sizeof window) == 0) {
            b.n = at + sizeof window;
            put(&b, 0, 8);
            put(&b, 19999, 4);
            put(&b, 19999, 4);
            break;
        }
    }
    Bytes whole;
    make_tiled(&whole);
    put_file(f, b.bytes, whole.n);
    assert_unreadable(f, f->path, "the header promises more pixels than the file can hold");
}

// ---- writing

static void assert_unwritable(Fixture *f, const char *path, const char *expected) {
    Image image = sample_image();
    assert_false(image_write(path, &image, &(FilmSettings){0}, f->message, sizeof f->message));
    assert_string_equal(f->message, expected);
}

static void writing_refuses(void **state) {
    Fixture *f = *state;
    assert_unwritable(f, "/nonexistent/a.exr", "cannot create: No such file or directory");
    assert_unwritable(f, "/dev/null/a.exr", "cannot create: Not a directory");
    assert_unwritable(f, "a.gif",
                      "the name's ending is none of .exr, .png, .jpg, .jpeg, .tif, .tiff, .bmp, "
                      ".tga, .webp");
    assert_unwritable(f, "no/ending.d/a",
                      "the name's ending is none of .exr, .png, .jpg, .jpeg, .tif, .tiff, .bmp, "
                      ".tga, .webp");
    assert_unwritable(f, "a.png", "the image has no channel G");
    Image image = sample_image();
    assert_false(image_write_exr("/dev/null", &image, f->message, sizeof f->message));
    assert_string_equal(f->message, "cannot write: it exists and is not a regular file");
    assert_false(image_write_exr(f->folder, &image, f->message, sizeof f->message));
    assert_string_equal(f->message, "cannot write: it is a folder");
    image.n_channels = 0;
    assert_false(image_write_exr("a.exr", &image, f->message, sizeof f->message));
    assert_string_equal(f->message, "an image of 0 channels cannot be written: 1 to 1024");
    ImageChannel twice[2] = {{"R", halves, true}, {"R", floats, false}};
    image.n_channels = 2;
    image.channels = twice;
    assert_false(image_write_exr("a.exr", &image, f->message, sizeof f->message));
    assert_string_equal(f->message, "two channels are called \"R\"");
    assert_int_equal(count_files(f->folder), 0);
}

// A file that is there stays whole when writing over it fails, and nothing is left beside it.
static void writing_fails_without_a_trace(void **state) {
    Fixture *f = *state;
    name(f, "a.exr");
    put_file(f, "precious", 8);
    Image image = sample_image();
    ImageAttribute wrong = {"channels", ATTRIBUTE_INT, .number = 1};
    image.attributes = &wrong;
    image.n_attributes = 1;
    assert_false(image_write_exr(f->path, &image, f->message, sizeof f->message));
    assert_true(strncmp(f->message, "cannot write: ", 14) == 0);
    size_t n;
    unsigned char *bytes = read_whole(f->path, &n);
    assert_int_equal(n, 8);
    assert_memory_equal(bytes, "precious", 8);
    free(bytes);
    assert_int_equal(count_files(f->folder), 1);
}

// ---- OpenImageIO

// First of the suite: what comes before must not have loaded it.
static void exr_needs_no_library(void **state) {
    Fixture *f = *state;
    assert_false(image_library_is_loaded());
    name(f, "a.exr");
    Image image = sample_image(), back;
    assert_true(image_write(f->path, &image, &(FilmSettings){0}, f->message, sizeof f->message));
    assert_true(image_read(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_false(image_library_is_loaded());
}

// The curve of IEC 61966-2-1 from linear light to 0..1, the other way round than the product has
// it.
static double srgb(double v) {
    v = v < 0 ? 0 : v > 1 ? 1 : v;
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

enum { RAMP = 4096 };
static float ramp[4][RAMP];

static Image ramp_image(uint32_t n_channels) {
    static ImageChannel planes[] = {
        {"R", ramp[0], false}, {"G", ramp[1], false}, {"B", ramp[2], false}, {"A", ramp[3], false}};
    for (int i = 0; i < RAMP; i++) {
        ramp[0][i] = (float)i / (RAMP - 1);
        ramp[1][i] = (float)i / 100000;
        ramp[2][i] = (float)(i - 100) / 2000;
        ramp[3][i] = 1;
    }
    return (Image){64, 64, n_channels, .channels = planes};
}

static void assert_ramp(const Image *back, double scale) {
    static const char *const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) {
        const ImageChannel *channel = image_channel(back, names[c]);
        for (int i = 0; i < RAMP; i++) {
            double wanted = 255 * srgb((double)ramp[c][i] * scale);
            double got = 255 * srgb((double)channel->values[i]);
            assert_true(fabs(got - floor(got + 0.5)) < 1e-3);
            assert_true(fabs(got - wanted) <= 0.5 + 1e-3);
        }
    }
}

static void png_and_tiff_round_trip(void **state) {
    Fixture *f = *state;
    static const char *const names[] = {"a.png", "a.TIFF", "a.bmp"};
    Image image = ramp_image(3), back;
    for (int i = 0; i < 3; i++) {
        name(f, names[i]);
        assert_true(image_write(f->path, &image, &(FilmSettings){.exposure = 1.5 * i}, f->message,
                                sizeof f->message));
        assert_int_equal(count_files(f->folder), 1);
        if (!image_read(&f->arena, f->path, &back, f->message, sizeof f->message)) {
            fail_msg("%s: %s", names[i], f->message);
        }
        assert_int_equal(back.n_channels, 3);
        assert_int_equal(back.width, 64);
        assert_ramp(&back, exp2(1.5 * i));
        unlink(f->path);
    }
    assert_true(image_library_is_loaded());
}

static void png_clips(void **state) {
    Fixture *f = *state;
    name(f, "a.png");
    float values[4] = {NAN, INFINITY, -INFINITY, 1e30f};
    ImageChannel planes[] = {{"R", values, false}, {"G", values, false}, {"B", values, false}};
    Image image = {4, 1, 3, .channels = planes}, back;
    assert_true(image_write(f->path, &image, &(FilmSettings){0}, f->message, sizeof f->message));
    assert_true(image_read(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_memory_equal(image_channel(&back, "G")->values, ((float[]){0, 1, 0, 1}), 16);
}

// Colours are multiplied by alpha in images, and are not in PNG files.
static void png_keeps_alpha(void **state) {
    Fixture *f = *state;
    name(f, "a.png");
    Image image = ramp_image(4), back;
    for (int i = 0; i < RAMP; i++) {
        ramp[3][i] = (float)(i % 256) / 255;
        for (int c = 0; c < 3; c++) {
            ramp[c][i] = ramp[3][i] * (0.2f + 0.3f * (float)c);
        }
    }
    assert_true(image_write(f->path, &image, &(FilmSettings){.transparent = true}, f->message,
                            sizeof f->message));
    assert_true(image_read(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_int_equal(back.n_channels, 4);
    for (int i = 0; i < RAMP; i++) {
        assert_true(fabsf(image_channel(&back, "A")->values[i] - ramp[3][i]) < 1e-6f);
        assert_true(fabsf(image_channel(&back, "G")->values[i] - ramp[1][i]) < 5e-3f);
    }
    unlink(f->path);
    name(f, "a.jpg");
    assert_false(image_write(f->path, &image, &(FilmSettings){.transparent = true}, f->message,
                             sizeof f->message));
    assert_string_equal(f->message, "cannot write: jpg files hold no alpha");
    assert_int_equal(count_files(f->folder), 0);
}

static void other_damage_is_reported(void **state) {
    Fixture *f = *state;
    name(f, "a.bmp");
    Image image = ramp_image(3), back;
    assert_true(image_write(f->path, &image, &(FilmSettings){0}, f->message, sizeof f->message));
    size_t n;
    unsigned char *bytes = read_whole(f->path, &n);
    put_file(f, bytes, n / 2);
    assert_false(image_read(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_true(f->message[0]);
    put_file(f, "rubbish", 7);
    assert_false(image_read(&f->arena, f->path, &back, f->message, sizeof f->message));
    assert_true(strncmp(f->message, "cannot read: ", 13) == 0);
    free(bytes);
}

#define IMAGE_TEST(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)

static const struct CMUnitTest tests[] = {
    IMAGE_TEST(exr_needs_no_library),
    IMAGE_TEST(exr_keeps_the_bits),
    IMAGE_TEST(exr_keeps_the_attributes),
    IMAGE_TEST(exr_reads_tiles),
    IMAGE_TEST(exr_damage_never_crashes),
    IMAGE_TEST(exr_notices_each_cut),
    IMAGE_TEST(exr_refuses),
    IMAGE_TEST(writing_refuses),
    IMAGE_TEST(writing_fails_without_a_trace),
    IMAGE_TEST(png_and_tiff_round_trip),
    IMAGE_TEST(png_clips),
    IMAGE_TEST(png_keeps_alpha),
    IMAGE_TEST(other_damage_is_reported),
};

SUITE(image, tests)
