// SPDX-License-Identifier: Apache-2.0
// Clips of mesh files: against closed forms, and files that are wrong.
#include "render/mesh_clips.h"

#include "tests/near.h"
#include "tests/skinned_gltf.h"
#include "tests/mesh_folder.h"
#include "tests/suite.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void put_gltf(MeshFolder *f, SkinnedKind kind) {
    char *text = skinned_gltf(kind);
    mesh_folder_put(f, "a.gltf", text, strlen(text));
    free(text);
}

static MeshStatus read_two(MeshFolder *f, const char *first, const char *second) {
    const char *names[2] = {first, second};
    f->message[0] = '\0';
    return mesh_clips_read(&f->arena, f->path, names, second ? 2 : 1, &f->places, &f->clips,
                           f->message, sizeof f->message);
}

static void read_well(MeshFolder *f, const char *first, const char *second) {
    if (read_two(f, first, second) != MESH_OK) {
        fail_msg("%s", f->message);
    }
}

// As a VertexTrack has it.
static void place_at(const PointCache *c, double seconds, uint32_t i, double place[3]) {
    uint32_t k = 0;
    while (k + 1 < c->n_samples && c->seconds[k + 1] <= seconds) {
        k++;
    }
    uint32_t next = k + 1 < c->n_samples && seconds > c->seconds[0] ? k + 1 : k;
    double span = c->seconds[next] - c->seconds[k];
    double s = span > 0 ? (seconds - c->seconds[k]) / span : 0;
    for (size_t axis = 0; axis < 3; axis++) {
        double a = (double)c->position[3 * ((size_t)k * c->n_points + i) + axis];
        double b = (double)c->position[3 * ((size_t)next * c->n_points + i) + axis];
        place[axis] = a + s * (b - a);
    }
}

typedef void Oracle(uint32_t vertex, double seconds, double place[3]);

// Of the box at rest, which reaches from 3 to 7 along x, is 0.7 high and 0.4 deep.
static double diagonal(void) {
    return sqrt(16 + 0.7 * 0.7 + 0.4 * 0.4);
}

// The largest error where the clip begins at `begin`, asked every 1 ms or so.
static double largest_error(const MeshFolder *f, Oracle *oracle, double begin, double seconds) {
    double worst = 0;
    for (double t = 0; t < seconds; t += 0.00117) {
        for (uint32_t i = 0; i < SKINNED_VERTICES; i++) {
            double p[3], q[3];
            place_at(&f->places, begin + t, i, p);
            oracle(i, t, q);
            worst = fmax(worst, hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]));
        }
    }
    return worst;
}

static void the_rest_is_what_bones_hold(void **state) {
    MeshFolder *f = *state;
    put_gltf(f, SKINNED_SOUND);
    assert_int_equal(mesh_read(&f->arena, f->path, &f->mesh, f->message, 256), MESH_OK);
    assert_int_equal(f->mesh.n_vertices, SKINNED_VERTICES);
    assert_int_equal(f->mesh.n_triangles, 8 * (RINGS - 1) + 1);
    for (uint32_t i = 0; i < SKINNED_VERTICES; i++) {
        double p[3];
        skinned_rest(i, p);
        for (size_t k = 0; k < 3; k++) {
            assert_near(f->mesh.position[3 * (size_t)i + k], p[k], 1e-6);
        }
    }
}

static void places_are_within_the_bound(void **state) {
    MeshFolder *f = *state;
    put_gltf(f, SKINNED_SOUND);
    read_well(f, "Bend", NULL);
    assert_int_equal(f->places.n_points, SKINNED_VERTICES);
    double error = largest_error(f, skinned_bend, 0, 2.6);
    assert_true(error < 1e-4 * diagonal());
    assert_true(error > 0.3e-4 * diagonal()); // no more keys than needed
    assert_near(f->places.seconds[0], 0, 0);
    assert_near(f->places.seconds[f->places.n_samples - 1], 2.5, 1e-6);
    read_well(f, "Wave", NULL);
    assert_true(largest_error(f, skinned_wave, 0, 1.6) < 1e-4 * diagonal());
}

