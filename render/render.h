// SPDX-License-Identifier: Apache-2.0
// From a scene to pictures on disk: the only door that the command uses.
#ifndef RENDER_RENDER_H
#define RENDER_RENDER_H

#include <stdio.h>

#include "accel/accel.h"
#include "render/scene.h"

// Warnings and errors of the renderer about a place in the scene. name: the warning's stable name
// ("not-finite", "tolerance-missed", "degenerate", "fast-rotation", ...; the table is
// render/warnings.def), NULL for an error. Called from one thread at a time.
typedef struct {
    void (*emit)(void *context, SourceRef where, const char *name, const char *message);
    void *context;
} Reporter;

// The ending of files of exact sums (render/film_file.h).
#define RENDER_FILM_ENDING ".st4film"

typedef enum { PROGRESS_NONE, PROGRESS_BAR, PROGRESS_JSON } ProgressKind;

// Called for each frame whose picture is there: was_there, before this run. What it returns, unless
// it is 0, ends the run as its exit status.
typedef int FrameFinished(void *context, int64_t frame, bool was_there);

// What ended a frame whose samples are allotted by need.
typedef enum { STOP_NOISE, STOP_SAMPLES, STOP_TIME, RENDER_STOPS } RenderStop;

// Samples per pixel in the mean that bound such a frame where nobody gives a bound.
enum { RENDER_SPP_UNBOUNDED = 1 << 16 };

typedef struct {
    const int64_t *frames; // film frame numbers in the order to render, n_frames >= 1
    uint32_t n_frames;
    const char *out; // pattern: #### or %04d is the frame number; the ending is the format
    uint32_t spp;    // >= 1
    uint32_t first_sample, last_sample; // of each pixel, from 1 to spp: a slice, whose `out` is a
                                        // file of sums; 0, 0: all
    // Samples go where the noise is (render/adaptive.h), until one of three bounds is reached:
    // mean_spp, samples per pixel in the mean of the picture, spp being that rounded up; noise, the
    // relative RMSE, 0: none; seconds, for each frame with its share in the sampling and building
    // of its block, 0: none. Without slices and subframes.
    bool is_adaptive;
    double mean_spp, noise, seconds;
    double
        began; // of clock_seconds: the run, which the first block shares; 0: with the first block
    uint32_t subframes; // >= 1: so many sharp pictures add up to a frame (render/accumulate.h), spp
                        // a multiple of it; 0: every sample has an instant of its own
    bool is_still; // a world of one instant, at which the shutter opens: vertices stand as they
                   // are then, in static structures; n_frames is 1 (for subframes)
    // Pixels [x0, x1) of the lines [y0, y1) alone, x right and y down; all 0: the whole picture.
    uint32_t crop_x0, crop_x1, crop_y0, crop_y1;
    bool has_layers; // in place of the film's:
    uint32_t layers; // a set
    uint64_t seed;
    double tolerance;   // pixels; 0: as each shape says
    uint32_t n_threads; // >= 1
    size_t memory;      // bytes for vertex arrays and trees of a block of frames; 0: 4 GiB
    const AccelType *accel;
    AccelOptions accel_options;
    bool bake;          // everything into one tree
    bool validate;      // check every structure after its build (tests)
    double checkpoint;  // seconds between two checkpoints of a frame; 0: none, not even when
                        // interrupted
    bool resume;        // go on from checkpoints; leave pictures that this run would make the same
    bool skip_existing; // leave pictures that are there, and frames that other processes lock
    FrameFinished *finished; // NULL: none
    void *finished_context;
    ProgressKind progress;    // to stderr
    const char *software;     // name and version of the program, for the header of the file
    const char *command_line; // for the header of the file: what changes the picture but for the
                              // number of samples, which is added to it, so that files are equal
                              // whatever the threads, the memory, the other frames and the slices
} RenderOptions;

typedef struct {
    double parse_seconds, sample_seconds, segment_seconds, build_seconds, trace_seconds,
        write_seconds;
    size_t vertex_bytes, segment_bytes, tree_bytes;
    uint64_t n_objects, n_triangles, n_spheres, n_keys, n_blocks;
    uint64_t n_structures, n_unbuilt; // in all blocks; those that no ray came to
    uint64_t n_frames;                // pictures written
    uint64_t n_skipped_frames;        // that were there, or that others have locked
    uint64_t camera_rays, shadow_rays, bounce_rays;
    uint64_t vertex_evaluations;                        // vertices times instants
    uint64_t lens_samples, light_samples, time_samples; // drawn; 0 where the scene needs none
    uint64_t film_samples;                              // of all pixels
    uint64_t dropped_samples;                           // not finite, counted as black
    // Of frames whose samples were allotted by need:
    uint64_t n_stopped[RENDER_STOPS]; // by what
    double noise_reached;             // relative RMSE, estimated; of the worst frame
    double mean_samples;              // per pixel, over all frames
    double tolerance_reached;         // pixels, the largest estimated error of the sampled motion
    AccelStats accel;                 // summed over objects and blocks (kappa: of all)
    AccelCounters rays;
} RenderStats;

// Whether a frame is more than one instant: what makes its picture changes while a shutter is open.
bool render_scene_blurs(const Scene *scene);

// An exit status: 0 fine; 1 an error of the scene that only sampling could find; 3 output that can
// not be written (checked before the first ray as far as it can be); 130 interrupted. Pictures that
// were finished stay.
int render_frames(const Scene *scene, const RenderOptions *options, const Reporter *reporter,
                  RenderStats *stats);

// Where the checkpoint of a picture is: its path and ".checkpoint". False: size is too small.
bool render_checkpoint_path(const char *picture, char *path, size_t size);

// What `st4 check` says of a shape without tracing: how its motion was sampled in these frames.
typedef struct {
    const Shape *shape;
    uint32_t n_keys;         // instants sampled, 1: does not deform
    double pixels_per_frame; // the fastest vertex that the camera sees, but for jumps
    double error_pixels;     // estimated, of linear motion between the instants
    size_t bytes;            // of vertex arrays, all instances
    uint32_t n_prototypes;   // vertex arrays that its instances need, each with a tree
    bool moves_as_body;      // its transform depends on time
} ShapeMotion;

// What a run of these frames will need.
typedef struct {
    size_t array_bytes; // of vertex arrays, in the largest block
    size_t bytes;       // with the trees over them, roughly
    uint32_t n_blocks;  // of frames
} CheckTotals;

typedef void ShapeMotionSink(void *context, const ShapeMotion *motion);
int render_check(const Scene *scene, const RenderOptions *options, const Reporter *reporter,
                 ShapeMotionSink *sink, void *context, CheckTotals *totals);

// The file name of one frame: "#" runs (or one %0Nd) replaced by the number; if the pattern has
// neither and many is true, the number goes before the ending as ".%04d". False: the pattern is
// malformed (two runs, another % sequence) or size is too small.
bool render_frame_path(const char *pattern, int64_t frame, bool many, char *path, size_t size);

// Frames per second as the rational of least denominator within a millionth: 24000/1001 too.
void render_rate(double fps, int32_t *numerator, uint32_t *denominator);

// The statistics file: JSON, versioned. False with a sentence in message.
bool render_write_stats(const char *path, const RenderStats *stats, char *message, size_t n);

#endif
