// SPDX-License-Identifier: Apache-2.0
// Instances that play clips one after another.
//
// While one fades into the next, an instance shows two moments of its def: `before` and `now`, with
// a weight. What is worked out at a ray's time (transforms, materials, lights) blends value by
// value (lang/eval_clock.c). Vertices blend as well, and are sampled: a fade is a form of its own,
// in the time since it began, so instances whose fades are alike share it. That they are alike is
// seen to here: a clip begins where the one before it has gone through a whole number of equal
// parts, its phase.
//
// The other way is one hierarchy for all fades, over the arrays of the clips themselves, whose
// boxes and vertices are blends of two moments at each ray's time; a phase costs it nothing. As a
// prototype, 16 wide, AVX2, beside bvh16 over sampled fades of 25 keys; camera rays at 1,000
// instances, all of them fading, one thread, medians of 5 in turn (that differ by up to 20 %):
//
//                                    1 phase             8                  32
//   a walker of       sampled   15.8 Mrays/s, 1.3 MB  13.4,  10.7 MB   11.4,   43 MB
//   2,224 triangles   blended   12.8          1.6     12.2    1.6      12.7     1.6
//   a figure of       sampled    7.8           38      3.6    303       2.9   1213
//   69,451 triangles  blended    6.4           18      4.6     18       4.1     18
//
// Sampling and trees take 5.6 s for the figure's 32 phases, the boxes of blends 0.2 s.
// It is the better one from some eight phases on. What is built is the first: it asks nothing of
// the structures below, and where a few instances fade at a time it costs little. Of frame 100 of
// examples/crowd.st4, where it is 24 MB and 0.5 s of sampling, the rays take as long with fades as
// without. A crowd of figures with ten thousand triangles or more would be worth the second.
//
// An instance with a clock of its own, in a def that plays clips, shows what it would if its def
// were written out there: its clock is asked at both moments, and what it shows at the two is
// blended. The clock itself is not: on the way from 9 s to 30 s it would rush through all between.
#include "lang/eval_clip.h"

#include <string.h>

#include "lang/functions.h"

enum { MAX_CLIPS = 64 };

// What is played, of what a list says.
typedef struct {
    const Ref *of; // [CLIP_REFS]
    Ref is_there;  // a truth value: lists may differ in length
} Play;

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref choose(Dag *dag, Ref condition, Ref then, Ref otherwise) {
    return dag_op(dag, OP_SELECT, condition, then, otherwise);
}

static Ref span_of(Dag *dag, const Play *p) {
    return op2(dag, OP_SUB, p->of[CLIP_END], p->of[CLIP_BEGIN]);
}

// ---- The list

static const char how_to[] = "write [walk, play(wave, at = 3s)]";

// A clip of the def that the copy is of; false: reported. number: of the item, 0: it stands alone.
static bool read_play(Eval *ev, const Object *copy, Span where, const Value *value, uint32_t number,
                      Play *play) {
    const Module *module = copy->def_env->module;
    if (!value_is(value, VALUE_CLIP)) {
        eval_error_at(ev, where, how_to, "clips are names of clips and play(...), item %u is %s",
                      number, value_describe(ev->arena, value));
        return false;
    }
    const ClipValue *clip = value->clip;
    if (clip->syntax != module->syntax || clip->def_block != copy->def_block) {
        const char *name = clip->name ? symbol_text(ev->symbols, clip->name) : "this";
        eval_error_at(ev, where, clips_text(ev, copy->clips),
                      "%s is a clip of %s, this is an instance of %s", name,
                      symbol_text(ev->symbols, clip->def), copy->name);
        return false;
    }
    *play = (Play){clip->ref, dag_const(ev->dag, 1)};
    return true;
}

// Returns how many; 0: reported, or asked for.
static uint32_t read_list(Eval *ev, const Object *copy, const Given *given, Play plays[MAX_CLIPS]) {
    const Value *value = &given->value;
    if (value_is_poison(value)) {
        return 0;
    }
    if (value_is(value, VALUE_CLIP)) {
        return read_play(ev, copy, given->where, value, 0, plays);
    }
    if (!value_is(value, VALUE_LIST) || value->list->each) {
        eval_error_at(ev, given->where, how_to, "clips is a list of clips, this is %s",
                      value_describe(ev->arena, value));
        return 0;
    }
    const List *list = value->list;
    if (list->n == 0 || list->n > MAX_CLIPS) {
        eval_error_at(ev, given->where, list->n ? NULL : how_to,
                      list->n ? "an instance plays at most %d clips, these are %u"
                              : "the list of clips is empty",
                      MAX_CLIPS, list->n);
        return 0;
    }
    for (uint32_t i = 0; i < list->n; i++) {
        if (!read_play(ev, copy, given->where, &list->items[i], i + 1, &plays[i])) {
            return 0;
        }
        if (list->length) {
            plays[i].is_there = op2(ev->dag, OP_LT, dag_const(ev->dag, i), *list->length);
        }
    }
    return list->n;
}

