// SPDX-License-Identifier: Apache-2.0
// Whole runs: names of files, the same bytes for any threads and any company, what can not be
// written, interruption, statistics.
#include "render/image.h"
#include "tests/near.h"
#include "tests/scenes.h"

#include <dirent.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <unistd.h>

static void frames_have_names(void **state) {
    (void)state;
    static const struct {
        const char *pattern;
        int64_t frame;
        bool many;
        const char *expected; // NULL: refused
    } cases[] = {
        {"a.exr", 7, false, "a.exr"},
        {"a.exr", 7, true, "a.0007.exr"},
        {"dir.d/a", 7, true, "dir.d/a.0007"},
        {".hidden", 7, true, ".hidden.0007"},
        {"a.####.exr", 7, false, "a.0007.exr"},
        {"a#.exr", 123, true, "a123.exr"},
        {"a.%04d.exr", 12345, true, "a.12345.exr"},
        {"%03d/a.exr", 7, true, "007/a.exr"},
        {"a.####.exr", -3, true, "a.-003.exr"},
        {"a.##.#.exr", 7, true, NULL},
        {"a.##.%02d.exr", 7, true, NULL},
        {"a.%s.exr", 7, true, NULL},
        {"a.%n.exr", 7, true, NULL},
        {"a.%.exr", 7, true, NULL},
        {"a.%%.exr", 7, true, NULL},
        {"a.%099999d.exr", 7, true, NULL},
        {"a.%4d.exr", 7, true, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char path[64];
        bool is_fine =
            render_frame_path(cases[i].pattern, cases[i].frame, cases[i].many, path, sizeof path);
        assert_int_equal(is_fine, cases[i].expected != NULL);
        if (is_fine) {
            assert_string_equal(path, cases[i].expected);
        }
    }
    char small[8];
    assert_false(render_frame_path("a.####.exr", 1, true, small, sizeof small));
    assert_true(render_frame_path("a.#.ex", 1, true, small, sizeof small));
}

// A folder of its own for each test.
static void make_folder(char folder[64]) {
    snprintf(folder, 64, "/tmp/st4-frames-XXXXXX");
    assert_non_null(mkdtemp(folder));
}

static int remove_folder(const char *folder) {
    int n = 0;
    char path[512];
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        if (strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..")) {
            snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
            unlink(path);
            n++;
        }
    }
    if (dir) {
        closedir(dir);
    }
    rmdir(folder);
    return n; // files that were there
}

static void make_scene(TestScene *test) {
    test_scene_init(test, 40, 30);
    test_camera(test, CAMERA_PERSPECTIVE, 10, 0.7);
    test->scene.shutter = (ShutterSettings){.length = 0.5, .open = -0.25};
    test->scene.render.bounces = 2;
    test_light(test, LIGHT_SKY, (double[]){0.4, 0.5, 0.8, 1}, 4);
    test_light(test, LIGHT_SUN, (double[]){1, 2, 2, 3, 1, 1, 1, 0.01}, 8);
    uint32_t red = test_material(test, MATERIAL_MATTE, (double[]){0.8, 0.2, 0.1}, 3);
    test_moving_sphere(test, red, vec3(-1, 0, 0), vec3(12, 0, 0), 1);
    test_moving_square(test, red, vec3(0, 0, -2), vec3(0, -8, 0), 3);
}

static int render(TestScene *test, const char *out, const int64_t *frames, uint32_t n,
                  uint32_t n_threads, RenderStats *stats) {
    test->n_threads = n_threads;
    RenderOptions options = test_options(test, 8);
    options.frames = frames;
    options.n_frames = n;
    options.out = out;
    *stats = (RenderStats){0};
    return render_frames(&test->scene, &options, &test->reporter, stats);
}

static char *read_whole(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*size + 1);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    bytes[*size] = 0;
    fclose(file);
    return bytes;
}

static void assert_same_file(const char *a, const char *b) {
    size_t n, m;
    char *x = read_whole(a, &n), *y = read_whole(b, &m);
    assert_int_equal(n, m);
    assert_memory_equal(x, y, n);
    free(x);
    free(y);
}

