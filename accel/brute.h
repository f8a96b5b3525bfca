// SPDX-License-Identifier: Apache-2.0
// No structure at all: every primitive is tested. What the others are compared with.
// The functions are those of AccelType.
#ifndef ACCEL_BRUTE_H
#define ACCEL_BRUTE_H

#include "accel/accel.h"

Accel *brute_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats);
bool brute_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit, AccelCounters *count);
bool brute_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count);
bool brute_validate(const Accel *accel, char *why, size_t n);
void brute_destroy(Accel *accel);

#endif
