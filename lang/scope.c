// SPDX-License-Identifier: Apache-2.0
// Scopes: few names are searched one by one, many through a table.
#include "lang/scope.h"

enum { FEW = 8 };

Scope *scope_new(Arena *arena, Scope *parent) {
    Scope *scope = ARENA_NEW(arena, Scope);
    scope->parent = parent;
    return scope;
}

static uint32_t slot_of(const Scope *scope, Symbol name) {
    return (name * 2654435769u) & (scope->n_slots - 1);
}

// Of two bindings of a name (the second is an error elsewhere) the first is found.
static void put_in_table(Scope *scope, uint32_t index) {
    uint32_t slot = slot_of(scope, scope->bindings[index].name);
    while (scope->slots[slot]) {
        slot = (slot + 1) & (scope->n_slots - 1);
    }
    scope->slots[slot] = index + 1;
}

static void grow_table(Arena *arena, Scope *scope) {
    scope->n_slots = scope->n_slots ? 2 * scope->n_slots : 8 * FEW;
    scope->slots = ARENA_ARRAY(arena, scope->n_slots, uint32_t);
    for (uint32_t i = 0; i < scope->n; i++) {
        put_in_table(scope, i);
    }
}

Binding *scope_bind(Arena *arena, Scope *scope, Symbol name, BindingKind kind) {
    scope->bindings =
        arena_grow(arena, scope->bindings, scope->n, &scope->capacity, sizeof *scope->bindings);
    Binding *binding = &scope->bindings[scope->n];
    *binding = (Binding){.name = name, .kind = (uint8_t)kind};
    scope->n++;
    if (scope->n > FEW && scope->n * 2 > scope->n_slots) {
        grow_table(arena, scope);
    } else if (scope->slots) {
        put_in_table(scope, scope->n - 1);
    }
    return binding;
}

Binding *scope_find_own(const Scope *scope, Symbol name) {
    if (!scope->slots) {
        for (uint32_t i = 0; i < scope->n; i++) {
            if (scope->bindings[i].name == name) {
                return &scope->bindings[i];
            }
        }
        return NULL;
    }
    for (uint32_t slot = slot_of(scope, name); scope->slots[slot];
         slot = (slot + 1) & (scope->n_slots - 1)) {
        if (scope->bindings[scope->slots[slot] - 1].name == name) {
            return &scope->bindings[scope->slots[slot] - 1];
        }
    }
    return NULL;
}

Binding *scope_find(Scope *scope, Symbol name, Scope **at) {
    Binding *variable = NULL;
    for (; scope; scope = scope->parent) {
        Binding *found = scope_find_own(scope, name);
        if (found && (!variable || found->kind == BINDING_LOOP)) {
            *at = scope;
            if (found->kind != BINDING_VARIABLE) {
                return found;
            }
            variable = found;
        }
    }
    return variable;
}

size_t scope_names(const Scope *scope, const Symbols *symbols, const char **names, size_t max) {
    size_t n = 0;
    for (; scope; scope = scope->parent) {
        for (uint32_t i = 0; i < scope->n && n < max; i++) {
            names[n++] = symbol_text(symbols, scope->bindings[i].name);
        }
    }
    return n;
}
