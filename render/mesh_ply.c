// SPDX-License-Identifier: Apache-2.0
// PLY: ASCII and binary of both byte orders, any property types, polygons, in the file's order.
// (Source: Greg Turk, The PLY Polygon File Format, 1994.)
//
// Elements come in the order of the header, each a run of rows of the same properties. Of element
// "vertex" x y z, nx ny nz and a pair of texture coordinates are kept, of element "face" the list
// vertex_indices; all else is stepped over.
#include "render/mesh_build.h"

#include <string.h>

// The types, under their old and their new names.
typedef enum { TYPE_I8, TYPE_U8, TYPE_I16, TYPE_U16, TYPE_I32, TYPE_U32, TYPE_F32, TYPE_F64 } Type;

static const struct {
    const char *old_name, *name;
    size_t size;
} types[] = {{"char", "int8", 1},     {"uchar", "uint8", 1},   {"short", "int16", 2},
             {"ushort", "uint16", 2}, {"int", "int32", 4},     {"uint", "uint32", 4},
             {"float", "float32", 4}, {"double", "float64", 8}};
enum { N_TYPES = sizeof types / sizeof types[0] };

typedef enum {
    ROLE_NONE,
    ROLE_X,
    ROLE_Y,
    ROLE_Z,
    ROLE_NX,
    ROLE_NY,
    ROLE_NZ,
    ROLE_U,
    ROLE_V,
    ROLE_CORNERS,
    N_ROLES
} Role;

static const struct {
    const char *name;
    Role role;
} vertex_roles[] = {{"x", ROLE_X},   {"y", ROLE_Y},   {"z", ROLE_Z},         {"nx", ROLE_NX},
                    {"ny", ROLE_NY}, {"nz", ROLE_NZ}, {"u", ROLE_U},         {"v", ROLE_V},
                    {"s", ROLE_U},   {"t", ROLE_V},   {"texture_u", ROLE_U}, {"texture_v", ROLE_V}};

typedef struct {
    Type type, count_type;
    Role role;
    bool is_list;
} Property;

typedef enum { ELEMENT_OTHER, ELEMENT_VERTEX, ELEMENT_FACE } ElementKind;

typedef struct {
    ElementKind kind;
    size_t n_rows, first, n_properties, room;
    Property *properties;
    bool has[N_ROLES];
} Element;

typedef enum { FORMAT_NONE, FORMAT_ASCII, FORMAT_LITTLE, FORMAT_BIG } Format;

typedef struct {
    MeshText *text;
    Arena *arena, *scratch;
    Mesh *mesh;
    Format format;
    Element *elements;
    size_t n_elements, room_elements, n_vertices;
    bool has_vertices;
    uint32_t *index; // grows
    size_t n_triangles, room_triangles;
    uint32_t *polygon;
    size_t room_polygon;
    const char *row_name; // of the row being read, for messages
    size_t row;
} Ply;

// ---- the header

static bool next_word(Ply *ply, const char *what) {
    mesh_text_skip_blanks(ply->text);
    return !mesh_text_at_line_end(ply->text) || mesh_text_fail(ply->text, "%s is missing", what);
}

static bool take_type(Ply *ply, Type *type) {
    if (!next_word(ply, "the type of the property")) {
        return false;
    }
    for (int i = 0; i < N_TYPES; i++) {
        if (mesh_text_is_word(ply->text, types[i].name) ||
            mesh_text_is_word(ply->text, types[i].old_name)) {
            *type = (Type)i;
            ply->text->at += mesh_text_word(ply->text);
            return true;
        }
    }
    return mesh_text_fail(ply->text, "unknown type \"%s\"", mesh_text_quote(ply->text).text);
}

static bool take_format(Ply *ply) {
    static const char *const names[] = {"", "ascii", "binary_little_endian", "binary_big_endian"};
    if (!next_word(ply, "the format")) {
        return false;
    }
    for (int i = FORMAT_ASCII; i <= FORMAT_BIG; i++) {
        if (mesh_text_is_word(ply->text, names[i])) {
            ply->format = (Format)i;
            return true;
        }
    }
    return mesh_text_fail(ply->text, "unknown format \"%s\"", mesh_text_quote(ply->text).text);
}

