// SPDX-License-Identifier: Apache-2.0
// Going back within a step: of those to whom something happens, and of those who notice it.
#include "render/sim_crowd_parts.h"

#include <string.h>

double crowd_allowed(const Crowd *c, double x) {
    const double part = 0.01;
    return part * c->sim->tolerance * fmax(1, fabs(x));
}

// ---- Who goes back

static uint32_t born_by(const Crowd *c, const CrowdLevel *l, double end) {
    uint32_t n = 0;
    while (n < l->n_later && c->run->birth[l->later[n]] <= end) {
        n++;
    }
    return n;
}

static uint32_t n_hit(const CrowdLevel *l) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < l->n; i++) {
        n += l->is_hit[i];
    }
    return n;
}

static bool is_few(const CrowdLevel *l, uint32_t n_born) {
    return 2 * ((uint64_t)n_hit(l) + n_born) <= l->n;
}

// Marks those to whom something happens by then. Whether that is few.
static bool mark_hit(Crowd *c, CrowdLevel *l, double end) {
    for (uint32_t i = 0; i < l->n; i++) {
        l->is_hit[i] = l->hit[i] <= end;
    }
    return is_few(l, born_by(c, l, end));
}

// Where something happens to more than half of the level in its step from t to *end, the step
// becomes so short that it does to fewer. False: that was not found.
static bool shorten(Crowd *c, uint32_t depth, double t, double *from, double *end) {
    enum { TIMES = 3, PARTS = 8 };
    CrowdLevel *l = &c->levels[depth];
    const double whole = *end;
    bool are_few = mark_hit(c, l, *end);
    for (int i = 0; i < TIMES && !are_few; i++) {
        const double length = *end - t;
        for (int k = PARTS - 1; k > 0 && t + length * k / PARTS >= *from && !are_few; k--) {
            *end = t + length * k / PARTS;
            are_few = mark_hit(c, l, *end);
        }
        if (!are_few) { // a closer look
            *from = crowd_look(c, depth, t, *end);
        }
    }
    if (!are_few || *end == whole) {
        return are_few;
    }
    for (uint32_t i = 0; i < l->n; i++) {
        crowd_cut_draft(c, l->who[i], *end);
    }
    crowd_read_drafts(c, l, *end, l->next);
    crowd_set_there(c, l->among, t);
    return crowd_rates(c, depth, *end, l->next, l->k[RUNGE_STAGES - 1]);
}

// Lists in l->some, with their rows, the members of the level that are hit. Returns how many.
static uint32_t list_hit(CrowdLevel *l) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < l->n; i++) {
        l->source[n] = i;
        l->some[n] = l->who[i];
        n += l->is_hit[i];
    }
    return n;
}

// Likewise those that are not and are among those around.
static uint32_t list_others(CrowdLevel *l, SimMembers around) {
    uint32_t n = 0, k = 0;
    for (uint32_t i = 0; i < l->n; i++) {
        while (around.who && k < around.n && around.who[k] < l->who[i]) {
            k++;
        }
        bool is_near = !around.who || (k < around.n && around.who[k] == l->who[i]);
        l->source[n] = i;
        l->some[n] = l->who[i];
        n += is_near && !l->is_hit[i];
    }
    return n;
}

// ---- Going back

// Who goes back is as at the time `from` again.
static void restore(Crowd *c, const CrowdLevel *l, uint32_t n_born, double from) {
    const size_t n_members = c->sim->n_members;
    for (uint32_t i = 0; i < l->n; i++) {
        if (l->is_hit[i]) {
            c->members[l->who[i]] = l->saved[i];
            crowd_cut_draft(c, l->who[i], from);
        }
    }
    for (uint32_t b = 0; b < n_born; b++) {
        uint32_t j = l->later[b];
        c->members[j] = (CrowdMember){0};
        crowd_cut_draft(c, j, from);
        for (uint32_t k = 0; k < c->sim->n_states; k++) {
            c->held[k * n_members + j] = c->starts[k * n_members + j];
        }
    }
}

