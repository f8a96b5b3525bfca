// SPDX-License-Identifier: Apache-2.0
// Programs: scheduling and the executor.
//
// An instruction's registers hold one value for each element of a batch. Whether an instruction is
// uniform in a call (all the inputs behind it are) is known from a mask per instruction: those run
// once per call in op_scalar() and are spread over a register of their own; the rest run once per
// batch in registers that are reused as soon as their last reader has run.
//
// What depends on loop variables alone comes first, so that one element can be run again at another
// time from there on.
#include "render/program.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "accel/cpu.h"
#include "render/program_exec.h"
#include "render/program_ops.h"

enum {
    BATCH_MAX = 256,     // elements; 16 registers of it fit the first-level cache
    STACK_DOUBLES = 8192 // scratch taken from the stack; larger programs take it from the heap
};

typedef struct {
    uint8_t op;
    bool is_paired; // a sine or cosine; the next step is the other of the same angle
    bool is_kept;   // of those that are still: others read it
    uint32_t a, b, c, table;
    uint32_t inputs; // bit i: Input i is behind it
    uint32_t slot;   // register, where it varies
    double value;
} Step;

struct Program {
    Step *steps;
    uint32_t n_steps, n_slots, n_out, inputs;
    uint32_t n_still; // the first ones read no inputs but loop variables
    const uint32_t *out;
    const ProgramTable *tables;
};

const char *const op_names[OP_COUNT] = {
#define OP(name, n, effect) #name,
#include "render/ops.def"
#undef OP
};

const uint8_t op_operands[OP_COUNT] = {
#define OP(name, n, effect) n,
#include "render/ops.def"
#undef OP
};

static struct { _Atomic uint64_t runs, elements, instructions; } counters;

static const ProgramCpu *kernels_now(void) {
    static const ProgramCpu all[CPU_COUNT] = {
        [CPU_SCALAR] = {program_kernel_scalar, program_sincos_scalar},
        [CPU_AVX2] = {program_kernel_avx2, program_sincos_avx2},
        [CPU_AVX512] = {program_kernel_avx512, program_sincos_avx512},
    };
    return &all[cpu_now()];
}

static bool has_table(Op op) {
    return op == OP_SEARCH || op == OP_TABLE || op == OP_IMAGE;
}

static void operands_of(const Instr *i, uint32_t operand[3]) {
    operand[0] = i->a;
    operand[1] = i->b;
    operand[2] = i->c;
}

static void mark_live(const Instr *code, uint32_t n_code, const uint32_t *out, uint32_t n_out,
                      uint8_t *live) {
    for (uint32_t i = 0; i < n_out; i++) {
        live[out[i]] = 1;
    }
    for (uint32_t i = n_code; i-- > 0;) {
        uint32_t operand[3];
        operands_of(&code[i], operand);
        for (int k = 0; live[i] && k < op_operands[code[i].op]; k++) {
            live[operand[k]] = 1;
        }
    }
}

// Linear scan in program order: a register is free again after its last reader. The result of an
// instruction never shares a register with its operands, so kernels see no partial overlap.
static uint32_t assign_slots(Step *steps, uint32_t n, const uint32_t *out, uint32_t n_out) {
    uint32_t *last = calloc(n + 1, sizeof *last), *free_slots = calloc(n + 1, sizeof *free_slots);
    uint32_t n_free = 0, n_slots = 0;
    for (uint32_t i = 0; last && i < n; i++) {
        const uint32_t operand[3] = {steps[i].a, steps[i].b, steps[i].c};
        for (int k = 0; k < op_operands[steps[i].op]; k++) {
            last[operand[k]] = i;
        }
    }
    for (uint32_t i = 0; last && i < n_out; i++) {
        last[out[i]] = UINT32_MAX;
    }
    for (uint32_t i = 0; last && free_slots && i < n; i++) {
        steps[i].slot = n_free ? free_slots[--n_free] : n_slots++;
        const uint32_t operand[3] = {steps[i].a, steps[i].b, steps[i].c};
        for (int k = 0; k < op_operands[steps[i].op]; k++) {
            uint32_t o = operand[k];
            if (last[o] == i) {
                last[o] = UINT32_MAX - 1; // an operand named twice is freed once
                free_slots[n_free++] = steps[o].slot;
            }
        }
    }
    if (!last || !free_slots) { // no memory to be clever with: every step has its own
        for (n_slots = 0; n_slots < n; n_slots++) {
            steps[n_slots].slot = n_slots;
        }
    }
    free(last);
    free(free_slots);
    return n_slots;
}

