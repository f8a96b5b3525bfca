// SPDX-License-Identifier: Apache-2.0
// Lowering: programs and materials made once, loops laid out, the scene put together.
#include "lang/lower_parts.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

Lowering *lowering_new(Arena *arena, Arena *scratch) {
    Lowering *l = ARENA_NEW(scratch, Lowering);
    l->arena = arena;
    l->scratch = scratch;
    l->scene = ARENA_NEW(arena, Scene);
    return l;
}

LoweringMark lowering_mark(const Lowering *l) {
    return (LoweringMark){l->n_shapes, l->n_lights};
}

void lowering_rewind(Lowering *l, LoweringMark mark) {
    l->n_shapes = mark.n_shapes;
    l->n_lights = mark.n_lights;
}

uint32_t lowering_n_objects(Lowering *l, uint32_t shape) {
    for (; l->n_counted < shape; l->n_counted++) {
        l->n_objects += shape_n_objects(&l->shapes[l->n_counted]);
    }
    return l->n_objects;
}

LoweredOrder lowering_order(Lowering *l, uint32_t index) {
    Shape *shape = &l->shapes[index];
    if (shape->is_other_form) {
        shape->objects = shape[-1].objects;
        return (LoweredOrder){NULL, 0};
    }
    uint32_t *object = ARENA_ARRAY(l->arena, shape->n_instances, uint32_t);
    shape->objects = object;
    return (LoweredOrder){object, shape->n_instances};
}

Arena *lower_arena(Eval *ev) {
    return ev->lowering->arena;
}

Shape *lower_new_shape(Eval *ev) {
    Lowering *l = ev->lowering;
    l->shapes =
        arena_grow(l->scratch, l->shapes, l->n_shapes, &l->shapes_capacity, sizeof *l->shapes);
    l->shapes[l->n_shapes] = (Shape){0};
    return &l->shapes[l->n_shapes++];
}

void lower_hash_mesh(Eval *ev, const Mesh *mesh) {
    Hash128 *hash = &ev->lowering->mesh_hash;
    hash_add(hash, mesh->position, (size_t)mesh->n_vertices * 3 * sizeof *mesh->position);
    hash_add(hash, mesh->index, (size_t)mesh->n_triangles * 3 * sizeof *mesh->index);
    if (mesh->normal) {
        hash_add(hash, mesh->normal, (size_t)mesh->n_vertices * 3 * sizeof *mesh->normal);
    }
    if (mesh->uv) {
        hash_add(hash, mesh->uv, (size_t)mesh->n_vertices * 2 * sizeof *mesh->uv);
    }
}

// ---- Programs

static uint64_t hash_refs(const Ref *refs, uint32_t n) {
    uint64_t hash = 0x9e3779b97f4a7c15 ^ n;
    for (uint32_t i = 0; i < n; i++) {
        hash = (hash ^ refs[i]) * 0xff51afd7ed558ccd;
        hash ^= hash >> 32;
    }
    return hash;
}

static CachedProgram *program_slot(Lowering *l, uint64_t hash, const Ref *refs, uint32_t n) {
    size_t slot = hash & (l->n_program_slots - 1);
    for (;; slot = (slot + 1) & (l->n_program_slots - 1)) {
        CachedProgram *cached = &l->programs[slot];
        bool is_same = cached->refs && cached->hash == hash && cached->n == n &&
                       memcmp(cached->refs, refs, n * sizeof *refs) == 0;
        if (!cached->refs || is_same) {
            return cached;
        }
    }
}

static void grow_programs(Lowering *l) {
    CachedProgram *old = l->programs;
    size_t n = l->n_program_slots;
    l->n_program_slots = n ? 2 * n : 64;
    l->programs = ARENA_ARRAY(l->scratch, l->n_program_slots, CachedProgram);
    for (size_t i = 0; i < n; i++) {
        if (old[i].refs) {
            *program_slot(l, old[i].hash, old[i].refs, old[i].n) = old[i];
        }
    }
}

