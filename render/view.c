// SPDX-License-Identifier: Apache-2.0
// Rays in a world: one thread's view of it at one instant.
//
// The answer does not depend on the order in which bodies are asked: every body gets its own
// closest hit up to the best distance so far, rounded up, and distances are compared in double.
#include "render/local_time.h"
#include "render/world_parts.h"

#include <stdlib.h>
#include <string.h>

// Slots of a view; bodies beyond them share slots and are worked out again.
enum { MAX_SLOTS = 4096 };

WorldView *world_view_new(const World *world) {
    Arena arena = {0};
    WorldView *view = ARENA_NEW(&arena, WorldView);
    uint32_t n = 16;
    while (n < MAX_SLOTS && n < assembly_n_solid(&world->parts) + world->parts.n_planes) {
        n *= 2;
    }
    view->world = world;
    view->mask = n - 1;
    view->slots = ARENA_ARRAY(&arena, n, BodyView);
    view->arena = arena;
    view->memo = memo_new(&view->arena, n);
    world_view_time(view, (Instant){world->scene->film.first_frame - 1, 0});
    return view;
}

void world_view_destroy(WorldView *view, AccelCounters *add) {
    if (!view) {
        return;
    }
    if (add) {
        add->rays += view->count.rays;
        add->nodes += view->count.nodes;
        add->prim_tests += view->count.prim_tests;
    }
    Arena arena = view->arena;
    arena_free(&arena);
}

void world_view_time(WorldView *view, Instant at) {
    view->at = at;
    view->seconds = instant_seconds(at, view->world->fps);
    view->tick = tick_of(&view->world->ticks, at);
    view->stamp++;
}

// Which rays pass through it now.
static uint8_t unseen_by(const Body *body, double seconds) {
    const Shape *shape = body->shape;
    double in[IN_COUNT], seen;
    uint8_t unseen = shape->is_catcher ? 1 << RAY_SHADOW : 0;
    shape_inputs(shape, body_loops(body), seconds, in);
    for (int k = 0; k < RAY_KINDS; k++) {
        if (shape->seen[k]) {
            program_run1(shape->seen[k], in, &seen);
            unseen |= program_is_true(seen) ? 0 : 1 << k;
        }
    }
    return unseen;
}

// Which body it is, where it stands, and the instant of its own time.
static void look_up(WorldView *view, BodyView *slot, Instant *at) {
    const Assembly *parts = &view->world->parts;
    uint32_t member;
    const InstanceSet *set = assembly_set(parts, slot->id, &member);
    if (set) {
        slot->made = instance_body(set, member);
        slot->own = instance_place(set, member, view->seconds);
        slot->body = &slot->made;
        slot->place = &slot->own;
        *at = set->form->users ? instant_of_seconds(instance_seconds(set, member, view->seconds),
                                                    view->world->fps)
                               : view->at;
        return;
    }
    slot->body = slot->id < parts->n_bodies ? &parts->bodies[slot->id]
                                            : &parts->planes[slot->id - assembly_n_solid(parts)];
    slot->place = slot->body->fixed;
    bool has_clock = slot->body->form && slot->body->form->users;
    if (!slot->place) {
        slot->own = body_place(slot->body, view->memo, view->seconds);
        slot->place = &slot->own;
    }
    *at = view->at;
    if (has_clock) {
        double shown = body_seconds(slot->body, view->memo, view->seconds);
        *at = instant_of_seconds(shown, view->world->fps);
    }
}

bool plane_at(const Body *body, double seconds, Vec3 *normal, double *offset) {
    double in[IN_COUNT], out[4];
    shape_inputs(body->shape, body_loops(body), seconds, in);
    program_run1(body->shape->geometry, in, out);
    *normal = vec3_normalize(vec3(out[0], out[1], out[2]));
    *offset = out[3];
    return vec3_is_finite(*normal) && isfinite(*offset) && vec3_dot(*normal, *normal) > 0;
}

