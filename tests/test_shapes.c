// SPDX-License-Identifier: Apache-2.0
// Solids, points and meshes that move, against closed forms and the very numbers of their files.
#include "lang/scene_load.h"
#include "accel/vec.h"
#include "render/mesh_track.h"
#include "render/mover.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double pi = 3.141592653589793;

typedef struct {
    Arena arena;
    Sources sources;
    FILE *reports;
    LoadedScene loaded;
    char folder[32], text[8192];
} Files;

static void *new_files(Files *f) {
    *f = (Files){.folder = "/tmp/st4-shapes-XXXXXX"};
    return mkdtemp(f->folder);
}

static void path_of(const Files *f, const char *name, char path[128]) {
    snprintf(path, 128, "%s/%s", f->folder, name);
}

static void write_bytes(const Files *f, const char *name, const void *bytes, size_t n) {
    char path[128];
    path_of(f, name, path);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, n, file), n);
    fclose(file);
}

static void write_text(const Files *f, const char *name, const char *text) {
    write_bytes(f, name, text, strlen(text));
}

// Loads a script that lies in the folder; what is reported goes to f->text.
static const Scene *load(Files *f, const char *script) {
    char path[128];
    path_of(f, "scene.st4", path);
    if (f->reports) {
        fclose(f->reports);
        scene_load_free(&f->loaded);
    }
    f->sources = (Sources){.arena = &f->arena, .end = 1};
    f->reports = tmpfile();
    Diag *diag = diag_new(&f->arena, &f->sources, f->reports, false, false);
    scene_load(&f->arena, &f->sources, diag, path, script, strlen(script), NULL, &f->loaded);
    rewind(f->reports);
    f->text[fread(f->text, 1, sizeof f->text - 1, f->reports)] = '\0';
    return f->loaded.scene;
}

static const Scene *load_well(Files *f, const char *script) {
    const Scene *scene = load(f, script);
    if (!scene) {
        print_error("%s", f->text);
    }
    assert_non_null(scene);
    return scene;
}

static void refuses(Files *f, const char *script, const char *report) {
    const Scene *scene = load(f, script);
    if (scene || !strstr(f->text, report)) {
        print_error("\"%s\" was not reported, but:\n%s", report, f->text);
    }
    assert_null(scene);
    assert_non_null(strstr(f->text, report));
}

static void end_files(Files *f) {
    DIR *dir = opendir(f->folder);
    char path[512];
    for (struct dirent *entry; (entry = readdir(dir));) {
        snprintf(path, sizeof path, "%s/%s", f->folder, entry->d_name);
        unlink(path);
    }
    closedir(dir);
    rmdir(f->folder);
    if (f->reports) {
        fclose(f->reports);
        scene_load_free(&f->loaded);
    }
    arena_free(&f->arena);
}

// ---- Where the vertices of a shape without loops are

static Affine map_at(const Shape *shape, double t) {
    double in[IN_COUNT] = {0};
    Affine map;
    in[IN_T] = in[IN_FILM_T] = t;
    assert_true(affine_run(shape->transform, in, &map));
    return map;
}

static Vec3 place(const Shape *shape, double t, uint32_t i) {
    const double *p = shape->mesh->position + 3 * (size_t)i;
    double in[IN_COUNT] = {0}, out[3] = {p[0], p[1], p[2]};
    in[IN_T] = in[IN_FILM_T] = t;
    in[IN_PX] = p[0];
    in[IN_PY] = p[1];
    in[IN_PZ] = p[2];
    if (shape->vertex) {
        program_run1(shape->vertex, in, out);
    }
    Affine map = map_at(shape, t);
    return affine_point(&map, vec3(out[0], out[1], out[2]));
}

// Of the triangles: their area, and the volume that they enclose if they look outwards.
typedef struct {
    double area, volume;
} Extent;

static Extent extent_at(const Shape *shape, double t) {
    Extent e = {0, 0};
    for (uint32_t f = 0; f < shape->mesh->n_triangles; f++) {
        const uint32_t *v = shape->mesh->index + 3 * (size_t)f;
        Vec3 a = place(shape, t, v[0]), b = place(shape, t, v[1]), c = place(shape, t, v[2]);
        Vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        e.area += 0.5 * vec3_length(n);
        e.volume += vec3_dot(a, n) / 6;
    }
    return e;
}

