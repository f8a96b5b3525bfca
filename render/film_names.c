// SPDX-License-Identifier: Apache-2.0
// Names of what a film has seen.
#include "render/film_names.h"

#include <stdlib.h>
#include <string.h>

#include "render/snapshot.h"

enum { NAME_SIZE = 512, SORT_AT = 4096 };

static int compare_names(const void *a, const void *b) {
    uint32_t p = ((const FilmName *)a)->number, q = ((const FilmName *)b)->number;
    return p < q ? -1 : p > q;
}

static FilmName *find(const FilmNames *names, uint32_t number) {
    const FilmName key = {.number = number};
    return names->n ? bsearch(&key, names->names, names->n, sizeof key, compare_names) : NULL;
}

const char *film_names_get(const FilmNames *names, uint32_t number) {
    const FilmName *found = find(names, number);
    return found ? found->name : NULL;
}

// Drops what stands twice.
static void sort_names(FilmNames *names) {
    size_t n = 0;
    if (names->n == 0) {
        return;
    }
    qsort(names->names, names->n, sizeof *names->names, compare_names);
    for (size_t i = 0; i < names->n; i++) {
        if (n == 0 || names->names[n - 1].number != names->names[i].number) {
            names->names[n++] = names->names[i];
        }
    }
    names->n = n;
}

static void append(Arena *arena, FilmNames *names, uint32_t number, const char *name) {
    names->names =
        arena_grow(arena, names->names, names->n, &names->capacity, sizeof *names->names);
    names->names[names->n++] = (FilmName){number, name};
}

// Lists are sorted whenever they have grown to twice their size, so that they hold little more than
// the picture has things.
static void collect(const Film *film, const FilmIds *all, Arena *arena, FilmNames *names) {
    size_t n_pixels = (size_t)film->width * film->height, sort_at = SORT_AT;
    for (size_t i = 0; i < n_pixels; i++) {
        for (const FilmIds *ids = &all[i]; ids; ids = ids->more) {
            for (int k = 0; k < FILM_IDS && ids->n[k]; k++) {
                append(arena, names, ids->id[k], "");
            }
        }
        if (names->n > sort_at) {
            sort_names(names);
            sort_at = 2 * names->n > SORT_AT ? 2 * names->n : SORT_AT;
        }
    }
    sort_names(names);
}

static void name_objects(const Scene *scene, Arena *arena, const FilmNames *names) {
    uint32_t base = 0, n_objects = 0;
    for (uint32_t s = 0; s < scene->n_shapes && names->n > 0; s++) {
        const Shape *shape = &scene->shapes[s];
        base = shape->is_other_form ? base : n_objects;
        for (uint32_t i = 0; i < shape->n_instances; i++) {
            FilmName *thing = find(names, shape->objects ? shape->objects[i] : base + i);
            if (thing) {
                char name[NAME_SIZE];
                shape_name(shape, i, name, sizeof name);
                thing->name = arena_string(arena, name, strlen(name));
            }
        }
        n_objects += shape_n_objects(shape);
    }
}

static void name_materials(const Scene *scene, const FilmNames *names) {
    for (size_t i = 0; i < names->n; i++) {
        names->names[i].name = scene->materials[names->names[i].number].label;
    }
}

void film_names_find(const Scene *scene, const Film *film, Arena *arena,
                     FilmNames names[N_FILM_IDS]) {
    for (int k = 0; k < N_FILM_IDS; k++) {
        names[k] = (FilmNames){0};
        if (film->ids[k]) {
            collect(film, film->ids[k], arena, &names[k]);
        }
    }
    name_objects(scene, arena, &names[0]);
    name_materials(scene, &names[1]);
}

void film_names_add(Arena *arena, FilmNames names[N_FILM_IDS], const FilmNames more[N_FILM_IDS]) {
    for (int k = 0; k < N_FILM_IDS; k++) {
        size_t n = names[k].n;
        for (size_t i = 0; i < more[k].n; i++) {
            const FilmName *name = &more[k].names[i];
            const FilmNames sorted = {names[k].names, n, 0};
            if (!find(&sorted, name->number)) {
                append(arena, &names[k], name->number,
                       arena_string(arena, name->name, strlen(name->name)));
            }
        }
        sort_names(&names[k]);
    }
}
