// SPDX-License-Identifier: Apache-2.0
// Lowering: programs of loaded scenes against closed forms; settings, files, the command line.
#include "lang/scene_load.h"
#include "render/snapshot.h"
#include "accel/vec.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct {
    Arena arena;
    Sources sources;
    Diag *diag;
    FILE *reports;
    LoadedScene loaded;
} Loaded;

static void load_with(Loaded *l, const char *path, const char *text, const LoadOptions *options) {
    *l = (Loaded){.sources = {.end = 1}};
    l->sources.arena = &l->arena;
    l->reports = tmpfile();
    assert_non_null(l->reports);
    l->diag = diag_new(&l->arena, &l->sources, l->reports, false, false);
    scene_load(&l->arena, &l->sources, l->diag, path, text, text ? strlen(text) : 0, options,
               &l->loaded);
}

static const Scene *load(Loaded *l, const char *text) {
    load_with(l, "test.st4", text, NULL);
    if (!l->loaded.scene) {
        char line[512];
        rewind(l->reports);
        while (fgets(line, sizeof line, l->reports)) {
            print_error("%s", line);
        }
    }
    assert_non_null(l->loaded.scene);
    scene_load_free(&l->loaded); // scenes stand on their own
    return l->loaded.scene;
}

static bool reported(Loaded *l, const char *text) {
    static char all[65536];
    rewind(l->reports);
    size_t n = fread(all, 1, sizeof all - 1, l->reports);
    all[n] = '\0';
    return strstr(all, text) != NULL;
}

static void unload(Loaded *l) {
    fclose(l->reports);
    scene_load_free(&l->loaded);
    arena_free(&l->arena);
}

static void run_at(const Program *program, double t, const double *loops, uint32_t n, double *out) {
    double in[IN_COUNT] = {0};
    assert_non_null(program);
    in[IN_T] = in[IN_FILM_T] = t;
    for (uint32_t i = 0; i < n; i++) {
        in[IN_LOOP0 + i] = loops[i];
    }
    program_run1(program, in, out);
}

static void assert_map(const Program *program, double t, const double p[3], const double q[3]) {
    double m[12];
    run_at(program, t, NULL, 0, m);
    for (int r = 0; r < 3; r++) {
        double mapped = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
        assert_near(mapped, q[r], 1e-12);
    }
}

// ---- Shapes

static void spheres_move(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "sphere { center = <t, 2*t, 3>  radius = 1 + t }");
    double out[4];
    run_at(scene->shapes[0].geometry, 0.5, NULL, 0, out);
    assert_near(out[0], 0.5, 0);
    assert_near(out[1], 1, 0);
    assert_near(out[2], 3, 0);
    assert_near(out[3], 1.5, 0);
    assert_null(scene->shapes[0].transform);
    assert_null(scene->shapes[0].visible);
    assert_null(scene->shapes[0].breaks);
    assert_string_equal(scene->shapes[0].label, "sphere@1");
    unload(&l);
}

static void transforms_join_in_written_order(void **state) {
    (void)state;
    Loaded l;
    const double origin[3] = {0, 0, 0}, a[3] = {0, 1, 0}, b[3] = {1, 0, 0}, c[3] = {0, 3, 5};
    const Scene *scene =
        load(&l, "sphere { translate x  rotate z, 90deg }\n"
                 "sphere { rotate z, 90deg  translate x }\n"
                 "group { translate <0, 0, 5>  sphere { scale 3  translate <3, 0, 0>  "
                 "rotate z, 90deg * t } }\n"
                 "group { sphere { }  for i in 0..2 { translate x } if true { translate x } }");
    assert_map(scene->shapes[0].transform, 0, origin, a);
    assert_map(scene->shapes[1].transform, 0, origin, b);
    assert_map(scene->shapes[2].transform, 1, origin, c);
    const double moved[3] = {4, 0, 0};
    assert_map(scene->shapes[3].transform, 0, origin, moved);
    unload(&l);
}

