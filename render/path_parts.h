// SPDX-License-Identifier: Apache-2.0
// The inside of the path tracer, shared by its files (render/path*.c).
#ifndef RENDER_PATH_PARTS_H
#define RENDER_PATH_PARTS_H

#include "render/path.h"

// Of sample dimensions behind those of the scene's lights: few emitters, what is drawn of many, the
// sky's image.
enum { PATH_CHOSEN_SETS = LIGHT_CHOICE_FEW + LIGHT_CHOICE_DRAWN + 1 };

// What is known of a path at its present end.
typedef struct {
    const Sampler *sampler;
    uint32_t index;
    uint32_t depth;     // bounces so far
    Vec3 origin, dir;   // of the ray that is followed; unit
    double weight[3];   // of what it brings
    double specular[3]; // of what it brings from lights with an area
    double density;     // with which its direction was drawn; 0: a mirror
    Vec3 normal;        // of the surface that it leaves, on the side of the ray
    double color[3];    // collected
    bool has_scattered; // by what is no mirror
} Path;

// A place on a surface, seen from the viewer's side.
typedef struct {
    SurfacePoint point;
    Vec3 x, y, N, Ng; // the shading frame; both normals on the viewer's side
    Vec3 wo;          // towards the viewer, in the frame
    Vec3 start;       // where rays leave
    WorldHit hit;     // how it was found
    Bsdf bsdf;
} Vertex;

static inline void add_scaled(double color[3], const double weight[3], const double light[3],
                              double scale) {
    for (int c = 0; c < 3; c++) {
        color[c] += weight[c] * light[c] * scale;
    }
}

static inline double max3(const double v[3]) {
    double m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

// The set of sample dimensions of the path's present surface: 0 is its direction, 1 + i light i,
// behind the lights are those of emitters and of the tree.
static inline uint32_t sample_set(const PathTracer *tracer, const Path *path, uint32_t which) {
    return SAMPLE_SET_PATH + path->depth * tracer->paths->n_sets + which;
}

// The point of an emitter as seen along dir, and how it glows there, in bsdf.emission. False: the
// material is not finite there.
bool path_emission(PathTracer *tracer, Vertex *vertex, Vec3 dir);

// How a material glows, for light_choice_new; context: the PathScene.
GlowFunction path_glow;

// ---- render/path_light.c

// Light of lamps, suns and areas that the path's ray meets before tmax. By shadow rays they were
// counted with the other share at the surface before.
void path_meet_lights(PathTracer *tracer, Path *path, double tmax);
// Whether a path may go on to meet a light: one that is near by any weight, others by the specular
// part of it.
bool path_may_meet_lights(const PathTracer *tracer, bool is_specular);
// The sky at the end of the path's ray, the share that did not come by shadow rays.
void path_meet_sky(PathTracer *tracer, Path *path);
// The part of what a surface glows that a path which found it brings: the rest came by shadow rays.
double path_glow_share(PathTracer *tracer, const Path *path, const Vertex *vertex);
// Light by shadow rays. is_followed: the path goes on, and may meet lights with an area.
void path_ask_lights(PathTracer *tracer, Path *path, const Vertex *vertex, bool is_followed);

#endif
