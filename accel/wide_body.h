// SPDX-License-Identifier: Apache-2.0
// Tracing a wide tree, once per instruction set: the including file defines WIDE(name).
//
// A node tests the boxes of its lanes at the ray's time; the nearest is entered at once, the others
// go to the stack with their distances.
//
// No hit of the triangle kernel is lost. The kernel subtracts the origin from each vertex, the test
// subtracts it from each plane; rounding is monotone, so what is inside stays inside, however far
// the origin. What both do afterwards has a relative error of a few units in the last place, for
// which the interval is widened by 2^-20.
#include "accel/lanes_kernels.h"
#include "accel/wide.h"

// 15 entries a level; a binary tree of depth 136 (accel/wide_build.c) has at most as many wide
// levels.
enum { STACK_SIZE = 2048 };

// Flags such as is_moving are constants of each use, so every kernel exists once for each case.
#define SPECIALISED static inline __attribute__((always_inline))

typedef struct {
    float t;
    uint32_t child;
} Entry;

typedef struct {
    const WideTree *tree;
    const RayState *ray;
    Nearest *nearest;
    uint32_t key;
    float w;
    float r[3];                             // 1 / d
    uint32_t near_offset[3], far_offset[3]; // of the nearer and farther faces' rows, from lo[0]
    uint64_t n_nodes, n_tests;
} Trace;

SPECIALISED Lanes plane_at(const float *rows, uint32_t offset, Lanes w, bool is_moving) {
    Lanes at = lanes_load(rows + offset);
    if (is_moving) {
        at = lanes_fma(w, lanes_load(rows + offset + 6 * WIDE_LANES), at);
    }
    return at;
}

// Which lanes' boxes the ray meets before `tf`; their entries in t[16].
SPECIALISED uint32_t test_boxes(const Trace *tr, const WideBoxes *node, bool is_moving, float *t) {
    const float *rows = &node->lo[0][0];
    Lanes w = lanes_all(tr->w), near = lanes_all(tr->ray->tn), far = lanes_all(tr->nearest->t);
    for (int a = 0; a < 3; a++) {
        Lanes r = lanes_all(tr->r[a]), o = lanes_all(tr->ray->o[a]);
        Lanes in = lanes_sub(plane_at(rows, tr->near_offset[a], w, is_moving), o);
        Lanes out = lanes_sub(plane_at(rows, tr->far_offset[a], w, is_moving), o);
        near = lanes_max(lanes_mul(in, r), near);
        far = lanes_min(lanes_mul(out, r), far);
    }
    Lanes slack = lanes_all(0x1p-20f);
    near = lanes_fnma(lanes_abs(near), slack, near);
    far = lanes_fma(lanes_abs(far), slack, far);
    lanes_store(t, near);
    return lanes_le(near, far);
}

SPECIALISED void test_triangles(Trace *tr, uint32_t index, bool is_moving) {
    const WideTree *tree = tr->tree;
    const RayState *ray = tr->ray;
    const Cluster *cluster = &tree->set->clusters[index];
    const float *key = cluster_key(tree->set, index, tr->key);
    Lanes p[3];
    for (int a = 0; a < 3; a++) {
        p[a] = lanes_load(key + a * CLUSTER_LANES);
        if (is_moving) {
            Lanes next = lanes_load(key + (3 + a) * CLUSTER_LANES);
            p[a] = lanes_fma(lanes_all(ray->f), lanes_sub(next, p[a]), p[a]);
        }
        p[a] = lanes_sub(p[a], lanes_all(ray->o[a]));
    }
    Lanes pz = p[ray->kz];
    Lanes x = lanes_fnma(lanes_all(ray->sx), pz, p[ray->kx]);
    Lanes y = lanes_fnma(lanes_all(ray->sy), pz, p[ray->ky]);
    Lanes cx[3], cy[3], edge[3];
    for (int c = 0; c < 3; c++) {
        LaneIndex corner = lanes_index(cluster->corner[c]);
        cx[c] = lanes_pick(x, corner);
        cy[c] = lanes_pick(y, corner);
    }
    for (int c = 0; c < 3; c++) {
        int i = (c + 2) % 3, j = (c + 1) % 3; // x[i]*y[j] - y[i]*x[j]
        Lanes w = lanes_mul(cy[i], cx[j]);
        Lanes e = lanes_fnma(cy[i], cx[j], w);
        edge[c] = lanes_add(lanes_fms(cx[i], cy[j], w), e);
    }
    uint32_t inside = lanes_one_sign(edge[0], edge[1], edge[2]);
    tr->n_tests += CLUSTER_LANES;
    if (!inside) {
        return;
    }
    float xs[16] __attribute__((aligned(64))), ys[16] __attribute__((aligned(64)));
    float zs[16] __attribute__((aligned(64)));
    lanes_store(xs, x);
    lanes_store(ys, y);
    lanes_store(zs, lanes_mul(lanes_all(ray->sz), pz));
    for (; inside; inside &= inside - 1) {
        int lane = __builtin_ctz(inside);
        if (cluster->prim[lane] < 0) {
            continue;
        }
        float tx[3], ty[3], tz[3];
        for (int c = 0; c < 3; c++) {
            int v = cluster->corner[c][lane];
            tx[c] = xs[v];
            ty[c] = ys[v];
            tz[c] = zs[v];
        }
        accept_triangle(ray, tx, ty, tz, cluster->prim[lane], tr->nearest);
    }
}

