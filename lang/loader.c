// SPDX-License-Identifier: Apache-2.0
// Files: found, read once, hashed. Includes and parameters.
#include "lang/loader_parts.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "lang/library.h"
#include "lang/lower.h"
#include "lang/run.h"

typedef struct {
    const Module *parent; // NULL: the script
    NodeId statement;     // the include
    const Scope *scope;   // that it stands in
    Module *module;
    const char *real; // the file, links resolved
    bool is_placed;   // without `as`
} Included;

typedef struct {
    const char *real;
    const Mesh *mesh; // NULL: it can not be read
} ReadMesh;

struct Loader {
    Arena *arena;
    const LoadOptions *options;
    bool *define_is_used;
    Included *included;
    ReadMesh *meshes;
    Table *tables;
    Picture *pictures;
    const char **files;
    const char *library; // the folder of the standard library; NULL: there is none
    size_t n_included, included_capacity, n_meshes, meshes_capacity, n_files, files_capacity;
    Hash128 hash;
    Value defaults[PROPERTY_COUNT];
    bool has_default[PROPERTY_COUNT];
};

Loader *loader_new(Arena *arena, const LoadOptions *options) {
    Loader *loader = ARENA_NEW(arena, Loader);
    loader->arena = arena;
    loader->options = options;
    loader->library = library_folder(arena);
    loader->define_is_used = ARENA_ARRAY(arena, options->n_defines, bool);
    for (size_t i = 0; i < options->n_defines; i++) {
        hash_add(&loader->hash, options->defines[i], strlen(options->defines[i]));
    }
    return loader;
}

const char *const *loader_files(const Loader *loader, size_t *n) {
    *n = loader->n_files;
    return loader->files;
}

const Hash128 *loader_hash(const Loader *loader) {
    return &loader->hash;
}

static void add_file(Loader *loader, const char *path) {
    for (size_t i = 0; i < loader->n_files; i++) {
        if (strcmp(loader->files[i], path) == 0) {
            return;
        }
    }
    loader->files = arena_grow(loader->arena, loader->files, loader->n_files,
                               &loader->files_capacity, sizeof *loader->files);
    loader->files[loader->n_files++] = arena_string(loader->arena, path, strlen(path));
}

// ---- Reading

// Of what comes from a pipe or a device, which may have no end.
enum { STREAM_MAX = 1 << 30 };

// How much to read at first, all of a file whose size is known, and at most. False: it is too
// large, errno says so.
static bool find_sizes(FILE *file, size_t *first, size_t *most) {
    struct stat about;
    bool is_known = fstat(fileno(file), &about) == 0 && S_ISREG(about.st_mode);
    bool is_fine = !is_known || about.st_size < UINT32_MAX - SOURCE_PADDING;
    // One more, so that its end is seen without growing.
    *first = is_known && is_fine ? (size_t)about.st_size + 1 : 1 << 16;
    *most = is_known ? UINT32_MAX : STREAM_MAX;
    errno = is_fine ? 0 : EFBIG;
    return is_fine;
}

char *loader_read(Arena *arena, const char *path, size_t *size) {
    FILE *file = strcmp(path, "-") == 0 ? stdin : fopen(path, "rb");
    char *text = NULL;
    size_t n = 0, capacity = 0, first = 0, most = 0;
    bool is_read = file && find_sizes(file, &first, &most);
    while (is_read && !feof(file) && !ferror(file)) {
        if (n >= most) {
            is_read = false;
            errno = EFBIG;
            break;
        }
        if (n && n == capacity && most == STREAM_MAX && memchr(text, 0, n)) {
            break; // no text, as whoever reads it says; /dev/zero has no end
        }
        if (n == capacity) {
            size_t larger = capacity ? 2 * capacity : first;
            char *copy = arena_alloc(arena, larger + SOURCE_PADDING);
            if (n) {
                memcpy(copy, text, n);
            }
            text = copy;
            capacity = larger;
        }
        n += fread(text + n, 1, capacity - n, file);
    }
    is_read = is_read && !ferror(file);
    int error = errno;
    if (file && file != stdin) {
        fclose(file);
    }
    errno = error;
    *size = n;
    return is_read ? text : NULL;
}

// Another module of a file that was read before, in another scope.
static Module *module_again(Eval *ev, const char *real, Scope *scope) {
    for (size_t i = 0; i < ev->loader->n_included; i++) {
        const Included *included = &ev->loader->included[i];
        if (included->real && strcmp(included->real, real) == 0) {
            Module *module = ARENA_NEW(ev->arena, Module);
            *module = *included->module;
            module->scope = scope;
            return module;
        }
    }
    return NULL;
}

