// SPDX-License-Identifier: Apache-2.0
// Sums over the members of a simulation that are near each other, by a grid of cells as wide as the
// radius: the cost goes with the pairs that are near, not with all pairs.
//
// Each member's sum is made in an order that the places alone decide, whatever the number of
// threads.
#ifndef RENDER_SIM_NEAR_H
#define RENDER_SIM_NEAR_H

#include "render/program.h"

#define SIM_NEAR_OTHER IN_U // the input of `terms` that is the other member's number

// All that is summed up over one neighborhood.
typedef struct {
    uint32_t n_members, n_axes; // 1 to 3
    const double *axis[3];      // [n_members] each: where the members are
    const double *there;        // [n_members] 0: it is near to none; NULL: all are there
    double radius;              // > 0; at this distance they are still near
    const Program *terms; // n_terms out, of a member IN_I and another; other inputs as at the time
    uint32_t n_terms;
    double *const *sum; // [n_terms][n_members]: what comes of it
} SimNear;

// Some of the members, different ones; who NULL: all of them.
typedef struct {
    const uint32_t *who;
    uint32_t n;
} SimMembers;

static inline uint32_t sim_member(SimMembers members, uint32_t i) {
    return members.who ? members.who[i] : i;
}

typedef struct SimNearGrid SimNearGrid;

// For n_nears neighborhoods of one simulation. NULL: no memory.
SimNearGrid *sim_near_new(const SimNear *nears, uint32_t n_nears);
void sim_near_free(SimNearGrid *grid); // NULL: nothing

// Fills in the sums of members at the time t, over `among`, of which they are. Members that are
// nowhere (not finite) are near to none.
void sim_near_run(SimNearGrid *grid, double t, SimMembers members, SimMembers among);

// For the first neighborhood alone: the grid of all members as they are now, and the numbers of
// those that are near to a member. Returns how many, out having room for all.
void sim_near_sort(SimNearGrid *grid);
uint32_t sim_near_list(const SimNearGrid *grid, uint32_t member, uint32_t *out);

#endif
