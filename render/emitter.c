// SPDX-License-Identifier: Apache-2.0
// Emitters: finding them, and drawing points of them.
#include "render/emitter.h"

#include "render/sampling.h"
#include "render/world_parts.h"

enum { NONE = UINT32_MAX };

// ---- Finding them

static const Shape *shape_of(const Body *body, uint32_t prim) {
    const BodyOfMany *many = body->many;
    return !many || many->instances ? body->shape
           : many->spheres          ? many->spheres[prim].shape
                                    : body_part(many, prim)->shape;
}

static uint32_t n_prims(const Body *body) {
    return body->form ? body->form->n_prims : 0;
}

static bool shape_glows(const Shape *shape, const bool *glows) {
    return glows[shape->material] && !shape->is_catcher;
}

// Whether any of a body's primitives may glow.
static bool body_glows(const Body *body, const bool *glows) {
    if (body->shape) {
        return shape_glows(body->shape, glows);
    }
    for (uint32_t i = 0; i < body->many->n; i++) {
        const Shape *shape =
            body->many->spheres ? body->many->spheres[i].shape : body->many->parts[i].shape;
        if (shape_glows(shape, glows)) {
            return true;
        }
    }
    return false;
}

EmitterSet emitters_find(Arena *arena, const World *world, const bool *glows) {
    const Assembly *parts = &world->parts;
    uint32_t *first = ARENA_ARRAY(arena, parts->n_bodies, uint32_t), n = 0;
    for (uint32_t b = 0; b < parts->n_bodies; b++) {
        const Body *body = &parts->bodies[b];
        first[b] = body_glows(body, glows) ? n : NONE;
        n += first[b] == NONE ? 0 : n_prims(body);
    }
    EmitterSet set = {.first = first, .n_bodies = parts->n_bodies};
    Emitter *list = ARENA_ARRAY(arena, n, Emitter);
    uint32_t *index = ARENA_ARRAY(arena, n, uint32_t);
    for (uint32_t b = 0; b < parts->n_bodies; b++) {
        const Body *body = &parts->bodies[b];
        for (uint32_t i = 0; first[b] != NONE && i < n_prims(body); i++) {
            bool is_one = shape_glows(shape_of(body, i), glows);
            index[first[b] + i] = is_one ? set.n : NONE;
            if (is_one) {
                list[set.n++] = (Emitter){b, i};
            }
        }
    }
    set.list = list;
    set.index = index;
    return set;
}

uint32_t emitter_of(const EmitterSet *set, const WorldHit *hit) {
    if (set->n == 0 || hit->body >= set->n_bodies || set->first[hit->body] == NONE) {
        return NONE;
    }
    return set->index[set->first[hit->body] + hit->at];
}

uint32_t emitter_material(const WorldView *view, const Emitter *emitter) {
    return shape_of(&view->world->parts.bodies[emitter->body], emitter->prim)->material;
}

// ---- Where they are at an instant

typedef struct {
    const Body *body;
    const BodyView *at;
    bool is_triangle;
    Vec3 corner[3]; // in the world
    Vec3 normal;    // unit
    double area;
    Vec3 center; // before the transform
    double radius;
    double scale; // of a similarity; 0: an ellipsoid
} Placed;

// The factor by which a similarity stretches, 0 where the map is none.
static double similarity(const Affine *a) {
    Vec3 c[3];
    for (int k = 0; k < 3; k++) {
        c[k] = vec3(a->m[0][k], a->m[1][k], a->m[2][k]);
    }
    double size = vec3_dot(c[0], c[0]), bound = 1e-9 * size;
    bool is_one = fabs(vec3_dot(c[1], c[1]) - size) <= bound &&
                  fabs(vec3_dot(c[2], c[2]) - size) <= bound &&
                  fabs(vec3_dot(c[0], c[1])) <= bound && fabs(vec3_dot(c[1], c[2])) <= bound &&
                  fabs(vec3_dot(c[2], c[0])) <= bound;
    return is_one ? sqrt(size) : 0;
}

// False: it is not there.
static bool place(WorldView *view, const Emitter *emitter, Placed *p) {
    p->body = &view->world->parts.bodies[emitter->body];
    p->at = view_body(view, emitter->body);
    if (!p->at->place->is_present || (p->at->unseen >> RAY_BOUNCE & 1)) {
        return false;
    }
    p->is_triangle = p->body->form->kind == GEOMETRY_TRIANGLES;
    if (p->is_triangle) {
        surface_corners(p->body, p->at, emitter->prim, p->corner);
        Vec3 n =
            vec3_cross(vec3_sub(p->corner[1], p->corner[0]), vec3_sub(p->corner[2], p->corner[0]));
        double length = vec3_length(n);
        p->area = 0.5 * length;
        p->normal = vec3_scale(n, 1 / length);
        return length > 0 && isfinite(length);
    }
    p->center = surface_center(p->body, p->at, emitter->prim, &p->radius);
    p->scale = similarity(&p->at->place->map);
    return p->radius > 0 && isfinite(p->radius) && vec3_is_finite(p->center);
}

