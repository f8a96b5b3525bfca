// SPDX-License-Identifier: Apache-2.0
// Rigid bodies by ODE, in a process of their own: bodies, joints, steps.
#include "render/sim_ode.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/sim_ode_parts.h"

// Bodies that are slower for so long sleep; speeds are means over a while.
static const double sleep_speed = 0.01, sleep_spin = 0.04, sleep_time = 0.5, sleep_mean = 0.1;
static const double most_distance = 1e7, most_speed = 1e6; // beyond, a body has run away

// ---- Places

// A geom in the block of its body, whose centre of mass is ODE's origin.
static void place_geom(const OdeBody *body, dGeomID geom, const RigidShape *shape) {
    dQuaternion q;
    sim_ode_quaternion(shape->turn, q);
    if (shape->kind == RIGID_PLANE) {
        return;
    }
    if (body->id) {
        dGeomSetBody(geom, body->id);
        dGeomSetOffsetPosition(geom, shape->at[0] - body->center[0], shape->at[1] - body->center[1],
                               shape->at[2] - body->center[2]);
        dGeomSetOffsetQuaternion(geom, q);
        return;
    }
    dQuaternion own, whole;
    dVector3 at;
    dMatrix3 rotation;
    sim_ode_quaternion(body->about->turn, own);
    dQMultiply0(whole, own, q);
    dQtoR(own, rotation);
    dMultiply0_331(at, rotation, shape->at);
    dGeomSetPosition(geom, body->about->at[0] + at[0], body->about->at[1] + at[1],
                     body->about->at[2] + at[2]);
    dGeomSetQuaternion(geom, whole);
}

// ---- Bodies

static void set_pose(const OdeBody *body, const double at[3], const double turn[4]) {
    dQuaternion q;
    dVector3 center;
    sim_ode_quaternion(turn, q);
    dBodySetQuaternion(body->id, q);
    dBodyVectorToWorld(body->id, body->center[0], body->center[1], body->center[2], center);
    dBodySetPosition(body->id, at[0] + center[0], at[1] + center[1], at[2] + center[2]);
}

static void find_pose(const OdeBody *body, double at[3], double turn[4]) {
    dVector3 center;
    const dReal *p = dBodyGetPosition(body->id), *q = dBodyGetQuaternion(body->id);
    dBodyVectorToWorld(body->id, body->center[0], body->center[1], body->center[2], center);
    for (int k = 0; k < 3; k++) {
        at[k] = p[k] - center[k];
        turn[k] = q[k + 1];
    }
    turn[3] = q[0];
}

static bool all_finite(const double *x, size_t n) {
    bool is = true;
    for (size_t i = 0; i < n; i++) {
        is = is && isfinite(x[i]);
    }
    return is;
}

// Newtons on the body at t, where it has that velocity; false: not finite.
static bool find_force(const OdeRun *run, const OdeBody *body, double t, const double velocity[3],
                       double force[3]) {
    double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t}, turn[4];
    memset(force, 0, 3 * sizeof *force);
    if (!body->about->force) {
        return true;
    }
    find_pose(body, &in[IN_PX], turn);
    memcpy(&in[IN_WX], velocity, 3 * sizeof *in);
    run->evaluate(body->about->force, in, force);
    return all_finite(force, 3);
}

// The velocity between two steps, from those in their middles: so drag is of second order too. Not
// after a step in which something was hit.
static void predict_velocity(OdeBody *body, double velocity[3]) {
    dVector3 now;
    dBodyGetRelPointVel(body->id, -body->center[0], -body->center[1], -body->center[2], now);
    for (int k = 0; k < 3; k++) {
        velocity[k] = body->touches ? now[k] : now[k] + (now[k] - body->last[k]) / 2;
        body->last[k] = now[k];
    }
}

// Half a step early, so that velocities are those of the steps' middles.
static void start_body(const OdeRun *run, OdeBody *body) {
    const RigidBody *about = body->about;
    double force[3], v[3];
    dMass mass;
    dVector3 arm;
    set_pose(body, about->at, about->turn);
    sim_ode_start_spin(body, run->sim->step, about->spin);
    dBodyVectorToWorld(body->id, body->center[0], body->center[1], body->center[2], arm);
    const double *w = about->spin;
    const double around[3] = {w[1] * arm[2] - w[2] * arm[1], w[2] * arm[0] - w[0] * arm[2],
                              w[0] * arm[1] - w[1] * arm[0]};
    for (int k = 0; k < 3; k++) {
        v[k] = about->velocity[k] + around[k];
    }
    dBodySetLinearVel(body->id, v[0], v[1], v[2]);
    find_force(run, body, run->sim->low, about->velocity, force);
    dBodyGetMass(body->id, &mass);
    for (int k = 0; k < 3; k++) {
        double change = run->sim->step * (run->sim->gravity[k] + force[k] / mass.mass);
        v[k] -= change / 2;
        body->last[k] = about->velocity[k] - 1.5 * change;
    }
    dBodySetLinearVel(body->id, v[0], v[1], v[2]);
}