static void assert_extent(const Shape *shape, double t, double area, double volume) {
    Extent e = extent_at(shape, t);
    assert_near(e.area / area, 1, 2e-3);
    assert_near(e.volume / volume, 1, 4e-3);
}

// ---- Solids

static double cone_area(double r, double s, double h) {
    return pi * (r + s) * sqrt(h * h + (r - s) * (r - s)) + pi * (r * r + s * s);
}

static double cone_volume(double r, double s, double h) {
    return pi * h / 3 * (r * r + r * s + s * s);
}

static void solids_have_their_area_and_volume(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    const Scene *scene =
        load_well(&f, "cylinder { from = <1, 2, 3>  to = <-1, 2 + t, 3>  radius = 0.5 + t }\n"
                      "cylinder { from = <0, 3, 0>  to = <0, 1, 0> }\n"
                      "cone { from = <0, 5, 1>  to = <0, 5, 3>  radius = 2 }\n"
                      "cone { radius = 0.25  top = 1.5 }\n"
                      "cone { radius = 1 - t  top = t }\n"
                      "torus { major = 2  minor = 0.5 }\n"
                      "torus { major = 1 + t  minor = 0.75 - t }\n"
                      "cylinder { from = <0, 0, 0>  to = <1e-9, -1, 2e-9> }\n"
                      "capsule { from = <1, 0, 0>  to = <1, 0, 3>  radius = 0.5 }\n"
                      "capsule { to = <0, 2 + t, 0>  radius = 0.5 + t }\n");
    const Shape *s = scene->shapes;
    double h = sqrt(4 + 0.25 * 0.25), r = 0.75;
    assert_extent(&s[0], 0.25, 2 * pi * r * h + 2 * pi * r * r, pi * r * r * h);
    assert_null(s[0].vertex); // its motion is that of its map, exact at every time
    assert_extent(&s[1], 0, 2 * pi * 0.5 * 2 + 2 * pi * 0.25, pi * 0.25 * 2);
    assert_ptr_equal(s[0].mesh, s[1].mesh);
    assert_extent(&s[2], 0, cone_area(2, 0, 2), cone_volume(2, 0, 2));
    assert_extent(&s[3], 0, cone_area(0.25, 1.5, 1), cone_volume(0.25, 1.5, 1));
    assert_extent(&s[4], 0.3, cone_area(0.7, 0.3, 1), cone_volume(0.7, 0.3, 1));
    assert_extent(&s[5], 0, 4 * pi * pi * 2 * 0.5, 2 * pi * pi * 2 * 0.25);
    assert_extent(&s[6], 0.25, 4 * pi * pi * 1.25 * 0.5, 2 * pi * pi * 1.25 * 0.25);
    assert_extent(&s[7], 0, 2 * pi * 0.5 + 2 * pi * 0.25, pi * 0.25);
    assert_extent(&s[8], 0, 2 * pi * 0.5 * (3 + 2 * 0.5), pi * 0.25 * (3 + 4.0 / 3 * 0.5));
    assert_extent(&s[9], 0.25, 2 * pi * r * (2.25 + 2 * r), pi * r * r * (2.25 + 4.0 / 3 * r));
    end_files(&f);
}

