// SPDX-License-Identifier: Apache-2.0
// What the sampling of a scene has to say: warnings about its shapes.
#include "render/report.h"

#include <stdarg.h>
#include <stdio.h>

enum {
    INSTANCES = 64, // of a shape, whose transforms are looked at
    INSTANTS = 8,   // within an opening, besides its ends
};

void report_warning(const Reporter *reporter, SourceRef where, const char *name, const char *format,
                    ...) {
    char message[512];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    if (reporter && reporter->emit) {
        reporter->emit(reporter->context, where, name, message);
    }
}

void report_error(const Reporter *reporter, SourceRef where, const char *message) {
    if (reporter && reporter->emit) {
        reporter->emit(reporter->context, where, NULL, message);
    }
}

// Triangles without area in the rest pose. Those with just two corners at one place, as at the
// poles of a surface, leave no hole and count only where no triangle has area.
void report_prototypes(const Reporter *reporter, const Shape *shape, uint32_t n) {
    enum { MANY = 64 };
    if (shape->clock && n > MANY) {
        report_warning(reporter, shape->where, "prototypes",
                       "the %u instances of %s need %u vertex arrays and trees: what moves their "
                       "vertices differs between them",
                       shape->n_instances, shape->label, n);
    }
}

void report_degenerate(const Reporter *reporter, const Shape *shape) {
    const Mesh *mesh = shape->mesh;
    uint32_t n_flat = 0, n_poles = 0;
    for (size_t f = 0; f < mesh->n_triangles; f++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const double *x = &mesh->position[3 * (size_t)mesh->index[3 * f + k]];
            p[k] = vec3(x[0], x[1], x[2]);
        }
        Vec3 a = vec3_sub(p[1], p[0]), b = vec3_sub(p[2], p[0]), c = vec3_sub(p[2], p[1]);
        if (vec3_length(vec3_cross(a, b)) == 0) {
            int n_zero = (vec3_dot(a, a) == 0) + (vec3_dot(b, b) == 0) + (vec3_dot(c, c) == 0);
            n_poles += n_zero == 1;
            n_flat += n_zero != 1;
        }
    }
    n_flat = n_flat + n_poles == mesh->n_triangles ? mesh->n_triangles : n_flat;
    if (mesh->n_triangles == 0) {
        report_warning(reporter, shape->where, "degenerate",
                       "%s has no triangle with an area: it is not seen", shape->label);
    } else if (n_flat > 0) {
        report_warning(reporter, shape->where, "degenerate",
                       "%u of the %u triangles of %s have no area and are not seen", n_flat,
                       mesh->n_triangles, shape->label);
    }
}

static void report_not_finite(const Reporter *reporter, const Form *form) {
    const char *points = form->kind == GEOMETRY_SPHERES ? "spheres" : "vertices";
    for (uint32_t k = 0; k < form->geometry.n_keys; k++) {
        if (form->n_not_finite[k] > 0 && form->moves) {
            report_warning(reporter, form->shape->where, "not-finite",
                           "%u of the %u %s of %s are not finite at t = %.9g s and are left out",
                           form->n_not_finite[k], form->geometry.n_vertices, points,
                           form->shape->label, form->key_seconds[k]);
            return;
        }
        if (form->n_not_finite[k] > 0) {
            report_warning(reporter, form->shape->where, "not-finite",
                           "%u of the %u %s of %s are not finite and are left out",
                           form->n_not_finite[k], form->geometry.n_vertices, points,
                           form->shape->label);
            return;
        }
    }
}

// Of what deforms: a point or a line along an axis at every instant.
static void report_collapsed(const Reporter *reporter, const Form *form) {
    uint32_t k = 0, n = form->geometry.n_keys;
    for (; k < n; k++) {
        Vec3 size = vec3_sub(form->bounds[k].hi, form->bounds[k].lo);
        if ((size.x > 0) + (size.y > 0) + (size.z > 0) > 1 || bounds_are_empty(form->bounds[k])) {
            return;
        }
    }
    if (n > 0 && form->kind == GEOMETRY_TRIANGLES && form->shape->vertex) {
        report_warning(reporter, form->shape->where, "degenerate",
                       "what moves the vertices of %s leaves it no area: it is not seen",
                       form->shape->label);
    }
}

