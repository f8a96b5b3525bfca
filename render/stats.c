// SPDX-License-Identifier: Apache-2.0
// The statistics file: every field of RenderStats, as JSON.
#include "render/render.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accel/cpu.h"
#include "render/outfile.h"

enum { VERSION = 1 };

typedef struct {
    FILE *file;
    bool has_members; // of the object that is open
} Json;

static void open_object(Json *json, const char *name) {
    fprintf(json->file, "%s\n  \"%s\": {", json->has_members ? "," : "", name);
    json->has_members = false;
}

static void close_object(Json *json) {
    fputs("\n  }", json->file);
    json->has_members = true;
}

static void name_member(Json *json, const char *name) {
    fprintf(json->file, "%s\n    \"%s\": ", json->has_members ? "," : "", name);
    json->has_members = true;
}

static void count(Json *json, const char *name, uint64_t value) {
    name_member(json, name);
    fprintf(json->file, "%llu", (unsigned long long)value);
}

// JSON has no infinities and no NaN.
static void real(Json *json, const char *name, double value) {
    name_member(json, name);
    if (isfinite(value)) {
        fprintf(json->file, "%.9g", value);
    } else {
        fputs("null", json->file);
    }
}

static void write_seconds(Json *json, const RenderStats *stats) {
    open_object(json, "seconds");
    real(json, "parse", stats->parse_seconds);
    real(json, "sample", stats->sample_seconds);
    real(json, "segment", stats->segment_seconds);
    real(json, "build", stats->build_seconds);
    real(json, "trace", stats->trace_seconds);
    real(json, "write", stats->write_seconds);
    close_object(json);
}

static void write_scene(Json *json, const RenderStats *stats) {
    open_object(json, "bytes");
    count(json, "vertices", stats->vertex_bytes);
    count(json, "segments", stats->segment_bytes);
    count(json, "tree", stats->tree_bytes);
    count(json, "peak", stats->accel.peak_bytes);
    close_object(json);
    open_object(json, "scene");
    count(json, "objects", stats->n_objects);
    count(json, "triangles", stats->n_triangles);
    count(json, "spheres", stats->n_spheres);
    count(json, "keys", stats->n_keys);
    count(json, "blocks", stats->n_blocks);
    count(json, "frames", stats->n_frames);
    count(json, "structures", stats->n_structures);
    count(json, "unbuilt", stats->n_unbuilt);
    count(json, "skipped_frames", stats->n_skipped_frames);
    count(json, "vertex_evaluations", stats->vertex_evaluations);
    real(json, "tolerance_reached", stats->tolerance_reached);
    close_object(json);
}

static void write_samples(Json *json, const RenderStats *stats) {
    open_object(json, "samples");
    count(json, "film", stats->film_samples);
    count(json, "time", stats->time_samples);
    count(json, "lens", stats->lens_samples);
    count(json, "light", stats->light_samples);
    count(json, "dropped", stats->dropped_samples);
    close_object(json);
}

// Of pictures whose samples were allotted by need.
static void write_quality(Json *json, const RenderStats *stats) {
    static const char *const names[RENDER_STOPS] = {"ended_by_noise", "ended_by_samples",
                                                    "ended_by_time"};
    open_object(json, "quality");
    for (int i = 0; i < RENDER_STOPS; i++) {
        count(json, names[i], stats->n_stopped[i]);
    }
    real(json, "noise", stats->noise_reached);
    real(json, "samples_per_pixel", stats->mean_samples);
    close_object(json);
}

static void write_tree(Json *json, const AccelStats *stats) {
    open_object(json, "tree");
    real(json, "segment_seconds", stats->segment_seconds);
    real(json, "build_seconds", stats->build_seconds);
    count(json, "bytes", stats->tree_bytes);
    count(json, "segment_bytes", stats->segment_bytes);
    count(json, "primitives", stats->n_prims);
    count(json, "segments", stats->n_segments);
    count(json, "nodes", stats->n_nodes);
    count(json, "leaves", stats->n_leaves);
    count(json, "references", stats->n_references);
    count(json, "time_splits", stats->n_time_splits);
    count(json, "depth", stats->n_depth);
    count(json, "dropped", stats->n_dropped);
    real(json, "kappa_min", stats->kappa_min);
    real(json, "kappa_median", stats->kappa_median);
    real(json, "kappa_max", stats->kappa_max);
    close_object(json);
    open_object(json, "leaves_by");
    for (int i = 0; i < LEAF_REASONS; i++) {
        count(json, leaf_reason_names[i], stats->leaves_by[i]);
    }
    close_object(json);
}

static void write_rays(Json *json, const RenderStats *stats) {
    const AccelCounters *rays = &stats->rays;
    open_object(json, "rays");
    count(json, "camera", stats->camera_rays);
    count(json, "shadow", stats->shadow_rays);
    count(json, "bounce", stats->bounce_rays);
    count(json, "traced_in_objects", rays->rays);
    count(json, "nodes", rays->nodes);
    count(json, "tests", rays->prim_tests);
    double all = (double)(stats->camera_rays + stats->shadow_rays + stats->bounce_rays);
    real(json, "nodes_per_ray", (double)rays->nodes / all);
    real(json, "tests_per_ray", (double)rays->prim_tests / all);
    close_object(json);
}

static char *format(const RenderStats *stats, size_t *size) {
    char *text = NULL;
    FILE *file = open_memstream(&text, size);
    if (!file) {
        return NULL;
    }
    fprintf(file, "{\n  \"version\": %d,\n  \"cpu\": \"%s\"", VERSION, cpu_names[cpu_now()]);
    Json json = {file, true};
    write_seconds(&json, stats);
    write_scene(&json, stats);
    write_samples(&json, stats);
    write_quality(&json, stats);
    write_rays(&json, stats);
    write_tree(&json, &stats->accel);
    fputs("\n}\n", file);
    if (fclose(file)) {
        free(text);
        return NULL;
    }
    return text;
}

bool render_write_stats(const char *path, const RenderStats *stats, char *message, size_t n) {
    size_t size;
    char *text = format(stats, &size);
    if (!text) {
        snprintf(message, n, "cannot write: %s", strerror(errno));
        return false;
    }
    OutFile file;
    bool is_written = outfile_open(&file, path, message, n) &&
                      outfile_write(&file, text, size, message, n) &&
                      outfile_commit(&file, message, n);
    free(text);
    return is_written;
}
