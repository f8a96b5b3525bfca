// SPDX-License-Identifier: Apache-2.0
// `keys` tables of numbers, and the words they are written with.
#include "lang/keys.h"

#include <math.h>
#include <string.h>

#include "lang/keys_table.h"

const KeysWord keys_curves[KEYS_CURVES] = {
#define MODE(id, name, n_arguments, help) {name, help, n_arguments},
#include "lang/keys.def"
#undef MODE
};

const KeysWord keys_ends[KEYS_ENDS] = {
#define END(id, name, help) {name, help, 0},
#include "lang/keys.def"
#undef END
};

KeysCurve keys_find_curve(const char *name, uint32_t n_arguments) {
    for (KeysCurve c = 0; c < KEYS_CURVES; c++) {
        if (keys_curves[c].n_arguments == n_arguments && strcmp(keys_curves[c].name, name) == 0) {
            return c;
        }
    }
    return KEYS_CURVES;
}

KeysEnd keys_find_end(const char *name) {
    for (KeysEnd e = 0; e < KEYS_ENDS; e++) {
        if (strcmp(keys_ends[e].name, name) == 0) {
            return e;
        }
    }
    return KEYS_ENDS;
}

static bool is_fraction(double x) {
    return x >= 0 && x <= 1;
}

const char *keys_check_mode(const KeysMode *mode) {
    const double *a = mode->arguments;
    switch (mode->curve) {
    case KEYS_EASE_IN_OUT:
        return is_fraction(a[0]) && is_fraction(a[1]) && a[0] + a[1] <= 1
                   ? NULL
                   : "ease takes two fractions of the span, from 0 and at most 1 together";
    case KEYS_BEZIER:
        if (!is_fraction(a[0]) || !is_fraction(a[2])) {
            return "x1 and x2 of bezier must be in 0..1";
        }
        return isfinite(a[1]) && isfinite(a[3]) ? NULL : "y1 and y2 of bezier must be finite";
    case KEYS_SPRING:
        if (!(a[0] > 0 && isfinite(a[0]))) {
            return "a spring's frequency must be above 0";
        }
        return a[1] >= 0 && isfinite(a[1]) ? NULL : "a spring's damping must not be below 0";
    default:
        return NULL;
    }
}

uint32_t keys_disorder(const double *times, uint32_t n) {
    for (uint32_t k = 1; k < n; k++) {
        if (!(times[k - 1] < times[k])) {
            return k;
        }
    }
    return n;
}

// --- Values ---

// One component: v + w (c1 + w (c2 + w c3)).
typedef struct {
    const KeysTable *table;
    const Ref *values; // this component of key k is values[k * width]
    uint32_t width;
    Ref *c[4]; // [table->n]
} Component;

static Ref value_of(const Component *c, uint32_t key) {
    return c->values[(size_t)key * c->width];
}

static Ref rise(const Component *c, uint32_t span) {
    return dag_op(c->table->dag, OP_SUB, value_of(c, span + 1), value_of(c, span), REF_NONE);
}

static Ref scaled(Dag *dag, Ref a, double k) {
    return dag_op(dag, OP_MUL, a, dag_const(dag, k), REF_NONE);
}

static Ref plus(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_ADD, a, b, REF_NONE);
}

// The speed at a key, times `seconds`.
static Ref way(const Component *c, uint32_t key, bool is_out, double seconds) {
    Dag *dag = c->table->dag;
    const Keys *keys = c->table->keys;
    KeysNeighbours n = keys_neighbours(c->table, key, is_out);
    Ref zero = dag_const(dag, 0), before = zero, after = zero;
    if (n.weight_before != 0) {
        double k = n.weight_before * (seconds / keys_span(keys, n.before));
        before = scaled(dag, rise(c, n.before), k);
    }
    if (n.weight_after != 0) {
        double k = n.weight_after * (seconds / keys_span(keys, n.after));
        after = scaled(dag, rise(c, n.after), k);
    }
    return plus(dag, before, after);
}

// Hermite's cubic in powers of s, from the rise and the ways at both ends.
static void fill_smooth(Component *c, uint32_t span) {
    Dag *dag = c->table->dag;
    double seconds = keys_span(c->table->keys, span);
    Ref up = rise(c, span);
    Ref in = way(c, span, true, seconds), out = way(c, span + 1, false, seconds);
    c->c[1][span + 1] = in;
    Ref twice = plus(dag, in, plus(dag, in, out));
    c->c[2][span + 1] = dag_op(dag, OP_SUB, scaled(dag, up, 3), twice, REF_NONE);
    c->c[3][span + 1] = dag_op(dag, OP_SUB, plus(dag, in, out), scaled(dag, up, 2), REF_NONE);
}

