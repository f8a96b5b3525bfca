// SPDX-License-Identifier: Apache-2.0
// Instances against the same scene written out: a copy for each, which is told the time that the
// instance's clock shows, so that each has arrays of its own and all of them go by the film's
// clock.
#include "render/instance_set.h"
#include "render/local_time.h"
#include "render/world_parts.h"
#include "tests/hand_scene.h"
#include "tests/script_scene.h"
#include "tests/suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    ScriptScene *script;
    World *world;
    RenderStats stats;
} Made;

static Made *make(const char *text, int64_t n_frames) {
    Made *made = calloc(1, sizeof *made);
    made->script = script_scene_new(text, NULL);
    int64_t frames[64];
    for (int64_t i = 0; i < n_frames; i++) {
        frames[i] = i + 1;
    }
    RenderOptions options = hand_options();
    Reports reports;
    Reporter reporter = hand_reporter(&reports);
    uint32_t taken;
    options.tolerance = 0.002;
    options.validate = true;
    made->world = world_build(script_scene(made->script), &options, frames, (uint32_t)n_frames,
                              &reporter, &taken, &made->stats);
    assert_non_null(made->world);
    assert_int_equal(taken, n_frames);
    return made;
}

static void unmake(Made *made) {
    world_destroy(made->world);
    script_scene_free(made->script);
    free(made);
}

static Vec3 random_in(uint64_t *seed, Vec3 lo, Vec3 hi) {
    double x = hand_random(seed), y = hand_random(seed), z = hand_random(seed);
    return vec3(lo.x + x * (hi.x - lo.x), lo.y + y * (hi.y - lo.y), lo.z + z * (hi.z - lo.z));
}

typedef struct {
    uint32_t n_hits, n_other, n_fast; // other: one of the two missed, or hit something else
} Agreement;

// One ray at one instant in both worlds. size: of what is hit, metres.
static void compare_ray(WorldView *const views[2], Vec3 o, Vec3 d, double size,
                        Agreement *agreement) {
    WorldHit hit[2];
    bool is_hit[2];
    for (int k = 0; k < 2; k++) {
        is_hit[k] = world_closest(views[k], o, d, 0, INFINITY, &hit[k]);
        assert_int_equal(world_occluded(views[k], o, d, 0, INFINITY), is_hit[k]);
    }
    agreement->n_hits += is_hit[0] && is_hit[1];
    if (is_hit[0] != is_hit[1] || (is_hit[0] && hit[0].object != hit[1].object)) {
        agreement->n_other++;
        return;
    }
    if (!is_hit[0]) {
        return;
    }
    SurfacePoint point[2];
    for (int k = 0; k < 2; k++) {
        world_surface(views[k], o, d, &hit[k], &point[k]);
    }
    // Where a surface is seen edge on, or another part of it is met, distances say little.
    bool is_same = fabs(hit[0].t - hit[1].t) * vec3_length(d) <= 2e-3 * size;
    double speed = vec3_length(point[1].velocity);
    double off = vec3_length(vec3_sub(point[0].velocity, point[1].velocity));
    agreement->n_other += !is_same;
    agreement->n_fast += is_same && off > 0.05 * speed + 0.05 * size;
}

// Rays from a shell around the box, through it, at instants of frames that are rendered.
static void agree(const char *instanced, const char *flat, Vec3 lo, Vec3 hi, double size,
                  uint32_t n_sets) {
    enum { RAYS = 6000, FRAMES = 3 };
    Made *made[2] = {make(instanced, FRAMES), make(flat, FRAMES)};
    WorldView *views[2];
    Agreement agreement = {0};
    uint64_t seed = 7;
    assert_int_equal(made[0]->world->parts.n_sets, n_sets);
    for (int k = 0; k < 2; k++) {
        views[k] = world_view_new(made[k]->world);
    }
    for (int i = 0; i < RAYS; i++) {
        Instant at = instant_at(i % FRAMES, (hand_random(&seed) - 0.5) * 0.5);
        Vec3 to = random_in(&seed, lo, hi),
             around = random_in(&seed, vec3(-1, -1, -1), vec3(1, 1, 1));
        double far = vec3_length(vec3_sub(hi, lo));
        Vec3 o = vec3_madd(to, 2 * far, vec3_normalize(around));
        for (int k = 0; k < 2; k++) {
            world_view_time(views[k], at);
        }
        compare_ray(views, o, vec3_sub(to, o), size, &agreement);
    }
    for (int k = 0; k < 2; k++) {
        world_view_destroy(views[k], NULL);
        unmake(made[k]);
    }
    assert_true(agreement.n_hits > RAYS / 20);
    assert_true(agreement.n_other <= RAYS / 100);
    assert_true(agreement.n_fast <= RAYS / 100);
}

