// SPDX-License-Identifier: Apache-2.0
// A libFuzzer target: any bytes are laid out, loaded as a scene and lowered, and asked for the
// values of expressions (see fuzz_files.h for what an input may hold). `make fuzz` builds and runs
// it. Besides what sanitizers see, an execution fails where
//   the layout does not format to itself, or is another tree,
//   reports are no JSON with --diag json, or hold control characters without,
//   a scene comes with errors, or none without, or holds what render/scene.h rules out,
//   programs give other bits one by one than together,
//   memory or files are not given back,
//   it takes more than a second of the processor (libFuzzer's own clock counts the waiting too).
#define FUZZ_NO_REDIRECT
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "accel/cpu.h"
#include "lang/format.h"
#include "lang/scene_load.h"
#include "tests/fuzz/fuzz_arena.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_json.h"
#include "tests/fuzz/fuzz_redirect.h"
#include "tests/fuzz/fuzz_simulator.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
const char *__asan_default_options(void);

// A little memory and few steps: whether bounds hold shows as well with small ones.
enum {
    MEMORY = 32 << 20,
    STEPS = 1 << 14,
    WORK = 1 << 19,
    MAX_SHAPES = 64,
    N_POINTS = 5,
    MAX_OUT = 16
};

FILE *fuzz_reports; // what goes to standard error
static jmp_buf on_exhausted;
static double work; // instructions that programs may still carry out

// What the arenas leave for the quarantine is little, and looking for leaks goes through it.
const char *__asan_default_options(void) {
    return "quarantine_size_mb=4:malloc_context_size=8:detect_stack_use_after_return=0";
}

static void fail(const char *format, ...) {
    va_list args;
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fputc('\n', stderr);
    abort();
}

static void exhaust(size_t wanted, size_t limit) {
    if (!limit) {
        fail("%zu bytes are wanted", wanted);
    }
    longjmp(on_exhausted, 1);
}

// What a surface of many vertices computes is no hang: it is as much as was asked for.
void __real_program_run(const Program *program, const ProgramInputs *in, size_t n,
                        double *const *out);
void __wrap_program_run(const Program *program, const ProgramInputs *in, size_t n,
                        double *const *out);

void __wrap_program_run(const Program *program, const ProgramInputs *in, size_t n,
                        double *const *out) {
    work -= (double)n * program_n_instr(program);
    if (work < 0) {
        longjmp(on_exhausted, 1);
    }
    __real_program_run(program, in, n, out);
}

// ---- Texts that are written again and again

typedef struct {
    FILE *file;
    char *text;
    size_t size;
} Sink;

static Sink reports, printed, layouts[2], trees[2];

static void sink_open(Sink *sink) {
    sink->file = open_memstream(&sink->text, &sink->size);
    if (!sink->file) {
        abort();
    }
}

static FILE *sink_begin(Sink *sink) {
    fseek(sink->file, 0, SEEK_SET);
    return sink->file;
}

static void sink_end(Sink *sink) {
    fflush(sink->file);
}

static bool is_same(const Sink *a, const Sink *b) {
    return a->size == b->size && memcmp(a->text, b->text, a->size) == 0;
}

int LLVMFuzzerInitialize(int *argc, char ***argv) {
    (void)argc;
    (void)argv;
    sink_open(&reports);
    sink_open(&printed);
    for (int i = 0; i < 2; i++) {
        sink_open(&layouts[i]);
        sink_open(&trees[i]);
    }
    fuzz_reports = printed.file;
    arena_on_exhausted(exhaust);
    if (!fuzz_files_library("stdlib")) {
        fprintf(stderr, "run this where stdlib/ is\n");
        exit(2);
    }
    return 0;
}

static void check_reports(bool is_json) {
    sink_end(&reports);
    if (is_json && !fuzz_json_lines(reports.text, reports.size)) {
        fail("this is no JSON:\n%.*s", (int)reports.size, reports.text);
    }
    for (size_t i = 0; i < reports.size; i++) {
        unsigned char c = (unsigned char)reports.text[i];
        if ((c < ' ' && c != '\n') || c == 0x7f) {
            fail("a report holds the character %u:\n%.*s", c, (int)reports.size, reports.text);
        }
    }
    if (!fuzz_json_utf8(reports.text, reports.size)) {
        fail("this is no UTF-8:\n%.*s", (int)reports.size, reports.text);
    }
}

// ---- Layout

typedef struct {
    Arena arena;
    Sources sources;
    Diag *diag;
    const SourceFile *file;
} Parsing;

static void parsing_begin(Parsing *p, const char *text, size_t size) {
    *p = (Parsing){.arena = {.limit = MEMORY}, .sources = {.end = 1}};
    p->sources.arena = &p->arena;
    p->diag = diag_new(&p->arena, &p->sources, sink_begin(&reports), false, false);
    p->file = source_add(&p->sources, FUZZ_SCRIPT, text, size, (Span){0, 0});
}

