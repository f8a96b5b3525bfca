// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: polygons with positions, texture coordinates and normals, in the file's order.
// (Source: "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual.)
//
// Lines are "v x y z", "vt u v", "vn x y z" and "f corner corner corner...", a corner being v,
// v/vt, v//vn or v/vt/vn with indices from 1, negative ones counted from the last so far. Groups,
// materials, lines and points are skipped; any other word is an error.
#include "render/mesh_build.h"

#include <string.h>

// Indices of one corner, from 0; -1: not named.
typedef struct {
    int64_t v, vt, vn;
} Corner;

typedef struct {
    MeshText *text;
    Arena *scratch;
    double *position;
    float *uv, *normal;              // as the lines have them
    size_t n_v, n_vt, n_vn;          // lines so far
    size_t room_v, room_vt, room_vn; // capacity of the arrays
    Corner *corners;                 // three for each triangle
    size_t n_corners, room_corners;
    Corner *polygon; // of the present line
    size_t room_polygon;
    bool all_vn, any_vt, any_vn;
} Obj;

static const char *const skipped[] = {
    "o",        "g",    "s",     "mg",    "usemtl",     "mtllib",   "usemap", "maplib", "l",
    "p",        "vp",   "deg",   "bmat",  "step",       "cstype",   "curv",   "curv2",  "surf",
    "parm",     "trim", "hole",  "scrv",  "sp",         "end",      "con",    "bevel",  "c_interp",
    "d_interp", "lod",  "ctech", "stech", "shadow_obj", "trace_obj"};

static bool is_skipped(const MeshText *text) {
    for (size_t i = 0; i < sizeof skipped / sizeof skipped[0]; i++) {
        if (mesh_text_is_word(text, skipped[i])) {
            return true;
        }
    }
    return false;
}

// A backslash at the end of a line joins the next one.
static void skip_blanks(MeshText *text) {
    mesh_text_skip_blanks(text);
    while (text->at[0] == '\\' && (text->at[1] == '\n' || text->at[1] == '\r')) {
        text->at++;
        mesh_text_next_line(text);
        mesh_text_skip_blanks(text);
    }
}

static bool at_end(const MeshText *text) {
    return mesh_text_at_line_end(text) || *text->at == '#';
}

// From low to high numbers up to the end of the line; those after the first `kept` are checked and
// dropped. What is missing is 0.
static bool take_numbers(MeshText *text, const char *what, size_t low, size_t high, size_t kept,
                         double *values) {
    size_t n = 0;
    for (skip_blanks(text); !at_end(text); skip_blanks(text), n++) {
        double value;
        if (!mesh_text_number(text, &value)) {
            return mesh_text_fail(text, "\"%s\" is not a number", mesh_text_quote(text).text);
        }
        if (n == high) {
            return mesh_text_fail(text, "a %s has at most %zu numbers", what, high);
        }
        if (n < kept) {
            values[n] = value;
        }
    }
    return n >= low || mesh_text_fail(text, "a %s has %zu numbers, here are %zu", what, low, n);
}

static bool check_count(Obj *obj, size_t n) {
    return n < MESH_COUNT_LIMIT || mesh_text_fail(obj->text, "more than 2^31 lines of one kind");
}

// x y z, then perhaps a weight, or a colour, or both.
static bool take_position(Obj *obj) {
    size_t size = 3 * sizeof *obj->position;
    obj->position = arena_grow(obj->scratch, obj->position, obj->n_v, &obj->room_v, size);
    return check_count(obj, obj->n_v) &&
           take_numbers(obj->text, "vertex", 3, 7, 3, obj->position + 3 * obj->n_v++);
}

static bool take_normal(Obj *obj) {
    double v[3] = {0};
    obj->normal =
        arena_grow(obj->scratch, obj->normal, obj->n_vn, &obj->room_vn, 3 * sizeof *obj->normal);
    if (!check_count(obj, obj->n_vn) || !take_numbers(obj->text, "normal", 3, 3, 3, v)) {
        return false;
    }
    for (int k = 0; k < 3; k++) {
        obj->normal[3 * obj->n_vn + (size_t)k] = (float)v[k];
    }
    obj->n_vn++;
    return true;
}

