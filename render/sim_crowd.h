// SPDX-License-Identifier: Apache-2.0
// Members that read each other, to whom something happens: they are born, die, have events.
//
// All of them take common steps of Runge-Kutta (render/sim_runge.h). A step at whose end nothing
// has happened is done. Else the members to whom something happens in it go back to the first such
// instant and from there by themselves, by steps of their own, on what is known of the courses of
// all others, and so on within them. Then the rates of the others are looked at again: those for
// whom they have changed by more than an error of the step go back too. So a jump costs what it
// changes, not a new beginning for all. Where half of all would go back, the step ends at that
// instant for all of them.
#ifndef RENDER_SIM_CROWD_H
#define RENDER_SIM_CROWD_H

#include "render/sim_state_parts.h"

// Follows all members over the span. False: reported.
bool sim_crowd_run(SimRun *run);

#endif
