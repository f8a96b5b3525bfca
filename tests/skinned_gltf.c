// SPDX-License-Identifier: Apache-2.0
// The nodes: `rig` (twice as large, 3 along x) holds `base`, which holds `tip` (1 along x), which
// holds `flag` with the triangle (0.5 along x). The bar's own node stands far off, which by the
// rules of glTF moves nothing that has bones.
#include "tests/skinned_gltf.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double degree = 3.141592653589793 / 180;

// ---- The closed form

static const double flag[3][3] = {{0, 0, 0}, {0.25, 0, 0}, {0, 0.25, 0}};

// Vertex k of a ring, before bones; how much of it the tip holds.
static double bar_vertex(uint32_t i, double v[3]) {
    static const double corner[4][2] = {{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}};
    v[0] = 0.25 * (i / 4);
    v[1] = corner[i % 4][0];
    v[2] = corner[i % 4][1];
    return fmin(fmax(v[0] - 0.5, 0), 1);
}

// Of straight lines between pairs of a time and a value, n of them.
static double keyed(const double (*keys)[2], int n, double t) {
    if (t <= keys[0][0]) {
        return keys[0][1];
    }
    for (int i = 1; i < n; i++) {
        if (t < keys[i][0]) {
            double f = (t - keys[i - 1][0]) / (keys[i][0] - keys[i - 1][0]);
            return keys[i - 1][1] + f * (keys[i][1] - keys[i - 1][1]);
        }
    }
    return keys[n - 1][1];
}

static const double bend_turn[2][2] = {{0, 0}, {2, 160}};           // of the base around y
static const double bend_rise[2][2] = {{0.25, 0}, {1, 0.5}};        // of the base along y
static const double bend_bow[3][2] = {{0, 0}, {1, 90}, {2.5, -30}}; // of the tip around z
static const double bend_swell[2][2] = {{0, 1}, {2.5, 1.5}};        // of the tip along y
static const double wave_bow[3][2] = {{0, 20}, {0.5, -170}, {1.5, 5}};

// The tip: bowed by an angle, swollen.
static void tip(double bow, double swell, double v[3]) {
    double x = v[0], y = swell * v[1], c = cos(bow * degree), s = sin(bow * degree);
    v[0] = 1 + c * x - s * y;
    v[1] = s * x + c * y;
}

static void base(double turn, double rise, double v[3]) {
    double x = v[0], z = v[2], c = cos(turn * degree), s = sin(turn * degree);
    v[0] = c * x + s * z;
    v[1] += rise;
    v[2] = c * z - s * x;
}

static void pose(uint32_t i, double turn, double rise, double bow, double swell, double p[3]) {
    double v[3], w = 1;
    if (i < BAR_VERTICES) {
        w = bar_vertex(i, v);
    } else {
        memcpy(v, flag[i - BAR_VERTICES], sizeof v);
    }
    double held[3] = {i < BAR_VERTICES ? v[0] - 1 : v[0] + 0.5, v[1], v[2]};
    tip(bow, swell, held);
    for (int k = 0; k < 3; k++) {
        p[k] = w == 1 ? held[k] : (1 - w) * v[k] + w * held[k];
    }
    base(turn, rise, p);
    for (int k = 0; k < 3; k++) {
        p[k] = 2 * p[k] + (k == 0 ? 3 : 0);
    }
}

void skinned_bend(uint32_t i, double t, double p[3]) {
    pose(i, keyed(bend_turn, 2, t), keyed(bend_rise, 2, t), keyed(bend_bow, 3, t),
         keyed(bend_swell, 2, t), p);
}

// The shorter way from 20 to -170 degrees goes through 105, of which linear keys know nothing.
void skinned_wave(uint32_t i, double t, double p[3]) {
    static const double shorter[3][2] = {{0, 20}, {0.5, 190}, {1.5, 365}};
    pose(i, 0, 0, keyed(shorter, 3, t), 1, p);
}

void skinned_rest(uint32_t i, double p[3]) {
    pose(i, 0, 0, 0, 1, p);
}

// ---- The file

typedef struct {
    char *text;
    size_t n, capacity;
} Text;

static void put(Text *t, const char *format, ...) {
    va_list list;
    t->text = realloc(t->text, t->capacity = t->n + (1 << 14));
    va_start(list, format);
    t->n += (size_t)vsnprintf(t->text + t->n, t->capacity - t->n, format, list);
    va_end(list);
}

typedef struct {
    Text views, accessors, channels, samplers, animations;
    unsigned char bytes[1 << 14];
    size_t n;
    int n_accessors, n_samplers;
    SkinnedKind kind;
} File;

