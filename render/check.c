// SPDX-License-Identifier: Apache-2.0
// How the motion of each shape was sampled: what `st4 check` says without tracing.
#include "render/local_time.h"
#include "render/report.h"
#include "render/survey.h"
#include "render/world_parts.h"

enum {
    VIEWS = 8, // instances of a shape whose speed is measured
    LOOKS = 5, // at how many instants of an opening
};

// Frame periods between neighbours of three instants.
static const double STEP = 1.0 / 256;

typedef struct {
    const Scene *scene;
    ShapeMotion *motions;  // [n_shapes]
    uint32_t *n_last_keys; // [n_shapes], in the block at hand
} Check;

// ---- Speed

typedef struct {
    const Scene *scene;
    const Shape *shape;
    const double *loops;
    Mover probe;
    double *at[3][4]; // at moments that follow each other
} Runner;

static Runner runner_new(Arena *arena, const Scene *scene, const Shape *shape, uint32_t instance) {
    Runner r = {.scene = scene, .shape = shape};
    r.loops = shape_loops(shape, instance);
    bool is_mesh = shape->kind == SHAPE_MESH;
    MoverPart *part = ARENA_NEW(arena, MoverPart);
    *part = is_mesh ? mover_mesh(arena, shape, instance)
                    : (MoverPart){.n = 1, .points = shape->geometry};
    mover_set_loops(&part->in, shape, instance);
    Mover all = {part, 1, is_mesh ? 3 : 4, part->n};
    r.probe = sample_choose(arena, &all, film_first_seconds(scene));
    for (uint32_t k = 0; k < 3 * all.width; k++) {
        r.at[k / all.width][k % all.width] = ARENA_ARRAY(arena, r.probe.n, double);
    }
    return r;
}

typedef struct {
    Camera camera;
    Affine map;
} Moment;

// False: it is not there.
static bool moment_at(const Runner *r, int which, Instant at, Moment *moment) {
    double in[IN_COUNT], seconds = instant_seconds(at, r->scene->film.fps);
    Arena scratch = {0};
    if (!shape_is_visible(r->shape, r->loops, seconds)) {
        return false;
    }
    mover_run(&r->probe, shape_seconds(r->shape, r->loops, seconds), &scratch, r->at[which]);
    arena_free(&scratch);
    moment->camera = camera_at(r->scene, seconds);
    shape_inputs(r->shape, r->loops, seconds, in);
    return affine_run(r->shape->transform, in, &moment->map);
}

// In the picture or nearer to it than its size: a point right beside the camera is anywhere.
static bool is_near_picture(const Camera *camera, double x, double y) {
    double w = camera->width, h = camera->height;
    return x >= -w && x <= 2 * w && y >= -h && y <= 2 * h;
}

// Pixels between two places of a point in the picture; 0 where the camera does not see them.
static double pixels_between(const Moment m[2], Vec3 a, Vec3 b) {
    double ax, ay, bx, by, scale;
    if (!m[0].camera.is_valid || !m[1].camera.is_valid ||
        !camera_project(&m[0].camera, a, &ax, &ay, &scale) ||
        !camera_project(&m[1].camera, b, &bx, &by, &scale) ||
        !is_near_picture(&m[0].camera, ax, ay) || !is_near_picture(&m[1].camera, bx, by)) {
        return 0;
    }
    double across = bx - ax;
    if (m[0].camera.kind == CAMERA_SPHERICAL) { // the short way around
        across -= m[0].camera.width * rint(across / m[0].camera.width);
    }
    return hypot(across, by - ay);
}

// The slower of two steps that follow each other: what jumps, a clock or a place that starts anew,
// does so in one of them.
static double point_speed(const Moment m[3], const Vec3 p[3]) {
    double first = pixels_between(m, p[0], p[1]), second = pixels_between(m + 1, p[1], p[2]);
    double pixels = fmin(first, second);
    return isfinite(first) && isfinite(second) ? pixels / STEP : 0;
}

static double speed_at(const Runner *r, Instant at) {
    Moment m[3];
    double most = 0;
    bool is_there = true;
    for (int k = 0; k < 3 && is_there; k++) {
        is_there = moment_at(r, k, instant_at(at.frame, at.frac + k * STEP), &m[k]);
    }
    for (size_t i = 0; i < r->probe.n && is_there; i++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = affine_point(&m[k].map, vec3(r->at[k][0][i], r->at[k][1][i], r->at[k][2][i]));
        }
        most = fmax(most, point_speed(m, p));
    }
    return most;
}

