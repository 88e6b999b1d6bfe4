/* mechanism.h: trees of joints without contact, in MuJoCo's coordinates.
 *
 * A mechanism is what a document says and never changes. What does change belongs
 * to one simulation and is in plain rows of numbers: its parameters, its positions,
 * its velocities. So any number of simulations share one mechanism. */
#ifndef MECHANISM_H
#define MECHANISM_H

#include <stddef.h>

#include "asid_backend.h"

/* A sensor: what it reads, of which body or joint, and where on it. */
typedef struct sensor {
  int reading;
  size_t object;
  double pos[3], quat[4]; /* frame in the body                                     */
  size_t parameter;       /* where its position is a parameter; 0 where it is fixed */
  size_t length;
} sensor;

typedef struct mechanism {
  double timestep;
  size_t nq, nv, nbody, njoint, ngeom, nactuator, nsensor;
  asid_body *bodies; /* as in the document, but without names, which are the host's */
  asid_joint *joints;
  asid_geom *geoms;
  asid_actuator *actuators;
  sensor *sensors;
  int *dof_parent; /* the next degree of freedom towards the world, -1 for none     */
  double *start;   /* qpos, then qvel, of a reset                                   */
  /* Parameters lie in one row: gravity, then so many numbers a joint, and so on. */
  size_t joint_at, actuator_at, body_at, geom_at, nparameter;
  double *nominal;
} mechanism;

enum { PER_JOINT = 3, PER_ACTUATOR = 3, PER_BODY = 13, PER_GEOM = 4 };

/* A body in motion. Spatial vectors are angular, then linear, at the world's origin. */
typedef struct motion {
  double pos[3], quat[4];
  double velocity[6], acceleration[6], force[6];
  double inertia[10]; /* mass, mass times centre, xx yy zz xy xz yz                 */
} motion;

/* What a step needs while it runs: nothing in it outlives the step. */
typedef struct workspace {
  motion *bodies;
  double (*axes)[6];  /* motion that each degree of freedom makes                   */
  double *mass;       /* nv x nv                                                    */
  double *force;      /* nv                                                         */
} workspace;

/* Fills in `error` and returns `code`. */
asid_code refuse(asid_error *error, asid_code code, const char *subject, const char *format, ...);

/* scene.c: builds a mechanism, or says why not. */
asid_code mechanism_new(const asid_world *world, mechanism **made, asid_error *error);
void mechanism_free(mechanism *m);

/* scene.c: a column of parameters, and a row of them from the values of columns. */
typedef struct column {
  size_t at;    /* in the row                                                       */
  int pass;     /* columns are applied pass by pass                                 */
  int sign;     /* 0: any value, 1: not negative, 2: positive                       */
  size_t body;  /* whose mass properties it changes; 0 where it changes none        */
} column;
asid_code column_find(const mechanism *m, const asid_target *target, column *found, asid_error *error);
asid_code columns_find(const mechanism *m, const asid_target *targets, size_t count, column *found,
                       asid_error *error);
asid_code column_check(const column *c, double value, asid_error *error);
void parameters_fill(const mechanism *m, const column *columns, size_t count, const double *values, double *p);

/* dynamics.c: one step, for given commands, generalised forces and wrenches on bodies
 * (nbody x 6, force then torque at the centre of mass; may be NULL). Returns NULL, or why
 * the simulation has diverged. */
const char *mechanism_step(const mechanism *m, const double *p, double *qpos, double *qvel,
                           const double *ctrl, const double *force, const double *wrench, workspace *w);

/* dynamics.c: where all bodies are and how they move. */
void mechanism_move(const mechanism *m, const double *p, const double *qpos, const double *qvel, workspace *w);

/* dynamics.c: reads a sensor after mechanism_move. */
void sensor_read(const mechanism *m, const sensor *s, const double *p, const double *qpos,
                 const double *qvel, double time, const workspace *w, double *out);

/* dynamics.c: inertia of a body about the origin of the frame that it is placed in by
 * `pos` and `quat`, from mass, centre and inertia in its own. */
void inertia_at_origin(const motion *placed, const double own[10], double out[10]);

/* dynamics.c: v turned by q. */
void quat_rotate(const double q[4], const double v[3], double out[3]);

/* dynamics.c: quaternions at unit length. */
void mechanism_normalise(const mechanism *m, double *qpos);

/* What sensors read. */
enum {
  READ_NOTHING, READ_JOINT_POSITION, READ_JOINT_VELOCITY, READ_CLOCK,
  READ_POSITION, READ_ORIENTATION, READ_X, READ_Y, READ_Z,
  READ_VELOCITY, READ_RATE, READ_OWN_VELOCITY, READ_OWN_RATE
};

#endif
