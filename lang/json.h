// SPDX-License-Identifier: Apache-2.0
// Values of JSON, as the commands print them.
#ifndef LANG_JSON_H
#define LANG_JSON_H

#include <stdio.h>

// In quotes, whatever bytes the text has.
void json_string(FILE *out, const char *text);

// So that it reads back the same; null where it is not finite, which JSON does not have.
void json_number(FILE *out, double value);

#endif
