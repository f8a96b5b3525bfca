// SPDX-License-Identifier: Apache-2.0
// Inside of the common runs of members (render/sim_crowd.h), shared by their files.
#ifndef RENDER_SIM_CROWD_PARTS_H
#define RENDER_SIM_CROWD_PARTS_H

#include "render/sim_crowd.h"
#include "render/sim_equations.h"
#include "render/sim_runge.h"

enum { CROWD_LEVELS = 24 }; // sets within sets; each has at most half the members of the one around

// What of a member has to be again as it was when it goes back.
typedef struct {
    SimEvents events;
    bool has_left; // dead, or at rest: its states are held
    bool rests;
    double rest_time;
} CrowdMember;

typedef struct CrowdAround CrowdAround; // render/sim_crowd_around.c

// Members that are moved together. All columns are of n rows.
typedef struct {
    uint32_t capacity, n;
    uint32_t *who;             // [n] in order
    uint32_t *listed, *wide;   // [n_members] room for lists
    SimMembers among;          // those who may matter for their rates, and they themselves
    double *y, *next;          // [n_states] columns: at its time; at the end of a step
    double *k[RUNGE_STAGES];   // [n_states] rates; k[0]: at its time
    double *old, *spare;       // [n_states] rates before something changes; room
    double *last, *now, *base; // [n_whens] conditions: at two looks; before the first that changes
    uint8_t *fires, *chosen;   // [n_whens] at the first instant at which something happens; room
    uint8_t *is_hit;           // [n] something happens to it in the step
    double *hit;               // [n] the time by which it does; INFINITY: it does not
    uint32_t *some;            // [n] some of the members
    uint32_t *source;          // [n] of which row a row was before
    CrowdMember *saved;        // [n] of those hit
    const uint32_t *later;     // [n_later] members to be born here, in order of that
    uint32_t n_later;
    double step;    // the next one, seconds
    double fastest; // the largest share of a radius that anybody has moved in a second
} CrowdLevel;

typedef struct {
    SimRun *run;
    const SimState *sim;
    SimEquations *equations;
    CrowdAround *around;
    SimCourse *drafts;     // [n_members] what is known of their courses since the last common step
    double *starts, *held; // [n_states][n_members]
    CrowdMember *members;  // [n_members]
    uint8_t *begins;       // [n_members] an arc begins with the next piece
    uint32_t *first;       // [n_members] of the pieces of the arc at hand
    uint32_t *later;       // [n_members] in order of birth
    double *leaves;        // [n_members] when it dies within the span, else INFINITY
    bool is_local;         // conditions read nothing of other members
    bool is_by_places;     // members read others as those near to them alone
    uint32_t bad;          // the member whose rates are not finite
    uint64_t n_steps, n_tiny, work, wasted; // work: members looked at; wasted: in moves undone
    CrowdLevel levels[CROWD_LEVELS];
} Crowd;

static inline void crowd_swap(double **a, double **b) {
    double *c = *a;
    *a = *b;
    *b = c;
}

// ---- render/sim_crowd.c

// The members of a level, whose rates k[0] are those at t, go from there to `to`, by drafts; those
// of the first level become courses. False: reported.
bool crowd_advance(Crowd *c, uint32_t depth, double t, double to);

// ---- render/sim_crowd_back.c

// What a step may miss by its own estimate, and what a change of rates that is let pass may come to
// by its end, where the value is x.
double crowd_allowed(const Crowd *c, double x);

// CUT: it is for all of the level that the step is to end at *from. FAILED: reported.
typedef enum { CROWD_DONE, CROWD_CUT, CROWD_FAILED } CrowdOutcome;

// The members to whom something happens in the step of a level from t to *end, first at *from, and
// those who notice, go back to there and by themselves to the end, which may become an earlier one.
CrowdOutcome crowd_go_back(Crowd *c, uint32_t depth, double t, double *from, double *end);

// ---- render/sim_crowd_level.c

// Room for so many members; those that are there are forgotten. False: no memory.
bool crowd_reserve(Crowd *c, uint32_t depth, uint32_t n);
void crowd_free_levels(Crowd *c);

// Moves columns: row i of `to`, of n rows, is the row source[i] of `from`, or 0 where that is none.
enum { CROWD_NO_ROW = UINT32_MAX };
void crowd_carry(const double *from, uint32_t n_from, const uint32_t *source, uint32_t n,
                 uint32_t n_columns, double *to);

// Who of some is there at t.
void crowd_set_there(Crowd *c, SimMembers members, double t);
// The states at t of a member, of some, by their drafts, become live.
void crowd_place(Crowd *c, uint32_t member, double t);
void crowd_place_all(Crowd *c, SimMembers members, double t);
// Likewise those of a level, and out[n_states][n].
void crowd_read_drafts(Crowd *c, const CrowdLevel *level, double t, double *out);
// Those of a level become y[n_states][n].
void crowd_put(Crowd *c, const CrowdLevel *level, const double *y);

// The rates at t of the members of a level, whose states are y. False: those of c->bad are not
// finite.
bool crowd_rates(Crowd *c, uint32_t depth, double t, const double *y, double *out);

// ---- Drafts

// The step of a level from t to `end` becomes part of the drafts of its members.
void crowd_draft(Crowd *c, const CrowdLevel *level, double t, double end);
// A draft ends at t.
void crowd_cut_draft(Crowd *c, uint32_t member, double t);
// All drafts become part of the courses.
void crowd_flush(Crowd *c);

// ---- render/sim_crowd_around.c

CrowdAround *crowd_around_new(const SimState *sim); // NULL: no memory
void crowd_around_free(CrowdAround *around);        // NULL: nothing
// The ways of all, by their drafts, in a step of the first level.
void crowd_survey(Crowd *c, double t, double end);
// Whether any of the members who[0..n) have gone, by their drafts, where they were not expected;
// from now on they are, and those around are to be asked for again.
bool crowd_go_astray(Crowd *c, const uint32_t *who, uint32_t n);
// In which no member of a level moves farther than it sees.
double crowd_longest_step(const Crowd *c, CrowdLevel *level);
// At how many instants of a time to look so that nobody so fast passes another unseen. 0: too many.
uint32_t crowd_n_looks(const Crowd *c, double fastest, double time);
// The members who[0..n), and who may matter for their rates in that step, in order; out: room for
// all.
SimMembers crowd_around(Crowd *c, const uint32_t *who, uint32_t n, uint32_t *out);

// ---- render/sim_crowd_look.c

// The first instant in (t, end] at which something happens to a member of a level, or one of those
// to be born here is; INFINITY: none. Finds for each by when anything does, and marks in fires what
// does at that instant.
double crowd_look(Crowd *c, uint32_t depth, double t, double end);

// Does what happens at t: who dies leaves, who is born comes, what is marked in fires is carried
// out, and what that brings about; finds the rates then. False: reported.
bool crowd_strike(Crowd *c, uint32_t depth, double t);

#endif
