// SPDX-License-Identifier: Apache-2.0
// Sums over what is near.
#include "render/sim_near.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PAIRS = 512,      // evaluated at once
    CHUNK = 128,      // members that one thread takes at a time
    LEAST_CHUNKS = 32 // for fewer, waiting for each other takes longer than the work
};

// Pairs that wait for their terms.
typedef struct {
    double me[PAIRS], other[PAIRS];
    uint32_t n;
    double *out[]; // [n_terms], then the numbers themselves
} Batch;

struct SimNearGrid {
    const SimNear *nears;
    uint32_t n_nears, n_members, n_slots; // slots: a power of two
    uint32_t *first;                      // [n_slots + 1] of the members in a slot, in order
    uint32_t *order;                      // [n_members]
    uint32_t *slot;                       // [n_members]
    double (*cell)[3];                    // [n_members] whole numbers, NaN: nowhere
    Batch **batches;                      // [n_chunks]
    uint32_t n_chunks;
};

static uint32_t slot_of(const SimNearGrid *grid, const double cell[3]) {
    uint64_t hash = 0x9e3779b97f4a7c15u;
    for (int k = 0; k < 3; k++) {
        uint64_t bits;
        double c = cell[k] + 0.0; // one zero
        memcpy(&bits, &c, sizeof bits);
        hash = (hash ^ bits) * 0xff51afd7ed558ccdu;
        hash ^= hash >> 32;
    }
    return (uint32_t)hash & (grid->n_slots - 1);
}

// ---- The grid

// A counting sort by slots: within one, members follow in the order of their numbers.
static void sort_into_cells(SimNearGrid *grid, const SimNear *near) {
    uint32_t n = grid->n_members;
    memset(grid->first, 0, (grid->n_slots + 1) * sizeof *grid->first);
    for (uint32_t i = 0; i < n; i++) {
        double *cell = grid->cell[i];
        memset(cell, 0, sizeof grid->cell[i]);
        for (uint32_t k = 0; k < near->n_axes; k++) {
            cell[k] = floor(near->axis[k][i] / near->radius);
        }
        if (!isfinite(cell[0] + cell[1] + cell[2]) || (near->there && near->there[i] == 0)) {
            cell[0] = NAN;
        }
        grid->slot[i] = slot_of(grid, cell);
        grid->first[grid->slot[i] + 1]++;
    }
    for (uint32_t s = 0; s < grid->n_slots; s++) {
        grid->first[s + 1] += grid->first[s];
    }
    for (uint32_t i = n; i-- > 0;) { // from the end of each slot; first becomes its beginning + 1
        grid->order[--grid->first[grid->slot[i] + 1]] = i;
    }
    memmove(grid->first, grid->first + 1, grid->n_slots * sizeof *grid->first);
    grid->first[grid->n_slots] = n;
}

// ---- Sums

static void evaluate(const SimNear *near, Batch *batch, double t) {
    ProgramInputs in = {.varying = 1u << IN_I | 1u << SIM_NEAR_OTHER};
    in.at[IN_T] = in.at[IN_FILM_T] = &t;
    in.at[IN_I] = batch->me;
    in.at[SIM_NEAR_OTHER] = batch->other;
    if (batch->n == 0) {
        return;
    }
    program_run(near->terms, &in, batch->n, batch->out);
    for (uint32_t k = 0; k < near->n_terms; k++) {
        for (uint32_t i = 0; i < batch->n; i++) {
            near->sum[k][(uint32_t)batch->me[i]] += batch->out[k][i];
        }
    }
    batch->n = 0;
}

static bool are_near(const SimNear *near, uint32_t i, uint32_t j) {
    double sum = 0;
    for (uint32_t k = 0; k < near->n_axes; k++) {
        double d = near->axis[k][i] - near->axis[k][j];
        sum += d * d;
    }
    return sum <= near->radius * near->radius;
}

static void add_cell(const SimNearGrid *grid, const SimNear *near, Batch *batch, double t,
                     uint32_t i, const double cell[3]) {
    uint32_t slot = slot_of(grid, cell);
    for (uint32_t at = grid->first[slot]; at < grid->first[slot + 1]; at++) {
        uint32_t j = grid->order[at];
        const double *there = grid->cell[j]; // other cells may share the slot
        if (j != i && there[0] == cell[0] && there[1] == cell[1] && there[2] == cell[2] &&
            are_near(near, i, j)) {
            batch->me[batch->n] = i;
            batch->other[batch->n++] = j;
            if (batch->n == PAIRS) {
                evaluate(near, batch, t);
            }
        }
    }
}