SPECIALISED void test_spheres(Trace *tr, uint32_t index) {
    const Cluster *cluster = &tr->tree->set->clusters[index];
    for (int lane = 0; lane < CLUSTER_LANES && cluster->prim[lane] >= 0; lane++) {
        intersect_sphere(tr->ray, cluster->prim[lane], tr->nearest);
        tr->n_tests++;
    }
}

SPECIALISED void trace_begin(Trace *tr, const WideTree *tree, const RayState *ray,
                             Nearest *nearest) {
    tr->tree = tree;
    tr->ray = ray;
    tr->nearest = nearest;
    tr->n_nodes = tr->n_tests = 0;
    tr->key = ray->tick / TICKS_PER_SPAN;
    tr->w = (float)tr->key + ray->f;
    for (int a = 0; a < 3; a++) {
        float d = ray->d[a];
        // A direction along a plane: so steep that the slab is either all or nothing.
        d = __builtin_fabsf(d) < 0x1p-80f ? __builtin_copysignf(0x1p-80f, d) : d;
        tr->r[a] = 1 / d;
        uint32_t lo = (uint32_t)a * WIDE_LANES, hi = (uint32_t)(3 + a) * WIDE_LANES;
        tr->near_offset[a] = d < 0 ? hi : lo;
        tr->far_offset[a] = d < 0 ? lo : hi;
    }
}

// The hit lanes: the nearest is returned, the others are pushed, farther ones deeper.
SPECIALISED uint32_t push_lanes(const WideBoxes *node, uint32_t mask, const float *t, Entry *stack,
                                uint32_t *top) {
    int lane = __builtin_ctz(mask);
    mask &= mask - 1;
    if (!mask) {
        return node->child[lane];
    }
    Entry best = {t[lane], node->child[lane]};
    uint32_t base = *top, n = base;
    for (; mask; mask &= mask - 1) {
        lane = __builtin_ctz(mask);
        Entry entry = {t[lane], node->child[lane]};
        if (entry.t < best.t) {
            Entry swap = best;
            best = entry;
            entry = swap;
        }
        uint32_t at = n++;
        while (at > base && stack[at - 1].t < entry.t) {
            stack[at] = stack[at - 1];
            at--;
        }
        stack[at] = entry;
    }
    *top = n;
    return best.child;
}

SPECIALISED void trace_tree(Trace *tr, bool is_moving, bool is_spheres, bool any_hit) {
    const WideTree *tree = tr->tree;
    Entry stack[STACK_SIZE];
    uint32_t top = 0, child = tree->root;
    float t[WIDE_LANES] __attribute__((aligned(64)));
    for (;;) {
        uint32_t index = child_index(child);
        ChildKind kind = child_kind(child);
        if (kind == CHILD_NODE) {
            const WideBoxes *node = wide_boxes(tree, is_moving, index);
            tr->n_nodes++;
            uint32_t mask = test_boxes(tr, node, is_moving, t);
            if (mask) {
                child = push_lanes(node, mask, t, stack, &top);
                continue;
            }
        } else if (kind == CHILD_TIME) {
            const TimeNode *time = &tree->times[index];
            child = time->child[tr->ray->tick >= time->tick];
            continue;
        } else if (kind == CHILD_CLUSTER) {
            if (is_spheres) {
                test_spheres(tr, index);
            } else {
                test_triangles(tr, index, is_moving);
            }
            if (any_hit && tr->nearest->prim != INT32_MAX) {
                return;
            }
        }
        do {
            if (top == 0) {
                return;
            }
            child = stack[--top].child;
        } while (stack[top].t > tr->nearest->t);
    }
}

