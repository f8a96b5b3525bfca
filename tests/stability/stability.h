// SPDX-License-Identifier: Apache-2.0
// What the stability tests share: counts, failures that can be reproduced, every structure on every
// instruction set over one geometry.
//
// Seeds are fixed. A ray's random numbers depend on its test and its index alone, so any failing
// ray can be asked for again whatever the number of rays and threads.
#ifndef TESTS_STABILITY_STABILITY_H
#define TESTS_STABILITY_STABILITY_H

#include "tests/accel_scenes.h"

typedef struct {
    const char *name;
    bool is_stress;
    double scale;  // of all counts
    uint64_t seed; // of the test; scenes add to it
    uint64_t n_queries, n_checks, n_failed;
    char notes[2000];
} Run;

// How many rays: `quick` in every run of the tests, `stress` with STRESS=1, both times the scale.
uint64_t run_count(const Run *run, double quick, double stress);

// Counts a failure; the first few are printed. Any thread.
void run_fail(Run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
// What was left out, or measured; printed with the result.
void run_note(Run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
// A failure unless it holds. True: it does.
bool run_expect(Run *run, bool holds, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Calls for each index, on all threads; stops early after many failures.
typedef void RayFn(Run *run, void *context, uint64_t index, uint64_t *random);
void run_rays(Run *run, uint64_t n, RayFn *fn, void *context);

// Counts queries of this thread; run_rays() collects them.
void count_queries(uint64_t n);

// ---- Structures

typedef struct {
    const AccelType *type;
    const char *cpu;
    Accel *accel;
    AccelStats stats;
    uint64_t every; // asked one ray in so many, where a ray takes long
} Subject;

enum { MAX_SUBJECTS = 32 };

typedef struct {
    Subject at[MAX_SUBJECTS];
    int n;
    const Geometry *geometry;
    char label[160]; // the scene, well enough to make it again
} Subjects;

// Builds and validates every structure of accel_types[] on every instruction set of this machine.
// Those that need too long for a geometry of this size and motion are left out, with a note;
// options NULL: the default.
Subjects *subjects_new(Run *run, const Geometry *geometry, const AccelOptions *options,
                       const char *label, ...) __attribute__((format(printf, 4, 5)));
void subjects_free(Subjects *subjects);

// All answers must have the same bits, closest and occluded. *hit gets them.
bool subjects_ask(Run *run, const Subjects *subjects, const AccelRay *ray, uint64_t index,
                  AccelHit *hit);
// And must be what the oracle allows (tests/stability/oracle.h).
bool subjects_check(Run *run, const Subjects *subjects, const AccelRay *ray, uint64_t index,
                    AccelHit *hit);

// A ray or a hit as C initializers with all bits, in a buffer of the calling thread.
const char *ray_text(const AccelRay *ray);
const char *hit_text(bool is_hit, const AccelHit *hit);

#define TEST(function, what) void test_##function(Run *run);
#include "tests/stability/tests.def"
#undef TEST

#endif
