// SPDX-License-Identifier: Apache-2.0
// Boxes whose faces move linearly, and the tightest of them around a cluster.
#include "accel/cluster.h"

#include <float.h>
#include <math.h>

MovingBox moving_box_empty(void) {
    MovingBox box;
    for (int a = 0; a < 3; a++) {
        box.lo0[a] = box.lo1[a] = INFINITY;
        box.hi0[a] = box.hi1[a] = -INFINITY;
    }
    return box;
}

static inline float least(float a, float b) {
    return a < b ? a : b;
}

static inline float most(float a, float b) {
    return a > b ? a : b;
}

void moving_box_join(MovingBox *box, const MovingBox *other) {
    for (int a = 0; a < 3; a++) {
        box->lo0[a] = least(box->lo0[a], other->lo0[a]);
        box->hi0[a] = most(box->hi0[a], other->hi0[a]);
        box->lo1[a] = least(box->lo1[a], other->lo1[a]);
        box->hi1[a] = most(box->hi1[a], other->hi1[a]);
    }
}

// Of Simpson's three heights the middle one is at the mean of the edges, so the half areas of the
// ends and the products between them say all: (2 A0 + 2 A1 + M) / 6, with M the mixed products.
double moving_box_area(const MovingBox *box) {
    double e0[3], e1[3];
    for (int a = 0; a < 3; a++) {
        e0[a] = (double)box->hi0[a] - box->lo0[a];
        e1[a] = (double)box->hi1[a] - box->lo1[a];
    }
    if (!(e0[0] >= 0 && e0[1] >= 0 && e0[2] >= 0)) {
        return 0;
    }
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        int b = a == 2 ? 0 : a + 1;
        sum += 2 * (e0[a] * e0[b] + e1[a] * e1[b]) + e0[a] * e1[b] + e1[a] * e0[b];
    }
    return sum / 6;
}

// The box of a cluster at a tick: of the key, or between two keys the linear mix, which bounds
// because every vertex moves linearly there.
static void box_at(const ClusterSet *set, uint32_t cluster, uint32_t tick, double box[6]) {
    uint32_t n_keys = set->geometry->n_keys, key = tick / TICKS_PER_SPAN;
    double f = (double)(tick % TICKS_PER_SPAN) / TICKS_PER_SPAN;
    const float *a = set->boxes + ((size_t)cluster * n_keys + key) * 6;
    const float *b = f > 0 ? a + 6 : a;
    for (int i = 0; i < 6; i++) {
        box[i] = a[i] + f * ((double)b[i] - a[i]);
    }
}

// Rounds outwards, a further ulp to cover the doubles' own rounding; stays finite.
static float round_down(double x) {
    return most(nextafterf((float)x, -INFINITY), -FLT_MAX);
}

static float round_up(double x) {
    return least(nextafterf((float)x, INFINITY), FLT_MAX);
}

MovingBox cluster_bound(const ClusterSet *set, uint32_t cluster, uint32_t tick0, uint32_t tick1) {
    double b0[6], b1[6], shift[6] = {0};
    box_at(set, cluster, tick0, b0);
    box_at(set, cluster, tick1, b1);
    uint32_t first = tick0 / TICKS_PER_SPAN + 1, last = (tick1 - (tick1 > 0)) / TICKS_PER_SPAN;
    for (uint32_t key = first; key <= last; key++) {
        const float *b = set->boxes + ((size_t)cluster * set->geometry->n_keys + key) * 6;
        double s = (double)(key * TICKS_PER_SPAN - tick0) / (double)(tick1 - tick0);
        for (int i = 0; i < 3; i++) {
            double lo = b[i] - (b0[i] + s * (b1[i] - b0[i]));
            double hi = b[i + 3] - (b0[i + 3] + s * (b1[i + 3] - b0[i + 3]));
            shift[i] = lo < shift[i] ? lo : shift[i];
            shift[i + 3] = hi > shift[i + 3] ? hi : shift[i + 3];
        }
    }
    MovingBox box;
    for (int i = 0; i < 3; i++) {
        box.lo0[i] = round_down(b0[i] + shift[i]);
        box.lo1[i] = round_down(b1[i] + shift[i]);
        box.hi0[i] = round_up(b0[i + 3] + shift[i + 3]);
        box.hi1[i] = round_up(b1[i + 3] + shift[i + 3]);
    }
    return box;
}
