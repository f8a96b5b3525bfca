// SPDX-License-Identifier: Apache-2.0
// The binary tree under the wide one: clusters, split by object or in time.
//
// Every reference knows the mean area of its moving box over the interval and over its two halves,
// each bounded anew. The gain of cutting time is what that saves over all the references of a set.
// Time is cut when the gain is over TIME_GAIN and both sides of the best split of objects would
// still want it, or the set is small; otherwise objects are split first and each side asks again,
// so that a fast part is cut in time and the still part beside it is not.
#include "accel/wide.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_BINS = 32,
    ASK_BELOW = 16,   // a set so small is cut in time by its own gain alone
    MAX_HALVINGS = 8, // of the whole interval
    MAX_DEPTH = 96    // of splits by cost; beyond it sets are halved
};

// Flat optimum: any value from 0.04 to 0.3 gives the same speed within a few percent.
static const double TIME_GAIN = 0.12, SIDE_GAIN = 0.06;

typedef struct {
    MovingBox box;
    uint32_t cluster;
    float whole, halves; // mean half areas; halves < 0: not asked yet
} Reference;

typedef struct {
    BinaryTree *tree;
    const ClusterSet *set;
    const double *share;
    Reference *refs; // a stack: children that are cut in time append copies
    size_t n_refs, capacity;
} Builder;

typedef struct {
    size_t first;
    uint32_t n, tick0, tick1, halvings, depth;
} Job;

typedef struct {
    double cost;
    int axis, n_bins, bin;
    float lo, scale;
    uint32_t n_left;
} Split;

