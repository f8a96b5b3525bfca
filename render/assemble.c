// SPDX-License-Identifier: Apache-2.0
// Bodies and forms from shapes: what is shared, what is merged, what is baked.
#include "render/assemble.h"

#include "render/prototypes.h"
#include "render/report.h"

#include <string.h>

// Where a shape says nothing.
static const double DEFAULT_TOLERANCE = 0.25;

enum {
    FEW = 64,     // spheres are bodies of their own; more are one
    MANY = 8,     // of one shape are a body by themselves
    CLASSES = 35, // of radii
    CLASS_BITS =
        6 // between the least and the most of a class: vertices are floats in a common frame
};

// A sphere of the world that is none of a set.
typedef struct {
    SphereOf of;
    double at[4]; // center and radius
} Standing;

typedef struct {
    Arena *arena;
    const Scene *scene;
    const RenderOptions *options;
    const Reporter *reporter;
    Assembly *out;
    // Meshes that stand still or move by clocks of their own, by what they are: a hash table of
    // indices into forms, plus 1.
    uint32_t *shared;
    size_t shared_size;
    Form *ball; // a sphere of radius 1; NULL: not made yet
    // The last smoothing of a mesh that deforms, which its instances share.
    const Shape *smoothed;
    Smoothing smoothing;
    // Single spheres that stand, by the size of their radius.
    Standing *standing[CLASSES];
    size_t n_standing[CLASSES], standing_capacity[CLASSES];
    MoverPart *baked_movers;
    BodyPart *baked;
    size_t n_baked, movers_capacity, baked_capacity;
} Work;

double film_first_seconds(const Scene *scene) {
    return instant_seconds((Instant){scene->film.first_frame - 1, 0}, scene->film.fps);
}

static Bounds rest_bounds(const Mesh *mesh) {
    Bounds b = bounds_empty();
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double *p = &mesh->position[3 * i];
        b = bounds_add(b, vec3(p[0], p[1], p[2]));
    }
    return b;
}

static Form *add_form(Work *w) {
    Assembly *out = w->out;
    out->forms =
        arena_grow(w->arena, out->forms, out->n_forms, &out->forms_capacity, sizeof *out->forms);
    Form *form = ARENA_NEW(w->arena, Form);
    form->home = w->arena;
    form->number = out->n_forms;
    out->forms[out->n_forms++] = form;
    return form;
}

static void add_body(Work *w, Body body) {
    Assembly *out = w->out;
    if (body.form) {
        out->bodies[out->n_bodies++] = body; // there is room for all
        return;
    }
    out->planes =
        arena_grow(w->arena, out->planes, out->n_planes, &out->planes_capacity, sizeof body);
    out->planes[out->n_planes++] = body;
}

static double tolerance_of(const Work *w, const Shape *shape) {
    if (w->options->tolerance > 0) {
        return w->options->tolerance;
    }
    return shape->tolerance > 0 ? shape->tolerance : DEFAULT_TOLERANCE;
}

static void prepare_views(Work *w, Sampler *s, const FormUser *user, bool is_in_world) {
    const Shape *shape = user->shape;
    SampleView *views = ARENA_ARRAY(w->arena, user->n, SampleView);
    for (uint32_t i = 0; i < user->n; i++) {
        const double *loops = shape_loops(shape, user_instance(user, i));
        views[i] = (SampleView){shape, shape->transform, loops};
    }
    if (is_in_world) {
        views[0].transform = NULL;
    }
    s->views = views;
    s->n_views = is_in_world ? 1 : user->n;
}

static void add_user(Work *w, Form *form, const FormUser *user) {
    form->users = arena_grow(w->arena, form->users, form->n_users, &form->users_capacity,
                             sizeof *form->users);
    form->users[form->n_users++] = *user;
}

