// SPDX-License-Identifier: Apache-2.0
// The tables of units and dimensions.
#include "lang/units.h"

const UnitInfo unit_infos[UNIT_COUNT] = {
#define UNIT(id, text, dimension, factor) {text, dimension, factor},
#include "lang/units.def"
#undef UNIT
};

const char *const dimension_names[DIMENSION_COUNT] = {
    "a number", "an angle", "an angle per second", "a time", "a length",
    "a mass",   "a rate",   "a number of pixels",
};