static void measure_speed(Check *check, uint32_t s, const World *world) {
    const Shape *shape = &check->scene->shapes[s];
    uint32_t n = shape->n_instances < VIEWS ? shape->n_instances : VIEWS;
    if (shape->kind == SHAPE_PLANE || (shape->kind == SHAPE_MESH && shape->mesh->n_vertices == 0)) {
        return;
    }
    ShapeMotion *motion = &check->motions[s];
    for (uint32_t i = 0; i < n; i++) {
        Arena arena = {0};
        uint32_t instance = (uint32_t)((uint64_t)i * shape->n_instances / n);
        Runner runner = runner_new(&arena, check->scene, shape, instance);
        for (size_t o = 0; o < world->n_openings; o++) {
            const Opening *open = &world->openings[o];
            for (int k = 0; k < LOOKS; k++) {
                double frac = open->lo + (open->hi - open->lo) * k / LOOKS;
                double speed = speed_at(&runner, instant_at(open->frame, frac));
                motion->pixels_per_frame = fmax(motion->pixels_per_frame, speed);
            }
        }
        arena_free(&arena);
    }
}

// ---- What was sampled

// Of a form that a shape stands in; bodies of a shape follow each other.
static void count_form(Check *check, const Shape *shape, const Form *form, const Shape **counted) {
    uint32_t s = (uint32_t)(shape - check->scene->shapes), n_keys = form->geometry.n_keys;
    ShapeMotion *motion = &check->motions[s];
    if (counted[form->number] == shape) {
        return;
    }
    counted[form->number] = shape;
    check->n_last_keys[s] = n_keys > check->n_last_keys[s] ? n_keys : check->n_last_keys[s];
    motion->error_pixels = fmax(motion->error_pixels, form->report.error);
    motion->bytes += form_array_bytes(form);
    motion->n_prototypes++;
}

static const Shape *shape_of_many(const BodyOfMany *many, uint32_t k) {
    return many->parts ? many->parts[k].shape : many->spheres[k].shape;
}

static void count_block(Check *check, const World *world) {
    Arena scratch = {0};
    const Assembly *parts = &world->parts;
    const Scene *scene = check->scene;
    const Shape **counted = ARENA_ARRAY(&scratch, parts->n_forms, const Shape *);
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        check->n_last_keys[s] = 0;
        check->motions[s].bytes = 0;
        check->motions[s].n_prototypes = 0;
    }
    for (uint32_t i = 0; i < parts->n_bodies; i++) {
        const Body *body = &parts->bodies[i];
        if (body->shape) {
            count_form(check, body->shape, body->form, counted);
        }
        for (uint32_t k = 0; body->many && !body->shape && k < body->many->n; k++) {
            count_form(check, shape_of_many(body->many, k), body->form, counted);
        }
    }
    for (uint32_t i = 0; i < parts->n_sets; i++) {
        count_form(check, parts->sets[i].shape, parts->sets[i].form, counted);
    }
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        uint32_t n = check->n_last_keys[s];
        check->motions[s].n_keys = n > 1 ? check->motions[s].n_keys + n : 1;
        measure_speed(check, s, world);
    }
    arena_free(&scratch);
}

static void add_totals(CheckTotals *totals, const World *world) {
    size_t array_bytes = 0, bytes = 0;
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        array_bytes += form_array_bytes(world->parts.forms[i]);
        bytes += form_bytes(world->parts.forms[i]);
    }
    totals->n_blocks++;
    totals->array_bytes = array_bytes > totals->array_bytes ? array_bytes : totals->array_bytes;
    totals->bytes = bytes > totals->bytes ? bytes : totals->bytes;
}

int render_check(const Scene *scene, const RenderOptions *options, const Reporter *reporter,
                 ShapeMotionSink *sink, void *context, CheckTotals *totals) {
    Arena arena = {0};
    Scene placed = *scene;
    world_place_camera(&arena, &placed);
    Check check = {&placed, ARENA_ARRAY(&arena, scene->n_shapes, ShapeMotion),
                   ARENA_ARRAY(&arena, scene->n_shapes, uint32_t)};
    bool is_fine = true;
    *totals = (CheckTotals){0};
    survey_scene(&placed, options, reporter);
    for (uint32_t first = 0, n = 0; first < options->n_frames && is_fine; first += n) {
        World *world = world_sample(&placed, options, options->frames + first,
                                    options->n_frames - first, reporter, &n);
        is_fine = world != NULL;
        if (is_fine) {
            count_block(&check, world);
            add_totals(totals, world);
        }
        world_destroy(world);
    }
    for (uint32_t s = 0; s < scene->n_shapes && is_fine; s++) {
        ShapeMotion *motion = &check.motions[s];
        motion->shape = &scene->shapes[s];
        motion->moves_as_body = program_reads_time(motion->shape->transform);
        sink(context, motion);
    }
    arena_free(&arena);
    return is_fine ? 0 : 1;
}
