// SPDX-License-Identifier: Apache-2.0
// Programs: expressions of the language, compiled, run over arrays of points, instants or indices.
//
// A program is a list of instructions in single-assignment form over double registers; vectors are
// their components. The executor runs each instruction over a batch; what depends only on inputs
// that are uniform in a call (an instant, say) is computed once per call, not per element. The
// results have the same bits on every processor, for any batch and for any n: sin, cos, exp, pow
// and kin are SLEEF's deterministic functions (finz_ variants), not the C library's.
#ifndef RENDER_PROGRAM_H
#define RENDER_PROGRAM_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"

// Where in the source a thing was written; opaque to the renderer, handed back in reports.
typedef uint64_t SourceRef;

typedef enum {
#define OP(name, n, effect) OP_##name,
#include "render/ops.def"
#undef OP
    OP_COUNT
} Op;

// What a program can read. Lengths in metres, times in seconds.
typedef enum {
    IN_T,      // t: the clock of the place (an instance's own)
    IN_FILM_T, // T: the film's clock
    IN_U,
    IN_V, // parameters of a surface, texture coordinates of a mesh
    IN_PX,
    IN_PY,
    IN_PZ, // p: rest position, in the shape's own block
    IN_NX,
    IN_NY,
    IN_NZ, // n: rest normal
    IN_WX,
    IN_WY,
    IN_WZ, // P: world position at the ray's time
    IN_WNX,
    IN_WNY,
    IN_WNZ, // N: world normal at the ray's time
    IN_I,   // i: index of the vertex
    IN_X,   // argument of a function given as a property (a shutter's curve)
    IN_LOOP0,
    IN_LOOP1,
    IN_LOOP2,
    IN_LOOP3, // loop variables of the enclosing `for`s, outer first
    IN_COUNT
} Input;

enum { LOOP_INPUTS = 15u << IN_LOOP0 };

typedef struct {
    uint8_t op; // Op
    uint8_t pad[3];
    uint32_t a, b, c; // indices of earlier instructions
    uint32_t table; // CONST: unused (value); INPUT: Input; SEARCH, TABLE, IMAGE: index into tables
    double value;   // CONST
} Instr;

// A picture that programs look up; made by render/texture.h.
typedef struct ProgramImage ProgramImage;
struct ProgramImage {
    // The mean of r g b and opacity around st (the picture fills [0, 1]^2, repeats, t grows
    // upwards), over the parallelogram of the sides dx and dy. Finite; from any thread.
    void (*look_up)(const ProgramImage *image, const double st[2], const double dx[2],
                    const double dy[2], float rgba[4]);
};

typedef struct {
    const double *values;
    uint32_t n;      // >= 1; of an image the channel, 0..3
    bool is_lasting; // outlives every program that has it, and is not copied; of an image: true
    uint32_t live;   // its values change between runs: 1 + what tells it from others; 0: never
    const ProgramImage *image;
} ProgramTable;

typedef struct Program Program;

// Copies everything but lasting tables. code[n_code] is in order (operands before their use);
// out[n_out] are indices into it. Dead instructions are dropped, the rest scheduled.
Program *program_new(Arena *arena, const Instr *code, uint32_t n_code, const uint32_t *out,
                     uint32_t n_out, const ProgramTable *tables, uint32_t n_tables);

uint32_t program_n_out(const Program *program);
uint32_t program_n_instr(const Program *program);
uint32_t program_inputs(const Program *program);  // bit i: Input i is read
bool program_is_constant(const Program *program); // reads nothing
bool program_has_images(const Program *program);
static inline bool program_reads(const Program *p, Input in) {
    return p && (program_inputs(p) >> in & 1);
}
static inline bool program_reads_time(const Program *p) {
    return program_reads(p, IN_T) || program_reads(p, IN_FILM_T);
}

// Where each input's values are. An input that the program reads must be set.
typedef struct {
    const double *at[IN_COUNT]; // one value, or n where bit i of varying is set
    uint32_t varying;
    bool are_neighbours; // of 3 elements the second and third lie beside the first, so that images
                         // are looked up over what is between them
} ProgramInputs;

// Runs over n elements: out[k][0..n) gets output k. Allocates nothing but a per-thread scratch that
// grows to the largest program run; safe from any number of threads at once.
void program_run(const Program *program, const ProgramInputs *in, size_t n, double *const *out);

// One element; out[n_out]. For tracks evaluated at a ray's own time.
void program_run1(const Program *program, const double in[IN_COUNT], double *out);

// The same in two steps, for one that runs at many times: registers[program_n_instr] keeps what
// depends on loop variables alone, which must be the same in both.
void program_keep(const Program *program, const double in[IN_COUNT], double *registers);
void program_run_kept(const Program *program, const double in[IN_COUNT], double *registers,
                      double *out);

// What the second step reads of the first, fewer than program_n_instr: returns how many values.
// Where they are equal, so is whatever comes of them. values NULL: only counts.
uint32_t program_kept(const Program *program, const double *registers, double *values);

// Whether a result is true; NaN is not.
static inline bool program_is_true(double x) {
    return x != 0 && !isnan(x);
}

// One operation on numbers, by the very code that programs run: the compiler folds constants with
// it, so that a folded expression and a computed one agree.
double program_fold(Op op, double a, double b, double c);

// Counted for the tests that show what a scene does not cost.
typedef struct {
    uint64_t runs, elements, instructions;
} ProgramCounters;
ProgramCounters program_counters(void); // of all threads, since the start

extern const char *const op_names[OP_COUNT];
extern const uint8_t op_operands[OP_COUNT];

#endif
