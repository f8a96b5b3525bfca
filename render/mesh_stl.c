// SPDX-License-Identifier: Apache-2.0
// STL, ASCII and binary: loose facets, whose exactly equal corners become one vertex, numbered in
// order of appearance, so that the mesh deforms as one. Its facets stay faceted; the normals in the
// file are those of the facets and often wrong, so they are not used.
// (Source: 3D Systems, StereoLithography Interface Specification, 1989.)
#include "render/mesh_build.h"

#include <string.h>

enum { HEADER = 84, FACET = 50, NORMAL = 12 };

typedef struct {
    MeshText *text;
    MeshWeld weld;
    uint32_t *index; // grows
    size_t n_corners, room;
} Stl;

static uint32_t bits_at(const char *bytes) {
    const unsigned char *at = (const unsigned char *)bytes;
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

bool mesh_stl_is_binary(const char *bytes, size_t n) {
    return n >= HEADER && n == HEADER + (uint64_t)FACET * bits_at(bytes + HEADER - 4);
}

static void add_corner(Stl *stl, const double position[3]) {
    uint64_t key[3];
    for (int k = 0; k < 3; k++) {
        double v = position[k] + 0.0; // -0 becomes 0: the same place
        memcpy(&key[k], &v, sizeof v);
    }
    stl->index =
        arena_grow(stl->weld.arena, stl->index, stl->n_corners, &stl->room, sizeof *stl->index);
    stl->index[stl->n_corners++] = mesh_weld_add(&stl->weld, key);
}

static void take_binary(Stl *stl) {
    const char *at = stl->text->at + HEADER;
    uint32_t n = bits_at(at - 4);
    for (uint32_t i = 0; i < n; i++, at += FACET) {
        for (int corner = 0; corner < 3; corner++) {
            double position[3];
            for (int k = 0; k < 3; k++) {
                uint32_t bits = bits_at(at + NORMAL + 12 * corner + 4 * k);
                float v;
                memcpy(&v, &bits, sizeof v);
                position[k] = (double)v;
            }
            add_corner(stl, position);
        }
    }
}

static bool take_word(Stl *stl, const char *word) {
    mesh_text_skip_space(stl->text);
    if (!mesh_text_is_word(stl->text, word)) {
        return stl->text->at == stl->text->end
                   ? mesh_text_fail(stl->text, "the file ends, \"%s\" is expected", word)
                   : mesh_text_fail(stl->text, "\"%s\" is expected, not \"%s\"", word,
                                    mesh_text_quote(stl->text).text);
    }
    stl->text->at += strlen(word);
    return true;
}

static bool take_vector(Stl *stl, double v[3]) {
    for (int k = 0; k < 3; k++) {
        mesh_text_skip_space(stl->text);
        if (!mesh_text_number(stl->text, &v[k])) {
            return mesh_text_fail(stl->text, "\"%s\" is not a number",
                                  mesh_text_quote(stl->text).text);
        }
    }
    return true;
}

// After "facet".
static bool take_facet(Stl *stl) {
    double v[3];
    if (stl->n_corners / 3 >= MESH_COUNT_LIMIT) {
        return mesh_text_fail(stl->text, "more than 2^31 facets");
    }
    if (!take_word(stl, "normal") || !take_vector(stl, v) || !take_word(stl, "outer") ||
        !take_word(stl, "loop")) {
        return false;
    }
    for (int corner = 0; corner < 3; corner++) {
        if (!take_word(stl, "vertex") || !take_vector(stl, v)) {
            return false;
        }
        add_corner(stl, v);
    }
    return take_word(stl, "endloop") && take_word(stl, "endfacet");
}

// solid NAME, facets, endsolid NAME; again and again up to the end of the file.
static bool take_ascii(Stl *stl) {
    MeshText *text = stl->text;
    while (mesh_text_skip_space(text), text->at < text->end) {
        if (!take_word(stl, "solid")) {
            return false;
        }
        mesh_text_next_line(text);
        while (mesh_text_skip_space(text), mesh_text_is_word(text, "facet")) {
            text->at += 5;
            if (!take_facet(stl)) {
                return false;
            }
        }
        if (!take_word(stl, "endsolid")) {
            return false;
        }
        mesh_text_next_line(text);
    }
    return true;
}

static bool take_file(Stl *stl) {
    MeshText *text = stl->text;
    size_t size = (size_t)(text->end - text->at);
    if (mesh_stl_is_binary(text->at, size)) {
        if (bits_at(text->at + HEADER - 4) > MESH_COUNT_LIMIT) {
            return mesh_text_fail(text, "more than 2^31 facets");
        }
        take_binary(stl);
        return true;
    }
    mesh_text_skip_space(text);
    if (mesh_text_is_word(text, "solid")) {
        return take_ascii(stl);
    }
    text->line = 0;
    if (size < HEADER) {
        return mesh_text_fail(text, "it is neither ASCII STL nor long enough for a binary one");
    }
    uint32_t n = bits_at(text->end - size + HEADER - 4);
    return mesh_text_fail(text, "%u facets take %llu bytes, the file has %zu", n,
                          HEADER + (unsigned long long)FACET * n, size);
}

MeshStatus mesh_stl_read(Arena *arena, MeshText *text, Mesh *mesh) {
    Arena scratch = {0};
    Stl stl = {.text = text, .weld.arena = &scratch};
    bool is_fine = take_file(&stl);
    if (is_fine) {
        mesh->faceted = true;
        mesh->n_vertices = (uint32_t)stl.weld.n;
        mesh->n_triangles = (uint32_t)(stl.n_corners / 3);
        mesh->position = ARENA_ARRAY(arena, 3 * stl.weld.n, double);
        mesh->index = ARENA_ARRAY(arena, stl.n_corners, uint32_t);
        if (stl.n_corners) {
            // The keys of the welding are the bits of the positions.
            memcpy(mesh->position, stl.weld.keys, stl.weld.n * sizeof *stl.weld.keys);
            memcpy(mesh->index, stl.index, stl.n_corners * sizeof *mesh->index);
        }
    }
    arena_free(&scratch);
    return is_fine ? MESH_OK : MESH_BAD_FORMAT;
}
