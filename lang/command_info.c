// SPDX-License-Identifier: Apache-2.0
// st4 info: what a scene holds and what a run will not spend on it, or how a picture was made.
#include "lang/command.h"

#include <string.h>
#include <strings.h>

#include "lang/session.h"
#include "render/image.h"

typedef struct {
    uint64_t n_objects, n_triangles, n_vertices, n_spheres, n_planes;
    uint32_t n_deforming, n_moving, n_breaks;
} Counts;

static bool reads_time(const Program *program) {
    return program_reads(program, IN_T) || program_reads(program, IN_FILM_T);
}

static Counts count(const Scene *scene) {
    Counts counts = {0};
    for (uint32_t i = 0; i < scene->n_shapes; i++) {
        const Shape *shape = &scene->shapes[i];
        counts.n_objects += shape->n_instances;
        counts.n_triangles += shape->mesh ? shape->mesh->n_triangles : 0;
        counts.n_vertices += shape->mesh ? shape->mesh->n_vertices : 0;
        counts.n_spheres += shape->kind == SHAPE_SPHERE ? shape->n_instances : 0;
        counts.n_planes += shape->kind == SHAPE_PLANE ? shape->n_instances : 0;
        counts.n_deforming +=
            shape->track || reads_time(shape->vertex) || reads_time(shape->geometry);
        counts.n_moving += reads_time(shape->transform);
        counts.n_breaks += shape->breaks != NULL;
    }
    return counts;
}

static bool lights_have_size(const Scene *scene) {
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        const Light *light = &scene->lights[i];
        double out[8] = {0};
        if (light->kind == LIGHT_SKY || !program_is_constant(light->program)) {
            continue;
        }
        const double in[IN_COUNT] = {0};
        program_run1(light->program, in, out);
        if (out[7] > 0) {
            return true;
        }
    }
    return false;
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
        puts("  light samples no light of constant size has an extent but the sky");
    }
    puts("  lens samples  the camera is a pinhole");
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
    printf("shapes    %u, placed as %llu objects; %u deform, %u move as bodies, %u have breaks\n",
           scene->n_shapes, (unsigned long long)counts.n_objects, counts.n_deforming,
           counts.n_moving, counts.n_breaks);
    printf("geometry  %llu triangles, %llu vertices (%llu bytes at rest), %llu spheres, "
           "%llu planes\n",
           (unsigned long long)counts.n_triangles, (unsigned long long)counts.n_vertices,
           (unsigned long long)(counts.n_vertices * 3 * sizeof(double)),
           (unsigned long long)counts.n_spheres, (unsigned long long)counts.n_planes);
    printf("materials %u, lights %u, camera %s\n", scene->n_materials, scene->n_lights,
           scene->camera.automatic             ? "placed to see everything"
           : reads_time(scene->camera.program) ? "moving"
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

static int info_image(Arena *arena, const char *path) {
    Image image;
    char message[256];
    if (!image_read_exr(arena, path, &image, message, sizeof message)) {
        fprintf(stderr, "st4: error: %s: %s\n", path, message);
        return STATUS_FILES;
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

int command_info(Arena *arena, const Options *options) {
    const char *dot = strrchr(options->operands[0], '.');
    if (dot && !strcasecmp(dot, ".exr")) {
        return info_image(arena, options->operands[0]);
    }
    Session session;
    int status = session_open(&session, arena, options);
    if (status == STATUS_OK) {
        print_scene(&session);
        status = session_close(&session, status);
    }
    return status;
}
