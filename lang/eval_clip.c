// SPDX-License-Identifier: Apache-2.0
// Clips: named spans of a def's time, and instances that play them one after another.
//
// While one fades into the next, an instance shows two moments of its def: `before` and `now`, with
// a weight. What is worked out at a ray's time (transforms, materials, lights) blends value by
// value (lang/eval_clock.c). Vertices blend as well, and are sampled: a fade is a form of its own,
// in the time since it began, so instances whose fades are alike share it. That they are alike is
// seen to here: a clip begins where the one before it has gone through a whole number of equal
// parts. A tree over cells of time holds one moment only; a hierarchy whose boxes blend would do
// without the parts, but ask for two moments of every vertex at each ray.
#include "lang/eval_clip.h"

#include <string.h>

#include "lang/builtins.h"
#include "lang/functions.h"

enum { MAX_CLIPS = 64 };

// What is played, of what a list says.
typedef struct {
    Ref lo, hi; // of the def's time
    Ref at, fade, speed, once, parts;
} Play;

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref choose(Dag *dag, Ref condition, Ref then, Ref otherwise) {
    return dag_op(dag, OP_SELECT, condition, then, otherwise);
}

// ---- The names of a def's clips

// A span's ends must be known. False: reported, or asked for.
static bool read_span(Eval *ev, const Env *env, NodeId statement, Value *clip) {
    NodeId node = syntax_node(env->module->syntax, statement)->b;
    Value span = eval_expr(ev, env, node);
    double lo, hi;
    if (value_is_poison(&span)) {
        return false;
    }
    if (!value_is(&span, VALUE_RANGE) || span.range->is_angle || span.range->step != REF_NONE) {
        eval_error(ev, env, node, "write 0s..1s", "a clip is a span of time, this is %s",
                   value_describe(ev->arena, &span));
        return false;
    }
    if (!eval_need(ev, env, node, span.range->low, "where a clip begins", &lo) ||
        !eval_need(ev, env, node, span.range->high, "where a clip ends", &hi)) {
        return false;
    }
    if (!(hi > lo)) {
        eval_error(ev, env, node, NULL, "a clip ends after it begins: this is from %gs to %gs", lo,
                   hi);
        return false;
    }
    const Ref ends[2] = {span.range->low, span.range->high};
    *clip = value_vec(VALUE_VEC, ends, 2);
    return true;
}

// What clips may be written with: the def's own names, but for its parameters.
static Env inside_def(Eval *ev, const Env *def, const Syntax *syntax, const Node *block) {
    Env env = {def->module, scope_new(ev->arena, def->scope)};
    for (uint32_t i = 0; i < block->b; i++) {
        NodeId statement = syntax->extra[block->a + i];
        const Node *node = syntax_node(syntax, statement);
        bool is_let = node->kind == NODE_LET, is_fn = node->kind == NODE_FN;
        if ((is_let || is_fn) && !scope_find_own(env.scope, node->a)) {
            eval_bind_name(ev, &env, statement, node->a, is_let ? BINDING_LET : BINDING_FN);
        }
    }
    return env;
}

Env clip_names(Eval *ev, const Env *env, const Object *copy) {
    const Syntax *syntax = copy->def_env->module->syntax;
    const Node *block = syntax_node(syntax, copy->def_block);
    Env names = {env->module, scope_new(ev->arena, env->scope)};
    Env def = inside_def(ev, copy->def_env, syntax, block);
    for (uint32_t i = 0; i < block->b; i++) {
        NodeId statement = syntax->extra[block->a + i];
        const Node *node = syntax_node(syntax, statement);
        Value clip;
        if (node->kind != NODE_CLIP) {
            continue;
        }
        const Env at = {def.module, names.scope};
        if (read_span(ev, &def, statement, &clip)) {
            Binding *binding = eval_bind_name(ev, &at, statement, node->a, BINDING_VARIABLE);
            if (binding) {
                binding->value = clip;
            }
        }
    }
    return names;
}

// ---- The list