// The parts of a sampler that do not depend on the kind of shape. user: who stands in the form.
static void prepare(Work *w, Form *form, const FormUser *user, bool is_in_world) {
    Sampler *s = &form->sampler;
    const Shape *shape = user->shape;
    form->shape = shape;
    form->moves = mover_moves(&s->all);
    s->scene = w->scene;
    s->tolerance = tolerance_of(w, shape);
    s->samples = shape->samples;
    if (!form->moves) {
        return;
    }
    s->probe = sample_choose(w->arena, &s->all, film_first_seconds(w->scene));
    form->report.evaluations += s->probe.n < s->all.n ? s->all.n : 0;
    if (shape->clock) {
        add_user(w, form, user);
    } else {
        prepare_views(w, s, user, is_in_world);
    }
    if (shape->breaks) {
        SampleBreaks *breaks = ARENA_NEW(w->arena, SampleBreaks);
        *breaks = (SampleBreaks){shape, shape_loops(shape, user_instance(user, 0))};
        s->breaks = breaks;
        s->n_breaks = 1;
    }
}

static Mover mover_of(Work *w, MoverPart part, uint32_t width) {
    Mover mover = {ARENA_NEW(w->arena, MoverPart), 1, width, part.n};
    mover.parts[0] = part;
    return mover;
}

static bool deforms(const Shape *shape) {
    return shape->vertex || shape->track;
}

static Smoothing smoothing_of(Work *w, const Shape *shape) {
    if (w->smoothed != shape) {
        w->smoothed = shape;
        w->smoothing = smoothing_new(w->arena, shape->mesh, shape->smooth, deforms(shape));
    }
    return w->smoothing;
}

static Form *mesh_form(Work *w, const FormUser *user) {
    const Shape *shape = user->shape;
    Form *form = add_form(w);
    form->kind = GEOMETRY_TRIANGLES;
    form->n_prims = shape->mesh->n_triangles;
    form->index = shape->mesh->index;
    form->smoothing = smoothing_of(w, shape);
    form->sampler.all = mover_of(w, mover_mesh(w->arena, shape, user_instance(user, 0)), 3);
    Bounds rest = rest_bounds(shape->mesh);
    form->sampler.frame = frame_from_box(rest.lo, rest.hi);
    prepare(w, form, user, false);
    return form;
}

static size_t hash_pointer(const void *p, double smooth) {
    uint64_t bits;
    memcpy(&bits, &smooth, sizeof bits);
    return (size_t)((((uintptr_t)p >> 4) ^ bits) * 0x9e3779b97f4a7c15u >> 20);
}

static bool is_same_form(const Work *w, const Shape *a, const Shape *b) {
    bool is_alike = a->mesh == b->mesh && a->smooth == b->smooth && a->vertex == b->vertex &&
                    a->fade == b->fade && a->track == b->track;
    return is_alike && (!deforms(a) || (a->clock && b->clock && a->samples == b->samples &&
                                        tolerance_of(w, a) == tolerance_of(w, b)));
}

// The form of a mesh that keeps its rest pose, or whose instances have clocks: shared by all shapes
// that show the same one.
static Form *shared_form(Work *w, const FormUser *user) {
    const Shape *shape = user->shape;
    size_t i = hash_pointer(shape->mesh, shape->smooth) % w->shared_size;
    for (; w->shared[i]; i = (i + 1) % w->shared_size) {
        Form *form = w->out->forms[w->shared[i] - 1];
        if (is_same_form(w, form->shape, shape)) {
            if (shape->clock) {
                add_user(w, form, user);
            }
            return form;
        }
    }
    Form *form = mesh_form(w, user);
    w->shared[i] = w->out->n_forms;
    return form;
}

static MoverPart sphere_part(const Shape *shape, uint32_t instance) {
    MoverPart part = {.n = 1, .points = shape->geometry};
    mover_set_loops(&part.in, shape, instance);
    return part;
}

static Form *sphere_form(Work *w, const FormUser *user, MoverPart part, bool is_in_world) {
    Form *form = add_form(w);
    form->kind = GEOMETRY_SPHERES;
    form->n_prims = (uint32_t)part.n;
    form->sampler.all = mover_of(w, part, 4);
    Bounds rest = mover_bounds(&form->sampler.all, film_first_seconds(w->scene));
    form->sampler.frame = frame_from_box(rest.lo, rest.hi);
    prepare(w, form, user, is_in_world);
    return form;
}