static void loops_are_batched(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "for i in 0..2 { for j in 0..1 by 0.5 { sphere { "
                                  "radius = 1 + i  translate <i, j, t> } } }");
    const Shape *shape = &scene->shapes[0];
    assert_int_equal(scene->n_shapes, 1);
    assert_int_equal(shape->n_instances, 9);
    assert_int_equal(shape->n_loops, 2);
    for (uint32_t k = 0; k < 9; k++) {
        const double *loops = shape->loops + 2 * (size_t)k;
        double geometry[4], m[12];
        assert_near(loops[0], k / 3, 0);
        assert_near(loops[1], 0.5 * (k % 3), 0);
        run_at(shape->geometry, 2, loops, 2, geometry);
        run_at(shape->transform, 2, loops, 2, m);
        assert_near(geometry[3], 1.0 + k / 3, 0);
        assert_near(m[3], k / 3, 0);
        assert_near(m[7], 0.5 * (k % 3), 0);
        assert_near(m[11], 2, 0);
    }
    unload(&l);
}

static void loops_are_walked_where_numbers_are_needed(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene =
        load(&l, "let sizes = [1, 4, 9]\n"
                 "for i in 0..2 { for j in 0..3 { sphere { radius = sizes[i] + j } } }\n"
                 "for i in 1..2 { sphere Ball[i] { } }\n"
                 "for i in 0..2 { sphere Bead[i] { } }\n");
    assert_int_equal(scene->n_shapes, 3 + 1 + 1);
    for (uint32_t i = 0; i < 3; i++) {
        double out[4], j = 2;
        assert_int_equal(scene->shapes[i].n_instances, 4);
        run_at(scene->shapes[i].geometry, 0, &j, 1, out);
        assert_near(out[3], (i + 1.0) * (i + 1) + 2, 0);
    }
    char name[32];
    shape_name(&scene->shapes[3], 0, name, sizeof name);
    assert_string_equal(name, "Ball[1]");
    shape_name(&scene->shapes[3], 1, name, sizeof name);
    assert_string_equal(name, "Ball[2]");
    shape_name(&scene->shapes[4], 2, name, sizeof name);
    assert_string_equal(name, "Bead[2]");
    assert_int_equal(scene->shapes[4].n_instances, 3);
    unload(&l);
}

static const double *vertex(const Mesh *mesh, uint32_t i) {
    return mesh->position + 3 * (size_t)i;
}

// A globe: its poles and its seam are closed, every face looks outwards.
static void surfaces_close(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "surface { u = 0turn..1turn  v = 0turn..0.5turn  res = <16, 8>\n"
                                  "fn at(u, v) = 2 * <sin(v)*cos(u), cos(v), sin(v)*sin(u)>\n"
                                  "fn deform(p) = turned(p, y, 90deg * t * p.y) }");
    const Mesh *mesh = scene->shapes[0].mesh;
    assert_int_equal(mesh->n_vertices, 17 * 9);
    assert_int_equal(mesh->n_triangles, 2 * 16 * 8 - 2 * 16);
    for (uint32_t j = 0; j <= 8; j++) {
        assert_memory_equal(vertex(mesh, 17 * j), vertex(mesh, 17 * j + 16), 3 * sizeof(double));
    }
    for (uint32_t i = 1; i <= 16; i++) {
        assert_memory_equal(vertex(mesh, 0), vertex(mesh, i), 3 * sizeof(double));
    }
    for (uint32_t f = 0; f < mesh->n_triangles; f++) {
        const uint32_t *index = mesh->index + 3 * (size_t)f;
        const double *a = vertex(mesh, index[0]), *b = vertex(mesh, index[1]),
                     *c = vertex(mesh, index[2]);
        Vec3 ab = vec3(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        Vec3 ac = vec3(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        assert_true(vec3_dot(vec3_cross(ab, ac), vec3(a[0], a[1], a[2])) > 0);
    }
    double in[IN_COUNT] = {0}, out[3], angle = 1.5707963267948966 * 0.5 * 0.8;
    in[IN_T] = 0.5;
    in[IN_PX] = 1;
    in[IN_PY] = 0.8;
    program_run1(scene->shapes[0].vertex, in, out);
    assert_near(out[0], cos(angle), 1e-14);
    assert_near(out[1], 0.8, 0);
    assert_near(out[2], -sin(angle), 1e-14);
    unload(&l);
}

static void surfaces_that_move_are_programs_of_u_and_v(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "surface { res = <4, 2>  fn at(u, v) = <u, v, u * v * t> }\n"
                                  "surface { res = <4, 2>  fn at(u, v) = <u, v, u * v> }");
    double in[IN_COUNT] = {0}, out[3];
    in[IN_T] = 3;
    in[IN_U] = 0.5;
    in[IN_V] = 0.25;
    program_run1(scene->shapes[0].vertex, in, out);
    assert_near(out[2], 0.375, 0);
    assert_null(scene->shapes[1].vertex);
    const Mesh *mesh = scene->shapes[1].mesh;
    assert_near(vertex(mesh, 1 * 5 + 3)[2], 0.75 * 0.5, 0);
    assert_near(mesh->uv[2 * 8], 0.75, 0);
    unload(&l);
}

