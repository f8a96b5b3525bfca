// SPDX-License-Identifier: Apache-2.0
// The nodes of a scene in a row, its vertices joined, their weights by vertex instead of by bone.
#include "render/mesh_skin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEPTH = 1000 };
static const uint32_t NONE = UINT32_MAX;

Affine skin_affine(const struct aiMatrix4x4 *a) {
    return (Affine){{{(double)a->a1, (double)a->a2, (double)a->a3, (double)a->a4},
                     {(double)a->b1, (double)a->b2, (double)a->b3, (double)a->b4},
                     {(double)a->c1, (double)a->c2, (double)a->c3, (double)a->c4}}};
}

// ---- Nodes

typedef struct {
    Arena *arena;
    const struct aiScene *scene;
    SkinNode *nodes;
    SkinPart *parts;
    size_t n_nodes, nodes_capacity, n_parts, parts_capacity;
} Walk;

// Points and lines have meshes of their own after sorting; they are left out.
static bool is_seen(const struct aiMesh *mesh) {
    return mesh->mPrimitiveTypes & aiPrimitiveType_TRIANGLE;
}

static void walk(Walk *w, const struct aiNode *node, uint32_t parent, int depth) {
    uint32_t at = (uint32_t)w->n_nodes;
    w->nodes = arena_grow(w->arena, w->nodes, w->n_nodes, &w->nodes_capacity, sizeof *w->nodes);
    w->nodes[w->n_nodes++] = (SkinNode){node, parent};
    for (unsigned i = 0; i < node->mNumMeshes; i++) {
        if (is_seen(w->scene->mMeshes[node->mMeshes[i]])) {
            w->parts =
                arena_grow(w->arena, w->parts, w->n_parts, &w->parts_capacity, sizeof *w->parts);
            w->parts[w->n_parts++] = (SkinPart){node->mMeshes[i], at};
        }
    }
    for (unsigned i = 0; i < node->mNumChildren && depth < DEPTH; i++) {
        walk(w, node->mChildren[i], at, depth + 1);
    }
}

typedef struct {
    const char *name;
    uint32_t node;
} NodeName;

static int name_compare(const void *a, const void *b) {
    const NodeName *x = a, *y = b;
    int order = strcmp(x->name, y->name);
    return order ? order : (x->node > y->node) - (x->node < y->node);
}

static const uint32_t *sort_names(Arena *arena, const SkinNode *nodes, uint32_t n) {
    Arena scratch = {0};
    NodeName *names = ARENA_ARRAY(&scratch, n, NodeName);
    uint32_t *sorted = ARENA_ARRAY(arena, n, uint32_t);
    for (uint32_t i = 0; i < n; i++) {
        names[i] = (NodeName){nodes[i].node->mName.data, i};
    }
    qsort(names, n, sizeof *names, name_compare);
    for (uint32_t i = 0; i < n; i++) {
        sorted[i] = names[i].node;
    }
    arena_free(&scratch);
    return sorted;
}

static const char *name_at(const Skin *skin, uint32_t k) {
    return skin->nodes[skin->by_name[k]].node->mName.data;
}

bool skin_find(const Skin *skin, const struct aiString *name, uint32_t *node, bool *is_known) {
    uint32_t lo = 0, hi = skin->n_nodes;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (strcmp(name_at(skin, mid), name->data) < 0) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    *is_known = lo < skin->n_nodes && strcmp(name_at(skin, lo), name->data) == 0;
    if (!*is_known || (lo + 1 < skin->n_nodes && strcmp(name_at(skin, lo + 1), name->data) == 0)) {
        return false;
    }
    *node = skin->by_name[lo];
    return true;
}

// ---- Weights

// Weights of no use are left out. What Assimp has checked is checked again.
static bool holds(const struct aiMesh *mesh, const struct aiVertexWeight *w) {
    return w->mVertexId < mesh->mNumVertices && w->mWeight > 0 && isfinite(w->mWeight);
}

// Each bone's node; false: one of them is lost, so that none of them counts.
static bool find_bones(Arena *arena, Skin *skin, SkinMesh *m) {
    m->bone_node = ARENA_ARRAY(arena, m->mesh->mNumBones, uint32_t);
    for (uint32_t b = 0; b < m->mesh->mNumBones; b++) {
        const struct aiBone *bone = m->mesh->mBones[b];
        bool is_known, is_used = false;
        for (unsigned i = 0; i < bone->mNumWeights && !is_used; i++) {
            is_used = holds(m->mesh, &bone->mWeights[i]);
        }
        if (!skin_find(skin, &bone->mName, &m->bone_node[b], &is_known) && is_used) {
            skin->lost_bone = bone->mName.data;
            return false;
        }
    }
    m->n_bones = m->mesh->mNumBones;
    return true;
}

