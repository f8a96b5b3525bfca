// SPDX-License-Identifier: Apache-2.0
// st4 info: what a scene holds and what a run will not spend on it, what a mesh file holds, or how
// a picture was made.
#include "lang/command.h"

#include <string.h>
#include <strings.h>

#include "lang/session.h"
#include "render/film_file.h"
#include "render/image.h"
#include "render/mesh_clips.h"
#include "render/shutter.h"

enum { INSTANTS = 256 }; // of the film, at which lights that change are looked at

typedef struct {
    uint64_t n_objects, n_triangles, n_vertices, n_spheres, n_planes;
    uint32_t n_shapes, n_fades, n_deforming, n_moving, n_breaks;
} Counts;

static Counts count(const Scene *scene) {
    Counts counts = {0};
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        const Shape *shape = &scene->shapes[i];
        if (shape->fade) { // another form of the shape before
            counts.n_fades++;
            continue;
        }
        counts.n_shapes++;
        counts.n_objects += shape_n_objects(shape);
        counts.n_triangles += shape->mesh ? shape->mesh->n_triangles : 0;
        counts.n_vertices += shape->mesh ? shape->mesh->n_vertices : 0;
        counts.n_spheres += shape->kind == SHAPE_SPHERE ? shape->n_instances : 0;
        counts.n_planes += shape->kind == SHAPE_PLANE ? shape->n_instances : 0;
        counts.n_deforming += shape->track || program_reads_time(shape->vertex) ||
                              program_reads_time(shape->geometry);
        counts.n_moving += program_reads_time(shape->transform);
        counts.n_breaks += shape->breaks != NULL;
    }
    return counts;
}

// At some instant of the film, lit or not.
static bool light_has_size(const Scene *scene, const Light *light) {
    double frames = (double)(scene->film.last_frame - scene->film.first_frame + 1);
    bool has_size = light->kind == LIGHT_AREA, is_still = program_is_constant(light->program);
    for (int i = 0; i < (is_still ? 1 : INSTANTS) && !has_size; i++) {
        double frame = (double)(scene->film.first_frame - 1) + frames * i / INSTANTS;
        double seconds = frame / scene->film.fps, out[16] = {0};
        const double in[IN_COUNT] = {[IN_T] = seconds, [IN_FILM_T] = seconds};
        program_run1(light->program, in, out);
        has_size = out[7] > 0;
    }
    return has_size;
}

static bool lights_have_size(const Scene *scene) {
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        if (scene->materials[i].kind == MATERIAL_GLOW) {
            return true;
        }
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        const Light *light = &scene->lights[i];
        if (light->kind == LIGHT_SKY ? light->image && light->image->rows
                                     : light_has_size(scene, light)) {
            return true;
        }
    }
    return false;
}

static bool camera_moves(const CameraSettings *camera) {
    return program_reads_time(camera->program) || program_reads_time(camera->lens);
}

static bool has_lens(const CameraSettings *camera) {
    double lens[4] = {1};
    if (camera->lens && program_is_constant(camera->lens)) {
        const double in[IN_COUNT] = {0};
        program_run1(camera->lens, in, lens);
    }
    return camera->lens && lens[0] > 0;
}

static void print_left_out(const Scene *scene, const Counts *counts) {
    bool moves = counts->n_deforming || counts->n_moving;
    puts("left out:");
    if (!moves) {
        puts("  motion        no shape moves: no time samples, segments or splits in time");
    } else if (!counts->n_deforming) {
        puts("  time samples  all shapes move as bodies: one set of vertices each");
    }
    if (scene->shutter.length == 0) {
        puts("  blur          the shutter is open for an instant");
    }
    if (!lights_have_size(scene)) {
        puts("  light samples nothing glows, no light but the sky has an extent");
    }
    if (!has_lens(&scene->camera)) {
        puts("  lens samples  the camera is a pinhole");
    }
    if (scene->render.bounces == 0) {
        puts("  bounces       direct light only");
    }
}

static void print_scene(const Session *session) {
    const Scene *scene = session->scene;
    const FilmSettings *film = &scene->film;
    const ShutterSettings *shutter = &scene->shutter;
    Counts counts = count(scene);
    printf("film      %ux%u, %g frames a second, frames %lld to %lld\n", film->width, film->height,
           film->fps, (long long)film->first_frame, (long long)film->last_frame);
    printf("shutter   open %g frame periods (%g s), from %+g\n", shutter->length,
           shutter->length / film->fps, shutter->open);
    if (shutter->first_delay != 0 || shutter->last_delay != 0) {
        printf("delayed   by %g to %g frame periods, from pixel to pixel\n", shutter->first_delay,
               shutter->last_delay);
    }
    if (shutter->curve) {
        printf("curve     of %u points, its integral right to %.1e\n", shutter->curve->n,
               shutter->curve->error);
    }
    printf("shapes    %u, placed as %llu objects; %u deform, %u move as bodies, %u have breaks\n",
           counts.n_shapes, (unsigned long long)counts.n_objects, counts.n_deforming,
           counts.n_moving, counts.n_breaks);
    if (counts.n_fades > 0) {
        printf("fades     %u, in which a shape goes from clip to clip\n", counts.n_fades);
    }
    printf("geometry  %llu triangles, %llu vertices (%llu bytes at rest), %llu spheres, "
           "%llu planes\n",
           (unsigned long long)counts.n_triangles, (unsigned long long)counts.n_vertices,
           (unsigned long long)(counts.n_vertices * 3 * sizeof(double)),
           (unsigned long long)counts.n_spheres, (unsigned long long)counts.n_planes);
    printf("materials %u, lights %u, camera %s\n", scene->n_materials, scene->n_lights,
           scene->camera.automatic        ? "placed to see everything"
           : camera_moves(&scene->camera) ? "moving"
                                          : "still");
    printf("hash      %s\n", scene->hash);
    print_left_out(scene, &counts);
}