// Across the axis and at the radius from it: from - to, whatever way it points.
static void axes_point_anywhere(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    static const double ends[][3] = {{0, 1, 0},  {0, -1, 0},       {3, 4, 0},      {-1, -2, 2},
                                     {0, 0, -5}, {1e-7, -1, 1e-8}, {0, -1, 1e-160}};
    for (size_t k = 0; k < sizeof ends / sizeof ends[0]; k++) {
        char script[256];
        const double *d = ends[k];
        snprintf(script, sizeof script,
                 "cylinder { from = <1, 1, 1>  to = <1 + %g, 1 + %g, 1 + %g>  radius = 0.3 }", d[0],
                 d[1], d[2]);
        const Shape *shape = &load_well(&f, script)->shapes[0];
        Vec3 from = vec3(1, 1, 1);
        Vec3 axis = vec3_normalize(
            vec3_sub(vec3(1 + d[0], 1 + d[1], 1 + d[2]), from)); // as the sums are rounded
        for (uint32_t i = 0; i < shape->mesh->n_vertices; i++) {
            Vec3 p = vec3_sub(place(shape, 0, i), from);
            double along = vec3_dot(p, axis);
            double across = vec3_length(vec3_madd(p, -along, axis));
            assert_true(fabs(across - 0.3) < 1e-12 || across < 1e-12);
        }
        assert_true(extent_at(shape, 0).volume > 0);
    }
    end_files(&f);
}

static Vec3 given_normal(const Shape *shape, uint32_t i) {
    const float *n = shape->mesh->normal + 3 * (size_t)i;
    Affine map = map_at(shape, 0), inverse = affine_identity();
    assert_true(affine_invert(&map, &inverse));
    return vec3_normalize(affine_normal(&inverse, vec3(n[0], n[1], n[2])));
}

static void normals_are_exact(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    const Scene *scene =
        load_well(&f, "cone { from = <0, 1, 0>  to = <0, 4, 0>  radius = 2  top = 0.5 }\n"
                      "torus { major = 3  minor = 1 }\n"
                      "disc { normal = <1, 2, -2>  radius = 3 }\n"
                      "capsule { to = <0, 2, 0>  radius = 0.75 }");
    const Shape *cone = &scene->shapes[0], *torus = &scene->shapes[1], *disc = &scene->shapes[2];
    double slant = sqrt(9 + 1.5 * 1.5);
    uint32_t n_caps = 0;
    for (uint32_t i = 0; i < cone->mesh->n_vertices; i++) {
        Vec3 n = given_normal(cone, i), p = place(cone, 0, i);
        if (fabs(n.y) > 0.999) { // rims belong to a cap and, as other vertices, to the side
            assert_near(p.y, n.y > 0 ? 4 : 1, 1e-12);
            n_caps++;
            continue;
        }
        double r = hypot(p.x, p.z);
        assert_near(n.y, 1.5 / slant, 1e-6);
        assert_near(n.x, p.x / r * 3 / slant, 1e-6);
        assert_near(n.z, p.z / r * 3 / slant, 1e-6);
    }
    assert_true(n_caps > 48 && n_caps < cone->mesh->n_vertices);
    for (uint32_t i = 0; i < torus->mesh->n_vertices; i++) {
        Vec3 n = given_normal(torus, i), p = place(torus, 0, i);
        double r = hypot(p.x, p.z);
        assert_near(n.x, p.x - 3 * p.x / r, 1e-6);
        assert_near(n.y, p.y, 1e-6);
        assert_near(n.z, p.z - 3 * p.z / r, 1e-6);
    }
    const Shape *capsule = &scene->shapes[3];
    for (uint32_t i = 0; i < capsule->mesh->n_vertices; i++) {
        Vec3 n = given_normal(capsule, i), p = place(capsule, 0, i);
        double over = p.y - fmax(0, fmin(2, p.y));
        assert_near(n.x, p.x / 0.75, 1e-6);
        assert_near(n.y, over / 0.75, 1e-6);
        assert_near(n.z, p.z / 0.75, 1e-6);
    }
    for (uint32_t i = 0; i < disc->mesh->n_vertices; i++) {
        Vec3 n = given_normal(disc, i), p = place(disc, 0, i);
        assert_near(vec3_dot(n, vec3(1.0 / 3, 2.0 / 3, -2.0 / 3)), 1, 1e-12);
        assert_near(vec3_dot(p, n), 0, 1e-12);
        assert_true(fabs(vec3_length(p) - 3) < 1e-12 || vec3_length(p) == 0);
    }
    assert_near(extent_at(disc, 0).area / (9 * pi), 1, 2e-3);
    end_files(&f);
}