// By vertex of the mesh: first[mNumVertices + 1].
static void gather_weights(Arena *arena, SkinMesh *m) {
    size_t n = m->mesh->mNumVertices;
    uint32_t *first = ARENA_ARRAY(arena, n + 2, uint32_t);
    for (uint32_t b = 0; b < m->n_bones; b++) {
        const struct aiBone *bone = m->mesh->mBones[b];
        for (unsigned i = 0; i < bone->mNumWeights; i++) {
            if (holds(m->mesh, &bone->mWeights[i])) {
                first[bone->mWeights[i].mVertexId + 2]++;
            }
        }
    }
    for (size_t i = 2; i < n + 2; i++) {
        first[i] += first[i - 1];
    }
    SkinWeight *weights = ARENA_ARRAY(arena, first[n + 1], SkinWeight);
    for (uint32_t b = 0; b < m->n_bones; b++) {
        const struct aiBone *bone = m->mesh->mBones[b];
        for (unsigned i = 0; i < bone->mNumWeights; i++) {
            if (holds(m->mesh, &bone->mWeights[i])) {
                weights[first[bone->mWeights[i].mVertexId + 1]++] =
                    (SkinWeight){b, bone->mWeights[i].mWeight};
            }
        }
    }
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint32_t k = first[i]; k < first[i + 1]; k++) {
            sum += (double)weights[k].weight;
        }
        for (uint32_t k = first[i]; k < first[i + 1]; k++) {
            weights[k].weight = (float)((double)weights[k].weight / sum);
        }
    }
    m->first = first;
    m->weights = weights;
}

// ---- Joining

typedef struct {
    const SkinMesh *m;
    uint32_t *slots; // points + 1; a power of two of them
    size_t mask;
    uint32_t *point, *joined, n;
} Joining;

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t n) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i < n; i++) {
        hash = (hash ^ at[i]) * 0x100000001b3u;
    }
    return hash;
}

static uint32_t n_weights(const SkinMesh *m, uint32_t v) {
    return m->n_bones ? m->first[v + 1] - m->first[v] : 0;
}

static uint64_t hash_vertex(const SkinMesh *m, uint32_t v) {
    const struct aiMesh *mesh = m->mesh;
    uint64_t hash = hash_bytes(0xcbf29ce484222325u, &mesh->mVertices[v], sizeof *mesh->mVertices);
    if (mesh->mNormals) {
        hash = hash_bytes(hash, &mesh->mNormals[v], sizeof *mesh->mNormals);
    }
    if (mesh->mTextureCoords[0]) {
        hash = hash_bytes(hash, &mesh->mTextureCoords[0][v], sizeof *mesh->mVertices);
    }
    if (n_weights(m, v)) {
        hash = hash_bytes(hash, &m->weights[m->first[v]], n_weights(m, v) * sizeof *m->weights);
    }
    return hash ^ hash >> 32;
}

static bool same(const struct aiVector3D *vectors, uint32_t a, uint32_t b) {
    return !vectors || memcmp(&vectors[a], &vectors[b], sizeof *vectors) == 0;
}

static bool are_alike(const SkinMesh *m, uint32_t a, uint32_t b) {
    return same(m->mesh->mVertices, a, b) && same(m->mesh->mNormals, a, b) &&
           same(m->mesh->mTextureCoords[0], a, b) && n_weights(m, a) == n_weights(m, b) &&
           (!n_weights(m, a) || memcmp(&m->weights[m->first[a]], &m->weights[m->first[b]],
                                       n_weights(m, a) * sizeof *m->weights) == 0);
}

static void join_vertex(Joining *j, uint32_t v) {
    for (size_t slot = hash_vertex(j->m, v) & j->mask;; slot = (slot + 1) & j->mask) {
        uint32_t at = j->slots[slot];
        if (at == 0) {
            j->joined[v] = j->n;
            j->point[j->n] = v;
            j->slots[slot] = ++j->n;
            return;
        }
        if (are_alike(j->m, j->point[at - 1], v)) {
            j->joined[v] = at - 1;
            return;
        }
    }
}

// The weights of the points instead of those of the vertices.
static void move_weights(Arena *arena, SkinMesh *m) {
    uint32_t *first = ARENA_ARRAY(arena, (size_t)m->n_points + 1, uint32_t);
    for (uint32_t p = 0; p < m->n_points; p++) {
        first[p + 1] = first[p] + n_weights(m, m->point[p]);
    }
    SkinWeight *weights = ARENA_ARRAY(arena, first[m->n_points], SkinWeight);
    for (uint32_t p = 0; p < m->n_points; p++) {
        for (uint32_t k = 0; k < n_weights(m, m->point[p]); k++) {
            weights[first[p] + k] = m->weights[m->first[m->point[p]] + k];
        }
    }
    m->first = first;
    m->weights = weights;
}

// Points come in the order of the vertices; those that no face has are left out.
static void join(Arena *arena, SkinMesh *m) {
    const struct aiMesh *mesh = m->mesh;
    Arena scratch = {0};
    size_t n = mesh->mNumVertices, n_slots = 16;
    while (n_slots < 2 * n) {
        n_slots *= 2;
    }
    Joining j = {m,
                 ARENA_ARRAY(&scratch, n_slots, uint32_t),
                 n_slots - 1,
                 ARENA_ARRAY(arena, n, uint32_t),
                 ARENA_ARRAY(arena, n, uint32_t),
                 0};
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *f = &mesh->mFaces[i];
        for (unsigned k = 0; f->mNumIndices == 3 && k < 3; k++) {
            j.joined[f->mIndices[k]] = NONE;
        }
    }
    for (uint32_t v = 0; v < n; v++) {
        if (j.joined[v] == NONE) {
            join_vertex(&j, v);
        }
    }
    arena_free(&scratch);
    m->n_points = j.n;
    m->point = j.point;
    m->joined = j.joined;
    if (m->n_bones) {
        move_weights(arena, m);
    }
}

