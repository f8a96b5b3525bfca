// SPDX-License-Identifier: Apache-2.0
// Who may be near whom during a step, so that a few members can be moved without a look at all.
//
// Each member is taken to be in a ball around the middle of its way, three times as wide as the one
// that holds the longest way of all. Who turns aside, or has just been born, may leave it, which is
// found when it has been moved: then its way becomes part of what is known, and it is moved again.
#include "render/sim_crowd_parts.h"

#include <stdlib.h>
#include <string.h>

#define NOT_ASKED UINT32_MAX

// Of one neighborhood: its grid is that of the middles of the ways.
typedef struct {
    SimNear near;
    SimNearGrid *grid;
    double radius;                          // of the neighborhood; that of the grid is larger
    double half;                            // of the longest way
    double *middle[3], *least[3], *most[3]; // [n_members] of the way, by axes
} Ways;

struct CrowdAround {
    uint32_t n_members, n_ways;
    Ways *ways;
    uint32_t *mark, stamp;   // [n_members] equal to stamp: it is in the list at hand
    uint32_t *near;          // [n_members] room for a list
    uint32_t *first, *count; // [n_members] those around it, once asked for: list[first...]
    uint32_t *list;
    size_t n, capacity;
};

// ---- Ways

static void widen(Ways *ways, const SimNear *near, bool is_first) {
    for (uint32_t k = 0; k < near->n_axes; k++) {
        for (uint32_t j = 0; j < near->n_members; j++) {
            double x = near->axis[k][j];
            ways->least[k][j] = is_first ? x : fmin(ways->least[k][j], x);
            ways->most[k][j] = is_first ? x : fmax(ways->most[k][j], x);
        }
    }
}

static void sort_ways(CrowdAround *around) {
    for (uint32_t g = 0; g < around->n_ways; g++) {
        Ways *ways = &around->ways[g];
        double longest = 0; // squared, of half a way
        for (uint32_t j = 0; j < around->n_members; j++) {
            double sum = 0;
            for (uint32_t k = 0; k < ways->near.n_axes; k++) {
                double half = (ways->most[k][j] - ways->least[k][j]) / 2;
                ways->middle[k][j] = ways->least[k][j] + half;
                sum += half * half;
            }
            longest = fmax(longest, sum);
        }
        ways->half = sqrt(longest);
        ways->near.radius = ways->radius + 4 * ways->half; // one within its own half, one in three
        sim_near_sort(ways->grid);
    }
    for (uint32_t j = 0; j < around->n_members; j++) {
        around->first[j] = NOT_ASKED;
    }
    around->n = 0;
}

void crowd_survey(Crowd *c, double t, double end) {
    CrowdAround *around = c->around;
    for (int i = 0; i <= 2 && around->n_ways; i++) {
        crowd_place_all(c, c->levels[0].among, t + (end - t) * i / 2);
        for (uint32_t g = 0; g < around->n_ways; g++) {
            widen(&around->ways[g], &c->sim->nears[g], i == 0);
        }
    }
    sort_ways(around);
}

// Whether a member, where it is now, is outside of its ball; its way then leads there too.
static bool is_astray(Ways *ways, const SimNear *near, uint32_t j) {
    double sum = 0;
    for (uint32_t k = 0; k < near->n_axes; k++) {
        double d = near->axis[k][j] - ways->middle[k][j];
        sum += d * d;
    }
    if (sum <= 9 * ways->half * ways->half) {
        return false;
    }
    for (uint32_t k = 0; k < near->n_axes; k++) {
        ways->least[k][j] = fmin(ways->least[k][j], near->axis[k][j]);
        ways->most[k][j] = fmax(ways->most[k][j], near->axis[k][j]);
    }
    return true;
}

bool crowd_go_astray(Crowd *c, const uint32_t *who, uint32_t n) {
    bool do_any = false;
    for (uint32_t i = 0; i < n && c->is_by_places; i++) {
        const SimCourse *draft = &c->drafts[who[i]];
        for (uint32_t p = 0; p < 2 * draft->n; p++) {
            const SimPiece *piece = &draft->pieces[p / 2];
            crowd_place(c, who[i], p % 2 ? (piece->start + piece->end) / 2 : piece->end);
            for (uint32_t g = 0; g < c->around->n_ways; g++) {
                bool is = is_astray(&c->around->ways[g], &c->sim->nears[g], who[i]);
                do_any = is || do_any;
            }
        }
    }
    if (do_any) {
        sort_ways(c->around);
    }
    return do_any;
}

// ---- Time

// The largest share of a radius that any member of a level moves in a second, by its rates.
static double speed_of(const Crowd *c, const CrowdLevel *l) {
    double most = 0;
    for (uint32_t g = 0; g < c->sim->n_nears; g++) {
        const SimNear *near = &c->sim->nears[g];
        for (uint32_t i = 0; i < l->n; i++) {
            double sum = 0;
            for (uint32_t k = 0; k < near->n_axes; k++) {
                size_t state = (size_t)(near->axis[k] - c->sim->live) / c->sim->n_members;
                sum += l->k[0][state * l->n + i] * l->k[0][state * l->n + i];
            }
            most = fmax(most, sqrt(sum) / near->radius);
        }
    }
    return most;
}