static WorldHit hit_of(const Body *body, const Emitter *emitter, double u, double v, double t) {
    const BodyOfMany *many = body->many;
    WorldHit hit = {.t = t,
                    .object = body->object,
                    .prim = (int32_t)emitter->prim,
                    .u = (float)u,
                    .v = (float)v,
                    .body = emitter->body,
                    .at = emitter->prim};
    if (many && many->parts) {
        hit.prim -= (int32_t)body_part(many, emitter->prim)->first_prim;
    }
    return hit;
}

// ---- Triangles

static double triangle_density(const Placed *p, Vec3 dir, double distance) {
    double cosine = fabs(vec3_dot(p->normal, dir));
    return cosine > 0 ? distance * distance / (cosine * p->area) : 0;
}

static bool sample_triangle(const Placed *p, const Emitter *emitter, Vec3 from, double u, double v,
                            EmitterSample *sample) {
    double root = sqrt(u), b1 = (float)(root * (1 - v)), b2 = (float)(root * v);
    Vec3 at = vec3_madd(vec3_madd(vec3_scale(p->corner[0], 1 - b1 - b2), b1, p->corner[1]), b2,
                        p->corner[2]);
    Vec3 towards = vec3_sub(at, from);
    sample->distance = vec3_length(towards);
    sample->dir = vec3_scale(towards, 1 / sample->distance);
    sample->density = triangle_density(p, sample->dir, sample->distance);
    sample->hit = hit_of(p->body, emitter, b1, b2, sample->distance);
    return sample->distance > 0;
}

// ---- Spheres

// Seen from outside: 1 - cos of half the angle that it fills; < 0: from inside, or no sphere.
static double spread_of(const Placed *p, Vec3 from, Vec3 *towards) {
    *towards = vec3_sub(affine_point(&p->at->place->map, p->center), from);
    double radius = p->radius * p->scale, d2 = vec3_dot(*towards, *towards);
    double share2 = radius * radius / d2;
    return p->scale > 0 && share2 < 1 ? share2 / (1 + sqrt(1 - share2)) : -1;
}

// Per area in the world, where a point of the sphere with that normal (before the transform) is
// drawn evenly over the sphere.
static double ellipsoid_density(const Placed *p, Vec3 n, Vec3 dir, double distance) {
    const Placement *place = p->at->place;
    Vec3 m = affine_normal(&place->inverse, n);
    double stretch = fabs(affine_det(&place->map)) * vec3_length(m);
    double area = 4 * SAMPLING_PI * p->radius * p->radius * stretch;
    double cosine = fabs(vec3_dot(vec3_normalize(m), dir));
    return cosine > 0 && area > 0 ? distance * distance / (cosine * area) : 0;
}

// Whether a point with that normal is on the far half of a sphere that is seen from outside: it
// hides behind the near one.
static bool is_behind(const Placed *p, Vec3 from, Vec3 n, Vec3 dir) {
    const Placement *place = p->at->place;
    Vec3 local = vec3_sub(placement_point_back(place, from), p->center);
    bool is_outside = vec3_dot(local, local) > p->radius * p->radius;
    return is_outside && vec3_dot(affine_normal(&place->inverse, n), dir) > 0;
}

static bool sample_ellipsoid(const Placed *p, const Emitter *emitter, Vec3 from, double u, double v,
                             EmitterSample *sample) {
    Vec3 n = sampling_cone(2, u, v);
    Vec3 at = affine_point(&p->at->place->map, vec3_madd(p->center, p->radius, n));
    Vec3 towards = vec3_sub(at, from);
    sample->distance = vec3_length(towards);
    sample->dir = vec3_scale(towards, 1 / sample->distance);
    sample->density = ellipsoid_density(p, n, sample->dir, sample->distance);
    sample->hit = hit_of(p->body, emitter, 0, 0, sample->distance);
    return sample->distance > 0 && !is_behind(p, from, n, sample->dir);
}

