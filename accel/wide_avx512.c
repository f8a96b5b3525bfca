// SPDX-License-Identifier: Apache-2.0
// The wide tree's kernels for processors with AVX-512.
#define WIDE(name) wide_##name##_avx512
#include "accel/wide_body.h"