static bool make_body(OdeRun *run, OdeBody *body, const RigidBody *about) {
    const RigidShape *shapes = run->sim->shapes + about->first_shape;
    dMass mass;
    *body = (OdeBody){.about = about};
    dMassSetZero(&mass);
    for (uint32_t i = 0; i < about->n_shapes && !about->is_fixed; i++) {
        sim_ode_add_mass(&mass, &shapes[i], about->density);
    }
    if (!about->is_fixed || about->motion) {
        body->id = dBodyCreate(run->world);
    }
    if (about->is_fixed && about->motion) {
        dBodySetKinematic(body->id);
    } else if (!about->is_fixed) {
        if (!(mass.mass > 0)) {
            return false;
        }
        for (int k = 0; k < 3; k++) {
            body->center[k] = mass.c[k];
        }
        dMassTranslate(&mass, -mass.c[0], -mass.c[1], -mass.c[2]);
        memset(mass.c, 0, sizeof mass.c);
        if (about->mass > 0) {
            dMassAdjust(&mass, about->mass);
        }
        dBodySetMass(body->id, &mass);
        sim_ode_keep_inertia(body);
    }
    for (uint32_t i = 0; i < about->n_shapes; i++) {
        dGeomID geom = sim_ode_geom(run->space, &shapes[i]);
        if (!geom) {
            return false;
        }
        dGeomSetData(geom, body);
        place_geom(body, geom, &shapes[i]);
    }
    if (body->id && about->is_fixed) {
        set_pose(body, about->at, about->turn);
    } else if (body->id) {
        start_body(run, body);
    }
    return true;
}

// A fixed body that moves: there now, with the velocity that takes it to where it is next. False:
// it is nowhere.
static bool drive(const OdeRun *run, OdeBody *body, double t) {
    double now[RIGID_COLUMNS], next[RIGID_COLUMNS], h = run->sim->step;
    double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t};
    run->evaluate(body->about->motion, in, now);
    in[IN_T] = in[IN_FILM_T] = t + h;
    run->evaluate(body->about->motion, in, next);
    if (!all_finite(now, RIGID_COLUMNS) || !all_finite(next, RIGID_COLUMNS)) {
        return false;
    }
    set_pose(body, now, now + 3);
    dBodySetLinearVel(body->id, (next[0] - now[0]) / h, (next[1] - now[1]) / h,
                      (next[2] - now[2]) / h);
    // The turn between both, about its axis: q = next * conjugate(now).
    const double *a = next + 3, *b = now + 3;
    double x = a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1];
    double y = a[1] * b[3] - a[3] * b[1] - a[2] * b[0] + a[0] * b[2];
    double z = a[2] * b[3] - a[3] * b[2] - a[0] * b[1] + a[1] * b[0];
    double w = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    double sine = sqrt(x * x + y * y + z * z), sign = w < 0 ? -1 : 1;
    double rate = sine > 0 ? sign * 2 * atan2(sine, fabs(w)) / (sine * h) : 0;
    dBodySetAngularVel(body->id, x * rate, y * rate, z * rate);
    return true;
}

// ---- Joints and contacts

static void set_joint(dJointID joint, RigidJointKind kind, int parameter, double x) {
    if (kind == RIGID_HINGE) {
        dJointSetHingeParam(joint, parameter, x);
    } else if (kind == RIGID_SLIDER) {
        dJointSetSliderParam(joint, parameter, x);
    }
}

// Stops and strength. What has gone too far in a step comes back slowly, or it would bounce.
static void limit_joint(dJointID joint, const RigidJoint *about, double step) {
    const double come_back_time = 0.1;
    set_joint(joint, about->kind, dParamLoStop, about->low);
    set_joint(joint, about->kind, dParamHiStop, about->high);
    set_joint(joint, about->kind, dParamStopERP, fmin(0.2, step / come_back_time));
    set_joint(joint, about->kind, dParamFMax, about->strength);
}