static const ProgramTable *copy_tables(Arena *arena, const ProgramTable *tables, uint32_t n) {
    ProgramTable *copy = ARENA_ARRAY(arena, n, ProgramTable);
    for (uint32_t i = 0; i < n; i++) {
        copy[i] = tables[i];
        if (!tables[i].is_lasting) {
            double *values = ARENA_ARRAY(arena, tables[i].n, double);
            memcpy(values, tables[i].values, tables[i].n * sizeof *values);
            copy[i].values = values;
        }
    }
    return copy;
}

// Taking instructions into a program.
typedef struct {
    Program *program;
    const Instr *code;
    uint32_t *moved; // where each instruction went
    uint8_t *live;
    uint32_t *partner; // [n_code]: the sine or cosine of the same angle that comes later; 0: none
    uint32_t *inputs;  // [n_code]: bit i: Input i is behind it
} Taking;

static void find_partners(const Taking *taking, uint32_t n_code, Arena *scratch) {
    uint32_t *first = ARENA_ARRAY(scratch, n_code, uint32_t); // by angle, + 1
    for (uint32_t i = 0; i < n_code; i++) {
        const Instr *code = &taking->code[i];
        if (!taking->live[i] || (code->op != OP_SIN && code->op != OP_COS)) {
            continue;
        }
        uint32_t other = first[code->a];
        if (!other) {
            first[code->a] = i + 1;
        } else if (taking->code[other - 1].op != code->op && !taking->partner[other - 1]) {
            taking->partner[other - 1] = i;
        }
    }
}

static Step *take_step(const Taking *taking, uint32_t i) {
    Program *p = taking->program;
    const Instr *code = &taking->code[i];
    Step *s = &p->steps[p->n_steps];
    *s = (Step){.op = code->op, .table = code->table, .value = code->value};
    uint32_t operand[3], *target[3] = {&s->a, &s->b, &s->c};
    operands_of(code, operand);
    for (int k = 0; k < op_operands[s->op]; k++) {
        *target[k] = taking->moved[operand[k]];
    }
    s->inputs = taking->inputs[i];
    taking->moved[i] = p->n_steps++;
    taking->live[i] = 0;
    return s;
}

static uint32_t code_inputs(const Taking *taking, uint32_t i) {
    uint32_t operand[3], inputs = 0;
    const Instr *code = &taking->code[i];
    operands_of(code, operand);
    for (int k = 0; k < op_operands[code->op]; k++) {
        inputs |= taking->inputs[operand[k]];
    }
    return code->op == OP_INPUT ? 1u << code->table : inputs;
}

// Those that are still, or those that are not.
static void take_steps(const Taking *taking, uint32_t n_code, bool still) {
    for (uint32_t i = 0; i < n_code; i++) {
        if (still == ((taking->inputs[i] & ~LOOP_INPUTS) == 0)) {
            if (taking->live[i]) {
                take_step(taking, i)->is_paired = taking->partner[i] != 0;
            }
            if (taking->partner[i]) {
                take_step(taking, taking->partner[i]);
            }
        }
    }
}

static void mark_kept(Program *p, const uint32_t *out, uint32_t n_out) {
    for (uint32_t i = p->n_still; i < p->n_steps; i++) {
        const uint32_t operand[3] = {p->steps[i].a, p->steps[i].b, p->steps[i].c};
        for (int k = 0; k < op_operands[p->steps[i].op]; k++) {
            p->steps[operand[k]].is_kept = operand[k] < p->n_still;
        }
    }
    for (uint32_t i = 0; i < n_out; i++) {
        p->steps[out[i]].is_kept = out[i] < p->n_still;
    }
}

Program *program_new(Arena *arena, const Instr *code, uint32_t n_code, const uint32_t *out,
                     uint32_t n_out, const ProgramTable *tables, uint32_t n_tables) {
    Arena scratch = {0};
    uint8_t *live = ARENA_ARRAY(&scratch, n_code, uint8_t);
    uint32_t *moved = ARENA_ARRAY(&scratch, n_code, uint32_t);
    mark_live(code, n_code, out, n_out, live);
    uint32_t n = 0;
    for (uint32_t i = 0; i < n_code; i++) {
        n += live[i];
    }
    Program *p = ARENA_NEW(arena, Program);
    p->steps = ARENA_ARRAY(arena, n, Step);
    p->tables = copy_tables(arena, tables, n_tables);
    Taking taking = {p,
                     code,
                     moved,
                     live,
                     ARENA_ARRAY(&scratch, n_code, uint32_t),
                     ARENA_ARRAY(&scratch, n_code, uint32_t)};
    for (uint32_t i = 0; i < n_code; i++) {
        taking.inputs[i] = code_inputs(&taking, i);
    }
    find_partners(&taking, n_code, &scratch);
    take_steps(&taking, n_code, true);
    p->n_still = p->n_steps;
    take_steps(&taking, n_code, false);
    uint32_t *outs = ARENA_ARRAY(arena, n_out, uint32_t);
    for (uint32_t i = 0; i < n_out; i++) {
        outs[i] = moved[out[i]];
        p->inputs |= p->steps[outs[i]].inputs;
    }
    mark_kept(p, outs, n_out);
    p->out = outs;
    p->n_out = n_out;
    p->n_slots = assign_slots(p->steps, p->n_steps, outs, n_out);
    arena_free(&scratch);
    return p;
}

