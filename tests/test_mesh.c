// SPDX-License-Identifier: Apache-2.0
// Mesh files: what each format gives, each message, damage, and readers that crash.
#include "render/mesh.h"
#include "tests/mesh_folder.h"
#include "tests/suite.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/mesh_assimp.h"
#include "render/mesh_child.h"

static MeshStatus read_bytes(MeshFolder *f, const char *base, const void *bytes, size_t n) {
    mesh_folder_put(f, base, bytes, n);
    f->message[0] = '\0';
    return mesh_read(&f->arena, f->path, &f->mesh, f->message, sizeof f->message);
}

static void read_text(MeshFolder *f, const char *base, const char *text) {
    if (read_bytes(f, base, text, strlen(text)) != MESH_OK) {
        fail_msg("%s: %s", base, f->message);
    }
}

static void assert_positions(const Mesh *mesh, uint32_t n, const double *expected) {
    assert_int_equal(mesh->n_vertices, n);
    for (uint32_t i = 0; i < 3 * n; i++) {
        assert_true(mesh->position[i] == expected[i]);
    }
}

static void assert_indices(const Mesh *mesh, uint32_t n, const uint32_t *expected) {
    assert_int_equal(mesh->n_triangles, n);
    for (uint32_t i = 0; i < 3 * n; i++) {
        assert_int_equal(mesh->index[i], expected[i]);
    }
}

// ---- OBJ

static void obj_keeps_the_order(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.obj",
              "# a square and a triangle\r\nmtllib x.mtl\r\no thing\r\nv 0 0 0\r\nv 1 0 0 1\r\n"
              "v 1 1 0 0.5 0.5 0.5\r\n\tv  0 1 -0.5\r\nv 7 7 7\r\ns off\r\nf 1 2 \\\r\n 3 4\r\n"
              "f -4 -3 -1 # last\r\n");
    assert_positions(&f->mesh, 5, (double[]){0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, -0.5, 7, 7, 7});
    assert_indices(&f->mesh, 3, (uint32_t[]){0, 1, 2, 0, 2, 3, 1, 2, 4});
    assert_null(f->mesh.normal);
    assert_null(f->mesh.uv);
    assert_false(f->mesh.faceted);
}

// Vertex 2 is used with two texture coordinates: the second one goes behind all v.
static void obj_splits_vertices(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.obj",
              "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 0.25 0.5\nvt 1 1\nvn 0 0 2\n"
              "f 1/1/1 2/2/1 3/3/1\nf 3/3/1 2/1/1 4/3/1\nf 2/1/1 4/3/1 1/1/1\n");
    assert_positions(&f->mesh, 5, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 1, 0, 0});
    assert_indices(&f->mesh, 3, (uint32_t[]){0, 1, 2, 2, 4, 3, 4, 3, 0});
    float uv[] = {0, 0, 0.25f, 0.5f, 1, 1, 1, 1, 0, 0};
    assert_memory_equal(f->mesh.uv, uv, sizeof uv);
    for (int i = 0; i < 5; i++) {
        assert_memory_equal(f->mesh.normal + 3 * i, ((float[]){0, 0, 1}), 3 * sizeof(float));
    }
}

static void obj_mends_normals(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.obj",
              "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 5 5 5\nvn 0 0 0\nvn nan 0 1\nvn 0 -3 0\n"
              "f 1//1 2//2 3//3\n");
    float expected[] = {0, -1, 0, 0, -1, 0, 0, -1, 0, 0, 0, 1};
    for (int i = 0; i < 12; i++) {
        assert_true(f->mesh.normal[i] == expected[i]);
    }
}

// ---- PLY

// Both byte orders are written by hand here, with a type of each size.
static size_t put_number(unsigned char *to, bool is_big, size_t size, const void *value) {
    for (size_t i = 0; i < size; i++) {
        to[i] = ((const unsigned char *)value)[is_big ? size - 1 - i : i];
    }
    return size;
}

