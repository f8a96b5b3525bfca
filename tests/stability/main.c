// SPDX-License-Identifier: Apache-2.0
// The stability tests' program: st4-stability [PATTERN] [scale=N] [seed=N], STRESS=1 in the
// environment.
//
// PATTERN is a glob over the names of tests/stability/tests.def. scale multiplies every count of
// rays. The last line counts like that of the unit tests.
#include "tests/stability/stability.h"

#include "accel/cpu.h"

#include <fnmatch.h>
#include <omp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SHOWN = 5,   // failures of a test that are printed in full
    ENOUGH = 50, // after so many a test asks no more rays
    CHUNK = 256, // rays that a thread takes at once
};

typedef struct {
    const char *name, *what;
    void (*run)(Run *run);
} Test;

static const Test tests[] = {
#undef TEST
#define TEST(function, what) {#function, what, test_##function},
#include "tests/stability/tests.def"
};
enum { N_TESTS = sizeof tests / sizeof *tests };

static _Thread_local uint64_t own_queries;

void count_queries(uint64_t n) {
    own_queries += n;
}

uint64_t run_count(const Run *run, double quick, double stress) {
    double n = (run->is_stress ? stress : quick) * run->scale;
    return n > 1 ? (uint64_t)n : 1;
}

static void print_failure(Run *run, const char *format, va_list args) {
#pragma omp critical(run_output)
    {
        if (run->n_failed < SHOWN) {
            printf("  %s (seed %llu): ", run->name, (unsigned long long)run->seed);
            vprintf(format, args);
            printf("\n");
            fflush(stdout);
        }
#pragma omp atomic
        run->n_failed++;
    }
}

void run_fail(Run *run, const char *format, ...) {
    va_list args;
    va_start(args, format);
    print_failure(run, format, args);
    va_end(args);
}

void run_note(Run *run, const char *format, ...) {
    char line[400];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
#pragma omp critical(run_output)
    if (!strstr(run->notes, line)) {
        size_t used = strlen(run->notes);
        snprintf(run->notes + used, sizeof run->notes - used, "        %s\n", line);
    }
}

bool run_expect(Run *run, bool holds, const char *format, ...) {
#pragma omp atomic
    run->n_checks++;
    if (!holds) {
        va_list args;
        va_start(args, format);
        print_failure(run, format, args);
        va_end(args);
    }
    return holds;
}

static void run_chunk(Run *run, RayFn *fn, void *context, uint64_t from, uint64_t to) {
    for (uint64_t i = from; i < to; i++) {
        uint64_t random = run->seed * 0x9e3779b97f4a7c15u ^ i * 0xd1342543de82ef95u;
        fn(run, context, i, &random);
    }
#pragma omp atomic
    run->n_queries += own_queries;
    own_queries = 0;
}

void run_rays(Run *run, uint64_t n, RayFn *fn, void *context) {
    int64_t n_chunks = (int64_t)((n + CHUNK - 1) / CHUNK);
#pragma omp parallel for schedule(dynamic)
    for (int64_t c = 0; c < n_chunks; c++) {
        uint64_t from = (uint64_t)c * CHUNK, n_failed;
#pragma omp atomic read
        n_failed = run->n_failed;
        if (n_failed < ENOUGH) {
            run_chunk(run, fn, context, from, from + CHUNK < n ? from + CHUNK : n);
        }
    }
}

static bool run_test(const Test *test, Run *run, uint64_t *n_queries) {
    *run = (Run){test->name, run->is_stress, run->scale, run->seed, 0, 0, 0, ""};
    double start = omp_get_wtime();
    test->run(run);
    run->n_queries += own_queries;
    own_queries = 0;
    if (run->n_queries + run->n_checks == 0) {
        run_fail(run, "nothing was asserted");
    }
    bool is_fine = run->n_failed == 0;
    printf("%s %-16s %s\n        %.3g queries, %llu other checks, %.1f s",
           is_fine ? "ok     " : "FAILED ", test->name, test->what, (double)run->n_queries,
           (unsigned long long)run->n_checks, omp_get_wtime() - start);
    printf(is_fine ? "\n" : ", %llu failures\n", (unsigned long long)run->n_failed);
    fputs(run->notes, stdout);
    fflush(stdout);
    *n_queries += run->n_queries;
    return is_fine;
}

int main(int argc, char **argv) {
    const char *pattern = "*", *stress = getenv("STRESS");
    uint64_t seed = 0, n_queries = 0;
    Run run = {.is_stress = stress && strcmp(stress, "0") != 0, .scale = 1};
    for (int i = 1; i < argc; i++) {
        if (strncmp(argv[i], "scale=", 6) == 0) {
            run.scale = atof(argv[i] + 6);
        } else if (strncmp(argv[i], "seed=", 5) == 0) {
            seed = strtoull(argv[i] + 5, NULL, 10);
        } else {
            pattern = argv[i];
        }
    }
    printf("instruction sets:");
    for (int cpu = 0; cpu < CPU_COUNT; cpu++) {
        printf("%s%s", cpu_has((Cpu)cpu) ? " " : " no ", cpu_names[cpu]);
    }
    printf("; structures:");
    for (const AccelType *type = accel_types; type->name; type++) {
        printf(" %s", type->name);
    }
    printf("\n");
    size_t n_passed = 0, n_failed = 0;
    double start = omp_get_wtime();
    for (size_t i = 0; i < N_TESTS; i++) {
        if (fnmatch(pattern, tests[i].name, 0) == 0) {
            run.seed = seed + i + 1;
            if (run_test(&tests[i], &run, &n_queries)) {
                n_passed++;
            } else {
                n_failed++;
            }
        }
    }
    printf("%.3g queries in %.0f s\n", (double)n_queries, omp_get_wtime() - start);
    printf("%zu passed, %zu failed\n", n_passed, n_failed);
    return n_failed != 0;
}
