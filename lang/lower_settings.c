// SPDX-License-Identifier: Apache-2.0
// Lowering of what describes the picture: film, shutter, render.
#include "lang/lower_parts.h"

#include <math.h>
#include <string.h>

#include "lang/layers.h"

static double known(Eval *ev, const Object *object, PropertyId id) {
    Value value = object_value(ev, object, id);
    double x = 0;
    if (value.n >= 1 && value_is_numeric(&value)) {
        dag_is_const(ev->dag, value.ref[0], &x);
    }
    return x;
}

static bool is_given(const Object *object, PropertyId id) {
    const Given *given = object_given(object, id);
    return given && !value_is_poison(&given->value);
}

void lower_misplaced_film(Eval *ev, const Object *film) {
    const Source *first = &ev->lowering->film;
    if (first->module) {
        eval_error_at(ev, film->where, NULL, "a scene has one film, this is a second");
        diag_note(ev->diag, first->where, "the first is here");
    } else {
        eval_error_at(ev, film->where, "give a property by a condition: fps = fast ? 60 : 24",
                      "film stands outermost, in no for or if");
    }
}

bool lowered_film(Eval *ev, const Module *module, NodeId statement) {
    const Source *film = &ev->lowering->film;
    return film->module == module && film->where.lo == syntax_node(module->syntax, statement)->lo;
}

void lower_fps(Eval *ev, const Object *film) {
    double fps = known(ev, film, PROPERTY_FILM_FPS);
    double override = ev->lowering->overrides.fps;
    ev->fps = override > 0 ? override : fps > 0 ? fps : 24;
}

static bool path_is_safe(const char *path) {
    if (*path == '/' || !*path) {
        return false;
    }
    for (const char *at = path; (at = strstr(at, "..")); at += 2) {
        bool begins = at == path || at[-1] == '/', ends = at[2] == '\0' || at[2] == '/';
        if (begins && ends) {
            return false;
        }
    }
    return true;
}

static void lower_film_size(Eval *ev, const Object *object, FilmSettings *film) {
    Value size = object_value(ev, object, PROPERTY_FILM_SIZE);
    double wh[2] = {640, 480};
    for (int i = 0; i < 2 && value_is(&size, VALUE_VEC); i++) {
        dag_is_const(ev->dag, size.ref[i], &wh[i]);
        if (wh[i] != floor(wh[i])) {
            eval_error_at(ev, object_given(object, PROPERTY_FILM_SIZE)->where, NULL,
                          "size is in whole pixels");
            return;
        }
    }
    film->width = (uint32_t)wh[0];
    film->height = (uint32_t)wh[1];
}

static void lower_frames(Eval *ev, const Object *object, FilmSettings *film) {
    Value frames = object_value(ev, object, PROPERTY_FILM_FRAMES);
    double low = 1, high = 1;
    if (value_is(&frames, VALUE_RANGE)) {
        dag_is_const(ev->dag, frames.range->low, &low);
        dag_is_const(ev->dag, frames.range->high, &high);
        if (low != floor(low) || high != floor(high) || frames.range->step != REF_NONE ||
            frames.range->is_angle) {
            eval_error_at(ev, object_given(object, PROPERTY_FILM_FRAMES)->where, "write 1..48",
                          "frames go from a whole number to another, one by one");
        }
    }
    film->first_frame = (int64_t)low;
    film->last_frame = (int64_t)high;
}

static void refuse_layer(Eval *ev, const Given *aov, const char *name) {
    const char *near = diag_nearest(name, layer_names, LAYER_COUNT);
    eval_error(ev, &aov->env, aov->node,
               near ? arena_printf(ev->arena, "did you mean \"%s\"?", near)
                    : arena_printf(ev->arena, "they are%s", layer_words),
               "there is no layer \"%s\"", name);
}

static uint32_t lower_layers(Eval *ev, const Object *object) {
    const Given *aov = object_given(object, PROPERTY_FILM_AOV);
    if (!aov || !value_is(&aov->value, VALUE_LIST)) {
        return LAYERS_DEFAULT;
    }
    uint32_t layers = 0;
    for (uint32_t i = 0; i < aov->value.list->n; i++) {
        const Value *item = &aov->value.list->items[i];
        if (!value_is(item, VALUE_STRING)) {
            if (!value_is_poison(item)) {
                eval_error(ev, &aov->env, aov->node, "write [\"z\", \"motion\"]",
                           "aov lists names of layers");
            }
            return layers;
        }
        const char *name = symbol_text(ev->symbols, item->symbol);
        Layer layer;
        if (layer_find(name, strlen(name), &layer)) {
            layers |= 1u << layer;
        } else {
            refuse_layer(ev, aov, name);
        }
    }
    return layers;
}

// Which of the property's words it is.
static int word_of(Eval *ev, const Object *object, PropertyId id) {
    Value value = object_value(ev, object, id);
    if (!value_is(&value, VALUE_STRING)) {
        return 0;
    }
    const char *word = symbol_text(ev->symbols, value.symbol);
    const char *at = property_infos[id].names;
    for (int i = 0;; i++) {
        size_t size = strcspn(at, " ");
        if (size == strlen(word) && memcmp(at, word, size) == 0) {
            return i;
        }
        if (!at[size]) {
            return 0;
        }
        at += size + 1;
    }
}

