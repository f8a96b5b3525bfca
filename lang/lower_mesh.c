// SPDX-License-Identifier: Apache-2.0
// Meshes: from a file, written out, or a sequence of files; their point caches and clips. In this
// order: the file, fit and ground, subdivide, deform, transforms.
#include "lang/lower_form.h"

#include <math.h>
#include <string.h>

#include "lang/loader.h"
#include "render/mesh_track.h"
#include "render/point_cache.h"

// p becomes p scale + shift.
typedef struct {
    double scale, shift[3];
} Fit;

typedef struct {
    const Object *object;
    const Given *file, *points, *frames, *cache, *clip;
    Fit fit;
    Mesh *mesh;
    VertexTrack *track;
} Making;

// ---- Written out

static bool read_number(Eval *ev, const Given *given, Ref ref, const char *what, double *x) {
    if (!eval_need(ev, &given->env, given->node, ref, what, x)) {
        return false;
    }
    if (!isfinite(*x)) {
        eval_error(ev, &given->env, given->node, NULL, "%s is not a finite number", what);
        return false;
    }
    return true;
}

// The vectors of a list, width numbers each; false: reported, or asked for.
static bool read_vectors(Eval *ev, const Given *given, uint32_t width, double **out) {
    const List *list = given->value.list;
    const char *what = property_infos[given->id].name;
    double *numbers = ARENA_ARRAY(lower_arena(ev), (size_t)list->n * width, double);
    for (uint32_t i = 0; i < list->n; i++) {
        const Value *item = &list->items[i];
        if (item->n != width || (item->type != VALUE_VEC && item->type != VALUE_COLOR)) {
            eval_error(ev, &given->env, given->node, NULL,
                       "%s is a list of vectors of %u, item %u is %s", what, width, i,
                       value_describe(ev->arena, item));
            return false;
        }
        for (uint32_t k = 0; k < width; k++) {
            if (!read_number(ev, given, item->ref[k], what, &numbers[(size_t)i * width + k])) {
                return false;
            }
        }
    }
    *out = numbers;
    return true;
}

// Corner k of a face, a list or a vector of numbers; REF_NONE: it is something else.
static Ref corner_ref(const Value *face, uint32_t k) {
    if (face->type == VALUE_VEC) {
        return face->ref[k];
    }
    const Value *item = &face->list->items[k];
    return item->type == VALUE_NUMBER ? item->ref[0] : REF_NONE;
}

static bool read_corner(Eval *ev, const Given *given, uint32_t n_points, uint32_t i, Ref ref,
                        uint32_t *corner) {
    double x;
    if (ref == REF_NONE) {
        eval_error(ev, &given->env, given->node, NULL, "face %u holds something else than numbers",
                   i);
        return false;
    }
    if (!read_number(ev, given, ref, "a face", &x)) {
        return false;
    }
    if (!(x >= 0 && x < n_points) || x != floor(x)) {
        eval_error(ev, &given->env, given->node, NULL,
                   "face %u: %.15g is not one of the points, 0 to %u", i, x, n_points - 1);
        return false;
    }
    *corner = (uint32_t)x;
    return true;
}

// Polygons are cut into fans.
static bool read_faces(Eval *ev, const Given *given, Mesh *mesh) {
    const List *list = given->value.list;
    size_t n_triangles = 0;
    for (uint32_t i = 0; i < list->n; i++) {
        const Value *face = &list->items[i];
        bool is_list = face->type == VALUE_LIST;
        uint32_t n = is_list ? face->list->n : face->type == VALUE_VEC ? face->n : 0;
        if (n < 3) {
            eval_error(ev, &given->env, given->node, "write faces = [[0, 1, 2], [0, 2, 3]]",
                       "a face is a list of 3 or more indices, face %u is %s", i,
                       is_list ? arena_printf(ev->arena, "a list of %u", n)
                               : value_describe(ev->arena, face));
            return false;
        }
        n_triangles += n - 2;
    }
    mesh->index = ARENA_ARRAY(lower_arena(ev), 3 * n_triangles, uint32_t);
    for (uint32_t i = 0; i < list->n; i++) {
        const Value *face = &list->items[i];
        uint32_t n = face->type == VALUE_LIST ? face->list->n : face->n, corner[3];
        for (uint32_t k = 0; k < n; k++) {
            if (!read_corner(ev, given, mesh->n_vertices, i, corner_ref(face, k),
                             &corner[k < 2 ? k : 2])) {
                return false;
            }
            if (k >= 2) {
                lower_mesh_triangle(mesh, corner[0], corner[1], corner[2]);
                corner[1] = corner[2];
            }
        }
    }
    return true;
}

