// SPDX-License-Identifier: Apache-2.0
// Units that a number can be written with, and the dimensions that they measure.
#ifndef LANG_UNITS_H
#define LANG_UNITS_H

#include "lang/syntax.h"

typedef enum {
    DIMENSION_NONE,
    DIMENSION_ANGLE,
    DIMENSION_ANGULAR_RATE,
    DIMENSION_TIME,
    DIMENSION_LENGTH,
    DIMENSION_MASS,
    DIMENSION_RATE,
    DIMENSION_PIXELS,
    DIMENSION_COUNT
} Dimension;

typedef struct {
    const char *text; // as written after a number
    uint8_t dimension;
    double factor; // to SI; 0: FRAME, whose factor is 1/fps
} UnitInfo;
extern const UnitInfo unit_infos[UNIT_COUNT];
extern const char *const dimension_names[DIMENSION_COUNT]; // "a length"

#endif
