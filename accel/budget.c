// SPDX-License-Identifier: Apache-2.0
// Memory under a bound.
#include "accel/budget.h"

#include <stdint.h>
#include <stdlib.h>

void *budget_resize(Budget *budget, void *array, size_t old, size_t size) {
    if (size == 0) {
        free(array);
        budget->used -= old;
        return NULL;
    }
    // Shrinking is done in place; growing may copy.
    size_t most = size > old ? budget->used + size : budget->used;
    if (size > SIZE_MAX / 4 || (budget->limit && most > budget->limit)) {
        return NULL;
    }
    void *resized = realloc(array, size);
    if (resized) {
        budget->peak = most > budget->peak ? most : budget->peak;
        budget->used += size - old;
    }
    return resized;
}
