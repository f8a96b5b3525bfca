// SPDX-License-Identifier: Apache-2.0
// Whether a text is what --diag json promises: lines that are one JSON object each.
#ifndef TESTS_FUZZ_FUZZ_JSON_H
#define TESTS_FUZZ_FUZZ_JSON_H

#include <stdbool.h>
#include <stddef.h>

// By RFC 8259: strict grammar, strings of valid UTF-8 without control characters.
bool fuzz_json_lines(const char *text, size_t size);
bool fuzz_json_utf8(const char *text, size_t size); // alone

#endif
