// SPDX-License-Identifier: Apache-2.0
// Rigid bodies by ODE: what touches, and what of it may go on sleeping.
//
// ODE wakes all bodies that touch each other, over any number of others, while one of them moves: a
// pile would never come to rest, since it creeps for as long as anything does. Here such an island
// wakes while something in it is pushed by a force, hangs on a joint or lies on a body that is
// moved, and takes part in a step in which something in it is as fast as what hits. What is slower
// wakes those that it touches. Else a body that sleeps is as good as fixed for those that do not
// yet, so that one after the other comes to rest.
#include <math.h>
#include <stdlib.h>

#include "render/sim_ode_parts.h"

enum { MOST_CONTACTS = 128, KEPT_CONTACTS = 12 };

static const double least_bounce = 0.05;                 // slower than this nothing bounces, m/s
static const double wake_speed = 0.05, wake_spin = 0.25; // of what is touched; m/s, rad/s
static const double hit_speed = 0.25, hit_spin = 1;      // of the whole island

// ---- Contacts

static bool may_move(const OdeBody *body) {
    return body->id && !body->about->is_fixed;
}

// Of many contacts the deepest, and those that are farthest from each other: a body is held at its
// ends, and the solver takes as long as there are contacts. n: more than are kept.
static int thin_out(dContact *contacts, int n) {
    double apart[MOST_CONTACTS]; // from those that are kept, squared
    int next = 0;
    for (int i = 0; i < n; i++) {
        next = contacts[i].geom.depth > contacts[next].geom.depth ? i : next;
        apart[i] = INFINITY;
    }
    for (int kept = 0; kept < KEPT_CONTACTS; kept++) {
        dContact swap = contacts[kept];
        contacts[kept] = contacts[next];
        contacts[next] = swap;
        apart[next] = apart[kept];
        const dReal *p = contacts[kept].geom.pos;
        next = kept + 1;
        for (int i = kept + 1; i < n; i++) {
            const dReal *q = contacts[i].geom.pos;
            double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
            apart[i] = fmin(apart[i], d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            next = apart[i] > apart[next] ? i : next;
        }
    }
    return KEPT_CONTACTS;
}

// More room by halves; NULL: no memory, the array stays.
static void *grown(void *array, size_t n, size_t more, size_t *capacity, size_t size) {
    if (n + more <= *capacity) {
        return array;
    }
    size_t wanted = n + more + n / 2;
    void *larger = realloc(array, wanted * size);
    *capacity = larger ? wanted : *capacity;
    return larger;
}

static void collide(void *data, dGeomID g1, dGeomID g2) {
    OdeRun *run = data;
    OdeBody *a = dGeomGetData(g1), *b = dGeomGetData(g2);
    dContact contacts[MOST_CONTACTS];
    if (a == b || (!may_move(a) && !may_move(b)) ||
        (a->id && b->id && dAreConnectedExcluding(a->id, b->id, dJointTypeContact))) {
        return;
    }
    int n = dCollide(g1, g2, MOST_CONTACTS, &contacts[0].geom, sizeof contacts[0]);
    n = n > KEPT_CONTACTS ? thin_out(contacts, n) : n;
    if (n == 0) {
        return;
    }
    OdeTouch *touches =
        grown(run->touches, run->n_touches, 1, &run->touches_capacity, sizeof *touches);
    run->touches = touches ? touches : run->touches;
    dContact *points =
        grown(run->points, run->n_points, (size_t)n, &run->points_capacity, sizeof *points);
    run->points = points ? points : run->points;
    if (!touches || !points) {
        run->has_no_memory = true;
        return;
    }
    touches[run->n_touches++] = (OdeTouch){a, b, (uint32_t)run->n_points, (uint32_t)n};
    for (int i = 0; i < n; i++) {
        dSurfaceParameters *surface = &contacts[i].surface;
        *surface = (dSurfaceParameters){0};
        surface->mode = dContactBounce | dContactApprox1;
        surface->mu = sqrt(a->about->friction * b->about->friction);
        surface->bounce = fmax(a->about->bounce, b->about->bounce);
        surface->bounce_vel = least_bounce;
        points[run->n_points++] = contacts[i];
    }
    a->touches = b->touches = true;
}

// ---- Islands: bodies that touch, over others

static uint32_t island_of(OdeRun *run, const OdeBody *body) {
    uint32_t i = (uint32_t)(body - run->bodies);
    while (run->bodies[i].island != i) {
        run->bodies[i].island = run->bodies[run->bodies[i].island].island;
        i = run->bodies[i].island;
    }
    return i;
}

static bool is_faster(const OdeBody *body, double speed, double spin) {
    const dReal *v = dBodyGetLinearVel(body->id), *w = dBodyGetAngularVel(body->id);
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2] > speed * speed ||
           w[0] * w[0] + w[1] * w[1] + w[2] * w[2] > spin * spin;
}

