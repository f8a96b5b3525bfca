// SPDX-License-Identifier: Apache-2.0
// Courses of simulated members: pieces, made fewer, put together.
#include "render/sim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void sim_quintic(double from, double to, double d_from, double d_to, double third,
                 double two_thirds, double c[SIM_COEFFICIENTS]) {
    double rise = to - from;
    c[0] = from;
    c[1] = d_from;
    c[2] = 3 * rise - 2 * d_from - d_to;
    c[3] = d_from + d_to - 2 * rise;
    c[4] = c[5] = 0;
    // What Hermite's cubic misses at both thirds is added as s^2 (1 - s)^2 (a + b s).
    double miss1 = third - sim_polynomial(c, 4, 1.0 / 3);
    double miss2 = two_thirds - sim_polynomial(c, 4, 2.0 / 3);
    double b = 243.0 / 4 * (miss2 - miss1), a = 81.0 / 8 * (miss1 + miss2) - b / 2;
    c[2] += a;
    c[3] += b - 2 * a;
    c[4] = a - 2 * b;
    c[5] = b;
}

static size_t stride(const SimCourse *course) {
    return (size_t)course->n_columns * course->n_coefficients;
}

double *sim_course_add(SimCourse *course, SimPiece piece, const double *coefficients) {
    size_t n = stride(course);
    if (course->n == course->capacity) {
        size_t capacity = course->capacity ? 2 * course->capacity : 4;
        SimPiece *pieces = realloc(course->pieces, capacity * sizeof *pieces);
        course->pieces = pieces ? pieces : course->pieces;
        double *all = pieces ? realloc(course->coefficients, capacity * n * sizeof *all) : NULL;
        course->coefficients = all ? all : course->coefficients;
        if (!all) {
            course->is_failed = true;
            return NULL;
        }
        course->capacity = capacity;
    }
    double *to = course->coefficients + course->n * n;
    course->pieces[course->n++] = piece;
    if (coefficients) {
        memcpy(to, coefficients, n * sizeof *to);
    } else {
        memset(to, 0, n * sizeof *to);
    }
    return to;
}

void sim_course_free(SimCourse *course) {
    free(course->pieces);
    free(course->coefficients);
    *course = (SimCourse){0};
}

static const double *column_of(const SimCourse *course, uint32_t piece, uint32_t column) {
    return course->coefficients + piece * stride(course) + (size_t)column * course->n_coefficients;
}

static double progress(const SimPiece *piece, double t) {
    return (t - piece->start) / (piece->end - piece->start);
}

double sim_course_value(const SimCourse *course, uint32_t piece, uint32_t column, double t) {
    return sim_polynomial(column_of(course, piece, column), course->n_coefficients,
                          progress(&course->pieces[piece], t));
}

// By the seconds.
static double slope(const SimCourse *course, uint32_t piece, uint32_t column, double t) {
    const double *c = column_of(course, piece, column);
    double s = progress(&course->pieces[piece], t), sum = 0;
    for (uint32_t k = course->n_coefficients; k-- > 1;) {
        sum = sum * s + k * c[k];
    }
    return sum / (course->pieces[piece].end - course->pieces[piece].start);
}

// ---- Fewer pieces

static uint32_t piece_at(const SimCourse *course, uint32_t first, uint32_t last, double t) {
    while (first < last) {
        uint32_t middle = first + (last - first + 1) / 2;
        if (course->pieces[middle].start <= t) {
            first = middle;
        } else {
            last = middle - 1;
        }
    }
    return first;
}

// One quintic in place of the pieces first..last; false: it is too far from them.
static bool fit(const SimCourse *course, uint32_t first, uint32_t last, double tolerance,
                double *to) {
    enum { CHECKS = 12 };
    double start = course->pieces[first].start, end = course->pieces[last].end;
    double length = end - start;
    double third = start + length / 3, two_thirds = start + 2 * length / 3;
    uint32_t at_third = piece_at(course, first, last, third);
    uint32_t at_two_thirds = piece_at(course, first, last, two_thirds);
    for (uint32_t c = 0; c < course->n_columns; c++) {
        double *p = to + (size_t)c * SIM_COEFFICIENTS;
        sim_quintic(sim_course_value(course, first, c, start),
                    sim_course_value(course, last, c, end), slope(course, first, c, start) * length,
                    slope(course, last, c, end) * length,
                    sim_course_value(course, at_third, c, third),
                    sim_course_value(course, at_two_thirds, c, two_thirds), p);
        for (uint32_t i = 0; i < CHECKS + last - first; i++) {
            double t = i < CHECKS ? start + length * (i + 0.5) / CHECKS
                                  : course->pieces[first + i - CHECKS + 1].start;
            double x = sim_course_value(course, piece_at(course, first, last, t), c, t);
            double miss = fabs(sim_polynomial(p, SIM_COEFFICIENTS, (t - start) / length) - x);
            if (!(miss <= tolerance * fmax(1, fabs(x)))) {
                return false;
            }
        }
    }
    return true;
}

