// SPDX-License-Identifier: Apache-2.0
// Cameras: perspective and orthographic, at one instant.
#include "render/camera.h"

enum { N_OUT = 10 };

// Below this sine between the line of sight and `up`, `up` says nothing about which way is up.
static const double LEAST_SINE = 1e-9;

// A unit vector for `up` where the one given lies along the line of sight: the axis furthest from
// it.
static Vec3 any_up(Vec3 forward) {
    double x = fabs(forward.x), y = fabs(forward.y), z = fabs(forward.z);
    if (z <= x && z <= y) {
        return vec3(0, 0, 1);
    }
    return x <= y ? vec3(1, 0, 0) : vec3(0, 1, 0);
}

// Fills the directions; false where `from` and `to` coincide.
static bool orient(Camera *camera, Vec3 along, Vec3 up) {
    double distance = vec3_length(along);
    if (!(distance > 0) || !isfinite(distance)) {
        return false;
    }
    camera->forward = vec3_scale(along, 1 / distance);
    Vec3 right = vec3_cross(camera->forward, vec3_normalize(up));
    if (!(vec3_length(right) > LEAST_SINE)) {
        right = vec3_cross(camera->forward, any_up(camera->forward));
    }
    camera->right = vec3_normalize(right);
    camera->down = vec3_cross(camera->forward, camera->right);
    return vec3_is_finite(camera->right) && vec3_is_finite(camera->down);
}

Camera camera_at(const Scene *scene, double seconds) {
    const CameraSettings *settings = &scene->camera;
    Camera camera = {.kind = settings->kind,
                     .center_x = 0.5 * scene->film.width,
                     .center_y = 0.5 * scene->film.height};
    if (!settings->program) {
        return camera;
    }
    double in[IN_COUNT] = {[IN_T] = seconds, [IN_FILM_T] = seconds}, out[N_OUT];
    program_run1(settings->program, in, out);
    for (int i = 0; i < N_OUT; i++) {
        if (!isfinite(out[i])) {
            return camera;
        }
    }
    camera.from = vec3(out[0], out[1], out[2]);
    Vec3 along = vec3_sub(vec3(out[3], out[4], out[5]), camera.from);
    if (!orient(&camera, along, vec3(out[6], out[7], out[8]))) {
        return camera;
    }
    camera.pixel = 2 * program_fold(OP_TAN, out[9] / 2, 0, 0) / scene->film.height;
    if (camera.kind == CAMERA_ORTHOGRAPHIC) {
        camera.pixel *= vec3_length(along);
    }
    camera.is_valid = camera.pixel > 0 && isfinite(camera.pixel);
    return camera;
}

const Program *camera_automatic(Arena *arena, const Scene *scene, Vec3 lo, Vec3 hi) {
    const double fov = 40 * 0.017453292519943295, margin = 1.1;
    const Vec3 side = vec3_normalize(vec3(0.5, 0.4, 1));
    Vec3 to = vec3_scale(vec3_add(lo, hi), 0.5);
    double radius = 0.5 * vec3_length(vec3_sub(hi, lo));
    if (!(radius > 0) || !isfinite(radius) || !vec3_is_finite(to)) {
        to = vec3_is_finite(to) ? to : vec3(0, 0, 0);
        radius = 1;
    }
    double aspect = (double)scene->film.width / scene->film.height;
    double slope = program_fold(OP_TAN, fov / 2, 0, 0) * (aspect < 1 ? aspect : 1);
    double sine = slope / sqrt(1 + slope * slope);
    Vec3 from = vec3_madd(to, margin * radius / sine, side);
    const double values[N_OUT] = {from.x, from.y, from.z, to.x, to.y, to.z, 0, 1, 0, fov};
    Instr code[N_OUT] = {{0}};
    uint32_t out[N_OUT];
    for (uint32_t i = 0; i < N_OUT; i++) {
        code[i] = (Instr){.op = OP_CONST, .value = values[i]};
        out[i] = i;
    }
    return program_new(arena, code, N_OUT, out, N_OUT, NULL, 0);
}

void camera_ray(const Camera *camera, double x, double y, Vec3 *origin, Vec3 *dir) {
    double across = (x - camera->center_x) * camera->pixel;
    double downward = (y - camera->center_y) * camera->pixel;
    Vec3 offset = vec3_add(vec3_scale(camera->right, across), vec3_scale(camera->down, downward));
    if (camera->kind == CAMERA_ORTHOGRAPHIC) {
        *origin = vec3_add(camera->from, offset);
        *dir = camera->forward;
    } else {
        *origin = camera->from;
        *dir = vec3_normalize(vec3_add(camera->forward, offset));
    }
}

bool camera_project(const Camera *camera, Vec3 point, double *x, double *y, double *scale) {
    Vec3 relative = vec3_sub(point, camera->from);
    double depth = vec3_dot(relative, camera->forward);
    if (!(depth > 0)) {
        return false;
    }
    *scale = 1 / (camera->kind == CAMERA_ORTHOGRAPHIC ? camera->pixel : camera->pixel * depth);
    *x = camera->center_x + vec3_dot(relative, camera->right) * *scale;
    *y = camera->center_y + vec3_dot(relative, camera->down) * *scale;
    return true;
}