// What both kinds of scenes have: shapes that deform, turn and grow by c.
#define PARTS                                                                                      \
    " surface { res = <8, 8> fn at(u, v) = <u - 0.5, v + 0.3*sin(1turn*(u + C)), "                 \
    "0.4*cos(2turn*C)> }"                                                                          \
    " sphere { radius = 0.2 + 0.1*sin(1turn*C) translate <0, 1.2, 0.2*cos(1turn*C)> }"             \
    " box { size = <0.2, 0.3 + 0.1*sin(1turn*C), 0.2> translate <0.7, 0.2, 0> }"                   \
    " rotate y, 1turn*C "

static char *with_clock(const char *head, const char *clock, const char *tail) {
    char *text = calloc(1, 8192), *to = text;
    to += sprintf(to, "film { fps = 24 frames = 1..3 size = <200, 200> }\n%s {", head);
    for (const char *p = PARTS; *p; p++) {
        to += *p == 'C' ? sprintf(to, "%s", clock) : sprintf(to, "%c", *p);
    }
    sprintf(to, "}\n%s", tail);
    return text;
}

static void agree_by(const char *instances, const char *copies, Vec3 lo, Vec3 hi, double size,
                     uint32_t n_sets) {
    char *instanced = with_clock("def Thing", "t", instances);
    char *flat = with_clock("def Thing(c)", "c", copies);
    agree(instanced, flat, lo, hi, size, n_sets);
    free(instanced);
    free(flat);
}

static void few_instances(void **state) {
    (void)state;
    agree_by("instance Thing { speed = 2.3 offset = 0.4s cycle = 0.7s translate <-2, 0, 0> }"
             "instance Thing { speed = -1 cycle = 0.04s translate <1*t, 0, 0> }"
             "instance Thing { clock = 0.2*sin(1turn*t) scale <-1, 1, 1> translate <2, 0, 0> }",
             "Thing((2.3*t + 0.4) % 0.7) { translate <-2, 0, 0> }"
             "Thing((-1*t) % 0.04) { translate <1*t, 0, 0> }"
             "Thing(0.2*sin(1turn*t)) { scale <-1, 1, 1> translate <2, 0, 0> }",
             vec3(-3, -1, -1), vec3(3, 2, 1), 1, 0);
}

// Enough of them for sets, with all that records hold: speeds of both signs, cycles of their own.
static void sets(void **state) {
    (void)state;
    agree_by("for i in 0..99 { instance Thing { speed = 2*rand(1, i) - 1 offset = rand(2, i)*1s"
             " cycle = 0.05s + 0.5s*rand(3, i) scale <1, 1 + rand(4, i), (i % 2 == 0 ? 1 : -1)>"
             " rotate y, rand(5, i)*1turn translate <3*(i % 10), 0, 3*floor(i / 10)> } }",
             "for i in 0..99 { Thing(((2*rand(1, i) - 1)*t + rand(2, i)) % (0.05 + 0.5*rand(3, i)))"
             " { scale <1, 1 + rand(4, i), (i % 2 == 0 ? 1 : -1)>"
             " rotate y, rand(5, i)*1turn translate <3*(i % 10), 0, 3*floor(i / 10)> } }",
             vec3(-1, -1, -1), vec3(28, 3, 28), 1, 1);
}

static void sizes(void **state) {
    (void)state;
    const char *instances = "for i in 0..79 { instance Thing { offset = i*0.01s cycle = 0.3s"
                            " scale %g translate <%g*(i %% 10), 0, %g*floor(i / 10)> } }";
    const char *copies = "for i in 0..79 { Thing((t + i*0.01) %% 0.3) {"
                         " scale %g translate <%g*(i %% 10), 0, %g*floor(i / 10)> } }";
    for (int k = -1; k <= 1; k++) {
        char a[512], b[512];
        double s = pow(1e6, k), step = 2 * s;
        snprintf(a, sizeof a, instances, s, step, step);
        snprintf(b, sizeof b, copies, s, step, step);
        agree_by(a, b, vec3(-s, -s, -s), vec3(19 * s, 2 * s, 15 * s), s, 1);
    }
}