// An end that goes on with its speed.
static Ref continued(const Component *c, bool is_last) {
    const Keys *keys = c->table->keys;
    uint32_t span = is_last ? keys->n - 2 : 0, key = is_last ? keys->n - 1 : 0;
    double seconds = keys_end_span(keys, is_last);
    if (keys->modes[span].curve == KEYS_SMOOTH) {
        return way(c, key, !is_last, seconds);
    }
    double slope = keys_slope(c->table->dag, keys, span, is_last);
    return scaled(c->table->dag, rise(c, span), slope * (seconds / keys_span(keys, span)));
}

static void fill(Component *c) {
    const Keys *keys = c->table->keys;
    Ref zero = dag_const(c->table->dag, 0);
    for (uint32_t i = 0; i < c->table->n; i++) {
        c->c[0][i] = value_of(c, i > 0 ? i - 1 : 0);
        c->c[1][i] = c->c[2][i] = c->c[3][i] = zero;
    }
    for (uint32_t k = 0; k + 1 < keys->n; k++) {
        if (keys->modes[k].curve == KEYS_SMOOTH) {
            fill_smooth(c, k);
        } else if (keys->modes[k].curve != KEYS_STEP) {
            c->c[1][k + 1] = rise(c, k);
        }
    }
    if (keys->before == KEYS_END_LINEAR) {
        c->c[1][0] = continued(c, false);
    }
    if (keys->after == KEYS_END_LINEAR) {
        c->c[1][keys->n] = continued(c, true);
    }
}

static Ref component_value(Component *c, Ref w) {
    const KeysTable *table = c->table;
    Dag *dag = table->dag;
    fill(c);
    Ref zero = dag_const(dag, 0), sum = keys_pick(table, c->c[3]);
    for (int k = 2; k >= 0; k--) { // without smooth spans the upper two are 0
        Ref product = sum == zero ? zero : dag_op(dag, OP_MUL, sum, w, REF_NONE);
        sum = plus(dag, keys_pick(table, c->c[k]), product);
    }
    if (table->turns != REF_NONE) {
        Ref first = value_of(c, 0), last = value_of(c, table->keys->n - 1);
        Ref gain = dag_op(dag, OP_SUB, last, first, REF_NONE);
        sum = plus(dag, sum, dag_op(dag, OP_MUL, gain, table->turns, REF_NONE));
    }
    return sum;
}

void keys_values(Dag *dag, const Keys *keys, Ref clock, const Ref *values, uint32_t width,
                 Ref *out) {
    const Ref *last = values + (size_t)(keys->n - 1) * width;
    if (keys->n == 1) {
        memcpy(out, values, width * sizeof *out);
        return;
    }
    Arena scratch = {0};
    bool is_same = memcmp(values, last, width * sizeof *values) == 0;
    KeysTable table = keys_table(dag, &scratch, keys, clock, is_same);
    Ref w = keys_progress(&table);
    Component c = {.table = &table, .width = width};
    for (int k = 0; k < 4; k++) {
        c.c[k] = ARENA_ARRAY(&scratch, table.n, Ref);
    }
    for (uint32_t i = 0; i < width; i++) {
        c.values = values + i;
        out[i] = component_value(&c, w);
    }
    arena_free(&scratch);
}

// --- Transforms ---

RefMap keys_map(Dag *dag, const Keys *keys, Ref clock, const RefMap *values) {
    if (keys->n == 1) {
        return values[0];
    }
    Arena scratch = {0};
    enum { WIDTH = 6 }; // translation and scale
    Ref *vectors = ARENA_ARRAY(&scratch, (size_t)keys->n * WIDTH, Ref), out[WIDTH];
    RefQuat *rotations = ARENA_ARRAY(&scratch, keys->n, RefQuat);
    for (uint32_t k = 0; k < keys->n; k++) {
        RefParts p = spatial_map_split(dag, &values[k]);
        const Ref row[WIDTH] = {p.translation.x, p.translation.y, p.translation.z,
                                p.scale.x,       p.scale.y,       p.scale.z};
        memcpy(vectors + (size_t)k * WIDTH, row, sizeof row);
        rotations[k] = p.rotation;
    }
    keys_values(dag, keys, clock, vectors, WIDTH, out);
    RefParts parts = {.translation = ref3(out[0], out[1], out[2]),
                      .rotation = keys_rotation(dag, keys, clock, rotations),
                      .scale = ref3(out[3], out[4], out[5])};
    arena_free(&scratch);
    return spatial_map_join(dag, &parts);
}