static void frames_are_the_same_bytes(void **state) {
    (void)state;
    static const int64_t all[] = {1, 2, 3}, one[] = {2};
    char folder[64], out[128], expected[128], found[128];
    make_folder(folder);
    snprintf(expected, sizeof expected, "%s/all1.0002.exr", folder);
    static const uint32_t threads[] = {1, 2, 5};
    for (int i = 0; i < 3; i++) {
        TestScene test;
        make_scene(&test);
        RenderStats stats;
        snprintf(out, sizeof out, "%s/all%u.####.exr", folder, threads[i]);
        assert_int_equal(render(&test, out, all, 3, threads[i], &stats), 0);
        assert_int_equal(stats.n_frames, 3);
        assert_int_equal(stats.camera_rays, 3 * 40 * 30 * 8);
        snprintf(found, sizeof found, "%s/all%u.0002.exr", folder, threads[i]);
        assert_same_file(found, expected);
        snprintf(out, sizeof out, "%s/one%u.exr", folder, threads[i]);
        assert_int_equal(render(&test, out, one, 1, threads[i], &stats), 0);
        assert_same_file(out, expected);
        test_scene_free(&test);
    }
    assert_int_equal(remove_folder(folder), 12);
}

static const ImageAttribute *attribute(const Image *image, const char *name) {
    for (uint32_t i = 0; i < image->n_attributes; i++) {
        if (!strcmp(image->attributes[i].name, name)) {
            return &image->attributes[i];
        }
    }
    return NULL;
}

static void frames_say_how_they_were_made(void **state) {
    (void)state;
    char folder[64], out[128], message[256];
    make_folder(folder);
    snprintf(out, sizeof out, "%s/a.exr", folder);
    TestScene test;
    make_scene(&test);
    test.scene.film.fps = 24000.0 / 1001;
    RenderStats stats;
    const int64_t frame = 1;
    assert_int_equal(render(&test, out, &frame, 1, 1, &stats), 0);
    Image image;
    assert_true(image_read_exr(&test.arena, out, &image, message, sizeof message));
    assert_int_equal(image.width, 40);
    assert_int_equal(image.height, 30);
    static const char *const channels[] = {"R", "G", "B", "A", "Z", "normal.X", "samples"};
    for (int i = 0; i < 7; i++) {
        assert_non_null(image_channel(&image, channels[i]));
    }
    assert_near(image_channel(&image, "samples")->values[77], 8, 0);
    assert_near(image_channel(&image, "A")->values[0], 1, 0);
    const ImageAttribute *rate = attribute(&image, "framesPerSecond");
    assert_non_null(rate);
    assert_int_equal(rate->numerator, 24000);
    assert_int_equal(rate->denominator, 1001);
    assert_near(attribute(&image, "expTime")->number, 0.5 * 1001 / 24000, 1e-8);
    assert_string_equal(attribute(&image, "sceneHash")->string, test.scene.hash);
    assert_string_equal(attribute(&image, "seed")->string, "0");
    assert_near(attribute(&image, "samples")->number, 8, 0);
    remove_folder(folder);
    test_scene_free(&test);
}

static void frames_refuse_bad_outputs(void **state) {
    (void)state;
    char folder[64], ending[128];
    make_folder(folder);
    snprintf(ending, sizeof ending, "%s/a.xyz", folder);
    const char *outs[] = {"/no/such/folder/a.exr", folder, ending, "a.#.#.exr", "/dev/null/a.exr"};
    for (int i = 0; i < 5; i++) {
        TestScene test;
        make_scene(&test);
        RenderStats stats;
        const int64_t frame = 1;
        assert_int_equal(render(&test, outs[i], &frame, 1, 1, &stats), 3);
        assert_int_equal(test.n_errors, 1);
        assert_non_null(strstr(test.message, outs[i]));
        assert_int_equal(stats.camera_rays, 0);
        test_scene_free(&test);
    }
    assert_int_equal(remove_folder(folder), 0);
}