static void nested(void **state) {
    (void)state;
    agree_by("def Two { instance Thing { speed = 2 cycle = 0.5s translate <t, 0, 0> }"
             " instance Thing { offset = 0.2s translate <0, 2, 0> } rotate z, 0.1turn*t }"
             "def Four { instance Two { speed = 1.5 } instance Two { offset = 1s cycle = 0.3s"
             " translate <0, 0, 2> scale <1, -1, 1> } }"
             "for i in 0..69 { instance Four { offset = i*0.1s translate <4*i, 0, 0> } }",
             "def Two(c) { Thing((2*c) % 0.5) { translate <c, 0, 0> }"
             " Thing(c + 0.2) { translate <0, 2, 0> } rotate z, 0.1turn*c }"
             "def Four(c) { Two(1.5*c) { } Two((c + 1) % 0.3) {"
             " translate <0, 0, 2> scale <1, -1, 1> } }"
             "for i in 0..69 { Four(t + i*0.1) { translate <4*i, 0, 0> } }",
             vec3(-2, -5, -2), vec3(280, 5, 4), 1, 0);
}

// ---- Seams: what a clock shows, and the box of it, one step of a double around them.

static void take_extremes(void *context, double lo, double hi) {
    double *out = context;
    out[0] = fmin(out[0], lo);
    out[1] = fmax(out[1], hi);
    out[2] += 1;
}

static void seams(void **state) {
    (void)state;
    Made *made = make("film { fps = 24 frames = 1..3 } def Thing { surface { res = <8, 8>"
                      " fn at(u, v) = <u, v, sin(1turn*t)> } }"
                      "for i in 0..64 { instance Thing { cycle = 0.25s"
                      " offset = 0.25s*(1 + (i - 32)*2.220446049250313e-16) } }",
                      3);
    const InstanceSet *set = &made->world->parts.sets[0];
    assert_int_equal(set->n, 65);
    uint32_t n_below = 0, n_at = 0;
    for (uint32_t k = 0; k < set->n; k++) {
        double shown = instance_seconds(set, k, 0), step = (double)set->records[k].instance - 32;
        double expected = step < 0 ? 0.25 * (1 + step * 0x1p-52) : 0.25 * step * 0x1p-52;
        assert_true(shown >= 0 && shown < 0.25);
        assert_true(fabs(shown - expected) <= 0x1p-54);
        n_below += step < 0;
        n_at += shown == 0;
        double seen[3] = {INFINITY, -INFINITY, 0};
        instance_times(set, k, -0.01, 0.01, take_extremes, seen);
        assert_true(seen[0] == 0 && seen[1] == 0.25 && seen[2] == 2); // both sides, not between
        // The generic way sees no less.
        double loops = set->records[k].instance, walked[3] = {INFINITY, -INFINITY, 0};
        local_times(set->shape, &loops, 24, 0, 0, 0.24, take_extremes, walked);
        assert_true(walked[0] <= fmin(shown, 0.01) && walked[1] >= 0.00999);
    }
    assert_int_equal(n_below, 32);
    assert_int_equal(n_at, 1);
    unmake(made);
}

// As many as make a set, and nothing beside them: rays that begin in front of what they hit.
static void the_smallest_set(void **state) {
    (void)state;
    Made *made =
        make("film { fps = 24 frames = 1..3 } def Thing { box { } }"
             "for i in 0..63 { instance Thing { translate <2*(i % 8), 0, 2*floor(i / 8)> } }",
             1);
    assert_int_equal(made->world->parts.n_sets, 1);
    WorldView *view = world_view_new(made->world);
    for (int i = 0; i < 64; i++) {
        WorldHit hit;
        Vec3 o = vec3(2 * (i % 8), 3, 2 * (i / 8)), down = vec3(0, -1, 0);
        assert_true(world_closest(view, o, down, 1, INFINITY, &hit));
        assert_int_equal(hit.object, i);
        assert_true(fabs(hit.t - 2.5) < 1e-6);
        assert_false(world_closest(view, o, down, 4, INFINITY, &hit));
    }
    world_view_destroy(view, NULL);
    unmake(made);
}

// ---- What instances share

