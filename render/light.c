// SPDX-License-Identifier: Apache-2.0
// Suns, lamps and skies: evaluation at an instant and sampling.
#include "render/light.h"

#include "render/sampling.h"

// Outputs of each kind's program.
static const int n_out[] = {
    [LIGHT_SUN] = 8, [LIGHT_LAMP] = 8, [LIGHT_SKY] = 4, [LIGHT_SPOT] = 13, [LIGHT_AREA] = 14};

enum { MAX_OUT = 14 };

bool light_is_moving(const Light *light) {
    return program_reads_time(light->gradient) || program_reads_time(light->program) ||
           program_reads_time(light->visible);
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
    *light = (LightAt){.kind = LIGHT_SUN,
                       .at = vec3_scale(towards, 1 / length),
                       .has_area = sine * sine > 0,
                       .spread = 2 * quarter_sine * quarter_sine};
    // A disc of radiance L gives pi sin^2 L on a surface that faces its centre.
    double area = light->has_area ? SAMPLING_PI * sine * sine : 1;
    scaled_color(light->color, out + 4, out[3] / area);
    return true;
}

// out: centre, power, r g b, radius.
static bool lamp_at(const double *out, LightAt *light) {
    *light =
        (LightAt){.kind = LIGHT_LAMP, .at = vec3(out[0], out[1], out[2]), .radius = fabs(out[7])};
    double r2 = light->radius * light->radius;
    light->has_area = r2 > 0;
    // A ball of radiance L has intensity pi r^2 L in every direction.
    double area = light->has_area ? SAMPLING_PI * r2 : 1;
    scaled_color(light->color, out + 4, out[3] / (4 * SAMPLING_PI) / area);
    return true;
}

// out: as a lamp, axis, cone, edge.
static bool spot_at(const double *out, LightAt *light) {
    Vec3 axis = vec3(out[8], out[9], out[10]);
    double length = vec3_length(axis);
    if (!(length > 0) || !isfinite(length) || !lamp_at(out, light)) {
        return false;
    }
    light->kind = LIGHT_SPOT;
    light->axis = vec3_scale(axis, 1 / length);
    light->outer = fmin(0.5 * fabs(out[11]), SAMPLING_PI);
    light->inner = fmax(light->outer - fabs(out[12]), 0);
    light->cos_outer = program_fold(OP_COS, light->outer, 0, 0);
    light->cos_inner = program_fold(OP_COS, light->inner, 0, 0);
    return true;
}

// out: middle, power, r g b, two-sided, half edges.
static bool area_at(const double *out, LightAt *light) {
    *light = (LightAt){.kind = LIGHT_AREA,
                       .at = vec3(out[0], out[1], out[2]),
                       .half_u = vec3(out[8], out[9], out[10]),
                       .half_v = vec3(out[11], out[12], out[13]),
                       .two_sided = out[7] != 0,
                       .has_area = true};
    Vec3 normal = vec3_cross(light->half_u, light->half_v);
    double quarter = vec3_length(normal);
    if (!isfinite(quarter)) {
        return false;
    }
    light->size = 4 * quarter;
    if (quarter > 0) { // else it is dark: nothing shines
        light->axis = vec3_scale(normal, 1 / quarter);
        // A side of radiance L sends out pi L from each square metre.
        double sides = light->two_sided ? 2 : 1;
        scaled_color(light->color, out + 4, out[3] / (SAMPLING_PI * light->size * sides));
    }
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

// What the program gave, as a light. False: not finite.
static bool shape_light(LightKind kind, const double *out, LightAt *at) {
    switch (kind) {
    case LIGHT_SUN:
        return sun_at(out, at);
    case LIGHT_LAMP:
        return lamp_at(out, at);
    case LIGHT_SPOT:
        return spot_at(out, at);
    case LIGHT_AREA:
        return area_at(out, at);
    case LIGHT_SKY:
        break;
    }
    return false;
}

bool light_at(const Light *light, double seconds, LightAt *at, bool *bad) {
    double in[IN_COUNT] = {[IN_T] = seconds, [IN_FILM_T] = seconds}, out[MAX_OUT];
    if (!is_visible(light, in)) {
        return false;
    }
    program_run1(light->program, in, out);
    if (!all_finite(out, n_out[light->kind]) || !shape_light(light->kind, out, at) ||
        !all_finite(at->color, 3)) {
        *bad = true;
        return false;
    }
    return !is_dark(at->color);
}

// False: not finite.
static bool add_sky(LightSet *set, const Light *light, const double in[IN_COUNT]) {
    double out[MAX_OUT], sky[3];
    if (!is_visible(light, in)) {
        return true;
    }
    program_run1(light->program, in, out);
    if (!all_finite(out, light->image ? 5 : n_out[LIGHT_SKY])) {
        return false;
    }
    scaled_color(sky, out, out[3]);
    for (int c = 0; c < 3; c++) {
        set->sky[c] += sky[c];
    }
    if (light->gradient || light->image) {
        set->painted = light;
    }
    if (light->image) {
        set->turn_cosine = program_fold(OP_COS, out[4], 0, 0);
        set->turn_sine = program_fold(OP_SIN, out[4], 0, 0);
    }
    return all_finite(sky, 3);
}

void light_set_at(const Scene *scene, double seconds, LightSet *set, bool *bad) {
    double in[IN_COUNT] = {[IN_T] = seconds, [IN_FILM_T] = seconds};
    *set = (LightSet){.lights = set->lights, .only_far = set->only_far};
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        const Light *light = &scene->lights[i];
        bool is_bad = false;
        if (set->only_far && light->kind != LIGHT_SKY && light->kind != LIGHT_SUN) {
            continue;
        }
        if (light->kind == LIGHT_SKY) {
            is_bad = !add_sky(set, light, in);
        } else if (light_at(light, seconds, &set->lights[set->n], &is_bad)) {
            set->has_area |= set->lights[set->n].has_area;
            set->is_near |= light_is_near(&set->lights[set->n]);
            set->n++;
        }
        if (is_bad && bad) {
            bad[i] = true;
        }
    }
}