const BodyView *view_body(WorldView *view, uint32_t id) {
    BodyView *slot = &view->slots[id & view->mask];
    if (slot->stamp == view->stamp && slot->id == id) {
        return slot;
    }
    Instant at;
    slot->stamp = view->stamp;
    slot->id = id;
    look_up(view, slot, &at);
    slot->key = 0;
    slot->f = 0;
    const Body *body = slot->body;
    slot->unseen =
        body->shape && shape_is_selective(body->shape) ? unseen_by(body, view->seconds) : 0;
    if (body->form) {
        form_time(body->form, at, &slot->key, &slot->f);
    } else if (!plane_at(body, view->seconds, &slot->normal, &slot->offset)) {
        slot->normal = vec3(0, 0, 0);
    }
    return slot;
}

typedef struct {
    WorldView *view;
    Vec3 origin, dir;
    double tmin;
    RayKind kind;
    bool any; // the first hit will do
    bool is_hit;
    WorldHit hit;
} Query;

// The next float but one, of those that are not infinite.
static float later(float x) {
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    // Numbers in the order of floats: -0 and 0 are one.
    int32_t order = bits < 0 ? INT32_MIN - bits : bits;
    order += 2;
    bits = order < 0 ? INT32_MIN - order : order;
    memcpy(&x, &bits, sizeof x);
    return x;
}

// The ray in the frame of a body's form; false: the body is absent or the ray is nothing.
static bool enter(const Query *q, const BodyView *at, double tmax, AccelRay *ray,
                  FrameDistance *distance) {
    const Body *body = at->body;
    if (!at->place->is_present || (at->unseen >> q->kind & 1)) {
        return false;
    }
    Vec3 origin = q->origin, dir = q->dir;
    if (!body->many) {
        origin = placement_point_back(at->place, origin);
        dir = affine_vector(&at->place->inverse, dir);
    }
    ray->key = at->key;
    ray->f = at->f;
    if (!frame_ray(&body->form->sampler.frame, origin, dir, q->tmin, tmax, ray, distance)) {
        return false;
    }
    // A hit at tmax itself must not be lost to its rounding, whatever was met before.
    ray->tmax = later(ray->tmax);
    return true;
}

// Whose primitive it is.
static void name_object(const Body *body, WorldHit *hit) {
    const BodyOfMany *many = body->many;
    hit->object = body->object;
    hit->prim = (int32_t)hit->at;
    if (!many) {
        return;
    }
    if (many->parts) {
        const BodyPart *part = body_part(many, hit->at);
        hit->object = part->object;
        hit->prim -= (int32_t)part->first_prim;
    } else {
        hit->object = many->spheres
                          ? many->spheres[hit->at].object
                          : shape_object(body->shape, many->base, many->instances[hit->at]);
        hit->prim = 0;
    }
}

// Keeps a hit if it is nearer, or as near and of a lower object.
static void keep(Query *q, WorldHit hit) {
    if (!q->is_hit || hit.t < q->hit.t || (hit.t == q->hit.t && hit.object < q->hit.object)) {
        q->hit = hit;
        q->is_hit = true;
    }
}

static void ask(Query *q, uint32_t id, double tmax) {
    const BodyView *at = view_body(q->view, id);
    const Body *body = at->body;
    AccelRay ray;
    FrameDistance distance;
    AccelHit hit;
    if (!enter(q, at, tmax, &ray, &distance)) {
        return;
    }
    const Accel *accel = builds_accel(q->view->world->builds, body->form, &ray);
    if (!accel) {
        return;
    }
    if (q->any) {
        q->is_hit |= accel->type->occluded(accel, &ray, &q->view->count);
        return;
    }
    if (!accel->type->closest(accel, &ray, &hit, &q->view->count)) {
        return;
    }
    WorldHit found = {.t = distance.base + hit.t * distance.unit,
                      .u = hit.u,
                      .v = hit.v,
                      .body = id,
                      .at = (uint32_t)hit.prim};
    name_object(body, &found);
    keep(q, found);
}

