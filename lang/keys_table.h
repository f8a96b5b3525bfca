// SPDX-License-Identifier: Apache-2.0
// Inside of `keys` tables: the clock brought into the table, and what is looked up at an instant.
//
// Segments: 0 lies before the first key, k between key k - 1 and key k, n after the last of n keys.
// In a segment that rests (held ends, steps) s stays exactly 0.
#ifndef LANG_KEYS_TABLE_H
#define LANG_KEYS_TABLE_H

#include "lang/keys.h"

typedef struct {
    Dag *dag;
    const Keys *keys;
    Arena *scratch;
    uint32_t n;     // segments: keys + 1
    Ref index;      // the segment's
    Ref s;          // in the segment: 0 at its beginning, 1 at its end
    Ref turns;      // repetitions passed, for `offset`; REF_NONE: none
    bool is_closed; // the last key's next neighbour is the first key's
} KeysTable;

// keys->n >= 2. is_same: the first and the last value are equal.
KeysTable keys_table(Dag *dag, Arena *scratch, const Keys *keys, Ref clock, bool is_same);

// What the segment has: [table->n] of them.
Ref keys_pick(const KeysTable *table, const Ref *refs);
Ref keys_pick_number(const KeysTable *table, const double *numbers);

// Span k (between key k and key k + 1).
static inline double keys_span(const Keys *keys, uint32_t k) {
    return keys->times[k + 1] - keys->times[k];
}
// The span that a held or continued end measures its s in, in seconds.
static inline double keys_end_span(const Keys *keys, bool is_last) {
    return keys_span(keys, is_last ? keys->n - 2 : 0) / 4;
}

// The weights that give a key's speed from those of the spans before and after it; at an end, or
// beside a step, one is 0. is_out: for the span after the key, else for the one before it.
typedef struct {
    uint32_t before, after; // spans
    double weight_before, weight_after;
} KeysNeighbours;
KeysNeighbours keys_neighbours(const KeysTable *table, uint32_t key, bool is_out);

// Progress f(s) by each segment's mode (lang/keys_curve.c).
Ref keys_progress(const KeysTable *table);
// f'(0) or f'(1) of a span's mode that is not smooth.
double keys_slope(Dag *dag, const Keys *keys, uint32_t span, bool is_end);

#endif