static void arrays_are_shared(void **state) {
    (void)state;
    const char *text = "film { fps = 24 frames = 1..3 } def Thing { surface { res = <32, 32>"
                       " fn at(u, v) = <u, v, sin(1turn*t)> } }"
                       "for i in 0..%d { instance Thing { cycle = 0.5s offset = i*0.001s"
                       " translate <i, 0, 0> } }"
                       "instance Thing { cycle = 0.5s translate <0, 5, 0> }";
    size_t bytes[2];
    for (int k = 0; k < 2; k++) {
        char script[512];
        snprintf(script, sizeof script, text, k ? 4999 : 499);
        Made *made = make(script, 1);
        assert_int_equal(made->world->parts.n_forms, 1);
        bytes[k] = made->stats.vertex_bytes;
        unmake(made);
    }
    assert_int_equal(bytes[0], bytes[1]); // one cycle of keys, however many instances
}

// A parameter that moves vertices: arrays for each of its values, whatever it was worked out from.
static void equal_values_share(void **state) {
    (void)state;
    const char *text = "film { fps = 24 frames = 1..3 } def Thing(k = 0) { surface { res = <4, 4>"
                       " fn at(u, v) = <u, v, k + 0.3*sin(1turn*(u + %s))> } }"
                       "for i in 0..99 { %s Thing(floor(rand(i)*5)) { %s"
                       " translate <2*(i %% 10), 2*floor(i/10), 0>  visible = i != 7 } }";
    char instanced[1024], flat[1024];
    snprintf(instanced, sizeof instanced, text, "t", "instance", "speed = 2 offset = 0.3s");
    snprintf(flat, sizeof flat, text, "(2*t + 0.3)", "", "");
    Made *made = make(instanced, 1);
    const Assembly *parts = &made->world->parts;
    assert_int_equal(parts->n_bodies, 99);
    assert_int_equal(parts->n_forms, 5);
    const Form *of[5] = {NULL};
    for (uint32_t i = 0; i < parts->n_bodies; i++) {
        const Form *form = parts->bodies[i].form;
        int k = (int)rint(mover_bounds(&form->sampler.all, 0).lo.z + 0.3);
        assert_true(k >= 0 && k < 5 && (!of[k] || of[k] == form));
        of[k] = form;
    }
    unmake(made);
    agree(instanced, flat, vec3(0, 0, -1), vec3(19, 19, 5), 1, 0);
}

// ---- Clips

// By one moment, or by two and the share of the second.
#define CLIP_PARTS                                                                                 \
    " fn bent(u, v, c) = <u - 0.5, v + 0.3*sin(1turn*(u + c)), 0.4*cos(2turn*c)>"                  \
    " fn turned_by(c) = 1turn*floor(c)/8 + 0.3turn*sin(1turn*c)"                                   \
    " surface { res = <8, 8>  fn at(u, v) = mix(bent(u, v, A), bent(u, v, B), W)"                  \
    "   rotate y, mix(turned_by(A), turned_by(B), W)  translate <0, 0.2, mix(A, B, W)*0.2> }"      \
    " sphere { radius = mix(0.2 + 0.1*sin(1turn*A), 0.2 + 0.1*sin(1turn*B), W)"                    \
    "   translate <0, 1.3, 0> }"                                                                   \
    " box { size = <0.2, 0.3, 0.2>  visible = (W < 0.5 ? A : B) % 0.5 < 0.4"                       \
    "   translate <0.7, 0.2, 0> }"

static char *with_moments(const char *head, const char *const moments[3], const char *tail) {
    char *text = calloc(1, 16384), *to = text;
    to += sprintf(to, "film { fps = 24 frames = 1..3 size = <200, 200> }\n%s", head);
    for (const char *p = CLIP_PARTS; *p; p++) {
        bool is_moment = (*p == 'A' || *p == 'B' || *p == 'W');
        to += is_moment ? sprintf(to, "%s", moments[*p == 'W' ? 2 : *p - 'A'])
                        : sprintf(to, "%c", *p);
    }
    sprintf(to, "}\n%s", tail);
    return text;
}

static const char *const by_clock[3] = {"t", "t", "1"}, *const by_moments[3] = {"a", "b", "w"};

