// SPDX-License-Identifier: Apache-2.0
// Interned strings as the parser needs them: words of the grammar have fixed symbols, and a hash
// that the lexer has made on its way is not made twice.
#ifndef LANG_SYMBOLS_H
#define LANG_SYMBOLS_H

#include "lang/syntax.h"

enum {
    KEYWORD_NONE,
#define KEYWORD(id, text) KEYWORD_##id,
#include "lang/keywords.def"
#undef KEYWORD
    KEYWORD_COUNT,
    KEYWORD_LAST_STATEMENT = KEYWORD_INSTANCE
};

// FNV-1a: begin with SYMBOL_HASH, then one step per character.
#define SYMBOL_HASH UINT32_C(2166136261)
static inline uint32_t symbol_hash_step(uint32_t hash, unsigned char c) {
    return (hash ^ c) * UINT32_C(16777619);
}

// symbol_of where the hash of the text is known.
Symbol symbol_of_hashed(Symbols *symbols, const char *text, size_t n, uint32_t hash);

// The symbols of the units' names follow the words' in the order of lang/units.def.
static inline bool symbol_is_unit(Symbol symbol) {
    return symbol >= KEYWORD_COUNT && symbol < KEYWORD_COUNT + UNIT_COUNT - 1;
}

#endif
