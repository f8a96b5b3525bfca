// SPDX-License-Identifier: Apache-2.0
// What tests/bench/bench_sim.sh measures against: the loops that one would write by hand around ODE
// and CVODE, for the same bodies and equations. bench-sim pile|sparks N SPAN prints
// processor seconds, bytes (a pose or a state for each step) and a figure to compare.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <ode/ode.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

static double processor_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

static void print_result(double begin, double bytes, double figure) {
    printf("%.3f %.0f %.6g\n", processor_seconds() - begin, bytes, figure);
}

// ---- A pile: as in the script, columns of turned boxes between four walls

enum { SIDE = 10, MOST_CONTACTS = 8 };

typedef struct {
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
} Pile;

static void touch(void *data, dGeomID a, dGeomID b) {
    Pile *pile = data;
    dContact contact[MOST_CONTACTS];
    int n = dCollide(a, b, MOST_CONTACTS, &contact[0].geom, sizeof contact[0]);
    for (int i = 0; i < n; i++) {
        contact[i].surface = (dSurfaceParameters){.mode = dContactApprox1, .mu = 0.6};
        dJointID joint = dJointCreateContact(pile->world, pile->contacts, &contact[i]);
        dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    }
}

static dBodyID make_box(Pile *pile, int i) {
    dBodyID body = dBodyCreate(pile->world);
    dMass mass;
    dMatrix3 turn;
    int column = i % SIDE, row = i / SIDE % SIDE, layer = i / (SIDE * SIDE);
    dMassSetBox(&mass, 1000, 0.3, 0.3, 0.3);
    dBodySetMass(body, &mass);
    dRFromAxisAndAngle(turn, 0, 1, 0, i * 2.4);
    dBodySetRotation(body, turn);
    dBodySetPosition(body, 0.45 * (column - 4.5) + 0.04 * sin(7.0 * i), 0.3 + 0.4 * layer,
                     0.45 * (row - 4.5) + 0.04 * cos(5.0 * i));
    dGeomSetBody(dCreateBox(pile->space, 0.3, 0.3, 0.3), body);
    return body;
}

// The figure: the farthest that a box moves in the second half.
static void run_pile(int n, double span) {
    const double step = 1.0 / 240, begin = processor_seconds();
    double(*before)[3] = calloc((size_t)n, sizeof *before), bytes = 0, most = 0;
    dBodyID *bodies = calloc((size_t)n, sizeof *bodies);
    dInitODE();
    Pile pile = {dWorldCreate(), dHashSpaceCreate(NULL), dJointGroupCreate(0)};
    dWorldSetGravity(pile.world, 0, -9.81, 0);
    dWorldSetQuickStepNumIterations(pile.world, 40);
    dWorldSetContactSurfaceLayer(pile.world, 1e-4);
    dWorldSetContactMaxCorrectingVel(pile.world, 1);
    dWorldSetAutoDisableFlag(pile.world, 1);
    dWorldSetAutoDisableTime(pile.world, 0.5);
    dCreatePlane(pile.space, 0, 1, 0, 0);
    for (int k = 0; k < 4; k++) {
        dGeomID wall = dCreateBox(pile.space, k % 2 ? 8 : 0.2, 8, k % 2 ? 0.2 : 8);
        dGeomSetPosition(wall, k % 2 ? 0 : 2.5 * (k - 1), 2, k % 2 ? 2.5 * (k - 2) : 0);
    }
    for (int i = 0; i < n; i++) {
        bodies[i] = make_box(&pile, i);
    }
    int n_steps = (int)ceil(span / step);
    for (int k = 0; k < n_steps; k++) {
        dSpaceCollide(pile.space, &pile, touch);
        dWorldQuickStep(pile.world, step);
        dJointGroupEmpty(pile.contacts);
        bytes += n * 7.0 * sizeof(double);
        for (int i = 0; i < n && k >= n_steps / 2; i++) {
            const dReal *p = dBodyGetPosition(bodies[i]);
            double d[3];
            for (int c = 0; c < 3; c++) {
                before[i][c] = k == n_steps / 2 ? p[c] : before[i][c];
                d[c] = p[c] - before[i][c];
            }
            most = fmax(most, sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        }
    }
    print_result(begin, bytes, most);
    free(before);
    free(bodies);
}

// ---- Sparks: each by itself, with its bounces found as roots

static int spark_rates(sunrealtype t, N_Vector y, N_Vector rates, void *data) {
    const double *s = N_VGetArrayPointer(y);
    double *out = N_VGetArrayPointer(rates);
    (void)t, (void)data;
    for (int k = 0; k < 3; k++) {
        out[k] = s[3 + k];
        out[3 + k] = -0.2 * s[3 + k] - (k == 1 ? 9.81 : 0);
    }
    return 0;
}

static int spark_height(sunrealtype t, N_Vector y, sunrealtype *height, void *data) {
    (void)t, (void)data;
    height[0] = N_VGetArrayPointer(y)[1];
    return 0;
}

// The figure: the lowest height of any spark.
static void run_sparks(int n, double span) {
    double begin = processor_seconds(), bytes = 0, lowest = 0;
    SUNContext context;
    SUNContext_Create(NULL, &context);
    N_Vector y = N_VNew_Serial(6, context);
    double *s = N_VGetArrayPointer(y), t;
    const int falling = -1;
    void *cvode = CVodeCreate(CV_ADAMS, context);
    CVodeInit(cvode, spark_rates, 0, y);
    CVodeSStolerances(cvode, 1e-8, 1e-8);
    SUNNonlinearSolver iteration = SUNNonlinSol_FixedPoint(y, 0, context);
    CVodeSetNonlinearSolver(cvode, iteration);
    CVodeRootInit(cvode, 1, spark_height);
    CVodeSetRootDirection(cvode, (int *)&falling);
    for (int i = 0; i < n; i++) {
        const double start[6] = {0, 1, 0, 2 * cos(2.4 * i), 3 + sin(7.0 * i), 2 * sin(2.4 * i)};
        t = fmin(2.0 * i / n, span);
        memcpy(s, start, sizeof start);
        double hits[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
        int n_hits = 0;
        CVodeReInit(cvode, t, y);
        while (t < span) {
            CVodeSetStopTime(cvode, span);
            int code = CVode(cvode, span, y, &t, CV_ONE_STEP);
            bytes += 7 * sizeof(double);
            lowest = fmin(lowest, s[1]);
            if (code < 0) {
                break;
            }
            if (code == CV_ROOT_RETURN) {
                s[1] = 1e-9; // at 0 CVODE would not see it fall again
                s[4] *= -0.6;
                CVodeReInit(cvode, t, y);
                if (t - hits[n_hits % 8] < 1e-4 * span && n_hits >= 8) {
                    break; // as in st4, it rests
                }
                hits[n_hits++ % 8] = t;
            }
        }
    }
    print_result(begin, bytes, lowest);
    CVodeFree(&cvode);
    SUNNonlinSolFree(iteration);
    N_VDestroy(y);
    SUNContext_Free(&context);
}

int main(int argc, char **argv) {
    if (argc != 4 || atoi(argv[2]) < 1 || !(atof(argv[3]) > 0)) {
        fprintf(stderr, "usage: bench-sim pile|sparks N SPAN\n");
        return 2;
    }
    if (strcmp(argv[1], "pile") == 0) {
        run_pile(atoi(argv[2]), atof(argv[3]));
    } else {
        run_sparks(atoi(argv[2]), atof(argv[3]));
    }
    return 0;
}