static bool take_uv(Obj *obj) {
    double v[2] = {0};
    obj->uv = arena_grow(obj->scratch, obj->uv, obj->n_vt, &obj->room_vt, 2 * sizeof *obj->uv);
    if (!check_count(obj, obj->n_vt) ||
        !take_numbers(obj->text, "texture coordinate", 1, 3, 2, v)) {
        return false;
    }
    obj->uv[2 * obj->n_vt] = (float)v[0];
    obj->uv[2 * obj->n_vt + 1] = (float)v[1];
    obj->n_vt++;
    return true;
}

static bool take_index(MeshText *text, const char *what, const char *whats, size_t n,
                       int64_t *index) {
    int64_t i;
    if (!mesh_text_integer(text, &i)) {
        return mesh_text_fail(text, "a %s index is expected, not \"%s\"", what,
                              mesh_text_quote(text).text);
    }
    if (i == 0) {
        return mesh_text_fail(text, "%s index 0: indices begin at 1", what);
    }
    if (i > (int64_t)n || i < -(int64_t)n) {
        return mesh_text_fail(text, "%s index %lld is beyond the %zu %s so far", what, (long long)i,
                              n, whats);
    }
    *index = i > 0 ? i - 1 : (int64_t)n + i;
    return true;
}

static bool take_corner(Obj *obj, Corner *c) {
    MeshText *text = obj->text;
    *c = (Corner){-1, -1, -1};
    if (!take_index(text, "face", "vertices", obj->n_v, &c->v)) {
        return false;
    }
    if (*text->at == '/') {
        text->at++;
        if (*text->at != '/' &&
            !take_index(text, "texture", "texture coordinates", obj->n_vt, &c->vt)) {
            return false;
        }
        if (*text->at == '/') {
            text->at++;
            if (!take_index(text, "normal", "normals", obj->n_vn, &c->vn)) {
                return false;
            }
        }
    }
    if (*text->at == ' ' || *text->at == '\t' || *text->at == '\\' || at_end(text)) {
        return true;
    }
    return mesh_text_fail(text, "\"%s\" after a corner of a face", mesh_text_quote(text).text);
}

static void add_triangle(Obj *obj, const Corner *a, const Corner *b, const Corner *c) {
    obj->corners = arena_grow(obj->scratch, obj->corners, obj->n_corners / 3, &obj->room_corners,
                              3 * sizeof *obj->corners);
    Corner *to = obj->corners + obj->n_corners;
    to[0] = *a;
    to[1] = *b;
    to[2] = *c;
    obj->n_corners += 3;
}

static bool take_face(Obj *obj) {
    size_t n = 0;
    for (skip_blanks(obj->text); !at_end(obj->text); skip_blanks(obj->text), n++) {
        obj->polygon =
            arena_grow(obj->scratch, obj->polygon, n, &obj->room_polygon, sizeof *obj->polygon);
        Corner *c = &obj->polygon[n];
        if (!take_corner(obj, c)) {
            return false;
        }
        if ((c->vt < 0) != (obj->polygon[0].vt < 0) || (c->vn < 0) != (obj->polygon[0].vn < 0)) {
            return mesh_text_fail(obj->text, "corner %zu is not of the form of the first one",
                                  n + 1);
        }
    }
    if (n < 3) {
        return mesh_text_fail(obj->text, "a face has 3 or more corners, here are %zu", n);
    }
    obj->any_vt |= obj->polygon[0].vt >= 0;
    obj->any_vn |= obj->polygon[0].vn >= 0;
    obj->all_vn &= obj->polygon[0].vn >= 0;
    for (size_t i = 2; i < n; i++) {
        if (!check_count(obj, obj->n_corners / 3)) {
            return false;
        }
        add_triangle(obj, &obj->polygon[0], &obj->polygon[i - 1], &obj->polygon[i]);
    }
    return true;
}

static bool take_line(Obj *obj) {
    static const struct {
        const char *word;
        bool (*take)(Obj *);
    } kinds[] = {{"v", take_position}, {"f", take_face}, {"vn", take_normal}, {"vt", take_uv}};
    MeshText *text = obj->text;
    skip_blanks(text);
    if (at_end(text)) {
        return true;
    }
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (mesh_text_is_word(text, kinds[i].word)) {
            text->at += strlen(kinds[i].word);
            return kinds[i].take(obj);
        }
    }
    return is_skipped(text) ||
           mesh_text_fail(text, "unknown word \"%s\"", mesh_text_quote(text).text);
}