static Module *parse_module(Eval *ev, const char *path, const char *text, size_t size, Span from,
                            Scope *scope) {
    const SourceFile *file = source_adopt(ev->sources, path, text, size, from);
    if (!file) {
        eval_error_at(ev, from, NULL, "'%s' is too large", path);
        return NULL;
    }
    hash_add(&ev->loader->hash, text, size);
    Module *module = ARENA_NEW(ev->arena, Module);
    module->syntax = syntax_parse_runs(ev->arena, lower_arena(ev), ev->symbols, file, ev->diag);
    module->scope = scope;
    module->n_flags = module->syntax->n_nodes;
    module->flags = ARENA_ARRAY(ev->arena, module->n_flags, uint8_t);
    diag_next_statement(ev->diag);
    return module;
}

static Module *read_module(Eval *ev, const char *path, Span where, Scope *scope) {
    size_t size;
    const char *text = loader_read(ev->sources->arena, path, &size);
    if (!text) {
        eval_error_at(ev, where, NULL, "cannot read '%s': %s", path, strerror(errno));
        ev->has_failed_file = true;
        return NULL;
    }
    add_file(ev->loader, path);
    return parse_module(ev, path, text, size, where, scope);
}

static void add_included(Loader *loader, Included included) {
    loader->included = arena_grow(loader->arena, loader->included, loader->n_included,
                                  &loader->included_capacity, sizeof *loader->included);
    loader->included[loader->n_included++] = included;
}

Module *loader_script(Eval *ev, const char *path, const char *text, size_t size) {
    Loader *loader = ev->loader;
    if (text) {
        char *copy = arena_alloc(ev->sources->arena, size + SOURCE_PADDING);
        text = memcpy(copy, text, size);
    } else {
        text = loader_read(ev->sources->arena, path, &size);
        if (!text) {
            eval_error_at(ev, (Span){0, 0}, NULL, "cannot read '%s': %s", path, strerror(errno));
            ev->has_failed_file = true;
            return NULL;
        }
    }
    add_file(loader, path);
    Module *module =
        parse_module(ev, path, text, size, (Span){0, 0}, scope_new(ev->arena, ev->predefined));
    if (module) {
        add_included(loader, (Included){.module = module,
                                        .real = loader_real_path(ev->arena, path),
                                        .is_placed = true});
    }
    return module;
}

NodeId loader_parse_expr(Eval *ev, const char *origin, const char *text, Module **module) {
    const SourceFile *file = source_add(ev->sources, origin, text, strlen(text), (Span){0, 0});
    Syntax *syntax = NULL;
    NodeId node = file ? syntax_parse_expr(ev->arena, ev->symbols, file, ev->diag, &syntax) : 0;
    if (node) {
        *module = ARENA_NEW(ev->arena, Module);
        **module = (Module){syntax, ev->predefined,
                            ARENA_ARRAY(ev->arena, syntax->n_nodes, uint8_t), syntax->n_nodes};
    }
    return node;
}

// ---- Folders

static const char *folder_of(Arena *arena, const char *path) {
    const char *slash = strrchr(path, '/');
    return slash == NULL   ? "."
           : slash == path ? "/"
                           : arena_string(arena, path, (size_t)(slash - path));
}

const char *loader_folder(Eval *ev, const Env *env, const Value *name, size_t i) {
    const LoadOptions *options = ev->loader->options;
    if (name->n == STRING_FROM_COMMAND_LINE) {
        return i == 0 ? "." : NULL;
    }
    if (i == 0) {
        return folder_of(ev->arena, env->module->syntax->file->path);
    }
    return i <= options->n_include_dirs       ? options->include_dirs[i - 1]
           : i == options->n_include_dirs + 1 ? ev->loader->library
                                              : NULL;
}

// ---- Includes

static Included *included_of(Eval *ev, const Module *module) {
    for (size_t i = 0; i < ev->loader->n_included; i++) {
        if (ev->loader->included[i].module == module) {
            return &ev->loader->included[i];
        }
    }
    return NULL;
}

// Whether the file is being included already: by itself, or by what it includes.
static bool is_cycle(Eval *ev, const Env *env, const char *real) {
    for (const Module *module = env->module; module;) {
        const Included *included = included_of(ev, module);
        if (!included || (included->real && strcmp(included->real, real) == 0)) {
            return included != NULL;
        }
        module = included->parent;
    }
    return false;
}

// "a.st4 -> b.st4": the files from one that is being included to the one that includes it again.
static const char *cycle_text(Eval *ev, const Env *env, const char *real) {
    const char *text = "";
    for (const Module *module = env->module; module;) {
        const Included *included = included_of(ev, module);
        text = arena_printf(ev->arena, "%s%s%s", module->syntax->file->path, *text ? " -> " : "",
                            text);
        if (!included || (included->real && strcmp(included->real, real) == 0)) {
            break;
        }
        module = included->parent;
    }
    return text;
}

