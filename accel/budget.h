// SPDX-License-Identifier: Apache-2.0
// Memory under a bound: what the builders of structures take from the system is counted to the
// byte, and refused where the bound would be passed, so that they can build something coarser.
#ifndef ACCEL_BUDGET_H
#define ACCEL_BUDGET_H

#include <stddef.h>

typedef struct {
    size_t limit; // 0: none
    size_t used, peak;
} Budget;

// As realloc() from old to size bytes, contents kept; while it lasts both count. size 0 frees.
// NULL: refused, by the bound or by the system, and array is as it was.
void *budget_resize(Budget *budget, void *array, size_t old, size_t size);

#endif
