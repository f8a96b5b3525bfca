// SPDX-License-Identifier: Apache-2.0
// Interned strings: an open-addressed hash table of symbols beside an array of texts.
#include "lang/symbols.h"

#include <string.h>

typedef struct {
    const char *text;
    uint32_t size, hash;
} Entry;

// The hash lies in the slot, so that a search that goes on past a slot reads nothing else.
typedef struct {
    uint32_t hash;
    Symbol symbol; // 0: free
} Slot;

struct Symbols {
    Arena *arena;
    Entry *entries; // by symbol; [0] is unused
    size_t n, capacity;
    Slot *slots; // a power of two of them, at most half of them taken
    size_t n_slots;
};

enum { FIRST_SLOTS = 256 };

static Slot *find_slot(const Symbols *symbols, const char *text, size_t n, uint32_t hash) {
    size_t mask = symbols->n_slots - 1;
    // The low bits of FNV are its good ones, but neighbours differ in few of them.
    for (size_t i = (hash ^ hash >> 15) & mask;; i = (i + 1) & mask) {
        Slot *slot = &symbols->slots[i];
        if (!slot->symbol) {
            return slot;
        }
        const Entry *entry = &symbols->entries[slot->symbol];
        if (slot->hash == hash && entry->size == n && memcmp(entry->text, text, n) == 0) {
            return slot;
        }
    }
}

static void double_slots(Symbols *symbols) {
    symbols->n_slots *= 2;
    symbols->slots = ARENA_ARRAY(symbols->arena, symbols->n_slots, Slot);
    for (Symbol symbol = 1; symbol < symbols->n; symbol++) {
        const Entry *entry = &symbols->entries[symbol];
        *find_slot(symbols, entry->text, entry->size, entry->hash) = (Slot){entry->hash, symbol};
    }
}

Symbol symbol_of_hashed(Symbols *symbols, const char *text, size_t n, uint32_t hash) {
    Slot *slot = find_slot(symbols, text, n, hash);
    if (slot->symbol) {
        return slot->symbol;
    }
    if (2 * symbols->n >= symbols->n_slots) {
        double_slots(symbols);
        slot = find_slot(symbols, text, n, hash);
    }
    symbols->entries = arena_grow(symbols->arena, symbols->entries, symbols->n, &symbols->capacity,
                                  sizeof *symbols->entries);
    symbols->entries[symbols->n] =
        (Entry){arena_string(symbols->arena, text, n), (uint32_t)n, hash};
    *slot = (Slot){hash, (Symbol)symbols->n};
    return (Symbol)symbols->n++;
}

Symbol symbol_of(Symbols *symbols, const char *text, size_t n) {
    uint32_t hash = SYMBOL_HASH;
    for (size_t i = 0; i < n; i++) {
        hash = symbol_hash_step(hash, (unsigned char)text[i]);
    }
    return symbol_of_hashed(symbols, text, n, hash);
}

const char *symbol_text(const Symbols *symbols, Symbol symbol) {
    return symbol ? symbols->entries[symbol].text : "";
}

size_t symbol_size(const Symbols *symbols, Symbol symbol) {
    return symbols->entries[symbol].size;
}

Symbols *symbols_new(Arena *arena) {
    static const char *const words[] = {
#define KEYWORD(id, text) text,
#include "lang/keywords.def"
#undef KEYWORD
#define UNIT(id, text, dimension, factor) text,
#include "lang/units.def"
#undef UNIT
    };
    Symbols *symbols = ARENA_NEW(arena, Symbols);
    symbols->arena = arena;
    symbols->n_slots = FIRST_SLOTS;
    symbols->slots = ARENA_ARRAY(arena, FIRST_SLOTS, Slot);
    symbols->entries = arena_grow(arena, NULL, 0, &symbols->capacity, sizeof *symbols->entries);
    symbols->n = 1;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (words[i][0]) { // the unit NONE has no name
            symbol_of(symbols, words[i], strlen(words[i]));
        }
    }
    return symbols;
}
