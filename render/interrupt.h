// SPDX-License-Identifier: Apache-2.0
// Stopping when asked: SIGINT and SIGTERM set a flag that long loops look at. The second signal
// ends the program at once.
#ifndef RENDER_INTERRUPT_H
#define RENDER_INTERRUPT_H

#include <stdbool.h>

// Between these two the signals are ours; the handlers from before come back. Signals that were
// ignored before (nohup) stay so.
void interrupt_begin(void);
void interrupt_end(void);

bool interrupt_is_asked(void); // from any thread

#endif