// Returns its number. component: 5126 floats, 5121 bytes, 5123 shorts.
static int add(File *f, const char *type, int component, int count, const void *bytes, size_t n) {
    memcpy(f->bytes + f->n, bytes, n);
    const char *comma = f->n_accessors ? "," : "";
    put(&f->views, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", comma, f->n, n);
    put(&f->accessors, "%s{\"bufferView\":%d,\"componentType\":%d,\"count\":%d,\"type\":\"%s\"",
        comma, f->n_accessors, component, count, type);
    put(&f->accessors, strcmp(type, "VEC3") ? "}" : ",\"min\":[-9,-9,-9],\"max\":[9,9,9]}");
    f->n += (n + 3) / 4 * 4;
    return f->n_accessors++;
}

static void add_channel(File *f, int node, const char *path, const char *type, int n,
                        const float *times, const float *values, size_t width) {
    int input = add(f, "SCALAR", 5126, n, times, (size_t)n * sizeof(float));
    int output = add(f, type, 5126, n, values, (size_t)n * width * sizeof(float));
    const char *comma = f->n_samplers ? "," : "";
    put(&f->channels, "%s{\"sampler\":%d,\"target\":{\"node\":%d,\"path\":\"%s\"}}", comma,
        f->n_samplers, node, path);
    put(&f->samplers, "%s{\"input\":%d,\"output\":%d}", comma, input, output);
    f->n_samplers++;
}

static void add_turns(File *f, int node, int axis, const double (*keys)[2], int n) {
    float times[4], values[16] = {0};
    for (int i = 0; i < n; i++) {
        times[i] = (float)keys[i][0];
        values[4 * i + axis] = (float)sin(0.5 * degree * keys[i][1]);
        values[4 * i + 3] = (float)cos(0.5 * degree * keys[i][1]);
    }
    if (f->kind == SKINNED_NO_ROTATION) {
        memset(values, 0, sizeof values);
    }
    if (f->kind == SKINNED_BACKWARD) {
        times[0] = 1.5f;
    }
    add_channel(f, node, "rotation", "VEC4", n, times, values, 4);
}

// rest: what the other two numbers are.
static void add_vectors(File *f, int node, const char *path, int axis, const double rest[3],
                        const double (*keys)[2], int n) {
    float times[4], values[12];
    for (int i = 0; i < 3 * n; i++) {
        values[i] = (float)(i % 3 == axis ? keys[i / 3][1] : rest[i % 3]);
        times[i / 3] = (float)keys[i / 3][0];
    }
    if (f->kind == SKINNED_NAN_TIME) {
        times[n - 1] = NAN;
    }
    if (f->kind == SKINNED_NAN_PLACE || f->kind == SKINNED_HUGE_PLACE) {
        values[0] = f->kind == SKINNED_NAN_PLACE ? NAN : 3e38f;
    }
    add_channel(f, node, path, "VEC3", n, times, values, 3);
}

static void end_clip(File *f, const char *name) {
    put(&f->animations, "%s{\"name\":\"%s\",\"channels\":[%s],\"samplers\":[%s]}",
        f->animations.n ? "," : "", name, f->channels.text, f->samplers.text);
    f->channels.n = f->samplers.n = 0;
    f->n_samplers = 0;
}

static void add_clips(File *f) {
    static const double zero[3] = {0, 0, 0}, one[3] = {1, 1, 1}, at_tip[3] = {1, 0, 0};
    // In the middle of a straight line, where nothing bends.
    static const double slide[3][2] = {{0, 0}, {0.5, 1}, {1, 2}};
    add_turns(f, 1, 1, bend_turn, 2);
    add_vectors(f, 1, "translation", 1, zero, bend_rise, 2);
    add_turns(f, 2, 2, bend_bow, 3);
    add_vectors(f, 2, "scale", 1, one, bend_swell, 2);
    if (f->kind == SKINNED_MORPH) {
        add_channel(f, 4, "weights", "SCALAR", 2, (float[2]){0, 1}, (float[2]){0, 1}, 1);
    }
    end_clip(f, "Bend");
    add_turns(f, 2, 2, wave_bow, 3);
    add_vectors(f, 2, "translation", 0, at_tip, (const double[1][2]){{0, 1}}, 1);
    end_clip(f, "Wave");
    add_vectors(f, 1, "translation", 2, zero, slide, 3);
    end_clip(f, "Slide");
}

typedef struct {
    float place[BAR_VERTICES][3], weight[BAR_VERTICES][4];
    uint8_t joint[BAR_VERTICES][4];
    uint16_t index[RINGS - 1][4][6];
} Bar;

static Bar make_bar(SkinnedKind kind) {
    Bar bar = {.joint = {{0}}};
    for (uint32_t i = 0; i < BAR_VERTICES; i++) {
        double v[3], w = bar_vertex(i, v), scale = i % 3 == 0 ? 1.04 : 1; // of no meaning
        for (int k = 0; k < 3; k++) {
            bar.place[i][k] = (float)v[k];
        }
        bar.weight[i][0] = (float)(scale * w);
        bar.weight[i][2] = (float)(scale * (1 - w));
        bar.joint[i][0] = kind == SKINNED_BAD_JOINT && i % 2 ? 200 : 1;
        if (kind == SKINNED_BAD_WEIGHT) {
            bar.weight[i][i % 2 * 2] = i % 4 < 2 ? NAN : INFINITY;
        }
    }
    for (int ring = 0; ring + 1 < RINGS; ring++) {
        for (int side = 0; side < 4; side++) {
            int a = 4 * ring + side, b = 4 * ring + (side + 1) % 4;
            const int face[6] = {a, a + 4, b, b, a + 4, b + 4};
            for (int k = 0; k < 6; k++) {
                bar.index[ring][side][k] = (uint16_t)face[k];
            }
        }
    }
    return bar;
}

static void put_base64(Text *t, const unsigned char *bytes, size_t n) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < n; i += 3) { // n is a multiple of 12
        uint32_t word = (uint32_t)bytes[i] << 16 | (uint32_t)bytes[i + 1] << 8 | bytes[i + 2];
        put(t, "%c%c%c%c", digits[word >> 18], digits[word >> 12 & 63], digits[word >> 6 & 63],
            digits[word & 63]);
    }
}

