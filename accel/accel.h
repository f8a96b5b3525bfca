// SPDX-License-Identifier: Apache-2.0
// The one interface of all ray-query structures over moving geometry.
//
// Geometry is K sets of vertices ("keys"); between neighbouring keys every vertex moves linearly. A
// ray carries its place in time as (key, f): span `key` lies between keys `key` and `key + 1`, and
// a vertex is at fma(f, b - a, a). What the keys mean in seconds is the caller's affair; the
// structures see only how long each span is. Within a structure time is counted in whole ticks,
//
//     tick(key, f) = key * TICKS_PER_SPAN + min(floor(f * TICKS_PER_SPAN), TICKS_PER_SPAN - 1),
//
// which is exact for every float f in [0, 1], so that no rounding can put a ray on the wrong side
// of a split in time. f = 1 belongs to the last tick of its own span: the next span may be a gap.
//
// All structures run the same float kernels (accel/intersect.h) on the same vertices, so every
// structure gives the same hit for the same ray, bit for bit: the least distance, at equal
// distances the lowest primitive.
#ifndef ACCEL_ACCEL_H
#define ACCEL_ACCEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { TICKS_PER_SPAN = 16, ACCEL_MAX_KEYS = 1 << 26, ACCEL_NO_PRIM = -1 };

typedef enum { GEOMETRY_TRIANGLES, GEOMETRY_SPHERES } GeometryKind;

// Borrowed by the structure that is built over it: must outlive it, unchanged.
// Coordinates are in the object's frame (see accel/frame.h), where the rest pose has extent <= 1.
typedef struct {
    GeometryKind kind;
    uint32_t n_prims;      // triangles, or spheres
    uint32_t n_vertices;   // spheres: n_prims (vertex i is the centre of sphere i)
    uint32_t n_keys;       // >= 1; 1: nothing moves
    const uint32_t *index; // [n_prims][3], each < n_vertices; spheres: NULL
    const float *position; // [n_keys][n_vertices][3]
    const float *radius;   // [n_keys][n_vertices] for spheres, else NULL; <= 0: absent
    // [n_keys - 1], relative length of each span, >= 0; a span that no ray can fall into (a gap
    // between shutters, a break) has 0. NULL: all equal.
    const double *span_share;
} Geometry;

static inline uint32_t accel_tick(uint32_t key, float f) {
    uint32_t i = f > 0 ? (uint32_t)(f * TICKS_PER_SPAN) : 0;
    return key * TICKS_PER_SPAN + (i < TICKS_PER_SPAN ? i : TICKS_PER_SPAN - 1);
}

// origin + t * dir, tmin < t <= tmax. dir need not be of unit length; t is in units of dir.
// key in [0, max(n_keys - 2, 0)], f in [0, 1]. Anything not finite (but tmax) is a miss, and so
// is what is farther away than t = 1e37.
typedef struct {
    float origin[3], dir[3];
    float tmin, tmax; // tmin may be negative (accel/frame.h)
    float f;
    uint32_t key;
} AccelRay;

typedef struct {
    float t;
    int32_t prim; // ACCEL_NO_PRIM: nothing was hit, and nothing else here is set
    float u, v;   // barycentric weights of the second and third vertex of index[prim]; spheres: 0
} AccelHit;

// Why leaves were made, in order of priority (the thesis, 4.1.1: the criteria must be ordered).
typedef enum {
    LEAF_BY_MEMORY,     // no bytes left for two more nodes and their lists
    LEAF_BY_DEPTH,      // max_depth
    LEAF_BY_DEGENERATE, // the cell cannot be cut any further in float
    LEAF_BY_SIZE,       // at most leaf_size primitives
    LEAF_BY_COST,       // no split is cheaper than testing all
    LEAF_BY_EMPTY,      // nothing in the cell
    LEAF_REASONS
} LeafReason;

extern const char *const leaf_reason_names[LEAF_REASONS]; // "memory", "depth", ...

typedef struct {
    double kappa;       // equation 4 of the thesis; > 1, default 2
    uint32_t leaf_size; // a cell of at most so many primitives is not split; default 8
    uint32_t max_depth; // 0: 8 + 1.3 log2(segments) + 4, at most 60
    size_t memory;      // bytes that the structure may take, build included; 0: no bound
    size_t kept;        // bytes that it may take once it is built; 0: as memory
    bool split_time;    // kd4-thesis only: false makes a 3D tree over the same segments
    uint32_t n_threads; // for the build; the result does not depend on it
} AccelOptions;

AccelOptions accel_options_default(void);

typedef struct {
    double segment_seconds, build_seconds;
    size_t tree_bytes, segment_bytes, peak_bytes;
    uint64_t n_prims, n_segments, n_nodes, n_leaves, n_references, n_time_splits;
    uint64_t n_depth; // of the deepest leaf
    uint64_t leaves_by[LEAF_REASONS];
    uint64_t n_dropped; // primitives left out on some span because a vertex is not finite there
    double kappa_min, kappa_median, kappa_max; // swept over initial half area, of the segments
} AccelStats;

// Counted per thread by the caller and added up at the end.
typedef struct {
    uint64_t rays, nodes, prim_tests;
} AccelCounters;

typedef struct Accel Accel;

typedef struct {
    const char *name; // as after --accel
    const char *help; // one line
    // Never fails for want of memory within options->memory (the tree gets coarser instead).
    Accel *(*build)(const Geometry *geometry, const AccelOptions *options, AccelStats *stats);
    bool (*closest)(const Accel *accel, const AccelRay *ray, AccelHit *hit, AccelCounters *count);
    bool (*occluded)(const Accel *accel, const AccelRay *ray, AccelCounters *count);
    // Checks every invariant of the structure; false with a sentence in why[n].
    bool (*validate)(const Accel *accel, char *why, size_t n);
    void (*destroy)(Accel *accel);
} AccelType;

// The one table of structures; ends with a NULL name. The first is the default.
extern const AccelType accel_types[];
const AccelType *accel_find(const char *name); // NULL: unknown

// Every structure begins with its type.
struct Accel {
    const AccelType *type;
};

// The oracle: every primitive, in double arithmetic throughout, by a formula that shares nothing
// with the float kernel (Moeller and Trumbore 1997, for spheres the quadratic of the exact
// centre). margin gets the least distance of the hit point from an edge of its triangle,
// in barycentric units, or, on a miss, how far the ray is from hitting anything.
typedef struct {
    double t, u, v, margin;
    double second_t; // of the next primitive behind or at the same place; INFINITY: none
    int32_t prim, second_prim;
} OracleHit;

bool accel_oracle(const Geometry *geometry, const AccelRay *ray, OracleHit *hit);

#endif
