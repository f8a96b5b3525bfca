// SPDX-License-Identifier: Apache-2.0
// Layers of rendered scenes against what is known of the scenes: position, normal, albedo, depth
// and time; motion against differences of positions; Cryptomatte's ids, ranks and sums; variance
// against many seeds.
#include "lang/scene_load.h"
#include "render/cryptomatte.h"
#include "render/tiles.h"
#include "tests/near.h"
#include "tests/scenes.h"

#include <stdio.h>
#include <string.h>

enum { ALL = (1 << LAYER_COUNT) - 1 };
static const double PI = 3.141592653589793;

typedef struct {
    Arena arena;
    Scene scene;
    Film film;
} Picture;

static void report(void *context, SourceRef where, const char *name, const char *message) {
    (void)context, (void)where;
    if (!name) {
        print_error("%s\n", message);
    }
}

// Frame 1 of a script, all layers.
static void render(Picture *picture, const char *text, uint32_t spp, uint64_t seed,
                   uint32_t n_threads) {
    *picture = (Picture){0};
    Arena *arena = &picture->arena;
    Sources sources = {.arena = arena, .end = 1};
    Diag *diag = diag_new(arena, &sources, stderr, false, false);
    diag_set_warning(diag, "no-zero-shutter");
    LoadedScene loaded;
    scene_load(arena, &sources, diag, "layers.st4", text, strlen(text), NULL, &loaded);
    diag_finish(diag);
    assert_non_null(loaded.scene);
    picture->scene = *loaded.scene;
    scene_load_free(&loaded);
    Scene *scene = &picture->scene;
    scene->film.layers = ALL;
    const int64_t frame = 1;
    const RenderOptions options = {.frames = &frame,
                                   .n_frames = 1,
                                   .spp = spp,
                                   .seed = seed,
                                   .n_threads = n_threads,
                                   .accel = &accel_types[0],
                                   .accel_options = accel_options_default()};
    const Reporter reporter = {report, NULL};
    RenderStats stats = {0};
    PathScene paths;
    PathTroubles troubles = {.lights = ARENA_ARRAY(arena, scene->n_lights, bool),
                             .materials = ARENA_ARRAY(arena, scene->n_materials, bool)};
    Progress progress = {.kind = PROGRESS_NONE};
    uint32_t n_taken;
    world_place_camera(arena, scene);
    film_init(&picture->film, arena, scene->film.layers, scene->film.width, scene->film.height);
    path_scene_init(&paths, arena, scene);
    World *world = world_build(scene, &options, &frame, 1, &reporter, &n_taken, &stats);
    assert_non_null(world);
    const TilePass pass = {.frame = frame, .n = spp, .due = INFINITY};
    assert_int_equal(
        tiles_trace(&paths, world, &options, &pass, &picture->film, &progress, &stats, &troubles),
        TILES_DONE);
    world_destroy(world);
    assert_int_equal(stats.dropped_samples, 0);
}

static void discard(Picture *picture) {
    arena_free(&picture->arena);
}

static void make_image(Picture *picture, Image *image) {
    film_image(&picture->film, &picture->arena, image);
    FilmNames names[N_FILM_IDS];
    film_names_find(&picture->scene, &picture->film, &picture->arena, names);
    cryptomatte_add(names, &picture->film, &picture->arena, image);
}

static const float *values(const Image *image, const char *name) {
    const ImageChannel *channel = image_channel(image, name);
    assert_non_null(channel);
    return channel->values;
}

static Vec3 position(const Film *film, size_t i) {
    return vec3(film->position[i][0], film->position[i][1], film->position[i][2]);
}

// Frame periods after the beginning of frame 1.
static double time_of(const Film *film, size_t i) {
    return (double)film->time[i] / 0x1p19 / film->n_hits[i];
}

