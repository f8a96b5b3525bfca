// SPDX-License-Identifier: Apache-2.0
// Structures on demand.
#include "render/builds.h"

#include <omp.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "accel/clock.h"
#include "render/assemble.h"

enum {
    LOCKS = 64,         // forms share them by number
    SHARED_FROM = 65536 // primitives times keys from which all threads build one form
};

struct Builds {
    const AccelType *type;
    AccelOptions options;
    bool validate;
    size_t memory; // for structures
    double weight; // of all forms
    pthread_mutex_t locks[LOCKS];
    atomic_ullong waited; // nanoseconds
    atomic_bool has_failed;
    char why[BUILDS_MESSAGE];
};

// Half of the memory is for structures once they are built, to each its share as is the work in it.
// The other half is for building, which takes several times as much for a moment: an equal part for
// each thread, so that which of them builds what has no say in what is built.
static double weight_of(const Form *form) {
    return (double)form->n_prims * form->geometry.n_keys;
}

// False after the first failure of all has left its sentence.
static bool build(Builds *builds, Form *form, uint32_t n_threads) {
    char why[BUILDS_MESSAGE] = "";
    AccelOptions options = builds->options;
    options.n_threads = n_threads;
    if (options.memory == 0) {
        double share = builds->weight > 0 ? weight_of(form) / builds->weight : 1;
        options.kept = (size_t)((double)builds->memory / 2 * share) + 4096;
        options.memory = options.kept + builds->memory / 2 / builds->options.n_threads;
    }
    bool is_built = form_build(form, builds->type, &options, builds->validate, why, sizeof why);
    if (!is_built && !atomic_exchange(&builds->has_failed, true)) {
        memcpy(builds->why, why, sizeof why);
    }
    return is_built;
}

// Few forms are built one after the other by all threads, many by one thread each.
static void build_all(Builds *builds, Form *const *forms, uint32_t n) {
    uint32_t n_threads = builds->options.n_threads;
    uint32_t across = n >= 2 * n_threads ? n_threads : 1;
#pragma omp parallel for schedule(dynamic) num_threads(across)
    for (uint32_t i = 0; i < n; i++) {
        build(builds, forms[i], across > 1 ? 1 : n_threads);
    }
}

Builds *builds_new(Form *const *forms, uint32_t n, const RenderOptions *options, size_t memory,
                   char *why) {
    Builds *builds = calloc(1, sizeof *builds);
    if (!builds) {
        snprintf(why, BUILDS_MESSAGE, "no memory for structures");
        return NULL;
    }
    builds->type = options->accel;
    builds->options = options->accel_options;
    builds->options.n_threads = options->n_threads;
    builds->validate = options->validate;
    size_t arrays = 0;
    for (uint32_t i = 0; i < n; i++) {
        builds->weight += weight_of(forms[i]);
        arrays += form_array_bytes(forms[i]);
        forms[i]->reach = bounds_empty();
        for (uint32_t key = 0; key < forms[i]->geometry.n_keys; key++) {
            forms[i]->reach = bounds_join(forms[i]->reach, forms[i]->bounds[key]);
        }
    }
    // Trees get what the arrays leave, and at least a quarter: a single frame may need too much.
    builds->memory = arrays < memory - memory / 4 ? memory - arrays : memory / 4;
    for (int i = 0; i < LOCKS; i++) {
        pthread_mutex_init(&builds->locks[i], NULL);
    }
    omp_set_max_active_levels(2); // threads that trace build by all threads
    if (n == 1 || builds->validate) {
        build_all(builds, forms, n);
    }
    if (builds_failure(builds)) {
        memcpy(why, builds->why, BUILDS_MESSAGE);
        builds_destroy(builds);
        return NULL;
    }
    return builds;
}

void builds_destroy(Builds *builds) {
    if (builds) {
        for (int i = 0; i < LOCKS; i++) {
            pthread_mutex_destroy(&builds->locks[i]);
        }
        free(builds);
    }
}

// Against the box of the points at all keys, wide enough for any rounding.
static bool meets_bounds(const Form *form, const AccelRay *ray) {
    if (bounds_are_empty(form->reach)) {
        return false;
    }
    const Frame *frame = &form->sampler.frame;
    const double lo[3] = {form->reach.lo.x, form->reach.lo.y, form->reach.lo.z};
    const double hi[3] = {form->reach.hi.x, form->reach.hi.y, form->reach.hi.z};
    double in = ray->tmin, out = ray->tmax;
    for (int a = 0; a < 3; a++) {
        double o = ray->origin[a], d = ray->dir[a];
        double low = (lo[a] - frame->center[a]) * frame->scale;
        double high = (hi[a] - frame->center[a]) * frame->scale;
        double pad = 1e-5 * (fabs(low) + fabs(high) + fabs(o)) + 1e-30;
        double t0 = (low - pad - o) / d, t1 = (high + pad - o) / d;
        if (d == 0 && (o < low - pad || o > high + pad)) {
            return false;
        }
        in = d != 0 ? fmax(in, fmin(t0, t1)) : in;
        out = d != 0 ? fmin(out, fmax(t0, t1)) : out;
    }
    return in <= out + 1e-5 * fabs(out);
}

static pthread_mutex_t *lock_of(Builds *builds, const Form *form) {
    return &builds->locks[(uintptr_t)form / sizeof *form % LOCKS];
}

static void build_once(Builds *builds, Form *form) {
    double start = clock_seconds();
    pthread_mutex_lock(lock_of(builds, form));
    if (!atomic_load(&form->is_built)) {
        build(builds, form, weight_of(form) < SHARED_FROM ? 1 : builds->options.n_threads);
    }
    pthread_mutex_unlock(lock_of(builds, form));
    atomic_fetch_add(&builds->waited, (unsigned long long)((clock_seconds() - start) * 1e9));
}

const Accel *builds_ask(Builds *builds, Form *form, const AccelRay *ray) {
    if (!meets_bounds(form, ray)) {
        return NULL;
    }
    build_once(builds, form);
    return form->accel;
}

const char *builds_failure(const Builds *builds) {
    return atomic_load(&builds->has_failed) ? builds->why : NULL;
}

double builds_waited(const Builds *builds) {
    return (double)atomic_load(&builds->waited) * 1e-9;
}
