// SPDX-License-Identifier: Apache-2.0
// The kernels for machines with AVX-512.
#define TRACE_KERNELS trace_avx512
#include "accel/trace_body.h"
