/* dynamics.c: motion of a tree of joints. Kinematics outwards, forces and composite
 * inertia inwards (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6,
 * with every spatial vector at the world's origin), and one implicit step. */
#include "mechanism.h"

#include <math.h>
#include <string.h>

/* Beyond this a state is no state: m, m/s, m/s2, rad... */
static const double PLAUSIBLE = 1e10;

static void cross(const double a[3], const double b[3], double out[3]) {
  double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
  out[0] = x;
  out[1] = y;
}

static double dot(const double *a, const double *b, int n) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

static void quat_product(const double a[4], const double b[4], double out[4]) {
  double v[3], w = a[0] * b[0] - dot(a + 1, b + 1, 3);
  cross(a + 1, b + 1, v);
  for (int i = 0; i < 3; i++) v[i] += a[0] * b[i + 1] + b[0] * a[i + 1];
  out[0] = w;
  memcpy(out + 1, v, sizeof v);
}

void quat_rotate(const double q[4], const double v[3], double out[3]) {
  double t[3], u[3];
  cross(q + 1, v, t);
  cross(q + 1, t, u);
  for (int i = 0; i < 3; i++) out[i] = v[i] + 2 * (q[0] * t[i] + u[i]);
}

static void rotate_back(const double q[4], const double v[3], double out[3]) {
  double inverse[4] = {q[0], -q[1], -q[2], -q[3]};
  quat_rotate(inverse, v, out);
}

/* Turns q by `scale` times a rotation vector in its own frame. */
static void turn(double q[4], const double vector[3], double scale) {
  double angle = scale * sqrt(dot(vector, vector, 3)), by[4] = {1, 0, 0, 0};
  if (angle != 0) {
    by[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++) by[i + 1] = sin(angle / 2) / angle * scale * vector[i];
  }
  quat_product(q, by, q);
}

static void normalise(double q[4]) {
  double norm = sqrt(dot(q, q, 4));
  if (norm > 0 && isfinite(norm)) {
    for (int i = 0; i < 4; i++) q[i] /= norm;
  } else if (norm == 0) {
    q[0] = 1;
  }
}

void mechanism_normalise(const mechanism *m, double *qpos) {
  for (size_t i = 0; i < m->njoint; i++) {
    const asid_joint *j = &m->joints[i];
    if (j->kind == ASID_FREE) normalise(qpos + j->qpos + 3);
    if (j->kind == ASID_BALL) normalise(qpos + j->qpos);
  }
}

/* Adds the motion of `n` degrees of freedom that move on what is moving already. */
static void advance(motion *b, double (*axes)[6], const double *v, int n) {
  double own[6] = {0}, t[3];
  for (int d = 0; d < n; d++)
    for (int i = 0; i < 6; i++) own[i] += axes[d][i] * v[d];
  const double *w = b->velocity, *u = b->velocity + 3;
  cross(w, own, t);
  for (int i = 0; i < 3; i++) b->acceleration[i] += t[i];
  cross(w, own + 3, t);
  for (int i = 0; i < 3; i++) b->acceleration[i + 3] += t[i];
  cross(u, own, t);
  for (int i = 0; i < 3; i++) b->acceleration[i + 3] += t[i];
  for (int i = 0; i < 6; i++) b->velocity[i] += own[i];
}

/* The motion of turning about an axis through a point. */
static void turning(const double axis[3], const double point[3], double out[6]) {
  memcpy(out, axis, 3 * sizeof *out);
  cross(point, axis, out + 3);
}