// What belongs to points: as many of them, or none.
static bool read_floats(Eval *ev, const Object *object, PropertyId id, uint32_t width,
                        const Mesh *mesh, float **out) {
    const Given *given = object_given(object, id);
    double *numbers;
    if (!given) {
        return true;
    }
    if (!value_is(&given->value, VALUE_LIST)) {
        return false;
    }
    if (given->value.list->n != mesh->n_vertices) {
        eval_error(ev, &given->env, given->node, NULL, "there are %u points and %u %s",
                   mesh->n_vertices, given->value.list->n, property_infos[id].name);
        return false;
    }
    if (!read_vectors(ev, given, width, &numbers)) {
        return false;
    }
    size_t n = (size_t)mesh->n_vertices * width;
    *out = ARENA_ARRAY(lower_arena(ev), n, float);
    for (size_t i = 0; i < n; i++) {
        (*out)[i] = (float)numbers[i];
    }
    return true;
}

static Mesh *written_mesh(Eval *ev, const Object *object, const Given *points) {
    const Given *faces = object_given(object, PROPERTY_MESH_FACES);
    Mesh *mesh = ARENA_NEW(lower_arena(ev), Mesh);
    if (!faces) {
        eval_error_at(ev, points->name, "write faces = [[0, 1, 2], [0, 2, 3]]",
                      "points without faces");
        return NULL;
    }
    if (!value_is(&points->value, VALUE_LIST) || !value_is(&faces->value, VALUE_LIST) ||
        !read_vectors(ev, points, 3, &mesh->position)) {
        return NULL;
    }
    mesh->n_vertices = points->value.list->n;
    if (!read_faces(ev, faces, mesh) ||
        !read_floats(ev, object, PROPERTY_MESH_NORMALS, 3, mesh, &mesh->normal) ||
        !read_floats(ev, object, PROPERTY_MESH_UVS, 2, mesh, &mesh->uv)) {
        return NULL;
    }
    if (mesh->normal) {
        mesh_normals_finish(mesh);
    }
    return mesh;
}

// ---- Sizes

static void bounds(const Mesh *mesh, double lo[3], double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; i++) {
        if (isfinite(mesh->position[i])) {
            lo[i % 3] = fmin(lo[i % 3], mesh->position[i]);
            hi[i % 3] = fmax(hi[i % 3], mesh->position[i]);
        }
    }
}

