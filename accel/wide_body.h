// SPDX-License-Identifier: Apache-2.0
// Tracing a wide tree, once per instruction set: the including file defines WIDE(name).
//
// A node tests the boxes of its lanes at the ray's time; the nearest is entered at once, the others
// go to the stack with their distances.
//
// No hit of the triangle kernel is lost. The kernel subtracts the origin from each vertex, the test
// subtracts it from each plane; rounding is monotone, so what is inside stays inside, however far
// the origin. What both do afterwards has an error of a few units in the last place of a distance,
// for which, and for the lane numbers that lanes_sort() hides in distances, boxes are left later by
// 2^-18 of the farthest that anything can be: one number for a ray, so that it costs nothing.
#include "accel/lanes_kernels.h"
#include "accel/wide.h"

// 15 entries a level; a binary tree of depth 136 (accel/wide_build.c) has at most as many wide
// levels. 16 more, since whole rows are written.
enum { STACK_SIZE = 2048 + WIDE_LANES };

// Flags such as is_moving are constants of each use, so every kernel exists once for each case.
#define SPECIALISED static inline __attribute__((always_inline))

// What a ray needs on its way, ready for use.
typedef struct {
    const WideTree *tree;
    const RayState *ray;
    Nearest *nearest;
    const float *keys;             // of cluster 0, at the ray's key
    size_t stride, next;           // from cluster to cluster, from key to key
    size_t kx_row, ky_row, kz_row; // where the rows of the ray's axes are within a key
    float w;
    float slack, far;                     // far: of what is still of interest, slack included
    float r[3];                           // 1 / d
    size_t near_offset[3], far_offset[3]; // of the nearer and farther faces' rows, from lo[0]
    uint64_t n_nodes, n_tests;
} Trace;

// Children to visit, and the distances at which the ray enters them.
typedef struct {
    float t[STACK_SIZE];
    uint32_t child[STACK_SIZE];
} Stack;

SPECIALISED Lanes plane_at(const float *rows, size_t offset, Lanes w, bool is_moving) {
    Lanes at = lanes_load(rows + offset);
    if (is_moving) {
        at = lanes_fma(w, lanes_load(rows + offset + 6 * WIDE_LANES), at);
    }
    return at;
}

// Which lanes' boxes the ray meets before the nearest hit, and where it enters them.
SPECIALISED uint32_t test_boxes(const Trace *tr, const WideBoxes *node, bool is_moving, Lanes *t) {
    const float *rows = &node->lo[0][0];
    Lanes w = lanes_all(tr->w), slack = lanes_all(tr->slack);
    Lanes near = lanes_all(tr->ray->tn), far = lanes_all(tr->far);
    for (int a = 0; a < 3; a++) {
        Lanes r = lanes_all(tr->r[a]), o = lanes_all(tr->ray->o[a]);
        Lanes in = lanes_sub(plane_at(rows, tr->near_offset[a], w, is_moving), o);
        Lanes out = lanes_sub(plane_at(rows, tr->far_offset[a], w, is_moving), o);
        near = lanes_max(lanes_mul(in, r), near);
        far = lanes_min(lanes_fma(out, r, slack), far);
    }
    *t = near;
    return lanes_le(near, far);
}

// A row of vertices at the ray's time.
SPECIALISED Lanes row_at(const Trace *tr, const float *row, bool is_moving) {
    Lanes p = lanes_load(row);
    if (is_moving) {
        Lanes q = lanes_load(row + tr->next);
        p = lanes_fma(lanes_all(tr->ray->f), lanes_sub(q, p), p);
    }
    return p;
}

