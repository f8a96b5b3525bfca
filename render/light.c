// SPDX-License-Identifier: Apache-2.0
// Suns, lamps and skies: evaluation at an instant and sampling.
#include "render/light.h"

#include "render/sampling.h"

enum { MAX_OUT = 8 };

// Outputs of each kind's program.
static const int n_out[] = {[LIGHT_SUN] = 8, [LIGHT_LAMP] = 8, [LIGHT_SKY] = 4};

bool light_is_moving(const Light *light) {
    return program_reads(light->program, IN_T) || program_reads(light->program, IN_FILM_T) ||
           program_reads(light->visible, IN_T) || program_reads(light->visible, IN_FILM_T);
}

static void scaled_color(double color[3], const double *rgb, double scale) {
    for (int c = 0; c < 3; c++) {
        color[c] = rgb[c] > 0 && scale > 0 ? rgb[c] * scale : 0;
    }
}

// out: direction, power, r g b, angle.
static bool sun_at(const double *out, LightAt *light) {
    Vec3 towards = vec3(out[0], out[1], out[2]);
    double length = vec3_length(towards);
    if (!(length > 0) || !isfinite(length)) {
        return false;
    }
    double half = 0.5 * fabs(out[7]);
    half = half < SAMPLING_PI / 2 ? half : SAMPLING_PI / 2;
    double sine = program_fold(OP_SIN, half, 0, 0);
    double quarter_sine = program_fold(OP_SIN, half / 2, 0, 0);
    *light = (LightAt){.at = vec3_scale(towards, 1 / length),
                       .is_sun = true,
                       .has_area = sine * sine > 0,
                       .spread = 2 * quarter_sine * quarter_sine};
    // A disc of radiance L gives pi sin^2 L on a surface that faces its centre.
    double area = light->has_area ? SAMPLING_PI * sine * sine : 1;
    scaled_color(light->color, out + 4, out[3] / area);
    return true;
}

// out: centre, power, r g b, radius.
static bool lamp_at(const double *out, LightAt *light) {
    *light = (LightAt){.at = vec3(out[0], out[1], out[2]), .radius = fabs(out[7])};
    double r2 = light->radius * light->radius;
    light->has_area = r2 > 0;
    // A ball of radiance L has intensity pi r^2 L in every direction.
    double area = light->has_area ? SAMPLING_PI * r2 : 1;
    scaled_color(light->color, out + 4, out[3] / (4 * SAMPLING_PI) / area);
    return true;
}

