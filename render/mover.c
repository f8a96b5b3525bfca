// SPDX-License-Identifier: Apache-2.0
// What moves: running the programs of points over all or some of them.
#include "render/mover.h"

#include <string.h>

#include "render/mesh_track.h"

bool program_reads_loops(const Program *program) {
    return program && program_inputs(program) & LOOP_INPUTS;
}

bool mover_moves(const Mover *mover) {
    for (uint32_t i = 0; i < mover->n_parts; i++) {
        const MoverPart *part = &mover->parts[i];
        if (part->fade || program_reads_time(part->points) || program_reads_time(part->transform) ||
            (part->track && part->track->n_keys > 1)) {
            return true;
        }
    }
    return false;
}

void mover_set_loops(ProgramInputs *in, const Shape *shape, uint32_t instance) {
    for (uint32_t k = 0; k < shape->n_loops; k++) {
        in->at[IN_LOOP0 + k] = &shape->loops[(size_t)instance * shape->n_loops + k];
    }
}

void shape_inputs(const Shape *shape, const double *loops, double seconds, double in[IN_COUNT]) {
    memset(in, 0, IN_COUNT * sizeof *in);
    in[IN_T] = in[IN_FILM_T] = seconds;
    for (uint32_t k = 0; k < shape->n_loops; k++) {
        in[IN_LOOP0 + k] = loops[k];
    }
}

bool shape_is_visible(const Shape *shape, const double *loops, double seconds) {
    double in[IN_COUNT], seen;
    if (!shape->visible) {
        return true;
    }
    shape_inputs(shape, loops, seconds, in);
    program_run1(shape->visible, in, &seen);
    return program_is_true(seen);
}

bool affine_run_at(const Program *transform, double t, Affine *out) {
    double in[IN_COUNT] = {[IN_T] = t};
    return affine_run(transform, in, out);
}

bool affine_from_rows(const double rows[12], Affine *out) {
    double sum = 0;
    for (int i = 0; i < 12; i++) {
        out->m[i / 4][i % 4] = rows[i];
        sum += rows[i] * 0;
    }
    return sum == 0;
}

bool affine_run(const Program *transform, const double in[IN_COUNT], Affine *out) {
    double rows[12];
    *out = affine_identity();
    if (!transform) {
        return true;
    }
    program_run1(transform, in, rows);
    return affine_from_rows(rows, out);
}

// Column c of an array of rows of `stride` values.
static double *column(Arena *arena, const double *rows, size_t n, size_t stride, size_t c) {
    double *values = ARENA_ARRAY(arena, n, double);
    for (size_t i = 0; i < n; i++) {
        values[i] = rows[i * stride + c];
    }
    return values;
}

static double *column_float(Arena *arena, const float *rows, size_t n, size_t stride, size_t c) {
    double *values = ARENA_ARRAY(arena, n, double);
    for (size_t i = 0; rows && i < n; i++) {
        values[i] = rows[i * stride + c];
    }
    return values;
}

// Normals of the rest pose where the file has none: the sum of the faces around each vertex.
static float *rest_normals(Arena *arena, const Mesh *mesh) {
    float *normals = ARENA_ARRAY(arena, (size_t)mesh->n_vertices * 3, float);
    Vec3 *sums = ARENA_ARRAY(arena, mesh->n_vertices, Vec3);
    for (uint32_t f = 0; f < mesh->n_triangles; f++) {
        const uint32_t *v = &mesh->index[3 * (size_t)f];
        const double *a = &mesh->position[3 * (size_t)v[0]], *b = &mesh->position[3 * (size_t)v[1]],
                     *c = &mesh->position[3 * (size_t)v[2]];
        Vec3 n = vec3_cross(vec3(b[0] - a[0], b[1] - a[1], b[2] - a[2]),
                            vec3(c[0] - a[0], c[1] - a[1], c[2] - a[2]));
        for (int k = 0; k < 3 && vec3_is_finite(n); k++) {
            sums[v[k]] = vec3_add(sums[v[k]], n);
        }
    }
    for (uint32_t i = 0; i < mesh->n_vertices; i++) {
        Vec3 n = vec3_normalize(sums[i]);
        normals[3 * (size_t)i] = (float)n.x;
        normals[3 * (size_t)i + 1] = (float)n.y;
        normals[3 * (size_t)i + 2] = (float)n.z;
    }
    return normals;
}

