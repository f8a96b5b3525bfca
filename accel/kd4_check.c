// SPDX-License-Identifier: Apache-2.0
// The 4D kd-tree's validator, its size and its end.
#include "accel/kd4.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    const Kd4Tree *tree;
    const BoxSegment *boxes;
    uint32_t n_boxes;
    uint8_t *seen;         // per node
    uint64_t n_nodes_seen; // besides the root
    uint64_t n_list_seen;
    uint64_t n_places; // leaves that the boxes belong into
    char *why;
    size_t size;
} Check;

#define FAIL(check, ...) (snprintf((check)->why, (check)->size, __VA_ARGS__), false)

static bool check_leaf(Check *c, Kd4Node leaf, uint32_t at) {
    uint32_t first = kd4_index(leaf);
    if (first > c->tree->n_list || leaf.n > c->tree->n_list - first) {
        return FAIL(c, "leaf %u: list of %u from %u passes the end %u", at, leaf.n, first,
                    c->tree->n_list);
    }
    for (uint32_t i = first; i < first + leaf.n; i++) {
        if (c->tree->list[i] >= c->n_boxes) {
            return FAIL(c, "leaf %u: box %u of %u", at, c->tree->list[i], c->n_boxes);
        }
        if (i > first && c->tree->list[i - 1] >= c->tree->list[i]) {
            return FAIL(c, "leaf %u: list not ascending", at);
        }
    }
    c->n_list_seen += leaf.n;
    return true;
}

// lo and hi of the cell in all four axes; ticks are exact in double.
static bool check_node(Check *c, uint32_t at, double lo[4], double hi[4], int depth) {
    Kd4Node node = c->tree->nodes[at];
    uint32_t axis = kd4_tag(node), pair = kd4_index(node);
    if (axis == KD4_LEAF) {
        return check_leaf(c, node, at);
    }
    if (axis > KD4_LEAF || depth >= KD4_MAX_DEPTH) {
        return FAIL(c, "node %u: tag %u at depth %d", at, axis, depth);
    }
    if (pair < 2 || pair % 2 || pair + 1 >= c->tree->n_nodes || c->seen[pair]) {
        return FAIL(c, "node %u: children at %u", at, pair);
    }
    c->seen[pair] = 1;
    c->n_nodes_seen += 2;
    double split = axis == KD4_TIME ? node.tick : node.split;
    if (!(lo[axis] < split && split < hi[axis])) {
        return FAIL(c, "node %u: split %g outside of its cell, %g to %g", at, split, lo[axis],
                    hi[axis]);
    }
    double whole[2] = {lo[axis], hi[axis]};
    hi[axis] = split;
    bool ok = check_node(c, pair, lo, hi, depth + 1);
    hi[axis] = whole[1];
    lo[axis] = split;
    ok = ok && check_node(c, pair + 1, lo, hi, depth + 1);
    lo[axis] = whole[0];
    return ok;
}

static bool is_listed(const Kd4Tree *tree, Kd4Node leaf, uint32_t box) {
    uint32_t lo = kd4_index(leaf), hi = lo + leaf.n;
    while (lo < hi) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (tree->list[middle] < box) {
            lo = middle + 1;
        } else {
            hi = middle;
        }
    }
    return lo < kd4_index(leaf) + leaf.n && tree->list[lo] == box;
}

static bool check_box(Check *c, uint32_t at, uint32_t box) {
    Kd4Node node = c->tree->nodes[at];
    const BoxSegment *b = &c->boxes[box];
    uint32_t axis = kd4_tag(node), pair = kd4_index(node);
    if (axis == KD4_LEAF) {
        c->n_places++;
        return is_listed(c->tree, node, box) ||
               FAIL(c, "leaf %u: box %u is in the cell and not in the list", at, box);
    }
    bool left = axis == KD4_TIME ? b->tick0 < node.tick : b->lo[axis] < node.split;
    bool right = axis == KD4_TIME ? b->tick1 > node.tick : b->hi[axis] > node.split;
    return (!left || check_box(c, pair, box)) && (!right || check_box(c, pair + 1, box));
}

static bool check_all(Check *c) {
    const Kd4Tree *tree = c->tree;
    double lo[4] = {tree->lo[0], tree->lo[1], tree->lo[2], 0};
    double hi[4] = {tree->hi[0], tree->hi[1], tree->hi[2], tree->n_ticks};
    if (!check_node(c, KD4_ROOT, lo, hi, 0)) {
        return false;
    }
    if (c->n_nodes_seen + 2 != tree->n_nodes || c->n_list_seen != tree->n_list) {
        return FAIL(c, "%u nodes and %u list entries, but %llu and %llu can be reached",
                    tree->n_nodes, tree->n_list, (unsigned long long)c->n_nodes_seen + 2,
                    (unsigned long long)c->n_list_seen);
    }
    for (uint32_t i = 0; i < c->n_boxes; i++) {
        for (int k = 0; k < 3; k++) {
            if (!(tree->lo[k] <= c->boxes[i].lo[k] && c->boxes[i].hi[k] <= tree->hi[k])) {
                return FAIL(c, "box %u is not within the bounds of all", i);
            }
        }
        if (!check_box(c, KD4_ROOT, i)) {
            return false;
        }
    }
    // All that belong are listed, so equal counts mean that nothing else is.
    return c->n_places == tree->n_list || FAIL(c, "%u list entries for %llu places", tree->n_list,
                                               (unsigned long long)c->n_places);
}

bool kd4_validate(const Kd4Tree *tree, const BoxSegment *boxes, uint32_t n, char *why,
                  size_t size) {
    Check c = {.tree = tree, .boxes = boxes, .n_boxes = n, .why = why, .size = size};
    c.seen = calloc(tree->n_nodes, 1);
    if (!c.seen) {
        return FAIL(&c, "no memory to validate in");
    }
    bool ok = check_all(&c);
    free(c.seen);
    return ok;
}

size_t kd4_bytes(const Kd4Tree *tree) {
    return tree->n_nodes * sizeof *tree->nodes +
           (tree->n_list ? tree->n_list : 1) * sizeof *tree->list;
}

void kd4_pad_box(const double lo[3], const double hi[3], const double largest[3], float out_lo[3],
                 float out_hi[3]) {
    const double u = 0x1p-24;
    double extent = fmax(hi[0] - lo[0], fmax(hi[1] - lo[1], hi[2] - lo[2]));
    for (int i = 0; i < 3; i++) {
        double pad = 16 * u * largest[i] + 8 * u * extent + 1e-36;
        double a = fmax(lo[i] - pad, -FLT_MAX), b = fmin(hi[i] + pad, FLT_MAX);
        out_lo[i] = nextafterf((float)a, -FLT_MAX);
        out_hi[i] = nextafterf((float)b, FLT_MAX);
    }
}
