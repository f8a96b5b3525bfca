// SPDX-License-Identifier: Apache-2.0
// The wide tree's kernels for any x86-64 processor.
#define WIDE(name) wide_##name##_scalar
#include "accel/wide_body.h"