// A larger picture and a smaller tolerance cut finer: the outline is off by at most the tolerance
// where the radius is the picture's height.
static void solids_are_cut_within_the_tolerance(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    static const struct {
        const char *script;
        double height, tolerance;
    } cases[] = {{"disc { }", 480, 0.25},
                 {"film { size = <100, 2160> }  disc { }", 2160, 0.25},
                 {"group { tolerance = 1px  disc { } }", 480, 1}};
    for (int k = 0; k < 3; k++) {
        const Shape *disc = &load_well(&f, cases[k].script)->shapes[0];
        double off = cases[k].height * (1 - cos(pi / disc->mesh->n_triangles));
        assert_true(off <= cases[k].tolerance && off > 0.8 * cases[k].tolerance);
    }
    refuses(&f, "cylinder { from = y  to = y }", "from and to are the same point");
    refuses(&f, "disc { normal = 0 * y }", "the disc has no normal");
    end_files(&f);
}

static void materials_see_solids_in_their_own_block(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    const Scene *scene = load_well(
        &f, "cylinder { from = <0, 1, 0>  to = <0, 3, 0>  radius = 2 + t  material = matte(p) }\n"
            "cone { radius = 3  to = <0, 2, 0>  material = matte(n)  translate x }");
    double in[IN_COUNT] = {0}, out[3];
    in[IN_PX] = 1;
    in[IN_PY] = 0.5;
    in[IN_T] = 1; // the rest pose is that of t = 0
    program_run1(scene->materials[scene->shapes[0].material].program, in, out);
    assert_near(out[0], 2, 1e-15);
    assert_near(out[1], 2, 1e-15);
    in[IN_NX] = in[IN_NY] = sqrt(0.5); // of the cone of unit size
    program_run1(scene->materials[scene->shapes[1].material].program, in, out);
    assert_near(out[0], 2 / sqrt(13), 1e-15);
    assert_near(out[1], 3 / sqrt(13), 1e-15);
    end_files(&f);
}

// ---- Points

static void points_are_one_shape(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    const Scene *scene = load_well(
        &f, "for g in 0..1 { points { at = [for k in 0..99: <k, 0.5*sin(k*1rad + 1turn*t), 3*g>]\n"
            "radius = 0.1 + t  color = [for k in 0..99: <k/100, 0, 1>]  material = glow(x, 7) } }");
    const Shape *shape = &scene->shapes[0];
    assert_int_equal(scene->n_shapes, 1);
    assert_int_equal(shape->n_instances, 200);
    const Program *material = scene->materials[shape->material].program;
    for (uint32_t i = 0; i < 200; i++) {
        double in[IN_COUNT], out[4], t = 0.37, k = i % 100;
        shape_inputs(shape, shape_loops(shape, i), t, in);
        program_run1(shape->geometry, in, out);
        assert_near(out[0], k, 0);
        assert_near(out[1], 0.5 * sin(k + 2 * pi * t), 1e-13);
        assert_near(out[2], 3 * (i / 100), 0);
        assert_near(out[3], 0.1 + t, 0);
        program_run1(material, in, out);
        assert_near(out[0], k / 100, 1e-15);
        assert_near(out[1], 0, 0);
        assert_near(out[3], 7, 0);
    }
    scene = load_well(&f, "points { at = [<t, 0, 0>, <0, sin(1turn*t), 0>, <1, 2, exp(t)>] }");
    assert_int_equal(scene->n_shapes, 3); // each moves in a way of its own
    refuses(&f, "points { at = [<1, 2, 3>, 4] }", "item 1 is a number");
    refuses(&f, "points { at = [x]  color = [] }", "there are 1 points and 0 colors");
    refuses(&f, "points { }", "points needs 'at'");
    end_files(&f);
}

// ---- Written meshes

