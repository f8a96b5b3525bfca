// SPDX-License-Identifier: Apache-2.0
// The flag that signals set. A handler can reach nothing but a global; this is the only one.
#include "render/interrupt.h"

#include <signal.h>
#include <string.h>

enum { N_SIGNALS = 2 };

static const int signals[N_SIGNALS] = {SIGINT, SIGTERM};
static struct sigaction before[N_SIGNALS];
static volatile sig_atomic_t is_asked;

static void ask(int signal_number) {
    (void)signal_number;
    is_asked = 1;
}

void interrupt_begin(void) {
    is_asked = 0;
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = ask;
    action.sa_flags = (int)SA_RESETHAND | SA_RESTART;
    sigemptyset(&action.sa_mask);
    for (int i = 0; i < N_SIGNALS; i++) {
        sigaction(signals[i], NULL, &before[i]);
        if (before[i].sa_handler != SIG_IGN) {
            sigaction(signals[i], &action, NULL);
        }
    }
}

void interrupt_end(void) {
    for (int i = 0; i < N_SIGNALS; i++) {
        sigaction(signals[i], &before[i], NULL);
    }
}

bool interrupt_is_asked(void) {
    return is_asked != 0;
}
