// SPDX-License-Identifier: Apache-2.0
// What there is to know of a point of a surface: from the vertices, not along the ray.
#include "render/local_time.h"
#include "render/world_parts.h"

#include <float.h>
#include <string.h>

// Rounding of a ray's origin to float, of vertices relative to it and of the shear, in units of the
// largest coordinate in the object's frame. Measured errors stay under a third of it.
static const double FLOAT_ERROR = 8 * 0x1p-24;
// Of the maps between world and object, in double, relative to the coordinates on either side.
static const double DOUBLE_ERROR = 32 * 0x1p-53;
// The transform is differenced over so much of a frame period on either side.
static const double RATE_STEP = 0x1p-12;
// Shading normals lean so far towards the ray's side at least (cosine).
static const double LEAST_COSINE = 1e-4;

// The point before the transform.
typedef struct {
    Vec3 p, ng, n; // n: zero where only ng is known
    Vec3 velocity; // of the points themselves, metres per second of object space
    double size;   // of what was rounded in float, in object space
} Local;

static double largest_of(Vec3 a) {
    return fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
}

// A vertex at the ray's time as the kernels see it (frame units), and its step over the span.
static Vec3 vertex_at(const Geometry *g, const BodyView *at, uint32_t vertex, Vec3 *step) {
    const float *a = &g->position[3 * ((size_t)at->key * g->n_vertices + vertex)];
    if (g->n_keys == 1) {
        *step = vec3(0, 0, 0);
        return vec3(a[0], a[1], a[2]);
    }
    const float *b = a + 3 * (size_t)g->n_vertices;
    float d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    *step = vec3(d[0], d[1], d[2]);
    return vec3(fmaf(at->f, d[0], a[0]), fmaf(at->f, d[1], a[1]), fmaf(at->f, d[2], a[2]));
}

static Vec3 weigh(const Vec3 v[3], double u, double w) {
    return vec3_madd(vec3_madd(vec3_scale(v[0], 1 - u - w), u, v[1]), w, v[2]);
}

static Vec3 from_frame(const Frame *frame, Vec3 p) {
    return vec3(frame->center[0] + p.x / frame->scale, frame->center[1] + p.y / frame->scale,
                frame->center[2] + p.z / frame->scale);
}

// Key normals at the ray's time, weighed; zero where the form has none here.
static Vec3 shading_normal(const Form *form, const BodyView *at, uint32_t prim, double u,
                           double w) {
    const Smoothing *s = &form->smoothing;
    if (!s->index) {
        return vec3(0, 0, 0);
    }
    Vec3 n[3];
    for (int k = 0; k < 3; k++) {
        uint32_t i = s->index[3 * (size_t)prim + k];
        if (i == NORMAL_NONE) {
            return vec3(0, 0, 0);
        }
        if (s->given) {
            n[k] = normal_unpack(s->given[i]);
            continue;
        }
        const uint32_t *key = form->normal + (size_t)at->key * s->n_normals;
        n[k] = normal_unpack(key[i]);
        if (at->f > 0) {
            Vec3 next = normal_unpack(key[s->n_normals + i]);
            n[k] = vec3_add(vec3_scale(n[k], 1 - (double)at->f), vec3_scale(next, at->f));
        }
    }
    return vec3_normalize(weigh(n, u, w));
}

static Local local_triangle(const Form *form, const BodyView *at, uint32_t prim, double u,
                            double w) {
    const Geometry *g = &form->geometry;
    Vec3 v[3], step[3];
    double size = 0;
    for (int k = 0; k < 3; k++) {
        v[k] = vertex_at(g, at, g->index[3 * (size_t)prim + k], &step[k]);
        size = fmax(size, largest_of(v[k]));
    }
    double unit = 1 / form->sampler.frame.scale, seconds = form_span_seconds(form, at->key);
    Local l = {.p = from_frame(&form->sampler.frame, weigh(v, u, w)), .size = 2 * size * unit};
    l.ng = vec3_normalize(vec3_cross(vec3_sub(v[1], v[0]), vec3_sub(v[2], v[0])));
    l.n = shading_normal(form, at, prim, u, w);
    if (seconds > 0) {
        l.velocity = vec3_scale(weigh(step, u, w), unit / seconds);
    }
    return l;
}

static double radius_at(const Form *form, const BodyView *at, uint32_t prim) {
    const Geometry *g = &form->geometry;
    const float *r = &g->radius[(size_t)at->key * g->n_vertices + prim];
    double grow = g->n_keys > 1 ? (double)r[g->n_vertices] - r[0] : 0;
    return (r[0] + at->f * grow) / form->sampler.frame.scale;
}