static uint32_t middle_tick(const Builder *b, const Job *job) {
    uint32_t span = TICKS_PER_SPAN;
    double want = 0.5 * (b->share[job->tick0] + b->share[job->tick1]);
    uint32_t lo = job->tick0, hi = job->tick1;
    while (hi - lo > 1) { // the last tick whose start is before the middle
        uint32_t middle = lo + (hi - lo) / 2;
        if (b->share[middle] <= want) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    uint32_t key = (lo + span / 2) / span * span; // a key if one lies inside
    uint32_t tick = key > job->tick0 && key < job->tick1 ? key : lo;
    return tick > job->tick0 && tick < job->tick1 ? tick : 0;
}

static double part_before(const Builder *b, const Job *job, uint32_t tick) {
    double whole = b->share[job->tick1] - b->share[job->tick0];
    return whole > 0 ? (b->share[tick] - b->share[job->tick0]) / whole : 0.5;
}

static void ask_halves(const Builder *b, const Job *job, Reference *ref, uint32_t tick,
                       double before) {
    if (ref->halves >= 0) {
        return;
    }
    MovingBox a = cluster_bound(b->set, ref->cluster, job->tick0, tick);
    MovingBox c = cluster_bound(b->set, ref->cluster, tick, job->tick1);
    ref->halves = (float)(before * moving_box_area(&a) + (1 - before) * moving_box_area(&c));
}

static double gain_of(const Reference *refs, uint32_t n) {
    double whole = 0, halves = 0;
    for (uint32_t i = 0; i < n; i++) {
        whole += refs[i].whole;
        halves += refs[i].halves;
    }
    return whole > 0 ? 1 - halves / whole : 0;
}

static float center_of(const Reference *ref, int axis) {
    const MovingBox *box = &ref->box;
    return 0.25f * (box->lo0[axis] + box->hi0[axis] + box->lo1[axis] + box->hi1[axis]);
}

static int bin_of(const Reference *ref, const Split *split) {
    float at = (center_of(ref, split->axis) - split->lo) * split->scale;
    return at >= (float)split->n_bins ? split->n_bins - 1 : at > 0 ? (int)at : 0;
}

static void bin_axis(const Reference *refs, uint32_t n, const Split *trial, Split *best) {
    MovingBox box[MOST_BINS];
    uint32_t count[MOST_BINS] = {0};
    int n_bins = trial->n_bins;
    for (int i = 0; i < n_bins; i++) {
        box[i] = moving_box_empty();
    }
    for (uint32_t i = 0; i < n; i++) {
        int k = bin_of(&refs[i], trial);
        moving_box_join(&box[k], &refs[i].box);
        count[k]++;
    }
    double right[MOST_BINS];
    MovingBox sum = moving_box_empty();
    for (int i = n_bins - 1; i > 0; i--) {
        moving_box_join(&sum, &box[i]);
        right[i] = moving_box_area(&sum);
    }
    sum = moving_box_empty();
    uint32_t n_left = 0;
    for (int i = 0; i + 1 < n_bins; i++) {
        moving_box_join(&sum, &box[i]);
        n_left += count[i];
        if (n_left == 0 || n_left == n) {
            continue;
        }
        double cost = moving_box_area(&sum) * n_left + right[i + 1] * (n - n_left);
        if (cost < best->cost) {
            *best = *trial;
            best->cost = cost;
            best->bin = i + 1;
            best->n_left = n_left;
        }
    }
}

// Two things are parted along the axis on which they lie furthest apart.
static Split split_of_two(const Reference *refs) {
    Split best = {.axis = -1, .n_bins = 2, .bin = 1, .n_left = 1};
    float most = 0;
    for (int axis = 0; axis < 3; axis++) {
        float a = center_of(&refs[0], axis), b = center_of(&refs[1], axis);
        float lo = a < b ? a : b, hi = a < b ? b : a, scale = 2 / (hi - lo);
        if (hi - lo > most && isfinite(scale)) {
            most = hi - lo;
            best.axis = axis;
            best.lo = lo;
            best.scale = scale;
        }
    }
    return best;
}

static Split best_split(const Reference *refs, uint32_t n) {
    if (n == 2) {
        return split_of_two(refs);
    }
    Split best = {.cost = INFINITY, .axis = -1};
    // More bins than things tell nothing more.
    int n_bins = n < MOST_BINS / 4 ? MOST_BINS / 4 : n < MOST_BINS ? (int)n : MOST_BINS;
    for (int axis = 0; axis < 3; axis++) {
        float lo = INFINITY, hi = -INFINITY;
        for (uint32_t i = 0; i < n; i++) {
            float c = center_of(&refs[i], axis);
            lo = c < lo ? c : lo;
            hi = c > hi ? c : hi;
        }
        Split trial = {
            .axis = axis, .n_bins = n_bins, .lo = lo, .scale = (float)n_bins / (hi - lo)};
        if (hi > lo && isfinite(trial.scale)) {
            bin_axis(refs, n, &trial, &best);
        }
    }
    return best;
}

// Stable for the left side, deterministic for both.
static void partition(Reference *refs, uint32_t n, const Split *split) {
    uint32_t left = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (bin_of(&refs[i], split) < split->bin) {
            Reference moved = refs[i];
            refs[i] = refs[left];
            refs[left++] = moved;
        }
    }
}

static uint32_t new_node(BinaryTree *tree) {
    if (tree->n == tree->capacity) {
        uint32_t larger = tree->capacity ? tree->capacity * 2 : BINARY_FIRST;
        BinaryNode *copy = realloc(tree->nodes, larger * sizeof *copy);
        if (!copy) {
            tree->is_out_of_memory = true;
            return 0;
        }
        tree->nodes = copy;
        tree->capacity = larger;
    }
    return tree->n++;
}

static bool reserve_refs(Builder *b, size_t n) {
    if (b->n_refs + n <= b->capacity) {
        return true;
    }
    size_t larger = (b->n_refs + n) * 3 / 2;
    Reference *copy = realloc(b->refs, larger * sizeof *copy);
    if (!copy) {
        b->tree->is_out_of_memory = true;
        return false;
    }
    b->refs = copy;
    b->capacity = larger;
    return true;
}

static uint32_t build(Builder *b, Job job);