static void interrupt_on_alarm(int number) {
    (void)number;
    raise(SIGINT);
}

// A run of hours, stopped after some milliseconds: no file, nothing temporary left.
static void frames_stop_when_interrupted(void **state) {
    (void)state;
    signal(SIGINT, SIG_DFL); // a shell's background jobs are born with it ignored
    char folder[64], out[128];
    make_folder(folder);
    snprintf(out, sizeof out, "%s/a.exr", folder);
    TestScene test;
    make_scene(&test);
    RenderOptions options = test_options(&test, 1 << 30);
    options.out = out;
    options.n_threads = 2;
    struct sigaction action = {.sa_handler = interrupt_on_alarm, .sa_flags = SA_RESTART}, before;
    struct sigaction interrupt_before, interrupt_after;
    sigaction(SIGALRM, &action, &before);
    sigaction(SIGINT, NULL, &interrupt_before);
    struct itimerval soon = {.it_value = {.tv_usec = 100000}};
    setitimer(ITIMER_REAL, &soon, NULL);
    RenderStats stats = {0};
    assert_int_equal(render_frames(&test.scene, &options, &test.reporter, &stats), 130);
    sigaction(SIGINT, NULL, &interrupt_after);
    assert_true(interrupt_after.sa_handler == interrupt_before.sa_handler);
    sigaction(SIGALRM, &before, NULL);
    assert_int_equal(stats.n_frames, 0);
    assert_int_equal(test.n_errors, 0);
    test_scene_free(&test);
    assert_int_equal(remove_folder(folder), 0);
}

// A camera at its own target, a light of no direction, a material that is not a number: one
// warning each, and a picture.
static void frames_warn_of_what_is_not_finite(void **state) {
    (void)state;
    char folder[64], out[128];
    make_folder(folder);
    snprintf(out, sizeof out, "%s/a.exr", folder);
    TestScene test;
    make_scene(&test);
    test_light(&test, LIGHT_SUN, (double[]){0, 0, 0, 3, 1, 1, 1, 0.01}, 8);
    uint32_t bad = test_material(&test, MATERIAL_MATTE, (double[]){NAN, 0, 0}, 3);
    test_moving_sphere(&test, bad, vec3(1, 1, 0), vec3(0, 0, 0), 1);
    RenderStats stats;
    static const int64_t frames[] = {1, 2};
    assert_int_equal(render(&test, out, frames, 2, 2, &stats), 0);
    assert_int_equal(test.n_warnings, 2);
    assert_int_equal(stats.dropped_samples, 0);
    test_camera(&test, CAMERA_PERSPECTIVE, 0, 0.7);
    test.n_warnings = 0;
    assert_int_equal(render(&test, out, frames, 1, 2, &stats), 0);
    assert_true(test.n_warnings >= 1);
    assert_int_equal(stats.camera_rays, 0);
    assert_int_equal(test.n_errors, 0);
    test_scene_free(&test);
    remove_folder(folder);
}

// Without a camera the picture shows the thing, whole.
static void frames_place_a_camera(void **state) {
    (void)state;
    char folder[64], out[128], message[256];
    make_folder(folder);
    snprintf(out, sizeof out, "%s/a.exr", folder);
    TestScene test;
    test_scene_init(&test, 40, 30);
    test.scene.film.transparent = true;
    uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    test_moving_sphere(&test, glow, vec3(100, 0, 0), vec3(0, 0, 0), 1);
    RenderStats stats;
    const int64_t frame = 1;
    assert_int_equal(render(&test, out, &frame, 1, 1, &stats), 0);
    Image image;
    assert_true(image_read_exr(&test.arena, out, &image, message, sizeof message));
    const float *alpha = image_channel(&image, "A")->values;
    double sum = 0;
    for (int i = 0; i < 40 * 30; i++) {
        bool is_border = i < 40 || i >= 40 * 29 || i % 40 == 0 || i % 40 == 39;
        assert_true(!is_border || alpha[i] == 0);
        sum += alpha[i];
    }
    assert_true(sum > 100);
    test_scene_free(&test);
    remove_folder(folder);
}

