// SPDX-License-Identifier: Apache-2.0
// The builder of the 4D kd-tree.
//
// Exact sweeps over the boxes' edges, which are kept sorted on every axis from the root down
// (Wald, Havran, "On building fast kd-trees for ray tracing, and on doing that in O(N log N)",
// 2006). Boxes are not clipped to cells: edges outside of a cell count, but are no candidates, and
// a stable partition keeps all lists in order.
#include "accel/kd4.h"

#include <float.h>
#include <math.h>
#include <string.h>

// t_t and t_i of equation 3. A test of a moving triangle takes about three times as long as a step
// down, but on a twisted mesh (10,000 triangles, 198,000 segments) that ratio gives 17.0 million
// references, 49 steps and 15 tests per random ray, where equal costs give 10.0 million, 47 and 18:
// that little is not worth the memory.
static const double COST_STEP = 1, COST_TEST = 1;
// b_e: a split that cuts off an empty cell is taken for so much cheaper.
static const double EMPTY_BONUS = 0.2;

enum { SIDE_LEFT = 1, SIDE_RIGHT = 2, SIDE_BOTH = 3 };

// One edge of one box. at: the place, as an integer in the order of the floats; ref: box * 2 + 1
// where the box begins, box * 2 where it ends. Sorted by (at, ends first, box).
typedef struct {
    uint32_t at, ref;
} Event;

typedef struct {
    float lo[3], hi[3];
    uint32_t tick0, tick1;
} Cell;

typedef struct {
    double cost;
    uint32_t axis, at;
    uint32_t n_left, n_right;
} Split;

typedef struct {
    const BoxSegment *boxes;
    const TimeAxis *time;
    const AccelOptions *options;
    Budget *budget;
    AccelStats *stats;
    Kd4Tree *tree;
    uint32_t n_axes, max_depth;
    Event *events[4];
    size_t event_capacity, node_capacity, list_capacity;
    size_t n_promised; // list entries that open cells will need at most
    uint8_t *side;     // per box
} Builder;

