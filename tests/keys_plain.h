// SPDX-License-Identifier: Apache-2.0
// An implementation of `keys` tables of numbers for the tests, by other formulas than the one that
// is tested: smooth spans by Barry and Goldman's pyramid, eases by integrating the speed, Bezier
// curves by bisection, springs by Runge and Kutta, continued ends by difference quotients.
#ifndef TESTS_KEYS_PLAIN_H
#define TESTS_KEYS_PLAIN_H

#include "lang/keys.h"

enum { MAX_KEYS = 9 };

typedef struct {
    uint32_t n;
    double times[MAX_KEYS], values[MAX_KEYS];
    KeysMode modes[MAX_KEYS];
    KeysEnd before, after;
} Plain;

extern uint64_t plain_seed; // of all that is random here
uint32_t plain_int(uint32_t n);
double plain_real(double lo, double hi);

// Any modes and ends; one mode for all spans in every third round, equal ends in every fourth.
Plain plain_random(int round);
double plain_value(const Plain *p, double t);
void plain_print(const Plain *p);

#endif