static void meshes_are_written_out(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    const Scene *scene = load_well(
        &f, "let corners = [<0,0,0>, <2,0,0>, <3,1,0>, <2,2,0>, <0,2,0>]\n"
            "mesh { points = corners  faces = [[0, 1, 2, 3, 4]]  normals = [for c in corners: 2*z]"
            "  uvs = [for c in corners: <c.x, c.y>]  subdivide = 2 }\n"
            "mesh { points = corners  faces = [<0, 1, 2>, <0, 2, 3, 4>] }");
    const Shape *shape = &scene->shapes[0];
    assert_int_equal(shape->mesh->n_triangles, 3 * 16);
    assert_near(extent_at(shape, 0).area, 5, 1e-14);
    for (uint32_t i = 0; i < shape->mesh->n_vertices; i++) {
        assert_near(shape->mesh->normal[3 * (size_t)i + 2], 1, 0);
        assert_near(shape->mesh->uv[2 * (size_t)i], place(shape, 0, i).x, 0);
    }
    // A pentagon of 3 triangles has 5 vertices and 7 edges; then 12 vertices and 23 edges.
    assert_int_equal(shape->mesh->n_vertices, 12 + 23);
    assert_int_equal(scene->shapes[1].mesh->n_triangles, 3);
    assert_near(extent_at(&scene->shapes[1], 0).area, 5, 1e-14);
    refuses(&f, "mesh { points = [x, y, z] }", "points without faces");
    refuses(&f, "mesh { points = [x, y, z]  faces = [[0, 1, 3]] }", "3 is not one of the points");
    refuses(&f, "mesh { points = [x, y, z]  faces = [[0, 1]] }", "face 0 is a list of 2");
    refuses(&f, "mesh { points = [x, y, t*z]  faces = [[0, 1, 2]] }", "depends on t");
    refuses(&f, "mesh { points = [x, y, z]  faces = [[0, 1, 2]]  uvs = [<0, 0>] }",
            "there are 3 points and 1 uvs");
    refuses(&f, "mesh { points = [x]  faces = []  file = \"a.obj\" }", "not by both");
    end_files(&f);
}

// ---- Caches

static const char quad_obj[] = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 1\n"
                               "f 1/1 2/1 3/1\nf 1/2 3/2 4/2\n";

static void put_word(unsigned char *to, uint32_t word, bool is_big) {
    for (int i = 0; i < 4; i++) {
        to[is_big ? 3 - i : i] = (unsigned char)(word >> (8 * i));
    }
}

static void put_float(unsigned char *to, float value, bool is_big) {
    uint32_t word;
    memcpy(&word, &value, sizeof word);
    put_word(to, word, is_big);
}

// Coordinate c of vertex v in sample k.
static float coordinate(uint32_t k, uint32_t v, uint32_t c) {
    return (float)(0.1 + 1.7 * k - 0.3 * v + 10 * c + 0.01 * k * v * c);
}

static const float sample_times[3] = {0.5f, 0.75f, 2};

static size_t make_cache(unsigned char *to, bool is_mdd) {
    unsigned char *at = to;
    if (is_mdd) {
        put_word(at, 3, true);
        put_word(at + 4, 4, true);
        for (int k = 0; k < 3; k++) {
            put_float(at + 8 + 4 * k, sample_times[k], true);
        }
        at += 8 + 12;
    } else {
        memcpy(at, "POINTCACHE2", 12);
        put_word(at + 12, 1, false);
        put_word(at + 16, 4, false);
        put_float(at + 20, 5, false);    // the first frame
        put_float(at + 24, 2.5f, false); // frames from one sample to the next
        put_word(at + 28, 3, false);
        at += 32;
    }
    for (uint32_t k = 0; k < 3; k++) {
        for (uint32_t i = 0; i < 12; i++, at += 4) {
            put_float(at, coordinate(k, i / 3, i % 3), is_mdd);
        }
    }
    return (size_t)(at - to);
}

static void run_track(const VertexTrack *track, double t, double *out[3]) {
    track_run(track, t, NULL, 0, track->n_vertices, out);
}

// The number that should stand there at t, given the samples' times.
static double expected(const double times[3], double t, uint32_t v, uint32_t c) {
    if (t <= times[0]) {
        return coordinate(0, v, c);
    }
    for (uint32_t k = 0; k < 2; k++) {
        if (t < times[k + 1]) {
            double s = (t - times[k]) / (times[k + 1] - times[k]);
            return (1 - s) * coordinate(k, v, c) + s * coordinate(k + 1, v, c);
        }
    }
    return coordinate(2, v, c);
}