void loader_include(Eval *ev, const Env *env, NodeId statement) {
    const Node *node = syntax_node(env->module->syntax, statement);
    Value name = {.type = VALUE_STRING, .symbol = syntax_node(env->module->syntax, node->a)->a};
    Span where = syntax_span(env->module->syntax, node->a);
    const char *real, *path = loader_find(ev, env, node->a, &name, &real);
    if (!path) {
        return;
    }
    if (is_cycle(ev, env, real)) {
        eval_error_at(ev, where, NULL, "'%s' includes itself: %s -> %s", path,
                      cycle_text(ev, env, real), path);
        return;
    }
    Scope *scope = node->b ? scope_new(ev->arena, ev->predefined) : env->scope;
    Module *module = module_again(ev, real, scope);
    module = module ? module : read_module(ev, path, where, scope);
    if (!module || module->syntax->has_errors) {
        ev->has_bad_file = true;
        return;
    }
    add_included(ev->loader,
                 (Included){env->module, statement, env->scope, module, real, !node->b});
    if (node->b) {
        Binding *binding = eval_bind_name(ev, env, statement, node->b, BINDING_MODULE);
        if (binding) {
            binding->members = scope;
        }
    }
    const Env inside = {module, scope};
    eval_declare(ev, &inside, module->syntax->root);
}

static const Included *placed_include(Eval *ev, const Env *env, NodeId statement) {
    for (size_t i = ev->loader->n_included; i-- > 0;) {
        const Included *included = &ev->loader->included[i];
        if (included->parent == env->module && included->statement == statement &&
            included->scope == env->scope) {
            return included->is_placed ? included : NULL;
        }
    }
    return NULL;
}

void loader_gather(Eval *ev, const Env *env, Object *object, NodeId statement) {
    const Included *included = placed_include(ev, env, statement);
    if (included) {
        const Env inside = {included->module, included->module->scope};
        eval_gather(ev, &inside, object, inside.module->syntax->root);
    }
}

void loader_place(Eval *ev, const Env *env, const Place *place, NodeId statement) {
    const Included *included = placed_include(ev, env, statement);
    if (included) {
        const Env inside = {included->module, included->module->scope};
        eval_emit(ev, &inside, place, inside.module->syntax->root, true, NULL);
    }
}

void loader_visit(Eval *ev, const Module *script, LoaderVisit *visit, void *context) {
    for (size_t i = 0; i < ev->loader->n_included; i++) {
        const Included *included = &ev->loader->included[i];
        if (included->is_placed && included->module->scope == script->scope) {
            const Env env = {included->module, included->module->scope};
            visit(ev, &env, env.module->syntax->root, context);
        }
    }
}

// ---- Parameters

// The text of the last -D of this name; NULL: none.
static const char *define_of(Loader *loader, const char *name) {
    size_t n = strlen(name);
    const char *text = NULL;
    for (size_t i = 0; i < loader->options->n_defines; i++) {
        const char *define = loader->options->defines[i];
        if (strncmp(define, name, n) == 0 && define[n] == '=') {
            loader->define_is_used[i] = true;
            text = define + n + 1;
        }
    }
    return text;
}

// Strings need no quotes where the default is one.
static Value define_value(Eval *ev, const char *name, const char *text, const Node *by_default) {
    if (by_default->kind == NODE_STRING && *text != '"') {
        return (Value){.type = VALUE_STRING,
                       .n = STRING_FROM_COMMAND_LINE,
                       .symbol = symbol_of(ev->symbols, text, strlen(text))};
    }
    Module *module = NULL;
    NodeId node = loader_parse_expr(ev, arena_printf(ev->arena, "-D %s", name), text, &module);
    if (!node) {
        return value_poison();
    }
    const Env env = {module, ev->predefined};
    Value value = eval_expr(ev, &env, node);
    if (value_is(&value, VALUE_STRING)) {
        value.n = STRING_FROM_COMMAND_LINE;
    }
    return value;
}

void loader_declare_param(Eval *ev, const Env *env, NodeId statement) {
    const Node *node = syntax_node(env->module->syntax, statement);
    const char *name = symbol_text(ev->symbols, node->a);
    const char *text = define_of(ev->loader, name);
    Binding *binding = eval_bind_name(ev, env, statement, node->a, BINDING_PARAM);
    if (!binding || !text) {
        return;
    }
    Value value = define_value(ev, name, text, syntax_node(env->module->syntax, node->b));
    uint8_t type =
        syntax_node(env->module->syntax, node->b)->kind == NODE_STRING ? VALUE_STRING : value.type;
    if (!value_is_poison(&value) && value.type != type) {
        eval_error_at(ev, (Span){0, 0}, NULL, "-D %s: a string is expected, this is %s", name,
                      value_describe(ev->arena, &value));
        value = value_poison();
    }
    binding = scope_find_own(env->scope, node->a);
    binding->state = BINDING_DONE;
    binding->value = value;
}