// Adds those to be born in the step.
static SimMembers list_back(Crowd *c, CrowdLevel *l, uint32_t n_born, uint32_t *out) {
    uint32_t n = list_hit(l);
    memcpy(l->some + n, l->later, n_born * sizeof *l->some); // there is room: they are few
    return crowd_around(c, l->some, n + n_born, out);
}

// Those of the level that are hit, and those born in the step from t, begin at `from` again, as a
// level of their own. False: reported.
static bool go_back(Crowd *c, uint32_t depth, double t, double from, uint32_t n_born) {
    CrowdLevel *l = &c->levels[depth], *inner = &c->levels[depth + 1];
    uint32_t n = list_hit(l);
    if (!crowd_reserve(c, depth + 1, n + n_born)) {
        return sim_run_fail(c->run, 0, t, SIM_NO_MEMORY);
    }
    inner->n = n;
    inner->later = l->later;
    inner->n_later = n_born;
    inner->step = l->step;
    inner->fastest = 0;
    memcpy(inner->who, l->some, n * sizeof *inner->who);
    inner->among = list_back(c, l, n_born, inner->listed);
    for (uint32_t w = 0; w < c->sim->n_whens; w++) {
        for (uint32_t i = 0; i < n; i++) {
            inner->fires[w * n + i] = l->fires[w * l->n + l->source[i]];
        }
    }
    crowd_read_drafts(c, inner, from, inner->y);
    crowd_set_there(c, inner->among, t);
    return crowd_strike(c, depth + 1, from);
}

// ---- Who notices

// Rates at t by the drafts.
static void look_again(Crowd *c, SimMembers members, SimMembers among, double t, double *out) {
    c->work += members.n + among.n;
    crowd_set_there(c, among, t);
    crowd_place_all(c, among, t);
    sim_equations_rates(c->equations, t, members, among, out);
}

// The slope at t of the last piece of a member's draft.
static double slope_of(const Crowd *c, uint32_t member, size_t state, double t) {
    const SimCourse *draft = &c->drafts[member];
    const SimPiece *piece = &draft->pieces[draft->n - 1];
    const double *p = draft->coefficients +
                      ((draft->n - 1) * (size_t)c->sim->n_states + state) * SIM_COEFFICIENTS;
    double s = (t - piece->start) / (piece->end - piece->start), sum = 0;
    for (int k = SIM_COEFFICIENTS; k-- > 1;) {
        sum = sum * s + k * p[k];
    }
    return sum / (piece->end - piece->start);
}

// Whether a rate is so different from what a step went by, for so long, that it matters.
static bool matters(const Crowd *c, double rate, double before, double time, double x) {
    return !(fabs(rate - before) * time <= crowd_allowed(c, x));
}

// Whether any others notice at t those that went back to `from`: they are marked as hit too. Else
// *n of them are listed with their rates in l->spare.
static bool notice(Crowd *c, uint32_t depth, double from, double t, double end, uint32_t *n) {
    CrowdLevel *l = &c->levels[depth];
    bool do_any = false;
    *n = list_others(l, c->levels[depth + 1].among);
    look_again(c, (SimMembers){l->some, *n}, crowd_around(c, l->some, *n, l->wide), t, l->spare);
    for (size_t at = 0; at < (size_t)c->sim->n_states * *n; at++) {
        uint32_t i = l->source[at % *n];
        size_t row = at / *n * l->n + i;
        double before = t < end ? slope_of(c, l->who[i], at / *n, t) : l->k[RUNGE_STAGES - 1][row];
        if (matters(c, l->spare[at], before, end - from, l->next[row]) && !l->is_hit[i]) {
            l->is_hit[i] = 1;
            l->saved[i] = c->members[l->who[i]];
            do_any = true;
        }
    }
    return do_any;
}

// The same at several instants up to the end.
static bool notice_later(Crowd *c, uint32_t depth, double from, double end, uint32_t n_looks,
                         uint32_t *n) {
    for (uint32_t k = 1; k <= n_looks; k++) {
        double t = k < n_looks ? from + (end - from) * k / n_looks : end;
        if (notice(c, depth, from, t, end, n)) {
            return true;
        }
    }
    return false;
}