// Instances 0 to 3 that play clips, and copies that are told the two moments and the share.
static void agree_on_clips(const char *clips, const char *moments) {
    char instances[1024], copies[1024];
    snprintf(instances, sizeof instances,
             "for i in 0..3 { instance Thing { clips = %s  translate <3*i, 0, 0> } }", clips);
    snprintf(copies, sizeof copies, "for i in 0..3 { Thing(%s) { translate <3*i, 0, 0> } }",
             moments);
    char *instanced = with_moments("def Thing { let end = 0.5  clip go = 0s..1s"
                                   "  clip stay = 1.2s..1.2 + end",
                                   by_clock, instances);
    char *flat = with_moments("def Thing(a, b, w) {", by_moments, copies);
    agree(instanced, flat, vec3(-1, -1, -1), vec3(10, 2, 1), 1, 0);
    free(instanced);
    free(flat);
}

// `stay` begins at the nearest 32nd of `go`, which is 0.03125 s.
static void clips_fade(void **state) {
    (void)state;
    agree_on_clips("[play(go, at = -0.25*i, speed = 2), play(stay, at = 0.03s, fade = 0.0625s)]",
                   "a = (2*(t + 0.25*i)) % 1, b = 1.2 + (t - 0.03125) % 0.5,"
                   " w = smoothstep(0.03125, 0.09375, t)");
}

// A fade that the next one cuts short; a clip that stays at its end; a list chosen by the loop.
static void clips_follow_each_other(void **state) {
    (void)state;
    agree_on_clips("[go, play(stay, at = 0.02s, fade = 1s, parts = 0, once = true),"
                   " play(i < 2 ? go : stay, at = 0.06s, fade = 0.03s, speed = 3, parts = 0)]",
                   "a = t < 0.06 ? t % 1 : 1.2 + clamp(t - 0.02, 0, 0.5),"
                   " b = t < 0.06 ? 1.2 + clamp(t - 0.02, 0, 0.5)"
                   "   : i < 2 ? (3*(t - 0.06)) % 1 : 1.2 + (3*(t - 0.06)) % 0.5,"
                   " w = t < 0.06 ? smoothstep(0.02, 0.06, t) : smoothstep(0.06, 0.09, t)");
}

// Lists between which the loop chooses: what one of them lacks does not cut a fade short.
static void clips_of_lists_that_differ(void **state) {
    (void)state;
    agree_on_clips("i < 1 ? [stay] : i < 2 ? [go, play(stay, at = 0.02s, fade = 0.06s, parts = 0)]"
                   " : [go, play(stay, at = 0.02s, fade = 0.06s, parts = 0),"
                   " play(go, at = 0.05s, fade = 0s, parts = 0)]",
                   "a = i < 1 ? 1.2 + t % 0.5 : t % 1,"
                   " b = i < 1 ? 1.2 + t % 0.5"
                   "   : i < 2 or t < 0.05 ? 1.2 + (t - 0.02) % 0.5 : (t - 0.05) % 1,"
                   " w = i < 1 or (i > 1 and t >= 0.05) ? 1"
                   "   : smoothstep(0.02, i < 2 ? 0.08 : 0.05, t)");
}

// Instances with clocks of their own within what plays clips: both of its moments go through them.
static void clocks_within_clips(void **state) {
    (void)state;
    char *instanced = with_moments(
        "def Thing {", by_clock,
        "def Two(to) { instance Thing { speed = 2 offset = 0.3s cycle = 0.7s"
        " translate <0, 2 + 0.2*t, to> } instance Thing { clock = -t  rotate z, 0.1turn*t } }"
        "def Four { clip go = 0s..1s  clip stay = 1.2s..1.7s  instance Two(t) { speed = 0.5 }"
        " for k in 0..1 { instance Two(0) { offset = 0.1s*k translate <0, 0, 3 + 3*k> } } }"
        "for i in 0..3 { instance Four { translate <3*i, 0, 0>"
        " clips = [play(go, at = -0.25*i), play(stay, at = 0.02s, fade = 0.08s, parts = 0)] } }");
    char *flat = with_moments(
        "def Thing(a, b, w) {", by_moments,
        "def Two(a, b, w, to) { Thing((2*a + 0.3) % 0.7, (2*b + 0.3) % 0.7, w)"
        " { translate <0, 2 + 0.2*mix(a, b, w), to> }"
        " Thing(-a, -b, w) { rotate z, 0.1turn*mix(a, b, w) } }"
        "def Four(a, b, w) { Two(0.5*a, 0.5*b, w, mix(a, b, w)) { }"
        " for k in 0..1 { Two(a + 0.1*k, b + 0.1*k, w, 0) { translate <0, 0, 3 + 3*k> } } }"
        "for i in 0..3 { Four((t + 0.25*i) % 1, 1.2 + (t - 0.02) % 0.5,"
        " smoothstep(0.02, 0.1, t)) { translate <3*i, 0, 0> } }");
    agree(instanced, flat, vec3(-1, -2, -1), vec3(10, 5, 8), 1, 0);
    free(instanced);
    free(flat);
}