// ---- When each begins, and what is shown

// The def's time, `gone` seconds of the clip's own after `from`.
static Ref shown(Dag *dag, const Play *p, Ref from, Ref gone) {
    Ref span = span_of(dag, p);
    Ref along = op2(dag, OP_ADD, from, op2(dag, OP_MUL, p->of[CLIP_SPEED], gone));
    Ref held = functions_clamp(dag, along, dag_const(dag, 0), span);
    Ref again = op2(dag, OP_MOD, along, span);
    return op2(dag, OP_ADD, p->of[CLIP_BEGIN], choose(dag, p->of[CLIP_ONCE], held, again));
}

typedef struct {
    Ref start; // of the place's clock
    Ref from;  // how far into the clip before it is then
    Ref fade;  // seconds, at most until the next one begins
} Begin;

// At the nearest whole number of parts of the clip before, and never before that begins; is_first:
// the first is always there.
static Begin begin_after(Dag *dag, const Play *p, const Play *before, Ref started, bool is_first) {
    Ref zero = dag_const(dag, 0), span = span_of(dag, before);
    Ref at = is_first ? p->of[CLIP_AT] : op2(dag, OP_MAX, p->of[CLIP_AT], started);
    Ref gone = op2(dag, OP_MUL, before->of[CLIP_SPEED], op2(dag, OP_SUB, at, started));
    Ref part = op2(dag, OP_DIV, span, p->of[CLIP_PARTS]);
    Ref n = dag_op(dag, OP_ROUND, op2(dag, OP_DIV, gone, part), REF_NONE, REF_NONE);
    Ref moved = op2(dag, OP_DIV, op2(dag, OP_MUL, n, part), before->of[CLIP_SPEED]);
    Ref held = functions_clamp(dag, n, zero, p->of[CLIP_PARTS]);
    Ref whole =
        op2(dag, OP_MUL,
            choose(dag, before->of[CLIP_ONCE], held, op2(dag, OP_MOD, n, p->of[CLIP_PARTS])), part);
    Ref exact = choose(dag, before->of[CLIP_ONCE], functions_clamp(dag, gone, zero, span),
                       op2(dag, OP_MOD, gone, span));
    Ref has_parts = op2(dag, OP_AND, op2(dag, OP_LT, zero, p->of[CLIP_PARTS]),
                        op2(dag, OP_LT, zero, before->of[CLIP_SPEED]));
    return (Begin){choose(dag, has_parts, op2(dag, OP_ADD, started, moved), at),
                   choose(dag, has_parts, whole, exact), p->of[CLIP_FADE]};
}

static void begin_all(Dag *dag, const Play *plays, uint32_t n, Begin *begins) {
    begins[0] = (Begin){plays[0].of[CLIP_AT], dag_const(dag, 0), dag_const(dag, 0)};
    for (uint32_t k = 1; k < n; k++) {
        begins[k] = begin_after(dag, &plays[k], &plays[k - 1], begins[k - 1].start, k == 1);
    }
    for (uint32_t k = 1; k + 1 < n; k++) {
        Ref until = op2(dag, OP_SUB, begins[k + 1].start, begins[k].start);
        Ref cut = op2(dag, OP_MAX, dag_const(dag, 0), op2(dag, OP_MIN, begins[k].fade, until));
        begins[k].fade = choose(dag, plays[k + 1].is_there, cut, begins[k].fade);
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

bool place_play_clips(Eval *ev, Place *place, const Object *copy, const Given *given, Ref t) {
    Dag *dag = ev->dag;
    Play plays[MAX_CLIPS];
    Begin begins[MAX_CLIPS];
    uint32_t n = read_list(ev, copy, given, plays);
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
        Ref has_begun = op2(dag, OP_AND, plays[k].is_there, op2(dag, OP_LE, begins[k].start, t));
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

void place_nest_clips(Eval *ev, Place *place, Ref clock) {
    const Clips *outer = place->clips;
    Clips *clips = ARENA_NEW(ev->arena, Clips);
    *clips = *outer;
    clips->before = dag_substitute(ev->dag, clock, IN_T, outer->before);
    clips->fades = ARENA_ARRAY(ev->arena, outer->n, ClipFade);
    for (uint32_t k = 0; k < outer->n; k++) {
        clips->fades[k] = outer->fades[k];
        for (int when = 0; when < 2; when++) {
            Ref *time = &clips->fades[k].times[when];
            *time = dag_substitute(ev->dag, clock, IN_T, *time);
        }
    }
    place->clock = dag_substitute(ev->dag, clock, IN_T, place->clock);
    place->clips = clips;
}