static void check_track(const Shape *shape, const double times[3]) {
    static const uint32_t point[6] = {0, 1, 2, 3, 0, 2}; // behind the file's own, the seam's
    static const double asked[] = {-3, 0.5, 0.51, 0.6123, 0.75, 1.99, 2, 77};
    double x[64], y[64], z[64], *out[3] = {x, y, z};
    assert_int_equal(shape->track->n_vertices, 6);
    for (size_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
        run_track(shape->track, asked[i], out);
        for (uint32_t v = 0; v < 6; v++) {
            for (uint32_t c = 0; c < 3; c++) {
                assert_near(out[c][v], expected(times, asked[i], point[v], c), 4e-6);
            }
        }
    }
}

static void caches_are_their_files_numbers(void **state) {
    (void)state;
    Files f;
    unsigned char bytes[512];
    assert_non_null(new_files(&f));
    write_text(&f, "quad.obj", quad_obj);
    write_bytes(&f, "a.mdd", bytes, make_cache(bytes, true));
    write_bytes(&f, "a.pc2", bytes, make_cache(bytes, false));
    const Scene *scene =
        load_well(&f, "mesh { file = \"quad.obj\"  cache = \"a.mdd\" }\n"
                      "mesh { file = \"quad.obj\"  cache = \"a.pc2\"  fps = 10 }\n"
                      "mesh { file = \"quad.obj\"  cache = \"a.mdd\"  fit = 4  subdivide = 1\n"
                      "fn deform(p) = p + <t, 0, 0> }");
    static const double mdd_times[3] = {0.5, 0.75, 2}, pc2_times[3] = {0.5, 0.75, 1};
    check_track(&scene->shapes[0], mdd_times);
    check_track(&scene->shapes[1], pc2_times);
    assert_non_null(strstr(f.text, "[-Wread-outside]"));
    // Fit doubles and centers the file's square, and the cache with it; middles stay in the middle.
    const Shape *shape = &scene->shapes[2];
    double x[64], y[64], z[64], *out[3] = {x, y, z};
    run_track(shape->track, 0.6, out);
    assert_near(x[1], 2 * expected(mdd_times, 0.6, 1, 0) - 2, 1e-5);
    assert_near(y[1], 2 * expected(mdd_times, 0.6, 1, 1) - 2, 1e-5);
    for (uint32_t i = 6; i < shape->track->n_vertices; i++) {
        const double *p = shape->mesh->position + 3 * (size_t)i;
        assert_true(fabs(p[0]) + fabs(p[1]) <= 4);
    }
    assert_int_equal(shape->track->n_vertices, 6 + 6); // three edges each, split along the seam
    // The program gets the track's places for p, for all vertices and for a few of them.
    Arena arena = {0};
    MoverPart part = mover_mesh(&arena, shape, 0);
    Mover mover = {&part, 1, 3, part.n};
    double a[64], b[64], c[64], *const got[4] = {a, b, c, NULL};
    assert_true(mover_moves(&mover));
    mover_run(&mover, 0.6, &arena, got);
    assert_near(a[1], x[1] + 0.6, 1e-12);
    assert_near(b[7], y[7], 0);
    static const uint32_t which[3] = {1, 7, 11};
    Mover few = mover_subset(&arena, &mover, which, 3);
    mover_run(&few, 0.6, &arena, got);
    assert_near(a[0], x[1] + 0.6, 1e-12);
    assert_near(b[1], y[7], 0);
    assert_near(c[2], z[11], 0);
    // Some of all, and some of a few.
    mover_run_some(&mover, 5, 4, 0.6, &arena, got);
    assert_near(a[0], x[5] + 0.6, 1e-12);
    assert_near(b[3], y[8], 0);
    mover_run_some(&few, 1, 2, 0.6, &arena, got);
    assert_near(a[0], x[7] + 0.6, 1e-12);
    assert_near(c[1], z[11], 0);
    arena_free(&arena);
    end_files(&f);
}