// To where a direction lies in the sky's image, and back.
static Vec3 turn_back(const LightSet *set, Vec3 dir) {
    return vec3(set->turn_cosine * dir.x - set->turn_sine * dir.z, dir.y,
                set->turn_sine * dir.x + set->turn_cosine * dir.z);
}

static Vec3 turn(const LightSet *set, Vec3 dir) {
    return vec3(set->turn_cosine * dir.x + set->turn_sine * dir.z, dir.y,
                set->turn_cosine * dir.z - set->turn_sine * dir.x);
}

void light_sky(const LightSet *set, double seconds, Vec3 dir, double rgb[3], bool *bad) {
    double paint[3] = {1, 1, 1};
    if (set->painted && set->painted->gradient) {
        const double in[IN_COUNT] = {[IN_T] = seconds,
                                     [IN_FILM_T] = seconds,
                                     [IN_PX] = dir.x,
                                     [IN_PY] = dir.y,
                                     [IN_PZ] = dir.z};
        program_run1(set->painted->gradient, in, paint);
        if (!all_finite(paint, 3)) {
            *bad = true;
            paint[0] = paint[1] = paint[2] = 0;
        }
    } else if (set->painted) {
        sky_image_radiance(set->painted->image, turn_back(set, dir), paint);
    }
    for (int c = 0; c < 3; c++) {
        rgb[c] = paint[c] > 0 ? set->sky[c] * paint[c] : 0;
    }
}

bool light_sky_is_sampled(const LightSet *set) {
    return set->painted && set->painted->image && set->painted->image->rows;
}

bool light_sky_sample(const LightSet *set, double u, double v, LightSample *sample) {
    bool bad;
    Vec3 dir = sky_image_sample(set->painted->image, u, v, &sample->density);
    sample->dir = turn(set, dir);
    sample->distance = INFINITY;
    light_sky(set, 0, sample->dir, sample->weight, &bad);
    for (int c = 0; c < 3; c++) {
        sample->weight[c] /= sample->density;
    }
    return sample->density > 0;
}

double light_sky_density(const LightSet *set, Vec3 dir) {
    return light_sky_is_sampled(set) ? sky_image_density(set->painted->image, turn_back(set, dir))
                                     : 0;
}

double light_share(const LightAt *light, Vec3 dir) {
    if (light->kind == LIGHT_AREA) {
        return light->two_sided || vec3_dot(dir, light->axis) > 0 ? 1 : 0;
    }
    if (light->kind != LIGHT_SPOT) {
        return 1;
    }
    double cosine = vec3_dot(dir, light->axis);
    if (cosine >= light->cos_inner) {
        return 1;
    }
    if (!(cosine > light->cos_outer)) {
        return 0;
    }
    double angle = program_fold(OP_ACOS, cosine, 0, 0);
    double x = (light->outer - angle) / (light->outer - light->inner);
    x = x < 0 ? 0 : x > 1 ? 1 : x;
    return x * x * (3 - 2 * x);
}