static void straight_motion_needs_two_keys(void **state) {
    MeshFolder *f = *state;
    put_gltf(f, SKINNED_SOUND);
    read_well(f, "Slide", NULL);
    assert_int_equal(f->places.n_samples, 2);
    for (uint32_t i = 0; i < SKINNED_VERTICES; i++) {
        double p[3], rest[3];
        place_at(&f->places, 0.7, i, p);
        skinned_rest(i, rest);
        assert_near(p[0], rest[0], 1e-5);
        assert_near(p[2], rest[2] + 2 * 1.4, 1e-5);
    }
}

// Just before the second one begins the first one is at its end.
static void clips_follow_each_other(void **state) {
    MeshFolder *f = *state;
    put_gltf(f, SKINNED_SOUND);
    read_well(f, "Bend", "Wave");
    assert_true(largest_error(f, skinned_bend, 0, 2.4999) < 1e-4 * diagonal());
    assert_true(largest_error(f, skinned_wave, 2.5, 1.6) < 1e-4 * diagonal());
    double p[3], q[3];
    place_at(&f->places, nextafter(2.5, 0), SKINNED_VERTICES - 1, p);
    skinned_bend(SKINNED_VERTICES - 1, 2.5, q);
    assert_near(p[0], q[0], 1e-5);
    place_at(&f->places, 2.5, SKINNED_VERTICES - 1, p);
    skinned_wave(SKINNED_VERTICES - 1, 0, q);
    assert_near(p[0], q[0], 1e-5);
    read_well(f, "Wave", "Wave");
    assert_true(largest_error(f, skinned_wave, 1.5, 1.6) < 1e-4 * diagonal());
}

static void names_are_told(void **state) {
    MeshFolder *f = *state;
    put_gltf(f, SKINNED_SOUND);
    assert_int_equal(mesh_clips_list(&f->arena, f->path, &f->clips, f->message, 256), MESH_OK);
    assert_int_equal(f->clips.n, 3);
    assert_string_equal(f->clips.clip[0].name, "Bend");
    assert_near(f->clips.clip[0].seconds, 2.5, 1e-6);
    assert_string_equal(f->clips.clip[2].name, "Slide");
    assert_near(f->clips.clip[1].seconds, 1.5, 1e-6);
    assert_int_equal(read_two(f, "Bend", "Bent"), MESH_NO_CLIP);
    assert_string_equal(f->message, "it has no clip 'Bent'");
    assert_int_equal(f->clips.missing, 1);
    assert_int_equal(f->clips.n, 3);
    static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    mesh_folder_put(f, "a.obj", obj, strlen(obj));
    assert_int_equal(read_two(f, "Bend", NULL), MESH_NO_CLIP);
    assert_string_equal(f->message, "it has no clips");
    assert_int_equal(f->clips.n, 0);
    assert_int_equal(mesh_clips_list(&f->arena, "/nonexistent.glb", &f->clips, f->message, 256),
                     MESH_NO_FILE);
}

// ---- Wrong files

// A message, or places that are sound.
static void assert_sound(MeshFolder *f, MeshStatus status) {
    if (status != MESH_OK) {
        assert_true(f->message[0]);
        return;
    }
    const PointCache *c = &f->places;
    for (uint32_t k = 0; k < c->n_samples; k++) {
        assert_true(fabs(c->seconds[k]) <= DBL_MAX);
        assert_true(k == 0 || c->seconds[k] > c->seconds[k - 1]);
    }
    for (size_t i = 0; i < 3 * (size_t)c->n_points * c->n_samples; i++) {
        assert_true(fabsf(c->position[i]) <= FLT_MAX);
    }
}