static void put_meshes(Text *t, File *f) {
    Bar bar = make_bar(f->kind);
    float corners[3][3];
    for (int i = 0; i < 9; i++) {
        corners[i / 3][i % 3] = (float)flag[i / 3][i % 3];
    }
    int place = add(f, "VEC3", 5126, BAR_VERTICES, bar.place, sizeof bar.place);
    int weight = add(f, "VEC4", 5126, BAR_VERTICES, bar.weight, sizeof bar.weight);
    int joint = add(f, "VEC4", 5121, BAR_VERTICES, bar.joint, sizeof bar.joint);
    int index = add(f, "SCALAR", 5123, 24 * (RINGS - 1), bar.index, sizeof bar.index);
    int corner = add(f, "VEC3", 5126, 3, corners, sizeof corners);
    put(t,
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":%d,\"WEIGHTS_0\":%d,"
        "\"JOINTS_0\":%d},\"indices\":%d%s%d%s}]%s},{\"primitives\":[{\"attributes\":"
        "{\"POSITION\":%d}}]}],",
        place, weight, joint, index,
        f->kind == SKINNED_MORPH ? ",\"targets\":[{\"POSITION\":" : ",\"extras\":[{\"x\":", place,
        "}]", f->kind == SKINNED_MORPH ? ",\"weights\":[0]" : "", corner);
}

// The tip's bone takes its place at rest away.
static void put_skin(Text *t, File *f) {
    static const float inverse[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                         {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}};
    put(t, "\"skins\":[{\"joints\":[1,2],\"inverseBindMatrices\":%d}],",
        add(f, "MAT4", 5126, 2, inverse, sizeof inverse));
}

char *skinned_gltf(SkinnedKind kind) {
    File *f = calloc(1, sizeof *f);
    Text t = {0};
    f->kind = kind;
    put(&t, "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[4,0]}],"
            "\"nodes\":[{\"name\":\"rig\",\"children\":[1],\"translation\":[3,0,0],"
            "\"scale\":[2,2,2]},{\"name\":\"base\",\"children\":[2]},"
            "{\"name\":\"tip\",\"children\":[3],\"translation\":[1,0,0]},"
            "{\"name\":\"flag\",\"mesh\":1,\"translation\":[0.5,0,0]},"
            "{\"name\":\"bar\",\"mesh\":0,\"skin\":0,\"translation\":[100,50,20]}],");
    put_meshes(&t, f);
    put_skin(&t, f);
    add_clips(f);
    put(&t, "\"animations\":[%s],", f->animations.text);
    put(&t, "\"accessors\":[%s],", f->accessors.text);
    put(&t, "\"bufferViews\":[%s],", f->views.text);
    f->n = (f->n + 11) / 12 * 12;
    put(&t, "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:application/octet-stream;base64,",
        f->n);
    put_base64(&t, f->bytes, f->n);
    put(&t, "\"}]}");
    free(f->views.text);
    free(f->accessors.text);
    free(f->channels.text);
    free(f->samplers.text);
    free(f->animations.text);
    free(f);
    return t.text;
}
