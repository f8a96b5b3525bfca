// SPDX-License-Identifier: Apache-2.0
// The level above the objects: the 4D kd-tree over their boxes, walked in double.
#include "accel/boxtree.h"

#include "accel/kd4.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

struct BoxTree {
    Kd4Tree tree;      // without nodes where the memory did not hold any: then all boxes are asked
    BoxSegment *boxes; // padded
    uint32_t n_boxes, n_ticks;
    uint32_t *start; // [n_ticks]: the first node that does not split time; NULL: the root for all
};

// ---- Building

static bool is_box(const BoxSegment *s, uint32_t n_ticks) {
    bool ok = s->tick0 < s->tick1 && s->tick0 < n_ticks;
    for (int i = 0; i < 3; i++) {
        ok = ok && s->lo[i] <= s->hi[i];
    }
    return ok;
}

static BoxSegment pad(const BoxSegment *s, uint32_t n_ticks) {
    double lo[3], hi[3], largest[3], extent = 0;
    for (int i = 0; i < 3; i++) {
        lo[i] = fmax(s->lo[i], -FLT_MAX);
        hi[i] = fmin(s->hi[i], FLT_MAX);
        extent = fmax(extent, hi[i] - lo[i]);
        largest[i] = fmax(fabs(lo[i]), fabs(hi[i]));
    }
    for (int i = 0; i < 3; i++) {
        lo[i] -= BOX_HIT_ERROR * extent;
        hi[i] += BOX_HIT_ERROR * extent;
    }
    BoxSegment padded = *s;
    padded.tick1 = s->tick1 < n_ticks ? s->tick1 : n_ticks;
    kd4_pad_box(lo, hi, largest, padded.lo, padded.hi);
    return padded;
}

// Sums of the shares. Where they do not fit, or there are none, all ticks count alike.
static double *sum_shares(const double *share, uint32_t n_ticks, Budget *budget) {
    size_t size = ((size_t)n_ticks + 1) * sizeof(double);
    double *prefix = share ? budget_resize(budget, NULL, 0, size) : NULL;
    for (uint32_t i = 0; prefix && i <= n_ticks; i++) {
        prefix[i] = i ? prefix[i - 1] + share[i - 1] : 0;
    }
    return prefix;
}

static void build_tree(BoxTree *tree, const double *share, const AccelOptions *options,
                       Budget *budget, AccelStats *stats) {
    double *prefix = sum_shares(share, tree->n_ticks, budget);
    double equal[2] = {0, tree->n_ticks};
    TimeAxis axis = {tree->n_ticks, prefix ? 1 : tree->n_ticks, prefix ? prefix : equal};
    kd4_build(tree->boxes, tree->n_boxes, &axis, options, budget, &tree->tree, stats);
    budget_resize(budget, prefix, prefix ? ((size_t)tree->n_ticks + 1) * sizeof(double) : 0, 0);
}

// Each tick has its tree: a block of frames costs its rays no more than one frame.
static void find_starts(BoxTree *tree, Budget *budget) {
    const Kd4Node *nodes = tree->tree.nodes;
    size_t size = tree->n_ticks * sizeof *tree->start;
    bool is_split = nodes && kd4_tag(nodes[KD4_ROOT]) == KD4_TIME;
    tree->start = is_split ? budget_resize(budget, NULL, 0, size) : NULL;
    for (uint32_t tick = 0; tree->start && tick < tree->n_ticks; tick++) {
        uint32_t at = KD4_ROOT;
        while (kd4_tag(nodes[at]) == KD4_TIME) {
            at = kd4_index(nodes[at]) + (tick >= nodes[at].tick);
        }
        tree->start[tick] = at;
    }
}

BoxTree *boxtree_build(const BoxSegment *segments, size_t n, uint32_t n_ticks,
                       const double *tick_share, const AccelOptions *options, AccelStats *stats) {
    AccelStats own = {.n_prims = n};
    Budget budget = {.limit = options->memory};
    BoxTree *tree = calloc(1, sizeof *tree);
    BoxSegment *boxes = tree ? malloc((n ? n : 1) * sizeof *boxes) : NULL;
    if (!boxes) {
        free(tree);
        return NULL;
    }
    tree->boxes = boxes;
    tree->n_ticks = n_ticks ? n_ticks : 1;
    for (size_t i = 0; i < n; i++) {
        if (is_box(&segments[i], tree->n_ticks)) {
            boxes[tree->n_boxes++] = pad(&segments[i], tree->n_ticks);
        }
    }
    own.n_segments = tree->n_boxes;
    own.n_dropped = n - tree->n_boxes;
    own.segment_bytes = (n ? n : 1) * sizeof *boxes;
    budget.used = budget.peak = sizeof *tree + own.segment_bytes;
    build_tree(tree, tick_share, options, &budget, &own);
    find_starts(tree, &budget);
    own.tree_bytes = boxtree_bytes(tree) - own.segment_bytes;
    own.peak_bytes = budget.peak;
    if (stats) {
        *stats = own;
    }
    return tree;
}

size_t boxtree_bytes(const BoxTree *tree) {
    return (tree->start ? tree->n_ticks * sizeof *tree->start : 0) + sizeof *tree +
           (tree->n_boxes ? tree->n_boxes : 1) * sizeof *tree->boxes +
           (tree->tree.nodes ? kd4_bytes(&tree->tree) : 0);
}

