// SPDX-License-Identifier: Apache-2.0
// UTF-8, which scripts and reports are written in.
#ifndef LANG_UTF8_H
#define LANG_UTF8_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { UTF8_BAD = 0xfffd }; // the replacement character, which stands for what is no UTF-8

// The character at s, s < end; its length goes to *size. UTF8_BAD and a *size of 1 where the bytes
// are not UTF-8: cut off, longer than needed, a surrogate, beyond U+10FFFF.
static inline uint32_t utf8_decode(const char *s, const char *end, unsigned *size) {
    static const uint32_t least[5] = {0, 0, 0x80, 0x800, 0x10000};
    const unsigned char *u = (const unsigned char *)s;
    unsigned n = u[0] < 0x80 ? 1 : u[0] >= 0xf0 ? 4 : u[0] >= 0xe0 ? 3 : u[0] >= 0xc2 ? 2 : 0;
    *size = 1;
    if (n == 1) {
        return u[0];
    }
    if (!n || (size_t)(end - s) < n) {
        return UTF8_BAD;
    }
    uint32_t c = u[0] & (0xffu >> (n + 1));
    for (unsigned i = 1; i < n; i++) {
        if ((u[i] & 0xc0) != 0x80) {
            return UTF8_BAD;
        }
        c = c << 6 | (u[i] & 0x3f);
    }
    if (c < least[n] || c > 0x10ffff || (c >= 0xd800 && c <= 0xdfff) || u[0] > 0xf4) {
        return UTF8_BAD;
    }
    *size = n;
    return c;
}

// Characters that would steer a terminal, or turn the writing around.
static inline bool utf8_steers(uint32_t c) {
    return c < 0x20 || (c >= 0x7f && c < 0xa0) || (c >= 0x202a && c <= 0x202e) ||
           (c >= 0x2066 && c <= 0x2069);
}

#endif