static void move_joint(const asid_joint *j, const double *q, const double *v, motion *b, double (*axes)[6]) {
  static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  double axis[3], anchor[3];
  if (j->kind == ASID_FREE) {
    memcpy(b->pos, q, sizeof b->pos);
    memcpy(b->quat, q + 3, sizeof b->quat);
    memset(axes, 0, 3 * sizeof *axes);
    for (int i = 0; i < 3; i++) axes[i][3 + i] = 1;
    advance(b, axes, v, 3);
    for (int i = 0; i < 3; i++) {
      quat_rotate(b->quat, unit[i], axis);
      turning(axis, b->pos, axes[3 + i]);
    }
    advance(b, axes + 3, v + 3, 3);
    return;
  }
  quat_rotate(b->quat, j->axis, axis);
  if (j->kind == ASID_SLIDE) {
    for (int i = 0; i < 3; i++) b->pos[i] += axis[i] * (q[0] - j->ref);
    memset(axes[0], 0, 3 * sizeof(double));
    memcpy(axes[0] + 3, axis, sizeof axis);
    advance(b, axes, v, 1);
    return;
  }
  /* A hinge or ball turns the body about the anchor, which stays. */
  quat_rotate(b->quat, j->pos, anchor);
  for (int i = 0; i < 3; i++) anchor[i] += b->pos[i];
  if (j->kind == ASID_HINGE) turn(b->quat, j->axis, q[0] - j->ref);
  else quat_product(b->quat, q, b->quat);
  quat_rotate(b->quat, j->pos, b->pos);
  for (int i = 0; i < 3; i++) b->pos[i] = anchor[i] - b->pos[i];
  int n = j->kind == ASID_HINGE ? 1 : 3;
  for (int i = 0; i < n; i++) {
    if (n == 3) quat_rotate(b->quat, unit[i], axis);
    turning(axis, anchor, axes[i]);
  }
  advance(b, axes, v, n);
}

void mechanism_move(const mechanism *m, const double *p, const double *qpos, const double *qvel, workspace *w) {
  memset(&w->bodies[0], 0, sizeof w->bodies[0]);
  w->bodies[0].quat[0] = 1;
  /* Gravity is an upward acceleration of the world. */
  for (int i = 0; i < 3; i++) w->bodies[0].acceleration[3 + i] = -p[i];
  size_t next = 0;
  for (size_t i = 1; i < m->nbody; i++) {
    const motion *parent = &w->bodies[m->bodies[i].parent];
    motion *b = &w->bodies[i];
    *b = *parent;
    quat_rotate(parent->quat, m->bodies[i].pos, b->pos);
    for (int k = 0; k < 3; k++) b->pos[k] += parent->pos[k];
    quat_product(parent->quat, m->bodies[i].quat, b->quat);
    for (; next < m->njoint && m->joints[next].body == i; next++) {
      const asid_joint *j = &m->joints[next];
      move_joint(j, qpos + j->qpos, qvel + j->qvel, b, w->axes + j->qvel);
    }
  }
}

void inertia_at_origin(const motion *b, const double values[10], double out[10]) {
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  const double *own = values + 4;
  double tensor[3][3] = {{own[0], own[3], own[4]}, {own[3], own[1], own[5]}, {own[4], own[5], own[2]}};
  double half[3][3], c[3];
  /* R I R^T: each row of I turned, then each column of that. */
  for (int i = 0; i < 3; i++) quat_rotate(b->quat, tensor[i], half[i]);
  for (int k = 0; k < 3; k++) {
    double line[3] = {half[0][k], half[1][k], half[2][k]};
    quat_rotate(b->quat, line, tensor[k]);
  }
  quat_rotate(b->quat, values + 1, c);
  for (int i = 0; i < 3; i++) c[i] += b->pos[i];
  double mass = values[0], square = dot(c, c, 3);
  out[0] = mass;
  for (int i = 0; i < 3; i++) out[1 + i] = mass * c[i];
  for (int i = 0; i < 6; i++)
    out[4 + i] = tensor[row[i]][column[i]] + mass * ((i < 3 ? square : 0) - c[row[i]] * c[column[i]]);
}

/* Momentum of a body that moves so. */
static void momentum(const double inertia[10], const double velocity[6], double out[6]) {
  const double *h = inertia + 1, *I = inertia + 4, *w = velocity, *v = velocity + 3;
  double t[3];
  cross(h, v, t);
  out[0] = I[0] * w[0] + I[3] * w[1] + I[4] * w[2] + t[0];
  out[1] = I[3] * w[0] + I[1] * w[1] + I[5] * w[2] + t[1];
  out[2] = I[4] * w[0] + I[5] * w[1] + I[2] * w[2] + t[2];
  cross(h, w, t);
  for (int i = 0; i < 3; i++) out[3 + i] = inertia[0] * v[i] - t[i];
}