// Appends the references bounded over one half, builds it, and takes them off again.
static uint32_t build_half(Builder *b, const Job *job, uint32_t tick0, uint32_t tick1) {
    size_t first = b->n_refs;
    if (!reserve_refs(b, job->n)) {
        return 0;
    }
    for (uint32_t i = 0; i < job->n; i++) {
        Reference *ref = &b->refs[first + i];
        ref->cluster = b->refs[job->first + i].cluster;
        ref->box = cluster_bound(b->set, ref->cluster, tick0, tick1);
        ref->whole = (float)moving_box_area(&ref->box);
        ref->halves = -1;
    }
    b->n_refs += job->n;
    uint32_t node = build(b, (Job){first, job->n, tick0, tick1, job->halvings + 1, job->depth + 1});
    b->n_refs = first;
    return node;
}

static bool wants_time(const Builder *b, const Job *job, Split *split, uint32_t tick) {
    Reference *refs = b->refs + job->first;
    double before = part_before(b, job, tick);
    for (uint32_t i = 0; i < job->n; i++) {
        ask_halves(b, job, &refs[i], tick, before);
    }
    if (gain_of(refs, job->n) <= TIME_GAIN) {
        return false;
    }
    if (job->n <= ASK_BELOW || split->axis < 0) {
        return true;
    }
    partition(refs, job->n, split);
    return gain_of(refs, split->n_left) > SIDE_GAIN &&
           gain_of(refs + split->n_left, job->n - split->n_left) > SIDE_GAIN;
}

static uint32_t build(Builder *b, Job job) {
    BinaryTree *tree = b->tree;
    uint32_t at = new_node(tree);
    if (tree->is_out_of_memory) {
        return 0;
    }
    tree->depth = job.depth > tree->depth ? job.depth : tree->depth;
    MovingBox box = moving_box_empty();
    for (uint32_t i = 0; i < job.n; i++) {
        moving_box_join(&box, &b->refs[job.first + i].box);
    }
    BinaryNode node = {.box = box, .tick0 = job.tick0, .tick1 = job.tick1};
    double area = moving_box_area(&box);
    node.area = area < 1e30 ? (float)area : 1e30f; // costs stay finite, whatever the coordinates
    uint32_t tick = job.halvings < MAX_HALVINGS ? middle_tick(b, &job) : 0;
    Split split = job.n > 1 && job.depth < MAX_DEPTH ? best_split(b->refs + job.first, job.n)
                                                     : (Split){.axis = -1};
    if (tick && wants_time(b, &job, &split, tick)) {
        tree->n_time_splits++;
        node.split = tick;
        node.left = build_half(b, &job, job.tick0, tick);
        node.right = build_half(b, &job, tick, job.tick1);
    } else if (job.n == 1) {
        node.left = UINT32_MAX;
        node.right = b->refs[job.first].cluster;
    } else {
        uint32_t n_left = job.n / 2;
        if (split.axis >= 0) {
            partition(b->refs + job.first, job.n, &split);
            n_left = split.n_left;
        }
        Job side = {job.first, n_left, job.tick0, job.tick1, job.halvings, job.depth + 1};
        node.left = build(b, side);
        side.first += n_left;
        side.n = job.n - n_left;
        node.right = build(b, side);
    }
    tree->nodes[at] = node;
    return at;
}

void binary_build(BinaryTree *tree, const ClusterSet *set, const double *share,
                  uint32_t last_tick) {
    Builder b = {.tree = tree, .set = set, .share = share};
    if (!reserve_refs(&b, set->n_clusters)) {
        return;
    }
    for (uint32_t c = 0; c < set->n_clusters; c++) {
        Reference *ref = &b.refs[c];
        ref->cluster = c;
        ref->box = cluster_bound(set, c, 0, last_tick);
        ref->whole = (float)moving_box_area(&ref->box);
        ref->halves = -1;
    }
    b.n_refs = set->n_clusters;
    if (b.n_refs) {
        build(&b, (Job){0, set->n_clusters, 0, last_tick, 0, 0});
    }
    free(b.refs);
}
