// SPDX-License-Identifier: Apache-2.0
// A 128-bit hash of what a scene was made from: to tell scenes apart, not to withstand an attacker.
#ifndef LANG_HASH_H
#define LANG_HASH_H

#include <stddef.h>
#include <stdint.h>

// Zeroed: of nothing.
typedef struct {
    uint64_t a, b;
} Hash128;

// Adds n bytes and their number: "ab", "c" is not "a", "bc".
void hash_add(Hash128 *hash, const void *bytes, size_t n);

// 32 hexadecimal digits and a NUL.
void hash_text(const Hash128 *hash, char text[33]);

#endif