// fit: so tall, the middle of its box in the origin. ground: standing on y = 0.
static bool fit_mesh(Eval *ev, Making *m) {
    const Given *given = object_given(m->object, PROPERTY_MESH_FIT);
    Value ground = object_value(ev, m->object, PROPERTY_MESH_GROUND);
    Fit *fit = &m->fit;
    double height = 0, stands = 0, lo[3], hi[3];
    *fit = (Fit){.scale = 1};
    bool is_fitted =
        given && given->value.n == 1 && dag_is_const(ev->dag, given->value.ref[0], &height);
    bool is_grounded =
        ground.n == 1 && dag_is_const(ev->dag, ground.ref[0], &stands) && stands != 0;
    bounds(m->mesh, lo, hi);
    if ((!is_fitted && !is_grounded) || !(lo[0] <= hi[0])) {
        return true;
    }
    if (is_fitted && hi[1] == lo[1]) {
        eval_error_at(ev, given->name, "write scale", "this mesh has no height to fit");
        return false;
    }
    if (is_fitted) {
        fit->scale = height / (hi[1] - lo[1]);
        for (int k = 0; k < 3; k++) {
            fit->shift[k] = -0.5 * (lo[k] + hi[k]) * fit->scale;
        }
    }
    if (is_grounded) {
        fit->shift[1] = -lo[1] * fit->scale;
    }
    double *position = ARENA_ARRAY(lower_arena(ev), 3 * (size_t)m->mesh->n_vertices, double);
    for (size_t i = 0; i < 3 * (size_t)m->mesh->n_vertices; i++) {
        position[i] = m->mesh->position[i] * fit->scale + fit->shift[i % 3];
    }
    m->mesh->position = position;
    return true;
}

static bool subdivide(Eval *ev, Making *m) {
    const Given *given = object_given(m->object, PROPERTY_MESH_SUBDIVIDE);
    double times = 0;
    if (given && given->value.n == 1) {
        dag_is_const(ev->dag, given->value.ref[0], &times);
    }
    if (m->mesh->n_triangles * pow(4, times) > MESH_MAX_SUBDIVIDED) {
        eval_error_at(ev, given->where, NULL, "cut %d times, this mesh has more than %d triangles",
                      (int)times, MESH_MAX_SUBDIVIDED);
        return false;
    }
    for (int i = 0; i < times; i++) {
        Mesh *finer = ARENA_NEW(lower_arena(ev), Mesh);
        uint32_t(*parents)[2];
        if (!mesh_subdivide(lower_arena(ev), m->mesh, finer, &parents)) {
            eval_error_at(ev, given->where, NULL,
                          "cut %d times, this mesh has more than %d triangles", i + 1,
                          MESH_MAX_SUBDIVIDED);
            return false;
        }
        if (m->track) {
            m->track =
                track_subdivide(lower_arena(ev), m->track, finer, (const uint32_t(*)[2])parents);
        }
        m->mesh = finer;
    }
    return true;
}

// ---- Tracks

// fps: what the property says, else the film's.
static double sequence_fps(Eval *ev, const Object *object) {
    const Given *given = object_given(object, PROPERTY_MESH_FPS);
    double fps = ev->fps;
    if (given && given->value.n == 1) {
        dag_is_const(ev->dag, given->value.ref[0], &fps);
    }
    return fps;
}

static float *new_track(Eval *ev, Making *m, uint32_t n_keys, double *seconds) {
    double lo[3], hi[3];
    size_t n = (size_t)m->mesh->n_vertices * n_keys;
    float *offset = ARENA_ARRAY(lower_arena(ev), 3 * n, float);
    m->track = ARENA_NEW(lower_arena(ev), VertexTrack);
    *m->track = (VertexTrack){
        .n_keys = n_keys, .n_vertices = m->mesh->n_vertices, .seconds = seconds, .offset = offset};
    bounds(m->mesh, lo, hi);
    for (int c = 0; c < 3 && lo[0] <= hi[0]; c++) {
        m->track->center[c] = 0.5 * lo[c] + 0.5 * hi[c];
    }
    return offset;
}

static float offset_of(const Making *m, double x, size_t c) {
    return (float)(x * m->fit.scale + m->fit.shift[c] - m->track->center[c]);
}

