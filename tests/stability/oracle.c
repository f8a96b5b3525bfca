// SPDX-License-Identifier: Apache-2.0
// The oracle: edge functions in double, with running error bounds.
//
// Doubles round 2^29 times finer than floats, so the bounds, which count the kernels' roundings,
// cover the oracle's own as well.
#include "tests/stability/oracle.h"

#include <math.h>
#include <stdio.h>

static const double U = 0x1.01p-24;     // a float's rounding, and a little for what is of order u^2
static const double TINY = 0x1p-148;    // a float's rounding where it is denormal
static const double TOO_LARGE = 0x1p60; // products of edges overflow beyond

typedef struct {
    double x[3], y[3], z[3], ex[3], ey[3], ez[3];
} Sheared;

static bool shear(const Meet *m, Sheared *s) {
    int kz = fabs(m->d[0]) > fabs(m->d[1]) ? 0 : 1;
    kz = fabs(m->d[2]) > fabs(m->d[kz]) ? 2 : kz;
    int kx = (kz + 1) % 3, ky = (kz + 2) % 3;
    double dz = fabs(m->d[kz]);
    double sx = m->d[kx] / m->d[kz], sy = m->d[ky] / m->d[kz];
    double esx = (m->ed[kx] + fabs(sx) * m->ed[kz]) / dz + U * fabs(sx) + TINY;
    double esy = (m->ed[ky] + fabs(sy) * m->ed[kz]) / dz + U * fabs(sy) + TINY;
    bool is_fine = true;
    for (int i = 0; i < 3; i++) {
        const double *a = m->a[i], *e = m->ea[i];
        s->x[i] = a[kx] - sx * a[kz];
        s->y[i] = a[ky] - sy * a[kz];
        s->z[i] = a[kz] / m->d[kz];
        s->ex[i] = e[kx] + fabs(sx) * e[kz] + esx * fabs(a[kz]) + U * fabs(s->x[i]) + TINY;
        s->ey[i] = e[ky] + fabs(sy) * e[kz] + esy * fabs(a[kz]) + U * fabs(s->y[i]) + TINY;
        s->ez[i] = e[kz] / dz + fabs(s->z[i]) * (m->ed[kz] / dz + 3 * U) + TINY / dz + TINY;
        is_fine = is_fine && fabs(s->x[i]) < TOO_LARGE && fabs(s->y[i]) < TOO_LARGE;
    }
    return is_fine;
}

// Twice the areas of the three parts, with their errors.
static void edges(const Sheared *s, double e[3], double error[3]) {
    for (int c = 0; c < 3; c++) {
        int i = (c + 2) % 3, j = (c + 1) % 3;
        e[c] = s->x[i] * s->y[j] - s->y[i] * s->x[j];
        error[c] = fabs(s->x[i]) * s->ey[j] + fabs(s->y[j]) * s->ex[i] + fabs(s->y[i]) * s->ex[j] +
                   fabs(s->x[j]) * s->ey[i] + s->ex[i] * s->ey[j] + s->ey[i] * s->ex[j] + 0x1p-140;
    }
}

Meeting meet_triangle(const Meet *m) {
    Sheared s;
    double e[3], error[3];
    if (!shear(m, &s)) {
        return (Meeting){MAYBE, -INFINITY, INFINITY, 0, 0, INFINITY};
    }
    edges(&s, e, error);
    bool can_be_plus = true, can_be_minus = true, is_plus = true, is_minus = true;
    double det = 0, det_error = 0, lo = INFINITY, hi = -INFINITY, z_error = 0;
    for (int c = 0; c < 3; c++) {
        can_be_plus = can_be_plus && e[c] >= -error[c];
        can_be_minus = can_be_minus && e[c] <= error[c];
        is_plus = is_plus && e[c] > error[c];
        is_minus = is_minus && e[c] < -error[c];
        det += e[c];
        det_error += error[c];
        z_error = fmax(z_error, s.ez[c] + 8 * U * fabs(s.z[c]));
        lo = fmin(lo, s.z[c]);
        hi = fmax(hi, s.z[c]);
    }
    Meeting r = {MAYBE, lo - z_error, hi + z_error, 0, 0, INFINITY};
    if (!can_be_plus && !can_be_minus) {
        r.is_met = SURELY_NOT;
    } else if (is_plus || is_minus) {
        r.is_met = SURELY;
        double t = 0, off = z_error;
        r.slack = fabs(det) > det_error ? 2 * det_error / (fabs(det) - det_error) + 8 * U : 1;
        for (int c = 0; c < 3; c++) {
            t += e[c] / det * s.z[c];
        }
        for (int c = 0; c < 3; c++) {
            off += r.slack * fabs(s.z[c] - t);
        }
        r.u = e[1] / det;
        r.v = e[2] / det;
        r.lo = fmax(r.lo, t - off);
        r.hi = fmin(r.hi, t + off);
    }
    return r;
}

// ---- The kernels' roundings

static void place(const Geometry *g, const AccelRay *ray, uint32_t vertex, double a[3],
                  double ea[3]) {
    size_t n = g->n_vertices;
    const float *p = g->position + 3 * (n * ray->key + vertex);
    const float *q = g->n_keys > 1 ? p + 3 * n : p;
    for (int k = 0; k < 3; k++) {
        double way = (double)q[k] - p[k], at = p[k] + ray->f * way;
        a[k] = at - ray->origin[k];
        ea[k] = U * (ray->f * fabs(way) + fabs(at) + fabs(a[k])) + 3 * TINY;
        if (isinf((float)way)) { // as b - a is
            a[k] = NAN;
        }
    }
}