static bool sample_sphere(const Placed *p, const Emitter *emitter, Vec3 from, double u, double v,
                          EmitterSample *sample) {
    Vec3 towards, x, y;
    double spread = spread_of(p, from, &towards);
    if (!(spread > 0)) {
        return sample_ellipsoid(p, emitter, from, u, v, sample);
    }
    Vec3 axis = vec3_normalize(towards);
    sampling_frame(axis, &x, &y);
    sample->dir = sampling_to_world(x, y, axis, sampling_cone(spread, u, v));
    double along = vec3_dot(towards, sample->dir), radius = p->radius * p->scale;
    Vec3 aside = vec3_madd(towards, -along, sample->dir);
    double inside2 = radius * radius - vec3_dot(aside, aside);
    sample->distance = along - (inside2 > 0 ? sqrt(inside2) : 0);
    sample->density = 1 / (2 * SAMPLING_PI * spread);
    sample->hit = hit_of(p->body, emitter, 0, 0, sample->distance);
    return sample->distance > 0;
}

// ---- Both

bool emitter_sample(WorldView *view, const Emitter *emitter, Vec3 from, double u, double v,
                    EmitterSample *sample) {
    Placed p;
    if (!place(view, emitter, &p)) {
        return false;
    }
    bool is_there = p.is_triangle ? sample_triangle(&p, emitter, from, u, v, sample)
                                  : sample_sphere(&p, emitter, from, u, v, sample);
    return is_there && sample->density > 0 && isfinite(sample->density);
}

double emitter_density(WorldView *view, const Emitter *emitter, Vec3 from, Vec3 dir,
                       double distance) {
    Placed p;
    Vec3 towards;
    double density;
    if (!place(view, emitter, &p)) {
        return 0;
    }
    if (p.is_triangle) {
        density = triangle_density(&p, dir, distance);
    } else {
        double spread = spread_of(&p, from, &towards);
        Vec3 at = placement_point_back(p.at->place, vec3_madd(from, distance, dir));
        Vec3 n = vec3_normalize(vec3_sub(at, p.center));
        density = is_behind(&p, from, n, dir) ? 0
                  : spread > 0                ? 1 / (2 * SAMPLING_PI * spread)
                                              : ellipsoid_density(&p, n, dir, distance);
    }
    return isfinite(density) ? density : 0;
}

bool emitter_bounds(WorldView *view, const Emitter *emitter, LightBounds *bounds) {
    Placed p;
    if (!place(view, emitter, &p)) {
        return false;
    }
    Bounds box = bounds_empty();
    *bounds = (LightBounds){.axis = vec3(0, 0, 1), .cos_o = -1, .cos_e = 0};
    if (p.is_triangle) {
        for (int k = 0; k < 3; k++) {
            box = bounds_add(box, p.corner[k]);
        }
        bounds->axis = p.normal;
        bounds->cos_o = 1;
        bounds->two_sided = true;
        bounds->power = 2 * p.area;
    } else {
        const Affine *map = &p.at->place->map;
        Vec3 c = affine_point(map, p.center), reach;
        double *r[3] = {&reach.x, &reach.y, &reach.z};
        for (int k = 0; k < 3; k++) {
            *r[k] = p.radius * sqrt(map->m[k][0] * map->m[k][0] + map->m[k][1] * map->m[k][1] +
                                    map->m[k][2] * map->m[k][2]);
        }
        box = (Bounds){vec3_sub(c, reach), vec3_add(c, reach)};
        double size = cbrt(fabs(affine_det(map))) * p.radius;
        bounds->power = 4 * SAMPLING_PI * size * size;
    }
    bounds->lo = box.lo;
    bounds->hi = box.hi;
    return true;
}

void emitter_point(WorldView *view, const Emitter *emitter, uint32_t k, SurfacePoint *point) {
    static const double inside[EMITTER_POINTS][2] = {{1 / 3.0, 1 / 3.0}, {0.1, 0.1}, {0.8, 0.1},
                                                     {0.1, 0.8},         {0.4, 0.1}, {0.1, 0.4}};
    Placed p;
    place(view, emitter, &p);
    // Along an axis, from afar.
    double side = k % 2 ? 1 : -1;
    Vec3 dir = vec3(k / 2 == 0 ? side : 0, k / 2 == 1 ? side : 0, k / 2 == 2 ? side : 0);
    WorldHit hit = hit_of(p.body, emitter, inside[k][0], inside[k][1], 1);
    Vec3 at = p.is_triangle ? p.corner[0]
                            : affine_point(&p.at->place->map, vec3_madd(p.center, -p.radius, dir));
    world_surface(view, vec3_sub(at, dir), dir, &hit, point);
}