// The point of the sphere nearest to the one along the ray: the latter's error is along the normal.
static Local local_sphere(const Form *form, const BodyView *at, uint32_t prim, Vec3 on_ray) {
    const Geometry *g = &form->geometry;
    const Frame *frame = &form->sampler.frame;
    Vec3 step, c = vertex_at(g, at, prim, &step);
    const float *r = &g->radius[(size_t)at->key * g->n_vertices + prim];
    double grow = g->n_keys > 1 ? (double)r[g->n_vertices] - r[0] : 0;
    double radius = r[0] + at->f * grow, unit = 1 / frame->scale;
    Vec3 center = from_frame(frame, c);
    Local l = {.ng = vec3_normalize(vec3_sub(on_ray, center))};
    if (vec3_dot(l.ng, l.ng) == 0) {
        l.ng = vec3(0, 0, 1);
    }
    l.p = vec3_madd(center, radius * unit, l.ng);
    l.size = 2 * (largest_of(c) + radius) * unit;
    double seconds = form_span_seconds(form, at->key);
    if (seconds > 0) {
        l.velocity = vec3_scale(vec3_madd(step, grow, l.ng), unit / seconds);
    }
    return l;
}

void surface_corners(const Body *body, const BodyView *at, uint32_t prim, Vec3 corner[3]) {
    const Geometry *g = &body->form->geometry;
    for (int k = 0; k < 3; k++) {
        Vec3 step, v = vertex_at(g, at, g->index[3 * (size_t)prim + k], &step);
        corner[k] = affine_point(&at->place->map, from_frame(&body->form->sampler.frame, v));
    }
}

Vec3 surface_center(const Body *body, const BodyView *at, uint32_t prim, double *radius) {
    Local l = local_sphere(body->form, at, prim, vec3(0, 0, 0));
    const Geometry *g = &body->form->geometry;
    const float *r = &g->radius[(size_t)at->key * g->n_vertices + prim];
    double grow = g->n_keys > 1 ? (double)r[g->n_vertices] - r[0] : 0;
    *radius = (r[0] + at->f * grow) / body->form->sampler.frame.scale;
    return vec3_madd(l.p, -*radius, l.ng);
}

static Local local_plane(const Body *body, const BodyView *at, double seconds, double step,
                         Vec3 on_ray) {
    Local l = {.ng = at->normal};
    double before = 0, after = 0;
    Vec3 normal;
    if (program_reads_time(body->shape->geometry)) {
        plane_at(body, seconds - step, &normal, &before);
        plane_at(body, seconds + step, &normal, &after);
    }
    l.p = vec3_madd(on_ray, at->offset - vec3_dot(on_ray, l.ng), l.ng);
    l.velocity = vec3_scale(l.ng, (after - before) / (2 * step));
    return l;
}

// Velocity of a point that is fixed in object space, by central differences of the transform: the
// error is (angular velocity * RATE_STEP frame)^2 / 6 of the velocity.
static Vec3 carried_velocity(const WorldView *view, const Body *body, Vec3 p) {
    if (body->many || !program_reads_time(body->shape->transform)) {
        return vec3(0, 0, 0);
    }
    double t[2];
    Affine map[2];
    for (int k = 0; k < 2; k++) {
        double step = k ? RATE_STEP : -RATE_STEP;
        t[k] = instant_seconds(instant_at(view->at.frame, view->at.frac + step), view->world->fps);
        if (!body_map(body, view->memo, t[k], &map[k])) {
            return vec3(0, 0, 0);
        }
    }
    Vec3 moved = vec3_sub(affine_point(&map[1], p), affine_point(&map[0], p));
    return vec3_scale(moved, 1 / (t[1] - t[0]));
}

// Rest position, rest normal and texture coordinates.
static void rest_of(const Mesh *mesh, uint32_t prim, double u, double w, SurfacePoint *point) {
    const uint32_t *index = &mesh->index[3 * (size_t)prim];
    const double weight[3] = {1 - u - w, u, w};
    Vec3 p[3], n = {0, 0, 0};
    point->u = point->v = 0;
    for (int k = 0; k < 3; k++) {
        size_t i = index[k];
        p[k] = vec3(mesh->position[3 * i], mesh->position[3 * i + 1], mesh->position[3 * i + 2]);
        if (mesh->normal) {
            const float *m = &mesh->normal[3 * i];
            n = vec3_madd(n, weight[k], vec3(m[0], m[1], m[2]));
        }
        if (mesh->uv) {
            point->u += weight[k] * mesh->uv[2 * i];
            point->v += weight[k] * mesh->uv[2 * i + 1];
        }
    }
    point->p = weigh(p, u, w);
    if (!mesh->normal) {
        n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
    }
    point->n = vec3_normalize(n);
}