static void take_places(Eval *ev, Making *m, const PointCache *places) {
    const Mesh *mesh = m->mesh;
    uint32_t n_points = mesh->point ? mesh->n_points : mesh->n_vertices;
    double *seconds = ARENA_ARRAY(lower_arena(ev), places->n_samples, double);
    memcpy(seconds, places->seconds, places->n_samples * sizeof *seconds);
    float *to = new_track(ev, m, places->n_samples, seconds);
    for (size_t k = 0; k < places->n_samples; k++) {
        const float *from = places->position + 3 * (size_t)n_points * k;
        for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; i++) {
            size_t at = mesh->point ? mesh->point[i / 3] : i / 3;
            *to++ = offset_of(m, from[3 * at + i % 3], i % 3);
        }
    }
    loader_hash_add(ev, seconds, places->n_samples * sizeof *seconds);
    loader_hash_add(ev, places->position,
                    3 * (size_t)n_points * places->n_samples * sizeof *places->position);
}

static bool read_cache(Eval *ev, Making *m) {
    const Given *given = m->cache;
    const Mesh *mesh = m->mesh;
    if (!value_is(&given->value, VALUE_STRING)) {
        return false;
    }
    const char *path = loader_file(ev, &given->env, given->node, &given->value);
    char message[512];
    PointCache cache;
    if (!path) {
        return false;
    }
    Arena scratch = {0};
    bool is_read = point_cache_read(&scratch, path, sequence_fps(ev, m->object), &cache, message,
                                    sizeof message) == MESH_OK;
    uint32_t n_points = mesh->point ? mesh->n_points : mesh->n_vertices;
    if (!is_read) {
        eval_error(ev, &given->env, given->node, NULL, "cannot read '%s': %s", path, message);
        ev->has_failed_file = true;
    } else if (cache.n_points != n_points) {
        eval_error(ev, &given->env, given->node, NULL,
                   "'%s' has %u points, the mesh has %u vertices", path, cache.n_points, n_points);
        is_read = false;
    }
    if (is_read) {
        take_places(ev, m, &cache);
    }
    arena_free(&scratch);
    return is_read;
}

static bool read_clip(Eval *ev, Making *m) {
    Arena scratch = {0};
    PointCache places;
    bool is_read = lower_clip_read(ev, m->file, m->clip, &scratch, &places);
    if (is_read && places.n_points != m->mesh->n_vertices) {
        eval_error(ev, &m->clip->env, m->clip->node, NULL,
                   "the file has changed while it was read");
        is_read = false;
    }
    if (is_read) {
        take_places(ev, m, &places);
    }
    arena_free(&scratch);
    return is_read;
}

// One more file of a sequence, of the same faces as the first.
static bool read_frame(Eval *ev, Making *m, const Value *name, Arena *scratch, Mesh *frame) {
    const Given *given = m->frames;
    const char *path = loader_file(ev, &given->env, given->node, name);
    const char *file = symbol_text(ev->symbols, name->symbol);
    char message[512];
    if (!path) {
        return false;
    }
    if (mesh_read(scratch, path, frame, message, sizeof message) != MESH_OK) {
        eval_error(ev, &given->env, given->node, NULL, "cannot read '%s': %s", path, message);
        ev->has_failed_file = true;
        return false;
    }
    lower_hash_mesh(ev, frame);
    if (frame->n_vertices != m->mesh->n_vertices) {
        eval_error(ev, &given->env, given->node, NULL,
                   "'%s' has %u vertices, the first file of the sequence has %u", file,
                   frame->n_vertices, m->mesh->n_vertices);
        return false;
    }
    if (frame->n_triangles != m->mesh->n_triangles ||
        memcmp(frame->index, m->mesh->index, 3 * (size_t)frame->n_triangles * sizeof(uint32_t)) !=
            0) {
        eval_error(ev, &given->env, given->node, NULL,
                   "the faces of '%s' are not those of the first file of the sequence", file);
        return false;
    }
    return true;
}

static bool read_frames(Eval *ev, Making *m, const Value *names, uint32_t n) {
    double *seconds = ARENA_ARRAY(lower_arena(ev), n, double), fps = sequence_fps(ev, m->object);
    float *to = new_track(ev, m, n, seconds);
    for (uint32_t k = 0; k < n; k++) {
        Arena scratch = {0};
        Mesh frame;
        seconds[k] = k / fps;
        bool is_read = read_frame(ev, m, &names[k], &scratch, &frame);
        for (size_t i = 0; is_read && i < 3 * (size_t)frame.n_vertices; i++) {
            *to++ = offset_of(m, frame.position[i], i % 3);
        }
        arena_free(&scratch);
        if (!is_read) {
            return false;
        }
    }
    return true;
}

