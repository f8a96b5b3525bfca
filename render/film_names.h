// SPDX-License-Identifier: Apache-2.0
// What the numbers of objects and materials in a film stand for.
#ifndef RENDER_FILM_NAMES_H
#define RENDER_FILM_NAMES_H

#include "render/film.h"

typedef struct {
    uint32_t number; // as the film counts it
    const char *name;
} FilmName;

// By rising number, each once.
typedef struct {
    FilmName *names;
    size_t n, capacity;
} FilmNames;

// Of all that is in the film, in the order of Film.ids; empty for layers that it does not have.
// From the arena.
void film_names_find(const Scene *scene, const Film *film, Arena *arena,
                     FilmNames names[N_FILM_IDS]);

// Adds those of another film of the same scene. Everything is copied into the arena.
void film_names_add(Arena *arena, FilmNames names[N_FILM_IDS], const FilmNames more[N_FILM_IDS]);

// NULL: it has none.
const char *film_names_get(const FilmNames *names, uint32_t number);

#endif