// Boxes share a mesh of unit size; materials see the box's own size.
static void boxes_share_a_mesh(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "box { size = <2, 3, 4 + t>  material = matte(p) }\n"
                                  "box { size = <5, 1, 1>  translate x }\n"
                                  "box { size = <1, 0, 1> }");
    const double corner[3] = {0.5, -0.5, 0.5}, placed[3] = {1, -1.5, 3};
    assert_ptr_equal(scene->shapes[0].mesh, scene->shapes[1].mesh);
    assert_ptr_not_equal(scene->shapes[0].mesh, scene->shapes[2].mesh);
    assert_null(scene->shapes[2].transform);
    assert_int_equal(scene->shapes[0].mesh->n_triangles, 12);
    assert_map(scene->shapes[0].transform, 2, corner, placed);
    double in[IN_COUNT] = {0}, out[3];
    in[IN_PX] = 0.5;
    in[IN_PZ] = 0.5;
    in[IN_T] = 2;
    program_run1(scene->materials[scene->shapes[0].material].program, in, out);
    assert_near(out[0], 1, 0);
    assert_near(out[2], 2, 0); // the rest pose is that of t = 0
    const Mesh *mesh = scene->shapes[0].mesh;
    for (uint32_t f = 0; f < 12; f++) {
        const uint32_t *index = mesh->index + 3 * (size_t)f;
        const double *a = vertex(mesh, index[0]), *b = vertex(mesh, index[1]),
                     *c = vertex(mesh, index[2]);
        Vec3 ab = vec3(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        Vec3 ac = vec3(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        Vec3 n = vec3_cross(ab, ac);
        assert_near(vec3_length(n), 1, 0);
        assert_near(vec3_dot(n, vec3(a[0], a[1], a[2])), 0.5, 0);
    }
    unload(&l);
}

static void materials_are_made_once(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene =
        load(&l, "let red = metal(<1, 0, 0>, 0.2)\n"
                 "group { material = red  sphere { } sphere { material = glow(x) } "
                 "group { material = matte(x * t)  quad { } } }\n"
                 "sphere { material = red }\n sphere { }");
    assert_int_equal(scene->n_materials, 4);
    assert_int_equal(scene->shapes[0].material, scene->shapes[3].material);
    assert_int_equal(scene->materials[scene->shapes[0].material].kind, MATERIAL_METAL);
    assert_int_equal(scene->materials[scene->shapes[1].material].kind, MATERIAL_GLOW);
    assert_int_equal(scene->materials[scene->shapes[2].material].kind, MATERIAL_MATTE);
    double out[4];
    run_at(scene->materials[scene->shapes[0].material].program, 0, NULL, 0, out);
    assert_near(out[0], 1, 0);
    assert_near(out[3], 0.2, 0);
    unload(&l);
}

static void jumps_are_known(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "sphere { center = <t % 1s, 0, 0> }\n"
                                  "sphere { visible = t > 1s }");
    assert_non_null(scene->shapes[0].breaks);
    double before[1], after[1];
    run_at(scene->shapes[0].breaks, 0.999, NULL, 0, before);
    run_at(scene->shapes[0].breaks, 1.001, NULL, 0, after);
    assert_true(floor(before[0]) != floor(after[0]));
    assert_null(scene->shapes[1].breaks);
    run_at(scene->shapes[1].visible, 0.5, NULL, 0, before);
    run_at(scene->shapes[1].visible, 1.5, NULL, 0, after);
    assert_near(before[0], 0, 0);
    assert_near(after[0], 1, 0);
    unload(&l);
}