// A line that is skipped may go on after a backslash, too.
static void next_line(MeshText *text) {
    while (!mesh_text_at_line_end(text)) {
        bool is_joined = text->at[0] == '\\' && (text->at[1] == '\n' || text->at[1] == '\r');
        text->at++;
        if (is_joined) {
            mesh_text_next_line(text);
        }
    }
    mesh_text_next_line(text);
}

// Gives each distinct (v, vt, vn) its vertex: the first that a v is used with lies at v itself,
// further ones after all v, in order of appearance.
static size_t number_vertices(Obj *obj, Corner **vertices, uint32_t *index) {
    MeshWeld weld = {.arena = obj->scratch};
    size_t n = obj->n_v, room = obj->n_v;
    Corner *table = ARENA_ARRAY(obj->scratch, room, Corner);
    for (size_t i = 0; i < n; i++) {
        table[i] = (Corner){-1, -1, -1};
    }
    for (size_t i = 0; i < obj->n_corners; i++) {
        Corner c = obj->corners[i];
        c.vn = obj->all_vn ? c.vn : -1;
        Corner *own = &table[c.v];
        if (own->v < 0) {
            *own = c;
        }
        if (own->vt == c.vt && own->vn == c.vn) {
            index[i] = (uint32_t)c.v;
            continue;
        }
        uint64_t key[3] = {(uint64_t)c.v, (uint64_t)c.vt, (uint64_t)c.vn};
        size_t at = obj->n_v + mesh_weld_add(&weld, key);
        if (at == n) {
            table = arena_grow(obj->scratch, table, n, &room, sizeof *table);
            table[n++] = c;
        }
        index[i] = (uint32_t)at;
    }
    *vertices = table;
    return n;
}

static bool collect(Obj *obj, Arena *arena, Mesh *mesh) {
    Corner *vertices;
    mesh->n_triangles = (uint32_t)(obj->n_corners / 3);
    mesh->index = ARENA_ARRAY(arena, obj->n_corners, uint32_t);
    size_t n = number_vertices(obj, &vertices, mesh->index);
    if (n > MESH_COUNT_LIMIT) {
        return false;
    }
    mesh->n_vertices = (uint32_t)n;
    mesh->position = ARENA_ARRAY(arena, 3 * n, double);
    mesh->normal = obj->any_vn && obj->all_vn ? ARENA_ARRAY(arena, 3 * n, float) : NULL;
    mesh->uv = obj->any_vt ? ARENA_ARRAY(arena, 2 * n, float) : NULL;
    mesh->n_points = (uint32_t)obj->n_v;
    mesh->point = n > obj->n_v ? ARENA_ARRAY(arena, n, uint32_t) : NULL;
    memcpy(mesh->position, obj->position, 3 * obj->n_v * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        const Corner *c = &vertices[i];
        if (mesh->point) {
            mesh->point[i] = (uint32_t)(i < obj->n_v ? i : (size_t)c->v);
        }
        if (i >= obj->n_v) {
            memcpy(mesh->position + 3 * i, obj->position + 3 * c->v, 3 * sizeof(double));
        }
        if (mesh->normal && c->vn >= 0) {
            memcpy(mesh->normal + 3 * i, obj->normal + 3 * c->vn, 3 * sizeof(float));
        }
        if (mesh->uv && c->vt >= 0) {
            memcpy(mesh->uv + 2 * i, obj->uv + 2 * c->vt, 2 * sizeof(float));
        }
    }
    if (mesh->normal) {
        mesh_normals_finish(mesh);
    }
    return true;
}

MeshStatus mesh_obj_read(Arena *arena, MeshText *text, Mesh *mesh) {
    Arena scratch = {0};
    Obj obj = {.text = text, .scratch = &scratch, .all_vn = true};
    bool is_fine = true;
    while (is_fine && text->at < text->end) {
        is_fine = take_line(&obj);
        if (is_fine) {
            next_line(text);
        }
    }
    MeshStatus status = is_fine ? MESH_OK : MESH_BAD_FORMAT;
    if (is_fine && obj.n_v == 0) {
        text->line = 0;
        mesh_text_fail(text, "there are no vertices in it");
        status = MESH_BAD_FORMAT;
    } else if (is_fine && !collect(&obj, arena, mesh)) {
        text->line = 0;
        mesh_text_fail(text, "it has more than 2^31 vertices");
        status = MESH_TOO_LARGE;
    }
    arena_free(&scratch);
    return status;
}
