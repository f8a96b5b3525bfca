// SPDX-License-Identifier: Apache-2.0
// `keys` tables: modes by name, times in order, values of one type.
#include "lang/eval_keys.h"

#include <math.h>
#include <string.h>

#include "lang/keys.h"
#include "lang/watch.h"

typedef struct {
    Eval *ev;
    const Env *env;
    Keys keys;
    double *times;
    KeysMode *modes;
    Value *values;
    const uint32_t *words; // (time, value, mode or 0)...
} Table;

// ---- Modes

static const char *mode_hint(Eval *ev, const char *name) {
    const char *names[KEYS_CURVES + 2];
    size_t n = 0;
    for (int i = 0; i < KEYS_CURVES; i++) {
        names[n++] = keys_curves[i].name;
    }
    names[n++] = "before";
    names[n++] = "after";
    if (keys_find_end(name) != KEYS_ENDS) {
        return arena_printf(ev->arena, "write before(%s) or after(%s)", name, name);
    }
    const char *near = diag_nearest(name, names, n);
    return near ? arena_printf(ev->arena, "did you mean %s?", near)
                : "step, linear, smooth, ease, ease(in, out), bezier(x1, y1, x2, y2), spring(freq, "
                  "damping)";
}

static bool read_curve(Table *table, NodeId node, KeysMode *mode) {
    Eval *ev = table->ev;
    const Syntax *syntax = table->env->module->syntax;
    const Node *m = syntax_node(syntax, node);
    const char *name = symbol_text(ev->symbols, m->a);
    const uint32_t *args = m->b ? syntax->extra + m->b : NULL;
    uint32_t n = args ? args[0] : 0;
    mode->curve = keys_find_curve(name, n);
    if (mode->curve == KEYS_CURVES) {
        bool is_known = false;
        for (int i = 0; i < KEYS_CURVES; i++) {
            is_known = is_known || strcmp(keys_curves[i].name, name) == 0;
        }
        eval_error(ev, table->env, node,
                   is_known ? "ease, ease(in, out), bezier(x1, y1, x2, y2), spring(freq, damping)"
                            : mode_hint(ev, name),
                   is_known ? "'%s' does not take so many values" : "keys have no mode '%s'", name);
        return false;
    }
    for (uint32_t i = 0; i < n && i < 4; i++) {
        Value value = eval_expr(ev, table->env, args[3 * i + 3]);
        if (value_is_poison(&value)) {
            return false;
        }
        if (!value_is(&value, VALUE_NUMBER)) {
            eval_error(ev, table->env, args[3 * i + 3], NULL, "a mode takes numbers, this is %s",
                       value_describe(ev->arena, &value));
            return false;
        }
        if (!eval_need(ev, table->env, args[3 * i + 3], value.ref[0], "a mode's number",
                       &mode->arguments[i])) {
            return false;
        }
    }
    const char *wrong = keys_check_mode(mode);
    if (wrong) {
        eval_error(ev, table->env, node, NULL, "%s: %s", name, wrong);
    }
    return !wrong;
}

// before(hold), after(loop). False: reported.
static bool read_end(Table *table, NodeId node, KeysEnd *end) {
    Eval *ev = table->ev;
    const Syntax *syntax = table->env->module->syntax;
    const Node *m = syntax_node(syntax, node);
    const uint32_t *args = m->b ? syntax->extra + m->b : NULL;
    const Node *word = args && args[0] == 1 ? syntax_node(syntax, args[3]) : NULL;
    *end = word && (word->kind == NODE_NAME || word->kind == NODE_STRING)
               ? keys_find_end(symbol_text(ev->symbols, word->a))
               : KEYS_ENDS;
    if (*end == KEYS_ENDS) {
        eval_error(ev, table->env, node, "hold, linear, loop, pingpong or offset",
                   "'%s' takes what the keys do there", symbol_text(ev->symbols, m->a));
    }
    return *end != KEYS_ENDS;
}

// keys MODE [before(..)] [after(..)]
static bool read_modes(Table *table, const uint32_t *modes, uint32_t n, KeysMode *common) {
    bool has_curve = false;
    for (uint32_t i = 0; i < n; i++) {
        const Node *m = syntax_node(table->env->module->syntax, modes[i]);
        const char *name = symbol_text(table->ev->symbols, m->a);
        bool is_before = strcmp(name, "before") == 0;
        if (is_before || strcmp(name, "after") == 0) {
            if (!read_end(table, modes[i], is_before ? &table->keys.before : &table->keys.after)) {
                return false;
            }
        } else if (has_curve) {
            eval_error(table->ev, table->env, modes[i], NULL,
                       "keys have one mode, '%s' is a second", name);
            return false;
        } else if (!read_curve(table, modes[i], common)) {
            return false;
        }
        has_curve = has_curve || (!is_before && strcmp(name, "after") != 0);
    }
    return true;
}

// ---- Keys