// ray_prepare() for the common case, without calls: what is not plainly valid goes the long way.
SPECIALISED bool prepare(const WideTree *tree, const AccelRay *ray, RayState *state) {
    const float *o = ray->origin, *d = ray->dir;
    float ax = __builtin_fabsf(d[0]), ay = __builtin_fabsf(d[1]), az = __builtin_fabsf(d[2]);
    int kz = ax > ay ? 0 : 1;
    float largest = ax > ay ? ax : ay;
    kz = az > largest ? 2 : kz;
    largest = az > largest ? az : largest;
    // Sums that are infinite or NaN show an operand that is.
    bool is_plain = (o[0] + o[1] + o[2]) * 0 == 0 && (ax + ay + az) * 0 == 0 &&
                    largest >= 0x1p-20f && largest <= 0x1p20f && ray->tmin > -1e37f &&
                    ray->tmin <= ray->tmax && ray->f >= 0 && ray->f <= 1 &&
                    ray->key < tree->n_spans;
    if (!is_plain) {
        return ray_prepare(tree->geometry, ray, state);
    }
    for (int a = 0; a < 3; a++) {
        state->o[a] = o[a];
        state->d[a] = d[a];
    }
    state->kz = kz;
    state->kx = kz == 2 ? 0 : kz + 1;
    state->ky = kz == 0 ? 2 : kz - 1;
    state->sx = d[state->kx] / d[kz];
    state->sy = d[state->ky] / d[kz];
    state->sz = 1 / d[kz];
    state->tn = ray->tmin;
    state->tf = ray->tmax < 1e37f ? ray->tmax : 1e37f;
    state->unscale = 1;
    state->f = ray->f;
    state->tick = accel_tick(ray->key, ray->f);
    if (tree->geometry->kind == GEOMETRY_SPHERES) {
        const Geometry *g = tree->geometry;
        size_t a = (size_t)ray->key * g->n_vertices, b = tree->is_moving ? a + g->n_vertices : a;
        state->a = g->position + 3 * a;
        state->b = g->position + 3 * b;
        state->ra = g->radius + a;
        state->rb = g->radius + b;
    }
    return true;
}

SPECIALISED bool trace_wide(const WideTree *tree, const AccelRay *ray, AccelHit *hit,
                            AccelCounters *count, bool any_hit) {
    RayState state;
    hit->prim = ACCEL_NO_PRIM;
    if (count) {
        count->rays++;
    }
    if (child_kind(tree->root) == CHILD_NONE || !prepare(tree, ray, &state)) {
        return false;
    }
    Nearest nearest = {state.tf, INT32_MAX, 0, 0};
    Trace tr;
    trace_begin(&tr, tree, &state, &nearest);
    if (tree->geometry->kind == GEOMETRY_SPHERES) {
        trace_tree(&tr, tree->is_moving, true, any_hit);
    } else if (tree->is_moving) {
        trace_tree(&tr, true, false, any_hit);
    } else {
        trace_tree(&tr, false, false, any_hit);
    }
    if (count) {
        count->nodes += tr.n_nodes;
        count->prim_tests += tr.n_tests;
    }
    if (nearest.prim == INT32_MAX) {
        return false;
    }
    *hit = (AccelHit){nearest.t * state.unscale, nearest.prim, nearest.u, nearest.v};
    return true;
}

bool WIDE(closest)(const WideTree *tree, const AccelRay *ray, AccelHit *hit, AccelCounters *count) {
    return trace_wide(tree, ray, hit, count, false);
}

bool WIDE(occluded)(const WideTree *tree, const AccelRay *ray, AccelHit *hit,
                    AccelCounters *count) {
    return trace_wide(tree, ray, hit, count, true);
}
