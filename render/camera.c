// SPDX-License-Identifier: Apache-2.0
// Cameras: perspective, orthographic and spherical, at one instant.
#include "render/camera.h"

#include "render/sampling.h"

enum { N_OUT = 10, N_LENS = 4 };

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

// What the lens is at this instant; false: not finite, or out of range.
static bool set_lens(Camera *camera, const CameraSettings *settings, const double in[IN_COUNT]) {
    double lens[N_LENS];
    if (!settings->lens) {
        return true;
    }
    program_run1(settings->lens, in, lens);
    camera->radius = lens[0] / 2;
    camera->focus = lens[1];
    camera->blades = settings->blades;
    camera->center_x -= lens[2] * camera->height;
    camera->center_y += lens[3] * camera->height;
    return isfinite(camera->center_x) && isfinite(camera->center_y) && camera->radius >= 0 &&
           isfinite(camera->radius) && camera->focus > 0;
}

static double pixel_size(const Camera *camera, double fov, double distance) {
    double slope = 2 * program_fold(OP_TAN, fov / 2, 0, 0) / camera->height;
    switch (camera->kind) {
    case CAMERA_ORTHOGRAPHIC:
        return slope * distance;
    case CAMERA_SPHERICAL:
        return fmin(2 * SAMPLING_PI / camera->width, SAMPLING_PI / camera->height);
    default:
        return slope;
    }
}

Camera camera_at(const Scene *scene, double seconds) {
    const CameraSettings *settings = &scene->camera;
    Camera camera = {.kind = settings->kind,
                     .width = scene->film.width,
                     .height = scene->film.height,
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
    if (!orient(&camera, along, vec3(out[6], out[7], out[8])) || !set_lens(&camera, settings, in)) {
        return camera;
    }
    camera.pixel = pixel_size(&camera, out[9], vec3_length(along));
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

// The ray of a pinhole, dir of any length but 1 forward, and the axes of the lens there.
typedef struct {
    Vec3 origin, dir, right, down;
} PinholeRay;

// x is the longitude, y the latitude.
static PinholeRay spherical_ray(const Camera *camera, double x, double y) {
    double sine, cosine, below, level;
    sampling_turn((x - camera->center_x) / camera->width, &sine, &cosine);
    sampling_turn(0.5 * (y - camera->center_y) / camera->height, &below, &level);
    Vec3 ahead = vec3_add(vec3_scale(camera->forward, cosine), vec3_scale(camera->right, sine));
    PinholeRay ray = {.origin = camera->from};
    ray.dir = vec3_madd(vec3_scale(ahead, level), below, camera->down);
    ray.right = vec3_madd(vec3_scale(camera->right, cosine), -sine, camera->forward);
    ray.down = vec3_madd(vec3_scale(camera->down, level), -below, ahead);
    return ray;
}

static PinholeRay pinhole_ray(const Camera *camera, double x, double y) {
    if (camera->kind == CAMERA_SPHERICAL) {
        return spherical_ray(camera, x, y);
    }
    double across = (x - camera->center_x) * camera->pixel;
    double downward = (y - camera->center_y) * camera->pixel;
    Vec3 offset = vec3_add(vec3_scale(camera->right, across), vec3_scale(camera->down, downward));
    PinholeRay ray = {camera->from, camera->forward, camera->right, camera->down};
    if (camera->kind == CAMERA_ORTHOGRAPHIC) {
        ray.origin = vec3_add(camera->from, offset);
    } else {
        ray.dir = vec3_add(camera->forward, offset);
    }
    return ray;
}

void camera_ray(const Camera *camera, double x, double y, Vec3 *origin, Vec3 *dir) {
    PinholeRay ray = pinhole_ray(camera, x, y);
    *origin = ray.origin;
    *dir = camera->kind == CAMERA_ORTHOGRAPHIC ? ray.dir : vec3_normalize(ray.dir);
}

// A point of the unit disc, or of the polygon in it: right and down.
static void lens_point(uint32_t blades, double u, double v, double *right, double *down) {
    double sine, cosine;
    if (blades == 0) {
        sampling_turn(v, &sine, &cosine);
        *right = sqrt(u) * sine;
        *down = -sqrt(u) * cosine;
        return;
    }
    // One triangle from the middle to two corners after the other, each uniform by itself.
    double which = fmin(floor(u * blades), blades - 1.0), r = sqrt(u * blades - which);
    double next_sine, next_cosine;
    sampling_turn(which / blades, &sine, &cosine);
    sampling_turn((which + 1) / blades, &next_sine, &next_cosine);
    *right = r * ((1 - v) * sine + v * next_sine);
    *down = -r * ((1 - v) * cosine + v * next_cosine);
}

void camera_lens_ray(const Camera *camera, double x, double y, double u, double v, Vec3 *origin,
                     Vec3 *dir) {
    PinholeRay ray = pinhole_ray(camera, x, y);
    double right, down;
    lens_point(camera->blades, u, v, &right, &down);
    Vec3 off = vec3_add(vec3_scale(ray.right, right * camera->radius),
                        vec3_scale(ray.down, down * camera->radius));
    *origin = vec3_add(ray.origin, off);
    *dir = vec3_normalize(vec3_madd(ray.dir, -1 / camera->focus, off));
}

// By the programs' own arc tangent, so that the sampling of motion does not depend on the
// processor.
static bool project_spherical(const Camera *camera, Vec3 relative, double *x, double *y,
                              double *scale) {
    double ahead = vec3_dot(relative, camera->forward), right = vec3_dot(relative, camera->right);
    double down = vec3_dot(relative, camera->down), distance = vec3_length(relative);
    if (!(distance > 0)) {
        return false;
    }
    double longitude = program_fold(OP_ATAN2, right, ahead, 0);
    double latitude = program_fold(OP_ATAN2, down, hypot(right, ahead), 0);
    *scale = 1 / (camera->pixel * distance);
    *x = camera->center_x + longitude / (2 * SAMPLING_PI) * camera->width;
    *y = camera->center_y + latitude / SAMPLING_PI * camera->height;
    return true;
}

double camera_depth(const Camera *camera, Vec3 point) {
    Vec3 relative = vec3_sub(point, camera->from);
    return camera->kind == CAMERA_SPHERICAL ? vec3_length(relative)
                                            : vec3_dot(relative, camera->forward);
}

bool camera_project(const Camera *camera, Vec3 point, double *x, double *y, double *scale) {
    Vec3 relative = vec3_sub(point, camera->from);
    double depth = vec3_dot(relative, camera->forward);
    if (camera->kind == CAMERA_SPHERICAL) {
        return project_spherical(camera, relative, x, y, scale);
    }
    if (!(depth > 0)) {
        return false;
    }
    *scale = 1 / (camera->kind == CAMERA_ORTHOGRAPHIC ? camera->pixel : camera->pixel * depth);
    *x = camera->center_x + vec3_dot(relative, camera->right) * *scale;
    *y = camera->center_y + vec3_dot(relative, camera->down) * *scale;
    return true;
}
