// SPDX-License-Identifier: Apache-2.0
// What a simulation comes to: for each member the course of a few scalars, as polynomials over
// spans of time, so that it can be asked for any instant in any order.
//
// A member's course falls into *arcs*, between whose ends it may jump or bend (events, contacts),
// an arc into *pieces*, which join smoothly. Pieces are found by a search: member m begins at the
// key m * spacing, spacing being more than the span is long; arc a of all, likewise, at
// a * spacing. The value of column c in piece i at time t is the polynomial in
// s = (t - piece_start[i]) * piece_rate[i] whose coefficient of s^k is
// coefficient[(c * n_coefficients + k) * n_pieces + i].
#ifndef RENDER_SIM_H
#define RENDER_SIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"

enum { SIM_COEFFICIENTS = 6, SIM_MESSAGE = 256 };

typedef struct {
    uint32_t n_members, n_columns, n_coefficients;
    uint32_t n_arcs, n_pieces;
    uint32_t n_resting, first_resting; // members that came to rest by too many events; the first
    double rest_time;                  // when that was
    double low, high;                  // seconds that the simulation spans
    double spacing;                    // a power of two above high - low
    const double *birth, *end;         // [n_members] first and last instant of its course
    const double *born, *dies;         // [n_members] it is there from born until before dies
    const double *arc_key;             // [n_arcs]: m * spacing + start - low
    const double *piece_key;           // [n_pieces]: a * spacing + start - low
    const double *piece_start, *piece_rate;
    const double *coefficient;
} SimTracks;

// Why a simulation has no result: of which member, when, in a sentence without either.
typedef struct {
    uint32_t member;
    double time;
    char message[SIM_MESSAGE];
} SimFailure;

// Told of what is done: 0..1. May be NULL.
typedef void SimProgress(void *context, double part);

// ---- A course under construction

typedef struct {
    double start, end; // seconds
    bool begins_arc;
} SimPiece;

// Memory of its own, until sim_course_free. Zeroed but for n_columns and n_coefficients: empty.
typedef struct {
    uint32_t n_columns, n_coefficients;
    uint32_t n;
    size_t capacity;
    SimPiece *pieces;
    double *coefficients; // [n][n_columns][n_coefficients]
    bool is_failed;       // there was no memory
} SimCourse;

// Appends a piece, end > start, which begins where the last one ends. coefficients: copied; NULL:
// zeros, for the caller to fill in. Returns where they are, NULL: no memory.
double *sim_course_add(SimCourse *course, SimPiece piece, const double *coefficients);

// Makes the pieces from `first` on, all of one arc, fewer and longer where the difference stays
// below tolerance * max(1, |x|) in every column. n_coefficients must be 6.
void sim_course_merge(SimCourse *course, uint32_t first, double tolerance);

// The value of a column at t within piece i.
double sim_course_value(const SimCourse *course, uint32_t piece, uint32_t column, double t);

void sim_course_free(SimCourse *course);

// The quintic on s = 0..1 with the values `from` and `to`, the slopes d_from and d_to by s, and the
// values `third` and `two_thirds` in between.
void sim_quintic(double from, double to, double d_from, double d_to, double third,
                 double two_thirds, double coefficients[SIM_COEFFICIENTS]);

static inline double sim_polynomial(const double *c, uint32_t n, double s) {
    double sum = c[n - 1];
    for (uint32_t k = n - 1; k-- > 0;) {
        sum = sum * s + c[k];
    }
    return sum;
}

// Puts the courses of all members together, in memory of the arena. tracks: has n_members, low,
// high; birth, end, born, dies of the arena. False: more pieces than can be counted.
bool sim_tracks_join(Arena *arena, const SimCourse *courses, SimTracks *tracks);

#endif