// The one that all spheres share that do not change in their own block.
static Form *ball_form(Work *w, const Shape *shape) {
    static const double ball[4] = {0, 0, 0, 1};
    if (!w->ball) {
        w->ball = sphere_form(w, &(FormUser){.shape = shape, .n = 1},
                              (MoverPart){.n = 1, .rest = ball}, false);
    }
    return w->ball;
}

// All instances as one set of spheres in the world.
static void add_sphere_set(Work *w, const Shape *shape, uint32_t base) {
    uint32_t n, *instances = instances_seen(w->arena, shape, &n);
    MoverPart part = {.n = n, .points = shape->geometry, .transform = shape->transform};
    for (uint32_t k = 0; k < shape->n_loops; k++) {
        double *values = ARENA_ARRAY(w->arena, n, double);
        for (uint32_t i = 0; i < n; i++) {
            values[i] = shape->loops[(size_t)instances[i] * shape->n_loops + k];
        }
        part.in.at[IN_LOOP0 + k] = values;
        part.in.varying |= 1u << (IN_LOOP0 + k);
    }
    if (n > 0) {
        BodyOfMany *many = ARENA_NEW(w->arena, BodyOfMany);
        *many = (BodyOfMany){.instances = instances, .n = n, .base = base};
        add_body(w, (Body){.shape = shape,
                           .object = shape_object(shape, base, instances[0]),
                           .form = sphere_form(w, &(FormUser){.shape = shape, .n = 1}, part, true),
                           .many = many});
    }
}

static void add_instance(Work *w, const Shape *shape, uint32_t instance, uint32_t object,
                         Form *form) {
    Body body = {.shape = shape, .instance = instance, .object = object, .form = form};
    body.is_ball = form && form == w->ball;
    body.moves = program_reads_time(shape->transform) || program_reads_time(shape->visible) ||
                 (!form && program_reads_time(shape->geometry));
    if (body.moves || body_place(&body, NULL, 0).is_present) {
        add_body(w, body);
    }
}

static bool is_finite_sphere(const Shape *shape, uint32_t instance) {
    double s[4];
    sphere_at(shape, shape_loops(shape, instance), 0, s);
    return isfinite(s[0] + s[1] + s[2] + s[3]);
}

static Form *instance_form(Work *w, const FormUser *user) {
    const Shape *shape = user->shape;
    uint32_t first = user_instance(user, 0);
    if (shape->kind == SHAPE_PLANE) {
        return NULL;
    }
    if (shape->kind == SHAPE_SPHERE) {
        bool is_still = !program_reads_time(shape->geometry);
        return is_still && is_finite_sphere(shape, first)
                   ? ball_form(w, shape)
                   : sphere_form(w, user, sphere_part(shape, first), false);
    }
    bool is_own = program_reads_loops(shape->vertex) || program_reads_loops(shape->fade);
    bool is_shared = !deforms(shape) || (shape->clock && !is_own);
    return is_shared ? shared_form(w, user) : mesh_form(w, user);
}

// A sphere as a body of its own.
static void add_own(Work *w, const Shape *shape, uint32_t instance, uint32_t object) {
    uint32_t *which = ARENA_NEW(w->arena, uint32_t);
    *which = instance;
    add_instance(w, shape, instance, object, instance_form(w, &(FormUser){shape, 1, which, NULL}));
}

static uint32_t class_of(double radius) {
    int exponent;
    frexp(radius, &exponent);
    exponent = exponent < -100 ? -100 : exponent > 100 ? 100 : exponent;
    return (uint32_t)(exponent + 102) / CLASS_BITS;
}

// Where an instance stands in the world; false: nowhere, or it is something to report.
static bool standing_at(const Shape *shape, uint32_t instance, double at[4]) {
    double in[IN_COUNT];
    Affine map;
    shape_inputs(shape, shape_loops(shape, instance), 0, in);
    program_run1(shape->geometry, in, at);
    if (!affine_run(shape->transform, in, &map)) {
        return false;
    }
    Vec3 p = affine_point(&map, vec3(at[0], at[1], at[2]));
    at[0] = p.x;
    at[1] = p.y;
    at[2] = p.z;
    at[3] *= cbrt(fabs(affine_det(&map)));
    return vec3_is_finite(p) && isfinite(at[3]) && at[3] >= 0;
}

