// SPDX-License-Identifier: Apache-2.0
// Clips as values: the named spans of a def's time, and choices between them.
//
// A def's clips are read once, when the def is first used: by a copy, an instance, or as Man.walk.
// They are the same for all its copies, so parameters say nothing about them. What loop variables
// choose between stays one value with a choice in each of its numbers, so that a thousand instances
// which play what they like are evaluated once; lists of different lengths are as long as the
// longer one, with a length that is chosen as well.
#include "lang/eval_clip.h"

#include <math.h>
#include <string.h>

#include "lang/builtins.h"

static Value clip_value(Eval *ev, const ClipValue *clip) {
    ClipValue *copy = ARENA_NEW(ev->arena, ClipValue);
    *copy = *clip;
    return (Value){.type = VALUE_CLIP, .clip = copy};
}

// ---- The clips of a def

// What spans may be written with: the def's own names. Its parameters have no values there.
static Env inside_def(Eval *ev, const Binding *def, Scope *at) {
    const Syntax *syntax = def->module->syntax;
    const uint32_t *extra = syntax->extra + syntax_node(syntax, def->node)->b;
    const Node *params = syntax_node(syntax, extra[0]), *block = syntax_node(syntax, extra[1]);
    Scope *around = scope_new(ev->arena, at);
    for (uint32_t i = 0; extra[0] && i < params->b; i++) {
        scope_bind(ev->arena, around, syntax->extra[params->a + 3 * i], BINDING_OF_COPIES);
    }
    Env env = {def->module, scope_new(ev->arena, around)};
    for (uint32_t i = 0; i < block->b; i++) {
        NodeId statement = syntax->extra[block->a + i];
        const Node *node = syntax_node(syntax, statement);
        BindingKind kind = node->kind == NODE_FN    ? BINDING_FN
                           : node->kind == NODE_DEF ? BINDING_DEF
                                                    : BINDING_LET;
        bool has_name = kind != BINDING_LET || node->kind == NODE_LET;
        if (has_name && !scope_find_own(env.scope, node->a)) {
            eval_bind_name(ev, &env, statement, node->a, kind);
        }
    }
    return env;
}

// False: reported, or asked for.
static bool read_span(Eval *ev, const Env *env, NodeId node, Ref ends[2]) {
    Value span = eval_expr(ev, env, node);
    double lo, hi;
    if (value_is_poison(&span)) {
        return false;
    }
    const char *found = value_describe(ev->arena, &span);
    bool is_range = value_is(&span, VALUE_RANGE) && span.range->step == REF_NONE;
    if (is_range && (span.range->dimension || span.range->is_angle)) {
        uint8_t of = span.range->is_angle ? DIMENSION_ANGLE : span.range->dimension;
        found = arena_printf(ev->arena, "a range from %s", dimension_names[of]);
        is_range = of == DIMENSION_TIME;
    }
    if (!is_range) {
        eval_error(ev, env, node, "write 0s..1s", "a clip is a span of time, this is %s", found);
        return false;
    }
    ends[0] = span.range->low;
    ends[1] = span.range->high;
    if (!eval_need(ev, env, node, ends[0], "where a clip begins", &lo) ||
        !eval_need(ev, env, node, ends[1], "where a clip ends", &hi)) {
        return false;
    }
    if (!(hi > lo) || !isfinite(lo) || !isfinite(hi)) {
        eval_error(ev, env, node, NULL, "a clip ends after it begins: this is from %gs to %gs", lo,
                   hi);
        return false;
    }
    return true;
}

static Value read_clip(Eval *ev, const Env *env, const Binding *def, NodeId statement) {
    const Syntax *syntax = def->module->syntax;
    const Node *node = syntax_node(syntax, statement);
    ClipValue clip = {.name = node->a,
                      .def = def->name,
                      .syntax = syntax,
                      .def_block = syntax->extra[syntax_node(syntax, def->node)->b + 1]};
    if (!read_span(ev, env, node->b, clip.ref)) {
        return value_poison();
    }
    for (int k = CLIP_AT; k < CLIP_REFS; k++) {
        clip.ref[k] = dag_const(ev->dag, 0);
    }
    Value value = clip_value(ev, &clip);
    Value played = builtins_apply(ev, BUILTIN_PLAY, &value, 1, env, node->b);
    clip = *played.clip;
    clip.is_played = false;
    return clip_value(ev, &clip);
}

