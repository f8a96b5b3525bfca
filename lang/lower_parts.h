// SPDX-License-Identifier: Apache-2.0
// Inside of the lowering, shared by its files (lang/lower*.c).
#ifndef LANG_LOWER_PARTS_H
#define LANG_LOWER_PARTS_H

#include "lang/hash.h"
#include "lang/lower.h"
#include "lang/scene_load.h"

// Where a node that may stand only once was found.
typedef struct {
    Span where;
    const Module *module; // NULL: nowhere
} Source;

// Programs by their outputs, each made when it is asked for.
typedef struct {
    uint64_t hash;
    uint32_t n;
    const Ref *refs;        // NULL: the slot is free
    const Program *program; // of the outputs
    const Program *breaks;  // of their breaks
    bool knows_breaks;
} CachedProgram;

// The rest pose of a surface, and what it was made from.
typedef struct {
    double u[2], v[2];
    Ref rest[4]; // 3; compared byte by byte, so without holes
    uint32_t nu, nv;
} SurfaceKey;

typedef struct {
    SurfaceKey key;
    const Mesh *mesh; // NULL: the slot is free
} CachedSurface;

// A mesh of lang/lower_solid.c, by what it was made from.
typedef struct {
    ObjectKind kind;
    uint32_t steps;
    double a, b; // its radii
    const Mesh *mesh;
} SharedSolid;

enum { LOWERING_SOLIDS = 64, LOWERING_MESHES = 64, MESH_KEY_VALUES = 12 }; // the latest are shared

// A mesh of lang/lower_mesh.c, by what the script says of it.
typedef struct {
    uint64_t value[MESH_KEY_VALUES];
    const Module *module[MESH_KEY_VALUES]; // where a file's name counts from
} MeshKey;

typedef struct {
    MeshKey key;
    const Mesh *mesh;
    const VertexTrack *track;
    Ref track_key;
} MadeMesh;

// Sampled data that stands over a part of time.
typedef struct {
    Span where;
    const char *what;
    double first, last; // seconds
} SampledData;

struct Lowering {
    Arena *arena, *scratch;
    Scene *scene;
    Shape *shapes;
    Light *lights;
    Material *materials;
    const MaterialValue **material_values; // what each was made from
    CachedProgram *programs;               // a power of two of slots
    uint32_t *material_slots;              // indices + 1
    size_t shapes_capacity, lights_capacity, materials_capacity, values_capacity;
    size_t n_programs, n_program_slots, n_material_slots;
    uint32_t n_shapes, n_lights, n_materials;
    uint32_t n_counted, n_objects; // shapes, and the objects that they are
    Source film, shutter, render, camera, sky;
    double phase; // of the shutter
    Span delay;   // where it says so
    Overrides overrides;
    const Mesh *unit_box, *unit_quad; // shared by all boxes and quads
    CachedSurface *surfaces;          // a power of two of slots
    size_t n_surfaces, n_surface_slots;
    SharedSolid solids[LOWERING_SOLIDS];
    uint32_t next_solid, next_made;
    MadeMesh made[LOWERING_MESHES];
    SampledData *data;
    size_t n_data, data_capacity;
    Hash128 mesh_hash;
};

// False: there was one before (reported).
bool lower_once(Eval *ev, Source *source, const Object *object);

// A property's components; false: there was a mistake.
bool lower_vec3(Eval *ev, const Object *object, PropertyId id, Ref3 *v);
bool lower_scalar(Eval *ev, const Object *object, PropertyId id, Ref *ref);

// The first component of a FIXED property; 0: not given and without a default, or a mistake.
double lower_known(Eval *ev, const Object *object, PropertyId id);

// A program with these outputs; the same graphs give the same program.
const Program *lower_program(Eval *ev, const Ref *refs, uint32_t n);

const Program *lower_breaks(Eval *ev, const Ref *refs, uint32_t n); // NULL: no jump, no bend

const Program *lower_visible(Eval *ev, const Place *place); // NULL: always

// The material of an object, as it was given; NULL: the default one.
uint32_t lower_material(Eval *ev, const MaterialValue *material, const Object *object,
                        const Given *given);

// Data that covers these seconds: a warning where the film reads outside of them.
void lower_note_data(Eval *ev, const Given *given, double first, double last);

// The values of the batched loops around, instance by instance.
void lower_loops(Eval *ev, Shape *shape);

Shape *lower_new_shape(Eval *ev);

// lang/lower_settings.c
void lower_film(Eval *ev, const Object *object);
void lower_shutter(Eval *ev, const Object *object);
void lower_delays(Eval *ev); // of all pixels, once the film's size is certain; and how long it is
void lower_render(Eval *ev, const Object *object);

// lang/lower_light.c
void lower_camera(Eval *ev, const Object *object, const Place *place);
void lower_sun(Eval *ev, const Object *object, const Place *place);
void lower_lamp(Eval *ev, const Object *object, const Place *place);
void lower_area(Eval *ev, const Object *object, const Place *place);
void lower_sky(Eval *ev, const Object *object, const Place *place);

// lang/lower_shape.c
void lower_shape(Eval *ev, const Object *object, const Place *place, const char *label);

// lang/lower_surface.c: the rest pose, cut into triangles; NULL: reported. *vertex gets what moves
// the vertices, 3 refs; REF_NONE: nothing does.
const Mesh *lower_surface(Eval *ev, const Object *object, Ref vertex[3]);

// What `deform` makes of a vertex at `rest`; false: reported. id: of surface or mesh.
// type_u, type_v: of the variables u and v.
bool lower_deform(Eval *ev, const Object *object, PropertyId id, const Value *rest,
                  ValueType type_u, ValueType type_v, Ref out[3]);

#endif