void report_sampling(const Reporter *reporter, const Form *form) {
    const SampleReport *r = &form->report;
    const Shape *shape = form->shape;
    if (form->geometry.n_keys > 0) {
        report_not_finite(reporter, form);
        report_collapsed(reporter, form);
    }
    if (r->has_too_many_breaks) {
        report_warning(reporter, shape->where, "tolerance-missed",
                       "the motion of %s jumps more than %d times in a frame; it is sampled at "
                       "1/%d of a frame and may be off there",
                       shape->label, SAMPLE_MAX_CUTS, SAMPLE_MAX_CUTS);
    }
    if (r->is_missed && form->sampler.samples > 0) {
        report_warning(reporter, shape->where, "tolerance-missed",
                       "with samples = %u the motion of %s is off by up to %.3g px (tolerance: "
                       "%.3g px)",
                       form->sampler.samples, shape->label, r->error, form->sampler.tolerance);
    } else if (r->is_missed) {
        report_warning(
            reporter, shape->where, "tolerance-missed",
            "the motion of %s, sampled at 1/%d of a frame, is still off by up to %.3g px "
            "(tolerance: %.3g px)",
            shape->label, SAMPLE_MAX_CUTS, r->error, form->sampler.tolerance);
    }
    if (r->is_fast_rotation) {
        report_warning(reporter, shape->where, "fast-rotation",
                       "with samples = %u %s turns more than a quarter turn between two samples",
                       form->sampler.samples, shape->label);
    }
}

static bool transform_is_finite(const Shape *shape, uint32_t instance, double seconds) {
    double in[IN_COUNT];
    Affine map;
    shape_inputs(shape, shape_loops(shape, instance), seconds, in);
    return affine_run(shape->transform, in, &map);
}

static bool report_transform_at(const Reporter *reporter, const Shape *shape, double seconds) {
    uint32_t n = shape->n_instances < INSTANCES ? shape->n_instances : INSTANCES;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t instance = (uint32_t)((uint64_t)i * shape->n_instances / n);
        if (!transform_is_finite(shape, instance, seconds)) {
            report_warning(reporter, shape->where, "not-finite",
                           "the transform of %s is not finite at t = %.9g s; it is not there then",
                           shape->label, seconds);
            return true;
        }
    }
    return false;
}

// A transform that flattens all there is, for good.
static void report_flat(const Reporter *reporter, const Shape *shape) {
    uint32_t n = shape->n_instances < INSTANCES ? shape->n_instances : INSTANCES;
    for (uint32_t i = 0; i < n; i++) {
        double in[IN_COUNT];
        Affine map;
        uint32_t instance = (uint32_t)((uint64_t)i * shape->n_instances / n);
        shape_inputs(shape, shape_loops(shape, instance), 0, in);
        if (!affine_run(shape->transform, in, &map) || affine_det(&map) != 0) {
            return;
        }
    }
    report_warning(reporter, shape->where, "degenerate",
                   "the transform of %s leaves it no extent: it is not seen", shape->label);
}

void report_transforms(const Reporter *reporter, const Scene *scene, const Opening *openings,
                       size_t n) {
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        const Shape *shape = &scene->shapes[s];
        bool moves = program_reads_time(shape->transform), is_done = !shape->transform;
        if (shape->transform && !moves) {
            report_flat(reporter, shape);
        }
        for (size_t i = 0; i < (moves ? n : 1) && !is_done; i++) {
            for (int k = 0; k <= INSTANTS + 1 && !is_done; k++) {
                const Opening *o = &openings[i];
                double frac = o->lo + (o->hi - o->lo) * k / (INSTANTS + 1);
                is_done = report_transform_at(
                    reporter, shape, instant_seconds((Instant){o->frame, frac}, scene->film.fps));
            }
        }
    }
}