static bool take_element(Ply *ply) {
    MeshText *text = ply->text;
    ply->elements = arena_grow(ply->scratch, ply->elements, ply->n_elements, &ply->room_elements,
                               sizeof *ply->elements);
    Element *e = &ply->elements[ply->n_elements];
    *e = (Element){0};
    if (!next_word(ply, "the name of the element")) {
        return false;
    }
    bool is_vertex = mesh_text_is_word(text, "vertex");
    if (mesh_text_is_word(text, "tristrips")) {
        return mesh_text_fail(text, "not supported yet: triangle strips");
    }
    e->kind = is_vertex                         ? ELEMENT_VERTEX
              : mesh_text_is_word(text, "face") ? ELEMENT_FACE
                                                : ELEMENT_OTHER;
    text->at += mesh_text_word(text);
    int64_t n;
    if (!next_word(ply, "the number of rows") || !mesh_text_integer(text, &n) || n < 0 ||
        (mesh_text_skip_blanks(text), !mesh_text_at_line_end(text))) {
        return mesh_text_fail(text, "the element's number of rows is expected");
    }
    e->n_rows = (size_t)n;
    if (is_vertex && ply->has_vertices) {
        return mesh_text_fail(text, "a second element \"vertex\"");
    }
    if (is_vertex) {
        ply->has_vertices = true;
        ply->n_vertices = e->n_rows;
    }
    ply->n_elements++;
    return true;
}

static Role role_of(const MeshText *text, ElementKind kind, bool is_list) {
    if (kind == ELEMENT_FACE && is_list &&
        (mesh_text_is_word(text, "vertex_indices") || mesh_text_is_word(text, "vertex_index"))) {
        return ROLE_CORNERS;
    }
    for (size_t i = 0;
         kind == ELEMENT_VERTEX && !is_list && i < sizeof vertex_roles / sizeof vertex_roles[0];
         i++) {
        if (mesh_text_is_word(text, vertex_roles[i].name)) {
            return vertex_roles[i].role;
        }
    }
    return ROLE_NONE;
}

static bool take_property(Ply *ply) {
    MeshText *text = ply->text;
    if (ply->n_elements == 0) {
        return mesh_text_fail(text, "a property before the first element");
    }
    Element *e = &ply->elements[ply->n_elements - 1];
    e->properties =
        arena_grow(ply->scratch, e->properties, e->n_properties, &e->room, sizeof *e->properties);
    Property *p = &e->properties[e->n_properties];
    *p = (Property){0};
    mesh_text_skip_blanks(text);
    p->is_list = mesh_text_is_word(text, "list");
    if (p->is_list) {
        text->at += 4;
        if (!take_type(ply, &p->count_type)) {
            return false;
        }
        if (p->count_type >= TYPE_F32) {
            return mesh_text_fail(text, "the length of a list is an integer");
        }
    }
    if (!take_type(ply, &p->type) || !next_word(ply, "the name of the property")) {
        return false;
    }
    p->role = role_of(text, e->kind, p->is_list);
    // Where two properties have one role, as s and u do, the first counts.
    p->role = e->has[p->role] ? ROLE_NONE : p->role;
    e->has[p->role] = p->role != ROLE_NONE;
    e->n_properties++;
    return true;
}

static bool take_header(Ply *ply) {
    MeshText *text = ply->text;
    for (mesh_text_next_line(text);; mesh_text_next_line(text)) {
        bool is_fine = true;
        if (text->at == text->end) {
            return mesh_text_fail(text, "the header has no end_header");
        }
        if (mesh_text_is_word(text, "end_header")) {
            mesh_text_next_line(text);
            break;
        } else if (mesh_text_is_word(text, "format")) {
            text->at += 6;
            is_fine = take_format(ply);
        } else if (mesh_text_is_word(text, "element")) {
            text->at += 7;
            is_fine = take_element(ply);
        } else if (mesh_text_is_word(text, "property")) {
            text->at += 8;
            is_fine = take_property(ply);
        } else if (!mesh_text_is_word(text, "comment") && !mesh_text_is_word(text, "obj_info") &&
                   !mesh_text_at_line_end(text)) {
            is_fine = mesh_text_fail(text, "unknown word \"%s\" in the header",
                                     mesh_text_quote(text).text);
        }
        if (!is_fine) {
            return false;
        }
    }
    return ply->format || mesh_text_fail(text, "the header names no format");
}

// ---- the rows

static bool fail_row(Ply *ply, const char *why) {
    return mesh_text_fail(ply->text, "%s %zu: %s", ply->row_name, ply->row, why);
}

static uint64_t take_bytes(Ply *ply, size_t size) {
    const unsigned char *at = (const unsigned char *)ply->text->at;
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++) {
        size_t shift = ply->format == FORMAT_LITTLE ? i : size - 1 - i;
        bits |= (uint64_t)at[i] << (8 * shift);
    }
    ply->text->at += size;
    return bits;
}

