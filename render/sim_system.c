// SPDX-License-Identifier: Apache-2.0
// The one file that knows SUNDIALS.
#include "render/sim_system.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "render/sim_equations.h"
#include "render/sim_state_parts.h"

struct SimSolver {
    SUNContext context;
    N_Vector y, other; // other: where the solution is asked for
    void *cvode;
    SUNNonlinearSolver iteration;
    SUNLinearSolver linear;
    SimEquations *equations;
    SimMembers members; // of the system
    uint32_t alone;     // the one, where they are not all
    uint8_t *is_still;  // [n]
    double *fits;       // [n_states * n][SIM_COEFFICIENTS]
    double from, to;    // of the fits
    double *last, *now; // [n_whens][n]: conditions at the end of the last step, and later
    double end;         // where it stops
};

const char *sim_state_library(void) {
    return "SUNDIALS CVODE " SUNDIALS_VERSION;
}

// ---- What CVODE asks for

static void set_live(SimSystem *s, const double *y) {
    for (uint32_t k = 0; k < s->sim->n_states; k++) {
        memcpy(s->sim->live + (size_t)k * s->sim->n_members + s->first, y + (size_t)k * s->n,
               s->n * sizeof *y);
    }
}

static void find_rates(SimSystem *s, double t, const double *y, double *out) {
    size_t n = (size_t)s->sim->n_states * s->n;
    set_live(s, y);
    sim_equations_rates(s->solver->equations, t, s->solver->members, s->solver->members, out);
    for (size_t i = 0; i < n; i++) {
        out[i] = s->solver->is_still[i % s->n] ? 0 : out[i];
    }
}

static int give_rates(sunrealtype t, N_Vector y, N_Vector rates, void *data) {
    SimSystem *s = data;
    double *out = N_VGetArrayPointer(rates);
    size_t n = (size_t)s->sim->n_states * s->n;
    find_rates(s, t, N_VGetArrayPointer(y), out);
    size_t bad = sim_first_infinite(out, n);
    if (bad < n) {
        s->bad_member = (uint32_t)(bad % s->n);
    }
    return bad < n; // a shorter step may help
}

// [n_whens][n] of the state y at t.
static void find_conditions(SimSystem *s, double t, const double *y, double *out) {
    if (!s->sim->n_whens) {
        return;
    }
    set_live(s, y);
    sim_equations_conditions(s->solver->equations, t, s->solver->members, s->solver->members, out);
    for (size_t i = 0; i < (size_t)s->sim->n_whens * s->n; i++) {
        out[i] = s->solver->is_still[i % s->n] ? 1 : out[i];
    }
}

static void be_silent(int code, const char *module, const char *function, char *message,
                      void *data) {
    (void)code, (void)module, (void)function, (void)message, (void)data;
}

// ---- Beginning and end

static bool set_up(SimSystem *s) {
    struct SimSolver *v = s->solver;
    const SimState *sim = s->sim;
    v->cvode = CVodeCreate(sim->is_stiff ? CV_BDF : CV_ADAMS, v->context);
    bool is_fine =
        v->cvode && CVodeSetErrHandlerFn(v->cvode, be_silent, NULL) == CV_SUCCESS &&
        CVodeInit(v->cvode, give_rates, 0, v->y) == CV_SUCCESS &&
        CVodeSStolerances(v->cvode, 0.01 * sim->tolerance, 0.01 * sim->tolerance) == CV_SUCCESS &&
        CVodeSetUserData(v->cvode, s) == CV_SUCCESS;
    if (is_fine && sim->is_stiff) {
        v->linear = SUNLinSol_SPGMR(v->y, SUN_PREC_NONE, 0, v->context);
        is_fine = v->linear && CVodeSetLinearSolver(v->cvode, v->linear, NULL) == CV_SUCCESS;
    } else if (is_fine) {
        v->iteration = SUNNonlinSol_FixedPoint(v->y, 0, v->context);
        is_fine = v->iteration && CVodeSetNonlinearSolver(v->cvode, v->iteration) == CV_SUCCESS;
    }
    return is_fine;
}

