// SPDX-License-Identifier: Apache-2.0
// The walk through the 4D kd-tree: a part of the text of accel/trace_body.h, included by it.
//
// The recursive traversal of the thesis (sections 4.2 and 5.3), on a stack. Nothing may be missed
// that the kernels, with their own rounding, take for a hit, so each plane's distance is a small
// interval: reciprocals are widened by 2^-20 to both sides, which covers the kernels' errors of 3u
// of the distance per axis; what does not shrink with the distance is covered by the padding of the
// boxes. The distance of a hit is exact to `slack`.

#ifndef ACCEL_TRACE_KD4_BODY_H
#define ACCEL_TRACE_KD4_BODY_H

#include "accel/kd4_accel.h"

enum { KD4_MAILBOXES = 8 };

typedef struct {
    float lower[3], upper[3]; // reciprocal direction, widened
    uint32_t far[3];          // which child of a node is the far one
    float slack;
} Kd4Ray;

typedef struct {
    uint32_t node;
    float near, far;
} Kd4Waiting;

static inline float min_f(float a, float b) {
    return a < b ? a : b;
}

static inline float max_f(float a, float b) {
    return a > b ? a : b;
}

static inline Kd4Ray kd4_ray(const struct Kd4Accel *accel, const RayState *ray) {
    Kd4Ray k;
    float reach = accel->reach, speed = __builtin_fabsf(ray->d[ray->kz]);
    for (int i = 0; i < 3; i++) {
        // Planes that the ray is parallel to are met very far away, on the right side.
        float d = max_f(__builtin_fabsf(ray->d[i]), 0x1p-100f);
        float r = __builtin_copysignf(1 / d, ray->d[i]);
        k.lower[i] = r * (1 - 0x1p-20f);
        k.upper[i] = r * (1 + 0x1p-20f);
        k.far[i] = __builtin_signbit(r) ? 0 : 1;
        reach = max_f(reach, __builtin_fabsf(ray->o[i]));
    }
    k.slack = 0x1p-19f * reach / speed;
    return k;
}

// Where a hit at t can lie at the furthest.
static inline float loosen(float t, float slack) {
    return t + (slack + 0x1p-19f * __builtin_fabsf(t));
}

// The part of the ray in the tree's bounds; false: none.
static inline bool kd4_clip(const Kd4Tree *tree, const RayState *ray, const Kd4Ray *k, float *near,
                            float *far) {
    *near = -loosen(-ray->tn, k->slack);
    *far = loosen(ray->tf, k->slack);
    for (int i = 0; i < 3; i++) {
        float a = tree->lo[i] - ray->o[i], b = tree->hi[i] - ray->o[i];
        float a0 = a * k->lower[i], a1 = a * k->upper[i];
        float b0 = b * k->lower[i], b1 = b * k->upper[i];
        *near = max_f(*near, min_f(min_f(a0, a1), min_f(b0, b1)));
        *far = min_f(*far, max_f(max_f(a0, a1), max_f(b0, b1)));
    }
    return *near <= *far;
}

// True: any hit is enough, and there is one.
static inline bool kd4_leaf(const struct Kd4Accel *accel, Kd4Node leaf, const RayState *ray,
                            bool any, int32_t *mailboxes, Nearest *nearest, uint64_t *n_tests) {
    const uint32_t *list = accel->tree.list + kd4_index(leaf);
    for (uint32_t i = 0; i < leaf.n; i++) {
        Subprimitive s = accel->segments[list[i]];
        int32_t *mail = &mailboxes[s.prim % KD4_MAILBOXES];
        if (ray->tick - s.tick0 < s.tick1 - s.tick0 && *mail != (int32_t)s.prim) {
            *mail = (int32_t)s.prim;
            intersect_prim(accel->geometry, ray, (int32_t)s.prim, nearest);
            ++*n_tests;
            if (any && nearest->prim != INT32_MAX) {
                return true;
            }
        }
    }
    return false;
}

static inline void kd4_walk(const struct Kd4Accel *accel, const RayState *ray, bool any,
                            Nearest *nearest, AccelCounters *count) {
    Kd4Ray k = kd4_ray(accel, ray);
    Kd4Waiting stack[KD4_STACK];
    int32_t mailboxes[KD4_MAILBOXES] = {-1, -1, -1, -1, -1, -1, -1, -1};
    const Kd4Node *nodes = accel->tree.nodes;
    uint64_t n_nodes = 0, n_tests = 0;
    uint32_t at = KD4_ROOT;
    int n_waiting = 0;
    float near, far;
    bool walks = kd4_clip(&accel->tree, ray, &k, &near, &far);
    while (walks) {
        Kd4Node node = nodes[at];
        uint32_t axis = kd4_tag(node), pair = kd4_index(node);
        n_nodes++;
        if (axis < KD4_TIME) {
            float way = node.split - ray->o[axis];
            float a = way * k.lower[axis], b = way * k.upper[axis];
            float first = min_f(a, b), last = max_f(a, b);
            uint32_t far_child = pair + k.far[axis], near_child = pair + !k.far[axis];
            if (first > far) {
                at = near_child;
            } else if (last < near) {
                at = far_child;
            } else {
                stack[n_waiting++] = (Kd4Waiting){far_child, max_f(near, first), far};
                far = min_f(far, last);
                at = near_child;
            }
            continue;
        }
        if (axis == KD4_TIME) {
            at = pair + (ray->tick >= node.tick);
            continue;
        }
        walks = !kd4_leaf(accel, node, ray, any, mailboxes, nearest, &n_tests);
        float end = loosen(nearest->t, k.slack);
        do {
            walks = walks && n_waiting > 0;
            if (walks) {
                Kd4Waiting w = stack[--n_waiting];
                at = w.node;
                near = w.near;
                far = w.far;
            }
        } while (walks && near > end);
    }
    count_ray(count, n_nodes, n_tests);
}

static inline bool kd4_closest(const struct Kd4Accel *accel, const AccelRay *ray, AccelHit *hit,
                               AccelCounters *count) {
    RayState state;
    Nearest nearest = {0, INT32_MAX, 0, 0};
    if (ray_prepare(accel->geometry, ray, &state)) {
        nearest.t = state.tf;
        kd4_walk(accel, &state, false, &nearest, count);
    }
    return report_hit(&state, &nearest, hit);
}

static inline bool kd4_occluded(const struct Kd4Accel *accel, const AccelRay *ray,
                                AccelCounters *count) {
    RayState state;
    Nearest nearest = {0, INT32_MAX, 0, 0};
    if (ray_prepare(accel->geometry, ray, &state)) {
        nearest.t = state.tf;
        kd4_walk(accel, &state, true, &nearest, count);
    }
    return nearest.prim != INT32_MAX;
}

#endif
