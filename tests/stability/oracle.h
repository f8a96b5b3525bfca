// SPDX-License-Identifier: Apache-2.0
// The oracle with certainty: a ray against every triangle in double, with bounds on what the float
// kernels may have rounded. It says of each triangle whether it is surely hit, surely not, or too
// close to tell, and within which distances; so no test needs a tolerance.
#ifndef TESTS_STABILITY_ORACLE_H
#define TESTS_STABILITY_ORACLE_H

#include "tests/stability/stability.h"

typedef enum { SURELY_NOT, MAYBE, SURELY } Certainty;

typedef struct {
    Certainty is_met;
    double lo, hi;      // distances
    double u, v, slack; // weights and how far they may be off; SURELY only
} Meeting;

// Vertices relative to the origin, with bounds on the error of each coordinate; a direction, too.
typedef struct {
    double a[3][3], ea[3][3], d[3], ed[3];
} Meet;

Meeting meet_triangle(const Meet *m);

// One triangle or sphere of a geometry, with the kernels' roundings.
Meeting meet_prim(const Geometry *geometry, const AccelRay *ray, uint32_t prim);

// Among what may be met, whether the answer is right: allowed by what it names, and nothing that is
// surely met surely lies before it. False: *why says what is wrong.
typedef Meeting MeetFn(const void *context, uint32_t prim);
bool oracle_allows(MeetFn *meet, const void *context, uint32_t n_prims, double tmin, double tmax,
                   bool is_hit, double t, uint32_t prim, char *why, size_t n);

bool oracle_allows_hit(const Geometry *geometry, const AccelRay *ray, bool is_hit,
                       const AccelHit *hit, char *why, size_t n);

#endif
