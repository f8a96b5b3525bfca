// SPDX-License-Identifier: Apache-2.0
// Programs: scheduling and the executor.
//
// An instruction's registers hold one value for each element of a batch. Whether an instruction is
// uniform in a call (all the inputs behind it are) is known from a mask per instruction: those run
// once per call in op_scalar() and are spread over a register of their own; the rest run once per
// batch in registers that are reused as soon as their last reader has run.
#include "render/program.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "render/program_exec.h"
#include "render/program_ops.h"

enum {
    BATCH_MAX = 256,     // elements; 16 registers of it fit the first-level cache
    STACK_DOUBLES = 8192 // scratch taken from the stack; larger programs take it from the heap
};

typedef struct {
    uint8_t op;
    uint32_t a, b, c, table;
    uint32_t inputs; // bit i: Input i is behind it
    uint32_t slot;   // register, where it varies
    double value;
} Step;

struct Program {
    Step *steps;
    uint32_t n_steps, n_slots, n_out, inputs;
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

static _Atomic(ProgramKernel *) kernel;

bool program_set_cpu(const char *name) {
    bool has_avx2 = __builtin_cpu_supports("avx2");
    bool is_scalar = name && strcmp(name, "scalar") == 0;
    bool is_avx2 = name && strcmp(name, "avx2") == 0;
    if (name && !is_scalar && !(is_avx2 && has_avx2)) {
        return false;
    }
    kernel = is_scalar || !has_avx2 ? program_kernel_scalar : program_kernel_avx2;
    return true;
}

static ProgramKernel *kernel_now(void) {
    if (!kernel) {
        program_set_cpu(NULL);
    }
    return kernel;
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
    for (uint32_t i = 0; i < n_code; i++) {
        if (!live[i]) {
            continue;
        }
        Step *s = &p->steps[p->n_steps];
        *s = (Step){.op = code[i].op, .table = code[i].table, .value = code[i].value};
        uint32_t operand[3], *target[3] = {&s->a, &s->b, &s->c};
        operands_of(&code[i], operand);
        for (int k = 0; k < op_operands[s->op]; k++) {
            *target[k] = moved[operand[k]];
            s->inputs |= p->steps[*target[k]].inputs;
        }
        if (s->op == OP_INPUT) {
            s->inputs = 1u << s->table;
        }
        moved[i] = p->n_steps++;
    }
    uint32_t *outs = ARENA_ARRAY(arena, n_out, uint32_t);
    for (uint32_t i = 0; i < n_out; i++) {
        outs[i] = moved[out[i]];
        p->inputs |= p->steps[outs[i]].inputs;
    }
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

static double run_step(const Program *p, const Step *s, const double *value, double input) {
    switch (s->op) {
    case OP_CONST:
        return s->value;
    case OP_INPUT:
        return input;
    default: {
        // Operands that the operation does not have name step 0: read, never used.
        const ProgramTable *table =
            s->op == OP_SEARCH || s->op == OP_TABLE ? &p->tables[s->table] : NULL;
        return op_scalar((Op)s->op, value[s->a], value[s->b], value[s->c], table);
    }
    }
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
    for (uint32_t i = 0; i < p->n_steps; i++) {
        const Step *s = &p->steps[i];
        value[i] = run_step(p, s, value, s->op == OP_INPUT ? in[s->table] : 0);
    }
    for (uint32_t k = 0; k < p->n_out; k++) {
        out[k] = value[p->out[k]];
    }
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

static uint64_t run_batch(const Call *call, ProgramKernel *run, size_t first, size_t n) {
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
            memcpy(r, call->in->at[s->table] + first, n * sizeof *r);
            for (size_t k = n; k < whole; k++) {
                r[k] = r[n - 1];
            }
            continue;
        }
        const ProgramTable *table =
            s->op == OP_SEARCH || s->op == OP_TABLE ? &p->tables[s->table] : NULL;
        run((Op)s->op, whole, r, call->at[s->a], call->at[s->b], call->at[s->c], table);
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
    ProgramKernel *run = kernel_now();
    uint64_t n_run = 0;
    for (size_t first = 0; first < n; first += batch) {
        size_t size = n - first < batch ? n - first : batch;
        n_run += run_batch(&call, run, first, size);
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
