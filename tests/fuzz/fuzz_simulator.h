// SPDX-License-Identifier: Apache-2.0
// Simulations under the fuzzer: quick, and the same for the same job.
#ifndef TESTS_FUZZ_FUZZ_SIMULATOR_H
#define TESTS_FUZZ_FUZZ_SIMULATOR_H

#include "lang/simulator.h"

// All programs of a job are run, at the start; from there members go straight on. Refused, as by
// the real ones: what is not finite; and more than 64 members or scalars.
extern const Simulator fuzz_simulator;

#endif
