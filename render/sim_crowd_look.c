// SPDX-License-Identifier: Apache-2.0
// What happens within a step, and at an instant.
#include "render/sim_crowd_parts.h"

#include <string.h>

static size_t n_conditions(const Crowd *c, const CrowdLevel *l) {
    return (size_t)c->sim->n_whens * l->n;
}

// ---- Looking for it

// The conditions at t of those members of the level that l->some lists, by their drafts.
static void look_at(Crowd *c, CrowdLevel *l, uint32_t n, double t, double *out) {
    for (uint32_t i = 0; i < n; i++) {
        crowd_place(c, l->some[i], t);
    }
    sim_equations_conditions(c->equations, t, (SimMembers){l->some, n}, l->among, out);
}

static bool has_changed(const CrowdLevel *l, size_t n, const double *before) {
    bool is = false;
    for (size_t i = 0; i < n; i++) {
        is = is || (before[i] >= 0 && l->now[i] < 0);
    }
    return is;
}

static void note_changes(CrowdLevel *l, size_t n, double t) {
    for (size_t i = 0; i < n; i++) {
        if (l->last[i] >= 0 && l->now[i] < 0) {
            l->hit[i % l->n] = fmin(l->hit[i % l->n], t);
        }
    }
}

// Narrows an interval in which the first conditions of a level become true, which did not hold at
// its beginning (l->base), down to neighbouring instants; marks them in fires. Returns the later.
static double narrow(Crowd *c, CrowdLevel *l, double low, double high) {
    uint32_t n_some = 0, n_whens = c->sim->n_whens;
    double *base = l->last; // of those that may be the first
    for (uint32_t i = 0; i < l->n; i++) {
        if (!c->is_local || l->hit[i] == high) {
            l->source[n_some] = i;
            l->some[n_some++] = l->who[i];
        }
    }
    crowd_carry(l->base, l->n, l->source, n_some, n_whens, base);
    size_t n = (size_t)n_whens * n_some;
    for (double middle = low + (high - low) / 2; low < middle && middle < high;
         middle = low + (high - low) / 2) {
        look_at(c, l, n_some, middle, l->now);
        if (has_changed(l, n, base)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    look_at(c, l, n_some, high, l->now);
    for (size_t i = 0; i < n; i++) {
        l->fires[i / n_some * l->n + l->source[i % n_some]] = base[i] >= 0 && l->now[i] < 0;
    }
    return high;
}

// The first event of the level's members in (t, end], as far as eight looks show.
static double first_event(Crowd *c, CrowdLevel *l, double t, double end) {
    enum { LOOKS = 8 };
    size_t n = n_conditions(c, l);
    double low = t, high = t, from = t, to = INFINITY;
    if (n == 0) {
        return INFINITY;
    }
    memcpy(l->some, l->who, l->n * sizeof *l->some);
    look_at(c, l, l->n, t, l->last);
    for (int k = 1; k <= LOOKS && (to == INFINITY || c->is_local); k++) {
        low = high;
        high = k < LOOKS ? t + (end - t) * k / LOOKS : end;
        look_at(c, l, l->n, high, l->now);
        if (to == INFINITY && has_changed(l, n, l->last)) {
            memcpy(l->base, l->last, n * sizeof *l->base);
            from = low;
            to = high;
        }
        note_changes(l, n, high);
        memcpy(l->last, l->now, n * sizeof *l->last);
    }
    return to == INFINITY ? INFINITY : narrow(c, l, from, to);
}

double crowd_look(Crowd *c, uint32_t depth, double t, double end) {
    CrowdLevel *l = &c->levels[depth];
    for (uint32_t i = 0; i < l->n; i++) {
        l->hit[i] = INFINITY;
    }
    memset(l->fires, 0, n_conditions(c, l));
    double event = first_event(c, l, t, end), change = INFINITY;
    if (l->n_later && c->run->birth[l->later[0]] <= end) {
        change = c->run->birth[l->later[0]];
    }
    for (uint32_t i = 0; i < l->n; i++) {
        double leaves = c->leaves[l->who[i]];
        if (leaves <= end) {
            change = fmin(change, leaves);
            l->hit[i] = fmin(l->hit[i], leaves);
        }
    }
    if (change < event) {
        memset(l->fires, 0, n_conditions(c, l));
    }
    return fmin(event, change);
}

// ---- Doing it

// Rows become those of l->source, of members l->some: of the states, of the rates and conditions
// before, of what fires.
static void remake(Crowd *c, CrowdLevel *l, uint32_t n) {
    uint32_t n_states = c->sim->n_states, n_whens = c->sim->n_whens;
    crowd_carry(l->y, l->n, l->source, n, n_states, l->spare);
    crowd_swap(&l->y, &l->spare);
    crowd_carry(l->old, l->n, l->source, n, n_states, l->spare);
    crowd_swap(&l->old, &l->spare);
    crowd_carry(l->last, l->n, l->source, n, n_whens, l->now);
    crowd_swap(&l->last, &l->now);
    for (uint32_t w = 0; w < n_whens; w++) {
        for (uint32_t i = 0; i < n; i++) {
            bool is_new = l->source[i] == CROWD_NO_ROW;
            l->chosen[w * n + i] = !is_new && l->fires[w * l->n + l->source[i]];
        }
    }
    memcpy(l->fires, l->chosen, (size_t)n_whens * n);
    memcpy(l->who, l->some, n * sizeof *l->who);
    l->n = n;
}

static void leave(Crowd *c, const CrowdLevel *l, uint32_t i) {
    uint32_t j = l->who[i];
    for (uint32_t k = 0; k < c->sim->n_states; k++) {
        c->held[(size_t)k * c->sim->n_members + j] = l->y[(size_t)k * l->n + i];
    }
    c->members[j].has_left = true;
}

// A new member in the list of those that will be the level's.
static void insert(CrowdLevel *l, uint32_t n, uint32_t j) {
    while (n > 0 && l->some[n - 1] > j) {
        l->some[n] = l->some[n - 1];
        l->source[n] = l->source[n - 1];
        n--;
    }
    l->some[n] = j;
    l->source[n] = CROWD_NO_ROW;
}

// Who has died or rests leaves, who is born comes. Whether anybody did.
static bool come_and_go(Crowd *c, CrowdLevel *l, double t) {
    uint32_t n = 0, n_before = l->n;
    const size_t n_members = c->sim->n_members;
    bool comes = false;
    for (uint32_t i = 0; i < l->n; i++) {
        if (c->leaves[l->who[i]] <= t) {
            leave(c, l, i);
        }
        if (!c->members[l->who[i]].has_left) {
            l->some[n] = l->who[i];
            l->source[n++] = i;
        }
    }
    for (; l->n_later && c->run->birth[l->later[0]] <= t; l->later++, l->n_later--) {
        c->begins[l->later[0]] = 1;
        insert(l, n++, l->later[0]);
        comes = true;
    }
    if (!comes && n == n_before) {
        return false;
    }
    remake(c, l, n);
    for (size_t at = 0; at < (size_t)c->sim->n_states * n; at++) {
        if (l->source[at % n] == CROWD_NO_ROW) {
            l->y[at] = c->starts[at / n * n_members + l->who[at % n]];
        }
    }
    return true;
}

// Members to whom something happens at t begin a new arc; one of too many events rests.
static void interrupt(Crowd *c, CrowdLevel *l, double t) {
    for (uint32_t i = 0; i < l->n; i++) {
        CrowdMember *member = &c->members[l->who[i]];
        bool is_hit = false;
        for (uint32_t w = 0; w < c->sim->n_whens; w++) {
            is_hit = is_hit || l->fires[w * l->n + i];
        }
        if (!is_hit || member->has_left) {
            continue;
        }
        c->begins[l->who[i]] = 1;
        if (events_are_too_many(c->sim, &member->events, t)) {
            leave(c, l, i);
            member->rests = true;
            member->rest_time = t;
        }
    }
}

static void find_conditions(Crowd *c, CrowdLevel *l, double t, double *out) {
    crowd_put(c, l, l->y);
    sim_equations_conditions(c->equations, t, (SimMembers){l->who, l->n}, l->among, out);
}

// Marks what has become true since the conditions l->last; nothing has for one that is new, rests,
// or has just done so. Whether anything is marked.
static bool find_fires(Crowd *c, CrowdLevel *l, double t, bool with_new) {
    size_t n = n_conditions(c, l);
    bool fires = false;
    find_conditions(c, l, t, l->now);
    for (size_t i = 0; i < n; i++) {
        bool is_in = !c->members[l->who[i % l->n]].has_left &&
                     (with_new || l->source[i % l->n] != CROWD_NO_ROW);
        l->fires[i] = is_in && !l->fires[i] && l->last[i] >= 0 && l->now[i] < 0;
        fires = fires || l->fires[i];
    }
    return fires;
}

// What is marked in fires happens at t, then what that brings about. What goes round in circles
// comes to rest, since each round counts. False: reported.
static bool happen(Crowd *c, CrowdLevel *l, double t) {
    size_t n = n_conditions(c, l);
    bool fires = false;
    for (size_t i = 0; i < n; i++) {
        fires = fires || l->fires[i];
    }
    while (fires) {
        interrupt(c, l, t);
        for (size_t i = 0; i < n; i++) {
            l->fires[i] = l->fires[i] && !c->members[l->who[i % l->n]].has_left;
        }
        find_conditions(c, l, t, l->last);
        sim_equations_assign(c->equations, t, (SimMembers){l->who, l->n}, l->among, l->fires, l->y);
        size_t n_y = (size_t)c->sim->n_states * l->n, bad = sim_first_infinite(l->y, n_y);
        if (bad < n_y) {
            return sim_run_fail(c->run, l->who[bad % l->n], t, SIM_BAD_EVENT);
        }
        fires = find_fires(c, l, t, true);
    }
    come_and_go(c, l, t);
    return true;
}

// Where a member's rates jump it begins a new arc, so that its bend stays a corner.
static void bend(Crowd *c, const CrowdLevel *l) {
    for (size_t at = 0; at < (size_t)c->sim->n_states * l->n; at++) {
        if (sim_run_bends(c->sim, l->old[at], l->k[0][at])) {
            c->begins[l->who[at % l->n]] = 1;
        }
    }
}

bool crowd_strike(Crowd *c, uint32_t depth, double t) {
    CrowdLevel *l = &c->levels[depth];
    crowd_place_all(c, l->among, t);
    if (!crowd_rates(c, depth, t, l->y, l->old)) {
        return sim_run_fail(c->run, c->bad, t, SIM_NOT_FINITE);
    }
    if (!c->is_local) {
        find_conditions(c, l, t, l->last);
    }
    crowd_set_there(c, l->among, t);
    if (come_and_go(c, l, t) && !c->is_local) { // which may make a condition true
        memcpy(l->chosen, l->fires, n_conditions(c, l));
        find_fires(c, l, t, false);
        for (size_t i = 0; i < n_conditions(c, l); i++) {
            l->fires[i] = l->fires[i] || l->chosen[i];
        }
    }
    if (!happen(c, l, t)) {
        return false;
    }
    if (!crowd_rates(c, depth, t, l->y, l->k[0])) {
        return sim_run_fail(c->run, c->bad, t, SIM_NOT_FINITE);
    }
    bend(c, l);
    return true;
}
