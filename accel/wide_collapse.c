// SPDX-License-Identifier: Apache-2.0
// From the binary tree to 16-wide nodes, with the least expected cost.
//
// cost[node][i] is the cost of the cheapest forest of at most i roots that holds all below the
// node: one root is a leaf or a wide node of its own, more are shared out between the two
// children. A cut in time takes one lane; each of its sides begins anew.
#include "accel/wide.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Expected costs for a ray that meets the lane's box, in units of a node's test.
static const float COST_NODE = 1, COST_CLUSTER = 1.3f, COST_TIME = 0.1f;

typedef struct {
    float cost[WIDE_LANES + 1];   // [i], i >= 1
    uint8_t left[WIDE_LANES + 1]; // roots given to the left child; 0: one root is as good
} Forest;

typedef struct {
    const BinaryTree *tree;
    Forest *forests;
    WideTree *wide;
    uint32_t node_capacity, time_capacity;
    bool is_out_of_memory;
} Collapse;

static bool is_leaf(const BinaryNode *node) {
    return node->left == UINT32_MAX;
}

// Children come after their parents in the array, so one pass from its end sees them first.
static void plan(const BinaryTree *tree, Forest *forests, uint32_t at) {
    const BinaryNode *node = &tree->nodes[at];
    Forest *f = &forests[at];
    if (is_leaf(node)) {
        for (int i = 1; i <= WIDE_LANES; i++) {
            f->cost[i] = node->area * COST_CLUSTER;
            f->left[i] = 0;
        }
        return;
    }
    const Forest *l = &forests[node->left], *r = &forests[node->right];
    if (node->split) {
        for (int i = 1; i <= WIDE_LANES; i++) {
            f->cost[i] = node->area * COST_TIME + 0.5f * (l->cost[1] + r->cost[1]);
            f->left[i] = 0;
        }
        return;
    }
    for (int i = 2; i <= WIDE_LANES; i++) {
        f->cost[i] = INFINITY;
        for (int k = 1; k < i; k++) {
            float cost = l->cost[k] + r->cost[i - k];
            if (cost < f->cost[i]) {
                f->cost[i] = cost;
                f->left[i] = (uint8_t)k;
            }
        }
    }
    f->cost[1] = node->area * COST_NODE + f->cost[WIDE_LANES];
    f->left[1] = 0;
    for (int i = 2; i <= WIDE_LANES; i++) {
        if (f->cost[1] < f->cost[i]) {
            f->cost[i] = f->cost[1];
            f->left[i] = 0;
        }
    }
}

// One face of a lane's box, lo + w*v. Where the numbers come near the end of float the face is as
// far out as it can be, at rest, so that a box never becomes NaN.
static void set_face(double at, double v, double pad, float *lo, float *vlo) {
    bool is_usual = fabs(at) < 1e36 && fabs(v) < 1e36;
    *lo = is_usual ? (float)(at + pad) : pad < 0 ? -FLT_MAX : FLT_MAX;
    *vlo = is_usual ? (float)v : 0;
}

// The box of a lane in global time. The floats' rounding is covered by a padding of four units in
// the last place of what is added.
static void set_lane(const WideTree *wide, uint32_t index, int lane, const BinaryNode *node) {
    WideBoxes *boxes = wide_boxes(wide, wide->is_moving, index);
    double w0 = (double)node->tick0 / TICKS_PER_SPAN, w1 = (double)node->tick1 / TICKS_PER_SPAN;
    for (int a = 0; a < 3; a++) {
        double lo0 = node->box.lo0[a], lo1 = node->box.lo1[a];
        double hi0 = node->box.hi0[a], hi1 = node->box.hi1[a];
        if (!wide->is_moving) {
            boxes->lo[a][lane] = (float)lo0;
            boxes->hi[a][lane] = (float)hi0;
            continue;
        }
        WideNode *moving = &((WideNode *)wide->nodes)[index];
        double vlo = (lo1 - lo0) / (w1 - w0), vhi = (hi1 - hi0) / (w1 - w0);
        double size_lo = fabs(lo0) + fabs(lo1) + 2 * w1 * fabs(vlo);
        double size_hi = fabs(hi0) + fabs(hi1) + 2 * w1 * fabs(vhi);
        set_face(lo0 - w0 * vlo, vlo, -0x1p-22 * size_lo, &boxes->lo[a][lane],
                 &moving->vlo[a][lane]);
        set_face(hi0 - w0 * vhi, vhi, 0x1p-22 * size_hi, &boxes->hi[a][lane],
                 &moving->vhi[a][lane]);
    }
}

