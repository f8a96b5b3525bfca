// SPDX-License-Identifier: Apache-2.0
// Instants of clips: halved until they are enough, then thinned out.
#include "render/mesh_keys.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "render/mesh_assimp.h"

// Of KEYS_BOUND: what halving may leave, the rest is for thinning out.
static const double HALVING = 0.125;
static const double QUARTER_TURN = 1.5707963267948966;

enum {
    HELD = 32,  // instants that one straight line may pass over
    DEPTH = 48, // of halving; what still moves then is taken for a jump
};

typedef struct {
    const Motion *motion;
    double ticks, seconds;
} Moment;

typedef struct {
    Arena *arena, *scratch;
    const Skin *skin;
    Keys *keys;
    size_t seconds_capacity, xyz_capacity;
    SkinPose pose;
    double diagonal;
    float *held[HELD]; // since the last key
    double held_seconds[HELD];
    int n_held;
    Vec3 *begin, *end[DEPTH + 2], *probe; // of spans: the nearest end last
    char *message;
    size_t n;
} Finder;

// ---- Places

static Vec3 *new_places(Finder *f) {
    return ARENA_ARRAY(f->scratch, f->skin->n_points, Vec3);
}

static void place(Finder *f, const Motion *motion, double ticks, Vec3 *xyz) {
    motion_pose(motion, ticks, &f->pose);
    skin_place(f->skin, &f->pose, xyz);
}

// Single precision is what they are kept in.
static bool is_kept(double x) {
    return isfinite((float)x);
}

static bool check_places(Finder *f, const Vec3 *xyz, double seconds) {
    for (size_t i = 0; i < f->skin->n_points; i++) {
        if (!is_kept(xyz[i].x) || !is_kept(xyz[i].y) || !is_kept(xyz[i].z)) {
            snprintf(f->message, f->n, "%.6g s into its clip a vertex is at no finite place",
                     seconds);
            return false;
        }
    }
    return true;
}

// Of the mesh as it rests; 0: it has no size.
static double find_diagonal(Finder *f) {
    Vec3 lo = {INFINITY, INFINITY, INFINITY}, hi = {-INFINITY, -INFINITY, -INFINITY};
    const Vec3 *p = f->begin;
    skin_pose_set(f->skin, NULL, &f->pose);
    skin_place(f->skin, &f->pose, f->begin);
    for (size_t i = 0; i < f->skin->n_points; i++) {
        lo = (Vec3){fmin(lo.x, p[i].x), fmin(lo.y, p[i].y), fmin(lo.z, p[i].z)};
        hi = (Vec3){fmax(hi.x, p[i].x), fmax(hi.y, p[i].y), fmax(hi.z, p[i].z)};
    }
    double size = vec3_length(vec3_sub(hi, lo));
    return isfinite(size) ? size : 0;
}

// ---- Thinning out

static bool add_key(Finder *f, float *xyz, double seconds) {
    Keys *keys = f->keys;
    size_t n_points = (size_t)f->skin->n_points, size = 3 * n_points * sizeof(float);
    if (keys->n == CLIP_STREAM_KEYS || (keys->n + 1) * size > CLIP_STREAM_BYTES) {
        snprintf(f->message, f->n,
                 "its clip needs the places of %zu vertices at more than %zu instants", n_points,
                 keys->n);
        return false;
    }
    keys->seconds =
        arena_grow(f->arena, keys->seconds, keys->n, &f->seconds_capacity, sizeof *keys->seconds);
    keys->xyz = arena_grow(f->arena, keys->xyz, keys->n, &f->xyz_capacity, sizeof *keys->xyz);
    keys->seconds[keys->n] = seconds;
    keys->xyz[keys->n++] = xyz;
    return true;
}

// What is held last becomes a key.
static bool keep_last(Finder *f) {
    int last = f->n_held - 1;
    float *xyz = f->held[last];
    f->held[last] = NULL;
    f->n_held = 0;
    return add_key(f, xyz, f->held_seconds[last]);
}

static void hold(Finder *f, const Vec3 *places, double seconds) {
    size_t n_points = (size_t)f->skin->n_points;
    float **slot = &f->held[f->n_held];
    *slot = *slot ? *slot : ARENA_ARRAY(f->arena, 3 * n_points, float);
    f->held_seconds[f->n_held++] = seconds;
    for (size_t i = 0; i < n_points; i++) {
        (*slot)[3 * i] = (float)places[i].x;
        (*slot)[3 * i + 1] = (float)places[i].y;
        (*slot)[3 * i + 2] = (float)places[i].z;
    }
}

// Whether a straight line from the last key comes near to all that is held.
static bool is_reached(const Finder *f, const Vec3 *places, double seconds) {
    const float *from = f->keys->xyz[f->keys->n - 1];
    double begin = f->keys->seconds[f->keys->n - 1];
    double bound = (1 - HALVING) * KEYS_BOUND * f->diagonal;
    for (int k = f->n_held - 1; k >= 0; k--) {
        double s = (f->held_seconds[k] - begin) / (seconds - begin);
        for (size_t i = 0; i < f->skin->n_points; i++) {
            const float *a = from + 3 * i, *p = f->held[k] + 3 * i;
            Vec3 line =
                vec3((1 - s) * (double)a[0], (1 - s) * (double)a[1], (1 - s) * (double)a[2]);
            Vec3 off = vec3_sub(vec3_madd(line, s, places[i]),
                                vec3((double)p[0], (double)p[1], (double)p[2]));
            if (!(vec3_dot(off, off) <= bound * bound)) {
                return false;
            }
        }
    }
    return true;
}

