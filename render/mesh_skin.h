// SPDX-License-Identifier: Apache-2.0
// A scene of Assimp as points that follow its nodes: rigidly, or blended by the weights of bones
// (linear blend skinning: N. Magnenat-Thalmann, R. Laperriere and D. Thalmann, "Joint-dependent
// local deformations for hand animation and object grasping", Graphics Interface 1988). Part of
// st4-assimp.so.
//
// Node i hangs on a node before it. Parts are in the order of the tree, and so are their points.
#ifndef RENDER_MESH_SKIN_H
#define RENDER_MESH_SKIN_H

#include <assimp/scene.h>
#include <stdbool.h>
#include <stdint.h>

#include "accel/arena.h"
#include "accel/vec.h"

typedef struct {
    const struct aiNode *node;
    uint32_t parent; // of the root: 0
} SkinNode;

typedef struct {
    uint32_t bone; // of the mesh
    float weight;  // > 0; those of a point add up to 1
} SkinWeight;

// Bones hold points only where all of them are known nodes.
typedef struct {
    const struct aiMesh *mesh;
    uint32_t n_points;      // 0: nothing of it is seen
    const uint32_t *point;  // [n_points] which of the mesh's vertices it is; NULL: the same
    const uint32_t *joined; // [mesh->mNumVertices] which point that one became; NULL: the same
    uint32_t n_bones;       // 0: the points follow the node of the part
    uint32_t first_bone;    // in SkinPose
    uint32_t *bone_node;    // [n_bones]
    const uint32_t *first; // [n_points + 1] of weights; a point without any follows the part's node
    const SkinWeight *weights;
} SkinMesh;

typedef struct {
    uint32_t mesh, node;
} SkinPart;

typedef struct {
    const struct aiScene *scene;
    const SkinNode *nodes;
    const uint32_t *by_name; // [n_nodes] nodes in the order of their names
    SkinMesh *meshes;        // [scene->mNumMeshes]
    const SkinPart *parts;
    uint32_t n_nodes, n_parts, n_bones;
    uint64_t n_points;     // of all parts
    const char *lost_bone; // a bone whose name is that of no node, or of several; NULL: none
} Skin;

typedef struct {
    Affine *node; // [n_nodes] to the world
    Affine *bone; // [n_bones] from the mesh's space to the world
} SkinPose;

// joins: points that are alike in all respects, their weights too, become one (Assimp's own way
// looks at no weights). Faces that are no triangles are not there.
Skin *skin_new(Arena *arena, const struct aiScene *scene, bool joins);

SkinPose skin_pose_new(Arena *arena, const Skin *skin);

// local: [n_nodes] to the node above; NULL: what the file gives them.
void skin_pose_set(const Skin *skin, const Affine *local, SkinPose *pose);

// What moves a point of a part; *blend has room for it.
const Affine *skin_map(const Skin *skin, const SkinPose *pose, SkinPart part, uint32_t point,
                       Affine *blend);

// The points of all parts: xyz[skin->n_points].
void skin_place(const Skin *skin, const SkinPose *pose, Vec3 *xyz);

// The only node of that name; false: there are none or several, *is_known says which.
bool skin_find(const Skin *skin, const struct aiString *name, uint32_t *node, bool *is_known);

Affine skin_affine(const struct aiMatrix4x4 *matrix);

static inline uint32_t skin_vertex(const SkinMesh *mesh, uint32_t point) {
    return mesh->point ? mesh->point[point] : point;
}

#endif
