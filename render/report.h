// SPDX-License-Identifier: Apache-2.0
// What the sampling of a scene has to say: warnings about its shapes.
#ifndef RENDER_REPORT_H
#define RENDER_REPORT_H

#include "render/form.h"

void report_error(const Reporter *reporter, SourceRef where, const char *message);
void report_warning(const Reporter *reporter, SourceRef where, const char *name, const char *format,
                    ...) __attribute__((format(printf, 4, 5)));

// Triangles without area in the rest pose of a mesh.
void report_degenerate(const Reporter *reporter, const Shape *shape);

// Instances with clocks that need many vertex arrays of their own.
void report_prototypes(const Reporter *reporter, const Shape *shape, uint32_t n);

// What sampling found, for the shape of a form whose keys are stored.
void report_sampling(const Reporter *reporter, const Form *form);

// Transforms that are not finite at an instant while a shutter is open; one warning per shape.
void report_transforms(const Reporter *reporter, const Scene *scene, const Opening *openings,
                       size_t n);

#endif
