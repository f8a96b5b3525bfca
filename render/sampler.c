// SPDX-License-Identifier: Apache-2.0
// Owen-scrambled Sobol points by hashing.
#include "render/sampler.h"

// directions[i][d]: what bit i of the index contributes to dimension d, lowest bit first (the usual
// tables reversed), which is how the scrambling wants them. Primitive polynomials 1, x + 1,
// x^2 + x + 1, x^3 + x + 1 with initial numbers (1), (1), (1, 3), (1, 3, 1).
// clang-format off
static const uint32_t directions[32][SAMPLE_DIMENSIONS] = {
    {0x00000001, 0x00000001, 0x00000001, 0x00000001},
    {0x00000002, 0x00000003, 0x00000003, 0x00000003},
    {0x00000004, 0x00000005, 0x00000006, 0x00000004},
    {0x00000008, 0x0000000f, 0x00000009, 0x0000000a},
    {0x00000010, 0x00000011, 0x00000017, 0x0000001f},
    {0x00000020, 0x00000033, 0x0000003a, 0x0000002e},
    {0x00000040, 0x00000055, 0x00000071, 0x00000045},
    {0x00000080, 0x000000ff, 0x000000a3, 0x000000c9},
    {0x00000100, 0x00000101, 0x00000116, 0x0000011b},
    {0x00000200, 0x00000303, 0x00000339, 0x000002a4},
    {0x00000400, 0x00000505, 0x00000677, 0x0000079a},
    {0x00000800, 0x00000f0f, 0x000009aa, 0x00000b67},
    {0x00001000, 0x00001111, 0x00001601, 0x0000101e},
    {0x00002000, 0x00003333, 0x00003903, 0x0000302d},
    {0x00004000, 0x00005555, 0x00007706, 0x00004041},
    {0x00008000, 0x0000ffff, 0x0000aa09, 0x0000a0c3},
    {0x00010000, 0x00010001, 0x00010117, 0x0001f104},
    {0x00020000, 0x00030003, 0x0003033a, 0x0002e28a},
    {0x00040000, 0x00050005, 0x00060671, 0x000457df},
    {0x00080000, 0x000f000f, 0x000909a3, 0x000c9bae},
    {0x00100000, 0x00110011, 0x00171616, 0x0011a105},
    {0x00200000, 0x00330033, 0x003a3939, 0x002a7289},
    {0x00400000, 0x00550055, 0x00717777, 0x0079e7db},
    {0x00800000, 0x00ff00ff, 0x00a3aaaa, 0x00b6dba4},
    {0x01000000, 0x01010101, 0x01170001, 0x0100011a},
    {0x02000000, 0x03030303, 0x033a0003, 0x030002a7},
    {0x04000000, 0x05050505, 0x06710006, 0x0400079e},
    {0x08000000, 0x0f0f0f0f, 0x09a30009, 0x0a000b6d},
    {0x10000000, 0x11111111, 0x16160017, 0x1f001001},
    {0x20000000, 0x33333333, 0x3939003a, 0x2e003003},
    {0x40000000, 0x55555555, 0x77770071, 0x45004004},
    {0x80000000, 0xffffffff, 0xaaaa00a3, 0xc900a00a},
};
// clang-format on

// A bijection of 64 bits in which every input bit reaches every output bit (Stafford, "Better bit
// mixing", variant 13).
static uint64_t mix(uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9u;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static uint64_t combine(uint64_t key, uint64_t value) {
    return mix(key + 0x9e3779b97f4a7c15u + mix(value));
}

static uint32_t reverse_bits(uint32_t x) {
    x = __builtin_bswap32(x);
    x = (x & 0xf0f0f0f0u) >> 4 | (x & 0x0f0f0f0fu) << 4;
    x = (x & 0xccccccccu) >> 2 | (x & 0x33333333u) << 2;
    return (x & 0xaaaaaaaau) >> 1 | (x & 0x55555555u) << 1;
}

// Each bit is changed by the bits below it alone: on reversed numbers that is a random nested
// uniform permutation.
static uint32_t permute_upwards(uint32_t x, uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= seed >> 16 | 1;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

// Sets are told apart by the order of their points. The first keeps it: there is nothing before it
// to be in step with, and small indices have few bits.
static uint32_t shuffle(uint32_t index, uint32_t set, uint32_t seed) {
    return set == SAMPLE_SET_PIXEL ? index
                                   : reverse_bits(permute_upwards(reverse_bits(index), seed));
}

Sampler sampler_pixel(uint64_t seed, bool freeze, int64_t frame, uint32_t x, uint32_t y) {
    uint64_t key = combine(seed, freeze ? 0 : (uint64_t)frame);
    return (Sampler){{combine(key, (uint64_t)y << 32 | x)}, 1};
}

Sampler sampler_pixel_halves(uint64_t seed, bool freeze, int64_t frame, uint32_t x, uint32_t y) {
    Sampler sampler = sampler_pixel(seed, freeze, frame, x, y);
    sampler.key[1] = combine(sampler.key[0], UINT64_MAX); // more than any set
    sampler.n_halves = 2;
    return sampler;
}

void sampler_draw(const Sampler *sampler, uint32_t index, uint32_t set,
                  double out[SAMPLE_DIMENSIONS]) {
    const uint32_t shift = sampler->n_halves - 1;
    const uint64_t key = combine(sampler->key[index & shift], set);
    const uint64_t more = mix(key + 1), most = mix(key + 2);
    const uint32_t seeds[SAMPLE_DIMENSIONS] = {(uint32_t)more, (uint32_t)(more >> 32),
                                               (uint32_t)most, (uint32_t)(most >> 32)};
    uint32_t point[SAMPLE_DIMENSIONS] = {0};
    for (uint32_t rest = shuffle(index >> shift, set, (uint32_t)key); rest; rest &= rest - 1) {
        const uint32_t *row = directions[__builtin_ctz(rest)];
        for (int d = 0; d < SAMPLE_DIMENSIONS; d++) {
            point[d] ^= row[d];
        }
    }
    for (int d = 0; d < SAMPLE_DIMENSIONS; d++) {
        uint32_t scrambled = reverse_bits(permute_upwards(point[d], seeds[d]));
        out[d] = (scrambled + 0.5) * 0x1p-32;
    }
}
