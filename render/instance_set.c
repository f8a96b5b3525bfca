// SPDX-License-Identifier: Apache-2.0
// Sets of instances: records from programs, clocks, boxes by phase.
#include "render/instance_set.h"

#include "accel/boxtree.h"
#include "render/local_time.h"
#include "render/program_ops.h"

#include <string.h>

enum {
    BATCH = 1024,      // instances whose programs run at once
    LEAST_PHASES = 64, // of what moves
    MOST_PHASES = 4096,
    PHASES_PER_PERIOD = 4
};

// ---- What suits

static bool may_glow(const Scene *scene, uint32_t material) {
    const Material *m = &scene->materials[material];
    return m->kind == MATERIAL_GLOW || (m->kind == MATERIAL_MIX && (may_glow(scene, m->parts[0]) ||
                                                                    may_glow(scene, m->parts[1])));
}

bool instance_set_suits(const Scene *scene, const Shape *shape) {
    bool deforms = shape->vertex || shape->track;
    bool is_parted = shape->pace || (!program_reads_time(shape->transform) && !deforms);
    return shape->kind == SHAPE_MESH && shape->n_instances >= SET_LEAST && is_parted &&
           !program_reads_loops(shape->vertex) && !shape->fade && !may_glow(scene, shape->material);
}

// ---- Records

// The programs that say where instances stand and how fast their clocks run, over many of them.
typedef struct {
    double place[12][BATCH], pace[3][BATCH], loop[4][BATCH], visible[BATCH];
} Batch;

static void run(const Program *program, const ProgramInputs *in, size_t n, double (*out)[BATCH]) {
    double *to[12];
    for (uint32_t k = 0; k < program_n_out(program); k++) {
        to[k] = out[k];
    }
    program_run(program, in, n, to);
}

static void run_batch(const Shape *shape, uint32_t first, uint32_t n, Batch *b) {
    static const double zero = 0;
    const Program *outer = shape->pace ? shape->outer : shape->transform;
    ProgramInputs in = {.at = {NULL}};
    for (int k = 0; k < IN_COUNT; k++) {
        in.at[k] = &zero;
    }
    for (uint32_t k = 0; k < shape->n_loops; k++) {
        for (uint32_t i = 0; i < n; i++) {
            b->loop[k][i] = shape->loops[(size_t)(first + i) * shape->n_loops + k];
        }
        in.at[IN_LOOP0 + k] = b->loop[k];
        in.varying |= 1u << (IN_LOOP0 + k);
    }
    if (outer) {
        run(outer, &in, n, b->place);
    }
    if (shape->pace) {
        run(shape->pace, &in, n, b->pace);
    }
    if (shape->visible && !program_reads_time(shape->visible)) {
        run(shape->visible, &in, n, &b->visible);
    } else {
        for (uint32_t i = 0; i < n; i++) {
            b->visible[i] = 1;
        }
    }
    for (int k = 0; !outer && k < 12; k++) {
        for (uint32_t i = 0; i < n; i++) {
            b->place[k][i] = k % 5 == 0;
        }
    }
}

// False: it is nowhere.
static bool record_of(const Batch *b, uint32_t i, InstanceRecord *record, double *cycle) {
    Affine map = affine_identity();
    double sum = 0;
    for (int k = 0; k < 12; k++) {
        double x = b->place[k][i];
        sum += x * 0;
        map.m[k / 4][k % 4] = x;
        if (k % 4 < 3) {
            record->linear[k / 4][k % 4] = (float)x;
        } else {
            record->at[k / 4] = x;
        }
    }
    record->speed = b->pace[0][i];
    record->offset = b->pace[1][i];
    *cycle = b->pace[2][i];
    bool has_time = isfinite(record->speed) && isfinite(record->offset) && !isnan(*cycle);
    bool is_seen = program_is_true(b->visible[i]);
    return sum == 0 && affine_det(&map) != 0 && has_time && is_seen;
}

// ---- Order

// A member's place, and which it was before.
typedef struct {
    float at[3];
    uint32_t k;
} Place;

static bool is_before(const Place *a, const Place *b, int axis) {
    return a->at[axis] < b->at[axis] || (a->at[axis] == b->at[axis] && a->k < b->k);
}

static void swap(Place *a, Place *b) {
    Place moved = *a;
    *a = *b;
    *b = moved;
}