// Every node has an extent within the file.
static void dump_tree(const char *text, size_t size, Sink *sink) {
    Parsing p;
    parsing_begin(&p, text, size);
    Syntax *syntax = syntax_parse(&p.arena, symbols_new(&p.arena), p.file, p.diag);
    if (syntax->has_errors != (diag_n_errors(p.diag) > 0)) {
        fail("errors are reported, or there are none");
    }
    for (NodeId id = 1; id < syntax->n_nodes; id++) {
        Span span = syntax_span(syntax, id);
        if (span.lo < p.file->base || span.lo > span.hi || span.hi > p.file->base + p.file->size) {
            fail("node %u is at %u..%u", id, span.lo, span.hi);
        }
    }
    syntax_dump(syntax, sink_begin(sink));
    sink_end(sink);
    arena_free(&p.arena);
}

static bool lay_out(const char *text, size_t size, Sink *sink) {
    Parsing p;
    parsing_begin(&p, text, size);
    FILE *out = sink_begin(sink);
    bool is_done = format_source(&p.arena, symbols_new(&p.arena), p.file, p.diag, out);
    sink_end(sink);
    if (is_done != (diag_n_errors(p.diag) == 0)) {
        fail("it is laid out in spite of errors, or refused without one");
    }
    arena_free(&p.arena);
    return is_done;
}

static void check_layout(const FuzzFile *script) {
    dump_tree(script->text, script->size, &trees[0]);
    if (!lay_out(script->text, script->size, &layouts[0])) {
        return;
    }
    bool is_done = lay_out(layouts[0].text, layouts[0].size, &layouts[1]);
    if (!is_done || !is_same(&layouts[0], &layouts[1])) {
        fail("%.*s\nis laid out as\n%.*s", (int)layouts[0].size, layouts[0].text,
             (int)layouts[1].size, layouts[1].text);
    }
    dump_tree(layouts[0].text, layouts[0].size, &trees[1]);
    if (!is_same(&trees[0], &trees[1])) {
        fail("the layout is another tree:\n%.*s", (int)layouts[0].size, layouts[0].text);
    }
}

// ---- Scenes

static const double points[N_POINTS] = {0, 1, -0.5, 1e6, 0.25};

static bool is_same_number(double a, double b) {
    return (isnan(a) && isnan(b)) || memcmp(&a, &b, sizeof a) == 0;
}

static void check_program(const Program *program, const double *loops, uint32_t n_loops) {
    double inputs[IN_COUNT][N_POINTS], together[MAX_OUT][N_POINTS], *out[MAX_OUT];
    ProgramInputs in = {.varying = (1u << IN_COUNT) - 1};
    uint32_t n_out = program ? program_n_out(program) : 0;
    if (n_out == 0 || n_out > MAX_OUT) {
        return;
    }
    for (int i = 0; i < IN_COUNT; i++) {
        for (int k = 0; k < N_POINTS; k++) {
            bool is_loop = i >= IN_LOOP0 && (uint32_t)(i - IN_LOOP0) < n_loops;
            inputs[i][k] = is_loop ? loops[i - IN_LOOP0] : points[(i + k) % N_POINTS];
        }
        in.at[i] = inputs[i];
    }
    for (uint32_t k = 0; k < n_out; k++) {
        out[k] = together[k];
    }
    program_run(program, &in, N_POINTS, out);
    for (int k = 0; k < N_POINTS; k++) {
        double one_in[IN_COUNT], one[MAX_OUT];
        for (int i = 0; i < IN_COUNT; i++) {
            one_in[i] = inputs[i][k];
        }
        program_run1(program, one_in, one);
        for (uint32_t j = 0; j < n_out; j++) {
            if (!is_same_number(one[j], together[j][k])) {
                fail("a program gives %.17g alone, %.17g among others", one[j], together[j][k]);
            }
        }
    }
}

static void check_shape(const Scene *scene, const Shape *shape) {
    const Mesh *mesh = shape->mesh;
    if (shape->material >= scene->n_materials || !shape->label || !(shape->tolerance > 0) ||
        shape->n_instances < 1 || shape->n_loops > 4 || (shape->n_loops > 0) != !!shape->loops ||
        (shape->kind == SHAPE_MESH) != (mesh != NULL)) {
        fail("the shape '%s' is damaged", shape->label ? shape->label : "");
    }
    for (size_t i = 0; mesh && i < (size_t)mesh->n_triangles * 3; i++) {
        if (mesh->index[i] >= mesh->n_vertices) {
            fail("'%s' has no vertex %u", shape->label, mesh->index[i]);
        }
    }
    const Program *programs[] = {shape->vertex,
                                 shape->geometry,
                                 shape->transform,
                                 shape->visible,
                                 shape->breaks,
                                 shape->clock,
                                 shape->fade,
                                 shape->pace,
                                 shape->outer,
                                 shape->inner,
                                 scene->materials[shape->material].program};
    for (size_t i = 0; i < sizeof programs / sizeof *programs; i++) {
        check_program(programs[i], shape->loops, shape->n_loops);
    }
}

