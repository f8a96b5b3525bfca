// SPDX-License-Identifier: Apache-2.0
// Gradient noise: Ken Perlin, "Improving Noise", SIGGRAPH 2002, with a hash of the lattice point in
// the place of his permutation, so that it does not repeat.
#include "render/program_ops.h"

static double fade(double t) {
    return t * t * t * (t * (t * 6 - 15) + 10);
}

static double lerp(double t, double a, double b) {
    return a + t * (b - a);
}

// The dot product of (x, y, z) with one of the twelve directions to the edges of a cube.
static double gradient(double ix, double iy, double iz, double x, double y, double z) {
    uint64_t h = op_mix(op_bits(ix) * 0x9e3779b97f4a7c15u + 1);
    h = op_mix(h ^ (op_bits(iy) * 0xbf58476d1ce4e5b9u + 2));
    h = op_mix(h ^ (op_bits(iz) * 0x94d049bb133111ebu + 3));
    unsigned k = (unsigned)(h >> 60);
    double u = k < 8 ? x : y;
    double v = k < 4 ? y : k == 12 || k == 14 ? x : z;
    return (k & 1 ? -u : u) + (k & 2 ? -v : v);
}

double op_noise(double x, double y, double z) {
    double ix = floor(x), iy = floor(y), iz = floor(z);
    double fx = x - ix, fy = y - iy, fz = z - iz;
    double u = fade(fx), v = fade(fy), w = fade(fz);
    double corner[8];
    for (int k = 0; k < 8; k++) {
        double dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
        corner[k] = gradient(ix + dx, iy + dy, iz + dz, fx - dx, fy - dy, fz - dz);
    }
    double front = lerp(v, lerp(u, corner[0], corner[1]), lerp(u, corner[2], corner[3]));
    double back = lerp(v, lerp(u, corner[4], corner[5]), lerp(u, corner[6], corner[7]));
    return lerp(w, front, back);
}