// Towards their speeds of the step from t on. NULL, or the one whose speed is none.
static const RigidJoint *drive_joints(OdeRun *run, double t) {
    for (uint32_t i = 0; i < run->sim->n_joints; i++) {
        const RigidJoint *about = &run->sim->joints[i];
        double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t}, speed = 0;
        if (about->speed) {
            run->evaluate(about->speed, in, &speed);
            if (!isfinite(speed)) {
                return about;
            }
            set_joint(run->joints[i], about->kind, dParamVel, speed);
        }
    }
    return NULL;
}

static dJointID make_joint(OdeRun *run, const RigidJoint *about) {
    dBodyID a = about->a < 0 ? NULL : run->bodies[about->a].id;
    dBodyID b = about->b < 0 ? NULL : run->bodies[about->b].id;
    const double *p = about->at;
    double d[3] = {about->axis[0], about->axis[1], about->axis[2]};
    dJointID joint = NULL;
    // ODE has the world second, and turns motors round where it exchanges the two itself. What a
    // does against b about an axis, b does against a about the opposite one.
    if (!a) {
        a = b;
        b = NULL;
        for (int k = 0; k < 3; k++) {
            d[k] = -d[k];
        }
    }
    for (int i = 0; i < 2; i++) {
        int32_t body = i == 0 ? about->a : about->b;
        if (body >= 0) {
            run->bodies[body].is_jointed = true;
        }
    }
    switch (about->kind) {
    case RIGID_HINGE:
        joint = dJointCreateHinge(run->world, NULL);
        dJointAttach(joint, a, b);
        dJointSetHingeAnchor(joint, p[0], p[1], p[2]);
        dJointSetHingeAxis(joint, d[0], d[1], d[2]);
        break;
    case RIGID_BALL:
        joint = dJointCreateBall(run->world, NULL);
        dJointAttach(joint, a, b);
        dJointSetBallAnchor(joint, p[0], p[1], p[2]);
        break;
    case RIGID_SLIDER:
        joint = dJointCreateSlider(run->world, NULL);
        dJointAttach(joint, a, b);
        dJointSetSliderAxis(joint, d[0], d[1], d[2]);
        break;
    case RIGID_FIXED:
        joint = dJointCreateFixed(run->world, NULL);
        dJointAttach(joint, a, b);
        dJointSetFixed(joint);
        break;
    }
    limit_joint(joint, about, run->sim->step);
    return joint;
}

// ---- Steps

static bool put(OdeRun *run, const void *bytes, size_t n) {
    return fwrite(bytes, n, 1, run->out) == 1;
}

static bool refuse(OdeRun *run, uint32_t member, double time, const char *message) {
    RigidStep step = {.magic = RIGID_STREAM_MAGIC, .is_bad = 1, .member = member, .time = time};
    snprintf(step.message, sizeof step.message, "%s", message);
    put(run, &step, sizeof step);
    return false;
}

// False: the pipe is closed, or a body has run away.
static bool send_step(OdeRun *run, double t) {
    RigidStep step = {.magic = RIGID_STREAM_MAGIC};
    for (uint32_t m = 0; m < run->sim->n_members; m++) {
        const OdeBody *body = &run->bodies[run->sim->members[m]];
        const dReal *p = dBodyGetPosition(body->id), *v = dBodyGetLinearVel(body->id);
        for (int k = 0; k < 3; k++) {
            if (!(fabs(p[k]) < most_distance) || !(fabs(v[k]) < most_speed)) {
                return refuse(run, m, t, "it runs away: a shorter step, or less force, may help");
            }
        }
    }
    bool is_fine = put(run, &step, sizeof step);
    for (uint32_t m = 0; is_fine && m < run->sim->n_members; m++) {
        const OdeBody *body = &run->bodies[run->sim->members[m]];
        RigidState state;
        memset(&state, 0, sizeof state);
        dVector3 velocity;
        const dReal *spin = dBodyGetAngularVel(body->id);
        find_pose(body, state.at, state.turn);
        dBodyGetRelPointVel(body->id, -body->center[0], -body->center[1], -body->center[2],
                            velocity);
        memcpy(state.velocity, velocity, sizeof state.velocity);
        memcpy(state.spin, spin, sizeof state.spin);
        state.touches = body->touches;
        state.sleeps = !dBodyIsEnabled(body->id);
        is_fine = put(run, &state, sizeof state);
    }
    return is_fine;
}

