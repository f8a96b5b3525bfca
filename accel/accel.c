// SPDX-License-Identifier: Apache-2.0
// The table of structures, and what all of them share.
#include "accel/accel.h"

#include "accel/brute.h"
#include "accel/kd4_accel.h"
#include "accel/wide.h"

#include <string.h>

const char *const leaf_reason_names[LEAF_REASONS] = {
    [LEAF_BY_MEMORY] = "memory", [LEAF_BY_DEPTH] = "depth", [LEAF_BY_DEGENERATE] = "degenerate",
    [LEAF_BY_SIZE] = "size",     [LEAF_BY_COST] = "cost",   [LEAF_BY_EMPTY] = "empty",
};

const AccelType accel_types[] = {
    {"bvh16", "16-wide nodes of moving boxes over clusters, split by object and in time",
     wide_build, wide_closest, wide_occluded, wide_validate, wide_destroy},
    {"kd4-thesis", "4D kd-tree over segments of motion, as in Olsson's thesis of 2007",
     kd4_accel_build, kd4_accel_closest, kd4_accel_occluded, kd4_accel_validate, kd4_accel_destroy},
    {"kd3", "3D kd-tree over the same segments, never split in time", kd3_accel_build,
     kd4_accel_closest, kd4_accel_occluded, kd4_accel_validate, kd4_accel_destroy},
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
