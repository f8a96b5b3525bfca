// SPDX-License-Identifier: Apache-2.0
// The forty formats of Assimp, as one triangle mesh: all nodes of the file's tree in their places,
// and what has bones where these hold it. Its clips, as places of the mesh's vertices over time.
#include "render/mesh_assimp.h"

#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/mesh.h"
#include "render/mesh_keys.h"
#include "render/mesh_motion.h"
#include "render/mesh_skin.h"

enum { BUFFER = 1 << 16 };

typedef struct {
    int fd;
    bool failed;
    size_t used;
    char buffer[BUFFER];
} Sender;

static void flush(Sender *s) {
    size_t done = 0;
    while (done < s->used && !s->failed) {
        ssize_t put = write(s->fd, s->buffer + done, s->used - done);
        if (put > 0) {
            done += (size_t)put;
        } else if (put == 0 || errno != EINTR) {
            s->failed = true;
        }
    }
    s->used = 0;
}

static void send(Sender *s, const void *bytes, size_t n) {
    const char *at = bytes;
    while (n > 0 && !s->failed) {
        size_t room = BUFFER - s->used, part = n < room ? n : room;
        memcpy(s->buffer + s->used, at, part);
        s->used += part;
        at += part;
        n -= part;
        if (s->used == BUFFER) {
            flush(s);
        }
    }
}

// ---- The mesh

// Of the linear part; the rows of cofactors transform normals, up to their length.
static double cofactors(const Affine *a, double c[3][3]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            c[i][j] = a->m[i1][j1] * a->m[i2][j2] - a->m[i1][j2] * a->m[i2][j1];
        }
    }
    return a->m[0][0] * c[0][0] + a->m[0][1] * c[0][1] + a->m[0][2] * c[0][2];
}

// At rest: what moves the points, part by part.
typedef struct {
    const Skin *skin;
    SkinPose pose;
} Rest;

static void send_positions(Sender *s, const Rest *rest, SkinPart part) {
    const SkinMesh *m = &rest->skin->meshes[part.mesh];
    for (uint32_t i = 0; i < m->n_points; i++) {
        const struct aiVector3D *v = &m->mesh->mVertices[skin_vertex(m, i)];
        Affine blend;
        Vec3 p = affine_point(skin_map(rest->skin, &rest->pose, part, i, &blend),
                              vec3((double)v->x, (double)v->y, (double)v->z));
        send(s, (double[3]){p.x, p.y, p.z}, 3 * sizeof(double));
    }
}

static void send_normals(Sender *s, const Rest *rest, SkinPart part) {
    const SkinMesh *m = &rest->skin->meshes[part.mesh];
    for (uint32_t i = 0; i < m->n_points; i++) {
        const struct aiVector3D *v = &m->mesh->mNormals[skin_vertex(m, i)];
        Affine blend;
        double c[3][3], q[3], square = 0;
        double sign = cofactors(skin_map(rest->skin, &rest->pose, part, i, &blend), c) < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++) {
            q[k] = c[k][0] * (double)v->x + c[k][1] * (double)v->y + c[k][2] * (double)v->z;
            square += q[k] * q[k];
        }
        double scale = square > 0 ? sign / sqrt(square) : 0;
        float unit[3] = {(float)(q[0] * scale), (float)(q[1] * scale), (float)(q[2] * scale)};
        send(s, unit, sizeof unit);
    }
}

static void send_uvs(Sender *s, const Rest *rest, SkinPart part) {
    const SkinMesh *m = &rest->skin->meshes[part.mesh];
    for (uint32_t i = 0; i < m->n_points; i++) {
        const struct aiVector3D *v = &m->mesh->mTextureCoords[0][skin_vertex(m, i)];
        send(s, (float[2]){v->x, v->y}, 2 * sizeof(float));
    }
}

// A mirroring transform turns the order of the corners round, so it is turned back. base: of the
// part's points.
static void send_triangles(Sender *s, const Rest *rest, SkinPart part, uint32_t base) {
    const SkinMesh *m = &rest->skin->meshes[part.mesh];
    for (unsigned i = 0; i < m->mesh->mNumFaces; i++) {
        const struct aiFace *f = &m->mesh->mFaces[i];
        if (f->mNumIndices != 3) {
            continue;
        }
        uint32_t t[3];
        Affine blend;
        for (int k = 0; k < 3; k++) {
            t[k] = m->joined ? m->joined[f->mIndices[k]] : f->mIndices[k];
        }
        bool is_mirrored = affine_det(skin_map(rest->skin, &rest->pose, part, t[0], &blend)) < 0;
        uint32_t turned[3] = {base + t[0], base + t[is_mirrored ? 2 : 1],
                              base + t[is_mirrored ? 1 : 2]};
        send(s, turned, sizeof turned);
    }
}