// ---- All of it

// The level at the end of the step: those that went back as they are there, the others with their
// rates there, which are the last of the step, or newer ones of the n listed in l->spare.
static void join(Crowd *c, uint32_t depth, uint32_t n_listed, uint32_t n_born) {
    CrowdLevel *l = &c->levels[depth];
    const CrowdLevel *inner = &c->levels[depth + 1];
    double *last = l->k[RUNGE_STAGES - 1];
    uint32_t n_states = c->sim->n_states, a = 0, b = 0;
    for (size_t at = 0; at < (size_t)n_states * n_listed; at++) {
        last[at / n_listed * l->n + l->source[at % n_listed]] = l->spare[at];
    }
    uint32_t n_others = list_others(l, (SimMembers){NULL, c->sim->n_members});
    uint32_t n = n_others + inner->n;
    for (uint32_t at = 0; at < n; at++) {
        bool is_other = b == inner->n || (a < n_others && l->some[a] < inner->who[b]);
        for (uint32_t k = 0; k < n_states; k++) {
            size_t to = (size_t)k * n + at, in = (size_t)k * inner->n + b;
            size_t own = (size_t)k * l->n + l->source[a];
            l->y[to] = is_other ? l->next[own] : inner->y[in];
            l->k[0][to] = is_other ? last[own] : inner->k[0][in];
        }
        l->who[at] = is_other ? l->some[a] : inner->who[b];
        a += is_other;
        b += !is_other;
    }
    l->n = n;
    l->later += n_born;
    l->n_later -= n_born;
}

// One try at it. *is_void: it was for nothing, as somebody went astray, or notices.
static CrowdOutcome move(Crowd *c, uint32_t depth, double from, double end, uint32_t n_born,
                         bool *is_void, uint32_t *n_listed) {
    CrowdLevel *l = &c->levels[depth], *inner = &c->levels[depth + 1];
    *is_void = notice(c, depth, from, from, end, n_listed);
    if (*is_void) {
        return CROWD_DONE;
    }
    if (!crowd_advance(c, depth + 1, from, end)) {
        return CROWD_FAILED;
    }
    l->fastest = fmax(l->fastest, inner->fastest);
    inner->among = list_back(c, l, n_born, inner->listed); // ways may have become known within
    *is_void = crowd_go_astray(c, l->some, n_hit(l) + n_born);
    if (*is_void) {
        return CROWD_DONE;
    }
    uint32_t n_looks = crowd_n_looks(c, l->fastest, end - from);
    *is_void = notice_later(c, depth, from, end, n_looks, n_listed);
    return n_looks ? CROWD_DONE : CROWD_CUT;
}

CrowdOutcome crowd_go_back(Crowd *c, uint32_t depth, double t, double *from, double *end) {
    CrowdLevel *l = &c->levels[depth];
    if (!c->is_local || depth + 1 >= CROWD_LEVELS || c->wasted > c->work / 2 ||
        !shorten(c, depth, t, from, end)) {
        return CROWD_CUT;
    }
    uint32_t n_born = born_by(c, l, *end), n_listed = 0;
    if (depth == 0 && c->is_by_places) {
        crowd_survey(c, t, *end);
    }
    for (uint32_t i = 0; i < l->n; i++) {
        l->saved[i] = c->members[l->who[i]];
    }
    for (bool is_void = true; is_void;) {
        uint64_t before = c->work;
        restore(c, l, n_born, *from);
        if (!is_few(l, n_born)) {
            return CROWD_CUT;
        }
        if (!go_back(c, depth, t, *from, n_born)) {
            return CROWD_FAILED;
        }
        CrowdOutcome outcome = move(c, depth, *from, *end, n_born, &is_void, &n_listed);
        c->wasted += is_void || outcome == CROWD_CUT ? c->work - before : 0;
        if (outcome == CROWD_CUT) {
            restore(c, l, n_born, *from);
        }
        if (outcome != CROWD_DONE) {
            return outcome;
        }
    }
    join(c, depth, n_listed, n_born);
    return CROWD_DONE;
}
