// SPDX-License-Identifier: Apache-2.0
// st4 mesh: what the shapes of a scene are at an instant, in the world, as a PLY file.
#include "lang/command.h"

#include <math.h>
#include <string.h>

#include "lang/session.h"
#include "render/snapshot.h"

static const char *plural(uint64_t n) {
    return n == 1 ? "" : "s";
}

// The instant asked for, else the beginning of the film.
static bool find_instant(Session *session, LoadedScene *loaded, double *seconds) {
    const char *at = session->options->values[OPTION_AT].text;
    const FilmSettings *film = &session->scene->film;
    *seconds = (double)(film->first_frame - 1) / film->fps;
    const double *times;
    size_t n;
    if (!at) {
        return true;
    }
    if (!scene_eval_times(loaded, session->arena, "--at", at, &times, &n)) {
        return false;
    }
    if (n != 1 || !isfinite(times[0])) {
        diag_error(session->diag, (Span){0, 0}, NULL, "--at: one instant is expected, not %zu", n);
        return false;
    }
    *seconds = times[0];
    return true;
}

static int no_such_label(const Session *session, const char *label) {
    const Scene *scene = session->scene;
    const char **names = ARENA_ARRAY(session->arena, scene->n_shapes, const char *);
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        const char *slash = strrchr(scene->shapes[i].label, '/');
        names[i] = slash ? slash + 1 : scene->shapes[i].label;
    }
    const char *near = diag_nearest(label, names, scene->n_shapes);
    diag_error(session->diag, (Span){0, 0}, NULL, "--label: no shape is called '%s'%s%s%s", label,
               near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    return STATUS_USAGE;
}

static void print_result(const char *path, const Mesh *mesh, const Snapshot *snapshot) {
    fprintf(stderr, "st4: wrote %s: %u vertices, %u triangles of %llu object%s\n", path,
            mesh->n_vertices, mesh->n_triangles, (unsigned long long)snapshot->n_objects,
            plural(snapshot->n_objects));
    if (snapshot->n_absent) {
        fprintf(stderr, "st4: %llu object%s not there at that instant\n",
                (unsigned long long)snapshot->n_absent, snapshot->n_absent == 1 ? " is" : "s are");
    }
    if (snapshot->n_planes) {
        fprintf(stderr, "st4: %llu plane%s left out: they have no vertices\n",
                (unsigned long long)snapshot->n_planes, plural(snapshot->n_planes));
    }
}

static int write_mesh(Session *session, LoadedScene *loaded) {
    const Options *options = session->options;
    const char *path = options->values[OPTION_OUT].text;
    const char *label = options->values[OPTION_LABEL].text;
    char message[256];
    double seconds;
    Mesh mesh;
    Snapshot snapshot;
    if (!path) {
        return session_refuse(session, STATUS_USAGE, "mesh", "-o OUT.ply is missing");
    }
    if (!find_instant(session, loaded, &seconds)) {
        return STATUS_SCENE;
    }
    if (!snapshot_take(session->arena, session->scene, label, seconds, &mesh, &snapshot)) {
        return session_refuse(session, STATUS_FILES, path,
                              "the scene has more than 2^31 vertices or triangles");
    }
    if (label && !snapshot.n_objects && !snapshot.n_absent && !snapshot.n_planes) {
        return no_such_label(session, label);
    }
    if (!mesh_write_ply(path, &mesh, message, sizeof message)) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    if (!option_flag(options, OPTION_QUIET)) {
        print_result(path, &mesh, &snapshot);
    }
    return STATUS_OK;
}

int command_mesh(Arena *arena, const Options *options) {
    Session session;
    LoadedScene loaded;
    int status = session_load(&session, arena, options, &loaded);
    status = status ? status : session_close(&session, write_mesh(&session, &loaded));
    scene_load_free(&loaded);
    return status;
}