uint32_t program_n_out(const Program *program) {
    return program->n_out;
}

uint32_t program_n_instr(const Program *program) {
    return program->n_steps;
}

uint32_t program_inputs(const Program *program) {
    return program->inputs;
}

bool program_is_constant(const Program *program) {
    return program->inputs == 0;
}

bool program_has_images(const Program *program) {
    for (uint32_t i = 0; i < program->n_steps; i++) {
        if (program->steps[i].op == OP_IMAGE) {
            return true;
        }
    }
    return false;
}

// Operands that the operation does not have name step 0: read, never used.
static double run_step(const Program *p, const Step *s, const double *value, double input) {
    const double a = value[s->a], b = value[s->b], c = value[s->c];
    switch (s->op) {
    case OP_CONST:
        return s->value;
    case OP_INPUT:
        return input;
#define OP_PLAIN(name, result)                                                                     \
    case OP_##name:                                                                                \
        return op_plain_##name(a, b, c);
        OPS_PLAIN
#undef OP_PLAIN
    default:
        return op_scalar((Op)s->op, a, b, c, has_table((Op)s->op) ? &p->tables[s->table] : NULL);
    }
}

static void run_steps(const Program *p, uint32_t first, uint32_t last, const double in[IN_COUNT],
                      double *value) {
    for (uint32_t i = first; i < last; i++) {
        const Step *s = &p->steps[i];
        if (s->is_paired) {
            uint32_t sine = s->op == OP_SIN ? i : i + 1;
            program_sincos_scalar(1, &value[sine], &value[2 * i + 1 - sine], &value[s->a]);
            i++;
        } else {
            value[i] = run_step(p, s, value, s->op == OP_INPUT ? in[s->table] : 0);
        }
    }
}

void program_keep(const Program *p, const double in[IN_COUNT], double *registers) {
    registers[0] = 0; // which the first step may name
    run_steps(p, 0, p->n_still, in, registers);
}

void program_run_kept(const Program *p, const double in[IN_COUNT], double *registers, double *out) {
    run_steps(p, p->n_still, p->n_steps, in, registers);
    for (uint32_t k = 0; k < p->n_out; k++) {
        out[k] = registers[p->out[k]];
    }
}

uint32_t program_kept(const Program *p, const double *registers, double *values) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->n_still; i++) {
        if (p->steps[i].is_kept) {
            if (values) {
                values[n] = registers[i];
            }
            n++;
        }
    }
    return n;
}

void program_run1(const Program *p, const double in[IN_COUNT], double *out) {
    double stack[512];
    double *value = p->n_steps <= 512 ? stack : malloc(p->n_steps * sizeof *value);
    for (uint32_t k = 0; !value && k < p->n_out; k++) {
        out[k] = NAN;
    }
    if (!value) {
        return;
    }
    program_keep(p, in, value);
    program_run_kept(p, in, value, out);
    if (value != stack) {
        free(value);
    }
}

// One call's plan: where each step's values lie.
typedef struct {
    const Program *program;
    const ProgramInputs *in;
    double *slots;  // [n_slots][batch]
    double *spread; // [n_uniform][batch]
    double *value;  // [n_steps], of uniform steps
    double **at;    // [n_steps]
    size_t batch;
} Call;

static bool is_uniform(const Call *call, const Step *s) {
    return (s->inputs & call->in->varying) == 0;
}

static void run_uniform(Call *call) {
    const Program *p = call->program;
    double *next = call->spread;
    for (uint32_t i = 0; i < p->n_steps; i++) {
        const Step *s = &p->steps[i];
        if (!is_uniform(call, s)) {
            call->at[i] = call->slots + s->slot * call->batch;
            continue;
        }
        double input = s->op == OP_INPUT ? *call->in->at[s->table] : 0;
        call->value[i] = run_step(p, s, call->value, input);
        call->at[i] = next;
        for (size_t k = 0; k < call->batch; k++) {
            next[k] = call->value[i];
        }
        next += call->batch;
    }
}

// Where the values of an input are: in the caller's array, or, as kernels run over whole groups of
// 4, in a register of its own at the array's end.
static double *read_input(const Call *call, const Step *s, size_t first, size_t n, size_t whole) {
    const double *values = call->in->at[s->table] + first;
    if (n == whole) {
        return (double *)values; // it is not written to: no step has an input's register
    }
    double *r = call->slots + s->slot * call->batch;
    memcpy(r, values, n * sizeof *r);
    for (size_t k = n; k < whole; k++) {
        r[k] = r[n - 1];
    }
    return r;
}