bool boxtree_validate(const BoxTree *tree, char *why, size_t n) {
    return !tree->tree.nodes || kd4_validate(&tree->tree, tree->boxes, tree->n_boxes, why, n);
}

void boxtree_destroy(BoxTree *tree) {
    if (tree) {
        free(tree->tree.nodes);
        free(tree->tree.list);
        free(tree->start);
        free(tree->boxes);
        free(tree);
    }
}

// ---- Tracing

// Direct mapped: a thing seen again is forgotten only when another came to its place.
enum { MAILBOXES = 16 };

typedef struct {
    const BoxTree *tree;
    BoxRay ray;
    double tmin, tmax;
    uint32_t tick;
    BoxVisit *visit;
    void *context;
    uint64_t mail[MAILBOXES];
    uint64_t n_nodes, n_tests;
} Walk;

static void meet_box(Walk *w, const BoxSegment *box) {
    if (w->tick < box->tick0 || w->tick >= box->tick1) {
        return;
    }
    uint64_t *mail = &w->mail[box->id % MAILBOXES];
    BoxInterval met = box_clip(&w->ray, box->lo, box->hi, (BoxInterval){w->tmin, w->tmax});
    w->n_tests++;
    if (*mail != box->id && met.near <= met.far) {
        *mail = box->id;
        w->tmax = w->visit(w->context, box->id, &w->ray, w->tmax);
    }
}

static bool is_over(const Walk *w) {
    return w->tmax == -INFINITY;
}

static void walk_leaf(Walk *w, Kd4Node leaf) {
    const uint32_t *list = w->tree->tree.list + kd4_index(leaf);
    for (uint32_t i = 0; i < leaf.n && !is_over(w); i++) {
        meet_box(w, &w->tree->boxes[list[i]]);
    }
}

typedef struct {
    uint32_t node;
    BoxInterval t;
} Waiting;

// Goes down one step; what has to wait is put on the stack.
static uint32_t step(const Walk *w, Kd4Node node, BoxInterval *t, Waiting *stack, int *n_waiting) {
    uint32_t axis = kd4_tag(node), pair = kd4_index(node);
    if (axis == KD4_TIME) {
        return pair + (w->tick >= node.tick);
    }
    double at = (node.split - w->ray.o[axis]) * w->ray.r[axis];
    uint32_t far = signbit(w->ray.r[axis]) ? 0 : 1;
    if (box_lower(at) > t->far) {
        return pair + !far;
    }
    if (box_upper(at) < t->near) {
        return pair + far;
    }
    stack[(*n_waiting)++] = (Waiting){pair + far, {fmax(t->near, box_lower(at)), t->far}};
    t->far = fmin(t->far, box_upper(at));
    return pair + !far;
}

static void walk_tree(Walk *w, BoxInterval t) {
    Waiting stack[KD4_STACK];
    int n_waiting = 0;
    uint32_t at = w->tree->start ? w->tree->start[w->tick] : KD4_ROOT;
    for (;;) {
        Kd4Node node = w->tree->tree.nodes[at];
        w->n_nodes++;
        if (kd4_tag(node) != KD4_LEAF) {
            at = step(w, node, &t, stack, &n_waiting);
            continue;
        }
        walk_leaf(w, node);
        do {
            if (n_waiting == 0 || is_over(w)) {
                return;
            }
            at = stack[--n_waiting].node;
            t = stack[n_waiting].t;
        } while (t.near > w->tmax);
    }
}

static bool prepare(Walk *w, const double origin[3], const double dir[3]) {
    double largest = fmax(fabs(dir[0]), fmax(fabs(dir[1]), fabs(dir[2])));
    bool finite = largest > 0 && w->tmin <= w->tmax;
    for (int i = 0; i < 3; i++) {
        finite = finite && isfinite(origin[i]) && isfinite(dir[i]);
        // Planes that the ray is parallel to are met very far away, on the right side.
        double d = fmax(fabs(dir[i]), largest * 0x1p-300);
        w->ray.o[i] = origin[i];
        w->ray.r[i] = copysign(1 / d, dir[i]);
    }
    return finite && isfinite(1 / largest);
}

void boxtree_trace(const BoxTree *tree, const double origin[3], const double dir[3], double tmin,
                   double tmax, uint32_t tick, BoxVisit *visit, void *context,
                   AccelCounters *count) {
    Walk w = {.tree = tree, .tmin = tmin, .tmax = tmax, .visit = visit, .context = context};
    w.tick = tick < tree->n_ticks ? tick : tree->n_ticks - 1;
    for (int i = 0; i < MAILBOXES; i++) {
        w.mail[i] = UINT64_MAX;
    }
    if (prepare(&w, origin, dir) && tree->tree.nodes) {
        BoxInterval t = box_clip(&w.ray, tree->tree.lo, tree->tree.hi, (BoxInterval){tmin, tmax});
        if (t.near <= t.far) {
            walk_tree(&w, t);
        }
    } else if (prepare(&w, origin, dir)) {
        for (uint32_t i = 0; i < tree->n_boxes && !is_over(&w); i++) {
            meet_box(&w, &tree->boxes[i]);
        }
    }
    if (count) {
        count->rays++;
        count->nodes += w.n_nodes;
        count->prim_tests += w.n_tests;
    }
}