Value clip_play(Eval *ev, const Value *clip, const Value *rest) {
    Value *items = ARENA_ARRAY(ev->arena, 7, Value);
    List *list = ARENA_NEW(ev->arena, List);
    items[0] = value_scalar(VALUE_NUMBER, clip->ref[0]);
    items[1] = value_scalar(VALUE_NUMBER, clip->ref[1]);
    memcpy(items + 2, rest, 5 * sizeof *items);
    *list = (List){.n = 7, .items = items};
    for (int k = 0; k < 7; k++) {
        list->inputs |= value_inputs(ev->dag, &items[k]);
    }
    return (Value){.type = VALUE_LIST, .list = list};
}

// A clip alone is as play(...) has it without more. False: it is something else.
static bool read_play(Eval *ev, const Given *given, const Value *value, Play *play) {
    Value alone;
    if (value_is(value, VALUE_VEC) && value->n == 2) {
        alone = builtins_apply(ev, BUILTIN_PLAY, value, 1, &given->env, given->node);
        value = &alone;
    }
    if (!value_is(value, VALUE_LIST) || value->list->n != 7) {
        return false;
    }
    Ref refs[7];
    for (int k = 0; k < 7; k++) {
        const Value *item = &value->list->items[k];
        if (item->n != 1 || !value_is_numeric(item)) {
            return false;
        }
        refs[k] = item->ref[0];
    }
    *play = (Play){refs[0], refs[1], refs[2], refs[3], refs[4], refs[5], refs[6]};
    return true;
}

// Returns how many; 0: reported, or asked for.
static uint32_t read_list(Eval *ev, const Given *given, Play plays[MAX_CLIPS]) {
    const Value *value = &given->value;
    Play one;
    bool is_one = read_play(ev, given, value, &one);
    bool is_list = value_is(value, VALUE_LIST) && !value->list->each;
    uint32_t n = is_one ? 1 : is_list ? value->list->n : 0;
    uint32_t inputs = value_inputs(ev->dag, value) & ~LOOP_INPUTS;
    if (value_is_poison(value)) {
        return 0;
    }
    if (n > MAX_CLIPS) {
        eval_error_at(ev, given->where, NULL, "an instance plays at most %d clips, these are %u",
                      MAX_CLIPS, n);
        return 0;
    }
    for (uint32_t i = 0; i < n; i++) {
        const Value *item = is_one ? value : &value->list->items[i];
        if (!read_play(ev, given, item, &plays[i])) {
            eval_error_at(ev, given->where, "write [walk, play(wave, at = 3s)]",
                          "clips are names of clips and play(...), item %u is %s", i + 1,
                          value_describe(ev->arena, item));
            return 0;
        }
    }
    if (is_list && n == 0) {
        eval_error_at(ev, given->where, "write [walk, play(wave, at = 3s)]",
                      "the list of clips is empty");
        return 0;
    }
    if (n == 0) {
        eval_error_at(ev, given->where, "write [walk, play(wave, at = 3s)]",
                      "clips is a list of clips, this is %s", value_describe(ev->arena, value));
        return 0;
    }
    if (inputs) {
        eval_error_at(ev, given->where, "say when a clip begins by at: play(wave, at = 3s)",
                      "which clips an instance plays can not depend on %s",
                      eval_input_name(inputs));
        return 0;
    }
    return n;
}

// ---- When each begins, and what is shown

// The def's time, `gone` seconds of the clip's own after `from`.
static Ref shown(Dag *dag, const Play *p, Ref from, Ref gone) {
    Ref span = op2(dag, OP_SUB, p->hi, p->lo);
    Ref along = op2(dag, OP_ADD, from, op2(dag, OP_MUL, p->speed, gone));
    Ref held = functions_clamp(dag, along, dag_const(dag, 0), span);
    Ref again = op2(dag, OP_MOD, along, span);
    return op2(dag, OP_ADD, p->lo, choose(dag, p->once, held, again));
}

typedef struct {
    Ref start; // of the place's clock
    Ref from;  // how far into the clip before it is then
    Ref fade;  // seconds, at most until the next one begins
} Begin;