/* Force that the body's present motion takes, less the wrench on it. */
static void body_force(motion *b, const double *wrench) {
  double p[6], t[3];
  momentum(b->inertia, b->acceleration, b->force);
  momentum(b->inertia, b->velocity, p);
  cross(b->velocity, p, t);
  for (int i = 0; i < 3; i++) b->force[i] += t[i];
  cross(b->velocity + 3, p + 3, t);
  for (int i = 0; i < 3; i++) b->force[i] += t[i];
  cross(b->velocity, p + 3, t);
  for (int i = 0; i < 3; i++) b->force[3 + i] += t[i];
  if (wrench && b->inertia[0] > 0) {
    double centre[3];
    for (int i = 0; i < 3; i++) centre[i] = b->inertia[1 + i] / b->inertia[0];
    cross(centre, wrench, t);
    for (int i = 0; i < 3; i++) b->force[i] -= wrench[3 + i] + t[i];
    for (int i = 0; i < 3; i++) b->force[3 + i] -= wrench[i];
  }
}

/* Mass matrix, and the forces that the motion takes from `force`. */
static void tree_dynamics(const mechanism *m, const double *p, const double *wrench, workspace *w) {
  for (size_t i = 1; i < m->nbody; i++) {
    inertia_at_origin(&w->bodies[i], p + m->body_at + PER_BODY * i, w->bodies[i].inertia);
    body_force(&w->bodies[i], wrench ? wrench + 6 * i : NULL);
  }
  memset(w->mass, 0, m->nv * m->nv * sizeof *w->mass);
  /* From the leaves inwards: at its turn a body carries all that it carries. */
  size_t last = m->njoint;
  for (size_t i = m->nbody - 1; i > 0; i--) {
    motion *b = &w->bodies[i], *parent = &w->bodies[m->bodies[i].parent];
    for (; last > 0 && m->joints[last - 1].body == i; last--) {
      int first = (int)m->joints[last - 1].qvel;
      int end = last == m->njoint ? (int)m->nv : (int)m->joints[last].qvel;
      for (int d = first; d < end; d++) {
        double carried[6];
        momentum(b->inertia, w->axes[d], carried);
        w->force[d] -= dot(w->axes[d], b->force, 6);
        for (int e = d; e >= 0; e = m->dof_parent[e])
          w->mass[d * m->nv + e] = w->mass[e * m->nv + d] = dot(w->axes[e], carried, 6);
      }
    }
    for (int k = 0; k < 6; k++) parent->force[k] += b->force[k];
    for (int k = 0; k < 10; k++) parent->inertia[k] += b->inertia[k];
  }
}

/* Springs, dampers and rotors. Damping acts on the velocity at the end of the step, so
 * that it stays stable however strong it is: its derivative goes to the mass matrix. */
static void joint_forces(const mechanism *m, const double *p, const double *qpos, const double *qvel, workspace *w) {
  for (size_t i = 0; i < m->njoint; i++) {
    const asid_joint *j = &m->joints[i];
    const double *value = p + m->joint_at + PER_JOINT * i;
    size_t end = i + 1 < m->njoint ? m->joints[i + 1].qvel : m->nv;
    for (size_t d = j->qvel; d < end; d++) {
      w->force[d] -= value[0] * qvel[d];
      w->mass[d * m->nv + d] += value[2] + m->timestep * value[0];
    }
    if (value[1] != 0) w->force[j->qvel] -= value[1] * (qpos[j->qpos] - j->springref);
  }
}

static double clamp(double x, int limited, const double range[2]) {
  return limited ? fmin(fmax(x, range[0]), range[1]) : x;
}

/* Motors and servos; their damping as that of joints, unless they are at their limit. */
static void drive_forces(const mechanism *m, const double *p, const double *qpos, const double *qvel,
                         const double *ctrl, workspace *w) {
  for (size_t i = 0; i < m->nactuator; i++) {
    const asid_actuator *a = &m->actuators[i];
    const asid_joint *j = &m->joints[a->joint];
    const double *value = p + m->actuator_at + PER_ACTUATOR * i;
    double gear = value[0], kp = value[1], kv = value[2];
    double command = clamp(ctrl[i], a->ctrl_limited, a->ctrl_range);
    double length = gear * qpos[j->qpos], speed = gear * qvel[j->qvel];
    double wanted = a->kind == ASID_MOTOR      ? command
                    : a->kind == ASID_POSITION ? kp * (command - length) - kv * speed
                                               : kv * (command - speed);
    double given = clamp(wanted, a->force_limited, a->force_range);
    w->force[j->qvel] += gear * given;
    if (given == wanted && a->kind != ASID_MOTOR)
      w->mass[j->qvel * m->nv + j->qvel] += m->timestep * gear * gear * kv;
  }
}