void sim_course_merge(SimCourse *course, uint32_t first, double tolerance) {
    size_t n = stride(course);
    double *tried = malloc(2 * n * sizeof *tried), *best = tried ? tried + n : NULL;
    uint32_t to = first, end = course->n;
    for (uint32_t i = first; tried && i < end;) {
        uint32_t last = i; // joined with those that follow, twice as many each time
        for (uint32_t more = 1; i + more < end; more *= 2) {
            uint32_t wanted = last + more < end ? last + more : end - 1;
            if (wanted == last || !fit(course, i, wanted, tolerance, tried)) {
                break;
            }
            last = wanted;
            memcpy(best, tried, n * sizeof *best);
        }
        SimPiece piece = course->pieces[i];
        piece.end = course->pieces[last].end;
        if (last > i) {
            memcpy(course->coefficients + to * n, best, n * sizeof *best);
        } else if (to != i) {
            memcpy(course->coefficients + to * n, course->coefficients + i * n, n * sizeof *best);
        }
        course->pieces[to++] = piece;
        i = last + 1;
    }
    course->n = tried ? to : end;
    free(tried);
}

// ---- All members

static double power_above(double x) {
    int exponent;
    frexp(x, &exponent); // x < 2^exponent
    return ldexp(1, exponent);
}

bool sim_tracks_join(Arena *arena, const SimCourse *courses, SimTracks *tracks) {
    uint64_t n_pieces = 0, n_arcs = 0;
    for (uint32_t m = 0; m < tracks->n_members; m++) {
        n_pieces += courses[m].n;
        for (uint32_t i = 0; i < courses[m].n; i++) {
            n_arcs += courses[m].pieces[i].begins_arc;
        }
    }
    uint32_t n_coefficients = courses[0].n_coefficients;
    if (n_pieces * courses[0].n_columns * n_coefficients > UINT32_MAX) {
        return false;
    }
    double *arc_key = ARENA_ARRAY(arena, n_arcs, double);
    double *key = ARENA_ARRAY(arena, n_pieces, double);
    double *start = ARENA_ARRAY(arena, n_pieces, double);
    double *rate = ARENA_ARRAY(arena, n_pieces, double);
    size_t width = (size_t)courses[0].n_columns * n_coefficients;
    double *coefficient = ARENA_ARRAY(arena, n_pieces * width, double);
    size_t at = 0, arc = 0;
    tracks->spacing = power_above(tracks->high - tracks->low);
    for (uint32_t m = 0; m < tracks->n_members; m++) {
        for (uint32_t i = 0; i < courses[m].n; i++, at++) {
            const SimPiece *piece = &courses[m].pieces[i];
            if (piece->begins_arc) {
                arc_key[arc++] = m * tracks->spacing + (piece->start - tracks->low);
            }
            key[at] = (double)(arc - 1) * tracks->spacing + (piece->start - tracks->low);
            start[at] = piece->start;
            rate[at] = 1 / (piece->end - piece->start);
            for (size_t k = 0; k < width; k++) {
                coefficient[k * n_pieces + at] = courses[m].coefficients[i * width + k];
            }
        }
    }
    tracks->n_columns = courses[0].n_columns;
    tracks->n_coefficients = n_coefficients;
    tracks->n_arcs = (uint32_t)n_arcs;
    tracks->n_pieces = (uint32_t)n_pieces;
    tracks->arc_key = arc_key;
    tracks->piece_key = key;
    tracks->piece_start = start;
    tracks->piece_rate = rate;
    tracks->coefficient = coefficient;
    return true;
}