static void add_standing(Work *w, const Shape *shape, uint32_t instance, uint32_t object) {
    Standing standing = {{shape, instance, object}, {0}};
    if (!standing_at(shape, instance, standing.at)) {
        add_own(w, shape, instance, object);
        return;
    }
    uint32_t k = class_of(standing.at[3]);
    w->standing[k] = arena_grow(w->arena, w->standing[k], w->n_standing[k],
                                &w->standing_capacity[k], sizeof standing);
    w->standing[k][w->n_standing[k]++] = standing;
}

static void join_standing(Work *w, const Standing *standing, size_t n) {
    SphereOf *spheres = ARENA_ARRAY(w->arena, n, SphereOf);
    double *rest = ARENA_ARRAY(w->arena, 4 * n, double);
    for (size_t i = 0; i < n; i++) {
        spheres[i] = standing[i].of;
        memcpy(rest + 4 * i, standing[i].at, sizeof standing[i].at);
    }
    BodyOfMany *many = ARENA_NEW(w->arena, BodyOfMany);
    *many = (BodyOfMany){.spheres = spheres, .n = (uint32_t)n};
    Form *form = sphere_form(w, &(FormUser){.shape = spheres[0].shape, .n = 1},
                             (MoverPart){.n = n, .rest = rest}, true);
    add_body(w, (Body){.object = spheres[0].object, .form = form, .many = many});
}

static void add_all_standing(Work *w) {
    for (int k = 0; k < CLASSES; k++) {
        size_t n = w->n_standing[k];
        if (n > FEW) {
            join_standing(w, w->standing[k], n);
            continue;
        }
        for (size_t i = 0; i < n; i++) {
            const SphereOf *of = &w->standing[k][i].of;
            add_own(w, of->shape, of->instance, of->object);
        }
    }
}

// A blinking shape is not part of the common tree: it must come and go. Nor is one that some rays
// pass through, or that has a clock of its own.
static bool is_baked(const Work *w, const Shape *shape) {
    return shape->kind == SHAPE_MESH && (shape->bake || w->options->bake) &&
           !program_reads_time(shape->visible) && !shape_is_selective(shape) && !shape->clock;
}

static void bake_instance(Work *w, const Shape *shape, uint32_t instance, uint32_t object,
                          const Smoothing *smoothing) {
    MoverPart mover = mover_mesh(w->arena, shape, instance);
    mover.transform = shape->transform;
    BodyPart part = {shape, instance, object, 0, 0, *smoothing};
    w->baked_movers =
        arena_grow(w->arena, w->baked_movers, w->n_baked, &w->movers_capacity, sizeof mover);
    w->baked = arena_grow(w->arena, w->baked, w->n_baked, &w->baked_capacity, sizeof part);
    w->baked_movers[w->n_baked] = mover;
    w->baked[w->n_baked++] = part;
}

static void add_bodies(Work *w, const Shape *shape, uint32_t base, const uint32_t *which,
                       uint32_t n) {
    Prototypes prototypes = prototypes_of(w->arena, shape, which, n);
    Form **forms = ARENA_ARRAY(w->arena, prototypes.n, Form *);
    report_prototypes(w->reporter, shape, prototypes.n);
    for (uint32_t k = 0; k < prototypes.n; k++) {
        FormUser user = {.shape = shape, .n = n, .which = which};
        if (prototypes.of) {
            user.which = prototypes.members + prototypes.first[k];
            user.n = prototypes.first[k + 1] - prototypes.first[k];
        }
        forms[k] = instance_form(w, &user);
    }
    for (uint32_t i = 0; i < n; i++) {
        add_instance(w, shape, which[i], shape_object(shape, base, which[i]),
                     forms[prototypes.of ? prototypes.of[i] : 0]);
    }
}

