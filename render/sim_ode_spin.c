// SPDX-License-Identifier: Apache-2.0
// How bodies turn by themselves, ODE's own way of it being of first order: by the implicit midpoint
// rule, which keeps the angular momentum of what is free.
//
// In a step of length h ODE turns a body by the angle 2 atan(h |w| / 2) about w, its angular
// velocity after the torques. That is to be the one of the middle, where it has turned by half of
// that: the angular momentum by the inertia there. The torque that makes it so is added.
#include "render/sim_ode_parts.h"

#include <math.h>
#include <string.h>

void sim_ode_keep_inertia(OdeBody *body) {
    dMass mass;
    dBodyGetMass(body->id, &mass);
    memcpy(body->inertia, mass.I, sizeof body->inertia);
    body->is_round = true;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            double alike = i == k ? mass.I[0] : 0;
            body->is_round = body->is_round && fabs(mass.I[4 * i + k] - alike) <= 1e-9 * mass.I[0];
        }
    }
    dInvertPDMatrix(mass.I, body->inverse, 3);
    dBodySetGyroscopicMode(body->id, 0);
}

// R m R* w, as a body is when it has turned on by its spin for a part of the step h, half of which
// it is with 1.
static void apply(const OdeBody *body, const dMatrix3 m, const double spin[3], double part,
                  double h, const double w[3], double out[3]) {
    double speed = sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]);
    double half = atan(part * h * speed / 2) / 2, sine = speed > 0 ? sin(half) / speed : 0;
    const dQuaternion turn = {cos(half), sine * spin[0], sine * spin[1], sine * spin[2]};
    dQuaternion q;
    dMatrix3 r;
    dVector3 own, result;
    dQMultiply0(q, turn, dBodyGetQuaternion(body->id));
    dQtoR(q, r);
    dMultiply1_331(own, r, w);
    dMultiply0_331(result, m, own);
    dMultiply0_331(own, r, result);
    memcpy(out, own, 3 * sizeof *out);
}

// The spin of the middle of a step, after now (part 1) or before (-1), with that angular momentum.
static void find_spin(const OdeBody *body, const double momentum[3], double part, double h,
                      double spin[3]) {
    for (int i = 0; i < 4; i++) { // each time nearer by about h |w|
        double last[3];
        memcpy(last, spin, sizeof last);
        apply(body, body->inverse, last, part, h, momentum, spin);
    }
}

void sim_ode_start_spin(OdeBody *body, double h, const double now[3]) {
    double momentum[3], spin[3];
    memcpy(spin, now, sizeof spin);
    if (!body->is_round) {
        apply(body, body->inertia, now, 0, h, now, momentum);
        find_spin(body, momentum, -1, h, spin);
    }
    dBodySetAngularVel(body->id, spin[0], spin[1], spin[2]);
}

void sim_ode_spin(OdeBody *body, double h) {
    const dReal *before = dBodyGetAngularVel(body->id);
    double momentum[3], spin[3], change[3], torque[3];
    if (body->is_round || !dBodyIsEnabled(body->id)) {
        return;
    }
    memcpy(spin, before, sizeof spin);
    apply(body, body->inertia, before, -1, h, before, momentum);
    find_spin(body, momentum, 1, h, spin);
    for (int k = 0; k < 3; k++) {
        change[k] = (spin[k] - before[k]) / h;
    }
    apply(body, body->inertia, spin, 0, h, change, torque);
    dBodyAddTorque(body->id, torque[0], torque[1], torque[2]);
}
