// SPDX-License-Identifier: Apache-2.0
// Clips from a child process: nothing that it sends is believed before it is checked.
#include "render/mesh_clips.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "render/infile.h"
#include "render/mesh_assimp.h"
#include "render/mesh_build.h"
#include "render/mesh_child.h"

// ---- In the child

static void run(const void *query, int fd) {
    ClipStream refusal = {.magic = CLIP_STREAM_MAGIC, .status = MESH_BAD_FORMAT};
    void *symbol = mesh_child_symbol("mesh_assimp_send_clips", fd, &refusal, sizeof refusal,
                                     refusal.message, sizeof refusal.message);
    if (symbol) { // as in mesh_child_assimp
        int (*send_clips)(const ClipQuery *, int);
        memcpy(&send_clips, &symbol, sizeof symbol);
        send_clips(query, fd);
    }
}

// ---- In the parent

static bool is_plausible(const ClipStream *head, const ClipQuery *query) {
    bool is_missing = head->status == MESH_NO_CLIP;
    bool has_keys = head->status == MESH_OK && query->n_names > 0;
    return head->magic == CLIP_STREAM_MAGIC && head->status <= MESH_NO_CLIP &&
           head->n_clips <= CLIP_STREAM_NAMES && (!is_missing || head->missing < query->n_names) &&
           head->n_points <= MESH_COUNT_LIMIT && has_keys == (head->n_keys > 0) &&
           head->n_keys <= CLIP_STREAM_KEYS && (head->n_points > 0 || !has_keys) &&
           3 * sizeof(float) * head->n_points * head->n_keys <= CLIP_STREAM_BYTES;
}

static bool receive_names(Child *child, Arena *arena, const ClipStream *head, MeshClips *clips) {
    MeshClip *clip = ARENA_ARRAY(arena, head->n_clips, MeshClip);
    for (uint32_t i = 0; i < head->n_clips; i++) {
        ClipName name;
        char text[CLIP_STREAM_NAME];
        if (!child_receive(child, &name, sizeof name)) {
            return false;
        }
        mesh_child_text(name.name, sizeof name.name, text, sizeof text);
        clip[i] = (MeshClip){arena_string(arena, text, strlen(text)), name.seconds};
    }
    *clips = (MeshClips){head->n_clips, head->missing, clip};
    return true;
}

static bool receive_places(Child *child, Arena *arena, const ClipStream *head, PointCache *places) {
    size_t n_keys = head->n_keys, n = 3 * (size_t)head->n_points * n_keys;
    *places = (PointCache){.n_samples = head->n_keys, .n_points = (uint32_t)head->n_points};
    places->seconds = ARENA_ARRAY(arena, n_keys, double);
    places->position = ARENA_ARRAY(arena, n, float);
    return child_receive(child, places->seconds, n_keys * sizeof(double)) &&
           child_receive(child, places->position, n * sizeof(float));
}

static bool are_sound(const PointCache *places) {
    for (uint32_t i = 0; i < places->n_samples; i++) {
        double at = places->seconds[i];
        if (!isfinite(at) || (i > 0 && !(at > places->seconds[i - 1]))) {
            return false;
        }
    }
    for (size_t i = 0; i < 3 * (size_t)places->n_points * places->n_samples; i++) {
        if (!isfinite(places->position[i])) {
            return false;
        }
    }
    return true;
}

static MeshStatus nonsense(char *message, size_t n) {
    snprintf(message, n, "the reader in its own process sent nonsense");
    return MESH_BAD_FORMAT;
}

static MeshStatus ask(Arena *arena, const ClipQuery *query, PointCache *places, MeshClips *clips,
                      char *message, size_t n) {
    Child child;
    ClipStream head;
    if (!child_start(&child, run, query, &mesh_child_limits)) {
        snprintf(message, n, "cannot start the reader: %s", strerror(errno));
        return MESH_BAD_FORMAT;
    }
    bool is_whole = child_receive(&child, &head, sizeof head);
    if (is_whole && !is_plausible(&head, query)) {
        child_stop(&child, false);
        return nonsense(message, n);
    }
    is_whole = is_whole && receive_names(&child, arena, &head, clips) &&
               (head.n_keys == 0 || receive_places(&child, arena, &head, places));
    int status = child_stop(&child, !is_whole);
    if (!is_whole) {
        return mesh_child_explain(&child, status, message, n);
    }
    if (head.n_keys > 0 && !are_sound(places)) {
        return nonsense(message, n);
    }
    mesh_child_text(head.message, sizeof head.message, message, n);
    return (MeshStatus)head.status;
}

// ---- The doors

static MeshStatus read_clips(Arena *arena, const ClipQuery *query, PointCache *places,
                             MeshClips *clips, char *message, size_t n) {
    size_t size;
    char start[4];
    *clips = (MeshClips){0};
    *places = (PointCache){0};
    int fd = infile_open(query->path, &size, message, n);
    if (fd < 0) {
        return MESH_NO_FILE;
    }
    bool has_none = mesh_is_read_here(query->path, start, infile_read(fd, start, 0, sizeof start));
    MeshStatus status = query->n_names ? MESH_NO_CLIP : MESH_OK;
    snprintf(message, n, "it has no clips");
    if (!has_none) {
        status = ask(arena, query, places, clips, message, n);
    }
    close(fd);
    if (status != MESH_OK) {
        *places = (PointCache){0};
    }
    return status;
}

MeshStatus mesh_clips_read(Arena *arena, const char *path, const char *const *names,
                           uint32_t n_names, PointCache *places, MeshClips *clips, char *message,
                           size_t n) {
    const ClipQuery query = {path, names, n_names};
    return read_clips(arena, &query, places, clips, message, n);
}

MeshStatus mesh_clips_list(Arena *arena, const char *path, MeshClips *clips, char *message,
                           size_t n) {
    PointCache none;
    const ClipQuery query = {path, NULL, 0};
    return read_clips(arena, &query, &none, clips, message, n);
}