// ---- The whole

static void add_mesh(Arena *arena, Skin *skin, uint32_t i, bool joins) {
    SkinMesh *m = &skin->meshes[i];
    *m = (SkinMesh){.mesh = skin->scene->mMeshes[i], .first_bone = skin->n_bones};
    if (!is_seen(m->mesh)) {
        return;
    }
    m->n_points = m->mesh->mNumVertices;
    if (m->mesh->mNumBones && find_bones(arena, skin, m)) {
        gather_weights(arena, m);
        skin->n_bones += m->n_bones;
    }
    if (joins) {
        join(arena, m);
    }
}

Skin *skin_new(Arena *arena, const struct aiScene *scene, bool joins) {
    Walk w = {.arena = arena, .scene = scene};
    walk(&w, scene->mRootNode, 0, 0);
    Skin *skin = ARENA_NEW(arena, Skin);
    *skin = (Skin){.scene = scene,
                   .nodes = w.nodes,
                   .by_name = sort_names(arena, w.nodes, (uint32_t)w.n_nodes),
                   .meshes = ARENA_ARRAY(arena, scene->mNumMeshes, SkinMesh),
                   .parts = w.parts,
                   .n_nodes = (uint32_t)w.n_nodes,
                   .n_parts = (uint32_t)w.n_parts};
    for (uint32_t i = 0; i < scene->mNumMeshes; i++) {
        add_mesh(arena, skin, i, joins);
    }
    for (uint32_t i = 0; i < skin->n_parts; i++) {
        skin->n_points += skin->meshes[skin->parts[i].mesh].n_points;
    }
    return skin;
}

// ---- Poses

SkinPose skin_pose_new(Arena *arena, const Skin *skin) {
    return (SkinPose){ARENA_ARRAY(arena, skin->n_nodes, Affine),
                      ARENA_ARRAY(arena, skin->n_bones, Affine)};
}

void skin_pose_set(const Skin *skin, const Affine *local, SkinPose *pose) {
    for (uint32_t i = 0; i < skin->n_nodes; i++) {
        const SkinNode *n = &skin->nodes[i];
        Affine own = local ? local[i] : skin_affine(&n->node->mTransformation);
        pose->node[i] = i ? affine_mul(&pose->node[n->parent], &own) : own;
    }
    for (uint32_t i = 0; i < skin->scene->mNumMeshes; i++) {
        const SkinMesh *m = &skin->meshes[i];
        for (uint32_t b = 0; b < m->n_bones; b++) {
            Affine offset = skin_affine(&m->mesh->mBones[b]->mOffsetMatrix);
            pose->bone[m->first_bone + b] = affine_mul(&pose->node[m->bone_node[b]], &offset);
        }
    }
}

const Affine *skin_map(const Skin *skin, const SkinPose *pose, SkinPart part, uint32_t point,
                       Affine *blend) {
    const SkinMesh *m = &skin->meshes[part.mesh];
    uint32_t first = m->n_bones ? m->first[point] : 0, end = m->n_bones ? m->first[point + 1] : 0;
    if (first == end) {
        return &pose->node[part.node];
    }
    *blend = (Affine){{{0}}};
    for (uint32_t k = first; k < end; k++) {
        const Affine *bone = &pose->bone[m->first_bone + m->weights[k].bone];
        double w = (double)m->weights[k].weight;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 4; j++) {
                blend->m[i][j] += w * bone->m[i][j];
            }
        }
    }
    return blend;
}

// Maps the point by each bone, which is less work than adding up their maps.
static Vec3 place_held(const SkinMesh *m, const SkinPose *pose, uint32_t point, Vec3 v) {
    Vec3 sum = {0, 0, 0};
    for (uint32_t k = m->first[point]; k < m->first[point + 1]; k++) {
        const Affine *bone = &pose->bone[m->first_bone + m->weights[k].bone];
        sum = vec3_madd(sum, (double)m->weights[k].weight, affine_point(bone, v));
    }
    return sum;
}

void skin_place(const Skin *skin, const SkinPose *pose, Vec3 *xyz) {
    for (uint32_t i = 0; i < skin->n_parts; i++) {
        const SkinMesh *m = &skin->meshes[skin->parts[i].mesh];
        for (uint32_t p = 0; p < m->n_points; p++) {
            const struct aiVector3D *at = &m->mesh->mVertices[skin_vertex(m, p)];
            Vec3 v = vec3((double)at->x, (double)at->y, (double)at->z);
            bool is_held = m->n_bones && m->first[p] < m->first[p + 1];
            *xyz++ = is_held ? place_held(m, pose, p, v)
                             : affine_point(&pose->node[skin->parts[i].node], v);
        }
    }
}
