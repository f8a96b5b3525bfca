// SPDX-License-Identifier: Apache-2.0
// Sums over what is near.
#include "render/sim_near.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,         // members whose distances are found at once
    PAIRS = 512,       // evaluated at once
    CHUNK = 128,       // members that one thread takes at a time
    LEAST_CHUNKS = 32, // for fewer, waiting for each other takes longer than the work
    MOST_SLOTS = 27,   // around a member
    FEW = 128          // members that a grid is not worth while for
};

#define NO_SLOT UINT32_MAX

// Pairs that wait for their terms.
typedef struct {
    double me[PAIRS + BLOCK], other[PAIRS + BLOCK];
    uint32_t n;
    double *out[]; // [n_terms], then the numbers themselves
} Batch;

struct SimNearGrid {
    const SimNear *nears;
    uint32_t n_nears, n_members;
    uint32_t n_slots, most_slots; // powers of two
    uint32_t *first;              // [n_slots + 1] of the members in a slot, in order
    uint32_t *slot;               // [n_members] NO_SLOT: it is nowhere, or not there
    double *order;                // [n_members + BLOCK] members, slot by slot
    double *place[3];             // likewise: where they are
    Batch **batches;              // [n_chunks]
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

static void find_cell(const SimNear *near, uint32_t i, double cell[3]) {
    for (uint32_t k = 0; k < 3; k++) {
        cell[k] = k < near->n_axes ? floor(near->axis[k][i] / near->radius) : 0;
    }
}

// A counting sort by slots: within one, members follow in the order of their numbers, if they are
// given so.
static void sort_into_slots(SimNearGrid *grid, const SimNear *near, SimMembers among) {
    uint32_t n_there = 0;
    for (grid->n_slots = 1; among.n > FEW && grid->n_slots < among.n;) {
        grid->n_slots *= 2;
    }
    memset(grid->first, 0, (grid->n_slots + 1) * sizeof *grid->first);
    for (uint32_t m = 0; m < among.n; m++) {
        uint32_t i = sim_member(among, m);
        double cell[3];
        find_cell(near, i, cell);
        bool is_there =
            isfinite(cell[0] + cell[1] + cell[2]) && !(near->there && near->there[i] == 0);
        grid->slot[i] = is_there ? slot_of(grid, cell) : NO_SLOT;
        if (is_there) {
            grid->first[grid->slot[i] + 1]++;
            n_there++;
        }
    }
    for (uint32_t s = 0; s < grid->n_slots; s++) {
        grid->first[s + 1] += grid->first[s];
    }
    for (uint32_t m = among.n; m-- > 0;) { // from each slot's end; first becomes its beginning + 1
        uint32_t i = sim_member(among, m);
        if (grid->slot[i] != NO_SLOT) {
            uint32_t at = --grid->first[grid->slot[i] + 1];
            grid->order[at] = i;
            for (uint32_t k = 0; k < near->n_axes; k++) {
                grid->place[k][at] = near->axis[k][i];
            }
        }
    }
    memmove(grid->first, grid->first + 1, grid->n_slots * sizeof *grid->first);
    grid->first[grid->n_slots] = n_there;
}

// The slots of the cells around a member, each once: others' cells may share one.
static uint32_t slots_around(const SimNearGrid *grid, const SimNear *near, uint32_t i,
                             uint32_t slots[MOST_SLOTS + 1]) {
    double own[3];
    int most[3];
    uint32_t n = 0;
    if (grid->n_slots == 1 || grid->slot[i] == NO_SLOT) {
        slots[0] = 0;
        return grid->slot[i] != NO_SLOT;
    }
    find_cell(near, i, own);
    for (uint32_t k = 0; k < 3; k++) {
        most[k] = k < near->n_axes ? 1 : 0;
    }
    for (int z = -most[2]; z <= most[2]; z++) {
        for (int y = -most[1]; y <= most[1]; y++) {
            for (int x = -most[0]; x <= most[0]; x++) {
                uint32_t slot = slot_of(grid, (double[]){own[0] + x, own[1] + y, own[2] + z});
                bool is_new = grid->first[slot] < grid->first[slot + 1];
                for (uint32_t s = 0; s < n && is_new; s++) {
                    is_new = slots[s] != slot;
                }
                slots[n] = slot;
                n += is_new;
            }
        }
    }
    return n;
}

// The squared distances of BLOCK places from `at` on from the member: beyond the last place too, as
// a loop of one length is quick.
static void find_distances(const SimNearGrid *grid, const SimNear *near, uint32_t i, uint32_t at,
                           double out[BLOCK]) {
    for (int b = 0; b < BLOCK; b++) {
        out[b] = 0;
    }
    for (uint32_t k = 0; k < near->n_axes; k++) {
        const double *place = grid->place[k] + at, own = near->axis[k][i];
        for (int b = 0; b < BLOCK; b++) {
            double d = own - place[b];
            out[b] += d * d;
        }
    }
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

// Those of the next BLOCK members from `at` on, `end` excluded, that are within the radius.
static void add_block(const SimNearGrid *grid, const SimNear *near, Batch *batch, uint32_t i,
                      uint32_t at, uint32_t end) {
    double distance[BLOCK], most = near->radius * near->radius;
    uint32_t n = end - at < BLOCK ? end - at : BLOCK;
    find_distances(grid, near, i, at, distance);
    for (uint32_t b = 0; b < n; b++) {
        double other = grid->order[at + b];
        batch->me[batch->n] = i;
        batch->other[batch->n] = other;
        batch->n += distance[b] <= most && other != i;
    }
}

static void add_member(const SimNearGrid *grid, const SimNear *near, Batch *batch, double t,
                       uint32_t i) {
    uint32_t slots[MOST_SLOTS + 1];
    for (uint32_t k = 0; k < near->n_terms; k++) {
        near->sum[k][i] = 0;
    }
    uint32_t n = slots_around(grid, near, i, slots);
    for (uint32_t s = 0; s < n; s++) {
        uint32_t end = grid->first[slots[s] + 1];
        for (uint32_t at = grid->first[slots[s]]; at < end; at += BLOCK) {
            add_block(grid, near, batch, i, at, end);
            if (batch->n >= PAIRS) {
                evaluate(near, batch, t);
            }
        }
    }
}

void sim_near_run(SimNearGrid *grid, double t, SimMembers members, SimMembers among) {
    uint32_t n_chunks = (members.n + CHUNK - 1) / CHUNK;
    for (uint32_t g = 0; g < grid->n_nears; g++) {
        const SimNear *near = &grid->nears[g];
        sort_into_slots(grid, near, among);
#pragma omp parallel for schedule(dynamic, 1) if (n_chunks >= LEAST_CHUNKS)
        for (uint32_t c = 0; c < n_chunks; c++) {
            Batch *batch = grid->batches[c];
            uint32_t end = (c + 1) * CHUNK < members.n ? (c + 1) * CHUNK : members.n;
            for (uint32_t m = c * CHUNK; m < end; m++) {
                add_member(grid, near, batch, t, sim_member(members, m));
            }
            evaluate(near, batch, t);
        }
    }
}

// ---- Who is near

void sim_near_sort(SimNearGrid *grid) {
    sort_into_slots(grid, grid->nears, (SimMembers){NULL, grid->n_members});
}

uint32_t sim_near_list(const SimNearGrid *grid, uint32_t member, uint32_t *out) {
    const SimNear *near = grid->nears;
    uint32_t slots[MOST_SLOTS + 1], n_slots = slots_around(grid, near, member, slots), n = 0;
    for (uint32_t s = 0; s < n_slots; s++) {
        uint32_t end = grid->first[slots[s] + 1];
        for (uint32_t at = grid->first[slots[s]]; at < end; at += BLOCK) {
            double distance[BLOCK];
            find_distances(grid, near, member, at, distance);
            for (uint32_t b = 0; b < BLOCK && at + b < end; b++) {
                out[n] = (uint32_t)grid->order[at + b];
                n += distance[b] <= near->radius * near->radius && out[n] != member;
            }
        }
    }
    return n;
}

// ---- Beginning and end

static Batch *new_batch(uint32_t n_terms) {
    size_t head = sizeof(Batch) + n_terms * sizeof(double *);
    Batch *batch = calloc(1, head + (size_t)n_terms * (PAIRS + BLOCK) * sizeof(double));
    double *numbers = batch ? (double *)((char *)batch + head) : NULL;
    for (uint32_t k = 0; batch && k < n_terms; k++) {
        batch->out[k] = numbers + (size_t)k * (PAIRS + BLOCK);
    }
    return batch;
}

SimNearGrid *sim_near_new(const SimNear *nears, uint32_t n_nears) {
    SimNearGrid *grid = calloc(1, sizeof *grid);
    uint32_t n = nears[0].n_members, n_terms = 0;
    if (!grid) {
        return NULL;
    }
    *grid = (SimNearGrid){.nears = nears, .n_nears = n_nears, .n_members = n, .most_slots = 1};
    while (grid->most_slots < n) {
        grid->most_slots *= 2;
    }
    for (uint32_t g = 0; g < n_nears; g++) {
        n_terms = nears[g].n_terms > n_terms ? nears[g].n_terms : n_terms;
    }
    grid->first = malloc((grid->most_slots + 1) * sizeof *grid->first);
    grid->slot = malloc(n * sizeof *grid->slot);
    grid->order = calloc((size_t)n + BLOCK, sizeof *grid->order);
    for (int k = 0; k < 3; k++) {
        grid->place[k] = calloc((size_t)n + BLOCK, sizeof *grid->place[k]);
    }
    grid->n_chunks = (n + CHUNK - 1) / CHUNK;
    grid->batches = calloc(grid->n_chunks, sizeof *grid->batches);
    bool is_fine = grid->first && grid->slot && grid->order && grid->place[0] && grid->place[1] &&
                   grid->place[2] && grid->batches;
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
    for (int k = 0; k < 3; k++) {
        free(grid->place[k]);
    }
    free(grid);
}