// A sphere of radius 1 at the origin before a wall, seen from z = 10.
static void layers_are_of_the_surface(void **state) {
    (void)state;
    Picture picture;
    render(&picture,
           "film { size = <32, 24> } shutter { length = 0s } render { bounces = 0 }\n"
           "camera { from = <0, 0, 10>  fov = 30deg }\n"
           "let red = matte(<0.75, 0.25, 0.125>)\n"
           "sphere { material = red }\n"
           "plane { normal = z  offset = -2  material = glow(<1, 1, 1>, 3) }\n",
           16, 0, 1);
    const Film *film = &picture.film;
    Image image;
    make_image(&picture, &image);
    int n_sphere = 0, n_wall = 0;
    for (size_t i = 0; i < 32 * 24; i++) {
        Vec3 p = position(film, i);
        Vec3 n = vec3(film->normal[i][0], film->normal[i][1], film->normal[i][2]);
        assert_near(film->depth[i], 10 - p.z, 2e-6);
        // The point is within its pixel's square.
        double scale = 24 / (2 * tan(15 * PI / 180) * (10 - p.z));
        assert_near(16 + p.x * scale, (double)(i % 32) + 0.5, 0.5001);
        assert_near(12 - p.y * scale, (double)(i / 32) + 0.5, 0.5001);
        assert_near(film->motion[i][0], 0, 0);
        assert_near(film->motion[i][1], 0, 0);
        assert_near(values(&image, "time")[i], 0, 0);
        if (p.z < -1) {
            n_wall++;
            assert_near(p.z, -2, 1e-6);
            assert_near(n.z, 1, 1e-6);
        } else {
            n_sphere++;
            assert_near(vec3_length(p), 1, 1e-6);
            assert_near(vec3_length(vec3_sub(n, p)), 0, 1e-6);
        }
    }
    assert_true(n_sphere > 40 && n_wall > 200);
    size_t middle = 12 * 32 + 16;
    assert_near(values(&image, "albedo.R")[middle], 0.75, 1e-7);
    assert_near(values(&image, "albedo.G")[middle], 0.25, 1e-7);
    assert_near(values(&image, "albedo.B")[middle], 0.125, 1e-7);
    assert_near(values(&image, "albedo.R")[0], 0, 0);
    assert_near(values(&image, "samples")[0], 16, 0);
    discard(&picture);
}

// ---- Motion

// A camera as the test knows it: at (x(t), 0, 10), looking along -z, fov 40 degrees, 40x30 pixels.
typedef struct {
    double speed; // metres per frame along x
} MovingCamera;

static void project(const MovingCamera *camera, Vec3 p, double frames, double out[2]) {
    double scale = 30 / (2 * tan(20 * PI / 180) * (10 - p.z));
    out[0] = 20 + (p.x - camera->speed * frames) * scale;
    out[1] = 15 - p.y * scale;
}

// Where the surface point that is at p at `frames` is at `later`, both in frame periods.
typedef Vec3 Carry(Vec3 p, double frames, double later);

static double worst_motion(const Film *film, const MovingCamera *camera, Carry *carry) {
    const double h = 1e-4;
    double worst = 0;
    int n = 0;
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        if (isinf(film->depth[i])) {
            continue;
        }
        double t = time_of(film, i), before[2], after[2];
        project(camera, carry(position(film, i), t, t - h), t - h, before);
        project(camera, carry(position(film, i), t, t + h), t + h, after);
        for (int k = 0; k < 2; k++) {
            double expected = (after[k] - before[k]) / (2 * h);
            worst = fmax(worst, fabs(film->motion[i][k] - expected));
        }
        n++;
    }
    assert_true(n > 100);
    return worst;
}

#define MOVING "film { size = <40, 30>  fps = 10 } render { bounces = 0 } sky { }\n"

static Vec3 carry_turning(Vec3 p, double frames, double later) {
    double a = 0.25 * (later - frames), c = cos(a), s = sin(a); // radians about y
    return vec3(c * p.x + s * p.z, p.y + 0.5 * (later - frames), c * p.z - s * p.x);
}

// With one sample in a pixel its time is that of what is seen, blur or not.
static void layers_motion_of_bodies(void **state) {
    (void)state;
    static const char body[] =
        "box { size = <4, 4, 4>  rotate y, 2.5rad*t  translate <0, 5*t, 0> }\n";
    static const char *const shutters[] = {"length = 0s", "angle = 360deg", "length = 3f"};
    static const char *const cameras[] = {"<0, 0, 10>  to = <0, 0, 0>",
                                          "<7*t, 0, 10>  to = <7*t, 0, 0>"};
    for (int i = 0; i < 6; i++) {
        char text[512];
        snprintf(text, sizeof text, MOVING "shutter { %s } camera { from = %s  fov = 40deg }\n%s",
                 shutters[i % 3], cameras[i / 3], body);
        Picture picture;
        render(&picture, text, 1, 0, 1);
        const MovingCamera camera = {i / 3 ? 0.7 : 0};
        // Float positions, times to 2e-6 of a frame. Measured: 3.1e-7.
        assert_near(worst_motion(&picture.film, &camera, carry_turning), 0, 2e-6);
        discard(&picture);
    }
}