// Sampling cuts where the places bend: at the keys, the first one too.
static void tracks_break_at_their_keys(void **state) {
    (void)state;
    Files f;
    unsigned char bytes[512];
    assert_non_null(new_files(&f));
    write_text(&f, "quad.obj", quad_obj);
    write_bytes(&f, "a.mdd", bytes, make_cache(bytes, true));
    const Scene *scene = load_well(&f, "mesh { file = \"quad.obj\"  cache = \"a.mdd\" }");
    const Program *breaks = scene->shapes[0].breaks;
    assert_non_null(breaks);
    for (int k = 0; k < 3; k++) {
        double in[IN_COUNT] = {0}, before[4], after[4];
        in[IN_T] = sample_times[k] - 1e-9;
        program_run1(breaks, in, before);
        in[IN_T] = sample_times[k];
        program_run1(breaks, in, after);
        assert_true(floor(before[0]) != floor(after[0]));
    }
    end_files(&f);
}

static void refuses_cache(Files *f, const unsigned char *bytes, size_t n, const char *report) {
    write_bytes(f, "bad.pc2", bytes, n);
    refuses(f, "mesh { file = \"quad.obj\"  cache = \"bad.pc2\" }", report);
}

static void damaged_caches_are_refused(void **state) {
    (void)state;
    Files f;
    unsigned char bytes[512], bad[512];
    assert_non_null(new_files(&f));
    write_text(&f, "quad.obj", quad_obj);
    size_t n = make_cache(bytes, false);
    refuses_cache(&f, bytes, n - 1,
                  "as PC2, it is cut off: 3 samples of 4 points are announced, 2");
    refuses_cache(&f, bytes, 20, "cut off within its head");
    refuses_cache(&f, bytes, 0, "the file is empty");
    memcpy(bad, bytes, n);
    refuses_cache(&f, bad, n + 5, "5 bytes follow");
    put_word(bad + 12, 2, false);
    refuses_cache(&f, bad, n, "PC2 of version 2");
    memcpy(bad, bytes, n);
    put_word(bad + 28, 0xffffffff, false);
    refuses_cache(&f, bad, n, "its head says 4294967295 samples");
    put_word(bad + 28, 0x7fffffff, false);
    put_word(bad + 16, 0x7fffffff, false);
    refuses_cache(&f, bad, n, "it is cut off");
    memcpy(bad, bytes, n);
    put_float(bad + 24, -1, false);
    refuses_cache(&f, bad, n, "do not ascend");
    put_float(bad + 20, NAN, false);
    refuses_cache(&f, bad, n, "do not ascend");
    n = make_cache(bytes, true);
    refuses_cache(&f, bytes, n - 40, "as MDD, it is cut off");
    refuses_cache(&f, bytes, 7, "neither PC2 nor MDD");
    memcpy(bad, bytes, n);
    put_float(bad + 12, 0.25f, true);
    refuses_cache(&f, bad, n, "do not ascend");
    write_text(&f, "tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_bytes(&f, "a.mdd", bytes, n);
    refuses(&f, "mesh { file = \"tri.obj\"  cache = \"a.mdd\" }",
            "has 4 points, the mesh has 3 vertices");
    refuses(&f, "mesh { file = \"tri.obj\"  cache = \"none.mdd\" }", "there is no file 'none.mdd'");
    end_files(&f);
}

// ---- Sequences

static void sequences_are_their_files(void **state) {
    (void)state;
    Files f;
    char text[128], name[32];
    assert_non_null(new_files(&f));
    for (int k = 0; k < 4; k++) {
        snprintf(name, sizeof name, "w.%03d.obj", 9 + k);
        snprintf(text, sizeof text, "v %d 0 0\nv 1 0 0\nv 0 1 %d\nf 1 2 3\n", k * k, k);
        write_text(&f, name, text);
    }
    static const char script[] = "mesh { frames = \"w.%03d.obj\"  fps = 8 }";
    const VertexTrack *track = load_well(&f, script)->shapes[0].track;
    double x[3], y[3], z[3], *out[3] = {x, y, z};
    assert_int_equal(track->n_keys, 4);
    run_track(track, 2.25 / 8, out);
    assert_near(x[0], 4 + 0.25 * 5, 1e-6);
    assert_near(z[2], 2.25, 1e-6);
    run_track(track, 1, out);
    assert_near(x[0], 9, 1e-6);
    assert_near(track->seconds[3], 3.0 / 8, 0);
    write_text(&f, "w.010.obj", "v 1 0 0\nv 1 0 0\nv 0 1 1\nv 0 0 0\nf 1 2 3\n");
    refuses(&f, script, "'w.010.obj' has 4 vertices, the first file of the sequence has 3");
    write_text(&f, "w.010.obj", "v 1 0 0\nv 1 0 0\nv 0 1 1\nf 2 1 3\n");
    refuses(&f, script, "the faces of 'w.010.obj' are not those");
    char path[128];
    path_of(&f, "w.010.obj", path);
    unlink(path);
    refuses(&f, script, "has 'w.009.obj' and 'w.012.obj', but no 'w.010.obj'");
    refuses(&f, "mesh { frames = \"v.%d.obj\" }", "there is no file 'v.%d.obj' with any number");
    refuses(&f, "mesh { frames = \"w.obj\" }", "holds no place for the number");
    refuses(&f, "mesh { frames = \"w.%s.obj\" }", "holds no place for the number");
    refuses(&f, "mesh { file = \"w.009.obj\"  fps = 4 }", "fps without frames or cache");
    end_files(&f);
}

// ---- Tables

static void tables_are_straight_between_rows(void **state) {
    (void)state;
    Files f;
    assert_non_null(new_files(&f));
    write_text(&f, "xy.txt", "# time, height\n0 1\n 1, 3 \r\n\n3\t-1e0\n");
    write_text(&f, "y.csv", "5;\n7\n-2");
    const Scene *scene =
        load_well(&f, "sphere { center = <table(\"xy.txt\", t), table(\"y.csv\", 2*t), 0> }");
    static const double at[][3] = {{-4, 1, 5}, {0.25, 1.5, 6}, {0.75, 2.5, 2.5},
                                   {2, 1, -2}, {3, -1, -2},    {9, -1, -2}};
    for (size_t k = 0; k < sizeof at / sizeof at[0]; k++) {
        double in[IN_COUNT] = {0}, out[4];
        in[IN_T] = at[k][0];
        program_run1(scene->shapes[0].geometry, in, out);
        assert_near(out[0], at[k][1], 1e-15);
        assert_near(out[1], at[k][2], 1e-14);
    }
    assert_non_null(scene->shapes[0].breaks);
    write_text(&f, "bad.txt", "1 2\n1 3\n");
    refuses(&f, "sphere { radius = table(\"bad.txt\", t) }",
            "'bad.txt', line 2: the first column does not ascend");
    write_text(&f, "bad.txt", "1\n2 3\n");
    refuses(&f, "sphere { radius = table(\"bad.txt\", t) }", "not as many columns");
    write_text(&f, "bad.txt", "1\nnan\n");
    refuses(&f, "sphere { radius = table(\"bad.txt\", t) }", "line 2: numbers are expected");
    write_text(&f, "bad.txt", "# nothing\n");
    refuses(&f, "sphere { radius = table(\"bad.txt\", t) }", "there are no numbers in 'bad.txt'");
    refuses(&f, "sphere { radius = table(\"none.txt\", t) }", "there is no file 'none.txt'");
    end_files(&f);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(solids_have_their_area_and_volume),
    cmocka_unit_test(axes_point_anywhere),
    cmocka_unit_test(normals_are_exact),
    cmocka_unit_test(solids_are_cut_within_the_tolerance),
    cmocka_unit_test(materials_see_solids_in_their_own_block),
    cmocka_unit_test(points_are_one_shape),
    cmocka_unit_test(meshes_are_written_out),
    cmocka_unit_test(caches_are_their_files_numbers),
    cmocka_unit_test(tracks_break_at_their_keys),
    cmocka_unit_test(damaged_caches_are_refused),
    cmocka_unit_test(sequences_are_their_files),
    cmocka_unit_test(tables_are_straight_between_rows),
};

SUITE(shapes, tests)