static void count(const Skin *skin, MeshStream *head) {
    *head = (MeshStream){
        .magic = MESH_STREAM_MAGIC, .n_vertices = skin->n_points, .has_normal = 1, .has_uv = 1};
    for (uint32_t i = 0; i < skin->n_parts; i++) {
        const struct aiMesh *mesh = skin->meshes[skin->parts[i].mesh].mesh;
        for (unsigned k = 0; k < mesh->mNumFaces; k++) {
            head->n_triangles += mesh->mFaces[k].mNumIndices == 3;
        }
        head->has_normal &= mesh->mNormals != NULL;
        head->has_uv &= mesh->mTextureCoords[0] != NULL;
    }
}

static void refuse(Sender *s, MeshStatus status, const char *sentence) {
    MeshStream head = {.magic = MESH_STREAM_MAGIC, .status = status};
    snprintf(head.message, sizeof head.message, "%.200s", sentence);
    send(s, &head, sizeof head);
}

static void send_mesh(Sender *s, Arena *arena, const Skin *skin) {
    Rest rest = {skin, skin_pose_new(arena, skin)};
    MeshStream head;
    uint32_t base = 0;
    skin_pose_set(skin, NULL, &rest.pose);
    count(skin, &head);
    if (head.n_vertices >> 31 || head.n_triangles >> 31) {
        refuse(s, MESH_TOO_LARGE, "it has more than 2^31 vertices or triangles");
        return;
    }
    send(s, &head, sizeof head);
    for (uint32_t i = 0; i < skin->n_parts; i++) {
        send_positions(s, &rest, skin->parts[i]);
    }
    for (uint32_t i = 0; head.has_normal && i < skin->n_parts; i++) {
        send_normals(s, &rest, skin->parts[i]);
    }
    for (uint32_t i = 0; head.has_uv && i < skin->n_parts; i++) {
        send_uvs(s, &rest, skin->parts[i]);
    }
    for (uint32_t i = 0; i < skin->n_parts; i++) {
        send_triangles(s, &rest, skin->parts[i], base);
        base += skin->meshes[skin->parts[i].mesh].n_points;
    }
}

// ---- Clips

static void send_clip_head(Sender *s, const struct aiScene *scene, ClipStream *head) {
    head->magic = CLIP_STREAM_MAGIC;
    head->n_clips = scene ? scene->mNumAnimations : 0;
    head->n_clips = head->n_clips < CLIP_STREAM_NAMES ? head->n_clips : CLIP_STREAM_NAMES;
    send(s, head, sizeof *head);
    for (uint32_t i = 0; i < head->n_clips; i++) {
        const struct aiAnimation *animation = scene->mAnimations[i];
        ClipName name = {.seconds = motion_seconds(animation)};
        snprintf(name.name, sizeof name.name, "%.119s", animation->mName.data);
        send(s, &name, sizeof name);
    }
}

static void refuse_clips(Sender *s, const struct aiScene *scene, MeshStatus status,
                         const char *sentence) {
    ClipStream head = {.status = status};
    snprintf(head.message, sizeof head.message, "%.200s", sentence);
    send_clip_head(s, scene, &head);
}

// The first of that name; NULL: none.
static const struct aiAnimation *find_clip(const struct aiScene *scene, const char *name) {
    for (unsigned i = 0; i < scene->mNumAnimations; i++) {
        if (strcmp(scene->mAnimations[i]->mName.data, name) == 0) {
            return scene->mAnimations[i];
        }
    }
    return NULL;
}

// The motions that are asked for. False: refused.
static bool find_motions(Sender *s, Arena *arena, const Skin *skin, const ClipQuery *query,
                         Motion *motions) {
    char message[MESH_STREAM_MESSAGE];
    for (uint32_t i = 0; i < query->n_names; i++) {
        const struct aiAnimation *animation = find_clip(skin->scene, query->names[i]);
        if (!animation) {
            ClipStream head = {.status = MESH_NO_CLIP, .missing = i};
            snprintf(head.message, sizeof head.message, "it has no clip '%.150s'", query->names[i]);
            send_clip_head(s, skin->scene, &head);
            return false;
        }
        if (!motion_new(arena, skin, animation, &motions[i], message, sizeof message)) {
            refuse_clips(s, skin->scene, MESH_BAD_FORMAT, message);
            return false;
        }
    }
    return true;
}