static void print_attribute(const ImageAttribute *attribute) {
    switch (attribute->kind) {
    case ATTRIBUTE_STRING:
        printf("%-20s %s\n", attribute->name, attribute->string);
        return;
    case ATTRIBUTE_INT:
    case ATTRIBUTE_FLOAT:
        printf("%-20s %.9g\n", attribute->name, attribute->number);
        return;
    case ATTRIBUTE_RATIONAL:
        printf("%-20s %d/%u\n", attribute->name, attribute->numerator, attribute->denominator);
        return;
    }
}

static int info_image(const Session *session, const char *path) {
    Image image;
    char message[256];
    if (!image_read_exr(session->arena, path, &image, message, sizeof message)) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    printf("%-20s %ux%u\n", "size", image.width, image.height);
    if (image.crop.width) {
        printf("%-20s %d,%lld,%d,%lld of %ux%u\n", "crop", image.crop.x,
               (long long)image.crop.x + image.width, image.crop.y,
               (long long)image.crop.y + image.height, image.crop.width, image.crop.height);
    }
    printf("%-20s", "channels");
    for (uint32_t i = 0; i < image.n_channels; i++) {
        printf(" %s:%s", image.channels[i].name, image.channels[i].half ? "half" : "float");
    }
    putchar('\n');
    for (uint32_t i = 0; i < image.n_attributes; i++) {
        print_attribute(&image.attributes[i]);
    }
    return STATUS_OK;
}

// Reads all of it, so that damage shows.
static int info_film(const Session *session, const char *path) {
    Film film;
    FilmOrigin origin;
    char message[256];
    if (!film_file_read(session->arena, path, &film, &origin, message, sizeof message)) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    FilmTotals counts = film_totals(&film);
    const char *crop = film_origin_crop(session->arena, &origin);
    printf("%-20s %ux%u\n", "size", origin.width, origin.height);
    if (crop) {
        printf("%-20s %s\n", "crop", crop);
    }
    printf("%-20s %s\n", "layers", film_origin_layers(session->arena, &origin));
    printf("%-20s %u to %u of %u\n", "samples", origin.first + 1, origin.first + origin.n,
           origin.spp);
    printf("%-20s %u to %u a pixel%s\n", "done", counts.least, counts.most,
           counts.least < origin.n ? ", not finished" : "");
    for (uint32_t i = 0; i < origin.n_attributes; i++) {
        if (strcmp(origin.attributes[i].name, "samples") != 0) {
            print_attribute(&origin.attributes[i]);
        }
    }
    for (uint32_t i = 0; i < origin.n_settings; i++) {
        print_attribute(&origin.settings[i]);
    }
    return STATUS_OK;
}

static int info_mesh(const Session *session, const char *path) {
    Mesh mesh;
    MeshClips clips;
    char message[512];
    if (mesh_read(session->arena, path, &mesh, message, sizeof message) != MESH_OK ||
        mesh_clips_list(session->arena, path, &clips, message, sizeof message) != MESH_OK) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    printf("%-20s %u\n", "vertices", mesh.n_vertices);
    printf("%-20s %u\n", "triangles", mesh.n_triangles);
    printf("%-20s %s\n", "normals", mesh.normal ? "yes" : "no");
    printf("%-20s %s\n", "uvs", mesh.uv ? "yes" : "no");
    for (uint32_t i = 0; i < clips.n; i++) {
        printf("%-20s \"%s\", %.6g s\n", "clip", clips.clip[i].name, clips.clip[i].seconds);
    }
    return STATUS_OK;
}

typedef enum { INFO_SCENE, INFO_MESH, INFO_EXR, INFO_FILM, INFO_PICTURE } InfoKind;

// Of mesh files, those that go by such names.
static const char *const mesh_endings[] = {".obj", ".ply", ".stl", ".gltf", ".glb",
                                           ".fbx", ".dae", ".3ds", ".x",    ".off"};
static const char *const picture_endings[] = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".hdr"};

static bool ends_in(const char *path, const char *const *endings, size_t n) {
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < n; i++) {
        if (!strcasecmp(dot, endings[i])) {
            return true;
        }
    }
    return false;
}

static InfoKind kind_of(const char *path) {
    if (image_is_exr(path)) {
        return INFO_EXR;
    }
    if (ends_in(path, picture_endings, sizeof picture_endings / sizeof *picture_endings)) {
        return INFO_PICTURE;
    }
    if (ends_in(path, mesh_endings, sizeof mesh_endings / sizeof *mesh_endings)) {
        return INFO_MESH;
    }
    return film_file_is(path) ? INFO_FILM : INFO_SCENE;
}

static int print_info(const Session *session, InfoKind kind, const char *path) {
    switch (kind) {
    case INFO_EXR:
        return info_image(session, path);
    case INFO_MESH:
        return info_mesh(session, path);
    case INFO_FILM:
        return info_film(session, path);
    case INFO_PICTURE:
        return session_refuse(session, STATUS_FILES, path,
                              "of pictures only .exr says how it was made");
    case INFO_SCENE:
        break;
    }
    print_scene(session);
    return STATUS_OK;
}

int command_info(Arena *arena, const Options *options) {
    const char *path = options->operands[0];
    InfoKind kind = kind_of(path);
    Session session;
    int status = kind == INFO_SCENE ? session_open(&session, arena, options)
                                    : session_begin(&session, arena, options);
    return status ? status : session_close(&session, print_info(&session, kind, path));
}