static bool all_finite(const double *values, int n) {
    for (int i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

static bool is_visible(const Light *light, const double in[IN_COUNT]) {
    double visible = 1;
    if (light->visible) {
        program_run1(light->visible, in, &visible);
    }
    return visible != 0;
}

static bool is_dark(const double color[3]) {
    return color[0] == 0 && color[1] == 0 && color[2] == 0;
}

static bool add_light(LightSet *set, const Light *light, const double in[IN_COUNT]) {
    double out[MAX_OUT];
    program_run1(light->program, in, out);
    if (!all_finite(out, n_out[light->kind])) {
        return false;
    }
    LightAt *at = &set->lights[set->n];
    double sky[3];
    switch (light->kind) {
    case LIGHT_SKY:
        scaled_color(sky, out, out[3]);
        for (int c = 0; c < 3; c++) {
            set->sky[c] += sky[c];
        }
        return all_finite(sky, 3);
    case LIGHT_SUN:
        if (!sun_at(out, at)) {
            return false;
        }
        break;
    case LIGHT_LAMP:
        if (!lamp_at(out, at)) {
            return false;
        }
        break;
    }
    if (!all_finite(at->color, 3)) {
        return false;
    }
    set->n += is_dark(at->color) ? 0 : 1;
    return true;
}

void light_set_at(const Scene *scene, double seconds, LightSet *set, bool *bad) {
    double in[IN_COUNT] = {[IN_T] = seconds, [IN_FILM_T] = seconds};
    set->n = 0;
    set->sky[0] = set->sky[1] = set->sky[2] = 0;
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        const Light *light = &scene->lights[i];
        if (is_visible(light, in) && !add_light(set, light, in) && bad) {
            bad[i] = true;
        }
    }
}

static void fill(LightSample *sample, const LightAt *light, double scale, double density) {
    for (int c = 0; c < 3; c++) {
        sample->weight[c] = light->color[c] * scale;
    }
    sample->density = density;
}

static Vec3 in_cone(Vec3 axis, double spread, double u, double v) {
    Vec3 x, y;
    sampling_frame(axis, &x, &y);
    return sampling_to_world(x, y, axis, sampling_cone(spread, u, v));
}

static bool sample_sun(const LightAt *light, double u, double v, LightSample *sample) {
    sample->distance = INFINITY;
    sample->dir = light->at;
    if (!light->has_area) {
        fill(sample, light, 1, 0);
        return true;
    }
    double angle = 2 * SAMPLING_PI * light->spread;
    sample->dir = in_cone(light->at, light->spread, u, v);
    fill(sample, light, angle, 1 / angle);
    return true;
}

// 1 - cos of the half angle under which a ball appears whose radius has this share of the distance,
// squared, without cancellation.
static double ball_spread(double share2) {
    return share2 / (1 + sqrt(1 - share2));
}

static bool sample_lamp(const LightAt *light, Vec3 from, double u, double v, LightSample *sample) {
    Vec3 towards = vec3_sub(light->at, from);
    double d2 = vec3_dot(towards, towards), d = sqrt(d2), r2 = light->radius * light->radius;
    if (!(d2 > r2) || !isfinite(d2)) {
        return false;
    }
    Vec3 axis = vec3_scale(towards, 1 / d);
    if (!light->has_area) {
        sample->dir = axis;
        sample->distance = d;
        fill(sample, light, 1 / d2, 0);
        return true;
    }
    double spread = ball_spread(r2 / d2), angle = 2 * SAMPLING_PI * spread;
    sample->dir = in_cone(axis, spread, u, v);
    double along = vec3_dot(towards, sample->dir);
    Vec3 aside = vec3_madd(towards, -along, sample->dir);
    double inside2 = r2 - vec3_dot(aside, aside);
    sample->distance = along - (inside2 > 0 ? sqrt(inside2) : 0);
    fill(sample, light, angle, 1 / angle);
    return sample->distance > 0;
}

bool light_sample(const LightAt *light, Vec3 from, double u, double v, LightSample *sample) {
    return light->is_sun ? sample_sun(light, u, v, sample) : sample_lamp(light, from, u, v, sample);
}

static bool hit_sun(const LightAt *light, Vec3 dir, double tmax, double *density) {
    // |a - b|^2 = 2 (1 - cos): exact for the smallest discs.
    Vec3 apart = vec3_sub(dir, light->at);
    *density = 1 / (2 * SAMPLING_PI * light->spread);
    return tmax == INFINITY && vec3_dot(apart, apart) <= 2 * light->spread;
}

static bool hit_lamp(const LightAt *light, Vec3 from, Vec3 dir, double tmax, double *density) {
    Vec3 towards = vec3_sub(light->at, from);
    double d2 = vec3_dot(towards, towards), r2 = light->radius * light->radius;
    double along = vec3_dot(towards, dir);
    Vec3 aside = vec3_madd(towards, -along, dir);
    double inside2 = r2 - vec3_dot(aside, aside);
    if (!(d2 > r2) || !(along > 0) || !(inside2 > 0)) {
        return false;
    }
    *density = 1 / (2 * SAMPLING_PI * ball_spread(r2 / d2));
    return along - sqrt(inside2) < tmax;
}

bool light_hit(const LightAt *light, Vec3 from, Vec3 dir, double tmax, double *density) {
    if (!light->has_area) {
        return false;
    }
    return light->is_sun ? hit_sun(light, dir, tmax, density)
                         : hit_lamp(light, from, dir, tmax, density);
}