// ---- Settings

static void settings_are_read(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene =
        load(&l, "shutter { length = 10f  phase = start }\n"
                 "film { fps = 30  size = <100, 50>  frames = 2..7  out = \"a/b.####.exr\" }\n"
                 "render { bounces = 2  spp = 16  seed = 7  freeze = true }\n"
                 "group { camera { from = <0, 0, 5>  fov = 90deg }  translate <1, 0, 0> "
                 "sun { dir = x  power = 3  color = <1, 0.5, 0> }  "
                 "lamp { from = <0, 2, 0>  radius = 0.1 }  rotate y, 90deg }\n"
                 "sky { color = <1, 1, 1>  power = 2 }\n sphere { }");
    assert_int_equal(scene->film.width, 100);
    assert_int_equal(scene->film.height, 50);
    assert_near(scene->film.fps, 30, 0);
    assert_int_equal(scene->film.first_frame, 2);
    assert_int_equal(scene->film.last_frame, 7);
    assert_string_equal(scene->film.out, "a/b.####.exr");
    assert_near(scene->shutter.length, 10, 1e-12);
    assert_near(scene->shutter.open, 0, 0);
    assert_int_equal(scene->render.bounces, 2);
    assert_int_equal(scene->render.spp, 16);
    assert_int_equal(scene->render.seed, 7);
    assert_true(scene->render.freeze);
    double camera[10], sun[8], lamp[8], sky[4];
    run_at(scene->camera.program, 0, NULL, 0, camera);
    const double expected[10] = {5, 0, -1, 0, 0, -1, 0, 1, 0, 1.5707963267948966};
    for (int i = 0; i < 10; i++) {
        assert_near(camera[i], expected[i], 1e-12);
    }
    assert_int_equal(scene->n_lights, 3);
    run_at(scene->lights[0].program, 0, NULL, 0, sun);
    assert_near(sun[0], 0, 1e-12);
    assert_near(sun[2], -1, 1e-12);
    assert_near(sun[3], 3, 0);
    assert_near(sun[5], 0.5, 0);
    run_at(scene->lights[1].program, 0, NULL, 0, lamp);
    assert_near(lamp[1], 2, 0);
    assert_near(lamp[2], -1, 1e-12);
    assert_near(lamp[3], 100, 0);
    assert_near(lamp[7], 0.1, 0);
    run_at(scene->lights[2].program, 0, NULL, 0, sky);
    assert_near(sky[3], 2, 0);
    unload(&l);
}