static CachedProgram *find_program(Lowering *l, const Ref *refs, uint32_t n) {
    if (2 * l->n_programs >= l->n_program_slots) {
        grow_programs(l);
    }
    uint64_t hash = hash_refs(refs, n);
    CachedProgram *slot = program_slot(l, hash, refs, n);
    if (!slot->refs) {
        Ref *copy = ARENA_ARRAY(l->scratch, n ? n : 1, Ref);
        memcpy(copy, refs, n * sizeof *refs);
        *slot = (CachedProgram){.hash = hash, .n = n, .refs = copy};
        l->n_programs++;
    }
    return slot;
}

const Program *lower_program(Eval *ev, const Ref *refs, uint32_t n) {
    CachedProgram *slot = find_program(ev->lowering, refs, n);
    if (!slot->program) {
        slot->program = dag_compile(ev->dag, ev->lowering->arena, refs, n);
    }
    return slot->program;
}

static const Program *compile_breaks(Eval *ev, const Ref *refs, uint32_t n) {
    Ref few[16], *breaks = few;
    uint32_t n_breaks = dag_breaks(ev->dag, refs, n, few, 16);
    if (n_breaks > 16) {
        breaks = ARENA_ARRAY(ev->arena, n_breaks, Ref);
        dag_breaks(ev->dag, refs, n, breaks, n_breaks);
    }
    return n_breaks ? lower_program(ev, breaks, n_breaks) : NULL;
}

const Program *lower_breaks(Eval *ev, const Ref *refs, uint32_t n) {
    uint32_t inputs = 0;
    for (uint32_t i = 0; i < n; i++) {
        inputs |= dag_inputs(ev->dag, refs[i]);
    }
    if (!(inputs & (1u << IN_T | 1u << IN_FILM_T))) {
        return NULL;
    }
    CachedProgram *slot = find_program(ev->lowering, refs, n);
    if (!slot->knows_breaks) {
        const Program *breaks = compile_breaks(ev, refs, n); // makes programs, which moves slots
        slot = find_program(ev->lowering, refs, n);
        slot->breaks = breaks;
        slot->knows_breaks = true;
    }
    return slot->breaks;
}

// ---- Materials

static bool same_material(const MaterialValue *a, const MaterialValue *b) {
    return a == b || (a->kind == b->kind && a->n == b->n &&
                      memcmp(a->ref, b->ref, a->n * sizeof *a->ref) == 0 &&
                      (a->kind != MATERIAL_MIX || (same_material(a->parts[0], b->parts[0]) &&
                                                   same_material(a->parts[1], b->parts[1]))));
}

static uint64_t hash_material(const MaterialValue *material) {
    uint64_t hash =
        hash_refs(material->ref, material->n) + (uint64_t)material->kind * 0x9e3779b97f4a7c15;
    for (int k = 0; k < 2 && material->kind == MATERIAL_MIX; k++) {
        hash = (hash ^ hash_material(material->parts[k])) * 0xff51afd7ed558ccd;
    }
    return hash;
}

static uint32_t *material_slot(Lowering *l, const MaterialValue *material) {
    size_t slot = hash_material(material) & (l->n_material_slots - 1);
    while (l->material_slots[slot] &&
           !same_material(l->material_values[l->material_slots[slot] - 1], material)) {
        slot = (slot + 1) & (l->n_material_slots - 1);
    }
    return &l->material_slots[slot];
}

static void grow_materials(Lowering *l) {
    l->n_material_slots = l->n_material_slots ? 2 * l->n_material_slots : 64;
    l->material_slots = ARENA_ARRAY(l->scratch, l->n_material_slots, uint32_t);
    for (uint32_t i = 0; i < l->n_materials; i++) {
        *material_slot(l, l->material_values[i]) = i + 1;
    }
}

// What was written: a name as it stands; of a call its beginning and the line.
static const char *material_label(Eval *ev, const Given *given) {
    Span where = given ? syntax_span(given->env.module->syntax, given->node) : (Span){0, 0};
    const SourceFile *file = source_of(ev->sources, where.lo);
    if (!file) {
        return "default";
    }
    const char *text = file->text + (where.lo - file->base);
    int size = (int)(where.hi - where.lo), n = 0;
    while (n < size && (isalnum((unsigned char)text[n]) || text[n] == '_' || text[n] == '.')) {
        n++;
    }
    return n == size ? arena_string(ev->lowering->arena, text, (size_t)n)
           : n == 0  ? arena_printf(ev->lowering->arena, "material@%u",
                                    source_line(ev->sources, where.lo))
                     : arena_printf(ev->lowering->arena, "%.*s@%u", n, text,
                                    source_line(ev->sources, where.lo));
}

