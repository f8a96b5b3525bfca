// SPDX-License-Identifier: Apache-2.0
// MurmurHash3_x64_128 (Austin Appleby, public domain), fed piece by piece: the state before is the
// seed of the next.
#include "lang/hash.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static uint64_t rotate_left(uint64_t x, int n) {
    return x << n | x >> (64 - n);
}

static uint64_t mix_final(uint64_t k) {
    k = (k ^ k >> 33) * UINT64_C(0xff51afd7ed558ccd);
    k = (k ^ k >> 33) * UINT64_C(0xc4ceb9fe1a85ec53);
    return k ^ k >> 33;
}

static const uint64_t c1 = UINT64_C(0x87c37b91114253d5), c2 = UINT64_C(0x4cf5ad432745937f);

static void mix_block(Hash128 *h, const unsigned char *block) {
    uint64_t k[2];
    memcpy(k, block, sizeof k);
    h->a ^= rotate_left(k[0] * c1, 31) * c2;
    h->a = (rotate_left(h->a, 27) + h->b) * 5 + 0x52dce729;
    h->b ^= rotate_left(k[1] * c2, 33) * c1;
    h->b = (rotate_left(h->b, 31) + h->a) * 5 + 0x38495ab5;
}

void hash_add(Hash128 *hash, const void *bytes, size_t n) {
    const unsigned char *at = bytes;
    Hash128 h = *hash;
    for (size_t left = n; left >= 16; left -= 16, at += 16) {
        mix_block(&h, at);
    }
    unsigned char tail[16] = {0};
    if (n % 16) {
        memcpy(tail, at, n % 16);
    }
    uint64_t k[2];
    memcpy(k, tail, sizeof k);
    h.b ^= rotate_left(k[1] * c2, 33) * c1;
    h.a ^= rotate_left(k[0] * c1, 31) * c2;
    h.a ^= n;
    h.b ^= n;
    h.a += h.b;
    h.b += h.a;
    h.a = mix_final(h.a);
    h.b = mix_final(h.b);
    h.a += h.b;
    h.b += h.a;
    *hash = h;
}

void hash_text(const Hash128 *hash, char text[33]) {
    snprintf(text, 33, "%016" PRIx64 "%016" PRIx64, hash->a, hash->b);
}
