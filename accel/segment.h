// SPDX-License-Identifier: Apache-2.0
// Temporal segmentation (Olsson 2007, section 5.1): a moving primitive becomes subprimitives, each
// for an interval of time in which its swept box is at most kappa times as large as the box that it
// begins with (equation 4, by surface area).
//
// Intervals are whole ticks. They never cover a span of share 0, nor one where a vertex is not
// finite at either key: there the primitive is absent. An end of an interval that lies on a key is
// evaluated from inside the interval, so that what is not finite beyond does not leak in.
#ifndef ACCEL_SEGMENT_H
#define ACCEL_SEGMENT_H

#include "accel/boxtree.h"
#include "accel/budget.h"

typedef struct {
    BoxSegment *boxes; // by primitive (id), then by time; padded by kd4_pad_box()
    uint32_t n;
    size_t capacity; // in boxes, as the budget counts them
    uint64_t n_dropped;
    double kappa_min, kappa_median, kappa_max; // median to 1 %
} SegmentList;

static inline uint32_t geometry_spans(const Geometry *geometry) {
    return geometry->n_keys > 1 ? geometry->n_keys - 1 : 1;
}

// The share of a span; 0 also for what is no share at all.
double segment_share(const Geometry *geometry, uint32_t span);

// Whether the primitive is there in that span: it has a share, and all is finite at both keys.
bool segment_is_present(const Geometry *geometry, uint32_t prim, uint32_t span);

// The padded box that holds the primitive at all times of the ticks [tick0, tick1), ends included;
// it must be present throughout. A vertex moves linearly between keys, so the box holds the
// instants at both ends and at every key between. Computed in double.
void segment_box(const Geometry *geometry, uint32_t prim, uint32_t tick0, uint32_t tick1,
                 float lo[3], float hi[3]);

// All primitives, kappa > 1 (INFINITY: no more segments than there are gaps). A primitive without
// any extent throughout a stretch of time cannot be hit, and has no segment there. The greatest
// interval is taken each time, as the thesis does, but two guards were needed: to the first box's
// area are added (1e-3 of the primitive's diagonal)^2, since it may be 0, and one tick is always
// taken. At most max_segments, within the budget; false: more would be needed, and nothing is kept.
// O(keys) per primitive and O(1) per segment.
bool segment_all(const Geometry *geometry, double kappa, size_t max_segments, Budget *budget,
                 SegmentList *list);

void segment_free(SegmentList *list, Budget *budget);

#endif