static size_t node_size(const WideTree *wide) {
    return wide->is_moving ? sizeof(WideNode) : sizeof(WideBoxes);
}

static uint32_t new_wide_node(Collapse *c) {
    WideTree *wide = c->wide;
    if (wide->n_nodes == c->node_capacity) {
        uint32_t larger = c->node_capacity ? c->node_capacity * 2 : 64;
        void *copy = aligned_alloc(64, larger * node_size(wide));
        if (!copy) {
            c->is_out_of_memory = true;
            return 0;
        }
        if (wide->n_nodes) {
            memcpy(copy, wide->nodes, wide->n_nodes * node_size(wide));
        }
        free(wide->nodes);
        wide->nodes = copy;
        c->node_capacity = larger;
    }
    uint32_t index = wide->n_nodes++;
    WideBoxes *boxes = wide_boxes(wide, wide->is_moving, index);
    memset(boxes, 0, node_size(wide));
    for (int lane = 0; lane < WIDE_LANES; lane++) {
        boxes->child[lane] = child_of(CHILD_NONE, 0);
        for (int a = 0; a < 3; a++) {
            boxes->lo[a][lane] = 1e30f;
            boxes->hi[a][lane] = -1e30f;
        }
    }
    return index;
}

static uint32_t new_time_node(Collapse *c, uint32_t tick) {
    WideTree *wide = c->wide;
    if (wide->n_times == c->time_capacity) {
        uint32_t larger = c->time_capacity ? c->time_capacity * 2 : 64;
        TimeNode *copy = realloc(wide->times, larger * sizeof *copy);
        if (!copy) {
            c->is_out_of_memory = true;
            return 0;
        }
        wide->times = copy;
        c->time_capacity = larger;
    }
    wide->times[wide->n_times] = (TimeNode){.tick = tick};
    return wide->n_times++;
}

static uint32_t emit(Collapse *c, uint32_t at);

// The lanes of one wide node: the roots of the forest that the plan gives `n` places below `at`.
static int gather(const Collapse *c, uint32_t at, int n, uint32_t lanes[WIDE_LANES], int count) {
    int left = c->forests[at].left[n];
    if (left == 0) {
        lanes[count] = at;
        return count + 1;
    }
    const BinaryNode *node = &c->tree->nodes[at];
    count = gather(c, node->left, left, lanes, count);
    return gather(c, node->right, n - left, lanes, count);
}

static uint32_t emit(Collapse *c, uint32_t at) {
    const BinaryNode *node = &c->tree->nodes[at];
    if (is_leaf(node)) {
        return child_of(CHILD_CLUSTER, node->right);
    }
    if (node->split) {
        uint32_t time = new_time_node(c, node->split);
        for (int k = 0; k < 2 && !c->is_out_of_memory; k++) {
            uint32_t child = emit(c, k ? node->right : node->left);
            if (!c->is_out_of_memory) {
                c->wide->times[time].child[k] = child;
            }
        }
        return child_of(CHILD_TIME, time);
    }
    uint32_t index = new_wide_node(c), lanes[WIDE_LANES];
    // A node of its own holds the forest of 16 roots shared out between its two children.
    const Forest *f = &c->forests[node->left], *g = &c->forests[node->right];
    float best = INFINITY;
    int left = 1;
    for (int k = 1; k < WIDE_LANES; k++) {
        if (f->cost[k] + g->cost[WIDE_LANES - k] < best) {
            best = f->cost[k] + g->cost[WIDE_LANES - k];
            left = k;
        }
    }
    int n = gather(c, node->left, left, lanes, 0);
    n = gather(c, node->right, WIDE_LANES - left, lanes, n);
    for (int lane = 0; lane < n && !c->is_out_of_memory; lane++) {
        uint32_t child = emit(c, lanes[lane]);
        if (!c->is_out_of_memory) {
            set_lane(c->wide, index, lane, &c->tree->nodes[lanes[lane]]);
            wide_boxes(c->wide, c->wide->is_moving, index)->child[lane] = child;
        }
    }
    return child_of(CHILD_NODE, index);
}

bool wide_collapse(WideTree *wide, const BinaryTree *tree) {
    Collapse c = {.tree = tree, .wide = wide};
    wide->root = child_of(CHILD_NONE, 0);
    if (tree->n == 0) {
        return true;
    }
    c.forests = malloc(tree->n * sizeof *c.forests);
    if (!c.forests) {
        return false;
    }
    for (uint32_t at = tree->n; at-- > 0;) {
        plan(tree, c.forests, at);
    }
    wide->root = emit(&c, 0);
    free(c.forests);
    return !c.is_out_of_memory;
}