// `late` is moved behind its successor: then that begins with it, and there is one of each object.
static void clips_never_overlap(void **state) {
    (void)state;
    Made *made =
        make("film { fps = 10 frames = 1..40 } def A { clip a = 0s..1s  clip slow = 1s..65s"
             "  clip late = 65s..66s  clip last = 66s..67s"
             "  surface { res = <4, 4>  fn at(u, v) = <u, v, 0.01*t> } }"
             "instance A { clips = [a, play(slow, at = 1s, fade = 2s), play(late, at = 2.1s),"
             " play(last, at = 2.2s)] }",
             1);
    const Assembly *parts = &made->world->parts;
    for (int k = 0; k < 400; k++) {
        uint32_t n = 0;
        for (uint32_t i = 0; i < parts->n_bodies; i++) {
            n += body_place(&parts->bodies[i], NULL, 0.01 * k).is_present;
        }
        assert_int_equal(n, 1);
    }
    unmake(made);
}

// Fades that begin at any time share 32 forms, and one is for all that play a clip alone.
static void fades_are_shared(void **state) {
    (void)state;
    Made *made = make("film { fps = 24 frames = 1..3 } def Thing { clip go = 0s..1s"
                      "  clip stay = 1s..2s  surface { res = <4, 4>"
                      " fn at(u, v) = <u, v, sin(1turn*(u + t))> } }"
                      "for i in 0..999 { instance Thing { translate <2*i, 0, 0>"
                      " clips = [play(go, at = -rand(1, i)), play(stay, at = 0.1*rand(2, i))] } }",
                      1);
    assert_int_equal(made->world->parts.n_forms, 33);
    unmake(made);
}

// Frames alone and in a block of others: the same hits, bit for bit.
static void blocks_do_not_matter(void **state) {
    (void)state;
    char *text = with_clock("def Thing", "t",
                            "for i in 0..99 { instance Thing { speed = 1 + rand(i) offset = i*0.01s"
                            " translate <3*(i % 10), 0, 3*floor(i / 10)> } }");
    Made *made[2] = {make(text, 1), make(text, 3)};
    WorldView *views[2] = {world_view_new(made[0]->world), world_view_new(made[1]->world)};
    uint64_t seed = 3;
    uint32_t n_hits = 0;
    for (int i = 0; i < 3000; i++) {
        Instant at = instant_at(0, (hand_random(&seed) - 0.5) * 0.5);
        Vec3 o = random_in(&seed, vec3(0, 5, 0), vec3(30, 9, 30));
        Vec3 d = vec3_sub(random_in(&seed, vec3(0, 0, 0), vec3(30, 1, 30)), o);
        WorldHit hit[2];
        bool is_hit[2];
        for (int k = 0; k < 2; k++) {
            world_view_time(views[k], at);
            is_hit[k] = world_closest(views[k], o, d, 0, INFINITY, &hit[k]);
        }
        assert_int_equal(is_hit[0], is_hit[1]);
        if (is_hit[0]) {
            n_hits++;
            assert_true(hit[0].t == hit[1].t && hit[0].object == hit[1].object &&
                        hit[0].prim == hit[1].prim);
        }
    }
    assert_true(n_hits > 300);
    for (int k = 0; k < 2; k++) {
        world_view_destroy(views[k], NULL);
        unmake(made[k]);
    }
    free(text);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(few_instances),
    cmocka_unit_test(sets),
    cmocka_unit_test(sizes),
    cmocka_unit_test(nested),
    cmocka_unit_test(seams),
    cmocka_unit_test(the_smallest_set),
    cmocka_unit_test(arrays_are_shared),
    cmocka_unit_test(equal_values_share),
    cmocka_unit_test(clips_fade),
    cmocka_unit_test(clips_follow_each_other),
    cmocka_unit_test(clips_of_lists_that_differ),
    cmocka_unit_test(clocks_within_clips),
    cmocka_unit_test(clips_never_overlap),
    cmocka_unit_test(fades_are_shared),
    cmocka_unit_test(blocks_do_not_matter),
};

SUITE(instances, tests)