// The `first` least along an axis come first (Hoare's selection, pivots by a fixed sequence).
static void select_first(Place *p, uint32_t n, uint32_t first, int axis) {
    uint32_t state = n;
    while (n > 1) {
        state = state * 747796405u + 2891336453u;
        Place pivot = p[(uint64_t)state * n >> 32];
        uint32_t i = 0, j = n - 1;
        for (;;) {
            while (is_before(&p[i], &pivot, axis)) {
                i++;
            }
            while (is_before(&pivot, &p[j], axis)) {
                j--;
            }
            if (i >= j) {
                break;
            }
            swap(&p[i++], &p[j--]);
        }
        uint32_t left = j + 1; // [0, left) are not after the pivot, the rest not before it
        left = left == n ? n - 1 : left; // the pivot was the last of all, and is now at the end
        if (first == left) {
            return;
        }
        if (first < left) {
            n = left;
        } else {
            p += left;
            n -= left;
            first -= left;
        }
    }
}

// Halves again and again along the axis on which they reach furthest, until they are groups.
static void halve(Place *p, uint32_t n) {
    enum { APART = 1 << 14 }; // so many are worth a thread
    while (n > SET_GROUP) {
        float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (uint32_t i = 0; i < n; i++) {
            for (int a = 0; a < 3; a++) {
                lo[a] = p[i].at[a] < lo[a] ? p[i].at[a] : lo[a];
                hi[a] = p[i].at[a] > hi[a] ? p[i].at[a] : hi[a];
            }
        }
        int axis = 0;
        for (int a = 1; a < 3; a++) {
            axis = hi[a] - lo[a] > hi[axis] - lo[axis] ? a : axis;
        }
        uint32_t n_groups = (n + SET_GROUP - 1) / SET_GROUP, left = n_groups / 2 * SET_GROUP;
        select_first(p, n, left, axis);
#pragma omp task firstprivate(p, left) if (left > APART)
        halve(p, left);
        p += left;
        n -= left;
    }
}

static void put_in_order(InstanceSet *set, double *cycles, uint32_t n_threads) {
    Arena scratch = {0};
    uint32_t n = set->n;
    Place *places = ARENA_ARRAY(&scratch, n, Place);
    InstanceRecord *records = ARENA_ARRAY(&scratch, n, InstanceRecord);
    double *own = ARENA_ARRAY(&scratch, n, double);
    for (uint32_t k = 0; k < n; k++) {
        for (int a = 0; a < 3; a++) {
            places[k].at[a] = (float)set->records[k].at[a];
        }
        places[k].k = k;
    }
#pragma omp parallel num_threads(n_threads)
#pragma omp single
    halve(places, n);
    for (uint32_t k = 0; k < n; k++) {
        records[k] = set->records[places[k].k];
        own[k] = cycles[places[k].k];
    }
    memcpy(set->records, records, n * sizeof *records);
    memcpy(cycles, own, n * sizeof *own);
    arena_free(&scratch);
}

// ---- Sets

InstanceSet instance_set_new(Arena *arena, const Shape *shape, Form *form, uint32_t base,
                             uint32_t n_threads) {
    InstanceSet set = {.shape = shape, .form = form, .base = base};
    uint32_t n = shape->n_instances, n_batches = (n + BATCH - 1) / BATCH;
    Arena scratch = {0};
    set.records = ARENA_ARRAY(arena, n, InstanceRecord);
    double *cycles = ARENA_ARRAY(&scratch, n, double);
    uint32_t *kept = ARENA_ARRAY(&scratch, n_batches, uint32_t);
#pragma omp parallel for schedule(static) num_threads(n_threads)
    for (uint32_t k = 0; k < n_batches; k++) {
        Arena own = {0};
        Batch *b = ARENA_NEW(&own, Batch);
        uint32_t first = k * BATCH, count = n - first < BATCH ? n - first : BATCH;
        run_batch(shape, first, count, b);
        for (uint32_t i = 0; i < count; i++) {
            InstanceRecord *record = &set.records[first + kept[k]];
            if (record_of(b, i, record, &cycles[first + kept[k]])) {
                record->instance = first + i;
                kept[k]++;
            }
        }
        arena_free(&own);
    }
    for (uint32_t k = 0; k < n_batches; k++) { // the gaps of those that are nowhere
        if (set.n != k * BATCH) {
            memmove(set.records + set.n, set.records + k * BATCH, kept[k] * sizeof *set.records);
            memmove(cycles + set.n, cycles + k * BATCH, kept[k] * sizeof *cycles);
        }
        set.n += kept[k];
    }
    put_in_order(&set, cycles, n_threads);
    set.cycle = set.n > 0 ? cycles[0] : 0;
    for (uint32_t k = 0; k < set.n && !set.cycles; k++) {
        if (cycles[k] != set.cycle) {
            double *own = ARENA_ARRAY(arena, set.n, double);
            memcpy(own, cycles, set.n * sizeof *own);
            set.cycles = own;
        }
    }
    arena_free(&scratch);
    set.moves = form->users || program_reads_time(shape->inner);
    return set;
}

