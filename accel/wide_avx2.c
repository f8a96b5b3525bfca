// SPDX-License-Identifier: Apache-2.0
// The wide tree's kernels for processors with AVX2 and FMA.
#define WIDE(name) wide_##name##_avx2
#include "accel/wide_body.h"