// White edges of metals are left out.
static const Program *lower_outputs(Eval *ev, const MaterialValue *material) {
    const Ref *own = material->ref + MATERIAL_OWN;
    uint32_t n = material->n - MATERIAL_OWN;
    if (material->kind == MATERIAL_METAL) {
        Ref one = dag_const(ev->dag, 1);
        n = own[4] == one && own[5] == one && own[6] == one ? 4 : 7;
    }
    return lower_program(ev, own, n);
}

// NULL where it is this number everywhere.
static const Program *lower_unless(Eval *ev, Ref ref, double number) {
    double x;
    return dag_is_const(ev->dag, ref, &x) && x == number ? NULL : lower_program(ev, &ref, 1);
}

// NULL: straight up.
static const Program *lower_normal(Eval *ev, const Ref *rgb) {
    Ref half = dag_const(ev->dag, 0.5), one = dag_const(ev->dag, 1);
    return rgb[0] == half && rgb[1] == half && rgb[2] == one ? NULL : lower_program(ev, rgb, 3);
}

// Colors that are known; those that change are looked at in render/survey.c.
static void warn_of_albedo(Eval *ev, const MaterialValue *material, SourceRef where) {
    const Ref *color = material->ref + MATERIAL_OWN;
    bool is_above = false;
    double x;
    for (int k = 0; k < 3 && material_reflects(material->kind); k++) {
        is_above |= dag_is_const(ev->dag, color[k], &x) && x > 1;
    }
    if (is_above) {
        diag_warn(ev->diag, WARN_ALBEDO_ABOVE_ONE, scene_span(where), NULL,
                  "this color is above 1: the surface sends back more light than falls on it");
    }
}

static uint32_t intern_material(Eval *ev, const MaterialValue *material, SourceRef where,
                                const char *label);

static Material make_material(Eval *ev, const MaterialValue *material, SourceRef where,
                              const char *label) {
    Material made = {.kind = material->kind, .where = where, .label = label};
    for (int k = 0; k < 2 && material->kind == MATERIAL_MIX; k++) {
        made.parts[k] = intern_material(ev, material->parts[k], where, label);
    }
    warn_of_albedo(ev, material, where);
    made.program = lower_outputs(ev, material);
    made.opacity = lower_unless(ev, material->ref[MATERIAL_OPACITY], 1);
    made.height = lower_unless(ev, material->ref[MATERIAL_BUMP], 0);
    made.normal = lower_normal(ev, material->ref + MATERIAL_NORMAL_X);
    return made;
}

static uint32_t intern_material(Eval *ev, const MaterialValue *material, SourceRef where,
                                const char *label) {
    Lowering *l = ev->lowering;
    uint32_t *known = l->n_material_slots ? material_slot(l, material) : NULL;
    if (known && *known) {
        return *known - 1;
    }
    Material made = make_material(ev, material, where, label); // its parts come first
    if (2 * (size_t)l->n_materials >= l->n_material_slots) {
        grow_materials(l);
    }
    l->materials =
        arena_grow(l->arena, l->materials, l->n_materials, &l->materials_capacity, sizeof made);
    l->material_values = arena_grow(l->scratch, l->material_values, l->n_materials,
                                    &l->values_capacity, sizeof *l->material_values);
    l->materials[l->n_materials] = made;
    l->material_values[l->n_materials] = material;
    *material_slot(l, material) = ++l->n_materials;
    return l->n_materials - 1;
}

uint32_t lower_material(Eval *ev, const MaterialValue *material, const Object *object,
                        const Given *given) {
    return intern_material(ev, material, scene_source_ref(given ? given->where : object->where),
                           material_label(ev, given));
}

// ---- Loops

void lower_loops(Eval *ev, Shape *shape) {
    Loops *loops = ev->loops;
    shape->n_instances = loops ? loops->n_instances : 1;
    shape->n_loops = loops ? loops->depth + 1 : 0;
    if (!loops) {
        return;
    }
    if (!loops->table) {
        size_t width = loops->depth + 1;
        loops->table = arena_array(ev->lowering->arena, loops->n_instances, width * sizeof(double));
        size_t every = 1; // instances between two values of a loop: the innermost changes fastest
        for (const Loops *loop = loops; loop; every *= loop->n_values, loop = loop->parent) {
            for (size_t i = 0; i < loops->n_instances; i++) {
                loops->table[i * width + loop->depth] = loop->values[i / every % loop->n_values];
            }
        }
    }
    shape->loops = loops->table;
}

