// SPDX-License-Identifier: Apache-2.0
// The tightest moving box around a cluster.
#include "accel/cluster.h"

#include <float.h>
#include <math.h>

static inline float least(float a, float b) {
    return a < b ? a : b;
}

static inline float most(float a, float b) {
    return a > b ? a : b;
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