static void read_clips(Eval *ev, const Binding *def, Scope *at, Scope *clips) {
    const Syntax *syntax = def->module->syntax;
    const Node *block = syntax_node(syntax, syntax->extra[syntax_node(syntax, def->node)->b + 1]);
    Env inside = {NULL, NULL};
    for (uint32_t i = 0; i < block->b; i++) {
        NodeId statement = syntax->extra[block->a + i];
        const Node *node = syntax_node(syntax, statement);
        if (node->kind != NODE_CLIP) {
            continue;
        }
        inside = inside.scope ? inside : inside_def(ev, def, at);
        def->module->flags[statement] |= MODULE_USED; // it stands in a def, as it ought to
        diag_next_statement(ev->diag);
        bool has_name = eval_bind_name(ev, &inside, statement, node->a, BINDING_LET);
        if (has_name || !scope_find_own(clips, node->a)) { // what has a wrong name is not missed
            Value value = has_name ? read_clip(ev, &inside, def, statement) : value_poison();
            Binding *binding = scope_bind(ev->arena, clips, node->a, BINDING_LET);
            binding->state = BINDING_DONE;
            binding->value = value;
            binding->where = syntax_name_span(syntax, statement);
        }
        diag_next_statement(ev->diag);
    }
}

const Scope *clips_of_def(Eval *ev, Scope *at, const Binding *def) {
    if (def->members) {
        return def->members;
    }
    const Binding own = *def; // it moves when more names are bound in its scope
    uint32_t index = (uint32_t)(def - at->bindings);
    Scope *clips = scope_new(ev->arena, NULL);
    at->bindings[index].members = clips;
    read_clips(ev, &own, at, clips);
    if (ev->unroll) { // what is poison only because of that is read again
        at->bindings[index].members = NULL;
    }
    return clips;
}

void clips_bind(Eval *ev, const Scope *clips, Scope *scope) {
    for (uint32_t i = 0; i < clips->n; i++) {
        const Binding *clip = &clips->bindings[i];
        if (!scope_find_own(scope, clip->name)) {
            Binding *binding = scope_bind(ev->arena, scope, clip->name, BINDING_LET);
            *binding = *clip;
        }
    }
}

const char *clips_text(Eval *ev, const Scope *clips) {
    enum { SHOWN = 8 };
    const char *text = "it has ";
    for (uint32_t i = 0; i < clips->n && i < SHOWN; i++) {
        const char *joint = i == 0 ? "" : i + 1 == clips->n ? " and " : ", ";
        text = arena_printf(ev->arena, "%s%s%s", text, joint,
                            symbol_text(ev->symbols, clips->bindings[i].name));
    }
    return clips->n == 0      ? "a def's clips stand in its block: clip walk = 0s..1s"
           : clips->n > SHOWN ? arena_printf(ev->arena, "%s and %u more", text, clips->n - SHOWN)
                              : text;
}

bool clip_member(Eval *ev, const Env *env, NodeId id, Value *value) {
    const Node *node = syntax_node(env->module->syntax, id);
    Scope *at = NULL;
    const Binding *def = object_find(env, node->a, &at);
    if (!def || def->kind != BINDING_DEF) {
        return false;
    }
    const char *def_name = symbol_text(ev->symbols, def->name);
    def->module->flags[def->node] |= MODULE_USED;
    const Scope *clips = clips_of_def(ev, at, def);
    const Binding *clip = scope_find_own(clips, node->b);
    if (clip || ev->unroll) {
        *value = clip ? clip->value : value_poison();
        return true;
    }
    const char *names[64], *name = symbol_text(ev->symbols, node->b);
    size_t n = scope_names(clips, ev->symbols, names, 64);
    const char *near = diag_nearest(name, names, n);
    *value = eval_error(ev, env, id,
                        near ? arena_printf(ev->arena, "did you mean '%s'?", near)
                             : clips_text(ev, clips),
                        "def %s has no clip '%s'", def_name, name);
    return true;
}