static bool add(Finder *f, const Vec3 *places, double seconds) {
    if (f->keys->n == 0) {
        hold(f, places, seconds);
        return keep_last(f);
    }
    bool is_full = f->n_held == HELD;
    if (f->n_held > 0 && (is_full || !is_reached(f, places, seconds)) && !keep_last(f)) {
        return false;
    }
    hold(f, places, seconds);
    return true;
}

// ---- Halving

static bool is_straight(const Finder *f, const Vec3 *end, const Vec3 *places, double s) {
    double bound = HALVING * KEYS_BOUND * f->diagonal;
    for (size_t i = 0; i < f->skin->n_points; i++) {
        Vec3 line = vec3_madd(f->begin[i], s, vec3_sub(end[i], f->begin[i]));
        Vec3 off = vec3_sub(places[i], line);
        if (!(vec3_dot(off, off) <= bound * bound)) {
            return false;
        }
    }
    return true;
}

// Whether nothing is to be put between the beginning and end[depth]; end[depth + 1] becomes what
// would be.
static bool is_enough(Finder *f, const Motion *motion, double lo, double hi, int depth) {
    Vec3 **middle = &f->end[depth + 1], *end = f->end[depth];
    *middle = *middle ? *middle : new_places(f);
    place(f, motion, lo + 0.5 * (hi - lo), *middle);
    if (motion_turn(motion, lo, hi) > QUARTER_TURN || !is_straight(f, end, *middle, 0.5)) {
        return false;
    }
    for (int i = 1; i <= 3; i += 2) {
        place(f, motion, lo + 0.25 * i * (hi - lo), f->probe);
        if (!is_straight(f, end, f->probe, 0.25 * i)) {
            return false;
        }
    }
    return true;
}

// From a moment, whose places are in f->begin, to the next one of the same clip.
static bool add_span(Finder *f, const Moment *from, const Moment *to) {
    double ends[DEPTH + 1], lo = from->ticks, last = from->seconds;
    double pace = (to->seconds - from->seconds) / (to->ticks - from->ticks);
    ends[0] = to->ticks;
    place(f, to->motion, to->ticks, f->end[0]);
    for (int depth = 0; depth >= 0;) {
        double hi = ends[depth], mid = lo + 0.5 * (hi - lo);
        double seconds = depth ? from->seconds + (hi - from->ticks) * pace : to->seconds;
        if (!check_places(f, f->end[depth], seconds)) {
            return false;
        }
        if (depth < DEPTH && mid > lo && mid < hi && !is_enough(f, to->motion, lo, hi, depth)) {
            ends[++depth] = mid;
            continue;
        }
        if (seconds > last && !add(f, f->end[depth], seconds)) {
            return false;
        }
        last = fmax(last, seconds);
        lo = hi;
        Vec3 *end = f->end[depth];
        f->end[depth--] = f->begin;
        f->begin = end;
    }
    return true;
}

// ---- The whole

// All of a clip's, at an offset.
static void add_moments(Arena *scratch, const Motion *motion, double offset, Moment **moments,
                        size_t *n, size_t *capacity) {
    size_t n_bends;
    const double *bends = motion_bends(scratch, motion, &n_bends);
    for (size_t i = 0; i < n_bends; i++) {
        *moments = arena_grow(scratch, *moments, *n, capacity, sizeof **moments);
        (*moments)[(*n)++] = (Moment){motion, bends[i], offset + bends[i] / motion->rate};
    }
}

// What falls together is moved apart by the least that there is, towards the past.
static void part_moments(Moment *moments, size_t n) {
    for (size_t i = n; i > 1; i--) {
        double next = moments[i - 1].seconds;
        if (!(moments[i - 2].seconds < next)) {
            moments[i - 2].seconds = nextafter(next, -INFINITY);
        }
    }
}

static bool find(Finder *f, const Moment *moments, size_t n) {
    for (size_t i = 0; i < n; i++) {
        const Moment *m = &moments[i];
        if (i > 0 && m->motion == m[-1].motion) {
            if (!add_span(f, m - 1, m)) {
                return false;
            }
            continue;
        }
        place(f, m->motion, m->ticks, f->begin);
        if (!check_places(f, f->begin, m->seconds) || !add(f, f->begin, m->seconds)) {
            return false;
        }
    }
    return f->n_held == 0 || keep_last(f);
}

bool keys_find(Arena *arena, const Skin *skin, const Motion *motions, uint32_t n_motions,
               Keys *keys, char *message, size_t n) {
    Arena scratch = {0};
    Moment *moments = NULL;
    size_t n_moments = 0, capacity = 0;
    double offset = 0;
    *keys = (Keys){0};
    Finder f = {.arena = arena,
                .scratch = &scratch,
                .skin = skin,
                .keys = keys,
                .pose = skin_pose_new(&scratch, skin),
                .message = message,
                .n = n};
    f.begin = new_places(&f);
    f.probe = new_places(&f);
    f.end[0] = new_places(&f);
    f.diagonal = find_diagonal(&f);
    for (uint32_t i = 0; i < n_motions; i++) {
        // One that takes no time is not seen beside others.
        if (motions[i].duration > 0 || (n_moments == 0 && i == n_motions - 1)) {
            add_moments(&scratch, &motions[i], offset, &moments, &n_moments, &capacity);
        }
        offset += motions[i].duration / motions[i].rate;
    }
    part_moments(moments, n_moments);
    bool is_found = f.diagonal > 0 && find(&f, moments, n_moments);
    if (!(f.diagonal > 0)) {
        snprintf(message, n, "its clip moves a mesh that has no size at rest");
    }
    arena_free(&scratch);
    return is_found;
}