static size_t make_binary_ply(unsigned char *to, bool is_big) {
    static const struct {
        double x;
        float y;
        int16_t z;
        uint8_t red;
        int32_t s;
        float t;
    } rows[4] = {{0.1, 0, 0, 1, 3, 0.5f},
                 {1, 0.25f, -1, 2, 4, 0},
                 {1, 1, 300, 3, 5, 1},
                 {0, 1, 0, 255, -6, 2}};
    int n = sprintf((char *)to,
                    "ply\nformat binary_%s_endian 1.0\ncomment made by a test\n"
                    "element vertex 4\nproperty double x\nproperty float32 y\nproperty short z\n"
                    "property uchar red\nproperty int s\nproperty float t\n"
                    "element edge 1\nproperty list uint8 int16 ends\nproperty ushort w\n"
                    "element face 1\nproperty uchar flags\n"
                    "property list ushort uint vertex_indices\nend_header\n",
                    is_big ? "big" : "little");
    unsigned char *at = to + n;
    for (int i = 0; i < 4; i++) {
        at += put_number(at, is_big, 8, &rows[i].x);
        at += put_number(at, is_big, 4, &rows[i].y);
        at += put_number(at, is_big, 2, &rows[i].z);
        at += put_number(at, is_big, 1, &rows[i].red);
        at += put_number(at, is_big, 4, &rows[i].s);
        at += put_number(at, is_big, 4, &rows[i].t);
    }
    static const uint16_t edge[3] = {7, 8, 9}, length = 4;
    *at++ = 2;
    for (int i = 0; i < 3; i++) {
        at += put_number(at, is_big, 2, &edge[i]);
    }
    static const uint32_t corners[4] = {3, 0, 1, 2};
    *at++ = 1;
    at += put_number(at, is_big, 2, &length);
    for (int i = 0; i < 4; i++) {
        at += put_number(at, is_big, 4, &corners[i]);
    }
    return (size_t)(at - to);
}

static void ply_reads_both_byte_orders(void **state) {
    MeshFolder *f = *state;
    for (int is_big = 0; is_big < 2; is_big++) {
        unsigned char bytes[1024];
        size_t n = make_binary_ply(bytes, is_big);
        assert_int_equal(read_bytes(f, "a.ply", bytes, n), MESH_OK);
        assert_positions(&f->mesh, 4, (double[]){0.1, 0, 0, 1, 0.25, -1, 1, 1, 300, 0, 1, 0});
        assert_indices(&f->mesh, 2, (uint32_t[]){3, 0, 1, 3, 1, 2});
        float uv[] = {3, 0.5f, 4, 0, 5, 1, -6, 2};
        assert_memory_equal(f->mesh.uv, uv, sizeof uv);
        assert_null(f->mesh.normal);
        // The content counts, whatever the name.
        assert_int_equal(read_bytes(f, "a.obj", bytes, n), MESH_OK);
        assert_int_equal(f->mesh.n_triangles, 2);
        for (size_t cut = 0; cut < n; cut++) {
            assert_int_not_equal(read_bytes(f, "a.ply", bytes, cut), MESH_OK);
            assert_true(f->message[0]);
        }
    }
}

static const char ascii_ply[] =
    "ply\nformat ascii 1.0\nobj_info x\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
    "element face 2\nproperty list uchar int vertex_index\nend_header\n"
    "0 0 0 0 0 1\n1 0 0 0 0 5\n1 1 0 0 0 1 \n0 1 0 0 0 0\n3 0 1 2\n3 0 2 3\n";

