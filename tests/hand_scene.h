// SPDX-License-Identifier: Apache-2.0
// Scenes by hand: programs from a few lines of C, small meshes, options, a reporter that counts.
#ifndef TESTS_HAND_SCENE_H
#define TESTS_HAND_SCENE_H

#include "accel/vec.h"
#include "render/render.h"

// A program in the making: every function returns the index of its instruction.
typedef struct {
    Instr code[256];
    uint32_t n;
} Code;

uint32_t code_number(Code *c, double value);
uint32_t code_input(Code *c, Input input);
uint32_t code_op(Code *c, Op op, uint32_t a, uint32_t b);
Program *code_done(Code *c, Arena *arena, const uint32_t *out, uint32_t n_out);

// 12 outputs: a map without motion.
Program *program_affine(Arena *arena, const Affine *map);
// 12 outputs: turns by rate * t radians around z, then moves by `to` + velocity * t.
Program *program_turning(Arena *arena, double rate, Vec3 to, Vec3 velocity);

// [0,1]^3 around the origin with side `size`: 8 vertices, 12 triangles, outwards.
Mesh *mesh_cube(Arena *arena, double size);
// (n + 1)^2 vertices in the plane z = 0, from -size/2 to size/2, normals to +z.
Mesh *mesh_grid(Arena *arena, uint32_t n, double size);

// A camera at (0, 0, distance) that looks at the origin; the picture is `height` pixels high and
// wide and shows what is `height / per_metre` metres high at the origin.
Scene hand_scene(Arena *arena, const Shape *shapes, uint32_t n_shapes, double distance,
                 double per_metre);

Shape hand_mesh(const Mesh *mesh);
Shape hand_sphere(Arena *arena, Vec3 center, double radius);

typedef struct {
    unsigned n_errors, n_warnings;
    char names[512]; // of warnings, each with a space behind it
    char last[512];  // the last message
} Reports;
Reporter hand_reporter(Reports *reports);

RenderOptions hand_options(void);

// A repeatable stream of numbers in [0, 1).
double hand_random(uint64_t *state);

#endif