SimSystem *sim_system_new(const SimState *sim, uint32_t n) {
    SimSystem *s = calloc(1, sizeof *s);
    struct SimSolver *v = calloc(1, sizeof *v);
    size_t size = (size_t)sim->n_states * n;
    if (!s || !v || size > INT32_MAX) {
        free(s);
        free(v);
        return NULL;
    }
    *s = (SimSystem){.sim = sim, .n = n, .solver = v};
    s->roots = calloc((size_t)sim->n_whens * n + 1, sizeof *s->roots);
    v->equations = sim_equations_new(sim);
    v->members = (SimMembers){n == 1 ? &v->alone : NULL, n};
    v->is_still = calloc(n, 1);
    v->fits = calloc(size * SIM_COEFFICIENTS, sizeof *v->fits);
    v->last = calloc((size_t)sim->n_whens * n + 1, sizeof *v->last);
    v->now = calloc((size_t)sim->n_whens * n + 1, sizeof *v->now);
    bool is_fine = s->roots && v->equations && v->is_still && v->fits && v->last && v->now &&
                   SUNContext_Create(NULL, &v->context) == 0;
    v->y = is_fine ? N_VNew_Serial((sunindextype)size, v->context) : NULL;
    v->other = is_fine ? N_VNew_Serial((sunindextype)size, v->context) : NULL;
    if (!v->y || !v->other || !set_up(s)) {
        sim_system_free(s);
        return NULL;
    }
    s->y = N_VGetArrayPointer(v->y);
    return s;
}

void sim_system_free(SimSystem *s) {
    if (!s) {
        return;
    }
    struct SimSolver *v = s->solver;
    CVodeFree(&v->cvode);
    if (v->linear) {
        SUNLinSolFree(v->linear);
    }
    if (v->iteration) {
        SUNNonlinSolFree(v->iteration);
    }
    if (v->y) {
        N_VDestroy(v->y);
    }
    if (v->other) {
        N_VDestroy(v->other);
    }
    SUNContext_Free(&v->context);
    sim_equations_free(v->equations);
    free(v->is_still);
    free(v->fits);
    free(v->last);
    free(v->now);
    free(v);
    free(s->roots);
    free(s);
}

// Whether all states are finite; else who has one that is not.
static bool is_finite(SimSystem *s) {
    size_t n = (size_t)s->sim->n_states * s->n, bad = sim_first_infinite(s->y, n);
    s->bad_member = bad < n ? (uint32_t)(bad % s->n) : 0;
    return bad == n;
}

bool sim_system_start(SimSystem *s) {
    for (uint32_t j = 0; j < s->n; j++) {
        sim_system_be_there(s, j, true);
    }
    s->solver->alone = s->first;
    sim_equations_start(s->solver->equations, s->solver->members, s->y);
    s->message = SIM_NO_START;
    return is_finite(s);
}

// ---- Steps

void sim_system_restart(SimSystem *s, double t, double end, double first_step) {
    struct SimSolver *v = s->solver;
    CVodeReInit(v->cvode, t, v->y);
    CVodeSetStopTime(v->cvode, end);
    CVodeSetInitStep(v->cvode, first_step < end - t ? first_step : 0);
    v->end = end;
    find_conditions(s, t, s->y, v->last);
}

// Whether any condition that did not hold at the last look holds at t.
static bool has_changed(SimSystem *s, double t) {
    struct SimSolver *v = s->solver;
    bool is = false;
    if (CVodeGetDky(v->cvode, t, 0, v->other) != CV_SUCCESS) {
        return false;
    }
    find_conditions(s, t, N_VGetArrayPointer(v->other), v->now);
    for (size_t i = 0; i < (size_t)s->sim->n_whens * s->n; i++) {
        is = is || (v->last[i] >= 0 && v->now[i] < 0);
    }
    return is;
}