static void ply_reads_ascii(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.ply", ascii_ply);
    assert_positions(&f->mesh, 4, (double[]){0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    assert_indices(&f->mesh, 2, (uint32_t[]){0, 1, 2, 0, 2, 3});
    for (int i = 0; i < 4; i++) {
        assert_memory_equal(f->mesh.normal + 3 * i, ((float[]){0, 0, 1}), 3 * sizeof(float));
    }
}

static void ply_round_trips(void **state) {
    MeshFolder *f = *state;
    double position[] = {0.1, 1e300, -0.0, 1, 2, 3, 4, 5, 6.000000000000001};
    float normal[] = {1, 0, 0, 0, 1, 0, 0, 0, -1}, uv[] = {0, 0.1f, -2, 3, 1e-30f, 1};
    uint32_t index[] = {2, 1, 0, 0, 1, 2};
    Mesh mesh = {3, 2, position, normal, uv, index, false};
    snprintf(f->path, sizeof f->path, "%s/a.ply", f->folder);
    assert_true(mesh_write_ply(f->path, &mesh, f->message, sizeof f->message));
    assert_int_equal(mesh_read(&f->arena, f->path, &f->mesh, f->message, 256), MESH_OK);
    assert_int_equal(f->mesh.n_vertices, 3);
    assert_memory_equal(f->mesh.position, position, sizeof position);
    assert_memory_equal(f->mesh.normal, normal, sizeof normal);
    assert_memory_equal(f->mesh.uv, uv, sizeof uv);
    assert_indices(&f->mesh, 2, index);
    assert_false(mesh_write_ply("/nonexistent/a.ply", &mesh, f->message, sizeof f->message));
    assert_string_equal(f->message, "cannot create: No such file or directory");
}

// ---- STL

static size_t make_binary_stl(unsigned char *to) {
    static const float corners[2][9] = {{0, 0, 0, 1, 0, 0, 0, 1, 0},
                                        {0, 1, 0, 1, 0, 0, 1, 1, -0.0f}};
    memset(to, 0, 84 + 2 * 50);
    memcpy(to, "solid but binary", 16);
    to[80] = 2;
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 9; k++) {
            put_number(to + 84 + 50 * i + 12 + 4 * k, false, 4, &corners[i][k]);
        }
    }
    return 84 + 2 * 50;
}

static const char ascii_stl[] =
    "solid two words\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
    "   vertex 0 1 0\n  endloop\n endfacet\n facet normal 0 0 1\n  outer loop\n   vertex 0 1 0\n"
    "   vertex 1 0 -0\n   vertex 1 1 0\n  endloop\n endfacet\nendsolid two words\n";