static bool is_asleep(const OdeBody *body) {
    return may_move(body) && !dBodyIsEnabled(body->id);
}

static void add_drive(OdeBody *island, OdeDrive drive) {
    island->drive = drive > island->drive ? drive : island->drive;
}

static void find_islands(OdeRun *run) {
    for (uint32_t i = 0; i < run->sim->n_bodies; i++) {
        OdeBody *body = &run->bodies[i];
        body->island = i;
        body->drive = !may_move(body)                          ? ODE_AT_REST
                      : body->about->force || body->is_jointed ? ODE_PUSHED
                      : is_faster(body, hit_speed, hit_spin)   ? ODE_HIT
                                                               : ODE_AT_REST;
    }
    for (size_t i = 0; i < run->n_touches; i++) {
        OdeBody *a = run->touches[i].a, *b = run->touches[i].b;
        if (may_move(a) && may_move(b)) {
            uint32_t from = island_of(run, a), to = island_of(run, b);
            add_drive(&run->bodies[to], run->bodies[from].drive);
            run->bodies[from].island = to;
        } else {
            const OdeBody *mover = may_move(a) ? a : b, *ground = may_move(a) ? b : a;
            bool is_carried = ground->about->motion && is_faster(ground, 0, 0);
            add_drive(&run->bodies[island_of(run, mover)], is_carried ? ODE_PUSHED : ODE_AT_REST);
        }
    }
}

// Their half second of quiet begins anew.
static void wake(OdeRun *run) {
    for (uint32_t i = 0; i < run->sim->n_bodies; i++) {
        OdeBody *body = &run->bodies[i];
        if (is_asleep(body) && run->bodies[island_of(run, body)].drive == ODE_PUSHED) {
            dBodyEnable(body->id);
        }
    }
    for (size_t i = 0; i < run->n_touches; i++) {
        OdeBody *a = run->touches[i].a, *b = run->touches[i].b;
        if (is_asleep(a) && may_move(b) && is_faster(b, wake_speed, wake_spin)) {
            dBodyEnable(a->id);
        } else if (is_asleep(b) && may_move(a) && is_faster(a, wake_speed, wake_spin)) {
            dBodyEnable(b->id);
        }
    }
}

bool sim_ode_touch(OdeRun *run) {
    run->n_touches = run->n_points = 0;
    dSpaceCollide(run->space, run, collide);
    find_islands(run);
    wake(run);
    for (size_t i = 0; i < run->n_touches; i++) {
        const OdeTouch *touch = &run->touches[i];
        const OdeBody *mover = may_move(touch->a) ? touch->a : touch->b;
        bool is_hit = run->bodies[island_of(run, mover)].drive == ODE_HIT;
        dBodyID a = is_asleep(touch->a) && !is_hit ? NULL : touch->a->id;
        dBodyID b = is_asleep(touch->b) && !is_hit ? NULL : touch->b->id;
        for (uint32_t k = 0; k < touch->n && (a || b); k++) {
            dJointID joint =
                dJointCreateContact(run->world, run->contacts, &run->points[touch->first + k]);
            dJointAttach(joint, a, b);
        }
    }
    return !run->has_no_memory;
}
