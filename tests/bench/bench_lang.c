// SPDX-License-Identifier: Apache-2.0
// How long what the language describes takes: vertices deformed by a program against the same loop
// in C, and a scene of many statements against what fills the same arrays.
//
// usage: bench_lang deform | arrays N WIDTH | time ROUNDS COMMAND...
// Ratios are of CPU seconds measured in turns in one run; medians, and the spread of all rounds.
#define _DEFAULT_SOURCE // wait4
#include <fcntl.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "render/form.h"
#include "tests/bench/deform_scene.h"

enum { VERTICES = 350000, INSTANTS = 33, ROUNDS = 7, FPS = 24 };

typedef struct {
    double median, least, most;
} Spread;

static double cpu_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double wall_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static Spread spread_of(double *values, int n) {
    qsort(values, (size_t)n, sizeof *values, compare);
    return (Spread){values[n / 2], values[0], values[n - 1]};
}

// ---- Deforming

static double second_of(int instant) {
    return 0.25 + instant / (double)FPS;
}

// As a person would write it.
__attribute__((noinline)) static void deform_by_hand(const double *in, size_t n, double a,
                                                     double *out) {
    for (size_t i = 0; i < n; i++) {
        double x = in[3 * i], y = in[3 * i + 1], z = in[3 * i + 2];
        double s = sin(a * y), c = cos(a * y);
        out[3 * i] = c * x + s * z;
        out[3 * i + 1] = y;
        out[3 * i + 2] = c * z - s * x;
    }
}

typedef struct {
    Arena arena;
    Mesh mesh;
    Shape shape;
    Scene scene;
    Mover mover;
    double *out[4], *by_hand;
} Deform;

// The program that the script makes of the deformer, over vertices of our own.
static bool prepare(Deform *d) {
    const Scene *scene = deform_scene(&d->arena);
    if (!scene) {
        return false;
    }
    d->scene = *scene;
    d->scene.film.fps = FPS;
    d->mesh =
        (Mesh){.n_vertices = VERTICES, .position = ARENA_ARRAY(&d->arena, 3 * VERTICES, double)};
    uint32_t seed = 1;
    for (int i = 0; i < 3 * VERTICES; i++) {
        seed = seed * 1664525u + 1013904223u;
        d->mesh.position[i] = (seed >> 8) * 0x1p-23 - 1;
    }
    d->shape = scene->shapes[0];
    d->shape.mesh = &d->mesh;
    d->mover = (Mover){ARENA_NEW(&d->arena, MoverPart), 1, 3, VERTICES};
    d->mover.parts[0] = mover_mesh(&d->arena, &d->shape, 0);
    for (int k = 0; k < 3; k++) {
        d->out[k] = ARENA_ARRAY(&d->arena, VERTICES, double);
    }
    d->by_hand = ARENA_ARRAY(&d->arena, 3 * VERTICES, double);
    return true;
}

static void run_hand(Deform *d) {
    for (int i = 0; i < INSTANTS; i++) {
        deform_by_hand(d->mesh.position, VERTICES, second_of(i), d->by_hand);
    }
}

static void run_program(Deform *d) {
    for (int i = 0; i < INSTANTS; i++) {
        mover_run(&d->mover, second_of(i), NULL, d->out);
    }
}

// Into the arrays that rays are traced through: sampled at the beginnings and ends of frames.
static void run_form(Deform *d, int n_threads) {
    Form form = {.kind = GEOMETRY_TRIANGLES, .shape = &d->shape, .moves = true};
    Span spans[INSTANTS - 1];
    for (int i = 0; i < INSTANTS - 1; i++) {
        spans[i] = (Span){i, 0, 1, 1};
    }
    form.spans = spans;
    form.n_spans = INSTANTS - 1;
    form.sampler = (Sampler){.scene = &d->scene, .all = d->mover};
    const double lo[3] = {-1.5, -1.5, -1.5}, hi[3] = {1.5, 1.5, 1.5};
    form.sampler.frame = frame_from_box(vec3(lo[0], lo[1], lo[2]), vec3(hi[0], hi[1], hi[2]));
    if (form_store(&form, 0)) {
#pragma omp parallel for schedule(dynamic) num_threads(n_threads)
        for (uint32_t key = 0; key < form.geometry.n_keys; key++) {
            form_store_key(&form, key);
        }
    }
    form_destroy(&form);
}

