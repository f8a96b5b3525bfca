// SPDX-License-Identifier: Apache-2.0
// Lowering: from evaluated objects to render/scene.h. Graphs become programs, surfaces and boxes
// become meshes; what is the same is made once.
#ifndef LANG_LOWER_H
#define LANG_LOWER_H

#include "lang/hash.h"
#include "lang/object.h"
#include "render/mesh.h"

typedef struct {
    uint32_t n_shapes, n_lights;
} LoweringMark;

// Everything of the scene is allocated from `arena`.
Lowering *lowering_new(Arena *arena, Arena *scratch);

// What a batched loop tried and gave up is forgotten.
LoweringMark lowering_mark(const Lowering *lowering);
void lowering_rewind(Lowering *lowering, LoweringMark mark);

// How many objects the shapes before this one are; none of them may be forgotten any more.
uint32_t lowering_n_objects(Lowering *lowering, uint32_t shape);

// Room for saying which objects a shape's instances are; n 0: those of the shape before.
typedef struct {
    uint32_t *object; // [n]
    uint32_t n;
} LoweredOrder;
LoweredOrder lowering_order(Lowering *lowering, uint32_t shape);

// A node that was evaluated, at its place. Reports what is wrong with it.
void lower_object(Eval *ev, const Object *object, const Place *place, const char *label);

// The triangles of a shape at an instant, its transforms included, of the arena of the evaluator;
// for rigid bodies, so it may not change its form over time. False: reported, or asked for.
bool lower_body_mesh(Eval *ev, const Object *object, double seconds, Mesh *mesh);

// The film's fps, as soon as it is known; the film is evaluated first of all.
void lower_fps(Eval *ev, const Object *film);

// The film as the schema has it, for a script without one.
void lowering_default_film(Eval *ev);

// A film where none may stand: a second one, or one in a for or an if. Reports.
void lower_misplaced_film(Eval *ev, const Object *film);

// Whether the film was lowered from this very statement.
bool lowered_film(Eval *ev, const Module *module, NodeId statement);

// film.fps, film.size, film.frames.
Value lower_film_member(Eval *ev, const Env *env, NodeId node, const char *member);

// What the command line says instead of the script.
typedef struct {
    uint32_t width, height; // 0: nothing
    double fps;             // 0: nothing
    bool has_frames, has_shutter;
    int64_t first_frame, last_frame;
    bool shutter_is_angle;
    double shutter; // radians, or seconds
} Overrides;

void lowering_override(Eval *ev, const Overrides *overrides);

// The scene, default things added where there are none. sources: of all text that it came from.
Scene *lowering_finish(Eval *ev, const Hash128 *sources);

// Sets length and open from an angle (of a frame's 360deg) or a time; phase: the part of it that
// lies before the frame's beginning.
void lowering_set_shutter(ShutterSettings *shutter, double fps, bool is_angle, double length,
                          double phase);

// A mesh read from a file: part of the scene's hash.
void lower_hash_mesh(Eval *ev, const Mesh *mesh);
// Where what the scene points to is allocated.
Arena *lower_arena(Eval *ev);

#endif
