// SPDX-License-Identifier: Apache-2.0
// The forty formats of Assimp, as one triangle mesh: all nodes of the file's tree in their places.
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

enum { BUFFER = 1 << 16, DEPTH = 1000 };

// The tree is walked once for the counts and once for each array, so that nothing is collected in
// memory beside what Assimp holds.
typedef enum { PASS_COUNT, PASS_POSITION, PASS_NORMAL, PASS_UV, PASS_INDEX } Pass;

typedef struct {
    const struct aiScene *scene;
    MeshStream header;
    Pass pass;
    uint64_t base; // of the indices of the present mesh
    int fd;
    bool failed;
    size_t used;
    char buffer[BUFFER];
} Sender;

typedef struct {
    double m[3][4];
} Affine;

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

// n is small.
static void send(Sender *s, const void *bytes, size_t n) {
    if (s->used + n > BUFFER) {
        flush(s);
    }
    memcpy(s->buffer + s->used, bytes, n);
    s->used += n;
}

static Affine affine_of(const struct aiMatrix4x4 *a) {
    return (Affine){{{(double)a->a1, (double)a->a2, (double)a->a3, (double)a->a4},
                     {(double)a->b1, (double)a->b2, (double)a->b3, (double)a->b4},
                     {(double)a->c1, (double)a->c2, (double)a->c3, (double)a->c4}}};
}

static Affine affine_compose(const Affine *a, const Affine *b) {
    Affine c;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            c.m[i][j] = j == 3 ? a->m[i][3] : 0;
            for (int k = 0; k < 3; k++) {
                c.m[i][j] += a->m[i][k] * b->m[k][j];
            }
        }
    }
    return c;
}

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

static void send_positions(Sender *s, const struct aiMesh *mesh, const Affine *a) {
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const struct aiVector3D *v = &mesh->mVertices[i];
        double p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = a->m[k][0] * (double)v->x + a->m[k][1] * (double)v->y +
                   a->m[k][2] * (double)v->z + a->m[k][3];
        }
        send(s, p, sizeof p);
    }
}

static void send_normals(Sender *s, const struct aiMesh *mesh, const Affine *a) {
    double c[3][3], sign = cofactors(a, c) < 0 ? -1 : 1;
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const struct aiVector3D *v = &mesh->mNormals[i];
        double q[3], square = 0;
        for (int k = 0; k < 3; k++) {
            q[k] = c[k][0] * (double)v->x + c[k][1] * (double)v->y + c[k][2] * (double)v->z;
            square += q[k] * q[k];
        }
        double scale = square > 0 ? sign / sqrt(square) : 0;
        float unit[3] = {(float)(q[0] * scale), (float)(q[1] * scale), (float)(q[2] * scale)};
        send(s, unit, sizeof unit);
    }
}

static void send_uvs(Sender *s, const struct aiMesh *mesh) {
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const struct aiVector3D *v = &mesh->mTextureCoords[0][i];
        float uv[2] = {v->x, v->y};
        send(s, uv, sizeof uv);
    }
}

// A mirroring transform turns the order of the corners round, so it is turned back.
static void send_triangles(Sender *s, const struct aiMesh *mesh, const Affine *a) {
    double c[3][3];
    bool is_mirrored = cofactors(a, c) < 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *f = &mesh->mFaces[i];
        if (f->mNumIndices == 3) {
            uint32_t base = (uint32_t)s->base;
            uint32_t t[3] = {base + f->mIndices[0], base + f->mIndices[is_mirrored ? 2 : 1],
                             base + f->mIndices[is_mirrored ? 1 : 2]};
            send(s, t, sizeof t);
        }
    }
    s->base += mesh->mNumVertices;
}

static void count(Sender *s, const struct aiMesh *mesh) {
    s->header.n_vertices += mesh->mNumVertices;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        s->header.n_triangles += mesh->mFaces[i].mNumIndices == 3;
    }
    s->header.has_normal &= mesh->mNormals != NULL;
    s->header.has_uv &= mesh->mTextureCoords[0] != NULL;
}

static void visit_mesh(Sender *s, const struct aiMesh *mesh, const Affine *a) {
    switch (s->pass) {
    case PASS_COUNT:
        count(s, mesh);
        break;
    case PASS_POSITION:
        send_positions(s, mesh, a);
        break;
    case PASS_NORMAL:
        send_normals(s, mesh, a);
        break;
    case PASS_UV:
        send_uvs(s, mesh);
        break;
    case PASS_INDEX:
        send_triangles(s, mesh, a);
        break;
    }
}

static void visit_node(Sender *s, const struct aiNode *node, const Affine *parent, int depth) {
    Affine own = affine_of(&node->mTransformation), a = affine_compose(parent, &own);
    for (unsigned i = 0; i < node->mNumMeshes && !s->failed; i++) {
        const struct aiMesh *mesh = s->scene->mMeshes[node->mMeshes[i]];
        // Points and lines have meshes of their own after sorting; they are left out.
        if (mesh->mPrimitiveTypes & aiPrimitiveType_TRIANGLE) {
            visit_mesh(s, mesh, &a);
        }
    }
    for (unsigned i = 0; i < node->mNumChildren && depth < DEPTH && !s->failed; i++) {
        visit_node(s, node->mChildren[i], &a, depth + 1);
    }
}

static void run(Sender *s, Pass pass) {
    static const Affine identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    s->pass = pass;
    visit_node(s, s->scene->mRootNode, &identity, 0);
}

static void refuse(Sender *s, MeshStatus status, const char *sentence) {
    s->header = (MeshStream){.magic = MESH_STREAM_MAGIC, .status = status};
    snprintf(s->header.message, sizeof s->header.message, "%.200s", sentence);
    send(s, &s->header, sizeof s->header);
}

// Assimp's sentence, but for those that need the file's name or the library's terms.
static void refuse_import(Sender *s, const char *why) {
    if (strstr(why, "alloc")) {
        refuse(s, MESH_TOO_LARGE, "it needs more memory than the reader is allowed");
    } else if (strstr(why, "No suitable reader")) {
        refuse(s, MESH_BAD_FORMAT, "no reader knows this kind of file");
    } else {
        refuse(s, MESH_BAD_FORMAT, why[0] ? why : "damaged, or of no known kind");
    }
}

static void send_scene(Sender *s) {
    s->header = (MeshStream){.magic = MESH_STREAM_MAGIC, .has_normal = 1, .has_uv = 1};
    run(s, PASS_COUNT);
    if (s->header.n_vertices >> 31 || s->header.n_triangles >> 31) {
        refuse(s, MESH_TOO_LARGE, "it has more than 2^31 vertices or triangles");
        return;
    }
    send(s, &s->header, sizeof s->header);
    run(s, PASS_POSITION);
    if (s->header.has_normal) {
        run(s, PASS_NORMAL);
    }
    if (s->header.has_uv) {
        run(s, PASS_UV);
    }
    run(s, PASS_INDEX);
}

int mesh_assimp_send(const char *path, int fd) {
    Sender *s = calloc(1, sizeof *s);
    if (!s) {
        return 0;
    }
    s->fd = fd;
    s->scene = aiImportFile(path, aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                                      aiProcess_SortByPType | aiProcess_ValidateDataStructure);
    if (!s->scene || !s->scene->mRootNode) {
        refuse_import(s, aiGetErrorString());
    } else {
        send_scene(s);
    }
    flush(s);
    int done = !s->failed;
    if (s->scene) {
        aiReleaseImport(s->scene);
    }
    free(s);
    return done;
}