/* Solves mass times x = force in place by Cholesky's method; 0 where it cannot. */
static int solve(double *mass, double *x, size_t n) {
  for (size_t i = 0; i < n; i++) {
    for (size_t k = 0; k <= i; k++) {
      double sum = mass[i * n + k];
      for (size_t l = 0; l < k; l++) sum -= mass[i * n + l] * mass[k * n + l];
      if (i == k && !(sum > 0)) return 0;
      mass[i * n + k] = i == k ? sqrt(sum) : sum / mass[k * n + k];
    }
    for (size_t l = 0; l < i; l++) x[i] -= mass[i * n + l] * x[l];
    x[i] /= mass[i * n + i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t l = i + 1; l < n; l++) x[i] -= mass[l * n + i] * x[l];
    x[i] /= mass[i * n + i];
  }
  return 1;
}

static int plausible(const double *values, size_t n) {
  for (size_t i = 0; i < n; i++)
    if (!(fabs(values[i]) <= PLAUSIBLE)) return 0;
  return 1;
}

const char *mechanism_step(const mechanism *m, const double *p, double *qpos, double *qvel,
                           const double *ctrl, const double *force, const double *wrench, workspace *w) {
  double dt = m->timestep;
  mechanism_move(m, p, qpos, qvel, w);
  memcpy(w->force, force, m->nv * sizeof *w->force);
  tree_dynamics(m, p, wrench, w);
  joint_forces(m, p, qpos, qvel, w);
  drive_forces(m, p, qpos, qvel, ctrl, w);
  if (!solve(w->mass, w->force, m->nv)) return "the mass matrix is not positive";
  if (!plausible(w->force, m->nv)) return "an acceleration is beyond 1e10";
  /* Velocities first, then positions with them: symplectic. */
  for (size_t d = 0; d < m->nv; d++) qvel[d] += dt * w->force[d];
  for (size_t i = 0; i < m->njoint; i++) {
    const asid_joint *j = &m->joints[i];
    double *q = qpos + j->qpos, *v = qvel + j->qvel;
    if (j->kind == ASID_HINGE || j->kind == ASID_SLIDE) q[0] += dt * v[0];
    if (j->kind == ASID_BALL) turn(q, v, dt);
    if (j->kind == ASID_FREE) {
      for (int k = 0; k < 3; k++) q[k] += dt * v[k];
      turn(q + 3, v + 3, dt);
    }
  }
  mechanism_normalise(m, qpos);
  if (!plausible(qpos, m->nq)) return "a position is beyond 1e10";
  if (!plausible(qvel, m->nv)) return "a velocity is beyond 1e10";
  return NULL;
}

void sensor_read(const mechanism *m, const sensor *s, const double *p, const double *qpos,
                 const double *qvel, double time, const workspace *w, double *out) {
  if (s->reading == READ_CLOCK) {
    out[0] = time;
    return;
  }
  if (s->reading == READ_JOINT_POSITION || s->reading == READ_JOINT_VELOCITY) {
    const asid_joint *j = &m->joints[s->object];
    const double *from = s->reading == READ_JOINT_POSITION ? qpos + j->qpos : qvel + j->qvel;
    memcpy(out, from, s->length * sizeof *out);
    return;
  }
  const motion *b = &w->bodies[s->object];
  double place[3], quat[4], velocity[3];
  static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  quat_rotate(b->quat, s->parameter ? p + s->parameter : s->pos, place);
  for (int i = 0; i < 3; i++) place[i] += b->pos[i];
  quat_product(b->quat, s->quat, quat);
  cross(b->velocity, place, velocity);
  for (int i = 0; i < 3; i++) velocity[i] += b->velocity[3 + i];
  switch (s->reading) {
    case READ_POSITION: memcpy(out, place, sizeof place); break;
    case READ_ORIENTATION: memcpy(out, quat, sizeof quat); break;
    case READ_VELOCITY: memcpy(out, velocity, sizeof velocity); break;
    case READ_RATE: memcpy(out, b->velocity, sizeof velocity); break;
    case READ_OWN_VELOCITY: rotate_back(quat, velocity, out); break;
    case READ_OWN_RATE: rotate_back(quat, b->velocity, out); break;
    default: quat_rotate(quat, unit[s->reading - READ_X], out); break;
  }
}
