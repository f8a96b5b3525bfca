// SPDX-License-Identifier: Apache-2.0
// Lowering of what describes the picture: film, shutter, render.
#include "lang/lower_parts.h"
#include "render/shutter.h"

#include <math.h>
#include <string.h>

#include "lang/layers.h"

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
    double fps = lower_known(ev, film, PROPERTY_FILM_FPS);
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
    film->transparent = lower_known(ev, object, PROPERTY_FILM_TRANSPARENT) != 0;
    film->exposure = lower_known(ev, object, PROPERTY_FILM_EXPOSURE);
    film->layers = lower_layers(ev, object);
    // The words are in the order of the enumerations.
    film->filter = (FilterKind)word_of(ev, object, PROPERTY_FILM_FILTER);
    film->filter_width = lower_known(ev, object, PROPERTY_FILM_FILTER_WIDTH);
    film->view = (ViewKind)word_of(ev, object, PROPERTY_FILM_VIEW);
    film->half = lower_known(ev, object, PROPERTY_FILM_HALF) != 0;
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

void lowering_set_shutter(ShutterSettings *shutter, double fps, bool is_angle, double length,
                          double phase) {
    // A turn is 2 pi in doubles too, so 360deg is exactly a frame and 180deg half of one.
    shutter->length = is_angle ? length / 6.283185307179586 : length * fps;
    shutter->open = phase == 0 ? 0 : -phase * shutter->length;
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

// What a function of the shutter gives: a number that depends on these inputs alone. NULL:
// reported.
static const Program *function_program(Eval *ev, const Given *given, const char *const *names,
                                       const Input *inputs, uint32_t n) {
    Symbol symbols[2];
    Value values[2];
    uint32_t allowed = 0;
    const char *name = property_infos[given->id].name;
    for (uint32_t i = 0; i < n; i++) {
        symbols[i] = symbol_of(ev->symbols, names[i], strlen(names[i]));
        values[i] = value_scalar(VALUE_NUMBER, dag_input(ev->dag, inputs[i]));
        allowed |= 1u << inputs[i];
    }
    Value value =
        eval_apply(ev, given->value.closure, symbols, values, n, &given->env, given->node);
    if (value_is_poison(&value)) {
        return NULL;
    }
    Dimension wanted = property_infos[given->id].dimension;
    if (!value_is(&value, VALUE_NUMBER) || (value.dimension && value.dimension != wanted)) {
        eval_error_at(ev, given->name, NULL, "%s gives %s, this is %s", name,
                      wanted ? dimension_names[wanted] : "a number",
                      value_describe(ev->arena, &value));
        return NULL;
    }
    uint32_t read = dag_inputs(ev->dag, value.ref[0]) & ~allowed;
    if (read) {
        eval_error_at(ev, given->name, NULL, "%s can not depend on %s", name,
                      eval_input_name(read));
        return NULL;
    }
    return lower_program(ev, value.ref, 1);
}

static void report_curve(Eval *ev, const Given *given, const CurveReport *report) {
    switch (report->trouble) {
    case CURVE_NOT_FINITE:
        eval_error_at(ev, given->name, NULL, "curve is not a finite number at x = %.6g",
                      report->at);
        break;
    case CURVE_NEGATIVE:
        eval_error_at(ev, given->name, "light can not be taken back: max(..., 0) cuts it off",
                      "curve is at least 0, this is %.6g at x = %.6g", report->value, report->at);
        break;
    case CURVE_ZERO:
        eval_error_at(ev, given->name, "its values are weights, of any size",
                      "curve is 0 everywhere: no light would fall on the film");
        break;
    default:
        eval_error_at(ev, given->name, "make it smoother",
                      "curve changes too fast: %.2g of the light would come at a wrong instant",
                      report->value);
    }
}

// NULL: a box.
static const ShutterCurve *lower_curve(Eval *ev, const Object *object) {
    static const char *const names[] = {"x"};
    static const Input inputs[] = {IN_X};
    const Given *given = object_given(object, PROPERTY_SHUTTER_CURVE);
    const Program *program = NULL;
    if (given && value_is(&given->value, VALUE_STRING)) {
        if (strcmp(symbol_text(ev->symbols, given->value.symbol), "cosine") == 0) {
            Ref angle = dag_op(ev->dag, OP_MUL, dag_input(ev->dag, IN_X),
                               dag_const(ev->dag, 3.141592653589793), REF_NONE);
            Ref sine = dag_op(ev->dag, OP_SIN, angle, REF_NONE, REF_NONE);
            program = lower_program(ev, &sine, 1);
        }
    } else if (given && value_is(&given->value, VALUE_FUNCTION)) {
        program = function_program(ev, given, names, inputs, 1);
    }
    if (!program) {
        return NULL;
    }
    CurveReport report;
    const ShutterCurve *curve = shutter_curve_new(ev->lowering->arena, program, &report);
    if (!curve) {
        report_curve(ev, given, &report);
    }
    return curve;
}

static void lower_roll(Eval *ev, const Object *object, ShutterSettings *shutter) {
    static const char *const words[] = {"none", "down", "up", "left", "right"};
    Value roll = object_value(ev, object, PROPERTY_SHUTTER_ROLL);
    const char *word = value_is(&roll, VALUE_STRING) ? symbol_text(ev->symbols, roll.symbol) : "";
    for (int i = ROLL_NONE; i <= ROLL_RIGHT; i++) {
        shutter->roll = strcmp(word, words[i]) == 0 ? (RollKind)i : shutter->roll;
    }
    shutter->readout = lower_known(ev, object, PROPERTY_SHUTTER_READOUT) * ev->fps;
    const Given *given_roll = object_given(object, PROPERTY_SHUTTER_ROLL);
    const Given *readout = object_given(object, PROPERTY_SHUTTER_READOUT);
    if (readout && !given_roll) {
        eval_error_at(ev, readout->name, "write roll = down, up, left or right",
                      "readout is of a shutter that rolls, this one does not");
    } else if (shutter->roll != ROLL_NONE && !readout) {
        eval_error_at(ev, given_roll->name, "write readout = 10ms",
                      "a shutter that rolls needs 'readout'");
    }
}

static void lower_delay(Eval *ev, const Object *object, ShutterSettings *shutter) {
    static const char *const names[] = {"u", "v"};
    static const Input inputs[] = {IN_U, IN_V};
    const Given *given = object_given(object, PROPERTY_SHUTTER_DELAY);
    if (given && value_is(&given->value, VALUE_FUNCTION)) {
        shutter->delay = function_program(ev, given, names, inputs, 2);
        ev->lowering->delay = given->name;
    }
}

// Frames are counted in whole numbers; beyond this not even doubles tell them apart.
static bool is_too_long(const ShutterSettings *shutter) {
    return !(shutter->length <= SHUTTER_MOST_DELAY && fabs(shutter->open) <= SHUTTER_MOST_DELAY &&
             fabs(shutter->readout) <= SHUTTER_MOST_DELAY);
}

void lower_delays(Eval *ev) {
    const FilmSettings *film = &ev->lowering->scene->film;
    uint32_t x = 0, y = 0;
    if (is_too_long(&ev->lowering->scene->shutter)) {
        eval_error_at(ev, ev->lowering->shutter.where, "length = 10ms is a time, 10f ten frames",
                      "the shutter opens, closes or is read out more than 1e15 frames away");
    } else if (!shutter_find_delays(&ev->lowering->scene->shutter, film, &x, &y)) {
        eval_error_at(ev, ev->lowering->delay, NULL,
                      "delay is not finite, or more than 1e15 frames, at u = %.6g, v = %.6g",
                      (x + 0.5) / film->width, (y + 0.5) / film->height);
    }
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
    double x = lower_known(ev, object, length ? PROPERTY_SHUTTER_LENGTH : PROPERTY_SHUTTER_ANGLE);
    ShutterSettings *shutter = &l->scene->shutter;
    lowering_set_shutter(shutter, ev->fps, !length, x, l->phase);
    shutter->curve = lower_curve(ev, object);
    lower_roll(ev, object, shutter);
    lower_delay(ev, object, shutter);
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
    render->bounces = (uint32_t)lower_known(ev, object, PROPERTY_RENDER_BOUNCES);
    render->spp = is_given(object, PROPERTY_RENDER_SPP)
                      ? (uint32_t)lower_known(ev, object, PROPERTY_RENDER_SPP)
                      : 0;
    render->has_noise = is_given(object, PROPERTY_RENDER_NOISE);
    render->noise = render->has_noise ? lower_known(ev, object, PROPERTY_RENDER_NOISE) : 0;
    render->seconds =
        is_given(object, PROPERTY_RENDER_TIME) ? lower_known(ev, object, PROPERTY_RENDER_TIME) : 0;
    render->clamp = is_given(object, PROPERTY_RENDER_CLAMP)
                        ? lower_known(ev, object, PROPERTY_RENDER_CLAMP)
                        : 0;
    render->seed = (uint64_t)lower_known(ev, object, PROPERTY_RENDER_SEED);
    render->freeze = lower_known(ev, object, PROPERTY_RENDER_FREEZE) != 0;
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