static Vec3 carry_wave(Vec3 p, double frames, double later) {
    p.y += 0.5 * (sin(2 * later + p.x) - sin(2 * frames + p.x));
    return p;
}

static void layers_motion_of_a_deforming_mesh(void **state) {
    (void)state;
    Picture picture;
    render(&picture,
           MOVING "shutter { angle = 360deg } camera { from = <0, 0, 10>  fov = 40deg }\n"
                  "surface {\n"
                  "  u = -3..3  v = -2..2  res = <64, 4>  tolerance = 0.001px\n"
                  "  fn at(u, v) = <u, v, 0>\n"
                  "  fn deform(p) = <p.x, p.y + 0.5*sin(20*1rad*t + p.x*1rad), p.z>\n"
                  "}\n",
           1, 0, 1);
    // The motion is that of the sampled one, straight between instants. A wave of 8.2 pixels per
    // frame^2 is a tolerance of 0.001 pixels off its chords over 0.031 frames, and its slope then
    // 0.128 pixels per frame. Measured: 0.062.
    assert_near(worst_motion(&picture.film, &(MovingCamera){0}, carry_wave), 0, 0.128);
    discard(&picture);
}

// The camera turns by 0.1 radians a frame: what is infinitely far moves too.
static void layers_motion_of_the_sky(void **state) {
    (void)state;
    Picture picture;
    render(&picture,
           MOVING "shutter { angle = 180deg }\n"
                  "camera { from = <0, 0, 0>  to = <sin(1rad*t), 0, -cos(1rad*t)>  fov = 40deg }\n"
                  "sphere { center = <0, 100, 0> }\n",
           1, 0, 1);
    const Film *film = &picture.film;
    double focal = 15 / tan(20 * PI / 180);
    size_t i = 15 * 40 + 20; // near the middle
    assert_true(isinf(film->depth[i]));
    assert_near(film->motion[i][0], -0.1 * focal, 0.01);
    assert_near(film->motion[i][1], 0, 0.01);
    discard(&picture);
}

// ---- Cryptomatte

static float id_of(const char *name) {
    uint32_t bits = cryptomatte_id(name);
    float id;
    memcpy(&id, &bits, 4);
    return id;
}

// MurmurHash3's values are those of its author's program; the ids those of the unit tests that are
// published with the specification.
static void layers_cryptomatte_ids(void **state) {
    (void)state;
    assert_int_equal(cryptomatte_hash(""), 0);
    assert_int_equal(cryptomatte_hash("test"), 0xba6bd213);
    assert_int_equal(cryptomatte_hash("Hello, world!"), 0xc0363e43);
    assert_int_equal(cryptomatte_hash("The quick brown fox jumps over the lazy dog"), 0x2e4ff723);
    static const struct {
        const char *name;
        double id;
    } known[] = {
        {"hello", 6.0705627102400005616e-17},
        {"cube", -4.08461912519e+15},
        {"sphere", 2.79018604383e+15},
        {"plane", 3.66557617593e-11},
        {"\xd1\x80\xd0\xb0\xd0\xb2\xd0\xbd\xd0\xb8\xd0\xbd\xd0\xb0", -1.3192631212399999468e-25},
        {"m\xc3\xa4"
         "dchen",
         6.2361298211599995797e+25},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        assert_near(id_of(known[i].name), known[i].id, 1e-11 * fabs(known[i].id));
    }
    // No name gives what is no ordinary number.
    for (int i = 0; i < 100000; i++) {
        char name[16];
        snprintf(name, sizeof name, "o%d", i);
        assert_true(isnormal(id_of(name)));
    }
}