static void add_member(const SimNearGrid *grid, const SimNear *near, Batch *batch, double t,
                       uint32_t i) {
    const double *own = grid->cell[i];
    int most[3];
    for (uint32_t k = 0; k < 3; k++) {
        most[k] = k < near->n_axes ? 1 : 0;
    }
    for (int z = -most[2]; z <= most[2] && !isnan(own[0]); z++) {
        for (int y = -most[1]; y <= most[1]; y++) {
            for (int x = -most[0]; x <= most[0]; x++) {
                const double cell[3] = {own[0] + x, own[1] + y, own[2] + z};
                add_cell(grid, near, batch, t, i, cell);
            }
        }
    }
}

void sim_near_run(SimNearGrid *grid, double t) {
    for (uint32_t g = 0; g < grid->n_nears; g++) {
        const SimNear *near = &grid->nears[g];
        sort_into_cells(grid, near);
        for (uint32_t k = 0; k < near->n_terms; k++) {
            memset(near->sum[k], 0, grid->n_members * sizeof *near->sum[k]);
        }
#pragma omp parallel for schedule(dynamic, 1) if (grid->n_chunks >= LEAST_CHUNKS)
        for (uint32_t c = 0; c < grid->n_chunks; c++) {
            Batch *batch = grid->batches[c];
            uint32_t end = (c + 1) * CHUNK < grid->n_members ? (c + 1) * CHUNK : grid->n_members;
            for (uint32_t i = c * CHUNK; i < end; i++) {
                add_member(grid, near, batch, t, i);
            }
            evaluate(near, batch, t);
        }
    }
}

// ---- Beginning and end

static Batch *new_batch(uint32_t n_terms) {
    size_t head = sizeof(Batch) + n_terms * sizeof(double *);
    Batch *batch = calloc(1, head + (size_t)n_terms * PAIRS * sizeof(double));
    double *numbers = batch ? (double *)((char *)batch + head) : NULL;
    for (uint32_t k = 0; batch && k < n_terms; k++) {
        batch->out[k] = numbers + (size_t)k * PAIRS;
    }
    return batch;
}

SimNearGrid *sim_near_new(const SimNear *nears, uint32_t n_nears) {
    SimNearGrid *grid = calloc(1, sizeof *grid);
    uint32_t n = nears[0].n_members, n_terms = 0;
    if (!grid) {
        return NULL;
    }
    *grid = (SimNearGrid){.nears = nears, .n_nears = n_nears, .n_members = n, .n_slots = 1};
    while (grid->n_slots < n) {
        grid->n_slots *= 2;
    }
    for (uint32_t g = 0; g < n_nears; g++) {
        n_terms = nears[g].n_terms > n_terms ? nears[g].n_terms : n_terms;
    }
    grid->first = malloc((grid->n_slots + 1) * sizeof *grid->first);
    grid->order = malloc(n * sizeof *grid->order);
    grid->slot = malloc(n * sizeof *grid->slot);
    grid->cell = malloc(n * sizeof *grid->cell);
    grid->n_chunks = (n + CHUNK - 1) / CHUNK;
    grid->batches = calloc(grid->n_chunks, sizeof *grid->batches);
    bool is_fine = grid->first && grid->order && grid->slot && grid->cell && grid->batches;
    for (uint32_t c = 0; is_fine && c < grid->n_chunks; c++) {
        grid->batches[c] = new_batch(n_terms);
        is_fine = grid->batches[c] != NULL;
    }
    if (!is_fine) {
        sim_near_free(grid);
        return NULL;
    }
    return grid;
}

void sim_near_free(SimNearGrid *grid) {
    if (!grid) {
        return;
    }
    for (uint32_t c = 0; grid->batches && c < grid->n_chunks; c++) {
        free(grid->batches[c]);
    }
    free(grid->batches);
    free(grid->first);
    free(grid->order);
    free(grid->slot);
    free(grid->cell);
    free(grid);
}