// ---- Members

static double cycle_of(const InstanceSet *set, uint32_t k) {
    return set->cycles ? set->cycles[k] : set->cycle;
}

// Within its cycle; 0: it has none.
static double wind(double shown, double cycle) {
    return cycle > 0 ? op_mod(shown, cycle) : shown;
}

double instance_seconds(const InstanceSet *set, uint32_t k, double seconds) {
    const InstanceRecord *r = &set->records[k];
    return wind(r->speed * seconds + r->offset, cycle_of(set, k));
}

Body instance_body(const InstanceSet *set, uint32_t k) {
    uint32_t instance = set->records[k].instance;
    return (Body){.shape = set->shape,
                  .form = set->form,
                  .instance = instance,
                  .object = shape_object(set->shape, set->base, instance)};
}

Affine instance_outer(const InstanceSet *set, uint32_t k) {
    const InstanceRecord *r = &set->records[k];
    Affine map;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            map.m[i][j] = (double)r->linear[i][j];
        }
        map.m[i][3] = r->at[i];
    }
    return map;
}

Placement instance_place(const InstanceSet *set, uint32_t k, double seconds) {
    const Shape *shape = set->shape;
    Placement p = {.map = instance_outer(set, k), .inverse = affine_identity(), .is_present = true};
    if (shape->inner) {
        Affine inner;
        p.is_present = affine_run_at(shape->inner, instance_seconds(set, k, seconds), &inner);
        p.map = affine_mul(&p.map, &inner);
    }
    p.is_present = p.is_present && placement_invert(&p);
    if (program_reads_time(shape->visible)) { // else those that are not there have no record
        const double *loops = shape_loops(shape, set->records[k].instance);
        p.is_present = p.is_present && shape_is_visible(shape, loops, seconds);
    }
    return p;
}

void instance_times(const InstanceSet *set, uint32_t k, double first, double last,
                    void take(void *context, double lo, double hi), void *context) {
    const InstanceRecord *r = &set->records[k];
    double a = r->speed * first + r->offset, b = r->speed * last + r->offset;
    double lo = fmin(a, b), hi = fmax(a, b), cycle = cycle_of(set, k);
    if (!(cycle > 0)) {
        take(context, lo, hi);
        return;
    }
    if (hi - lo >= cycle) {
        take(context, 0, cycle);
        return;
    }
    // Each end as rays there would have it: rounding may put an end on the other side of the seam.
    double from = wind(lo, cycle), to = wind(hi, cycle);
    if (from <= to) {
        take(context, from, to);
    } else {
        take(context, from, cycle);
        take(context, 0, to);
    }
}

// ---- Boxes by phase

static Bounds points_between(const InstanceSet *set, double fps, double lo, double hi) {
    const Form *form = set->form;
    return form_bounds(form, instant_of_seconds(lo, fps), instant_of_seconds(hi, fps));
}

typedef struct {
    double lo, hi;
} Reach;

static void widen(void *context, double lo, double hi) {
    Reach *reach = context;
    reach->lo = fmin(reach->lo, lo);
    reach->hi = fmax(reach->hi, hi);
}

static void fill_levels(PhaseBoxes *p) {
    for (uint32_t level = 1; level < p->n_levels; level++) {
        const Bounds *below = p->boxes + (size_t)(level - 1) * p->n;
        Bounds *to = p->boxes + (size_t)level * p->n;
        uint32_t half = 1u << (level - 1);
        for (uint32_t i = 0; i < p->n; i++) {
            to[i] = bounds_join(below[i], below[i + half < p->n ? i + half : p->n - 1]);
        }
    }
}