static void wrong_files_are_refused(void **state) {
    static const char *const messages[SKINNED_KINDS] = {
        [SKINNED_NAN_TIME] = "do not ascend",
        [SKINNED_NAN_PLACE] = "a vertex is at no finite place",
        [SKINNED_HUGE_PLACE] = "a vertex is at no finite place",
        [SKINNED_BACKWARD] = "do not ascend",
        [SKINNED_MORPH] = "not supported yet: clips that move morph targets",
    };
    MeshFolder *f = *state;
    for (SkinnedKind kind = 0; kind < SKINNED_KINDS; kind++) {
        put_gltf(f, kind);
        MeshStatus status = read_two(f, "Bend", NULL);
        assert_sound(f, status);
        if (messages[kind] && !strstr(f->message, messages[kind])) {
            fail_msg("kind %d: status %d, '%s'", kind, status, f->message);
        }
        if (!messages[kind] && status != MESH_OK) {
            fail_msg("kind %d: status %d, '%s'", kind, status, f->message);
        }
        assert_int_equal(mesh_read(&f->arena, f->path, &f->mesh, f->message, 256), MESH_OK);
    }
}

// A bone that holds vertex 2000000000 of three.
static void bones_hold_no_vertices_that_are_not_there(void **state) {
    static const char text[] =
        "xof 0303txt 0032\nFrame Root { FrameTransformMatrix { 1;0;0;0;0;1;0;0;0;0;1;0;0;0;0;1;; "
        "}\n"
        "Frame Bone { FrameTransformMatrix { 1;0;0;0;0;1;0;0;0;0;1;0;0;0;0;1;; } }\n"
        "Mesh m { 3; 0;0;0;, 1;0;0;, 0;1;0;; 1; 3;0,1,2;;\n"
        "XSkinMeshHeader { 1; 1; 1; }\n"
        "SkinWeights { \"Bone\"; 2; 0, %s; 1, 1; 1;0;0;0;0;1;0;0;0;0;1;0;0;0;0;1;; } } }\n"
        "AnimationSet Go { Animation { { Bone } AnimationKey { 2; 2; 0;3;0;0;0;;, 4800;3;1;0;0;;; "
        "} } }\n";
    MeshFolder *f = *state;
    for (int i = 0; i < 2; i++) {
        char file[sizeof text + 16];
        snprintf(file, sizeof file, text, i ? "2000000000" : "1");
        mesh_folder_put(f, "a.x", file, strlen(file));
        MeshStatus status = read_two(f, "Go", NULL);
        assert_sound(f, status);
        if (i == 0 && status != MESH_OK) {
            fail_msg("%s", f->message);
        }
    }
}

static void damaged_clips_do_not_crash(void **state) {
    MeshFolder *f = *state;
    char *sound = skinned_gltf(SKINNED_SOUND);
    size_t n = strlen(sound);
    uint64_t seed = 7;
    for (int i = 0; i < 40; i++) {
        char *copy = malloc(n);
        memcpy(copy, sound, n);
        for (int k = 0; k <= i % 3; k++) {
            seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
            copy[(size_t)(seed >> 33) % n] = "0123456789-.,:\"[]{}eAz/"[(seed >> 20) % 23];
        }
        mesh_folder_put(f, "a.gltf", copy, n);
        assert_sound(f, read_two(f, "Bend", "Wave"));
        free(copy);
    }
    free(sound);
}

#define CLIP_TEST(name)                                                                            \
    cmocka_unit_test_setup_teardown(name, mesh_folder_set_up, mesh_folder_tear_down)

static const struct CMUnitTest tests[] = {
    CLIP_TEST(the_rest_is_what_bones_hold),
    CLIP_TEST(places_are_within_the_bound),
    CLIP_TEST(straight_motion_needs_two_keys),
    CLIP_TEST(clips_follow_each_other),
    CLIP_TEST(names_are_told),
    CLIP_TEST(wrong_files_are_refused),
    CLIP_TEST(bones_hold_no_vertices_that_are_not_there),
    CLIP_TEST(damaged_clips_do_not_crash),
};

SUITE(clips, tests)
