// SPDX-License-Identifier: Apache-2.0
// Light transport: paths from the camera, each at one instant, which everything on it shares.
//
// At each surface the lights, and what glows, are asked by shadow rays (render/light_choice.h) and
// one direction is followed, for `bounces` bounces; one ray more looks for the sky, for what glows
// and, from rough metals and coats, for the lights' own shapes. What can be found both ways is
// weighted by the balance heuristic, with the densities of the path's own instant. Beyond the
// fourth bounce a path survives with the probability of its weight, which is divided by it.
//
// After a bounce that was no mirror's, metals, coats and glass count as at least PATH_ROUGH: what
// would be a caustic, a few samples of enormous weight, becomes a soft one (Kaplanyan and
// Dachsbacher, "Path space regularization", 2013). Mirrors that the camera sees, in other mirrors
// too, stay mirrors, and smooth glass stays clear.
//
// Glass takes part in shadows like everything else: the light that it lets through is found by the
// directions that paths follow. What it absorbs within is taken off along each ray from where it
// enters to where it leaves, or ends at something inside; of glass within glass the inner one
// counts.
//
// Where a surface is not opaque, a path meets it with the probability of its opacity, and else goes
// on as if it were not there; to shadow rays it lets through what is left. A catcher is not there
// either, but takes off the weight of what is behind it the share of the light that does not reach
// it: of each light, and of the sky in one direction, as much as it would send there unhindered.
//
// Who sees a shape: its own light, and what stands in the way of it, are matters of bounces, which
// find it as well; what stands in the way of other lights is a matter of shadow rays, and of
// bounces where a mirror shows a light.
#ifndef RENDER_PATH_H
#define RENDER_PATH_H

#include "render/camera.h"
#include "render/film.h"
#include "render/filter.h"
#include "render/light.h"
#include "render/light_choice.h"
#include "render/material.h"
#include "render/sampler.h"
#include "render/world.h"

#define PATH_ROUGH 0.5

// What all threads share while a scene is rendered: what need not be asked at each ray.
typedef struct {
    const Scene *scene;
    Filter filter;
    Materials materials;
    bool draws_time; // something moves and the shutter is no instant
    bool is_delayed; // something moves and pixels have a time of their own
    bool camera_moves, lights_move;
    bool has_sky;
    bool is_selective;  // some rays pass through what others meet
    uint32_t n_sets;    // of sample dimensions, for each surface of a path
    LightChoice choice; // of the frame; empty before path_scene_frame
    // Where the shutter is no instant but one of several that share a pixel's samples
    // (render/accumulate.h): its place in [0, 1].
    double instant;
} PathScene;

// The camera must not be automatic any more.
void path_scene_init(PathScene *paths, Arena *arena, const Scene *scene);

// For the rays of one frame in this world: with the lights that they choose from, in the arena.
PathScene path_scene_frame(const PathScene *paths, Arena *arena, const World *world, int64_t frame);

// Whether anything in the scene depends on time.
bool path_scene_is_moving(const Scene *scene);

typedef struct {
    uint64_t camera_rays, shadow_rays, bounce_rays;
    uint64_t lens_samples, light_samples, time_samples, film_samples, dropped_samples;
} PathCounters;

// What was found not to be finite at some instant, for warnings after the frame.
typedef struct {
    bool camera, *lights, *materials;
} PathTroubles;

// One thread's state. lights.lights and troubles' arrays have room for all of the scene's.
typedef struct {
    const PathScene *paths;
    WorldView *view;
    int64_t frame; // number; 1 is the first
    uint32_t x, y; // the pixel at hand
    double delay;  // its shutter's
    double seconds;
    Camera camera;
    LightSet lights;
    PathCounters counters;
    PathTroubles troubles;
} PathTracer;

// frame: its number. Begins in its first pixel, in the middle of the open interval.
void path_tracer_init(PathTracer *tracer, Arena *arena, const PathScene *paths, WorldView *view,
                      int64_t frame);

// Sample `index` of pixel (x, y); adds it to the film.
void path_trace(PathTracer *tracer, const Sampler *sampler, uint32_t x, uint32_t y, uint32_t index,
                Film *film);

#endif