// Times become frame periods, also where the command line has another rate; its shutter leaves the
// curve and the delays as they are, and its size is that of which pixels are asked.
static void shutters_and_lenses_are_read(void **state) {
    (void)state;
    Loaded l;
    LoadOptions options = {.width = 10, .height = 4, .fps = 50, .shutter = "360deg"};
    load_with(&l, "test.st4",
              "shutter { angle = 90deg  phase = start  curve = cosine  roll = up  "
              "readout = 10ms  fn delay(u, v) = 2s*u - 1s }\n"
              "camera { aperture = 2cm  blades = 5  shift = <0.25, t>  to = <0, 1, 1> }\n"
              "sphere { }",
              &options);
    const Scene *scene = l.loaded.scene;
    const ShutterSettings *shutter = &scene->shutter;
    assert_near(shutter->length, 1, 0);
    assert_near(shutter->open, 0, 0);
    assert_non_null(shutter->curve);
    assert_int_equal(shutter->roll, ROLL_UP);
    assert_near(shutter->readout, 0.5, 1e-15);
    assert_near(shutter->first_delay, -0.9 * 50, 1e-12); // the lowest row, the first column
    assert_near(shutter->last_delay, 0.9 * 50 + 0.5, 1e-12);
    double lens[4];
    run_at(scene->camera.lens, 3, NULL, 0, lens);
    const double expected[4] = {0.02, 4, 0.25, 3}; // focus is at to, 4 m from <0, 1, 5>
    for (int i = 0; i < 4; i++) {
        assert_near(lens[i], expected[i], 1e-15);
    }
    assert_int_equal(scene->camera.blades, 5);
    unload(&l);
}

static void everything_has_a_default(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "sphere { }");
    assert_int_equal(scene->film.width, 640);
    assert_near(scene->film.fps, 24, 0);
    assert_near(scene->shutter.length, 0.5, 0);
    assert_near(scene->shutter.open, -0.25, 0);
    assert_null(scene->shutter.curve);
    assert_null(scene->camera.lens);
    assert_int_equal(scene->render.bounces, 4);
    assert_true(scene->camera.automatic);
    assert_int_equal(scene->n_lights, 1);
    assert_int_equal(scene->lights[0].kind, LIGHT_SKY);
    assert_near(scene->shapes[0].tolerance, 0.25, 0);
    unload(&l);
}

static void the_command_line_overrides(void **state) {
    (void)state;
    Loaded l;
    const char *text = "param n = 2  param name = \"a\"  param when = 12f\n"
                       "film { fps = 24  frames = 1..5 }\n"
                       "sphere { radius = n + when * 0 + (name == \"b.obj\" ? 10 : 0) }";
    const char *defines[] = {"n=1", "n=3 + 4", "name=b.obj"};
    LoadOptions options = {.defines = defines,
                           .n_defines = 3,
                           .width = 32,
                           .height = 16,
                           .fps = 48,
                           .shutter = "4f",
                           .has_frames = true,
                           .first_frame = 3,
                           .last_frame = 3};
    load_with(&l, "test.st4", text, &options);
    const Scene *scene = l.loaded.scene;
    assert_non_null(scene);
    double out[4];
    run_at(scene->shapes[0].geometry, 0, NULL, 0, out);
    assert_near(out[3], 17, 0);
    assert_int_equal(scene->film.width, 32);
    assert_near(scene->film.fps, 48, 0);
    assert_int_equal(scene->film.first_frame, 3);
    assert_near(scene->shutter.length, 4, 1e-12);
    assert_near(scene->shutter.open, -2, 1e-12);
    SceneMotion motion;
    assert_true(scene_eval(&l.loaded, &l.arena, "when", &motion));
    run_at(motion.program, 0, NULL, 0, out);
    assert_near(out[0], 0.25, 0);
    unload(&l);
    const char *typo[] = {"m=1"};
    options = (LoadOptions){.defines = typo, .n_defines = 1};
    load_with(&l, "test.st4", text, &options);
    assert_int_equal(l.loaded.status, 1);
    assert_true(reported(&l, "the script has no param 'm'"));
    unload(&l);
}

