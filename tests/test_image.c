// SPDX-License-Identifier: Apache-2.0
// Image files: bits and attributes survive the round trip, damage ends in a message, nothing is left
// behind, and what needs no OpenImageIO does not load it.
#include "render/image.h"
#include "tests/suite.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
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

// An oracle of its own: the value of a half by the formula of the standard, in double.
static double half_value(unsigned h) {
    double sign = h & 0x8000 ? -1 : 1;
    int exponent = h >> 10 & 31, mantissa = h & 1023;
    if (exponent == 31) {
        return mantissa ? NAN : sign * INFINITY;
    }
    return sign * (exponent ? ldexp(1024 + mantissa, exponent - 25) : ldexp(mantissa, -24));
}

static void half_round_trips(void **state) {
    (void)state;
    for (unsigned h = 0; h < 65536; h++) {
        float v = half_to_float((uint16_t)h);
        double expected = half_value(h);
        assert_true(isnan(expected) ? isnan(v) : (double)v == expected);
        assert_int_equal(half_from_float(v), h);
    }
}

// Every half's neighbourhood: just below, at and just above the middle to the next one.
static void half_rounds_to_nearest_even(void **state) {
    (void)state;
    for (unsigned h = 0; h < 0x7bff; h++) {
        float middle = (float)((half_value(h) + half_value(h + 1)) / 2);
        assert_int_equal(half_from_float(nextafterf(middle, 0)), h);
        assert_int_equal(half_from_float(middle), h + (h & 1));
        assert_int_equal(half_from_float(nextafterf(middle, INFINITY)), h + 1);
        assert_int_equal(half_from_float(-middle), 0x8000 | (h + (h & 1)));
    }
    assert_int_equal(half_from_float(65519.99f), 0x7bff);
    assert_int_equal(half_from_float(65520.0f), 0x7c00);
    assert_int_equal(half_from_float(1e-30f), 0);
    assert_int_equal(half_from_float(-0.0f), 0x8000);
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
    Image image = sample_image(), back;
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

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(half_round_trips),
    cmocka_unit_test(half_rounds_to_nearest_even),
    cmocka_unit_test_setup_teardown(exr_keeps_the_bits, set_up, tear_down),
    cmocka_unit_test_setup_teardown(exr_keeps_the_attributes, set_up, tear_down),
};

SUITE(image, tests)