// A sine and a cosine that follow each other, in either order.
static void run_pair(const Call *call, const ProgramCpu *kernels, uint32_t i, size_t n) {
    const Step *s = &call->program->steps[i];
    uint32_t sine = s->op == OP_SIN ? i : i + 1, cosine = s->op == OP_SIN ? i + 1 : i;
    kernels->sincos(n, call->at[sine], call->at[cosine], call->at[s->a]);
}

// Over the parallelogram that the three elements span.
static void run_images(const Call *call, const Step *s, double *r, size_t whole) {
    const double *a = call->at[s->a], *b = call->at[s->b];
    const double dx[2] = {a[1] - a[0], b[1] - b[0]}, dy[2] = {a[2] - a[0], b[2] - b[0]};
    for (size_t i = 0; i < whole; i++) {
        r[i] = i < 3 ? op_image(a[i], b[i], dx, dy, &call->program->tables[s->table]) : r[2];
    }
}

static uint64_t run_batch(const Call *call, const ProgramCpu *kernels, size_t first, size_t n) {
    const Program *p = call->program;
    size_t whole = (n + 3) & ~(size_t)3;
    uint64_t n_run = 0;
    for (uint32_t i = 0; i < p->n_steps; i++) {
        const Step *s = &p->steps[i];
        if (is_uniform(call, s)) {
            continue;
        }
        n_run++;
        double *r = call->at[i];
        if (s->op == OP_INPUT) {
            call->at[i] = read_input(call, s, first, n, whole);
            continue;
        }
        if (s->is_paired) {
            run_pair(call, kernels, i, whole);
            n_run++;
            i++;
            continue;
        }
        if (s->op == OP_IMAGE && call->in->are_neighbours) {
            run_images(call, s, r, whole);
            continue;
        }
        const ProgramTable *table = has_table((Op)s->op) ? &p->tables[s->table] : NULL;
        kernels->run((Op)s->op, whole, r, call->at[s->a], call->at[s->b], call->at[s->c], table);
    }
    return n_run;
}

static uint32_t count_uniform(const Program *p, uint32_t varying) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->n_steps; i++) {
        n += (p->steps[i].inputs & varying) == 0;
    }
    return n;
}

// As many elements as keep the registers on the stack, a multiple of 4, at least 16.
static size_t batch_size(size_t n_registers, size_t n) {
    size_t batch = n_registers ? STACK_DOUBLES / n_registers & ~(size_t)3 : BATCH_MAX;
    batch = batch > BATCH_MAX ? BATCH_MAX : batch < 16 ? 16 : batch;
    return n < batch ? (n + 3) & ~(size_t)3 : batch;
}

void program_run(const Program *p, const ProgramInputs *in, size_t n, double *const *out) {
    if (n == 0) {
        return;
    }
    size_t n_registers = (size_t)p->n_slots + count_uniform(p, in->varying);
    size_t batch = batch_size(n_registers, n);
    double stack[STACK_DOUBLES], *heap = NULL;
    double *registers = stack;
    if (n_registers * batch > STACK_DOUBLES) {
        registers = heap = malloc(n_registers * batch * sizeof *heap);
    }
    double *value = malloc(p->n_steps * (sizeof *value + sizeof(double *)));
    if (!registers || !value) {
        for (uint32_t k = 0; k < p->n_out; k++) {
            for (size_t i = 0; i < n; i++) {
                out[k][i] = NAN;
            }
        }
        free(heap);
        free(value);
        return;
    }
    Call call = {.program = p,
                 .in = in,
                 .slots = registers,
                 .spread = registers + p->n_slots * batch,
                 .value = value,
                 .at = (double **)(void *)(value + p->n_steps),
                 .batch = batch};
    run_uniform(&call);
    const ProgramCpu *kernels = kernels_now();
    uint64_t n_run = 0;
    for (size_t first = 0; first < n; first += batch) {
        size_t size = n - first < batch ? n - first : batch;
        n_run += run_batch(&call, kernels, first, size);
        for (uint32_t k = 0; k < p->n_out; k++) {
            memcpy(out[k] + first, call.at[p->out[k]], size * sizeof(double));
        }
    }
    free(heap);
    free(value);
    counters.runs += 1;
    counters.elements += n;
    counters.instructions += n_run;
}

double program_fold(Op op, double a, double b, double c) {
    return op_scalar(op, a, b, c, NULL);
}

ProgramCounters program_counters(void) {
    return (ProgramCounters){counters.runs, counters.elements, counters.instructions};
}
