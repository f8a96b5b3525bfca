// SPDX-License-Identifier: Apache-2.0
// Whole worlds for the stability tests: built with every structure, asked, and compared with all
// their triangles, flattened: put into the world in long double.
#ifndef TESTS_STABILITY_WORLDS_H
#define TESTS_STABILITY_WORLDS_H

#include "render/world.h"
#include "tests/hand_scene.h"
#include "tests/stability/oracle.h"

typedef struct {
    const char *structure, *cpu;
    World *world;
} BuiltWorld;

typedef struct {
    BuiltWorld at[MAX_SUBJECTS];
    int n;
    double fps;
    char label[160];
} Worlds;

// Of the frames first to first + n - 1, with each structure on each instruction set; those that are
// slow only if with_slow.
void worlds_build(Run *run, Worlds *worlds, const Scene *scene, int64_t first, uint32_t n,
                  bool with_slow, const char *label);
void worlds_free(Worlds *worlds);

// A view of each world, for one thread.
typedef struct {
    WorldView *at[MAX_SUBJECTS];
} WorldViews;

WorldViews views_new(const Worlds *worlds);
void views_free(const Worlds *worlds, WorldViews *views);

// One object of the world as it stands at an instant.
typedef struct {
    const Mesh *mesh;
    Affine map;
    double slack; // metres: how far it may be off, besides what float kernels round
} Flat;

// All worlds must give the same hit, and one that the flattened objects allow: object i is flat[i],
// and all meshes have the same number of triangles. *hit gets it; true: something is hit.
bool worlds_check(Run *run, const Worlds *worlds, WorldViews *views, Instant at, Vec3 origin,
                  Vec3 dir, double tmax, const Flat *flat, uint32_t n_flat, uint32_t first_object,
                  uint64_t index, WorldHit *hit);

// A rotation, times `scale` by axis (mirrored: the third negative), then a shift.
Affine random_placement(uint64_t *random, double scale, bool is_mirrored, Vec3 to);

#endif