static double *counting(Arena *arena, size_t n) {
    double *values = ARENA_ARRAY(arena, n, double);
    for (size_t i = 0; i < n; i++) {
        values[i] = (double)i;
    }
    return values;
}

MoverPart mover_mesh(Arena *arena, const Shape *shape, uint32_t instance) {
    const Mesh *mesh = shape->mesh;
    size_t n = mesh->n_vertices;
    MoverPart part = {.n = n,
                      .rest = mesh->position,
                      .track = shape->track,
                      .points = shape->vertex,
                      .fade = shape->fade};
    mover_set_loops(&part.in, shape, instance);
    const float *normal = mesh->normal;
    for (uint32_t input = 0; input < IN_COUNT; input++) {
        if (!program_reads(part.points, input)) {
            continue;
        }
        const double *values = NULL;
        if (input == IN_U || input == IN_V) {
            values = column_float(arena, mesh->uv, n, 2, input - IN_U);
        } else if (input >= IN_PX && input <= IN_PZ) {
            values = column(arena, mesh->position, n, 3, input - IN_PX);
        } else if (input >= IN_NX && input <= IN_NZ) {
            normal = normal ? normal : rest_normals(arena, mesh);
            values = column_float(arena, normal, n, 3, input - IN_NX);
        } else if (input == IN_I) {
            values = counting(arena, n);
        }
        if (values) {
            part.in.at[input] = values;
            part.in.varying |= 1u << input;
        }
    }
    return part;
}

// Maps points[c][0..n) by matrices of 12 rows, one for all (stride 0) or one for each (stride 1). A
// radius grows with the cube root of the volume: exact for similarities.
static void transform_points(const double *const rows[12], size_t stride, size_t n, uint32_t width,
                             double *const out[4]) {
    for (size_t i = 0; i < n; i++) {
        Affine map;
        for (int k = 0; k < 12; k++) {
            map.m[k / 4][k % 4] = rows[k][i * stride];
        }
        Vec3 p = affine_point(&map, vec3(out[0][i], out[1][i], out[2][i]));
        out[0][i] = p.x;
        out[1][i] = p.y;
        out[2][i] = p.z;
        if (width == 4) {
            out[3][i] *= cbrt(fabs(affine_det(&map)));
        }
    }
}

static void apply_transform(const MoverPart *part, const ProgramInputs *in, uint32_t width,
                            Arena *scratch, double *const out[4]) {
    bool is_varying = program_inputs(part->transform) & in->varying;
    size_t n = is_varying ? part->n : 1;
    double *rows[12];
    for (int k = 0; k < 12; k++) {
        rows[k] = ARENA_ARRAY(scratch, n, double);
    }
    program_run(part->transform, in, n, rows);
    transform_points((const double *const *)rows, is_varying, part->n, width, out);
}

// The track's places: themselves what is wanted, or what the program takes for p.
static void run_track(const MoverPart *part, double seconds, ProgramInputs *in, Arena *scratch,
                      double *const out[4]) {
    double *p[3] = {out[0], out[1], out[2]};
    for (int c = 0; c < 3 && part->points; c++) {
        p[c] = ARENA_ARRAY(scratch, part->n, double);
        in->at[IN_PX + c] = p[c];
        in->varying |= 1u << (IN_PX + c);
    }
    track_run(part->track, seconds, part->which, part->first, part->n, p);
}

// The points at one time of theirs.
static void run_points(const MoverPart *part, double seconds, uint32_t width, Arena *scratch,
                       double *const out[4]) {
    ProgramInputs in = part->in;
    in.at[IN_T] = in.at[IN_FILM_T] = &seconds;
    if (part->track) {
        run_track(part, seconds, &in, scratch, out);
    }
    if (part->points) {
        program_run(part->points, &in, part->n, out);
    } else if (!part->track) {
        for (size_t i = 0; i < part->n; i++) {
            for (uint32_t c = 0; c < width; c++) {
                out[c][i] = part->rest[width * i + c];
            }
        }
    }
}