static double ask_before(Query *q, uint32_t id, double tmax) {
    double best = q->is_hit && q->hit.t < tmax ? q->hit.t : tmax;
    ask(q, id, best);
    if (q->is_hit) {
        return q->any ? -INFINITY : fmin(q->hit.t, tmax);
    }
    return tmax;
}

static double visit(void *context, uint32_t thing, const BoxRay *ray, double tmax) {
    Query *q = context;
    uint32_t first, last;
    const InstanceSet *set = assembly_group(&q->view->world->parts, thing, &first, &last);
    if (!set) {
        return ask_before(q, thing, tmax);
    }
    q->view->count.prim_tests += last - first;
    for (uint32_t k = first; k < last && tmax > -INFINITY; k++) {
        const float *box = set->boxes[k];
        BoxInterval in = box_clip(ray, box, box + 3, (BoxInterval){q->tmin, tmax});
        if (in.near <= in.far) {
            tmax = ask_before(q, set->first + k, tmax);
        }
    }
    return tmax;
}

static void ask_plane(Query *q, uint32_t id, double tmax) {
    const Assembly *parts = &q->view->world->parts;
    uint32_t plane = assembly_n_solid(parts) + id;
    const BodyView *at = view_body(q->view, plane);
    q->view->count.prim_tests++;
    if (!at->place->is_present || (at->unseen >> q->kind & 1)) {
        return;
    }
    Vec3 origin = placement_point_back(at->place, q->origin);
    Vec3 dir = affine_vector(&at->place->inverse, q->dir);
    double t = (at->offset - vec3_dot(origin, at->normal)) / vec3_dot(dir, at->normal);
    if (t > q->tmin && t <= tmax && isfinite(t)) {
        keep(q, (WorldHit){.t = t, .object = at->body->object, .body = plane});
    }
}

static void trace_bodies(Query *q, double tmax) {
    const World *world = q->view->world;
    if (world->top) {
        const double o[3] = {q->origin.x, q->origin.y, q->origin.z};
        const double d[3] = {q->dir.x, q->dir.y, q->dir.z};
        boxtree_trace(world->top, o, d, q->tmin, tmax, q->view->tick, visit, q, &q->view->count);
        return;
    }
    for (uint32_t i = 0; i < world->parts.n_bodies && !(q->any && q->is_hit); i++) {
        ask_before(q, i, tmax);
    }
}

static bool trace(Query *q, double tmax) {
    const Assembly *parts = &q->view->world->parts;
    uint64_t n_rays = q->view->count.rays + 1;
    for (uint32_t i = 0; i < parts->n_planes && !(q->any && q->is_hit); i++) {
        ask_plane(q, i, q->is_hit ? q->hit.t : tmax);
    }
    if (!(q->any && q->is_hit)) {
        trace_bodies(q, q->is_hit ? q->hit.t : tmax);
    }
    q->view->count.rays = n_rays; // one, however many structures it went through
    return q->is_hit;
}

bool world_closest_of(WorldView *view, RayKind kind, Vec3 origin, Vec3 dir, double tmin,
                      double tmax, WorldHit *hit) {
    Query q = {.view = view, .origin = origin, .dir = dir, .tmin = tmin, .kind = kind};
    if (trace(&q, tmax)) {
        *hit = q.hit;
    }
    return q.is_hit;
}

bool world_occluded_of(WorldView *view, RayKind kind, Vec3 origin, Vec3 dir, double tmin,
                       double tmax) {
    Query q = {.view = view, .origin = origin, .dir = dir, .tmin = tmin, .kind = kind, .any = true};
    return trace(&q, tmax);
}

bool world_closest(WorldView *view, Vec3 origin, Vec3 dir, double tmin, double tmax,
                   WorldHit *hit) {
    return world_closest_of(view, RAY_ANY, origin, dir, tmin, tmax, hit);
}

bool world_occluded(WorldView *view, Vec3 origin, Vec3 dir, double tmin, double tmax) {
    return world_occluded_of(view, RAY_ANY, origin, dir, tmin, tmax);
}