static void check_scene(const Scene *scene) {
    const FilmSettings *film = &scene->film;
    const ShutterSettings *shutter = &scene->shutter;
    if (film->width < 1 || film->width > 65536 || film->height < 1 || film->height > 65536 ||
        !(film->fps > 0) || !isfinite(film->fps) || film->first_frame > film->last_frame ||
        !(shutter->length >= 0) || !isfinite(shutter->length) || !isfinite(shutter->open)) {
        fail("%ux%u, %g fps, frames %lld..%lld, open for %g from %g on", film->width, film->height,
             film->fps, (long long)film->first_frame, (long long)film->last_frame, shutter->length,
             shutter->open);
    }
    for (uint32_t i = 0; i < scene->n_shapes && i < MAX_SHAPES; i++) {
        check_shape(scene, &scene->shapes[i]);
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        check_program(scene->lights[i].program, NULL, 0);
        check_program(scene->lights[i].visible, NULL, 0);
    }
    check_program(scene->camera.program, NULL, 0);
}

// The text of an expression or a definition, ended by a NUL.
static const char *text_of(Arena *arena, const FuzzFile *file) {
    size_t n = file->size;
    while (n && (file->text[n - 1] == '\n' || file->text[n - 1] == '\0')) {
        n--;
    }
    return arena_string(arena, file->text, n);
}

static void read_options(Arena *arena, const FuzzFile *files, size_t n, LoadOptions *options) {
    const char **defines = ARENA_ARRAY(arena, FUZZ_MAX_FILES, const char *);
    options->defines = defines;
    for (size_t i = 1; i < n; i++) {
        if (strcmp(files[i].name, "-D") == 0) {
            const char *define = text_of(arena, &files[i]);
            if (strchr(define, '=')) {
                defines[options->n_defines++] = define;
            }
        } else if (strcmp(files[i].name, "shutter") == 0) {
            options->shutter = text_of(arena, &files[i]);
        }
    }
}

static void check_eval(LoadedScene *loaded, Arena *arena, const FuzzFile *file) {
    const char *expression = text_of(arena, file);
    SceneMotion motion;
    const double *times;
    size_t n;
    if (scene_eval(loaded, arena, expression, &motion)) {
        check_program(motion.program, NULL, 0);
        if (!motion.type || (!motion.program && !motion.text)) {
            fail("an expression has no value");
        }
    }
    scene_eval_times(loaded, arena, "--at", expression, &times, &n);
}

static void check_load(const FuzzFile *files, size_t n, unsigned variant) {
    Arena arena = {.limit = 2 * MEMORY};
    Sources sources = {.arena = &arena, .end = 1};
    LoadOptions options = {.memory = MEMORY, .max_steps = STEPS, .simulator = &fuzz_simulator};
    LoadedScene loaded;
    bool is_json = variant & 16;
    read_options(&arena, files, n, &options);
    cpu_set(variant & 32 ? "scalar" : NULL);
    Diag *diag = diag_new(&arena, &sources, sink_begin(&reports), is_json, false);
    sink_begin(&printed);
    scene_load(&arena, &sources, diag, FUZZ_SCRIPT, files[0].text, files[0].size, &options,
               &loaded);
    unsigned n_errors = diag_n_errors(diag);
    if ((loaded.scene != NULL) != (n_errors == 0) || (loaded.status == 0) != (n_errors == 0)) {
        fail("%u errors, status %d, %s scene", n_errors, loaded.status, loaded.scene ? "a" : "no");
    }
    if (loaded.scene) {
        check_scene(loaded.scene);
    }
    for (size_t i = 1; i < n; i++) {
        if (strcmp(files[i].name, "eval") == 0) {
            check_eval(&loaded, &arena, &files[i]);
        }
    }
    diag_finish(diag);
    check_reports(is_json);
    scene_load_free(&loaded);
    arena_free(&arena);
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const double start = seconds();
    const FuzzFile *files;
    unsigned variant = 0;
    for (size_t i = 0; i < size; i++) {
        variant += data[i];
    }
    volatile bool is_whole = false;
    work = WORK;
    if (!setjmp(on_exhausted)) {
        size_t n = fuzz_files_begin((const char *)data, size, &files);
        if (variant % 4 == 0) { // it takes as long as all else
            check_layout(&files[0]);
        }
        check_load(files, n, variant);
        is_whole = true;
    }
    size_t n_open = fuzz_files_end(), n_blocks = fuzz_arena_reclaim();
    if (is_whole && (n_open || n_blocks)) {
        fail("%zu blocks and files, %zu pieces of arenas are not given back", n_open, n_blocks);
    }
    if (seconds() - start > 1) {
        fail("it takes %.3f s", seconds() - start);
    }
    return 0;
}