// ---- Properties

bool lower_once(Eval *ev, Source *source, const Object *object) {
    if (source->module) {
        eval_error_at(ev, object->where, NULL, "a scene has one %s, this is a second",
                      object->name);
        diag_note(ev->diag, source->where, "the first is here");
        return false;
    }
    *source = (Source){object->where, object->env.module};
    return true;
}

bool lower_vec3(Eval *ev, const Object *object, PropertyId id, Ref3 *v) {
    Value value = object_value(ev, object, id);
    if (!value_is_vec3(&value)) {
        return false;
    }
    *v = value_ref3(&value);
    return true;
}

bool lower_scalar(Eval *ev, const Object *object, PropertyId id, Ref *ref) {
    Value value = object_value(ev, object, id);
    *ref = value.ref[0];
    return value.n == 1 && value_is_numeric(&value);
}

double lower_known(Eval *ev, const Object *object, PropertyId id) {
    Value value = object_value(ev, object, id);
    double x = 0;
    if (value.n >= 1 && value_is_numeric(&value)) {
        dag_is_const(ev->dag, value.ref[0], &x);
    }
    return x;
}

const Program *lower_visible(Eval *ev, const Place *place) {
    double x;
    bool is_always = dag_is_const(ev->dag, place->visible, &x) && x != 0;
    return is_always ? NULL : lower_program(ev, &place->visible, 1);
}

// ---- Sampled data

void lower_note_data(Eval *ev, const Given *given, double first, double last) {
    Lowering *l = ev->lowering;
    Span where = syntax_span(given->env.module->syntax, given->node);
    for (size_t i = 0; i < l->n_data; i++) {
        if (l->data[i].where.lo == where.lo) {
            return;
        }
    }
    l->data = arena_grow(l->scratch, l->data, l->n_data, &l->data_capacity, sizeof *l->data);
    l->data[l->n_data++] = (SampledData){where, property_infos[given->id].name, first, last};
}

// Up to a frame period is let pass: a shutter that opens before the first frame begins, a last
// sample that stands where the last frame begins.
static void check_data(Eval *ev) {
    const Lowering *l = ev->lowering;
    const FilmSettings *film = &l->scene->film;
    const ShutterSettings *shutter = &l->scene->shutter;
    double open = shutter->open + shutter->first_delay;
    double close = shutter->open + shutter->length + shutter->last_delay;
    double first = ((double)(film->first_frame - 1) + open) / film->fps;
    double last = ((double)(film->last_frame - 1) + close) / film->fps;
    for (size_t i = 0; i < l->n_data; i++) {
        const SampledData *data = &l->data[i];
        if (first < data->first - 1 / film->fps || last > data->last + 1 / film->fps) {
            diag_warn(ev->diag, WARN_READ_OUTSIDE, data->where,
                      "before its first and after its last sample it holds still",
                      "%s covers %.6gs to %.6gs, the film reads %.6gs to %.6gs", data->what,
                      data->first, data->last, first, last);
        }
    }
}

// ---- The door

// Cameras and lights stand alone: a loop around them is walked value by value.
static bool in_batch(Eval *ev) {
    if (ev->loops) {
        ev->unroll |= (2u << ev->loops->depth) - 1;
    }
    return ev->loops != NULL;
}

static void lower_at_film(Eval *ev, const Object *object, const Place *place, const char *label) {
    if (node_infos[object->kind].class == NODE_CLASS_SHAPE) {
        lower_shape(ev, object, place, label);
        return;
    }
    if (in_batch(ev)) {
        return;
    }
    switch (object->kind) {
    case OBJECT_FILM:
        lower_film(ev, object);
        break;
    case OBJECT_SHUTTER:
        lower_shutter(ev, object);
        break;
    case OBJECT_RENDER:
        lower_render(ev, object);
        break;
    case OBJECT_CAMERA:
        lower_camera(ev, object, place);
        break;
    case OBJECT_SUN:
        lower_sun(ev, object, place);
        break;
    case OBJECT_AREA:
        lower_area(ev, object, place);
        break;
    case OBJECT_LAMP:
        lower_lamp(ev, object, place);
        break;
    default:
        lower_sky(ev, object, place);
    }
}

