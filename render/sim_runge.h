// SPDX-License-Identifier: Apache-2.0
// Steps of Dormand and Prince's Runge-Kutta method of order 5(4), and the polynomials of degree 4
// between their ends (Hairer, Norsett and Wanner, "Solving Ordinary Differential Equations I",
// 2nd ed. 1993, tables II.5.2 and equation II.6.12; their program DOPRI5).
//
// A step needs nothing of the one before, so that it may begin at any jump. The rates of its
// last stage are those of the first stage of the next.
#ifndef RENDER_SIM_RUNGE_H
#define RENDER_SIM_RUNGE_H

#include <stddef.h>

#include "render/sim.h"

enum { RUNGE_STAGES = 7, RUNGE_ORDER = 5 };

// The part of a step at which the rates k[stage][n] are wanted, one stage after another.
extern const double runge_time[RUNGE_STAGES];

// out[n]: where a stage >= 1 looks, from y at the beginning of a step so long and the rates of the
// stages before. That of the last stage is the result of the step.
void runge_look(uint32_t stage, double step, size_t n, const double *y, double *const k[],
                double *out);

// An estimate of the error of scalar i of the result, of order 4: too large where steps are short.
double runge_error(double step, double *const k[], size_t i);

// The way of scalar i from y to `to`, its result, on s = 0..1.
void runge_way(double step, double y, double to, double *const k[], size_t i,
               double coefficients[SIM_COEFFICIENTS]);

#endif