void instance_phases(Arena *arena, InstanceSet *set, double fps, double first, double last) {
    PhaseBoxes *p = &set->phases;
    if (!set->moves) {
        p->n_levels = 1;
        p->boxes = ARENA_NEW(arena, Bounds);
        *p->boxes = map_bounds(set->shape->inner, set->form->bounds[0], 0, 0);
        return;
    }
    Reach reach = {INFINITY, -INFINITY};
    for (uint32_t k = 0; k < set->n; k++) {
        instance_times(set, k, first, last, widen, &reach);
    }
    double n = PHASES_PER_PERIOD * (reach.hi - reach.lo) * fps;
    p->lo = reach.lo;
    p->hi = reach.hi;
    p->n = n > MOST_PHASES ? MOST_PHASES : n > LEAST_PHASES ? (uint32_t)n : LEAST_PHASES;
    for (p->n_levels = 1; p->n >> p->n_levels; p->n_levels++) {
    }
    p->boxes = ARENA_ARRAY(arena, (size_t)p->n * p->n_levels, Bounds);
    for (uint32_t i = 0; i < p->n; i++) {
        double lo = p->lo + (p->hi - p->lo) * i / p->n,
               hi = p->lo + (p->hi - p->lo) * (i + 1) / p->n;
        p->boxes[i] = map_bounds(set->shape->inner, points_between(set, fps, lo, hi), lo, hi);
    }
    fill_levels(p);
}

// Rounding may put an end into the neighbouring part.
static uint32_t phase_of(const PhaseBoxes *p, double shown, double by) {
    double at = p->hi > p->lo ? (shown - p->lo) / (p->hi - p->lo) * p->n + by : 0;
    return at > 0 ? at < p->n - 1 ? (uint32_t)at : p->n - 1 : 0;
}

static Bounds phases_between(const PhaseBoxes *p, double lo, double hi) {
    uint32_t a = phase_of(p, lo, -1e-6), b = phase_of(p, hi, 1e-6), level = 0;
    while (2u << level <= b - a + 1) {
        level++;
    }
    const Bounds *row = p->boxes + (size_t)level * p->n;
    return bounds_join(row[a], row[b + 1 - (1u << level)]);
}

typedef struct {
    const PhaseBoxes *phases;
    Bounds sum;
} Union;

static void add_phases(void *context, double lo, double hi) {
    Union *u = context;
    u->sum = bounds_join(u->sum, phases_between(u->phases, lo, hi));
}

// Of a box under a map, by its centre and half its size.
static Bounds box_at(const InstanceRecord *r, Bounds b) {
    Vec3 c = vec3_scale(vec3_add(b.lo, b.hi), 0.5), h = vec3_scale(vec3_sub(b.hi, b.lo), 0.5);
    double lo[3], hi[3];
    for (int i = 0; i < 3; i++) {
        const float *m = r->linear[i];
        double at = (double)m[0] * c.x + (double)m[1] * c.y + (double)m[2] * c.z + r->at[i];
        double by = fabs((double)m[0]) * h.x + fabs((double)m[1]) * h.y + fabs((double)m[2]) * h.z;
        by += 0x1p-20 * by + 0x1p-48 * (fabs(r->at[i]) + fabs(at));
        lo[i] = at - by;
        hi[i] = at + by;
    }
    return (Bounds){{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
}

Bounds instance_bounds(const InstanceSet *set, uint32_t k, double fps, int64_t frame, double lo,
                       double hi) {
    Union u = {&set->phases, bounds_empty()};
    if (set->phases.n == 0) {
        u.sum = set->phases.boxes[0];
    } else {
        instance_times(set, k, instant_seconds((Instant){frame, lo}, fps),
                       instant_seconds((Instant){frame, hi}, fps), add_phases, &u);
    }
    return bounds_are_empty(u.sum) ? u.sum : box_at(&set->records[k], u.sum);
}

static void store_box(Bounds b, float box[6]) {
    const double lo[3] = {b.lo.x, b.lo.y, b.lo.z}, hi[3] = {b.hi.x, b.hi.y, b.hi.z};
    double by = BOX_HIT_ERROR * fmax(hi[0] - lo[0], fmax(hi[1] - lo[1], hi[2] - lo[2]));
    for (int a = 0; a < 3; a++) {
        box[a] = nextafterf((float)(lo[a] - by), -INFINITY);
        box[3 + a] = nextafterf((float)(hi[a] + by), INFINITY);
    }
}

void instance_boxes(Arena *arena, InstanceSet *set, double fps, const Opening *openings, size_t n,
                    uint32_t n_threads) {
    set->boxes = (float(*)[6])arena_array(arena, set->n, sizeof *set->boxes);
#pragma omp parallel for schedule(static) num_threads(n_threads)
    for (uint32_t k = 0; k < set->n; k++) {
        Bounds b = bounds_empty();
        for (size_t i = 0; i < (set->moves ? n : 1); i++) {
            const Opening *o = &openings[i];
            b = bounds_join(b, instance_bounds(set, k, fps, o->frame, o->lo, o->hi));
        }
        store_box(b, set->boxes[k]);
    }
}