static bool do_step(OdeRun *run, double t) {
    const SimRigid *sim = run->sim;
    for (uint32_t i = 0; i < sim->n_bodies; i++) {
        OdeBody *body = &run->bodies[i];
        double force[3], velocity[3];
        if (body->about->motion && !drive(run, body, t)) {
            char message[SIM_MESSAGE];
            snprintf(message, sizeof message, "the place of the fixed body %.100s is not finite",
                     body->about->name);
            return refuse(run, UINT32_MAX, t, message);
        } else if (body->about->force) {
            predict_velocity(body, velocity);
            if (!find_force(run, body, t, velocity, force)) {
                return refuse(run, body->member, t, "its force is not a finite number");
            }
            dBodyAddForce(body->id, force[0], force[1], force[2]);
        }
        if (!body->about->is_fixed) {
            sim_ode_spin(body, sim->step);
        }
        body->touches = false;
    }
    const RigidJoint *bad = drive_joints(run, t + sim->step / 2);
    if (bad) {
        char message[SIM_MESSAGE];
        snprintf(message, sizeof message, "the speed of the joint of %.100s is not a finite number",
                 sim->bodies[bad->a].name);
        return refuse(run, UINT32_MAX, t, message);
    }
    if (!sim_ode_touch(run)) {
        return refuse(run, UINT32_MAX, t, "there is no memory for its contacts");
    }
    dWorldQuickStep(run->world, sim->step);
    dJointGroupEmpty(run->contacts);
    return send_step(run, t + sim->step);
}

static bool set_up(OdeRun *run) {
    const SimRigid *sim = run->sim;
    run->world = dWorldCreate();
    run->space = dHashSpaceCreate(NULL);
    run->contacts = dJointGroupCreate(0);
    run->bodies = calloc(sim->n_bodies, sizeof *run->bodies);
    dRandSetSeed(sim->seed);
    dWorldSetGravity(run->world, sim->gravity[0], sim->gravity[1], sim->gravity[2]);
    dWorldSetQuickStepNumIterations(run->world, (int)sim->iterations);
    dWorldSetContactSurfaceLayer(run->world, 1e-4);
    dWorldSetContactMaxCorrectingVel(run->world, 1);
    dWorldSetAutoDisableFlag(run->world, 1);
    dWorldSetAutoDisableLinearThreshold(run->world, sleep_speed);
    dWorldSetAutoDisableAngularThreshold(run->world, sleep_spin);
    dWorldSetAutoDisableTime(run->world, sleep_time);
    dWorldSetAutoDisableSteps(run->world, 0);
    dWorldSetAutoDisableAverageSamplesCount(
        run->world, (unsigned)fmax(1, fmin(ceil(sleep_mean / sim->step), 1000)));
    for (uint32_t i = 0; run->bodies && i < sim->n_bodies; i++) {
        if (!make_body(run, &run->bodies[i], &sim->bodies[i])) {
            return false;
        }
    }
    for (uint32_t m = 0; run->bodies && m < sim->n_members; m++) {
        run->bodies[sim->members[m]].member = m;
        // What forces hold up or push is not to fall asleep at a standstill.
        if (sim->bodies[sim->members[m]].force) {
            dBodySetAutoDisableFlag(run->bodies[sim->members[m]].id, 0);
        }
    }
    run->joints = calloc(sim->n_joints + 1, sizeof *run->joints);
    for (uint32_t i = 0; run->bodies && run->joints && i < sim->n_joints; i++) {
        const RigidJoint *about = &sim->joints[i];
        run->joints[i] = make_joint(run, about);
        const int32_t ends[2] = {about->a, about->b};
        for (int k = 0; about->speed && k < 2; k++) { // nor is what a motor may move
            dBodyID body = ends[k] < 0 ? NULL : run->bodies[ends[k]].id;
            if (body) {
                dBodySetAutoDisableFlag(body, 0);
            }
        }
    }
    return run->bodies && run->joints;
}

int sim_ode_send(const SimRigid *sim, uint64_t n_steps, RigidEvaluate *evaluate, int fd) {
    OdeRun run = {.sim = sim, .evaluate = evaluate, .out = fdopen(fd, "wb")};
    if (!run.out || !dInitODE2(0) || !dAllocateODEDataForThread(dAllocateMaskAll)) {
        return 0;
    }
    bool is_fine = set_up(&run) && send_step(&run, sim->low);
    for (uint64_t i = 0; is_fine && i < n_steps; i++) {
        is_fine = do_step(&run, sim->low + (double)i * sim->step);
    }
    return fflush(run.out) == 0 && is_fine;
}