static void hashes_tell_scenes_apart(void **state) {
    (void)state;
    const char *texts[] = {"sphere { }", "sphere { }", "sphere {  }",
                           "param n = 1 sphere { radius = n }"};
    const char *defines[] = {"n=1"};
    char hashes[5][33];
    for (int i = 0; i < 5; i++) {
        Loaded l;
        LoadOptions options = {.defines = defines, .n_defines = i == 4};
        load_with(&l, "test.st4", texts[i < 4 ? i : 3], &options);
        assert_non_null(l.loaded.scene);
        memcpy(hashes[i], l.loaded.scene->hash, 33);
        assert_int_equal(strlen(hashes[i]), 32);
        unload(&l);
    }
    assert_string_equal(hashes[0], hashes[1]);
    assert_string_not_equal(hashes[0], hashes[2]);
    assert_string_not_equal(hashes[3], hashes[4]);
}

// ---- Files

static void write_file(const char *folder, const char *name, const char *text) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static const char *const file_names[] = {"main.st4", "parts.st4", "tri.obj",
                                         "a.st4",    "b.st4",     "sub/in.st4"};

static void remove_files(const char *folder) {
    char path[256];
    for (size_t i = 0; i < sizeof file_names / sizeof file_names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, file_names[i]);
        remove(path);
    }
    snprintf(path, sizeof path, "%s/sub", folder);
    rmdir(path);
    rmdir(folder);
}

static void load_file(Loaded *l, const char *folder, const char *name, const LoadOptions *options) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    load_with(l, path, NULL, options);
}

static void files_are_found(void **state) {
    (void)state;
    char folder[] = "/tmp/st4-lower-XXXXXX", sub[64];
    assert_non_null(mkdtemp(folder));
    snprintf(sub, sizeof sub, "%s/sub", folder);
    assert_int_equal(mkdir(sub, 0700), 0);
    write_file(folder, "tri.obj", "v 0 0 0\nv 2 0 0\nv 0 4 0\nf 1 2 3\n");
    write_file(folder, "parts.st4",
               "let size = 3  def Tri { mesh { file = \"tri.obj\" } }\n"
               "sphere { radius = size }");
    write_file(folder, "main.st4",
               "include \"parts.st4\" as parts\nparts.Tri { scale parts.size }\n"
               "group { include \"parts.st4\"  translate x }\n"
               "mesh { file = \"tri.obj\"  fit = 2  ground = true }");
    write_file(folder, "a.st4", "include \"b.st4\"\nsphere { }");
    write_file(folder, "b.st4", "include \"a.st4\"");
    write_file(folder, "sub/in.st4", "mesh { file = \"tri.obj\" }\nmesh { file = \"../tri.obj\" }");
    Loaded l;
    load_file(&l, folder, "main.st4", NULL);
    assert_int_equal(l.loaded.status, 0);
    assert_int_equal(l.loaded.n_files, 3);
    assert_int_equal(l.loaded.scene->n_shapes, 3);
    const double corner[3] = {2, 0, 0}, scaled[3] = {6, 0, 0}, origin[3] = {0, 0, 0},
                 moved[3] = {1, 0, 0};
    assert_map(l.loaded.scene->shapes[0].transform, 0, corner, scaled);
    assert_map(l.loaded.scene->shapes[1].transform, 0, origin, moved);
    const Mesh *fitted = l.loaded.scene->shapes[2].mesh;
    assert_near(vertex(fitted, 0)[1], 0, 0);
    assert_near(vertex(fitted, 2)[1], 2, 0);
    assert_near(vertex(fitted, 0)[0], -0.5, 0);
    unload(&l);
    load_file(&l, folder, "a.st4", NULL);
    assert_int_equal(l.loaded.status, 1);
    assert_true(reported(&l, "includes itself"));
    unload(&l);
    load_file(&l, folder, "sub/in.st4", NULL);
    assert_int_equal(l.loaded.status, 3);
    assert_true(reported(&l, "there is no file 'tri.obj'"));
    assert_true(reported(&l, "lies outside of the folders"));
    unload(&l);
    const char *dirs[] = {folder};
    LoadOptions options = {.include_dirs = dirs, .n_include_dirs = 1};
    load_file(&l, folder, "sub/in.st4", &options);
    assert_int_equal(l.loaded.status, 3); // tri.obj is found now, ../tri.obj still lies outside
    assert_false(reported(&l, "there is no file"));
    unload(&l);
    remove_files(folder);
}