static void stl_welds(void **state) {
    MeshFolder *f = *state;
    unsigned char bytes[256];
    for (int is_ascii = 0; is_ascii < 2; is_ascii++) {
        if (is_ascii) {
            read_text(f, "a.STL", ascii_stl);
        } else {
            assert_int_equal(read_bytes(f, "a.stl", bytes, make_binary_stl(bytes)), MESH_OK);
        }
        assert_positions(&f->mesh, 4, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
        assert_indices(&f->mesh, 2, (uint32_t[]){0, 1, 2, 2, 1, 3});
        assert_true(f->mesh.faceted);
        assert_null(f->mesh.normal);
    }
}

// ---- messages

#define TRIANGLE  "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define PLY_START "ply\nformat ascii 1.0\n"
#define PLY_XYZ   "property float x\nproperty float y\nproperty float z\n"
#define PLY_FACE  "element face 1\nproperty list uchar int vertex_indices\nend_header\n"

static void mistakes_get_their_message(void **state) {
    static const struct {
        const char *name, *text, *message;
    } cases[] = {
        {"a.obj", "", "the file is empty"},
        {"a.obj", "# nothing\n", "there are no vertices in it"},
        {"a.obj", TRIANGLE, "there are no faces in it"},
        {"a.obj", "v 0 0\n", "line 1: a vertex has 3 numbers, here are 2"},
        {"a.obj", "v 1 2 3 4 5 6 7 8\n", "line 1: a vertex has at most 7 numbers"},
        {"a.obj", "\n\nv 0 0 zero\n", "line 3: \"zero\" is not a number"},
        {"a.obj", "v 0 0 1,5\n", "line 1: \"1,5\" is not a number"},
        {"a.obj", TRIANGLE "f 1 2 9\n", "line 4: face index 9 is beyond the 3 vertices so far"},
        {"a.obj", TRIANGLE "f 1 2 -4\n", "line 4: face index -4 is beyond the 3 vertices so far"},
        {"a.obj", TRIANGLE "f 1 2 99999999999999999999\n",
         "line 4: face index 9223372036854775807 is beyond the 3 vertices so far"},
        {"a.obj", TRIANGLE "f 0 1 2\n", "line 4: face index 0: indices begin at 1"},
        {"a.obj", TRIANGLE "f 1 2\n", "line 4: a face has 3 or more corners, here are 2"},
        {"a.obj", TRIANGLE "f 1/1 2/1 3/1\n",
         "line 4: texture index 1 is beyond the 0 texture coordinates so far"},
        {"a.obj", TRIANGLE "f 1//1 2//1 3//1\n",
         "line 4: normal index 1 is beyond the 0 normals so far"},
        {"a.obj", TRIANGLE "vn 0 0 1\nf 1//1 2 3\n",
         "line 5: corner 2 is not of the form of the first one"},
        {"a.obj", TRIANGLE "f 1 2 x\n", "line 4: a face index is expected, not \"x\""},
        {"a.obj", TRIANGLE "f 1 2 3.5\n", "line 4: \".5\" after a corner of a face"},
        {"a.obj", "vertex 1 2 3\n", "line 1: unknown word \"vertex\""},
        {"a.ply", "plz\n", "line 1: it does not begin with \"ply\""},
        {"a.ply", "ply\n", "line 2: the header has no end_header"},
        {"a.ply", "ply\nend_header\n", "line 3: the header names no format"},
        {"a.ply", "ply\nformat utf8 1.0\n", "line 2: unknown format \"utf8\""},
        {"a.ply", PLY_START "end_header\n", "line 4: the header names no element \"vertex\""},
        {"a.ply", PLY_START "property int x\n", "line 3: a property before the first element"},
        {"a.ply", PLY_START "element vertex -1\n",
         "line 3: the element's number of rows is expected"},
        {"a.ply", PLY_START "element vertex 1\nproperty real x\n", "line 4: unknown type \"real\""},
        {"a.ply", PLY_START "element vertex 1\nproperty float x\nend_header\n0\n",
         "line 6: the vertices lack x, y or z"},
        {"a.ply", PLY_START "element vertex 1\nproperty list float int x\n",
         "line 4: the length of a list is an integer"},
        {"a.ply", PLY_START "element vertex 1000000\n" PLY_XYZ "end_header\n0 0 0\n",
         "line 8: the header promises 1000000 rows of \"vertex\", more than the file has"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0 0\n3 0 0 1\n",
         "line 11: face 0: index 1 is beyond the 1 vertices"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0 0\n3 0 0 -1\n",
         "line 11: face 0: index -1 is beyond the 1 vertices"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0 0\n2 0 0\n",
         "line 11: face 0: it has 3 or more corners, here are 2"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0 0\n-3 0 0 0\n",
         "line 11: face 0: a list of -3 entries"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0 0 0\n3 0 0 0\n",
         "line 10: vertex 0: there is more on the line than its properties"},
        {"a.ply", PLY_START "element vertex 1\n" PLY_XYZ PLY_FACE "0 0\n3 0 0 0\n",
         "line 10: vertex 0: a number is missing"},
        {"a.ply", PLY_START "element tristrips 1\n", "line 3: not supported yet: triangle strips"},
        {"a.stl", "solid x\nfacet normal 0 0 1\nouter lop\n",
         "line 3: \"loop\" is expected, not \"lop\""},
        {"a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 x\n",
         "line 5: \"x\" is not a number"},
        {"a.stl", "solid x\n", "line 2: the file ends, \"endsolid\" is expected"},
        {"a.stl", "hello", "it is neither ASCII STL nor long enough for a binary one"},
        {"a.off", "OFX\n", NULL},
        {"a.xyzzy", "who knows\n", "no reader knows this kind of file"},
    };
    MeshFolder *f = *state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        MeshStatus status = read_bytes(f, cases[i].name, cases[i].text, strlen(cases[i].text));
        assert_int_equal(status, cases[i].text[0] ? MESH_BAD_FORMAT : MESH_NO_FILE);
        assert_int_equal(f->mesh.n_vertices, 0);
        if (cases[i].message) {
            assert_string_equal(f->message, cases[i].message);
        }
        assert_true(f->message[0]);
    }
    assert_int_equal(mesh_read(&f->arena, "/nonexistent.obj", &f->mesh, f->message, 256),
                     MESH_NO_FILE);
    assert_string_equal(f->message, "cannot read: No such file or directory");
    assert_int_equal(mesh_read(&f->arena, f->folder, &f->mesh, f->message, 256), MESH_NO_FILE);
    assert_string_equal(f->message, "it is a folder");
}