static bool read_time(Table *table, uint32_t i) {
    NodeId node = table->words[3 * i];
    Value time = eval_expr(table->ev, table->env, node);
    if (value_is_poison(&time)) {
        return false;
    }
    if (!value_is(&time, VALUE_NUMBER) || (time.dimension && time.dimension != DIMENSION_TIME)) {
        eval_error(table->ev, table->env, node, NULL, "a key stands at a time, this is %s",
                   value_describe(table->ev->arena, &time));
        return false;
    }
    if (!eval_need(table->ev, table->env, node, time.ref[0], "the time of a key",
                   &table->times[i])) {
        return false;
    }
    if (!isfinite(table->times[i])) {
        eval_error(table->ev, table->env, node, NULL, "the time of a key is not a finite number");
        return false;
    }
    return true;
}

static bool read_value(Table *table, uint32_t i) {
    NodeId node = table->words[3 * i + 1];
    Value *value = &table->values[i], *first = &table->values[0];
    *value = eval_expr(table->ev, table->env, node);
    if (value_is_poison(value)) {
        return false;
    }
    if (!value_is_numeric(value) || value_is(value, VALUE_BOOL)) {
        eval_error(
            table->ev, table->env, node,
            value_is(value, VALUE_BOOL) ? "compare keys of numbers: keys step { ... } > 0" : NULL,
            "keys go over numbers, angles, vectors, colors, rotations and transforms, this is %s",
            value_describe(table->ev->arena, value));
        return false;
    }
    bool is_alike = value->type == first->type || (value_is_vec3(value) && value_is_vec3(first));
    if (!is_alike || value->n != first->n) {
        double x;
        bool is_number = value_is(value, VALUE_NUMBER) && value_is(first, VALUE_ANGLE) &&
                         dag_is_const(table->ev->dag, value->ref[0], &x);
        eval_error(table->ev, table->env, node,
                   is_number ? arena_printf(table->ev->arena, "write %.15gdeg", x) : NULL,
                   "the first key is %s, this is %s", value_describe(table->ev->arena, first),
                   value_describe(table->ev->arena, value));
        return false;
    }
    return true;
}

static bool read_keys(Table *table, const KeysMode *common) {
    for (uint32_t i = 0; i < table->keys.n; i++) {
        NodeId mode = table->words[3 * i + 2];
        table->modes[i] = *common;
        if (!read_time(table, i) || !read_value(table, i) ||
            (mode && !read_curve(table, mode, &table->modes[i]))) {
            return false;
        }
    }
    uint32_t late = keys_disorder(table->times, table->keys.n);
    if (late < table->keys.n) {
        bool is_equal = table->times[late] == table->times[late - 1];
        eval_error(table->ev, table->env, table->words[3 * late],
                   is_equal ? "for a jump write: value step" : NULL,
                   is_equal ? "two keys stand at one time"
                            : "keys stand in the order of their times");
        return false;
    }
    return true;
}

static Value build(Table *table) {
    Eval *ev = table->ev;
    uint32_t n = table->keys.n;
    const Value *first = &table->values[0];
    Ref clock = dag_input(ev->dag, IN_T);
    if (value_is(first, VALUE_ROTATION)) {
        RefQuat *quats = ARENA_ARRAY(ev->arena, n, RefQuat);
        for (uint32_t i = 0; i < n; i++) {
            quats[i] = value_quat(&table->values[i]);
        }
        return value_from_quat(keys_rotation(ev->dag, &table->keys, clock, quats));
    }
    if (value_is(first, VALUE_TRANSFORM)) {
        RefMap *maps = ARENA_ARRAY(ev->arena, n, RefMap), map;
        for (uint32_t i = 0; i < n; i++) {
            maps[i] = *table->values[i].map;
        }
        map = keys_map(ev->dag, &table->keys, clock, maps);
        return value_transform(ev->arena, &map);
    }
    Ref *refs = ARENA_ARRAY(ev->arena, (size_t)n * first->n, Ref);
    for (uint32_t i = 0; i < n; i++) {
        memcpy(refs + (size_t)i * first->n, table->values[i].ref, first->n * sizeof *refs);
    }
    Value value = *first;
    keys_values(ev->dag, &table->keys, clock, refs, first->n, value.ref);
    return value;
}

Value eval_keys(Eval *ev, const Env *env, NodeId id) {
    const Syntax *syntax = env->module->syntax;
    const uint32_t *words = syntax->extra + syntax_node(syntax, id)->a;
    uint32_t n_modes = words[0], n = words[1 + n_modes];
    KeysMode common = {.curve = KEYS_LINEAR};
    Table table = {.ev = ev, .env = env, .words = words + 2 + n_modes};
    table.times = ARENA_ARRAY(ev->arena, n, double);
    table.modes = ARENA_ARRAY(ev->arena, n, KeysMode);
    table.values = ARENA_ARRAY(ev->arena, n, Value);
    table.keys = (Keys){n, table.times, table.modes, KEYS_END_HOLD, KEYS_END_HOLD};
    if (!read_modes(&table, words + 1, n_modes, &common)) {
        return value_poison();
    }
    if (n < 2 && !(n == 1 && common.curve == KEYS_STEP)) {
        return eval_error(ev, env, id, "one value that does not change needs no keys",
                          "keys are at least two");
    }
    if (!read_keys(&table, &common)) {
        return value_poison();
    }
    if (table.keys.before == KEYS_END_HOLD && table.keys.after == KEYS_END_HOLD) {
        watch_keys(ev, syntax_word_span(syntax, syntax_node(syntax, id)->lo), table.times[0],
                   table.times[n - 1]);
    }
    return build(&table);
}