static void what_is_not_used_is_not_read(void **state) {
    (void)state;
    Loaded l;
    const Scene *scene = load(&l, "def Ghost { mesh { file = \"no such file.obj\" } }\n"
                                  "let broken = 1 / 0\n"
                                  "fn f(x) = g(x)\n"
                                  "if false { mesh { file = \"nor this one.obj\" } }\n"
                                  "sphere { }");
    assert_int_equal(scene->n_shapes, 1);
    unload(&l);
}

static void mistakes_within_calls_show_the_call(void **state) {
    (void)state;
    Loaded l;
    load_with(&l, "test.st4",
              "fn half(x) = x / 2deg\ndef Ball(r) { sphere { radius = r } }\n"
              "sphere { radius = half(half(3)) }\nBall(\"a\") { }",
              NULL);
    assert_int_equal(l.loaded.status, 1);
    assert_true(reported(&l, "test.st4:3:24: note: in this use of fn half"));
    assert_true(reported(&l, "test.st4:4:1: note: in this use of def Ball"));
    assert_false(reported(&l, "test.st4:3:19: note"));
    unload(&l);
}

static void scenes_may_be_bare(void **state) {
    (void)state;
    Loaded l;
    load_with(&l, "test.st4", "film { }", NULL);
    assert_int_equal(l.loaded.status, 0);
    assert_int_equal(l.loaded.scene->n_shapes, 0);
    assert_true(reported(&l, "the scene has no shapes"));
    unload(&l);
}

static void bad_files_have_their_status(void **state) {
    (void)state;
    Loaded l;
    load_with(&l, "test.st4", "// nothing but a comment\n", NULL);
    assert_int_equal(l.loaded.status, 1);
    assert_true(reported(&l, "an empty file shows nothing"));
    unload(&l);
    load_with(&l, "/no/such/file.st4", NULL, NULL);
    assert_int_equal(l.loaded.status, 3);
    assert_true(reported(&l, "cannot read '/no/such/file.st4'"));
    unload(&l);
    load_with(&l, "test.st4", "mesh { file = \"no such file.obj\" }", NULL);
    assert_int_equal(l.loaded.status, 3);
    unload(&l);
    load_with(&l, "test.st4", "sphere { radius = }", NULL);
    assert_int_equal(l.loaded.status, 1);
    unload(&l);
    load_with(&l, "test.st4", "film { out = \"../x.exr\" } sphere { }", NULL);
    assert_int_equal(l.loaded.status, 1);
    unload(&l);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(spheres_move),
    cmocka_unit_test(transforms_join_in_written_order),
    cmocka_unit_test(loops_are_batched),
    cmocka_unit_test(loops_are_walked_where_numbers_are_needed),
    cmocka_unit_test(surfaces_close),
    cmocka_unit_test(surfaces_that_move_are_programs_of_u_and_v),
    cmocka_unit_test(boxes_share_a_mesh),
    cmocka_unit_test(materials_are_made_once),
    cmocka_unit_test(jumps_are_known),
    cmocka_unit_test(settings_are_read),
    cmocka_unit_test(shutters_and_lenses_are_read),
    cmocka_unit_test(everything_has_a_default),
    cmocka_unit_test(the_command_line_overrides),
    cmocka_unit_test(hashes_tell_scenes_apart),
    cmocka_unit_test(files_are_found),
    cmocka_unit_test(what_is_not_used_is_not_read),
    cmocka_unit_test(mistakes_within_calls_show_the_call),
    cmocka_unit_test(scenes_may_be_bare),
    cmocka_unit_test(bad_files_have_their_status),
};

SUITE(lower, tests)