// ---- The whole

static bool check_clip(Eval *ev, const Making *m) {
    if (m->clip && !m->file) {
        eval_error_at(ev, m->clip->name, "it is an animation within the file", "clip without file");
        return false;
    }
    if (m->clip && m->cache) {
        eval_error_at(ev, m->cache->name, NULL,
                      "a mesh moves by its clip or by a cache, not by both");
        return false;
    }
    return true;
}

static bool check_sources(Eval *ev, Making *m) {
    const Given *first = m->file ? m->file : m->points ? m->points : m->frames;
    const Given *second = m->file && m->points                  ? m->points
                          : (m->file || m->points) && m->frames ? m->frames
                          : m->frames && m->cache               ? m->cache
                                                                : NULL;
    const Given *fps = object_given(m->object, PROPERTY_MESH_FPS);
    if (!first) {
        eval_error_at(ev, m->object->where, "write file = \"bunny.obj\"", "mesh needs 'file'");
        return false;
    }
    if (second) {
        eval_error_at(ev, second->name, NULL, "a mesh is given by %s or by %s, not by both",
                      property_infos[first->id].name, property_infos[second->id].name);
        return false;
    }
    static const PropertyId of_points[] = {PROPERTY_MESH_FACES, PROPERTY_MESH_NORMALS,
                                           PROPERTY_MESH_UVS};
    for (int i = 0; i < 3 && !m->points; i++) {
        const Given *given = object_given(m->object, of_points[i]);
        if (given) {
            eval_error_at(ev, given->name, NULL, "%s without points",
                          property_infos[given->id].name);
            return false;
        }
    }
    if (fps && !m->frames && !m->cache) {
        eval_error_at(ev, fps->name, NULL, "fps without frames or cache");
        return false;
    }
    return check_clip(ev, m);
}

// The mesh before anything is done to it, to be changed; names[*n]: of a sequence.
static bool first_mesh(Eval *ev, Making *m, const Value **names, uint32_t *n) {
    if (m->points) {
        m->mesh = written_mesh(ev, m->object, m->points);
        return m->mesh != NULL;
    }
    Given given = m->file ? *m->file : *m->frames;
    if (!value_is(&given.value, VALUE_STRING)) {
        return false;
    }
    if (m->frames) {
        *names = loader_sequence(ev, m->frames, n);
        if (!*names) {
            return false;
        }
        given.value = (*names)[0];
    }
    const Mesh *mesh = loader_mesh(ev, &given);
    if (!mesh) {
        return false;
    }
    m->mesh = ARENA_NEW(lower_arena(ev), Mesh);
    *m->mesh = *mesh;
    return true;
}

static bool make(Eval *ev, Making *m) {
    const Value *names = NULL;
    uint32_t n = 0;
    return check_sources(ev, m) && first_mesh(ev, m, &names, &n) && fit_mesh(ev, m) &&
           (!m->cache || read_cache(ev, m)) && (!m->clip || read_clip(ev, m)) &&
           (!m->frames || read_frames(ev, m, names, n)) && subdivide(ev, m);
}

// The index of the span between two keys of a track: it changes at each of them.
static Ref track_key(Eval *ev, const VertexTrack *track) {
    double *starts = ARENA_ARRAY(ev->arena, (size_t)track->n_keys + 1, double);
    starts[0] = -1e300;
    memcpy(starts + 1, track->seconds, track->n_keys * sizeof *starts);
    return dag_table_op(ev->dag, OP_SEARCH, dag_input(ev->dag, IN_T), starts, track->n_keys + 1);
}