static double value_of_bits(uint64_t bits, Type type) {
    uint32_t low = (uint32_t)bits;
    float single;
    double value;
    switch (type) {
    case TYPE_I8:
        return (int8_t)bits;
    case TYPE_I16:
        return (int16_t)bits;
    case TYPE_I32:
        return (int32_t)bits;
    case TYPE_U8:
    case TYPE_U16:
    case TYPE_U32:
        return (double)bits;
    case TYPE_F32:
        memcpy(&single, &low, sizeof single);
        return (double)single;
    case TYPE_F64:
        break;
    }
    memcpy(&value, &bits, sizeof value);
    return value;
}

// A double holds every value of every type.
static bool take_value(Ply *ply, Type type, double *value) {
    MeshText *text = ply->text;
    if (ply->format != FORMAT_ASCII) {
        if ((size_t)(text->end - text->at) < types[type].size) {
            return fail_row(ply, "the file ends in the middle of it");
        }
        *value = value_of_bits(take_bytes(ply, types[type].size), type);
        return true;
    }
    mesh_text_skip_blanks(text);
    if (mesh_text_at_line_end(text)) {
        return fail_row(ply, "a number is missing");
    }
    if (!mesh_text_number(text, value)) {
        return mesh_text_fail(text, "\"%s\" is not a number", mesh_text_quote(text).text);
    }
    return true;
}

// An integer from 0 up to limit, as lengths and indices are.
static bool take_count(Ply *ply, Type type, size_t limit, size_t *count, double *value) {
    if (!take_value(ply, type, value)) {
        return false;
    }
    if (!(*value >= 0 && *value <= (double)limit) || *value != (double)(size_t)*value) {
        *count = SIZE_MAX;
        return true;
    }
    *count = (size_t)*value;
    return true;
}

// Every entry takes a byte at least, so that a length is bounded by what is left of the file.
static bool take_length(Ply *ply, const Property *p, size_t *n) {
    double value;
    if (!take_count(ply, p->count_type, (size_t)(ply->text->end - ply->text->at), n, &value)) {
        return false;
    }
    if (*n != SIZE_MAX) {
        return true;
    }
    return mesh_text_fail(ply->text, "%s %zu: a list of %.17g entries", ply->row_name, ply->row,
                          value);
}

static bool skip_list(Ply *ply, const Property *p) {
    size_t n;
    double value;
    if (!take_length(ply, p, &n)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        if (!take_value(ply, p->type, &value)) {
            return false;
        }
    }
    return true;
}

static bool add_polygon(Ply *ply, size_t n) {
    for (size_t i = 2; i < n; i++) {
        if (ply->n_triangles >= MESH_COUNT_LIMIT) {
            return fail_row(ply, "more than 2^31 triangles");
        }
        ply->index = arena_grow(ply->scratch, ply->index, ply->n_triangles, &ply->room_triangles,
                                3 * sizeof *ply->index);
        uint32_t *t = ply->index + 3 * ply->n_triangles++;
        t[0] = ply->polygon[0];
        t[1] = ply->polygon[i - 1];
        t[2] = ply->polygon[i];
    }
    return true;
}

static bool take_polygon(Ply *ply, const Property *p) {
    size_t n;
    if (!take_length(ply, p, &n)) {
        return false;
    }
    if (n < 3) {
        return mesh_text_fail(ply->text, "face %zu: it has 3 or more corners, here are %zu",
                              ply->row, n);
    }
    for (size_t i = 0; i < n; i++) {
        size_t corner;
        double value;
        ply->polygon =
            arena_grow(ply->scratch, ply->polygon, i, &ply->room_polygon, sizeof *ply->polygon);
        if (!take_count(ply, p->type, UINT32_MAX, &corner, &value)) {
            return false;
        }
        if (corner >= ply->n_vertices) {
            return mesh_text_fail(ply->text, "face %zu: index %.17g is beyond the %zu vertices",
                                  ply->row, value, ply->n_vertices);
        }
        ply->polygon[i] = (uint32_t)corner;
    }
    return add_polygon(ply, n);
}

static bool take_row(Ply *ply, const Element *e) {
    double values[N_ROLES] = {0};
    for (size_t i = 0; i < e->n_properties; i++) {
        const Property *p = &e->properties[i];
        if (p->role == ROLE_CORNERS ? !take_polygon(ply, p)
            : p->is_list            ? !skip_list(ply, p)
                                    : !take_value(ply, p->type, &values[p->role])) {
            return false;
        }
    }
    if (ply->format == FORMAT_ASCII) {
        mesh_text_skip_blanks(ply->text);
        if (!mesh_text_at_line_end(ply->text)) {
            return fail_row(ply, "there is more on the line than its properties");
        }
        mesh_text_next_line(ply->text);
    }
    if (e->kind == ELEMENT_VERTEX) {
        Mesh *mesh = ply->mesh;
        memcpy(mesh->position + 3 * ply->row, &values[ROLE_X], 3 * sizeof(double));
        for (size_t k = 0; mesh->normal && k < 3; k++) {
            mesh->normal[3 * ply->row + k] = (float)values[ROLE_NX + k];
        }
        for (size_t k = 0; mesh->uv && k < 2; k++) {
            mesh->uv[2 * ply->row + k] = (float)values[ROLE_U + k];
        }
    }
    return true;
}

