// SPDX-License-Identifier: Apache-2.0
// The kernels for machines with AVX2 and FMA.
#define TRACE_KERNELS trace_avx2
#include "accel/trace_body.h"