// ---- Played

Value clip_play(Eval *ev, const ClipValue *clip, const Value *rest) {
    ClipValue played = *clip;
    played.is_played = true;
    for (int k = CLIP_AT; k < CLIP_REFS; k++) {
        played.ref[k] = rest[k - CLIP_AT].ref[0];
    }
    return clip_value(ev, &played);
}

// ---- Choices

static bool are_clips(const List *list) {
    for (uint32_t i = 0; i < list->n; i++) {
        if (!value_is(&list->items[i], VALUE_CLIP)) {
            return false;
        }
    }
    return list->n > 0 && !list->each;
}

bool clip_is_or_holds(const Value *value) {
    return value_is(value, VALUE_CLIP) || (value_is(value, VALUE_LIST) && are_clips(value->list));
}

static Value choose_clip(Eval *ev, Ref condition, const ClipValue *a, const ClipValue *b) {
    ClipValue clip = *a;
    clip.name = a->name == b->name ? a->name : 0;
    clip.is_played = a->is_played || b->is_played;
    for (int k = 0; k < CLIP_REFS; k++) {
        clip.ref[k] = dag_op(ev->dag, OP_SELECT, condition, a->ref[k], b->ref[k]);
    }
    return clip_value(ev, &clip);
}

static bool are_of_one_def(const List *a, const List *b) {
    uint32_t n = a->n < b->n ? a->n : b->n;
    for (uint32_t i = 0; i < n; i++) {
        if (!clip_is_of_one_def(a->items[i].clip, b->items[i].clip)) {
            return false;
        }
    }
    return true;
}

static Ref length_of(Eval *ev, const List *list) {
    return list->length ? *list->length : dag_const(ev->dag, list->n);
}

static Value choose_list(Eval *ev, Ref condition, const List *a, const List *b) {
    const List *longer = a->n < b->n ? b : a;
    uint32_t n_both = a->n < b->n ? a->n : b->n;
    List *list = ARENA_NEW(ev->arena, List);
    Value *items = ARENA_ARRAY(ev->arena, longer->n, Value);
    memcpy(items, longer->items, longer->n * sizeof *items);
    *list = (List){.n = longer->n, .items = items, .inputs = dag_inputs(ev->dag, condition)};
    list->inputs |= a->inputs | b->inputs;
    for (uint32_t i = 0; i < n_both; i++) {
        items[i] = choose_clip(ev, condition, a->items[i].clip, b->items[i].clip);
    }
    if (a->n != b->n || a->length || b->length) {
        Ref *length = ARENA_NEW(ev->arena, Ref);
        *length = dag_op(ev->dag, OP_SELECT, condition, length_of(ev, a), length_of(ev, b));
        list->length = length;
    }
    ev->steps += longer->n / 8;
    return (Value){.type = VALUE_LIST, .list = list};
}

bool clip_choose(Eval *ev, Ref condition, const Value *a, const Value *b, Value *chosen) {
    if (dag_inputs(ev->dag, condition) & ~LOOP_INPUTS) {
        return false;
    }
    if (value_is(a, VALUE_CLIP) && value_is(b, VALUE_CLIP) &&
        clip_is_of_one_def(a->clip, b->clip)) {
        *chosen = choose_clip(ev, condition, a->clip, b->clip);
        return true;
    }
    if (value_is(a, VALUE_LIST) && value_is(b, VALUE_LIST) && clip_is_or_holds(a) &&
        clip_is_or_holds(b) && are_of_one_def(a->list, b->list)) {
        *chosen = choose_list(ev, condition, a->list, b->list);
        return true;
    }
    return false;
}
