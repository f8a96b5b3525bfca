// SPDX-License-Identifier: Apache-2.0
// Files of sums: back as they were written; each damaged bit and each length is noticed.
#include "render/film_file.h"
#include "tests/scenes.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ALL = (1 << LAYER_COUNT) - 1 };

typedef struct {
    Arena arena;
    char path[64], message[256];
    Film film, found;
    FilmOrigin origin, of;
} Fixture;

static int set_up(void **state) {
    Fixture *f = calloc(1, sizeof *f);
    *state = f;
    snprintf(f->path, sizeof f->path, "/tmp/st4-film-XXXXXX");
    int fd = mkstemp(f->path);
    if (fd < 0) {
        return -1;
    }
    close(fd);
    film_init(&f->film, &f->arena, ALL, 3, 2);
    f->film.x = 1;
    f->film.y = 4;
    for (uint32_t i = 0; i < 6; i++) {
        const FilmSample sample = {.color = {i, 1, 0.1 * i},
                                   .alpha = 1,
                                   .u = 0.1 * i,
                                   .index = 7,
                                   .is_hit = i > 0,
                                   .object = i / 2,
                                   .material = 3,
                                   .depth = i};
        film_add(&f->film, 1 + i % 3, 4 + i / 3, &sample);
    }
    static ImageAttribute attributes[] = {
        {.name = "sceneHash", .kind = ATTRIBUTE_STRING, .string = "0123"},
        {.name = "command", .kind = ATTRIBUTE_STRING, .string = "st4 a"},
        {.name = "expTime", .kind = ATTRIBUTE_FLOAT, .number = 0.1},
        {.name = "rate", .kind = ATTRIBUTE_RATIONAL, .numerator = -3, .denominator = 1001}};
    static ImageAttribute settings[] = {{.name = "bake", .kind = ATTRIBUTE_INT, .number = 1}};
    static FilmName objects[] = {{0, "ball"}, {1, "box \"1\""}, {2, ""}},
                    materials[] = {{3, "red"}};
    f->origin = (FilmOrigin){.width = 3,
                             .height = 2,
                             .x = 1,
                             .y = 4,
                             .full_width = 5,
                             .full_height = 6,
                             .layers = ALL,
                             .first = 7,
                             .n = 1,
                             .spp = 64,
                             .n_attributes = 4,
                             .n_settings = 1,
                             .attributes = attributes,
                             .settings = settings,
                             .names = {{objects, 3, 3}, {materials, 1, 1}}};
    return film_file_write(f->path, &f->film, &f->origin, f->message, sizeof f->message) ? 0 : -1;
}

static int tear_down(void **state) {
    Fixture *f = *state;
    unlink(f->path);
    arena_free(&f->arena);
    free(f);
    return 0;
}

static bool read_back(Fixture *f) {
    f->message[0] = '\0';
    return film_file_read(&f->arena, f->path, &f->found, &f->of, f->message, sizeof f->message);
}

static void film_files_come_back(void **state) {
    Fixture *f = *state;
    FilmDifference difference;
    assert_true(film_file_is(f->path));
    assert_true(read_back(f));
    size_t n, n_found;
    void *bytes = test_film_bytes(&f->film, &f->arena, &n);
    void *found = test_film_bytes(&f->found, &f->arena, &n_found);
    assert_int_equal(n_found, n);
    assert_memory_equal(found, bytes, n);
    assert_int_equal(f->found.x, 1);
    assert_int_equal(f->found.y, 4);
    assert_int_equal(f->of.names[0].n, 3);
    assert_string_equal(film_names_get(&f->of.names[0], 1), "box \"1\"");
    assert_string_equal(film_names_get(&f->of.names[1], 3), "red");
    assert_null(film_names_get(&f->of.names[1], 2));
    assert_int_equal(f->of.first, 7);
    assert_int_equal(f->of.n, 1);
    assert_int_equal(f->of.spp, 64);
    assert_true(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    f->of.attributes[1].string = "st4 b"; // the command may be another
    assert_true(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    f->of.attributes[3].numerator = 3;
    assert_false(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    assert_string_equal(difference.name, "rate");
    assert_string_equal(difference.a, "3/1001");
    assert_string_equal(difference.b, "-3/1001");
    f->of.n_attributes--;
    assert_false(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    assert_string_equal(difference.a, "not there");
    FilmTotals totals = film_totals(&f->found);
    assert_int_equal(totals.least, 1);
    assert_int_equal(totals.most, 1);
    assert_int_equal(totals.total, 6);
    f->of = f->origin;
    f->of.y = 3;
    assert_false(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    assert_string_equal(difference.a, "3x2 (crop 1,4,3,5 of 5x6)");
    f->of.y = 4;
    f->of.layers = 1 << LAYER_Z | 1 << LAYER_TIME;
    assert_false(film_origin_agrees(&f->arena, &f->of, &f->origin, &difference));
    assert_string_equal(difference.a, "z,time");
}

static void film_files_notice_damage(void **state) {
    Fixture *f = *state;
    struct stat s;
    assert_int_equal(stat(f->path, &s), 0);
    int fd = open(f->path, O_RDWR);
    assert_true(fd >= 0);
    for (off_t at = 0; at < s.st_size; at++) {
        for (int bit = 0; bit < 8; bit++) {
            unsigned char kept, byte;
            assert_int_equal(pread(fd, &kept, 1, at), 1);
            byte = (unsigned char)(kept ^ 1 << bit);
            assert_int_equal(pwrite(fd, &byte, 1, at), 1);
            assert_false(read_back(f));
            assert_true(f->message[0] != '\0');
            assert_int_equal(pwrite(fd, &kept, 1, at), 1);
        }
    }
    assert_true(read_back(f));
    for (off_t size = s.st_size - 1; size >= 0; size--) {
        assert_int_equal(ftruncate(fd, size), 0);
        assert_false(read_back(f));
    }
    close(fd);
    assert_false(film_file_is(f->path));
    unlink(f->path);
    assert_false(read_back(f));
    assert_false(film_file_is("/tmp"));
}

static void film_files_have_an_ending(void **state) {
    (void)state;
    assert_true(film_file_has_ending("a.st4film"));
    assert_true(film_file_has_ending("dir/a.0001.ST4FILM"));
    assert_false(film_file_has_ending(".st4film"));
    assert_false(film_file_has_ending("a.st4"));
    assert_false(film_file_has_ending("a.exr"));
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test_setup_teardown(film_files_come_back, set_up, tear_down),
    cmocka_unit_test_setup_teardown(film_files_notice_damage, set_up, tear_down),
    cmocka_unit_test(film_files_have_an_ending),
};

SUITE(film_file, tests)
