// SPDX-License-Identifier: Apache-2.0
// The table of structures, and what all of them share.
#include "accel/accel.h"

#include "accel/brute.h"

#include <string.h>

const char *const leaf_reason_names[LEAF_REASONS] = {
    [LEAF_BY_MEMORY] = "memory", [LEAF_BY_DEPTH] = "depth", [LEAF_BY_DEGENERATE] = "degenerate",
    [LEAF_BY_SIZE] = "size",     [LEAF_BY_COST] = "cost",   [LEAF_BY_EMPTY] = "empty",
};

const AccelType accel_types[] = {
    {"brute", "no structure: every ray is tested against every primitive", brute_build,
     brute_closest, brute_occluded, brute_validate, brute_destroy},
    {NULL},
};

const AccelType *accel_find(const char *name) {
    const AccelType *type = accel_types;
    while (type->name && strcmp(type->name, name) != 0) {
        type++;
    }
    return type->name ? type : NULL;
}

AccelOptions accel_options_default(void) {
    return (AccelOptions){.kappa = 2, .leaf_size = 8, .split_time = true, .n_threads = 1};
}
