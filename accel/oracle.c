// SPDX-License-Identifier: Apache-2.0
// The oracle in double: every primitive, by formulas that share nothing with the float kernels.
#include "accel/accel.h"
#include "accel/vec.h"

#include <math.h>

// What one primitive says to a ray: where along it, and how far inside (> 0) or outside (< 0).
typedef struct {
    double t, u, v, inside;
} Meeting;

static Vec3 place(const Geometry *geometry, const AccelRay *ray, uint32_t vertex) {
    size_t n = geometry->n_vertices;
    const float *a = geometry->position + 3 * (n * ray->key + vertex);
    const float *b = geometry->n_keys > 1 ? a + 3 * n : a;
    double f = ray->f;
    return vec3(a[0] + f * ((double)b[0] - a[0]), a[1] + f * ((double)b[1] - a[1]),
                a[2] + f * ((double)b[2] - a[2]));
}

// Moeller, Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997).
static bool meet_triangle(const Geometry *geometry, const AccelRay *ray, uint32_t prim, Vec3 o,
                          Vec3 d, Meeting *m) {
    const uint32_t *index = geometry->index + 3 * (size_t)prim;
    Vec3 a = place(geometry, ray, index[0]);
    Vec3 e1 = vec3_sub(place(geometry, ray, index[1]), a);
    Vec3 e2 = vec3_sub(place(geometry, ray, index[2]), a);
    Vec3 p = vec3_cross(d, e2), s = vec3_sub(o, a), q = vec3_cross(s, e1);
    double det = vec3_dot(e1, p);
    m->u = vec3_dot(s, p) / det;
    m->v = vec3_dot(d, q) / det;
    m->t = vec3_dot(e2, q) / det;
    m->inside = fmin(fmin(m->u, m->v), 1 - m->u - m->v);
    return isfinite(m->t) && isfinite(m->u) && isfinite(m->v);
}

static bool meet_sphere(const Geometry *geometry, const AccelRay *ray, uint32_t prim, Vec3 o,
                        Vec3 d, Meeting *m) {
    size_t at = (size_t)geometry->n_vertices * ray->key + prim;
    double r0 = geometry->radius[at];
    double r1 = geometry->n_keys > 1 ? geometry->radius[at + geometry->n_vertices] : r0;
    double r = r0 + ray->f * (r1 - r0);
    Vec3 s = vec3_sub(o, place(geometry, ray, prim));
    double l = vec3_length(vec3_cross(s, d)) / vec3_length(d); // distance of the centre
    double middle = -vec3_dot(s, d) / vec3_dot(d, d);
    double half = sqrt(fmax(r * r - l * l, 0)) / vec3_length(d);
    m->t = middle - half > ray->tmin ? middle - half : middle + half;
    m->u = m->v = 0;
    m->inside = (r - l) / r;
    return r > 0 && isfinite(m->t) && isfinite(m->inside);
}

static void take(OracleHit *hit, const Meeting *m, uint32_t prim) {
    if (m->t < hit->t) {
        hit->second_t = hit->t;
        hit->second_prim = hit->prim;
        hit->t = m->t;
        hit->u = m->u;
        hit->v = m->v;
        hit->margin = m->inside;
        hit->prim = (int32_t)prim;
    } else if (m->t < hit->second_t) {
        hit->second_t = m->t;
        hit->second_prim = (int32_t)prim;
    }
}

static bool is_finite_ray(const AccelRay *ray, Vec3 o, Vec3 d) {
    return vec3_is_finite(o) && vec3_is_finite(d) && vec3_dot(d, d) > 0 && isfinite(ray->tmin) &&
           ray->tmin <= ray->tmax && ray->f >= 0 && ray->f <= 1;
}

bool accel_oracle(const Geometry *geometry, const AccelRay *ray, OracleHit *hit) {
    *hit = (OracleHit){.t = INFINITY,
                       .margin = INFINITY,
                       .second_t = INFINITY,
                       .prim = ACCEL_NO_PRIM,
                       .second_prim = ACCEL_NO_PRIM};
    Vec3 o = vec3(ray->origin[0], ray->origin[1], ray->origin[2]);
    Vec3 d = vec3(ray->dir[0], ray->dir[1], ray->dir[2]);
    uint32_t n_spans = geometry->n_keys > 1 ? geometry->n_keys - 1 : 1;
    if (!is_finite_ray(ray, o, d) || ray->key >= n_spans) {
        return false;
    }
    double outside = INFINITY;
    for (uint32_t i = 0; i < geometry->n_prims; i++) {
        Meeting m;
        bool met = geometry->kind == GEOMETRY_TRIANGLES ? meet_triangle(geometry, ray, i, o, d, &m)
                                                        : meet_sphere(geometry, ray, i, o, d, &m);
        bool in_range = met && m.t > ray->tmin && m.t <= ray->tmax;
        if (in_range && m.inside >= 0) {
            take(hit, &m, i);
        } else if (in_range) {
            outside = fmin(outside, -m.inside);
        }
    }
    bool is_hit = hit->prim != ACCEL_NO_PRIM;
    hit->margin = is_hit ? hit->margin : outside;
    return is_hit;
}
