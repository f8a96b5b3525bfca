// SPDX-License-Identifier: Apache-2.0
// The picture's layers by name, from the table render/layers.def.
#ifndef LANG_LAYERS_H
#define LANG_LAYERS_H

#include <stdbool.h>
#include <stddef.h>

#include "render/film_settings.h"

extern const char *const layer_names[LAYER_COUNT];

// All of them, for messages: " z normal albedo ...".
extern const char *const layer_words;

// name[n]; false: there is none of that name.
bool layer_find(const char *name, size_t n, Layer *layer);

#endif
