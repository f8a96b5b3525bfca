// SPDX-License-Identifier: Apache-2.0
// How a scene is shot: shutter and camera, part of render/scene.h and under its conventions.
#ifndef RENDER_SHOT_H
#define RENDER_SHOT_H

#include "render/program.h"

// Where in the source a thing was written; opaque to the renderer, handed back in reports.
typedef uint64_t SourceRef;

typedef struct ShutterCurve ShutterCurve; // render/shutter.h

typedef enum { ROLL_NONE, ROLL_DOWN, ROLL_UP, ROLL_LEFT, ROLL_RIGHT } RollKind;

// The shutter of frame n is open from (n-1)/fps + open to (n-1)/fps + open + length, and as much
// later at a pixel as its delay says: that of its line, where it rolls, and that of the program.
typedef struct {
    double length;             // frame periods, >= 0, of any size; 0: an instant
    double open;               // frame periods
    const ShutterCurve *curve; // NULL: a box
    RollKind roll;
    double readout;                 // frame periods, >= 0, between the first line and the last
    const Program *delay;           // out: seconds. Reads u v alone: of the pixel's middle, 0..1 to
                                    // the right and down. NULL: 0
    double first_delay, last_delay; // frame periods, of all pixels (shutter_find_delays)
} ShutterSettings;

typedef enum {
    CAMERA_PERSPECTIVE,
    CAMERA_ORTHOGRAPHIC,
    CAMERA_SPHERICAL, // equirectangular: all directions, whatever the picture's shape
} CameraKind;

// out: from x y z, to x y z, up x y z, fov (vertical, radians; orthographic: the picture is
// 2 |to - from| tan(fov/2) high, so both kinds agree at `to`; spherical: not looked at). Not given:
// automatic is true, and the renderer places a camera that sees everything at the film's first
// frame.
typedef struct {
    CameraKind kind;
    const Program *program;
    const Program *lens; // out: aperture (diameter, metres, >= 0), focus (metres, > 0), shift x y
                         // (of the picture, right and up, in picture heights; spherical: 0). NULL:
                         // a pinhole, no shift
    uint32_t blades;     // of the aperture, >= 3; 0: it is round
    bool automatic;
    SourceRef where;
} CameraSettings;

#endif