SPECIALISED void test_triangles(Trace *tr, uint32_t index, bool is_moving) {
    const WideTree *tree = tr->tree;
    const RayState *ray = tr->ray;
    const Cluster *cluster = &tree->set->clusters[index];
    const float *key = tr->keys + index * tr->stride;
    Lanes z = lanes_sub(row_at(tr, key + tr->kz_row, is_moving), lanes_all(ray->o[ray->kz]));
    Lanes x = lanes_sub(row_at(tr, key + tr->kx_row, is_moving), lanes_all(ray->o[ray->kx]));
    Lanes y = lanes_sub(row_at(tr, key + tr->ky_row, is_moving), lanes_all(ray->o[ray->ky]));
    x = lanes_fnma(lanes_all(ray->sx), z, x);
    y = lanes_fnma(lanes_all(ray->sy), z, y);
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
    uint32_t inside = lanes_one_sign(edge[0], edge[1], edge[2]) & cluster->used;
    tr->n_tests += CLUSTER_LANES;
    if (!inside) {
        return;
    }
    float xs[16] __attribute__((aligned(64))), ys[16] __attribute__((aligned(64)));
    float zs[16] __attribute__((aligned(64)));
    lanes_store(xs, x);
    lanes_store(ys, y);
    lanes_store(zs, lanes_mul(lanes_all(ray->sz), z));
    for (; inside; inside &= inside - 1) {
        int lane = __builtin_ctz(inside);
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

// First in float, with room for its error: the distance of the centre from the ray's line is at
// most the radius. Then, for the few that pass, the kernel of all structures.
SPECIALISED void test_spheres(Trace *tr, uint32_t index, bool is_moving) {
    const RayState *ray = tr->ray;
    const Cluster *cluster = &tr->tree->set->clusters[index];
    const float *key = tr->keys + index * tr->stride;
    const float *d = ray->d;
    float scale = 1 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    Lanes g[3], along = lanes_all(0), size = lanes_all(0), square = lanes_all(0);
    for (int a = 0; a < 3; a++) {
        g[a] = lanes_sub(row_at(tr, key + a * CLUSTER_LANES, is_moving), lanes_all(ray->o[a]));
        along = lanes_fma(g[a], lanes_all(d[a] * scale), along);
        size = lanes_add(size, lanes_abs(g[a]));
    }
    for (int a = 0; a < 3; a++) {
        Lanes off = lanes_fnma(along, lanes_all(d[a]), g[a]);
        square = lanes_fma(off, off, square);
    }
    // Each component is off by less than 8 units in the last place of the sum of all.
    Lanes radius = row_at(tr, key + 3 * CLUSTER_LANES, is_moving);
    Lanes room = lanes_fma(size, lanes_all(0x1p-18f), radius);
    Lanes far = lanes_fma(room, room, lanes_all(1e-30f));
    // Squares overflow first, to infinity, which passes.
    uint32_t near = ~lanes_le(far, lanes_min(square, lanes_all(0x1.fffffep127f)));
    near &= lanes_le(lanes_all(0), radius);
    tr->n_tests += CLUSTER_LANES;
    for (; near; near &= near - 1) {
        intersect_sphere(ray, cluster->prim[__builtin_ctz(near)], tr->nearest);
    }
}

SPECIALISED void begin_boxes(Trace *tr, const WideTree *tree, RayState *ray, Nearest *nearest) {
    tr->tree = tree;
    tr->ray = ray;
    tr->nearest = nearest;
    tr->n_nodes = tr->n_tests = 0;
    tr->w = (float)(ray->tick / TICKS_PER_SPAN) + ray->f;
    for (uint32_t a = 0; a < 3; a++) {
        float d = ray->d[a];
        // A direction along a plane: so steep that the slab is either all or nothing.
        d = __builtin_fabsf(d) < 0x1p-80f ? __builtin_copysignf(0x1p-80f, d) : d;
        tr->r[a] = 1 / d;
        size_t back = d < 0 ? 3 * WIDE_LANES : 0;
        tr->near_offset[a] = a * WIDE_LANES + back;
        tr->far_offset[a] = (3 + a) * WIDE_LANES - back;
    }
    float x = __builtin_fabsf(tr->r[0]), y = __builtin_fabsf(tr->r[1]);
    float z = __builtin_fabsf(tr->r[2]), least = x < y ? x : y;
    least = z < least ? z : least; // of the direction's largest component
    x = __builtin_fabsf(ray->o[0]), y = __builtin_fabsf(ray->o[1]), z = __builtin_fabsf(ray->o[2]);
    float reach = (tree->set->reach + (x + y + z)) * least;
    tr->slack = 0x1p-18f * (reach < 1e37f ? reach : 1e37f);
    tr->far = nearest->t + tr->slack;
}

// What clusters need, for rays that come to one.
SPECIALISED void begin_clusters(Trace *tr, RayState *ray, bool is_spheres) {
    const ClusterSet *set = tr->tree->set;
    uint32_t key = ray->tick / TICKS_PER_SPAN;
    tr->keys = cluster_key(set, 0, key);
    tr->stride = (size_t)set->geometry->n_keys * set->n_rows * CLUSTER_LANES;
    tr->next = (size_t)set->n_rows * CLUSTER_LANES;
    if (is_spheres) {
        ray_set_keys(ray, set->geometry, key);
    } else {
        ray_set_shear(ray);
        tr->kx_row = (size_t)ray->kx * CLUSTER_LANES;
        tr->ky_row = (size_t)ray->ky * CLUSTER_LANES;
        tr->kz_row = (size_t)ray->kz * CLUSTER_LANES;
    }
}

// Whether the ray meets any of the node's boxes: then *child is the one to go to, and the others
// are on the stack.
SPECIALISED bool visit_node(Trace *tr, const WideBoxes *node, Stack *stack, uint32_t *top,
                            uint32_t *child, bool is_moving, bool any_hit) {
    Lanes t;
    uint32_t mask = test_boxes(tr, node, is_moving, &t);
    tr->n_nodes++;
    if (!mask) {
        return false;
    }
    uint32_t more = (uint32_t)__builtin_popcount(mask) - 1;
    if (!more) {
        *child = node->child[__builtin_ctz(mask)];
    } else if (any_hit) {
        lanes_pack(node->child, mask, stack->child + *top);
        *child = node->child[31 - __builtin_clz(mask)];
    } else {
        *child = lanes_sort(t, mask, node->child, stack->t + *top, stack->child + *top);
    }
    *top += more;
    return true;
}

SPECIALISED uint32_t pass_times(const WideTree *tree, uint32_t child, uint32_t tick) {
    while (child_kind(child) == CHILD_TIME) {
        const TimeNode *time = &tree->times[child_index(child)];
        child = time->child[tick >= time->tick];
    }
    return child;
}

SPECIALISED void trace_tree(Trace *tr, RayState *ray, bool is_moving, bool is_spheres,
                            bool any_hit) {
    const WideTree *tree = tr->tree;
    Stack stack;
    uint32_t top = 0, child = pass_times(tree, wide_root(tree, ray->tick), ray->tick);
    // Many rays end here, before anything is made ready for clusters.
    if (child_kind(child) == CHILD_NODE &&
        !visit_node(tr, wide_boxes(tree, is_moving, child_index(child)), &stack, &top, &child,
                    is_moving, any_hit)) {
        return;
    }
    begin_clusters(tr, ray, is_spheres);
    for (;;) {
        uint32_t index = child_index(child);
        ChildKind kind = child_kind(child);
        if (kind == CHILD_NODE) {
            if (visit_node(tr, wide_boxes(tree, is_moving, index), &stack, &top, &child, is_moving,
                           any_hit)) {
                continue;
            }
        } else if (kind == CHILD_TIME) {
            child = pass_times(tree, child, ray->tick);
            continue;
        } else if (kind == CHILD_CLUSTER) {
            if (is_spheres) {
                test_spheres(tr, index, is_moving);
            } else {
                test_triangles(tr, index, is_moving);
            }
            if (any_hit && tr->nearest->prim != INT32_MAX) {
                return;
            }
            tr->far = tr->nearest->t + tr->slack;
        }
        do {
            if (top == 0) {
                return;
            }
            child = stack.child[--top];
        } while (!any_hit && stack.t[top] > tr->far);
    }
}

// ray_prepare() for the common case, without calls: what is not plainly valid goes the long way.
SPECIALISED bool prepare(const WideTree *tree, const AccelRay *ray, RayState *state) {
    const float *o = ray->origin, *d = ray->dir;
    float ax = __builtin_fabsf(d[0]), ay = __builtin_fabsf(d[1]), az = __builtin_fabsf(d[2]);
    float largest = ax > ay ? ax : ay;
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
    state->tn = ray->tmin;
    state->tf = ray->tmax < 1e37f ? ray->tmax : 1e37f;
    state->unscale = 1;
    state->f = ray->f;
    state->tick = accel_tick(ray->key, ray->f);
    return true;
}

SPECIALISED bool trace_wide(const WideTree *tree, const AccelRay *ray, AccelHit *hit,
                            AccelCounters *count, bool is_moving, bool is_spheres, bool any_hit) {
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
    begin_boxes(&tr, tree, &state, &nearest);
    trace_tree(&tr, &state, is_moving, is_spheres, any_hit);
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

// A function for each case, so that registers are given out for that case alone.
#define KERNEL(name, is_moving, is_spheres, any_hit)                                               \
    static bool name(const WideTree *tree, const AccelRay *ray, AccelHit *hit,                     \
                     AccelCounters *count) {                                                       \
        return trace_wide(tree, ray, hit, count, is_moving, is_spheres, any_hit);                  \
    }

KERNEL(closest_triangles, false, false, false)
KERNEL(closest_moving_triangles, true, false, false)
KERNEL(closest_spheres, false, true, false)
KERNEL(closest_moving_spheres, true, true, false)
KERNEL(occluded_triangles, false, false, true)
KERNEL(occluded_moving_triangles, true, false, true)
KERNEL(occluded_spheres, false, true, true)
KERNEL(occluded_moving_spheres, true, true, true)

const WideKernels WIDE(kernels)[2][2] = {
    {{closest_triangles, occluded_triangles},
     {closest_moving_triangles, occluded_moving_triangles}},
    {{closest_spheres, occluded_spheres}, {closest_moving_spheres, occluded_moving_spheres}},
};
