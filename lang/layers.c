// SPDX-License-Identifier: Apache-2.0
// Names of layers.
#include "lang/layers.h"

#include <string.h>

const char *const layer_names[LAYER_COUNT] = {
#define LAYER(id, name, channels, help) name,
#include "render/layers.def"
#undef LAYER
};

const char *const layer_words =
#define LAYER(id, name, channels, help) " " name
#include "render/layers.def"
#undef LAYER
    ;

bool layer_find(const char *name, size_t n, Layer *layer) {
    for (int i = 0; i < LAYER_COUNT; i++) {
        if (strlen(layer_names[i]) == n && memcmp(layer_names[i], name, n) == 0) {
            *layer = (Layer)i;
            return true;
        }
    }
    return false;
}