static uint32_t order_of(float x) {
    uint32_t bits;
    x += 0.0f; // -0 is 0
    memcpy(&bits, &x, sizeof bits);
    return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

static float float_of(uint32_t order) {
    uint32_t bits = order & 0x80000000u ? order & 0x7fffffffu : ~order;
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static double share_before(const TimeAxis *axis, uint32_t tick) {
    uint32_t i = tick / axis->unit, rest = tick % axis->unit;
    double p = axis->prefix[i];
    return rest ? p + (axis->prefix[i + 1] - p) * rest / axis->unit : p;
}

// ---- Sorting

static void fill_events(Builder *b, uint32_t n, uint32_t axis) {
    Event *e = b->events[axis];
    for (uint32_t i = 0; i < n; i++) {
        const BoxSegment *box = &b->boxes[i];
        bool time = axis == KD4_TIME;
        e[i] = (Event){time ? box->tick1 : order_of(box->hi[axis]), 2 * i};
        e[n + i] = (Event){time ? box->tick0 : order_of(box->lo[axis]), 2 * i + 1};
    }
}

// Stable by `at`, in three passes of 11 bits; what comes in has the ends first and the boxes in
// order. The upper half of the array is scratch.
static void sort_events(Event *events, size_t n) {
    Event *from = events, *to = events + n;
    for (int shift = 0; shift < 33; shift += 11) {
        size_t start[2049] = {0};
        for (size_t i = 0; i < n; i++) {
            start[(from[i].at >> shift & 2047) + 1]++;
        }
        for (int i = 0; i < 2048; i++) {
            start[i + 1] += start[i];
        }
        for (size_t i = 0; i < n; i++) {
            to[start[from[i].at >> shift & 2047]++] = from[i];
        }
        Event *swap = from;
        from = to;
        to = swap;
    }
    memcpy(events, from, n * sizeof *events); // three passes end in the upper half
}

static void sift_down(uint32_t *a, size_t i, size_t n) {
    for (size_t child = 2 * i + 1; child < n; i = child, child = 2 * i + 1) {
        child += child + 1 < n && a[child] < a[child + 1];
        if (a[i] >= a[child]) {
            return;
        }
        uint32_t swap = a[i];
        a[i] = a[child];
        a[child] = swap;
    }
}

// Heapsort: takes no memory, which the budget would not know of.
static void sort_list(uint32_t *a, size_t n) {
    for (size_t i = n / 2; i-- > 0;) {
        sift_down(a, i, n);
    }
    for (size_t i = n; i-- > 1;) {
        uint32_t swap = a[0];
        a[0] = a[i];
        a[i] = swap;
        sift_down(a, 0, i);
    }
}

// ---- Memory

// Grows by half where there is room for it, else to what is needed, else not at all.
static bool reserve(Budget *budget, void **array, size_t *capacity, size_t need, size_t size) {
    if (need <= *capacity) {
        return true;
    }
    size_t wanted[2] = {*capacity + *capacity / 2, need};
    for (int i = wanted[0] < need; i < 2; i++) {
        void *p = budget_resize(budget, *array, *capacity * size, wanted[i] * size);
        if (p) {
            *array = p;
            *capacity = wanted[i];
            return true;
        }
    }
    return false;
}

static bool reserve_nodes(Builder *b, size_t need) {
    void *p = b->tree->nodes;
    bool ok = need < 1u << (32 - KD4_TAG_BITS) &&
              reserve(b->budget, &p, &b->node_capacity, need, sizeof(Kd4Node));
    b->tree->nodes = p;
    return ok;
}

static bool reserve_list(Builder *b, size_t need) {
    void *p = b->tree->list;
    bool ok = need < 1u << (32 - KD4_TAG_BITS) &&
              reserve(b->budget, &p, &b->list_capacity, need, sizeof(uint32_t));
    b->tree->list = p;
    return ok;
}

static bool reserve_events(Builder *b, size_t need) {
    size_t capacity = b->event_capacity;
    for (uint32_t axis = 0; axis < b->n_axes; axis++) {
        void *p = b->events[axis];
        capacity = b->event_capacity;
        if (!reserve(b->budget, &p, &capacity, need, sizeof(Event))) {
            // Those that were enlarged already go back, so that all have one capacity.
            for (uint32_t i = 0; i < axis; i++) {
                b->events[i] = budget_resize(b->budget, b->events[i], need * sizeof(Event),
                                             b->event_capacity * sizeof(Event));
            }
            return false;
        }
        b->events[axis] = p;
        need = capacity; // the others alike
    }
    b->event_capacity = capacity;
    return true;
}

// ---- Costs

static void consider(Split *best, uint32_t axis, uint32_t at, double p_left, double p_right,
                     size_t n_left, size_t n_right) {
    double tests = p_left * (double)n_left + p_right * (double)n_right;
    double bonus = n_left && n_right ? 1 : 1 - EMPTY_BONUS;
    double cost = COST_STEP + bonus * tests * COST_TEST;
    if (cost < best->cost) {
        *best = (Split){cost, axis, at, (uint32_t)n_left, (uint32_t)n_right};
    }
}

// A plane at x gives cells of half areas (x - lo) * rim + base and (hi - x) * rim + base.
typedef struct {
    double lo, hi, rim, base, area;
} Slab;

static Slab slab_of(const Cell *cell, uint32_t axis) {
    uint32_t i = (axis + 1) % 3, j = (axis + 2) % 3;
    double h = (double)cell->hi[i] - cell->lo[i], w = (double)cell->hi[j] - cell->lo[j];
    Slab s = {cell->lo[axis], cell->hi[axis], h + w, h * w, 0};
    s.area = (s.hi - s.lo) * s.rim + s.base;
    return s;
}

// Whether a plane in the cell can be told from its sides.
static bool is_divisible(const Cell *cell, uint32_t axis) {
    if (axis == KD4_TIME) {
        return cell->tick1 - cell->tick0 > 1;
    }
    double lo = cell->lo[axis], hi = cell->hi[axis];
    return hi - lo > 4 * FLT_EPSILON * fmax(fabs(lo), fabs(hi)) && hi - lo > FLT_MIN;
}

static void sweep(const Builder *b, size_t first, size_t n, const Cell *cell, uint32_t axis,
                  Split *best) {
    const Event *e = b->events[axis] + first, *end = e + 2 * n;
    bool time = axis == KD4_TIME;
    uint32_t lo = time ? cell->tick0 : order_of(cell->lo[axis]);
    uint32_t hi = time ? cell->tick1 : order_of(cell->hi[axis]);
    double share0 = time ? share_before(b->time, lo) : 0;
    double share = time ? share_before(b->time, hi) - share0 : 0;
    Slab slab = time ? (Slab){0} : slab_of(cell, axis);
    if (time ? !(share > 0) : !(slab.area > 0)) {
        return;
    }
    size_t n_left = 0, n_right = n;
    while (e < end && e->at < hi) {
        uint32_t at = e->at;
        size_t n_begin = 0;
        for (; e < end && e->at == at; e++) {
            n_begin += e->ref & 1;
            n_right -= !(e->ref & 1);
        }
        if (at > lo) {
            double x = time ? 0 : float_of(at);
            double p = time ? (share_before(b->time, at) - share0) / share
                            : ((x - slab.lo) * slab.rim + slab.base) / slab.area;
            double q = time ? 1 - p : ((slab.hi - x) * slab.rim + slab.base) / slab.area;
            consider(best, axis, at, p, q, n_left, n_right);
        }
        n_left += n_begin;
    }
}

// ---- Cells

static void make_leaf(Builder *b, uint32_t node, size_t first, size_t n, uint32_t depth,
                      LeafReason reason) {
    Kd4Tree *tree = b->tree;
    uint32_t start = tree->n_list;
    for (const Event *e = b->events[0] + first, *end = e + 2 * n; e < end; e++) {
        if (e->ref & 1) {
            tree->list[tree->n_list++] = e->ref >> 1;
        }
    }
    sort_list(tree->list + start, n);
    tree->nodes[node].n = (uint32_t)n;
    tree->nodes[node].word = start << KD4_TAG_BITS | KD4_LEAF;
    b->n_promised -= n;
    b->stats->n_leaves++;
    b->stats->leaves_by[reason]++;
    b->stats->n_references += n;
    b->stats->n_depth = depth > b->stats->n_depth ? depth : b->stats->n_depth;
}

// Room for the two nodes, for the lists that all open cells may need, for the children's edges.
static bool has_room(Builder *b, size_t first, size_t n, const Split *split) {
    size_t n_children = (size_t)split->n_left + split->n_right;
    size_t promised = b->n_promised - n + n_children;
    return reserve_nodes(b, (size_t)b->tree->n_nodes + 2) &&
           reserve_list(b, b->tree->n_list + promised) &&
           reserve_events(b, first + 2 * n + 2 * (size_t)split->n_left);
}

static void choose_sides(Builder *b, size_t first, size_t n, const Split *split) {
    const Event *e = b->events[split->axis] + first;
    for (const Event *end = e + 2 * n; e < end; e++) {
        uint8_t *side = &b->side[e->ref >> 1];
        if (e->ref & 1) { // comes before the same box's end
            *side = e->at >= split->at ? SIDE_RIGHT : SIDE_BOTH;
        } else if (e->at <= split->at) {
            *side = SIDE_LEFT;
        }
    }
}

// The right child's edges stay in place, the left child's follow them. A child that will be a leaf
// needs no more than a list of its boxes, so its edges on the first axis.
static void part_events(Builder *b, size_t first, size_t n, const Split *split, uint32_t depth) {
    bool leaves = depth + 1 >= b->max_depth;
    uint8_t later = (uint8_t)((split->n_left > b->options->leaf_size ? SIDE_LEFT : 0) |
                              (split->n_right > b->options->leaf_size ? SIDE_RIGHT : 0));
    for (uint32_t axis = 0; axis < b->n_axes; axis++) {
        uint8_t wanted = axis == 0 ? SIDE_BOTH : leaves ? 0 : later;
        Event *e = b->events[axis] + first, *right = e, *left = e + 2 * n;
        for (Event *end = wanted ? e + 2 * n : e; e < end; e++) {
            uint8_t side = b->side[e->ref >> 1] & wanted;
            if (side & SIDE_LEFT) {
                *left++ = *e;
            }
            if (side & SIDE_RIGHT) {
                *right++ = *e;
            }
        }
        Event *left_begin = b->events[axis] + first + 2 * n;
        memmove(b->events[axis] + first + 2 * (size_t)split->n_right, left_begin,
                (size_t)(left - left_begin) * sizeof *left);
    }
}

static bool find_split(const Builder *b, size_t first, size_t n, const Cell *cell, Split *split,
                       LeafReason *reason) {
    *split = (Split){.cost = COST_TEST * (double)n, .axis = KD4_LEAF};
    bool divisible = false;
    for (uint32_t axis = 0; axis < b->n_axes; axis++) {
        if (is_divisible(cell, axis)) {
            divisible = true;
            sweep(b, first, n, cell, axis, split);
        }
    }
    *reason = divisible ? LEAF_BY_COST : LEAF_BY_DEGENERATE;
    return split->axis != KD4_LEAF;
}

static void split_cell(const Cell *cell, const Split *split, Cell *left, Cell *right) {
    *left = *right = *cell;
    if (split->axis == KD4_TIME) {
        left->tick1 = right->tick0 = split->at;
    } else {
        left->hi[split->axis] = right->lo[split->axis] = float_of(split->at);
    }
}

static void build_node(Builder *b, uint32_t node, size_t first, size_t n, const Cell *cell,
                       uint32_t depth) {
    Split split;
    LeafReason reason = LEAF_BY_EMPTY;
    bool splits = false;
    if (n > 0 && depth >= b->max_depth) {
        reason = LEAF_BY_DEPTH;
    } else if (n > 0 && n <= b->options->leaf_size) {
        reason = LEAF_BY_SIZE;
    } else if (n > 0 && find_split(b, first, n, cell, &split, &reason)) {
        splits = has_room(b, first, n, &split);
        reason = LEAF_BY_MEMORY;
    }
    if (!splits) {
        make_leaf(b, node, first, n, depth, reason);
        return;
    }
    choose_sides(b, first, n, &split);
    part_events(b, first, n, &split, depth);
    b->n_promised += (size_t)split.n_left + split.n_right - n;
    uint32_t pair = b->tree->n_nodes;
    b->tree->n_nodes += 2;
    Kd4Node *out = &b->tree->nodes[node];
    out->word = pair << KD4_TAG_BITS | split.axis;
    if (split.axis == KD4_TIME) {
        out->tick = split.at;
        b->stats->n_time_splits++;
    } else {
        out->split = float_of(split.at);
    }
    Cell left, right;
    split_cell(cell, &split, &left, &right);
    build_node(b, pair, first + 2 * (size_t)split.n_right, split.n_left, &left, depth + 1);
    build_node(b, pair + 1, first, split.n_right, &right, depth + 1);
}

static uint32_t default_depth(uint32_t n) {
    double depth = 8 + 1.3 * log2(n > 1 ? n : 1) + 4;
    return depth < KD4_MAX_DEPTH ? (uint32_t)depth : KD4_MAX_DEPTH;
}

static void root_cell(const BoxSegment *boxes, uint32_t n, Kd4Tree *tree, Cell *cell) {
    for (int i = 0; i < 3; i++) {
        tree->lo[i] = n ? FLT_MAX : 0;
        tree->hi[i] = n ? -FLT_MAX : 0;
        for (uint32_t k = 0; k < n; k++) {
            tree->lo[i] = fminf(tree->lo[i], boxes[k].lo[i]);
            tree->hi[i] = fmaxf(tree->hi[i], boxes[k].hi[i]);
        }
        cell->lo[i] = tree->lo[i];
        cell->hi[i] = tree->hi[i];
    }
    cell->tick0 = 0;
    cell->tick1 = tree->n_ticks;
}

// The working arrays of a real build. False: no room, the tree is one leaf.
static bool set_up(Builder *b, uint32_t n) {
    if (n <= b->options->leaf_size || b->max_depth == 0 || !reserve_events(b, 4 * (size_t)n)) {
        return false;
    }
    b->side = budget_resize(b->budget, NULL, 0, n);
    if (!b->side) {
        return false;
    }
    for (uint32_t axis = 0; axis < b->n_axes; axis++) {
        fill_events(b, n, axis);
        sort_events(b->events[axis], 2 * (size_t)n);
    }
    return true;
}

static void make_single_leaf(Builder *b, uint32_t n) {
    Kd4Tree *tree = b->tree;
    for (uint32_t i = 0; i < n; i++) {
        tree->list[i] = i;
    }
    tree->n_list = n;
    tree->nodes[KD4_ROOT].n = n;
    tree->nodes[KD4_ROOT].word = KD4_LEAF;
    LeafReason reason = n == 0                       ? LEAF_BY_EMPTY
                        : b->max_depth == 0          ? LEAF_BY_DEPTH
                        : n <= b->options->leaf_size ? LEAF_BY_SIZE
                                                     : LEAF_BY_MEMORY;
    b->stats->n_leaves++;
    b->stats->leaves_by[reason]++;
    b->stats->n_references += n;
}

static void trim(Builder *b, uint32_t n) {
    for (uint32_t axis = 0; axis < b->n_axes; axis++) {
        budget_resize(b->budget, b->events[axis], b->event_capacity * sizeof(Event), 0);
    }
    budget_resize(b->budget, b->side, b->side ? n : 0, 0);
    Kd4Tree *tree = b->tree;
    Kd4Node *nodes = budget_resize(b->budget, tree->nodes, b->node_capacity * sizeof(Kd4Node),
                                   tree->n_nodes * sizeof(Kd4Node));
    tree->nodes = nodes ? nodes : tree->nodes;
    size_t n_list = tree->n_list ? tree->n_list : 1; // the array stays valid
    uint32_t *list = budget_resize(b->budget, tree->list, b->list_capacity * sizeof(uint32_t),
                                   n_list * sizeof(uint32_t));
    tree->list = list ? list : tree->list;
}

bool kd4_build(const BoxSegment *boxes, uint32_t n, const TimeAxis *axis,
               const AccelOptions *options, Budget *budget, Kd4Tree *tree, AccelStats *stats) {
    Builder b = {boxes, axis, options, budget, stats, tree};
    *tree = (Kd4Tree){.n_ticks = axis->n_ticks};
    b.n_axes = options->split_time ? 4 : 3;
    b.max_depth = options->max_depth ? options->max_depth : default_depth(n);
    b.max_depth = b.max_depth < KD4_MAX_DEPTH ? b.max_depth : KD4_MAX_DEPTH;
    if (!reserve_nodes(&b, 2) || !reserve_list(&b, n ? n : 1)) {
        budget_resize(budget, tree->nodes, b.node_capacity * sizeof(Kd4Node), 0);
        tree->nodes = NULL;
        return false;
    }
    memset(tree->nodes, 0, 2 * sizeof *tree->nodes);
    tree->n_nodes = 2;
    b.n_promised = n;
    Cell cell;
    root_cell(boxes, n, tree, &cell);
    if (set_up(&b, n)) {
        build_node(&b, KD4_ROOT, 0, n, &cell, 0);
    } else {
        make_single_leaf(&b, n);
    }
    trim(&b, n);
    stats->n_nodes = tree->n_nodes - 1;
    return true;
}
