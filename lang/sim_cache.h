// SPDX-License-Identifier: Apache-2.0
// Simulations on disk: run once, kept in a folder under the hash of all that they depend on.
//
// A file holds the numbers of a SimTracks in this machine's order, with its key and a checksum; one
// that is damaged, cut off or of another program is noticed and made again. It is written under a
// temporary name and renamed, so any number of processes may look for the same one.
#ifndef LANG_SIM_CACHE_H
#define LANG_SIM_CACHE_H

#include <stdio.h>

#include "lang/simulator.h"

typedef struct {
    const char *folder; // where files are kept; NULL: nowhere
    FILE *progress;     // where to say what is going on; NULL: nowhere
    FILE *list;         // gets a line for each simulation; NULL: no list
    FILE *reports;      // what goes wrong with files
} SimCache;

// --cache, or $XDG_CACHE_HOME/st4, or ~/.cache/st4; NULL: none is known.
const char *sim_cache_folder(Arena *arena, const char *given);

// A simulator that loads what is there, and runs and stores what is not. The cache must stay where
// it is.
Simulator sim_cache_simulator(SimCache *cache, bool runs_all);

#endif