// Direction around y and height, from the outward normal.
static void sphere_coordinates(Vec3 n, SurfacePoint *point) {
    const double pi = 3.141592653589793;
    double around = program_fold(OP_ATAN2, n.x, n.z, 0) / (2 * pi);
    point->u = around < 0 ? around + 1 : around;
    point->v = program_fold(OP_ASIN, fmax(-1, fmin(1, n.y)), 0, 0) / pi + 0.5;
}

// A direction across a plane's normal, the same for every point.
static Vec3 plane_axis(Vec3 n) {
    Vec3 a = fabs(n.x) < 0.9 ? vec3(1, 0, 0) : vec3(0, 0, 1);
    return vec3_normalize(vec3_madd(a, -vec3_dot(a, n), n));
}

static void plane_coordinates(Vec3 p, Vec3 n, SurfacePoint *point) {
    Vec3 across = plane_axis(n);
    point->u = vec3_dot(p, across);
    point->v = vec3_dot(p, vec3_cross(n, across));
}

// N to Ng's side, and then to the ray's side as Ng is; a normal that faces away is bent until it is
// just in sight.
static Vec3 consistent(Vec3 n, Vec3 ng, Vec3 dir) {
    n = vec3_dot(n, ng) < 0 ? vec3_scale(n, -1) : n;
    Vec3 back = vec3_scale(vec3_normalize(dir), -1);
    double side = vec3_dot(ng, back) < 0 ? -1 : 1, seen = side * vec3_dot(n, back);
    if (seen >= LEAST_COSINE) {
        return n;
    }
    return vec3_normalize(vec3_madd(n, side * (LEAST_COSINE - seen), back));
}

// Whose primitive it is: in a body of many, one of the instances or parts.
static void resolve(const Body *body, const WorldHit *hit, SurfacePoint *point) {
    const BodyOfMany *many = body->many;
    point->shape = body->shape;
    point->instance = body->instance;
    if (many && many->spheres) {
        point->shape = many->spheres[hit->at].shape;
        point->instance = many->spheres[hit->at].instance;
    } else if (many && many->instances) {
        point->instance = many->instances[hit->at];
    } else if (many) {
        const BodyPart *part = body_part(many, hit->at);
        point->shape = part->shape;
        point->instance = part->instance;
    }
    point->loops = shape_loops(point->shape, point->instance);
    point->material = point->shape->material;
}

// Baked vertices are in the world already: a mirrored transform has turned their faces round.
static double handedness(const WorldView *view, const Body *body, const SurfacePoint *point) {
    double in[IN_COUNT];
    Affine map;
    if (!body->many || !body->many->parts || !point->shape->transform) {
        return 1;
    }
    shape_inputs(point->shape, point->loops, view->seconds, in);
    return affine_run(point->shape->transform, in, &map) && affine_det(&map) < 0 ? -1 : 1;
}

static Local local_of(const WorldView *view, const Body *body, const BodyView *at, Vec3 on_ray,
                      const WorldHit *hit, uint32_t prim) {
    if (!body->form) {
        return local_plane(body, at, view->seconds, RATE_STEP / view->world->fps, on_ray);
    }
    if (body->form->kind == GEOMETRY_SPHERES) {
        return local_sphere(body->form, at, prim, on_ray);
    }
    return local_triangle(body->form, at, prim, hit->u, hit->v);
}

static void set_rest(const Body *body, const Local *l, const WorldHit *hit, SurfacePoint *point) {
    double s[4];
    if (point->shape->kind == SHAPE_MESH) {
        rest_of(point->shape->mesh, (uint32_t)hit->prim, hit->u, hit->v, point);
        return;
    }
    point->p = l->p;
    point->n = l->ng;
    if (body->is_ball) {
        sphere_at(body->shape, point->loops, 0, s);
        point->p = vec3_madd(vec3(s[0], s[1], s[2]), s[3], l->p);
    }
    if (body->form) {
        sphere_coordinates(l->ng, point);
    } else {
        plane_coordinates(l->p, l->ng, point);
    }
}

