// SPDX-License-Identifier: Apache-2.0
// Channels between their keys.
#include "render/mesh_motion.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- Keys

// Either kind of key begins with its time.
typedef struct {
    const unsigned char *keys;
    size_t size;
    uint32_t n;
} Keys;

typedef enum { POSITION, ROTATION, SCALING, KINDS } Kind;

static Keys keys_of(const struct aiNodeAnim *c, Kind kind) {
    switch (kind) {
    case POSITION:
        return (Keys){(const void *)c->mPositionKeys, sizeof *c->mPositionKeys,
                      c->mNumPositionKeys};
    case ROTATION:
        return (Keys){(const void *)c->mRotationKeys, sizeof *c->mRotationKeys,
                      c->mNumRotationKeys};
    default:
        return (Keys){(const void *)c->mScalingKeys, sizeof *c->mScalingKeys, c->mNumScalingKeys};
    }
}

static double time_of(Keys keys, uint32_t i) {
    double time;
    memcpy(&time, keys.keys + keys.size * i, sizeof time);
    return time;
}

// The keys on either side of a time, and how far it is from one to the other.
typedef struct {
    uint32_t a, b;
    double f;
} Between;

static Between find(Keys keys, double ticks) {
    uint32_t lo = 0, hi = keys.n;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (time_of(keys, mid) <= ticks) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    if (lo == 0 || lo == keys.n) {
        uint32_t end = lo ? lo - 1 : 0;
        return (Between){end, end, 0};
    }
    double a = time_of(keys, lo - 1), b = time_of(keys, lo);
    return (Between){lo - 1, lo, (ticks - a) / (b - a)};
}

// ---- Rotations

typedef struct {
    double w, v[3];
} Quat;

static Quat quat_of(const struct aiQuatKey *key) {
    const struct aiQuaternion *q = &key->mValue;
    double w = (double)q->w, x = (double)q->x, y = (double)q->y, z = (double)q->z;
    double size = sqrt(w * w + x * x + y * y + z * z);
    return size > 0 ? (Quat){w / size, {x / size, y / size, z / size}} : (Quat){1, {0, 0, 0}};
}

static double quat_dot(const Quat *a, const Quat *b) {
    return a->w * b->w + a->v[0] * b->v[0] + a->v[1] * b->v[1] + a->v[2] * b->v[2];
}

// *b becomes the nearer one of the two that are the same rotation. Returns half the angle between.
static double quat_near(const Quat *a, Quat *b) {
    if (quat_dot(a, b) < 0) {
        *b = (Quat){-b->w, {-b->v[0], -b->v[1], -b->v[2]}};
    }
    Quat d = {b->w - a->w, {b->v[0] - a->v[0], b->v[1] - a->v[1], b->v[2] - a->v[2]}};
    return 2 * asin(fmin(0.5 * sqrt(quat_dot(&d, &d)), 1));
}

static Quat quat_mix(Quat a, Quat b, double f) {
    double half = quat_near(&a, &b), s = sin(half);
    double u = s > 1e-9 ? sin((1 - f) * half) / s : 1 - f, v = s > 1e-9 ? sin(f * half) / s : f;
    Quat q = {u * a.w + v * b.w,
              {u * a.v[0] + v * b.v[0], u * a.v[1] + v * b.v[1], u * a.v[2] + v * b.v[2]}};
    return q;
}

static Affine local_of(const double place[3], const Quat *q, const double scale[3]) {
    double w = q->w, x = q->v[0], y = q->v[1], z = q->v[2];
    const double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    Affine a;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            a.m[i][j] = turn[i][j] * scale[j];
        }
        a.m[i][3] = place[i];
    }
    return a;
}

// ---- Channels

static void mix_vectors(const struct aiVectorKey *keys, Between at, double v[3]) {
    const struct aiVector3D *a = &keys[at.a].mValue, *b = &keys[at.b].mValue;
    v[0] = (1 - at.f) * (double)a->x + at.f * (double)b->x;
    v[1] = (1 - at.f) * (double)a->y + at.f * (double)b->y;
    v[2] = (1 - at.f) * (double)a->z + at.f * (double)b->z;
}

// Assimp fills in from the node the kinds of keys that a channel has none of.
static Affine channel_local(const struct aiNodeAnim *c, double ticks) {
    double place[3] = {0, 0, 0}, scale[3] = {1, 1, 1};
    Quat q = {1, {0, 0, 0}};
    if (c->mNumPositionKeys) {
        mix_vectors(c->mPositionKeys, find(keys_of(c, POSITION), ticks), place);
    }
    if (c->mNumScalingKeys) {
        mix_vectors(c->mScalingKeys, find(keys_of(c, SCALING), ticks), scale);
    }
    if (c->mNumRotationKeys) {
        Between at = find(keys_of(c, ROTATION), ticks);
        q = quat_mix(quat_of(&c->mRotationKeys[at.a]), quat_of(&c->mRotationKeys[at.b]), at.f);
    }
    return local_of(place, &q, scale);
}

void motion_pose(const Motion *m, double ticks, SkinPose *pose) {
    for (uint32_t i = 0; i < m->skin->n_nodes; i++) {
        m->local[i] = m->channel[i] ? channel_local(m->channel[i], ticks)
                                    : skin_affine(&m->skin->nodes[i].node->mTransformation);
    }
    skin_pose_set(m->skin, m->local, pose);
}