// The first change within a step, narrowed down to neighbouring instants. CVODE's own search looks
// at the ends of a step alone, and not at what begins at 0, as a ball does that has just bounced.
static bool find_event(SimSystem *s, double from, double *to) {
    enum { LOOKS = 8 };
    struct SimSolver *v = s->solver;
    size_t n = (size_t)s->sim->n_whens * s->n;
    double low = from, high = *to;
    bool is_found = false;
    for (int k = 1; k <= LOOKS && !is_found; k++) {
        low = high < *to ? high : from;
        high = k < LOOKS ? from + (*to - from) * k / LOOKS : *to;
        is_found = has_changed(s, high);
        if (!is_found) {
            memcpy(v->last, v->now, n * sizeof *v->last);
        }
    }
    if (!is_found) {
        return false;
    }
    for (double middle = low + (high - low) / 2; low < middle && middle < high;
         middle = low + (high - low) / 2) {
        if (has_changed(s, middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    has_changed(s, high);
    for (size_t i = 0; i < n; i++) {
        s->roots[i] = v->last[i] >= 0 && v->now[i] < 0;
    }
    memcpy(s->y, N_VGetArrayPointer(v->other), (size_t)s->sim->n_states * s->n * sizeof *s->y);
    *to = high;
    return true;
}

SimStep sim_system_step(SimSystem *s, double *t) {
    struct SimSolver *v = s->solver;
    double from = *t;
    int code = CVode(v->cvode, v->end, v->y, t, CV_ONE_STEP);
    switch (code) {
    case CV_SUCCESS:
    case CV_TSTOP_RETURN:
        return s->sim->n_whens && find_event(s, from, t) ? SIM_STEP_EVENT : SIM_STEP_ON;
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
        s->message = SIM_NOT_FINITE;
        return SIM_STEP_FAILED;
    default:
        s->message = SIM_NO_LONGER;
        return SIM_STEP_FAILED;
    }
}

// ---- Interpolation

static bool solution(SimSystem *s, double t, int order, double *out) {
    struct SimSolver *v = s->solver;
    if (CVodeGetDky(v->cvode, t, order, v->other) != CV_SUCCESS) {
        return false;
    }
    memcpy(out, N_VGetArrayPointer(v->other), (size_t)s->sim->n_states * s->n * sizeof *out);
    return true;
}

bool sim_system_interpolate(SimSystem *s, double from, double to) {
    struct SimSolver *v = s->solver;
    size_t n = (size_t)s->sim->n_states * s->n;
    double *x = malloc(6 * n * sizeof *x), length = to - from;
    bool is_fine = x && solution(s, from, 0, x) && solution(s, to, 0, x + n) &&
                   solution(s, from, 1, x + 2 * n) && solution(s, to, 1, x + 3 * n) &&
                   solution(s, from + length / 3, 0, x + 4 * n) &&
                   solution(s, from + 2 * length / 3, 0, x + 5 * n);
    for (size_t i = 0; is_fine && i < n; i++) {
        sim_quintic(x[i], x[i + n], x[i + 2 * n] * length, x[i + 3 * n] * length, x[i + 4 * n],
                    x[i + 5 * n], v->fits + i * SIM_COEFFICIENTS);
    }
    v->from = from;
    v->to = to;
    free(x);
    return is_fine;
}

const double *sim_system_fit(const SimSystem *s, uint32_t i) {
    return s->solver->fits + (size_t)i * SIM_COEFFICIENTS;
}

double sim_system_miss(SimSystem *s) {
    static const double places[3] = {1.0 / 6, 0.5, 5.0 / 6};
    struct SimSolver *v = s->solver;
    size_t n = (size_t)s->sim->n_states * s->n;
    double most = 0;
    for (int k = 0; k < 3; k++) {
        if (CVodeGetDky(v->cvode, v->from + places[k] * (v->to - v->from), 0, v->other)) {
            return 0;
        }
        const double *x = N_VGetArrayPointer(v->other);
        for (size_t i = 0; i < n; i++) {
            double own =
                sim_polynomial(sim_system_fit(s, (uint32_t)i), SIM_COEFFICIENTS, places[k]);
            most = fmax(most, fabs(own - x[i]) / fmax(1, fabs(x[i])));
        }
    }
    return most;
}

void sim_system_rates(SimSystem *s, double t, double *out) {
    find_rates(s, t, s->y, out);
}

// ---- Events

void sim_system_conditions(SimSystem *s, double t, double *out) {
    find_conditions(s, t, s->y, out);
}

bool sim_system_assign(SimSystem *s, double t, const uint8_t *fires) {
    set_live(s, s->y);
    sim_equations_assign(s->solver->equations, t, s->solver->members, s->solver->members, fires,
                         s->y);
    return is_finite(s);
}

void sim_system_rest(SimSystem *s, uint32_t j) {
    s->solver->is_still[j] = 1;
}

void sim_system_be_there(SimSystem *s, uint32_t j, bool is) {
    s->solver->is_still[j] = !is;
    if (s->sim->there) {
        s->sim->there[s->first + j] = is;
    }
}