void world_surface(WorldView *view, Vec3 origin, Vec3 dir, const WorldHit *hit,
                   SurfacePoint *point) {
    const BodyView *at = view_body(view, hit->body);
    const Body *body = at->body;
    resolve(body, hit, point);
    const Placement *place = at->place;
    Vec3 o = body->many ? origin : placement_point_back(place, origin);
    Vec3 d = body->many ? dir : affine_vector(&place->inverse, dir);
    Local l = local_of(view, body, at, vec3_madd(o, hit->t, d), hit, hit->at);
    l.velocity = vec3_scale(l.velocity, shape_rate(point->shape, point->loops, view->seconds,
                                                   RATE_STEP / view->world->fps));
    set_rest(body, &l, hit, point);
    double side = handedness(view, body, point), grown = affine_stretch(&place->map);
    point->P = affine_point(&place->map, l.p);
    point->Ng = vec3_scale(vec3_normalize(affine_normal(&place->inverse, l.ng)), side);
    Vec3 n = vec3_scale(vec3_normalize(affine_normal(&place->inverse, l.n)), side);
    point->N = vec3_dot(n, n) > 0 ? consistent(n, point->Ng, dir) : point->Ng;
    point->velocity =
        vec3_add(affine_vector(&place->map, l.velocity), carried_velocity(view, body, l.p));
    Vec3 far = vec3(place->map.m[0][3], place->map.m[1][3], place->map.m[2][3]);
    double on_object = FLOAT_ERROR * l.size + DOUBLE_ERROR * largest_of(l.p);
    double in_world = DOUBLE_ERROR * (largest_of(point->P) + largest_of(far));
    point->error = grown * on_object + in_world;
}

// ---- Slopes: `along` is that of the point in the body's own space

static void slope_plane(Vec3 n, SurfaceSlope *slope, Vec3 along[2]) {
    along[0] = slope->p[0] = plane_axis(n);
    along[1] = slope->p[1] = vec3_cross(n, along[0]);
    slope->u[0] = slope->v[1] = 1;
}

// East and north.
static void slope_sphere(Vec3 n, double radius, double rest, SurfaceSlope *slope, Vec3 along[2]) {
    const double pi = 3.141592653589793;
    double level = hypot(n.x, n.z);
    slope->n[0] = level > 0 ? vec3(n.z / level, 0, -n.x / level) : vec3(1, 0, 0);
    slope->n[1] = vec3_cross(n, slope->n[0]);
    for (int k = 0; k < 2; k++) {
        along[k] = vec3_scale(slope->n[k], radius);
        slope->p[k] = vec3_scale(slope->n[k], rest);
    }
    slope->u[0] = level > 0 ? 1 / (2 * pi * level) : 0;
    slope->v[1] = 1 / pi;
}

static void slope_triangle(const Form *form, const BodyView *at, const WorldHit *hit,
                           const Mesh *mesh, SurfaceSlope *slope, Vec3 along[2]) {
    const Geometry *g = &form->geometry;
    const uint32_t *index = &mesh->index[3 * (size_t)hit->prim];
    Vec3 v[3], step;
    for (int k = 0; k < 3; k++) {
        v[k] = vertex_at(g, at, g->index[3 * (size_t)hit->at + (size_t)k], &step);
    }
    for (int k = 0; k < 2; k++) {
        size_t a = index[0], b = index[k + 1];
        const double *p = &mesh->position[3 * a], *q = &mesh->position[3 * b];
        along[k] = vec3_scale(vec3_sub(v[k + 1], v[0]), 1 / form->sampler.frame.scale);
        slope->p[k] = vec3(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
        if (mesh->normal) {
            const float *m = &mesh->normal[3 * a], *n = &mesh->normal[3 * b];
            slope->n[k] = vec3(n[0] - m[0], n[1] - m[1], n[2] - m[2]);
        }
        if (mesh->uv) {
            slope->u[k] = (double)mesh->uv[2 * b] - mesh->uv[2 * a];
            slope->v[k] = (double)mesh->uv[2 * b + 1] - mesh->uv[2 * a + 1];
        }
    }
}

void world_surface_slope(WorldView *view, const WorldHit *hit, const SurfacePoint *point,
                         SurfaceSlope *slope) {
    const BodyView *at = view_body(view, hit->body);
    const Body *body = at->body;
    Vec3 along[2];
    *slope = (SurfaceSlope){0};
    if (!body->form) {
        slope_plane(point->n, slope, along);
    } else if (body->form->kind == GEOMETRY_SPHERES) {
        double s[4], radius = radius_at(body->form, at, hit->at), rest = radius;
        if (body->is_ball) {
            sphere_at(body->shape, point->loops, 0, s);
            rest = s[3];
        }
        slope_sphere(point->n, radius, rest, slope, along);
    } else {
        slope_triangle(body->form, at, hit, point->shape->mesh, slope, along);
    }
    for (int k = 0; k < 2; k++) {
        slope->P[k] = affine_vector(&at->place->map, along[k]);
    }
}