static Meeting meet_sphere(const Geometry *g, const AccelRay *ray, uint32_t prim) {
    size_t at = (size_t)g->n_vertices * ray->key + prim;
    double r0 = g->radius[at], r1 = g->n_keys > 1 ? g->radius[at + g->n_vertices] : r0;
    double r = r0 + ray->f * (r1 - r0), er = U * (fabs(r) + ray->f * fabs(r1 - r0)) + TINY;
    double a[3], ea[3], d[3], dd = 0, ad = 0, error = er, reach = 0;
    place(g, ray, prim, a, ea);
    for (int k = 0; k < 3; k++) {
        d[k] = ray->dir[k];
        dd += d[k] * d[k];
        ad += a[k] * d[k];
        error += ea[k];
        reach += fabs(a[k]);
    }
    double middle = ad / dd, ll = 0;
    for (int k = 0; k < 3; k++) {
        double l = a[k] - middle * d[k];
        ll += l * l;
    }
    error += 0x1p-48 * reach;
    double l = sqrt(ll), length = sqrt(dd);
    if (!(r + er > 0) || l > r + error || !isfinite(l) || !isfinite(r)) {
        return (Meeting){SURELY_NOT, 0, 0, 0, 0, 0};
    }
    double most =
        sqrt(fmax((r + error) * (r + error) - fmax(l - error, 0) * fmax(l - error, 0), 0));
    double least =
        sqrt(fmax(fmax(r - error, 0) * fmax(r - error, 0) - (l + error) * (l + error), 0));
    double grain = (2 * U * (reach + r) + error) / length + TINY;
    Meeting m = {l < r - 2 * error && r > 2 * er ? SURELY : MAYBE, 0, 0, 0, 0, 0};
    m.lo = middle - most / length - grain;
    m.hi = middle - least / length + grain;
    if (m.lo <= ray->tmin) { // it may be the far side that is met
        m.is_met = m.hi <= ray->tmin ? m.is_met : MAYBE;
        m.hi = middle + most / length + grain;
        m.lo = m.is_met == SURELY ? middle + least / length - grain : m.lo;
    }
    return m;
}

Meeting meet_prim(const Geometry *g, const AccelRay *ray, uint32_t prim) {
    if (g->kind == GEOMETRY_SPHERES) {
        return meet_sphere(g, ray, prim);
    }
    Meet m = {.d = {ray->dir[0], ray->dir[1], ray->dir[2]}};
    bool is_finite = true;
    for (int i = 0; i < 3; i++) {
        place(g, ray, g->index[3 * (size_t)prim + (size_t)i], m.a[i], m.ea[i]);
        is_finite = is_finite && isfinite(m.a[i][0]) && isfinite(m.a[i][1]) && isfinite(m.a[i][2]);
    }
    return is_finite ? meet_triangle(&m) : (Meeting){SURELY_NOT, 0, 0, 0, 0, 0};
}

// ---- Judgement

bool oracle_allows(MeetFn *meet, const void *context, uint32_t n_prims, double tmin, double tmax,
                   bool is_hit, double t, uint32_t prim, char *why, size_t n) {
    if (is_hit) {
        if (!(prim < n_prims)) {
            snprintf(why, n, "there is no primitive %u", prim);
            return false;
        }
        Meeting m = meet(context, prim);
        if (m.is_met == SURELY_NOT || !(t >= m.lo && t <= m.hi)) {
            snprintf(why, n, "primitive %u is %s at %.17g to %.17g", prim,
                     m.is_met == SURELY_NOT ? "not met" : "met", m.lo, m.hi);
            return false;
        }
        tmax = t;
    }
    for (uint32_t i = 0; i < n_prims; i++) {
        Meeting m = meet(context, i);
        bool is_before = m.is_met == SURELY && m.lo > tmin && (is_hit ? m.hi < t : m.hi <= tmax);
        if (is_before && !(is_hit && i == prim)) {
            snprintf(why, n, "primitive %u is surely met at %.17g to %.17g", i, m.lo, m.hi);
            return false;
        }
    }
    return true;
}

typedef struct {
    const Geometry *geometry;
    const AccelRay *ray;
} Question;

static Meeting answer(const void *context, uint32_t prim) {
    const Question *q = context;
    return meet_prim(q->geometry, q->ray, prim);
}

bool oracle_allows_hit(const Geometry *g, const AccelRay *ray, bool is_hit, const AccelHit *hit,
                       char *why, size_t n) {
    const Question q = {g, ray};
    if (is_hit && !(hit->t > ray->tmin && hit->t <= ray->tmax)) {
        snprintf(why, n, "the distance is outside of the interval");
        return false;
    }
    if (is_hit && !(hit->u >= 0 && hit->v >= 0 && hit->u + hit->v <= 1 + 8 * U)) {
        snprintf(why, n, "the weights are not those of a point of the triangle");
        return false;
    }
    double t = is_hit ? hit->t : 0;
    uint32_t prim = is_hit ? (uint32_t)hit->prim : 0;
    double most = fmin(ray->tmax, 1e37); // what is farther away is no hit
    if (!oracle_allows(answer, &q, g->n_prims, ray->tmin, most, is_hit, t, prim, why, n)) {
        return false;
    }
    Meeting m = is_hit ? meet_prim(g, ray, prim) : (Meeting){0};
    if (m.is_met == SURELY && (fabs(hit->u - m.u) > m.slack || fabs(hit->v - m.v) > m.slack) &&
        g->kind == GEOMETRY_TRIANGLES) {
        snprintf(why, n, "the weights are to be %.9g %.9g, to %.3g", m.u, m.v, m.slack);
        return false;
    }
    return true;
}