// ---- damage

static void assert_sound(const MeshFolder *f, MeshStatus status) {
    if (status != MESH_OK) {
        assert_true(f->message[0]);
        return;
    }
    for (size_t i = 0; i < 3 * (size_t)f->mesh.n_triangles; i++) {
        assert_true(f->mesh.index[i] < f->mesh.n_vertices);
    }
    for (size_t i = 0; f->mesh.normal && i < f->mesh.n_vertices; i++) {
        const float *n = f->mesh.normal + 3 * i;
        assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5f);
    }
}

static void damage(MeshFolder *f, const char *base, const void *bytes, size_t n, uint64_t seed) {
    unsigned char copy[1024];
    for (int i = 0; i < 400; i++) {
        memcpy(copy, bytes, n);
        size_t length = n;
        for (int k = 0; k <= i % 4; k++) {
            seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
            size_t at = (size_t)(seed >> 33) % n;
            switch (seed >> 61) {
            case 0:
                length = at;
                break;
            case 1:
                copy[at] = (unsigned char)(seed >> 20);
                break;
            case 2:
                copy[at] = "0123456789-/\n\\. eE"[(seed >> 20) % 18];
                break;
            default:
                copy[at] ^= (unsigned char)(1u << (seed >> 20) % 8);
            }
        }
        assert_sound(f, read_bytes(f, base, copy, length));
    }
}

static void damage_never_crashes(void **state) {
    MeshFolder *f = *state;
    static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
                              "vn 0 1 0\nf 1/1/1 2/2/1 3/1/2 4/2/2\nf -1/-1/-1 2/1/2 1/2/1\n";
    unsigned char bytes[1024];
    damage(f, "a.obj", obj, sizeof obj - 1, 1);
    damage(f, "a.ply", ascii_ply, sizeof ascii_ply - 1, 2);
    damage(f, "a.ply", bytes, make_binary_ply(bytes, true), 3);
    damage(f, "a.stl", bytes, make_binary_stl(bytes), 4);
    damage(f, "a.stl", ascii_stl, sizeof ascii_stl - 1, 5);
}

// ---- the child process

static void assimp_reads_off(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.off", "OFF\n4 2 0\n0 0 0\n2 0 0\n0 2 0\n0 0 2.5\n3 0 2 1\n3 0 1 3\n");
    assert_int_equal(f->mesh.n_triangles, 2);
    double sum = 0;
    for (int i = 0; i < 6; i++) {
        sum += f->mesh.position[3 * f->mesh.index[i] + 2];
    }
    assert_true(sum == 2.5);
}

// One triangle in a buffer of 36 bytes, (0 0 0) (1 0 0) (0 1 0), under a node that moves, mirrors.
static void assimp_places_gltf_nodes(void **state) {
    MeshFolder *f = *state;
    read_text(f, "a.gltf",
              "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
              "\"nodes\":[{\"mesh\":0,\"translation\":[10,0,0],\"scale\":[-1,1,1]}],"
              "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
              "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,"
              "\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,1,0]}],"
              "\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":36}],"
              "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
              "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}");
    assert_int_equal(f->mesh.n_triangles, 1);
    const double *p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = f->mesh.position + 3 * f->mesh.index[i];
    }
    // Mirrored, it still looks towards +z.
    double area =
        (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    assert_true(area == 1);
    assert_true(p[0][0] + p[1][0] + p[2][0] == 29);
}