static void send_clips(Sender *s, Arena *arena, const Skin *skin, const ClipQuery *query) {
    Motion *motions = ARENA_ARRAY(arena, query->n_names, Motion);
    char message[MESH_STREAM_MESSAGE];
    Keys keys = {0};
    if (skin->n_points >> 31) {
        refuse_clips(s, skin->scene, MESH_TOO_LARGE, "it has more than 2^31 vertices");
        return;
    }
    if (!find_motions(s, arena, skin, query, motions)) {
        return;
    }
    if (query->n_names > 0 &&
        !keys_find(arena, skin, motions, query->n_names, &keys, message, sizeof message)) {
        refuse_clips(s, skin->scene, MESH_TOO_LARGE, message);
        return;
    }
    ClipStream head = {.n_points = skin->n_points, .n_keys = (uint32_t)keys.n};
    send_clip_head(s, skin->scene, &head);
    send(s, keys.seconds, keys.n * sizeof *keys.seconds);
    for (size_t i = 0; i < keys.n; i++) {
        send(s, keys.xyz[i], 3 * (size_t)skin->n_points * sizeof(float));
    }
}

// ---- The doors

// What an arena calls that gets no memory: nothing has been sent by then.
static Sender *exhausted_sender;
static bool exhausted_clips;

static void exhausted(size_t wanted, size_t limit) {
    static const char sentence[] = "it needs more memory than the reader is allowed";
    (void)wanted;
    (void)limit;
    if (exhausted_clips) {
        refuse_clips(exhausted_sender, NULL, MESH_TOO_LARGE, sentence);
    } else {
        refuse(exhausted_sender, MESH_TOO_LARGE, sentence);
    }
    flush(exhausted_sender);
    _exit(0);
}

// Vertices are joined by Assimp, whose way is to look at all that they have but their weights:
// where there are bones, *joins is left to be done.
static const struct aiScene *import(const char *path, bool *joins) {
    const struct aiScene *scene = aiImportFile(path, aiProcess_Triangulate | aiProcess_SortByPType |
                                                         aiProcess_ValidateDataStructure);
    *joins = false;
    for (unsigned i = 0; scene && i < scene->mNumMeshes; i++) {
        *joins = *joins || scene->mMeshes[i]->mNumBones > 0;
    }
    if (scene && !*joins) {
        scene = aiApplyPostProcessing(scene, aiProcess_JoinIdenticalVertices);
    }
    return scene && scene->mRootNode ? scene : NULL;
}

// Assimp's sentence, but for those that need the file's name or the library's terms.
static const char *why_not(MeshStatus *status) {
    const char *why = aiGetErrorString();
    *status = MESH_BAD_FORMAT;
    if (strstr(why, "alloc")) {
        *status = MESH_TOO_LARGE;
        return "it needs more memory than the reader is allowed";
    }
    if (strstr(why, "No suitable reader")) {
        return "no reader knows this kind of file";
    }
    return why[0] ? why : "damaged, or of no known kind";
}

static int answer(const char *path, const ClipQuery *query, int fd) {
    Sender *s = calloc(1, sizeof *s);
    Arena arena = {0};
    MeshStatus status;
    bool joins;
    if (!s) {
        return 0;
    }
    s->fd = fd;
    exhausted_sender = s;
    exhausted_clips = query != NULL;
    arena_on_exhausted(exhausted);
    const struct aiScene *scene = import(path, &joins);
    const char *why = scene ? NULL : why_not(&status);
    if (why && query) {
        refuse_clips(s, NULL, status, why);
    } else if (why) {
        refuse(s, status, why);
    } else {
        const Skin *skin = skin_new(&arena, scene, joins);
        if (query) {
            send_clips(s, &arena, skin, query);
        } else {
            send_mesh(s, &arena, skin);
        }
        aiReleaseImport(scene);
    }
    flush(s);
    int done = !s->failed;
    arena_free(&arena);
    free(s);
    return done;
}

int mesh_assimp_send(const char *path, int fd) {
    return answer(path, NULL, fd);
}

int mesh_assimp_send_clips(const ClipQuery *query, int fd) {
    return answer(query->path, query, fd);
}