void lower_object(Eval *ev, const Object *object, const Place *place, const char *label) {
    if (place->clock == REF_NONE) {
        lower_at_film(ev, object, place, label);
        return;
    }
    Place at = place_at_clock(ev, place);
    Object changed = object_at_clock(ev, place, object);
    lower_at_film(ev, &changed, &at, label);
}

void lowering_override(Eval *ev, const Overrides *overrides) {
    ev->lowering->overrides = *overrides;
    if (overrides->fps > 0) {
        ev->fps = overrides->fps;
    }
}

// ---- The end

// Materials of objects that a batched loop gave up are left out. Parts stand before their mixes.
static void keep_used_materials(Lowering *l) {
    uint32_t *index = ARENA_ARRAY(l->scratch, l->n_materials, uint32_t), n = 0;
    for (uint32_t i = 0; i < l->n_shapes; i++) {
        index[l->shapes[i].material] = 1;
    }
    for (uint32_t i = l->n_materials; i-- > 0;) {
        for (int k = 0; k < 2 && index[i] && l->materials[i].kind == MATERIAL_MIX; k++) {
            index[l->materials[i].parts[k]] = 1;
        }
    }
    for (uint32_t i = 0; i < l->n_materials; i++) {
        if (index[i]) {
            Material *material = &l->materials[n];
            *material = l->materials[i];
            for (int k = 0; k < 2 && material->kind == MATERIAL_MIX; k++) {
                material->parts[k] = index[material->parts[k]];
            }
            index[i] = n++;
        }
    }
    for (uint32_t i = 0; i < l->n_shapes; i++) {
        l->shapes[i].material = index[l->shapes[i].material];
    }
    l->n_materials = n;
}

static void add_defaults(Eval *ev) {
    Lowering *l = ev->lowering;
    Place place = place_outermost(ev);
    Object object = {.is_identity = true};
    if (!l->shutter.module) {
        object.kind = OBJECT_SHUTTER;
        lower_shutter(ev, &object);
    }
    if (!l->render.module) {
        object.kind = OBJECT_RENDER;
        lower_render(ev, &object);
    }
    if (l->n_lights == 0) {
        object.kind = OBJECT_SKY;
        lower_sky(ev, &object, &place);
    }
    l->scene->camera.automatic = !l->camera.module;
}

static void apply_overrides(Lowering *l) {
    const Overrides *o = &l->overrides;
    FilmSettings *film = &l->scene->film;
    if (o->width) {
        film->width = o->width;
        film->height = o->height;
    }
    if (o->has_frames) {
        film->first_frame = o->first_frame;
        film->last_frame = o->last_frame;
    }
    if (o->has_shutter) {
        lowering_set_shutter(&l->scene->shutter, film->fps, o->shutter_is_angle, o->shutter,
                             l->phase);
    }
}

Scene *lowering_finish(Eval *ev, const Hash128 *sources) {
    Lowering *l = ev->lowering;
    Scene *scene = l->scene;
    add_defaults(ev);
    apply_overrides(l);
    lower_delays(ev);
    check_data(ev);
    keep_used_materials(l);
    if (l->n_shapes == 0) {
        diag_warn(ev->diag, WARN_EMPTY, (Span){0, 0}, "sphere { } is one",
                  "the scene has no shapes");
    }
    Shape *shapes = ARENA_ARRAY(l->arena, l->n_shapes, Shape);
    if (l->n_shapes) {
        memcpy(shapes, l->shapes, l->n_shapes * sizeof *shapes);
    }
    scene->shapes = shapes;
    scene->n_shapes = l->n_shapes;
    scene->lights = l->lights;
    scene->n_lights = l->n_lights;
    scene->materials = l->materials;
    scene->n_materials = l->n_materials;
    Hash128 hash = *sources;
    hash_add(&hash, &l->mesh_hash, sizeof l->mesh_hash);
    hash_text(&hash, scene->hash);
    return scene;
}
