// SPDX-License-Identifier: Apache-2.0
// The structures of a world, each built when the first ray comes to its form: what no ray meets is
// never built. A single form is built at once, by all threads, since rays would only wait for it;
// and so is everything that is to be validated.
//
// What is built does not depend on when, nor on the threads.
#ifndef RENDER_BUILDS_H
#define RENDER_BUILDS_H

#include "render/form.h"

enum { BUILDS_MESSAGE = 256 };

typedef struct Builds Builds;

// The forms stay the caller's. memory: bytes for the arrays and structures of all of them. NULL: a
// structure could not be built, why[BUILDS_MESSAGE] is a sentence.
Builds *builds_new(Form *const *forms, uint32_t n, const RenderOptions *options, size_t memory,
                   char *why);
void builds_destroy(Builds *builds);

// For a form that is not built: builds it, if a ray (in its own frame) meets its bounds.
const Accel *builds_ask(Builds *builds, Form *form, const AccelRay *ray);

// The structure over a form that a ray (in its own frame) comes to; from any threads. NULL: the ray
// misses it, or there is no memory (see builds_failure).
static inline const Accel *builds_accel(Builds *builds, Form *form, const AccelRay *ray) {
    bool is_built = atomic_load_explicit(&form->is_built, memory_order_acquire);
    return is_built ? form->accel : builds_ask(builds, form, ray);
}

// NULL: all went well so far. Else a sentence; the pictures since then are worth nothing.
const char *builds_failure(const Builds *builds);

// Seconds that all threads together have spent on building and on waiting for it since rays began.
double builds_waited(const Builds *builds);

#endif