void lower_film(Eval *ev, const Object *object) {
    Lowering *l = ev->lowering;
    if (!lower_once(ev, &l->film, object)) {
        return;
    }
    FilmSettings *film = &l->scene->film;
    lower_film_size(ev, object, film);
    lower_frames(ev, object, film);
    film->fps = ev->fps;
    film->transparent = known(ev, object, PROPERTY_FILM_TRANSPARENT) != 0;
    film->exposure = known(ev, object, PROPERTY_FILM_EXPOSURE);
    film->layers = lower_layers(ev, object);
    // The words are in the order of the enumerations.
    film->filter = (FilterKind)word_of(ev, object, PROPERTY_FILM_FILTER);
    film->filter_width = known(ev, object, PROPERTY_FILM_FILTER_WIDTH);
    film->view = (ViewKind)word_of(ev, object, PROPERTY_FILM_VIEW);
    film->half = known(ev, object, PROPERTY_FILM_HALF) != 0;
    film->compression = (Compression)word_of(ev, object, PROPERTY_FILM_COMPRESSION);
    const Given *out = object_given(object, PROPERTY_FILM_OUT);
    if (out && value_is(&out->value, VALUE_STRING)) {
        const char *path = symbol_text(ev->symbols, out->value.symbol);
        if (!path_is_safe(path)) {
            eval_error_at(ev, out->where, "write -o PATH on the command line",
                          "out is a relative path without '..'");
        }
        film->out = arena_string(l->arena, path, strlen(path));
    }
}

ShutterSettings lowering_shutter(double fps, bool is_angle, double length, double phase) {
    // A turn is 2 pi in doubles too, so 360deg is exactly a frame and 180deg half of one.
    double frames = is_angle ? length / 6.283185307179586 : length * fps;
    return (ShutterSettings){.length = frames, .open = phase == 0 ? 0 : -phase * frames};
}

static double lower_phase(Eval *ev, const Object *object) {
    Value phase = object_value(ev, object, PROPERTY_SHUTTER_PHASE);
    double x = 0.5;
    if (value_is(&phase, VALUE_STRING)) {
        const char *word = symbol_text(ev->symbols, phase.symbol);
        return strcmp(word, "start") == 0 ? 0 : strcmp(word, "end") == 0 ? 1 : 0.5;
    }
    if (value_is(&phase, VALUE_NUMBER)) {
        dag_is_const(ev->dag, phase.ref[0], &x);
    }
    return x;
}

void lower_shutter(Eval *ev, const Object *object) {
    Lowering *l = ev->lowering;
    if (!lower_once(ev, &l->shutter, object)) {
        return;
    }
    const Given *angle = object_given(object, PROPERTY_SHUTTER_ANGLE);
    const Given *length = object_given(object, PROPERTY_SHUTTER_LENGTH);
    if (angle && length) {
        eval_error_at(ev, length->name, NULL,
                      "the shutter has an angle and a length, one is enough");
        diag_note(ev->diag, angle->name, "the other is given here");
        return;
    }
    l->phase = lower_phase(ev, object);
    double x = known(ev, object, length ? PROPERTY_SHUTTER_LENGTH : PROPERTY_SHUTTER_ANGLE);
    l->scene->shutter = lowering_shutter(ev->fps, !length, x, l->phase);
    bool is_wrong = (angle && !is_given(object, PROPERTY_SHUTTER_ANGLE)) ||
                    (length && !is_given(object, PROPERTY_SHUTTER_LENGTH)); // reported
    if (x == 0 && !is_wrong && !l->overrides.has_shutter) {
        diag_warn(ev->diag, WARN_ZERO_SHUTTER, object->where, NULL,
                  "the shutter is open for no time: nothing will blur");
    }
}

void lower_render(Eval *ev, const Object *object) {
    Lowering *l = ev->lowering;
    if (!lower_once(ev, &l->render, object)) {
        return;
    }
    RenderSettings *render = &l->scene->render;
    render->bounces = (uint32_t)known(ev, object, PROPERTY_RENDER_BOUNCES);
    render->spp = is_given(object, PROPERTY_RENDER_SPP)
                      ? (uint32_t)known(ev, object, PROPERTY_RENDER_SPP)
                      : 0;
    render->seed = (uint64_t)known(ev, object, PROPERTY_RENDER_SEED);
    render->freeze = known(ev, object, PROPERTY_RENDER_FREEZE) != 0;
}

Value lower_film_member(Eval *ev, const Env *env, NodeId node, const char *member) {
    const FilmSettings *film = &ev->lowering->scene->film;
    Ref size[2] = {dag_const(ev->dag, film->width), dag_const(ev->dag, film->height)};
    if (!(ev->fps > 0) || film->width == 0) {
        return eval_error(ev, env, node, NULL, "the film can not be described by itself");
    }
    if (strcmp(member, "fps") == 0) {
        return value_number(ev->dag, ev->fps);
    }
    if (strcmp(member, "size") == 0) {
        return value_vec(VALUE_VEC, size, 2);
    }
    if (strcmp(member, "frames") == 0) {
        Range *range = ARENA_NEW(ev->arena, Range);
        *range = (Range){dag_const(ev->dag, (double)film->first_frame),
                         dag_const(ev->dag, (double)film->last_frame), REF_NONE, false};
        return (Value){.type = VALUE_RANGE, .range = range};
    }
    return eval_error(ev, env, node, "film.fps, film.size and film.frames can be read",
                      "film has nothing to read called '%s'", member);
}

void lowering_default_film(Eval *ev) {
    Object film = {.kind = OBJECT_FILM, .name = "film", .is_identity = true};
    lower_fps(ev, &film);
    lower_film(ev, &film);
    ev->lowering->film = (Source){{0, 0}, NULL};
}