static void fill(LightSample *sample, const LightAt *light, double scale, double density) {
    scale *= light_share(light, vec3_scale(sample->dir, -1));
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

static bool sample_area(const LightAt *light, Vec3 from, double u, double v, LightSample *sample) {
    Vec3 at = vec3_madd(vec3_madd(light->at, 2 * u - 1, light->half_u), 2 * v - 1, light->half_v);
    Vec3 towards = vec3_sub(at, from);
    double d2 = vec3_dot(towards, towards);
    if (!(d2 > 0) || !isfinite(d2)) {
        return false;
    }
    sample->distance = sqrt(d2);
    sample->dir = vec3_scale(towards, 1 / sample->distance);
    double cosine = fabs(vec3_dot(sample->dir, light->axis));
    double angle = light->size * cosine / d2;
    if (!(angle > 0) || !isfinite(1 / angle)) {
        return false;
    }
    fill(sample, light, angle, 1 / angle);
    return sample->weight[0] + sample->weight[1] + sample->weight[2] > 0;
}

bool light_sample(const LightAt *light, Vec3 from, double u, double v, LightSample *sample) {
    switch (light->kind) {
    case LIGHT_SUN:
        return sample_sun(light, u, v, sample);
    case LIGHT_AREA:
        return sample_area(light, from, u, v, sample);
    case LIGHT_LAMP:
    case LIGHT_SPOT:
        return sample_lamp(light, from, u, v, sample);
    case LIGHT_SKY:
        break;
    }
    return false;
}

static bool hit_sun(const LightAt *light, Vec3 dir, double tmax, LightHit *hit) {
    // |a - b|^2 = 2 (1 - cos): exact for the smallest discs.
    Vec3 apart = vec3_sub(dir, light->at);
    hit->distance = INFINITY;
    hit->density = 1 / (2 * SAMPLING_PI * light->spread);
    return tmax == INFINITY && vec3_dot(apart, apart) <= 2 * light->spread;
}

static bool hit_lamp(const LightAt *light, Vec3 from, Vec3 dir, double tmax, LightHit *hit) {
    Vec3 towards = vec3_sub(light->at, from);
    double d2 = vec3_dot(towards, towards), r2 = light->radius * light->radius;
    double along = vec3_dot(towards, dir);
    Vec3 aside = vec3_madd(towards, -along, dir);
    double inside2 = r2 - vec3_dot(aside, aside);
    if (!(d2 > r2) || !(along > 0) || !(inside2 > 0)) {
        return false;
    }
    hit->distance = along - sqrt(inside2);
    hit->density = 1 / (2 * SAMPLING_PI * ball_spread(r2 / d2));
    return hit->distance < tmax;
}

static bool hit_area(const LightAt *light, Vec3 from, Vec3 dir, double tmax, LightHit *hit) {
    double cosine = vec3_dot(dir, light->axis);
    double t = vec3_dot(vec3_sub(light->at, from), light->axis) / cosine;
    if (!(t > 0 && t < tmax) || !isfinite(t)) {
        return false;
    }
    // In the plane, as (u, v) of the half edges: by the edges' cross products.
    Vec3 q = vec3_sub(vec3_madd(from, t, dir), light->at);
    double quarter = light->size / 4;
    double u = vec3_dot(vec3_cross(q, light->half_v), light->axis) / quarter;
    double v = vec3_dot(vec3_cross(light->half_u, q), light->axis) / quarter;
    hit->distance = t;
    hit->density = t * t / (light->size * fabs(cosine));
    return fabs(u) <= 1 && fabs(v) <= 1;
}

bool light_hit(const LightAt *light, Vec3 from, Vec3 dir, double tmax, LightHit *hit) {
    if (!light->has_area) {
        return false;
    }
    return light->kind == LIGHT_SUN    ? hit_sun(light, dir, tmax, hit)
           : light->kind == LIGHT_AREA ? hit_area(light, from, dir, tmax, hit)
                                       : hit_lamp(light, from, dir, tmax, hit);
}