static void crash(const void *argument, int fd) {
    (void)argument;
    (void)fd;
    raise(SIGSEGV);
}

// Too late for the parent although it needs no processor time.
static void hang(const void *argument, int fd) {
    (void)argument;
    (void)fd;
    pause();
}

static void spin(const void *argument, int fd) {
    (void)fd;
    for (volatile const void *p = argument;;) {
        (void)p;
    }
}

static void babble(const void *argument, int fd) {
    (void)argument;
    char nonsense[4096];
    memset(nonsense, 0x5a, sizeof nonsense);
    while (write(fd, nonsense, sizeof nonsense) > 0) {
    }
}

static void stop_early(const void *argument, int fd) {
    (void)argument;
    MeshStream header = {.magic = MESH_STREAM_MAGIC, .n_vertices = 100, .n_triangles = 100};
    assert_true(write(fd, &header, sizeof header) == sizeof header);
}

static void send_bad_index(const void *argument, int fd) {
    (void)argument;
    MeshStream header = {.magic = MESH_STREAM_MAGIC, .n_vertices = 1, .n_triangles = 1};
    double position[3] = {0};
    uint32_t index[3] = {0, 0, 1};
    assert_true(write(fd, &header, sizeof header) == sizeof header);
    assert_true(write(fd, position, sizeof position) == sizeof position);
    assert_true(write(fd, index, sizeof index) == sizeof index);
}

static void send_refusal(const void *argument, int fd) {
    MeshStream header = {.magic = MESH_STREAM_MAGIC, .status = MESH_TOO_LARGE};
    memset(header.message, 'x', sizeof header.message);
    memcpy(header.message, argument, strlen(argument));
    assert_true(write(fd, &header, sizeof header) == sizeof header);
}

static void children_may_fail(void **state) {
#define READER "the reader in its own process "
    static const struct {
        ChildBody *body;
        MeshStatus status;
        const char *message;
    } cases[] = {
        {crash, MESH_BAD_FORMAT, READER "crashed"},
        {hang, MESH_TOO_LARGE, READER "took too long and was stopped"},
        {spin, MESH_TOO_LARGE, READER "took too long and was stopped"},
        {babble, MESH_BAD_FORMAT, READER "sent nonsense"},
        {stop_early, MESH_BAD_FORMAT, READER "crashed (it ended early)"},
        {send_bad_index, MESH_BAD_FORMAT, "face 0: index 1 is beyond the 1 vertices"},
        {send_refusal, MESH_TOO_LARGE, "too much  of it"},
    };
    MeshFolder *f = *state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ChildLimits limits = {.memory = (size_t)1 << 30, .seconds = 1, .wait = 30};
        limits.wait = cases[i].body == hang ? 0.1 : limits.wait;
        MeshStatus status = mesh_child_read(&f->arena, cases[i].body, "too much\n of it", &limits,
                                            &f->mesh, f->message, sizeof f->message);
        if (status != cases[i].status ||
            strncmp(f->message, cases[i].message, strlen(cases[i].message)) != 0) {
            fail_msg("case %zu: %d, %s", i, status, f->message);
        }
    }
}

#define MESH_TEST(name)                                                                            \
    cmocka_unit_test_setup_teardown(name, mesh_folder_set_up, mesh_folder_tear_down)

static const struct CMUnitTest tests[] = {
    MESH_TEST(obj_keeps_the_order),
    MESH_TEST(obj_splits_vertices),
    MESH_TEST(obj_mends_normals),
    MESH_TEST(ply_reads_both_byte_orders),
    MESH_TEST(ply_reads_ascii),
    MESH_TEST(ply_round_trips),
    MESH_TEST(stl_welds),
    MESH_TEST(mistakes_get_their_message),
    MESH_TEST(damage_never_crashes),
    MESH_TEST(assimp_reads_off),
    MESH_TEST(assimp_places_gltf_nodes),
    MESH_TEST(children_may_fail),
};

SUITE(mesh, tests)