// What is not seen is not in the manifest; ranks fall; the rest is 0.
static void layers_cryptomatte_picture(void **state) {
    (void)state;
    Picture picture;
    render(&picture,
           "film { size = <24, 16>  transparent = true } shutter { angle = 360deg }\n"
           "camera { from = <0, 0, 10>  fov = 30deg }\n"
           "let red = matte(<0.7, 0.2, 0.1>)\n"
           "group Car { for i in 0..2 { box Wheel[i] {\n"
           "  translate <1.2*i - 1.2 + 8*t, 0, 0>  material = red } } }\n"
           "sphere Ball { radius = 2  center = <-1, 0, -3>  material = metal(<1, 1, 1>, 0.3) }\n"
           "sphere Hidden { radius = 0.1  center = <-1, 0, -3> }\n",
           64, 0, 1);
    Image image;
    make_image(&picture, &image);
    static const char *const names[2][4] = {
        {"Ball", "Car/Wheel[0]", "Car/Wheel[1]", "Car/Wheel[2]"}, {"red", "metal@6", NULL, NULL}};
    static const char *const prefix[2] = {"CryptoObject", "CryptoMaterial"};
    bool has_two = false;
    for (int layer = 0; layer < 2; layer++) {
        for (size_t i = 0; i < 24 * 16; i++) {
            double sum = 0, last = 1;
            for (int k = 0; k < CRYPTOMATTE_IDS; k++) {
                char name[32];
                snprintf(name, sizeof name, "%s%02d.%c", prefix[layer], k / 2, "RB"[k % 2]);
                float id = values(&image, name)[i];
                snprintf(name, sizeof name, "%s%02d.%c", prefix[layer], k / 2, "GA"[k % 2]);
                double coverage = (double)values(&image, name)[i];
                bool is_known = id == 0 && coverage == 0;
                for (int n = 0; n < 4 && names[layer][n]; n++) {
                    is_known |= id == id_of(names[layer][n]) && coverage > 0;
                }
                assert_true(is_known);
                assert_true(coverage <= last);
                has_two |= k == 1 && coverage > 0;
                last = coverage;
                sum += coverage;
            }
            assert_near(sum, values(&image, "A")[i], 1e-6);
        }
    }
    assert_true(has_two);
    int n_found = 0;
    for (uint32_t i = 0; i < image.n_attributes; i++) {
        const ImageAttribute *a = &image.attributes[i];
        char expected[256];
        if (strstr(a->name, "/manifest") && strstr(a->string, "Ball")) {
            n_found++;
            assert_null(strstr(a->string, "Hidden"));
            snprintf(expected, sizeof expected, "\"Car/Wheel[1]\":\"%08x\"",
                     (unsigned)cryptomatte_id("Car/Wheel[1]"));
            assert_non_null(strstr(a->string, expected));
            char key[64];
            snprintf(key, sizeof key, "%08x", (unsigned)cryptomatte_hash("CryptoObject"));
            key[7] = 0;
            assert_int_equal(strncmp(a->name + strlen("cryptomatte/"), key, 7), 0);
        }
    }
    assert_int_equal(n_found, 1);
    discard(&picture);
}

// More things in a pixel than ranks: the largest are kept, exactly counted.
static void layers_cryptomatte_crowds(void **state) {
    (void)state;
    Picture picture;
    render(&picture,
           "film { size = <4, 4>  transparent = true } shutter { length = 0s }\n"
           "camera { from = <0, 0, 10>  kind = orthographic  fov = 40deg }\n"
           "for i in 0..39 { for j in 0..39 { quad Dot[40*i + j] {\n"
           "  size = <0.2, 0.2>  translate <0.2*i - 3.9, 0.2*j - 3.9, 0> } } }\n",
           4096, 0, 2);
    const Film *film = &picture.film;
    FilmCounts room = {0};
    for (size_t i = 0; i < 16; i++) {
        uint32_t n = film_counts(film, LAYER_OBJECT, i, &picture.arena, &room), sum = 0;
        assert_true(n > 80);
        for (uint32_t k = 0; k < n; k++) {
            sum += room.counts[k].n;
        }
        assert_int_equal(sum, film->sum[i][3] >> 28);
    }
    discard(&picture);
}

// ---- Variance