static void run_fade(const MoverPart *part, double seconds, uint32_t width, Arena *scratch,
                     double *const out[4]) {
    double times[3], *const to[3] = {&times[0], &times[1], &times[2]}, *now[4];
    ProgramInputs in = part->in;
    in.at[IN_T] = in.at[IN_FILM_T] = &seconds;
    in.varying = 0;
    program_run(part->fade, &in, 1, to);
    double weight = times[2];
    if (weight <= 0 || weight >= 1) {
        run_points(part, times[weight >= 1], width, scratch, out);
        return;
    }
    for (uint32_t c = 0; c < width; c++) {
        now[c] = ARENA_ARRAY(scratch, part->n, double);
    }
    run_points(part, times[0], width, scratch, out);
    run_points(part, times[1], width, scratch, now);
    for (uint32_t c = 0; c < width; c++) {
        for (size_t i = 0; i < part->n; i++) {
            out[c][i] = (1 - weight) * out[c][i] + weight * now[c][i];
        }
    }
}

static void run_part(const MoverPart *part, double seconds, uint32_t width, Arena *scratch,
                     double *const out[4]) {
    if (part->fade) {
        run_fade(part, seconds, width, scratch, out);
    } else {
        run_points(part, seconds, width, scratch, out);
    }
    if (part->transform) {
        ProgramInputs in = part->in;
        in.at[IN_T] = in.at[IN_FILM_T] = &seconds;
        apply_transform(part, &in, width, scratch, out);
    }
}

// The elements [first, first + n) of a part.
static MoverPart slice_part(const MoverPart *part, size_t first, size_t n, uint32_t width) {
    MoverPart slice = *part;
    slice.n = n;
    slice.rest = part->rest ? part->rest + width * first : NULL;
    slice.which = part->which ? part->which + first : NULL;
    slice.first = part->first + first;
    for (uint32_t input = 0; input < IN_COUNT; input++) {
        if (part->in.varying >> input & 1) {
            slice.in.at[input] += first;
        }
    }
    return slice;
}

void mover_run_some(const Mover *mover, size_t first, size_t n, double seconds, Arena *scratch,
                    double *const out[4]) {
    size_t begin = 0, end = first + n; // the part's first element; the last asked for
    for (uint32_t i = 0; i < mover->n_parts && begin < end; begin += mover->parts[i++].n) {
        size_t lo = first > begin ? first - begin : 0;
        size_t hi = mover->parts[i].n < end - begin ? mover->parts[i].n : end - begin;
        if (lo >= hi) {
            continue;
        }
        MoverPart slice = slice_part(&mover->parts[i], lo, hi - lo, mover->width);
        size_t to = begin + lo - first;
        double *const at[4] = {out[0] + to, out[1] + to, out[2] + to,
                               mover->width == 4 ? out[3] + to : NULL};
        run_part(&slice, seconds, mover->width, scratch, at);
    }
}

void mover_run(const Mover *mover, double seconds, Arena *scratch, double *const out[4]) {
    mover_run_some(mover, 0, mover->n, seconds, scratch, out);
}

static MoverPart subset_part(Arena *arena, const MoverPart *part, const uint32_t *which, size_t n,
                             size_t first, uint32_t width) {
    MoverPart small = *part;
    small.n = n;
    if (part->rest) {
        double *rest = ARENA_ARRAY(arena, width * n, double);
        for (size_t i = 0; i < n; i++) {
            memcpy(&rest[width * i], &part->rest[width * (which[i] - first)], width * sizeof *rest);
        }
        small.rest = rest;
    }
    if (part->track) {
        uint32_t *own = ARENA_ARRAY(arena, n, uint32_t);
        for (size_t i = 0; i < n; i++) {
            own[i] = which[i] - (uint32_t)first;
        }
        small.which = own;
    }
    for (uint32_t input = 0; input < IN_COUNT; input++) {
        if (part->in.varying >> input & 1) {
            double *values = ARENA_ARRAY(arena, n, double);
            for (size_t i = 0; i < n; i++) {
                values[i] = part->in.at[input][which[i] - first];
            }
            small.in.at[input] = values;
        }
    }
    return small;
}

Mover mover_subset(Arena *arena, const Mover *mover, const uint32_t *which, size_t n) {
    Mover small = {.width = mover->width, .n = n};
    small.parts = ARENA_ARRAY(arena, mover->n_parts, MoverPart);
    size_t first = 0, taken = 0;
    for (uint32_t i = 0; i < mover->n_parts; i++) {
        size_t end = taken;
        while (end < n && which[end] < first + mover->parts[i].n) {
            end++;
        }
        if (end > taken) {
            small.parts[small.n_parts++] = subset_part(arena, &mover->parts[i], which + taken,
                                                       end - taken, first, mover->width);
        }
        first += mover->parts[i].n;
        taken = end;
    }
    return small;
}