static void add_instances(Work *w, const Shape *shape, uint32_t base) {
    uint32_t n;
    const uint32_t *which = instances_seen(w->arena, shape, &n);
    if (is_baked(w, shape)) {
        Smoothing smoothing = smoothing_new(w->arena, shape->mesh, shape->smooth, true);
        for (uint32_t i = 0; i < n; i++) {
            uint32_t object = shape_object(shape, base, which[i]);
            bake_instance(w, shape, which[i], object, &smoothing);
        }
    } else if (shape_stands(shape) && !program_reads_time(shape->geometry) &&
               !shape_is_selective(shape)) {
        for (uint32_t i = 0; i < n; i++) {
            add_standing(w, shape, which[i], shape_object(shape, base, which[i]));
        }
    } else {
        add_bodies(w, shape, base, which, n);
    }
}

static bool becomes_set(const Work *w, const Shape *shape) {
    return instance_set_suits(w->scene, shape) && !is_baked(w, shape);
}

static void add_set(Work *w, const Shape *shape, uint32_t base) {
    Assembly *out = w->out;
    Form *form = shared_form(w, &(FormUser){.shape = shape, .n = shape->n_instances});
    InstanceSet set = instance_set_new(w->arena, shape, form, base, w->options->n_threads);
    if (set.n > 0) {
        out->sets = arena_grow(w->arena, out->sets, out->n_sets, &out->sets_capacity, sizeof set);
        out->sets[out->n_sets++] = set;
        out->n_members += set.n;
    }
}

// Whether rays meet some of its instances and not others.
static bool differs_in_sight(const Shape *shape) {
    bool differs = false;
    for (int k = 0; k < RAY_KINDS; k++) {
        differs |= shape->seen[k] && program_reads_loops(shape->seen[k]);
    }
    return differs;
}

static void add_shape(Work *w, const Shape *shape, uint32_t base) {
    if (shape->kind == SHAPE_MESH) {
        report_degenerate(w->reporter, shape);
        if (shape->mesh->n_triangles == 0) {
            return;
        }
    }
    bool is_set = shape_stands(shape) && !differs_in_sight(shape) &&
                  (shape->n_instances >= MANY ||
                   (shape->n_instances > 1 && program_reads_time(shape->geometry)));
    if (is_set) {
        add_sphere_set(w, shape, base);
    } else if (becomes_set(w, shape)) {
        add_set(w, shape, base);
    } else {
        add_instances(w, shape, base);
    }
}

// The common faces of all baked parts, and which normals they share; faceted ones have none.
static void join_baked(Work *w, Form *form) {
    size_t n_prims = 0, n_vertices = 0, n_normals = 0, at = 0;
    for (size_t i = 0; i < w->n_baked; i++) {
        w->baked[i].first_prim = (uint32_t)n_prims;
        w->baked[i].first_vertex = (uint32_t)n_vertices;
        n_prims += w->baked[i].shape->mesh->n_triangles;
        n_vertices += w->baked[i].shape->mesh->n_vertices;
    }
    uint32_t *index = ARENA_ARRAY(w->arena, 3 * n_prims, uint32_t);
    uint32_t *normal_index = ARENA_ARRAY(w->arena, 3 * n_prims, uint32_t);
    for (size_t i = 0; i < w->n_baked; i++) {
        const BodyPart *part = &w->baked[i];
        for (size_t k = 0; k < 3 * (size_t)part->shape->mesh->n_triangles; k++, at++) {
            index[at] = part->first_vertex + part->shape->mesh->index[k];
            normal_index[at] = part->smoothing.index
                                   ? (uint32_t)n_normals + part->smoothing.index[k]
                                   : NORMAL_NONE;
        }
        n_normals += part->smoothing.n_normals;
    }
    form->n_prims = (uint32_t)n_prims;
    form->index = index;
    form->smoothing = (Smoothing){(uint32_t)n_normals, n_normals ? normal_index : NULL, NULL};
    form->sampler.all = (Mover){w->baked_movers, (uint32_t)w->n_baked, 3, n_vertices};
}