// What makes two meshes the same: the values of all that is said of them but the deformation.
static MeshKey key_of(Eval *ev, const Making *m) {
    static const PropertyId ids[] = {
        PROPERTY_MESH_FILE,      PROPERTY_MESH_POINTS, PROPERTY_MESH_FACES,  PROPERTY_MESH_NORMALS,
        PROPERTY_MESH_UVS,       PROPERTY_MESH_FRAMES, PROPERTY_MESH_FPS,    PROPERTY_MESH_CACHE,
        PROPERTY_MESH_SUBDIVIDE, PROPERTY_MESH_FIT,    PROPERTY_MESH_GROUND, PROPERTY_MESH_CLIP};
    MeshKey key;
    memset(&key, 0, sizeof key);
    for (int i = 0; i < MESH_KEY_VALUES; i++) {
        const Given *given = object_given(m->object, ids[i]);
        if (given) {
            const Value *v = &given->value;
            key.module[i] = given->env.module;
            key.value[i] = ids[i] == PROPERTY_MESH_CLIP ? lower_clip_symbol(ev, given)
                           : v->type == VALUE_STRING    ? v->symbol | (uint64_t)v->n << 32
                           : v->type == VALUE_LIST      ? (uintptr_t)v->list
                                                        : v->ref[0];
        }
    }
    return key;
}

static bool shared_mesh(Eval *ev, const Object *object, MadeMesh *made) {
    Lowering *l = ev->lowering;
    Making m = {.object = object,
                .file = object_given(object, PROPERTY_MESH_FILE),
                .points = object_given(object, PROPERTY_MESH_POINTS),
                .frames = object_given(object, PROPERTY_MESH_FRAMES),
                .cache = object_given(object, PROPERTY_MESH_CACHE),
                .clip = object_given(object, PROPERTY_MESH_CLIP)};
    MeshKey key = key_of(ev, &m);
    for (uint32_t i = 0; i < LOWERING_MESHES; i++) {
        if (l->made[i].mesh && memcmp(&l->made[i].key, &key, sizeof key) == 0) {
            *made = l->made[i];
            return true;
        }
    }
    if (!make(ev, &m)) {
        return false;
    }
    *made = (MadeMesh){key, m.mesh, m.track, REF_NONE};
    if (m.track) {
        made->track_key = track_key(ev, m.track);
    }
    l->made[l->next_made++ % LOWERING_MESHES] = *made;
    return true;
}

// By a clock of its own a mesh reads other times than those of the film.
static void note_track(Eval *ev, const Object *object, const Place *place,
                       const VertexTrack *track) {
    static const PropertyId ids[] = {PROPERTY_MESH_CACHE, PROPERTY_MESH_FRAMES, PROPERTY_MESH_CLIP};
    for (int i = 0; i < 3 && place->clock == REF_NONE; i++) {
        const Given *given = object_given(object, ids[i]);
        if (given) {
            lower_note_data(ev, given, track->seconds[0], track->seconds[track->n_keys - 1]);
        }
    }
}

bool lower_mesh_form(Eval *ev, const Object *object, const Place *place, Form *form) {
    MadeMesh made;
    if (!shared_mesh(ev, object, &made)) {
        return false;
    }
    if (made.track) {
        note_track(ev, object, place, made.track);
    }
    form->mesh = made.mesh;
    form->track = made.track;
    form->track_key = made.track_key;
    form->faceted = made.mesh->faceted;
    if (object_given(object, PROPERTY_MESH_DEFORM)) {
        Ref refs[3] = {dag_input(ev->dag, IN_PX), dag_input(ev->dag, IN_PY),
                       dag_input(ev->dag, IN_PZ)};
        Value rest = value_vec(VALUE_VEC, refs, 3);
        return lower_deform(ev, object, PROPERTY_MESH_DEFORM, &rest, VALUE_NUMBER, VALUE_NUMBER,
                            form->vertex);
    }
    return true;
}