double motion_turn(const Motion *m, double lo, double hi) {
    Arena scratch = {0};
    double most = 0, *turn = ARENA_ARRAY(&scratch, m->skin->n_nodes, double);
    for (uint32_t i = 0; i < m->skin->n_nodes; i++) {
        const struct aiNodeAnim *c = m->channel[i];
        turn[i] = i ? turn[m->skin->nodes[i].parent] : 0;
        if (c && c->mNumRotationKeys) {
            Keys keys = keys_of(c, ROTATION);
            Between at = find(keys, lo);
            Quat a = quat_of(&c->mRotationKeys[at.a]), b = quat_of(&c->mRotationKeys[at.b]);
            double span = time_of(keys, at.b) - time_of(keys, at.a);
            turn[i] += span > 0 ? 2 * quat_near(&a, &b) * (hi - lo) / span : 0;
        }
        most = fmax(most, turn[i]);
    }
    arena_free(&scratch);
    return most;
}

// ---- Times

// Files without a rate have 0, which stands for 25 in Assimp.
static double rate_of(const struct aiAnimation *animation) {
    double rate = animation->mTicksPerSecond;
    return rate > 0 && rate <= DBL_MAX ? rate : 25;
}

double motion_seconds(const struct aiAnimation *animation) {
    return fmax(animation->mDuration, 0) / rate_of(animation);
}

static int double_compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double *motion_bends(Arena *arena, const Motion *m, size_t *n) {
    size_t most = 2, kept = 0;
    for (uint32_t i = 0; i < m->skin->n_nodes; i++) {
        for (Kind kind = 0; m->channel[i] && kind < KINDS; kind++) {
            most += 2 * (size_t)keys_of(m->channel[i], kind).n;
        }
    }
    double *bends = ARENA_ARRAY(arena, most, double);
    *n = 0;
    bends[(*n)++] = 0;
    bends[(*n)++] = m->duration;
    for (uint32_t i = 0; i < m->skin->n_nodes; i++) {
        for (Kind kind = 0; m->channel[i] && kind < KINDS; kind++) {
            Keys keys = keys_of(m->channel[i], kind);
            for (uint32_t k = 0; k < keys.n; k++) {
                double at = time_of(keys, k);
                if (at > 0 && at <= m->duration) {
                    bends[(*n)++] = at;
                    if (k > 0 && time_of(keys, k - 1) == at) {
                        bends[(*n)++] = nextafter(at, 0);
                    }
                }
            }
        }
    }
    qsort(bends, *n, sizeof *bends, double_compare);
    for (size_t i = 0; i < *n; i++) {
        if (kept == 0 || bends[i] > bends[kept - 1]) {
            bends[kept++] = bends[i];
        }
    }
    *n = kept;
    return bends;
}

// ---- New ones

static bool check_keys(const struct aiNodeAnim *c, char *message, size_t n) {
    for (Kind kind = 0; kind < KINDS; kind++) {
        Keys keys = keys_of(c, kind);
        for (uint32_t i = 0; i < keys.n; i++) {
            double at = time_of(keys, i);
            if (!isfinite(at) || (i > 0 && at < time_of(keys, i - 1))) {
                snprintf(message, n, "the times of the keys of '%.60s' do not ascend",
                         c->mNodeName.data);
                return false;
            }
        }
    }
    return true;
}

// A channel of a node that is not there moves nothing.
static bool take_channel(Motion *m, const struct aiNodeAnim *c, char *message, size_t n) {
    uint32_t node;
    bool is_known;
    if (!check_keys(c, message, n)) {
        return false;
    }
    if (skin_find(m->skin, &c->mNodeName, &node, &is_known)) {
        m->channel[node] = c;
    } else if (is_known) {
        snprintf(message, n, "it moves '%.60s', the name of several nodes", c->mNodeName.data);
        return false;
    }
    return true;
}

bool motion_new(Arena *arena, const Skin *skin, const struct aiAnimation *animation, Motion *motion,
                char *message, size_t n) {
    *motion = (Motion){.skin = skin,
                       .animation = animation,
                       .channel = arena_array(arena, skin->n_nodes, sizeof *motion->channel),
                       .local = ARENA_ARRAY(arena, skin->n_nodes, Affine),
                       .duration = fmax(animation->mDuration, 0),
                       .rate = rate_of(animation)};
    if (animation->mNumMorphMeshChannels || animation->mNumMeshChannels) {
        snprintf(message, n, "not supported yet: clips that move morph targets");
        return false;
    }
    if (skin->lost_bone) {
        snprintf(message, n, "no node, or more than one, is called like its bone '%.60s'",
                 skin->lost_bone);
        return false;
    }
    if (!isfinite(motion->duration / motion->rate)) {
        snprintf(message, n, "its clip '%.60s' has no finite duration", animation->mName.data);
        return false;
    }
    for (unsigned i = 0; i < animation->mNumChannels; i++) {
        if (!take_channel(motion, animation->mChannels[i], message, n)) {
            return false;
        }
    }
    return true;
}