double crowd_longest_step(const Crowd *c, CrowdLevel *l) {
    double speed = speed_of(c, l);
    l->fastest = fmax(l->fastest, speed);
    return 1 / speed;
}

uint32_t crowd_n_looks(const Crowd *c, double fastest, double time) {
    enum { LEAST = 2, OTHERWISE = 5, MOST = 12 };
    if (!c->is_by_places) {
        return OTHERWISE;
    }
    // From one to the next, two that fly towards each other come nearer by half a radius.
    double wanted = ceil(4 * fastest * time);
    return wanted <= MOST ? (uint32_t)fmax(wanted, LEAST) : 0;
}

// ---- Lists

static bool add(CrowdAround *around, const uint32_t *more, uint32_t n) {
    if (around->n + n > around->capacity) {
        size_t capacity = 2 * (around->n + n);
        uint32_t *list = realloc(around->list, capacity * sizeof *list);
        if (!list || capacity >= NOT_ASKED) {
            around->list = list ? list : around->list;
            return false;
        }
        around->list = list;
        around->capacity = capacity;
    }
    if (n > 0) {
        memcpy(around->list + around->n, more, n * sizeof *more);
        around->n += n;
    }
    return true;
}

// Finds those around a member. False: no memory.
static bool ask(CrowdAround *around, uint32_t member) {
    size_t first = around->n;
    for (uint32_t g = 0; g < around->n_ways; g++) {
        uint32_t n = sim_near_list(around->ways[g].grid, member, around->near);
        if (!add(around, around->near, n)) {
            return false;
        }
    }
    around->first[member] = (uint32_t)first;
    around->count[member] = (uint32_t)(around->n - first);
    return true;
}

static int compare(const void *a, const void *b) {
    uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    return (i > j) - (i < j);
}

static uint32_t mark(CrowdAround *around, uint32_t member, uint32_t n, uint32_t *out) {
    if (around->mark[member] != around->stamp) {
        around->mark[member] = around->stamp;
        out[n++] = member;
    }
    return n;
}

SimMembers crowd_around(Crowd *c, const uint32_t *who, uint32_t n_who, uint32_t *out) {
    CrowdAround *around = c->around;
    uint32_t n = 0;
    bool is_known = c->is_by_places;
    around->stamp++;
    for (uint32_t i = 0; i < n_who && is_known; i++) {
        n = mark(around, who[i], n, out);
        is_known = around->first[who[i]] != NOT_ASKED || ask(around, who[i]);
        for (uint32_t k = 0; is_known && k < around->count[who[i]]; k++) {
            n = mark(around, around->list[around->first[who[i]] + k], n, out);
        }
    }
    if (!is_known) {
        return (SimMembers){NULL, around->n_members};
    }
    qsort(out, n, sizeof *out, compare);
    return (SimMembers){out, n};
}

// ---- Beginning and end

CrowdAround *crowd_around_new(const SimState *sim) {
    CrowdAround *around = calloc(1, sizeof *around);
    size_t n = sim->n_members;
    if (!around) {
        return NULL;
    }
    *around = (CrowdAround){.n_members = sim->n_members,
                            .n_ways = sim->n_nears,
                            .ways = calloc(sim->n_nears + 1, sizeof(Ways)),
                            .mark = calloc(n, sizeof(uint32_t)),
                            .near = malloc(n * sizeof(uint32_t)),
                            .first = malloc(n * sizeof(uint32_t)),
                            .count = malloc(n * sizeof(uint32_t))};
    bool is_fine = around->ways && around->mark && around->near && around->first && around->count;
    for (uint32_t g = 0; g < sim->n_nears && is_fine; g++) {
        Ways *ways = &around->ways[g];
        ways->near = sim->nears[g];
        ways->radius = sim->nears[g].radius;
        ways->near.there = NULL;
        for (uint32_t k = 0; k < ways->near.n_axes && is_fine; k++) {
            ways->middle[k] = malloc(n * sizeof(double));
            ways->least[k] = malloc(n * sizeof(double));
            ways->most[k] = malloc(n * sizeof(double));
            ways->near.axis[k] = ways->middle[k];
            is_fine = ways->middle[k] && ways->least[k] && ways->most[k];
        }
        ways->grid = is_fine ? sim_near_new(&ways->near, 1) : NULL;
        is_fine = ways->grid != NULL;
    }
    if (!is_fine) {
        crowd_around_free(around);
        return NULL;
    }
    return around;
}

void crowd_around_free(CrowdAround *around) {
    if (!around) {
        return;
    }
    for (uint32_t g = 0; around->ways && g < around->n_ways; g++) {
        Ways *ways = &around->ways[g];
        sim_near_free(ways->grid);
        for (int k = 0; k < 3; k++) {
            free(ways->middle[k]);
            free(ways->least[k]);
            free(ways->most[k]);
        }
    }
    free(around->ways);
    free(around->mark);
    free(around->near);
    free(around->first);
    free(around->count);
    free(around->list);
    free(around);
}