static double largest_difference(Deform *d) {
    double most = 0;
    run_hand(d);
    run_program(d);
    for (int i = 0; i < VERTICES; i++) {
        for (int k = 0; k < 3; k++) {
            most = fmax(most, fabs(d->out[k][i] - d->by_hand[3 * i + k]));
        }
    }
    return most;
}

static int bench_deform(void) {
    static Deform d;
    double hand[ROUNDS], program[ROUNDS], form[ROUNDS], wall[2][ROUNDS];
    if (!prepare(&d)) {
        return 1;
    }
    int n_threads = omp_get_num_procs();
    double difference = largest_difference(&d);
    for (int round = 0; round < ROUNDS; round++) {
        double start = cpu_now();
        run_hand(&d);
        hand[round] = cpu_now() - start;
        start = cpu_now();
        run_program(&d);
        program[round] = (cpu_now() - start) / hand[round];
        start = cpu_now();
        run_form(&d, 1);
        form[round] = (cpu_now() - start) / hand[round];
        start = wall_now();
        run_form(&d, 1);
        wall[0][round] = wall_now() - start;
        start = wall_now();
        run_form(&d, n_threads);
        wall[1][round] = wall[0][round] / (wall_now() - start);
    }
    Spread h = spread_of(hand, ROUNDS), p = spread_of(program, ROUNDS), f = spread_of(form, ROUNDS),
           w = spread_of(wall[1], ROUNDS);
    double ns = 1e9 / ((double)VERTICES * INSTANTS);
    printf("deform: %d vertices x %d instants, %u instructions; differs by %.2g at most\n",
           VERTICES, INSTANTS, program_n_instr(d.shape.vertex), difference);
    printf("  loop in C       %6.1f ns a vertex (%.1f to %.1f)\n", h.median * ns, h.least * ns,
           h.most * ns);
    printf("  program / C     %6.2f (%.2f to %.2f), at most 3\n", p.median, p.least, p.most);
    printf("  arrays / C      %6.2f (%.2f to %.2f), at most 3\n", f.median, f.least, f.most);
    printf("  %d threads       %6.2f times as fast as one, by the clock (%.2f to %.2f)\n",
           n_threads, w.median, w.least, w.most);
    arena_free(&d.arena);
    return p.median <= 3 && f.median <= 3 ? 0 : 1;
}

// ---- The arrays of many shapes

// What a scene comes to, filled by a loop: the numbers of each shape, its centre, radius, color.
static int fill_arrays(size_t n) {
    double *values = malloc(n * sizeof *values);
    if (!values) {
        return 1;
    }
    for (size_t i = 0; i < n; i++) {
        values[i] = (double)(i % 1000) * 1e-3;
    }
    volatile double last = values[n - 1];
    (void)last;
    free(values);
    return 0;
}

// ---- Commands

static double seconds_of(struct timeval t) {
    return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

// Runs the command, silently; its exit status, what it used.
static int run_command(char **command, struct rusage *usage) {
    int status = 1;
    pid_t child = fork();
    if (child == 0) {
        int silent = open("/dev/null", O_WRONLY);
        dup2(silent, 1);
        execvp(command[0], command);
        _exit(127);
    }
    return child > 0 && wait4(child, &status, 0, usage) == child && WIFEXITED(status)
               ? WEXITSTATUS(status)
               : 1;
}

// Prints the CPU seconds (median, least, most) and the kilobytes of the command.
static int time_command(int rounds, char **command) {
    double seconds[99];
    struct rusage usage = {0};
    rounds = rounds < 1 ? 1 : rounds > 99 ? 99 : rounds;
    for (int i = 0; i < rounds; i++) {
        int status = run_command(command, &usage);
        if (status) {
            fprintf(stderr, "bench_lang: %s: exit status %d\n", command[0], status);
            return 1;
        }
        seconds[i] = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
    }
    Spread spread = spread_of(seconds, rounds);
    printf("%.3f %.3f %.3f %ld\n", spread.median, spread.least, spread.most, usage.ru_maxrss);
    return 0;
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "deform") == 0) {
        return bench_deform();
    }
    if (argc == 4 && strcmp(argv[1], "arrays") == 0) {
        return fill_arrays(strtoul(argv[2], NULL, 10) * strtoul(argv[3], NULL, 10));
    }
    if (argc > 3 && strcmp(argv[1], "time") == 0) {
        return time_command(atoi(argv[2]), argv + 3);
    }
    fprintf(stderr, "usage: bench_lang deform | arrays N WIDTH | time ROUNDS COMMAND...\n");
    return 2;
}