static void stats_are_json(void **state) {
    (void)state;
    char folder[64], path[128], message[256];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/stats.json", folder);
    RenderStats stats = {.trace_seconds = 1.5, .camera_rays = 1ull << 60, .time_samples = 77};
    stats.accel.kappa_max = INFINITY;
    assert_true(render_write_stats(path, &stats, message, sizeof message));
    size_t size;
    char *text = read_whole(path, &size);
    static const char *const parts[] = {"\"version\": 1", "\"trace\": 1.5", "\"time\": 77",
                                        "\"camera\": 1152921504606846976", "\"kappa_max\": null"};
    for (int i = 0; i < 5; i++) {
        assert_non_null(strstr(text, parts[i]));
    }
    int depth = 0;
    for (size_t i = 0; i < size; i++) {
        depth += (text[i] == '{') - (text[i] == '}');
        assert_true(depth >= 0);
    }
    assert_int_equal(depth, 0);
    free(text);
    assert_false(render_write_stats("/no/such/folder/s.json", &stats, message, sizeof message));
    remove_folder(folder);
}

// Any part of a picture is the same pixels as in the whole, all layers, and says where it belongs.
static void frames_crop(void **state) {
    (void)state;
    static const struct {
        uint32_t x0, x1, y0, y1;
    } crops[] = {{0, 40, 0, 30}, {0, 1, 0, 1}, {39, 40, 29, 30}, {7, 33, 11, 29}, {0, 40, 13, 14}};
    TestScene test;
    make_scene(&test);
    test.scene.film.layers = (1u << LAYER_COUNT) - 1;
    char folder[64], path[128], message[256];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/whole.exr", folder);
    RenderOptions options = test_options(&test, 4);
    options.out = path;
    RenderStats stats = {0};
    assert_int_equal(render_frames(&test.scene, &options, &test.reporter, &stats), 0);
    Image whole;
    assert_true(image_read_exr(&test.arena, path, &whole, message, sizeof message));
    assert_int_equal(whole.crop.width, 0);
    for (size_t i = 0; i < sizeof crops / sizeof *crops; i++) {
        uint32_t x0 = crops[i].x0, y0 = crops[i].y0;
        snprintf(path, sizeof path, "%s/%zu.exr", folder, i);
        options.crop_x0 = x0;
        options.crop_x1 = crops[i].x1;
        options.crop_y0 = y0;
        options.crop_y1 = crops[i].y1;
        assert_int_equal(render_frames(&test.scene, &options, &test.reporter, &stats), 0);
        Image part;
        assert_true(image_read_exr(&test.arena, path, &part, message, sizeof message));
        assert_int_equal(part.width, crops[i].x1 - x0);
        assert_int_equal(part.height, crops[i].y1 - y0);
        assert_int_equal(part.crop.width, i ? 40 : 0);
        assert_int_equal(part.crop.x, i ? x0 : 0);
        assert_int_equal(part.crop.y, i ? y0 : 0);
        assert_int_equal(part.n_channels, whole.n_channels);
        for (uint32_t c = 0; c < part.n_channels; c++) {
            assert_string_equal(part.channels[c].name, whole.channels[c].name);
            for (uint32_t y = 0; y < part.height; y++) {
                assert_memory_equal(part.channels[c].values + (size_t)y * part.width,
                                    whole.channels[c].values + (size_t)(y0 + y) * 40 + x0,
                                    part.width * sizeof(float));
            }
        }
    }
    assert_int_equal(remove_folder(folder), 6);
    test_scene_free(&test);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(frames_crop),
    cmocka_unit_test(frames_have_names),
    cmocka_unit_test(frames_are_the_same_bytes),
    cmocka_unit_test(frames_say_how_they_were_made),
    cmocka_unit_test(frames_refuse_bad_outputs),
    cmocka_unit_test(frames_stop_when_interrupted),
    cmocka_unit_test(frames_warn_of_what_is_not_finite),
    cmocka_unit_test(frames_place_a_camera),
    cmocka_unit_test(stats_are_json),
};

SUITE(frames, tests)