// Independent samples: the mean of the estimates is the variance over the seeds.
static void layers_variance_is_right(void **state) {
    (void)state;
    enum { N = 32, SEEDS = 20000 };
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 1 << LAYER_VARIANCE, 1, 1);
    uint64_t random = 88172645463325252u;
    double sum = 0, square = 0, estimate = 0;
    for (int seed = 0; seed < SEEDS; seed++) {
        film_clear(&film);
        for (uint32_t i = 0; i < N; i++) {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            double u = (double)(random >> 11) * 0x1p-53;
            FilmSample s = {.color = {u < 0.25 ? 1000 : 0, 1e-4 * u, 3}, .alpha = 1, .index = i};
            assert_true(film_add(&film, 0, 0, &s));
        }
        Arena own = {0};
        Image image;
        film_image(&film, &own, &image);
        double mean = (double)values(&image, "R")[0];
        sum += mean;
        square += mean * mean;
        estimate += (double)values(&image, "variance.R")[0];
        assert_near(values(&image, "variance.B")[0], 0, 0);
        assert_true(values(&image, "variance.G")[0] > 0);
        arena_free(&own);
    }
    double spread = square / SEEDS - sum / SEEDS * (sum / SEEDS);
    double exact = 1000.0 * 1000 * 0.25 * 0.75 / N;
    assert_near(estimate / SEEDS / exact, 1, 0.005);
    assert_near(spread / exact, 1, 0.05);
    arena_free(&arena);
}

// Samples of a picture are spread evenly, so the truth lies below, and not by orders of magnitude
// where light has to be found.
static void layers_variance_bounds_the_true_one(void **state) {
    (void)state;
    enum { SEEDS = 64, PIXELS = 8 * 8 };
    double sum[PIXELS] = {0}, square[PIXELS] = {0}, estimate = 0, spread = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        Picture picture;
        render(&picture,
               "film { size = <8, 8> } shutter { length = 0s } render { bounces = 2 }\n"
               "camera { from = <0, 2, 6>  fov = 40deg }\n"
               "plane { } sphere { center = y } sphere { center = <2, 3, 1>  radius = 0.5\n"
               "  material = glow(<1, 1, 1>, 20) }\n",
               16, seed, 2);
        Image image;
        make_image(&picture, &image);
        for (int i = 0; i < PIXELS; i++) {
            double mean = (double)values(&image, "R")[i];
            sum[i] += mean;
            square[i] += mean * mean;
            estimate += (double)values(&image, "variance.R")[i] / SEEDS;
        }
        discard(&picture);
    }
    for (int i = 0; i < PIXELS; i++) {
        double mean = sum[i] / SEEDS;
        spread += (square[i] / SEEDS - mean * mean) * SEEDS / (SEEDS - 1);
    }
    // Measured: 0.37.
    assert_true(spread <= 1.15 * estimate && spread >= 0.2 * estimate);
}

static void layers_are_the_same_for_any_threads(void **state) {
    (void)state;
    static const uint32_t threads[] = {1, 2, 5};
    Arena arena = {0};
    void *first = NULL;
    size_t n_first = 0, n;
    for (int i = 0; i < 3; i++) {
        Picture picture;
        render(
            &picture,
            "film { size = <40, 40> } shutter { angle = 360deg }\n"
            "camera { from = <0, 2, 12>  fov = 40deg }\n"
            "for i in 0..9 { for j in 0..9 { sphere { radius = 0.3\n"
            "  center = <i - 4.5 + 24*t, j - 4.5, 0>  material = gloss(<0.1*i, 0.5, 0.1*j>, 0.2)\n"
            "} } } plane { offset = -5 }\n",
            16, 7, threads[i]);
        void *bytes = test_film_bytes(&picture.film, i ? &picture.arena : &arena, &n);
        first = i ? first : bytes;
        n_first = i ? n_first : n;
        assert_int_equal(n, n_first);
        assert_memory_equal(bytes, first, n);
        discard(&picture);
    }
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(layers_are_of_the_surface),
    cmocka_unit_test(layers_motion_of_bodies),
    cmocka_unit_test(layers_motion_of_a_deforming_mesh),
    cmocka_unit_test(layers_motion_of_the_sky),
    cmocka_unit_test(layers_cryptomatte_ids),
    cmocka_unit_test(layers_cryptomatte_picture),
    cmocka_unit_test(layers_cryptomatte_crowds),
    cmocka_unit_test(layers_variance_is_right),
    cmocka_unit_test(layers_variance_bounds_the_true_one),
    cmocka_unit_test(layers_are_the_same_for_any_threads),
};

SUITE(layers, tests)