// At the nearest whole number of parts of the clip before, and never before that begins; is_first:
// the first is always there.
static Begin begin_after(Dag *dag, const Play *p, const Play *before, Ref started, bool is_first) {
    Ref zero = dag_const(dag, 0), span = op2(dag, OP_SUB, before->hi, before->lo);
    Ref at = is_first ? p->at : op2(dag, OP_MAX, p->at, started);
    Ref gone = op2(dag, OP_MUL, before->speed, op2(dag, OP_SUB, at, started));
    Ref part = op2(dag, OP_DIV, span, p->parts);
    Ref n = dag_op(dag, OP_ROUND, op2(dag, OP_DIV, gone, part), REF_NONE, REF_NONE);
    Ref moved = op2(dag, OP_DIV, op2(dag, OP_MUL, n, part), before->speed);
    Ref held = functions_clamp(dag, n, zero, p->parts);
    Ref whole =
        op2(dag, OP_MUL, choose(dag, before->once, held, op2(dag, OP_MOD, n, p->parts)), part);
    Ref exact = choose(dag, before->once, functions_clamp(dag, gone, zero, span),
                       op2(dag, OP_MOD, gone, span));
    Ref has_parts =
        op2(dag, OP_AND, op2(dag, OP_LT, zero, p->parts), op2(dag, OP_LT, zero, before->speed));
    return (Begin){choose(dag, has_parts, op2(dag, OP_ADD, started, moved), at),
                   choose(dag, has_parts, whole, exact), p->fade};
}

static void begin_all(Dag *dag, const Play *plays, uint32_t n, Begin *begins) {
    begins[0] = (Begin){plays[0].at, dag_const(dag, 0), dag_const(dag, 0)};
    for (uint32_t k = 1; k < n; k++) {
        begins[k] = begin_after(dag, &plays[k], &plays[k - 1], begins[k - 1].start, k == 1);
    }
    for (uint32_t k = 1; k + 1 < n; k++) {
        Ref until = op2(dag, OP_SUB, begins[k + 1].start, begins[k].start);
        begins[k].fade =
            op2(dag, OP_MAX, dag_const(dag, 0), op2(dag, OP_MIN, begins[k].fade, until));
    }
}

// One fade: what is shown `gone` seconds after it began.
static void fade_times(Dag *dag, const Play *p, const Play *before, const Begin *begin, Ref gone,
                       Ref times[3]) {
    Ref zero = dag_const(dag, 0), one = dag_const(dag, 1);
    times[0] = shown(dag, before, begin->from, gone);
    times[1] = shown(dag, p, zero, gone);
    times[2] = choose(dag, op2(dag, OP_LT, zero, begin->fade),
                      functions_smoothstep(dag, zero, begin->fade, gone), one);
}

bool place_play_clips(Eval *ev, Place *place, const Given *given, Ref t) {
    Dag *dag = ev->dag;
    Play plays[MAX_CLIPS];
    Begin begins[MAX_CLIPS];
    uint32_t n = read_list(ev, given, plays);
    if (n == 0) {
        return false;
    }
    begin_all(dag, plays, n, begins);
    Ref since = dag_input(dag, IN_T), zero = dag_const(dag, 0);
    Clips *clips = ARENA_NEW(ev->arena, Clips);
    *clips = (Clips){.weight = dag_const(dag, 1),
                     .is_fading = zero,
                     .n = n - 1,
                     .fades = ARENA_ARRAY(ev->arena, n, ClipFade)};
    Ref now = shown(dag, &plays[0], zero, op2(dag, OP_SUB, t, begins[0].start));
    clips->before = now;
    for (uint32_t k = 1; k < n; k++) {
        ClipFade *fade = &clips->fades[k - 1];
        Ref gone = op2(dag, OP_SUB, t, begins[k].start), times[3];
        Ref has_begun = op2(dag, OP_LE, begins[k].start, t);
        fade_times(dag, &plays[k], &plays[k - 1], &begins[k], gone, times);
        fade_times(dag, &plays[k], &plays[k - 1], &begins[k], since, fade->times);
        fade->clock = functions_clamp(dag, gone, zero, begins[k].fade);
        fade->is_on = op2(dag, OP_AND, has_begun, op2(dag, OP_LT, gone, begins[k].fade));
        clips->before = choose(dag, has_begun, times[0], clips->before);
        clips->weight = choose(dag, has_begun, times[2], clips->weight);
        clips->is_fading = op2(dag, OP_OR, clips->is_fading, fade->is_on);
        now = choose(dag, has_begun, times[1], now);
    }
    place->clock = now;
    place->clips = clips;
    return true;
}