// The least that a row takes: in ASCII two bytes for each value, the last perhaps without its line
// end.
static size_t least_row(const Ply *ply, const Element *e) {
    size_t n = 0;
    for (size_t i = 0; i < e->n_properties; i++) {
        const Property *p = &e->properties[i];
        n += ply->format == FORMAT_ASCII ? 2 : types[p->is_list ? p->count_type : p->type].size;
    }
    return n;
}

static bool prepare(Ply *ply, const Element *e) {
    MeshText *text = ply->text;
    size_t least = least_row(ply, e), left = (size_t)(text->end - text->at) + 1;
    if (least && e->n_rows > left / least) {
        return mesh_text_fail(text,
                              "the header promises %zu rows of \"%s\", more than the file has",
                              e->n_rows, ply->row_name);
    }
    if (e->kind != ELEMENT_VERTEX) {
        return true;
    }
    if (!e->has[ROLE_X] || !e->has[ROLE_Y] || !e->has[ROLE_Z]) {
        return mesh_text_fail(text, "the vertices lack x, y or z");
    }
    if (e->n_rows > MESH_COUNT_LIMIT) {
        return mesh_text_fail(text, "more than 2^31 vertices");
    }
    Mesh *mesh = ply->mesh;
    mesh->n_vertices = (uint32_t)e->n_rows;
    mesh->position = ARENA_ARRAY(ply->arena, 3 * e->n_rows, double);
    if (e->has[ROLE_NX] && e->has[ROLE_NY] && e->has[ROLE_NZ]) {
        mesh->normal = ARENA_ARRAY(ply->arena, 3 * e->n_rows, float);
    }
    if (e->has[ROLE_U] && e->has[ROLE_V]) {
        mesh->uv = ARENA_ARRAY(ply->arena, 2 * e->n_rows, float);
    }
    return true;
}

static bool take_rows(Ply *ply, const Element *e) {
    static const char *const names[] = {"row", "vertex", "face"};
    ply->row_name = names[e->kind];
    if (!prepare(ply, e)) {
        return false;
    }
    // Rows without properties take no bytes, but in ASCII a line.
    size_t n_rows = e->n_properties || ply->format == FORMAT_ASCII ? e->n_rows : 0;
    for (ply->row = 0; ply->row < n_rows; ply->row++) {
        if (ply->text->at == ply->text->end) {
            return mesh_text_fail(ply->text, "the file ends after %zu of %zu rows of \"%s\"",
                                  ply->row, e->n_rows, ply->row_name);
        }
        if (!take_row(ply, e)) {
            return false;
        }
    }
    return true;
}

static bool take_file(Ply *ply) {
    if (!take_header(ply)) {
        return false;
    }
    if (!ply->has_vertices) {
        return mesh_text_fail(ply->text, "the header names no element \"vertex\"");
    }
    if (ply->format != FORMAT_ASCII) {
        ply->text->line = 0;
    }
    for (size_t i = 0; i < ply->n_elements; i++) {
        if (!take_rows(ply, &ply->elements[i])) {
            return false;
        }
    }
    return true;
}

MeshStatus mesh_ply_read(Arena *arena, MeshText *text, Mesh *mesh) {
    Arena scratch = {0};
    Ply ply = {.text = text, .arena = arena, .scratch = &scratch, .mesh = mesh};
    bool is_fine = mesh_text_is_word(text, "ply")
                       ? take_file(&ply)
                       : mesh_text_fail(text, "it does not begin with \"ply\"");
    if (is_fine) {
        mesh->n_triangles = (uint32_t)ply.n_triangles;
        mesh->index = ARENA_ARRAY(arena, 3 * ply.n_triangles, uint32_t);
        if (ply.n_triangles) {
            memcpy(mesh->index, ply.index, 3 * ply.n_triangles * sizeof *mesh->index);
        }
        if (mesh->normal) {
            mesh_normals_finish(mesh);
        }
    }
    arena_free(&scratch);
    return is_fine ? MESH_OK : MESH_BAD_FORMAT;
}
