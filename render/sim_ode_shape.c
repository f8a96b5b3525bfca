// SPDX-License-Identifier: Apache-2.0
// Rigid bodies by ODE: shapes and what they weigh.
#include <stdlib.h>
#include <string.h>

#include "render/sim_ode_parts.h"

void sim_ode_quaternion(const double turn[4], dQuaternion q) {
    q[0] = turn[3];
    memcpy(q + 1, turn, 3 * sizeof *q);
}

// What the engine reads from a hull for as long as it runs.
static dGeomID make_convex(dSpaceID space, const SimSolid *solid) {
    size_t n = solid->n_faces;
    double *planes = malloc(4 * n * sizeof *planes);
    unsigned *polygons = malloc(4 * n * sizeof *polygons);
    for (size_t f = 0; planes && polygons && f < n; f++) {
        const uint32_t *v = solid->face + 3 * f;
        const double *a = solid->point + 3 * (size_t)v[0], *b = solid->point + 3 * (size_t)v[1];
        const double *c = solid->point + 3 * (size_t)v[2];
        dVector3 u, w;
        for (int k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            w[k] = c[k] - a[k];
        }
        dReal *plane = planes + 4 * f;
        dCalcVectorCross3(plane, u, w);
        dSafeNormalize3(plane);
        plane[3] = dCalcVectorDot3(plane, a);
        polygons[4 * f] = 3;
        for (int k = 0; k < 3; k++) {
            polygons[4 * f + 1 + (size_t)k] = v[k];
        }
    }
    return planes && polygons ? dCreateConvex(space, planes, solid->n_faces, solid->point,
                                              solid->n_points, polygons)
                              : NULL;
}

static dGeomID make_mesh(dSpaceID space, const SimSolid *solid) {
    dTriMeshDataID data = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildDouble(data, solid->point, 3 * sizeof(double), (int)solid->n_points,
                                solid->face, 3 * (int)solid->n_faces, 3 * sizeof(uint32_t));
    // Without the angles between faces, hulls cannot touch it.
    dGeomTriMeshDataPreprocess2(data, 1u << dTRIDATAPREPROCESS_BUILD_FACE_ANGLES, NULL);
    return dCreateTriMesh(space, data, NULL, NULL, NULL);
}

dGeomID sim_ode_geom(dSpaceID space, const RigidShape *shape) {
    switch (shape->kind) {
    case RIGID_CAPSULE:
        return dCreateCapsule(space, shape->size[0], shape->size[1]);
    case RIGID_CONVEX:
        return make_convex(space, shape->solid);
    case RIGID_MESH:
        return make_mesh(space, shape->solid);
    case RIGID_BOX:
        return dCreateBox(space, shape->size[0], shape->size[1], shape->size[2]);
    case RIGID_SPHERE:
        return dCreateSphere(space, shape->size[0]);
    case RIGID_CYLINDER:
        return dCreateCylinder(space, shape->size[0], shape->size[1]);
    case RIGID_PLANE:
        return dCreatePlane(space, shape->plane[0], shape->plane[1], shape->plane[2],
                            shape->plane[3]);
    }
    return NULL;
}

static void set_mass(dMass *mass, const SimSolidMass *own, double density) {
    const double *m = own->moment;
    dMassSetParameters(mass, density * own->mass, 0, 0, 0, density * m[0], density * m[1],
                       density * m[2], density * m[3], density * m[4], density * m[5]);
    dMassTranslate(mass, own->center[0], own->center[1], own->center[2]);
}

void sim_ode_add_mass(dMass *total, const RigidShape *shape, double density) {
    dMass mass;
    dMatrix3 rotation;
    dQuaternion q;
    switch (shape->kind) {
    case RIGID_BOX:
        dMassSetBox(&mass, density, shape->size[0], shape->size[1], shape->size[2]);
        break;
    case RIGID_SPHERE:
        dMassSetSphere(&mass, density, shape->size[0]);
        break;
    case RIGID_CYLINDER:
        dMassSetCylinder(&mass, density, 3, shape->size[0], shape->size[1]);
        break;
    case RIGID_CAPSULE:
        dMassSetCapsule(&mass, density, 3, shape->size[0], shape->size[1]);
        break;
    case RIGID_CONVEX:
    case RIGID_MESH:
        set_mass(&mass, &shape->own, density);
        break;
    default:
        return;
    }
    sim_ode_quaternion(shape->turn, q);
    dQtoR(q, rotation);
    dMassRotate(&mass, rotation);
    dMassTranslate(&mass, shape->at[0], shape->at[1], shape->at[2]);
    dMassAdd(total, &mass);
}