static void add_baked(Work *w) {
    if (w->n_baked == 0) {
        return;
    }
    Form *form = add_form(w);
    form->kind = GEOMETRY_TRIANGLES;
    join_baked(w, form);
    Sampler *s = &form->sampler;
    Bounds rest = mover_bounds(&s->all, film_first_seconds(w->scene));
    s->frame = frame_from_box(rest.lo, rest.hi);
    prepare(w, form, &(FormUser){.shape = w->baked[0].shape, .n = 1}, true);
    SampleBreaks *breaks = ARENA_ARRAY(w->arena, w->n_baked, SampleBreaks);
    s->n_breaks = 0;
    for (size_t i = 0; i < w->n_baked; i++) {
        const Shape *shape = w->baked[i].shape;
        bool is_first = i == 0 || w->baked[i - 1].shape != shape; // of those that are visible
        s->tolerance = fmin(s->tolerance, tolerance_of(w, shape));
        s->samples = shape->samples > s->samples ? shape->samples : s->samples;
        if (shape->breaks && (is_first || program_reads_loops(shape->breaks))) {
            breaks[s->n_breaks++] = (SampleBreaks){shape, shape_loops(shape, w->baked[i].instance)};
        }
    }
    s->breaks = breaks;
    BodyOfMany *many = ARENA_NEW(w->arena, BodyOfMany);
    *many = (BodyOfMany){.parts = w->baked, .n = (uint32_t)w->n_baked};
    add_body(w, (Body){.object = w->baked[0].object, .form = form, .many = many});
}

// Now that the sets stay where they are.
static void link_set(InstanceSet *set) {
    for (size_t u = 0; u < set->form->n_users; u++) {
        FormUser *user = &set->form->users[u];
        if (user->shape == set->shape) {
            user->set = set;
            user->n = set->n;
        }
    }
}

Assembly assemble(Arena *arena, const Scene *scene, const RenderOptions *options,
                  const Reporter *reporter) {
    Assembly out = {0};
    Work w = {
        .arena = arena, .scene = scene, .options = options, .reporter = reporter, .out = &out};
    w.shared_size = 2 * (size_t)scene->n_shapes + 1;
    w.shared = ARENA_ARRAY(arena, w.shared_size, uint32_t);
    size_t n_bodies = 1; // what is baked
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        const Shape *shape = &scene->shapes[i];
        n_bodies += becomes_set(&w, shape) ? 0 : shape->n_instances;
    }
    out.bodies = ARENA_ARRAY(arena, n_bodies, Body);
    for (uint32_t i = 0, base = 0; i < scene->n_shapes; i++) {
        const Shape *shape = &scene->shapes[i];
        base = shape->is_other_form ? base : out.n_objects;
        add_shape(&w, shape, base);
        out.n_objects += shape_n_objects(shape);
    }
    add_all_standing(&w);
    add_baked(&w);
    for (uint32_t i = 0, first = out.n_bodies; i < out.n_sets; i++) {
        out.sets[i].first = first;
        out.sets[i].first_group = out.n_bodies + out.n_groups;
        first += out.sets[i].n;
        out.n_groups += set_n_groups(&out.sets[i]);
        link_set(&out.sets[i]);
    }
    return out;
}

void assembly_destroy(Assembly *assembly) {
    for (uint32_t i = 0; i < assembly->n_forms; i++) {
        form_destroy(assembly->forms[i]);
    }
}

// The last set whose first body, or first group, is not behind this one.
static const InstanceSet *find_set(const Assembly *parts, uint32_t at, bool is_group) {
    uint32_t lo = 0, hi = parts->n_sets;
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        const InstanceSet *set = &parts->sets[mid];
        *((is_group ? set->first_group : set->first) <= at ? &lo : &hi) = mid;
    }
    return &parts->sets[lo];
}

const InstanceSet *assembly_set(const Assembly *parts, uint32_t body, uint32_t *member) {
    if (body < parts->n_bodies || body >= assembly_n_solid(parts)) {
        return NULL;
    }
    const InstanceSet *set = find_set(parts, body, false);
    *member = body - set->first;
    return set;
}

const InstanceSet *assembly_group(const Assembly *parts, uint32_t thing, uint32_t *first,
                                  uint32_t *last) {
    if (thing < parts->n_bodies) {
        return NULL;
    }
    const InstanceSet *set = find_set(parts, thing, true);
    *first = (thing - set->first_group) * SET_GROUP;
    *last = *first + SET_GROUP < set->n ? *first + SET_GROUP : set->n;
    return set;
}
