// SPDX-License-Identifier: Apache-2.0
// Scenes by hand.
#include "tests/hand_scene.h"

#include <stdio.h>
#include <string.h>

uint32_t code_number(Code *c, double value) {
    c->code[c->n] = (Instr){.op = OP_CONST, .value = value};
    return c->n++;
}

uint32_t code_input(Code *c, Input input) {
    c->code[c->n] = (Instr){.op = OP_INPUT, .table = input};
    return c->n++;
}

uint32_t code_op(Code *c, Op op, uint32_t a, uint32_t b) {
    c->code[c->n] = (Instr){.op = (uint8_t)op, .a = a, .b = b};
    return c->n++;
}

Program *code_done(Code *c, Arena *arena, const uint32_t *out, uint32_t n_out) {
    return program_new(arena, c->code, c->n, out, n_out, NULL, 0);
}

Program *program_affine(Arena *arena, const Affine *map) {
    Code c = {.n = 0};
    uint32_t out[12];
    for (int i = 0; i < 12; i++) {
        out[i] = code_number(&c, map->m[i / 4][i % 4]);
    }
    return code_done(&c, arena, out, 12);
}

Program *program_turning(Arena *arena, double rate, Vec3 to, Vec3 velocity) {
    Code c = {.n = 0};
    uint32_t t = code_input(&c, IN_T), zero = code_number(&c, 0), one = code_number(&c, 1);
    uint32_t angle = code_op(&c, OP_MUL, t, code_number(&c, rate));
    uint32_t cosine = code_op(&c, OP_COS, angle, 0), sine = code_op(&c, OP_SIN, angle, 0);
    const double start[3] = {to.x, to.y, to.z}, speed[3] = {velocity.x, velocity.y, velocity.z};
    uint32_t at[3];
    for (int k = 0; k < 3; k++) {
        uint32_t way = code_op(&c, OP_MUL, t, code_number(&c, speed[k]));
        at[k] = code_op(&c, OP_ADD, way, code_number(&c, start[k]));
    }
    uint32_t back = code_op(&c, OP_NEG, sine, 0);
    const uint32_t out[12] = {cosine, back,  zero, at[0], sine, cosine,
                              zero,   at[1], zero, zero,  one,  at[2]};
    return code_done(&c, arena, out, 12);
}

Mesh *mesh_cube(Arena *arena, double size) {
    static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                          {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                          {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    Mesh *mesh = ARENA_NEW(arena, Mesh);
    mesh->n_vertices = 8;
    mesh->n_triangles = 12;
    mesh->position = ARENA_ARRAY(arena, 24, double);
    mesh->index = ARENA_ARRAY(arena, 36, uint32_t);
    for (int i = 0; i < 8; i++) {
        for (int k = 0; k < 3; k++) {
            mesh->position[3 * i + k] = (i >> k & 1 ? 0.5 : -0.5) * size;
        }
    }
    memcpy(mesh->index, faces, sizeof faces);
    return mesh;
}

Mesh *mesh_grid(Arena *arena, uint32_t n, double size) {
    Mesh *mesh = ARENA_NEW(arena, Mesh);
    uint32_t row = n + 1, *index;
    mesh->n_vertices = row * row;
    mesh->n_triangles = 2 * n * n;
    mesh->position = ARENA_ARRAY(arena, 3 * (size_t)mesh->n_vertices, double);
    mesh->index = index = ARENA_ARRAY(arena, 3 * (size_t)mesh->n_triangles, uint32_t);
    for (uint32_t i = 0; i < mesh->n_vertices; i++) {
        mesh->position[3 * i] = ((double)(i % row) / n - 0.5) * size;
        mesh->position[3 * i + 1] = ((double)(i / row) / n - 0.5) * size;
    }
    for (uint32_t y = 0; y < n; y++) {
        for (uint32_t x = 0; x < n; x++) {
            uint32_t a = y * row + x;
            const uint32_t corners[6] = {a, a + 1, a + row + 1, a, a + row + 1, a + row};
            memcpy(index, corners, sizeof corners);
            index += 6;
        }
    }
    return mesh;
}

Scene hand_scene(Arena *arena, const Shape *shapes, uint32_t n_shapes, double distance,
                 double per_metre) {
    const uint32_t height = 100;
    Scene scene = {
        .film = {.width = height, .height = height, .fps = 24, .first_frame = 1, .last_frame = 10},
        .shutter = {.length = 1, .open = 0},
        .shapes = shapes,
        .n_shapes = n_shapes};
    const double fov = 2 * atan(height / per_metre / 2 / distance);
    const double values[10] = {0, 0, distance, 0, 0, 0, 0, 1, 0, fov};
    Code c = {.n = 0};
    uint32_t out[10];
    for (int i = 0; i < 10; i++) {
        out[i] = code_number(&c, values[i]);
    }
    scene.camera.program = code_done(&c, arena, out, 10);
    return scene;
}

Shape hand_mesh(const Mesh *mesh) {
    return (Shape){.kind = SHAPE_MESH,
                   .mesh = mesh,
                   .label = "mesh",
                   .tolerance = 0.25,
                   .smooth = -1,
                   .n_instances = 1};
}

Shape hand_sphere(Arena *arena, Vec3 center, double radius) {
    Code c = {.n = 0};
    const uint32_t out[4] = {code_number(&c, center.x), code_number(&c, center.y),
                             code_number(&c, center.z), code_number(&c, radius)};
    return (Shape){.kind = SHAPE_SPHERE,
                   .geometry = code_done(&c, arena, out, 4),
                   .label = "sphere",
                   .tolerance = 0.25,
                   .n_instances = 1};
}

static void emit(void *context, SourceRef where, const char *name, const char *message) {
    (void)where;
    Reports *r = context;
    size_t used = strlen(r->names);
    r->n_errors += name == NULL;
    r->n_warnings += name != NULL;
    snprintf(r->names + used, sizeof r->names - used, "%s ", name ? name : "error");
    snprintf(r->last, sizeof r->last, "%s", message);
}

Reporter hand_reporter(Reports *reports) {
    *reports = (Reports){0};
    return (Reporter){emit, reports};
}

RenderOptions hand_options(void) {
    RenderOptions options = {.spp = 1, .n_threads = 1, .validate = true};
    options.accel = accel_find("brute");
    options.accel_options = accel_options_default();
    return options;
}

double hand_random(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}
