// SPDX-License-Identifier: Apache-2.0
// The inside of the path tracer, shared by its files: they follow paths (render/path.c), find what
// their rays meet (render/path_surface.c) and ask the lights (render/path_light.c).
#ifndef RENDER_PATH_PARTS_H
#define RENDER_PATH_PARTS_H

#include "render/path.h"

// Of sample dimensions behind those of the scene's lights: few emitters, what is drawn of many, the
// sky's image.
enum { PATH_CHOSEN_SETS = LIGHT_CHOICE_FEW + LIGHT_CHOICE_DRAWN + 1 };
// What light passes through: glass that absorbs, or nothing.
typedef struct {
    bool absorbs;
    double per_metre[3];
} Medium;

// What is known of a path at its present end.
typedef struct {
    const Sampler *sampler;
    uint32_t index;
    uint32_t depth;     // bounces so far
    Vec3 origin, dir;   // of the ray that is followed; unit
    double weight[3];   // of what it brings
    double specular[3]; // of what it brings from lights with an area
    double density;     // with which its direction was drawn; 0: a mirror
    Vec3 facing;        // path_facing of the surface that it leaves
    uint32_t emitter;   // that it leaves; UINT32_MAX: none
    double color[3];    // collected
    bool has_scattered; // by what is no mirror
    double shade;       // share of what is behind the catchers that its ray went through
    Medium medium;      // of its ray
    // Of the bundle of rays that a pixel is: metres across at the origin, and how many more for
    // each metre on; only where a material looks around.
    double width, spread;
    uint32_t n_chances; // random numbers drawn for what surfaces are
} Path;

// A place on a surface, seen from the viewer's side.
typedef struct {
    SurfacePoint point, beside[2];
    SurfaceSlope slope; // where the material looks around
    bool has_beside;
    Vec3 x, y, N, Ng;  // the shading frame; both normals on the viewer's side
    Vec3 wo;           // towards the viewer, in the frame
    Vec3 start;        // where rays leave
    Vec3 through;      // where rays leave that go through the surface
    bool is_inside;    // the viewer is behind the surface
    double distance;   // from the path's origin
    uint32_t emitter;  // of the frame's; UINT32_MAX: none
    uint32_t object;   // that was met
    uint32_t material; // of it, no mix
    double values[BSDF_MAX_OUT];
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

// ---- render/path_surface.c

// Normals towards the viewer, and starts for rays beyond the error of the point.
void path_orient(Vertex *vertex, Vec3 dir);

// As whom to ask the world: only where it makes a difference.
RayKind path_ask_as(const PathTracer *tracer, RayKind kind);

// Whether rays may go through surfaces.
bool path_goes_through(const PathTracer *tracer);

// The share of the light from there, up to tmax, that nothing stops: of a light (NULL) as shadow
// rays see it, of an emitter as the bounces that find it too.
double path_unhindered(PathTracer *tracer, Vec3 origin, Vec3 dir, double tmax,
                       const Emitter *emitter);

// The next surface that the path's ray does not go through: vertex->distance, INFINITY: there is
// none, and vertex->material, what it is there.
bool path_next_surface(PathTracer *tracer, Path *path, Vertex *vertex);

// How it scatters. False: an output of its program is not finite (noted).
bool path_set_material(PathTracer *tracer, const Path *path, Vertex *vertex);

// Where a ray towards dir leaves the surface. False: not where its frame has it, a shading normal
// tells of a side that is not there.
bool path_leave(const Vertex *vertex, Vec3 dir, bool is_through, Vec3 *start);

// What a ray that leaves the surface passes through; the path's ray came to it.
Medium path_medium(const Path *path, const Vertex *vertex, bool is_through);
// What is left of light of that color after so many metres.
double path_medium_left(const Medium *medium, int color, double distance);

// ---- render/path_light.c

// Light of lamps, suns and areas that the path's ray meets; its next surface is so far away.
void path_meet_lights(PathTracer *tracer, Path *path, double distance);
// Whether a path may go on to meet a light: one that is near by any weight, others by the specular
// part of it.
bool path_may_meet_lights(const PathTracer *tracer, bool is_specular);
// The sky at the end of the path's ray, the share that did not come by shadow rays.
void path_meet_sky(PathTracer *tracer, Path *path);
// The part of what a surface glows that a path which found it brings: the rest came by shadow rays.
double path_glow_share(PathTracer *tracer, const Path *path, const Vertex *vertex);
// On which side of it a surface sees lights, for light_tree_sample: 0: on both.
Vec3 path_facing(const Vertex *vertex);
// Light by shadow rays. is_followed: the path goes on, and may meet lights with an area.
void path_ask_lights(PathTracer *tracer, Path *path, const Vertex *vertex, bool is_followed);
// The share of the light that reaches a catcher, of what would without anything in between.
double path_lit_share(PathTracer *tracer, Path *path, const Vertex *vertex);

#endif