void loader_check_defines(Eval *ev) {
    const LoadOptions *options = ev->loader->options;
    const char *names[256];
    size_t n = 0;
    for (size_t i = 0; i < ev->loader->n_included; i++) {
        const Syntax *syntax = ev->loader->included[i].module->syntax;
        for (size_t k = 1; k < syntax->n_nodes && n < 256; k++) {
            if (syntax->nodes[k].kind == NODE_PARAM) {
                names[n++] = symbol_text(ev->symbols, syntax->nodes[k].a);
            }
        }
    }
    for (size_t i = 0; i < options->n_defines; i++) {
        if (!ev->loader->define_is_used[i]) {
            const char *name =
                arena_string(ev->arena, options->defines[i], strcspn(options->defines[i], "="));
            const char *near = diag_nearest(name, names, n);
            eval_error_at(ev, (Span){0, 0},
                          near ? arena_printf(ev->arena, "did you mean '%s'?", near) : NULL,
                          "-D %s: the script has no param '%s'", options->defines[i], name);
            diag_next_statement(ev->diag);
        }
    }
}

// ---- Meshes and defaults

const char *loader_file(Eval *ev, const Env *env, NodeId node, const Value *name) {
    const char *real, *path = loader_find(ev, env, node, name, &real);
    if (path) {
        add_file(ev->loader, path);
    }
    return path;
}

const char *loader_text(Eval *ev, const Env *env, NodeId node, const Value *name, size_t *size) {
    const char *path = loader_file(ev, env, node, name);
    char *text = path ? loader_read(ev->arena, path, size) : NULL, *copy;
    if (!text) {
        if (path) {
            eval_error(ev, env, node, NULL, "cannot read '%s': %s", path, strerror(errno));
            ev->has_failed_file = true;
        }
        return NULL;
    }
    loader_hash_add(ev, text, *size);
    copy = ARENA_ARRAY(ev->arena, *size + 1, char);
    memcpy(copy, text, *size);
    return copy;
}

Picture **loader_pictures(Eval *ev) {
    return &ev->loader->pictures;
}

Table **loader_tables(Eval *ev) {
    return &ev->loader->tables;
}

void loader_hash_add(Eval *ev, const void *bytes, size_t n) {
    hash_add(&ev->loader->hash, bytes, n);
}

const Mesh *loader_mesh(Eval *ev, const Given *file) {
    Loader *loader = ev->loader;
    const char *real, *path = loader_find(ev, &file->env, file->node, &file->value, &real);
    if (!path) {
        return NULL;
    }
    for (size_t i = 0; i < loader->n_meshes; i++) {
        if (strcmp(loader->meshes[i].real, real) == 0) {
            return loader->meshes[i].mesh;
        }
    }
    Mesh *mesh = ARENA_NEW(lower_arena(ev), Mesh);
    char message[512];
    MeshStatus status = mesh_read(lower_arena(ev), path, mesh, message, sizeof message);
    if (status != MESH_OK) {
        eval_error(ev, &file->env, file->node, NULL, "cannot read '%s': %s", path, message);
        ev->has_failed_file = true;
        mesh = NULL;
    } else {
        add_file(loader, path);
        lower_hash_mesh(ev, mesh);
    }
    loader->meshes = arena_grow(loader->arena, loader->meshes, loader->n_meshes,
                                &loader->meshes_capacity, sizeof *loader->meshes);
    loader->meshes[loader->n_meshes++] = (ReadMesh){real, mesh};
    return mesh;
}

Value eval_default(Eval *ev, PropertyId id) {
    const PropertyInfo *info = &property_infos[id];
    Loader *loader = ev->loader;
    if (loader->has_default[id]) {
        return loader->defaults[id];
    }
    Value value = value_poison();
    if (schema_takes_words(info) && schema_has_word(info->names, info->default_text)) {
        value = (Value){.type = VALUE_STRING,
                        .symbol =
                            symbol_of(ev->symbols, info->default_text, strlen(info->default_text))};
    } else if (*info->default_text) {
        Module *module = NULL;
        const char *origin = arena_printf(ev->arena, "default of %s", info->name);
        NodeId node = loader_parse_expr(ev, origin, info->default_text, &module);
        const Env env = {module, ev->predefined};
        // Defaults are short: they are there even where the script ran out of what it may do.
        const Eval before = *ev;
        ev->steps = ev->depth = 0;
        ev->stopped = false;
        value = node ? eval_expr(ev, &env, node) : value;
        ev->steps = before.steps;
        ev->depth = before.depth;
        ev->stopped = before.stopped;
    }
    if (!ev->unroll && !ev->stopped) {
        loader->has_default[id] = true;
        loader->defaults[id] = value;
    }
    return value;
}
