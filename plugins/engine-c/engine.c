/* engine.c: a physics engine for ASID in one file, to start from. It flies rigid bodies:
 * a free joint each, under gravity and pushes, without contact. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "asid_backend.h"

enum { MOST = 32 }; /* bodies, sensors, parameters */
enum { POSITION, ORIENTATION, VELOCITY, RATE, UNKNOWN };

typedef struct flyer {
  double mass, com[3], moments[3], axes[4]; /* principal moments, body_from_principal */
} flyer;

typedef struct sensor {
  int reading;
  size_t flyer;
  double pos[3], quat[4]; /* of its frame in the flyer */
} sensor;

/* All that moves in a simulation: positions and velocities of free joints, and the time. */
typedef struct state {
  double qpos[7 * MOST], qvel[6 * MOST], time;
  asid_status status;
} state;

/* A loaded scene. It never changes, so any number of batches and threads share it. */
struct asid_model {
  double timestep, gravity[3];
  size_t n, nsensor; /* flyer i is body i + 1 */
  flyer flyers[MOST];
  sensor sensors[MOST];
  state start;
};

/* Simulations, each with a state and parameters of its own; gravity is the only one here. */
struct asid_batch {
  const asid_model *model;
  size_t size, ncolumn, columns[MOST]; /* which component of gravity a column sets */
  uint64_t steps;
  struct { state now; double gravity[3]; } sims[];
};

struct asid_snapshot {
  size_t count;
  state states[];
};

static asid_code fail(asid_error *error, asid_code code, const char *why, const char *what) {
  snprintf(error->message, sizeof error->message, "%s%s%s", why, *what ? ": " : "", what);
  return code;
}

/* Refuses what this engine would otherwise ignore in silence. */
static asid_code check(const asid_world *w, asid_error *error) {
  for (size_t i = 0; i < w->nleft_out; i++) /* how other engines integrate is no physics */
    if (strcmp(w->left_out[i], "option integrator") != 0 && strcmp(w->left_out[i], "option cone") != 0)
      return fail(error, ASID_SCENE, "this engine lacks", w->left_out[i]);
  if (w->nbody > MOST || w->nsensor > MOST) return fail(error, ASID_SCENE, "the scene is too large", "");
  if (w->nactuator > 0) return fail(error, ASID_SCENE, "this engine has no actuators", w->actuators[0].name);
  for (size_t i = 1; i < w->nbody; i++) {
    const asid_body *b = &w->bodies[i];
    if (i > w->njoint || w->joints[i - 1].body != i || w->joints[i - 1].kind != ASID_FREE)
      return fail(error, ASID_SCENE, "this engine needs one free joint on each body", b->name);
    const asid_joint *j = &w->joints[i - 1];
    if (!(b->mass > 0 && b->moments[0] > 0 && b->moments[1] > 0 && b->moments[2] > 0))
      return fail(error, ASID_SCENE, "a body flies without mass or inertia", b->name);
    if (j->damping != 0 || j->armature != 0 || j->frictionloss != 0 || j->stiffness != 0)
      return fail(error, ASID_SCENE, "this engine has no springs and dampers", j->name);
  }
  for (size_t i = 0; i < w->ngeom; i++)
    if (w->geoms[i].contype != 0 || w->geoms[i].conaffinity != 0)
      return fail(error, ASID_SCENE, "this engine has no contact; give contype and conaffinity 0", w->geoms[i].name);
  return ASID_OK;
}

/* What a sensor reads, and where. One that this engine cannot read is no reason to refuse
 * the scene: it is refused when somebody records it. */
static void find_sensor(const asid_world *w, const asid_sensor *from, sensor *to) {
  static const char *const kinds[] = {"framepos", "framequat", "framelinvel", "frameangvel"};
  uint64_t body = from->object;
  to->quat[0] = 1;
  while (to->reading < UNKNOWN && strcmp(from->kind, kinds[to->reading]) != 0) to->reading++;
  if (strcmp(from->object_kind, "site") == 0) {
    body = w->sites[from->object].body;
    memcpy(to->pos, w->sites[from->object].pos, sizeof to->pos);
    memcpy(to->quat, w->sites[from->object].quat, sizeof to->quat);
  } else if (strcmp(from->object_kind, "body") == 0) { /* the frame of the centre of mass */
    memcpy(to->pos, w->bodies[body].com, sizeof to->pos);
    memcpy(to->quat, w->bodies[body].iquat, sizeof to->quat);
  } else if (strcmp(from->object_kind, "xbody") != 0) {
    body = 0;
  }
  if (body == 0) to->reading = UNKNOWN;
  else to->flyer = (size_t)body - 1;
}

static asid_code load(const asid_scene *scene, asid_model **model, asid_error *error) {
  const asid_world *w = scene->world(scene, error);
  if (!w) return ASID_SCENE; /* the host has said why */
  asid_code code = check(w, error);
  if (code != ASID_OK) return code;
  asid_model *m = calloc(1, sizeof *m);
  if (!m) return fail(error, ASID_FAILED, "out of memory", "");
  /* `w` is gone when this function returns, so everything is copied. */
  m->timestep = w->timestep, m->n = w->njoint, m->nsensor = w->nsensor;
  memcpy(m->gravity, w->gravity, sizeof m->gravity);
  for (size_t i = 0; i < m->n; i++) {
    m->flyers[i].mass = w->bodies[i + 1].mass;
    memcpy(m->flyers[i].com, w->bodies[i + 1].com, sizeof m->flyers[i].com);
    memcpy(m->flyers[i].moments, w->bodies[i + 1].moments, sizeof m->flyers[i].moments);
    memcpy(m->flyers[i].axes, w->bodies[i + 1].iquat, sizeof m->flyers[i].axes);
  }
  memcpy(m->start.qpos, w->nkeyframe ? w->keyframes[0].qpos : w->qpos0, w->nq * sizeof(double));
  if (w->nkeyframe) memcpy(m->start.qvel, w->keyframes[0].qvel, w->nv * sizeof(double));
  for (size_t i = 0; i < m->nsensor; i++) find_sensor(w, &w->sensors[i], &m->sensors[i]);
  *model = m;
  return ASID_OK;
}

static void destroy_model(asid_model *m) { free(m); }

/* The parameter that a target means: here a component of gravity. */
static asid_code find_column(const asid_target *t, size_t *column, asid_error *error) {
  if (strcmp(t->element, "option") != 0 || strcmp(t->attribute, "gravity") != 0 || t->index > 2)
    return fail(error, ASID_PARAMETER, "this engine can change option/gravity/{0,1,2} only", "");
  *column = (size_t)t->index;
  return ASID_OK;
}

static asid_code nominal(const asid_model *m, const asid_target *target, double *value, asid_error *error) {
  size_t column;
  asid_code code = find_column(target, &column, error);
  if (code == ASID_OK) *value = m->gravity[column];
  return code;
}

static asid_code make_batch(const asid_model *m, const asid_batch_config *config, asid_batch **batch,
                            asid_error *error) {
  if (config->target_count > MOST) return fail(error, ASID_CONFIG, "too many parameters", "");
  asid_batch *b = calloc(1, sizeof *b + config->batch_size * sizeof b->sims[0]);
  if (!b) return fail(error, ASID_FAILED, "out of memory", "");
  b->model = m, b->size = config->batch_size, b->ncolumn = config->target_count;
  asid_code code = ASID_OK;
  for (size_t i = 0; i < b->ncolumn && code == ASID_OK; i++)
    code = find_column(&config->targets[i], &b->columns[i], error);
  for (size_t i = 0; i < b->size; i++) {
    b->sims[i].now = m->start;
    memcpy(b->sims[i].gravity, m->gravity, sizeof m->gravity);
  }
  if (code == ASID_OK) *batch = b;
  else free(b);
  return code;
}

static void destroy_batch(asid_batch *b) { free(b); }

static asid_code reset(asid_batch *b, const uint64_t *sims, uint64_t count, asid_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) b->sims[sims[i]].now = b->model->start;
  return ASID_OK;
}

static void normalise(double q[4]) {
  double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 0; i < 4; i++) q[i] = norm > 0 ? q[i] / norm : i == 0;
}

static asid_code set_state(asid_batch *b, const uint64_t *sims, uint64_t count, const double *qpos,
                           const double *qvel, asid_error *error) {
  (void)error;
  size_t n = b->model->n;
  for (size_t i = 0; i < count; i++) {
    state *s = &b->sims[sims[i]].now;
    memcpy(s->qpos, qpos + 7 * n * i, 7 * n * sizeof *qpos);
    memcpy(s->qvel, qvel + 6 * n * i, 6 * n * sizeof *qvel);
    for (size_t k = 0; k < n; k++) normalise(s->qpos + 7 * k + 3);
  }
  return ASID_OK;
}

static asid_code set_parameters(asid_batch *b, const uint64_t *sims, uint64_t count, const double *values,
                                asid_error *error) {
  (void)error; /* any gravity will do; a mass would be checked here, all rows before the first is set */
  for (size_t i = 0; i < count; i++)
    for (size_t c = 0; c < b->ncolumn; c++) b->sims[sims[i]].gravity[b->columns[c]] = values[b->ncolumn * i + c];
  return ASID_OK;
}

static void cross(const double a[3], const double b[3], double out[3]) {
  double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  memcpy(out, c, sizeof c);
}

/* v turned by q, or back where `sign` is -1. */
static void rotate(const double q[4], double sign, const double v[3], double out[3]) {
  double u[3] = {sign * q[1], sign * q[2], sign * q[3]}, t[3], tt[3];
  cross(u, v, t);
  cross(u, t, tt);
  for (int i = 0; i < 3; i++) out[i] = v[i] + 2 * (q[0] * t[i] + tt[i]);
}

static void product(const double a[4], const double b[4], double out[4]) {
  double c[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                 a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                 a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
                 a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1]};
  memcpy(out, c, sizeof c);
}

/* Velocity in the world of a point that is fixed in a body. Of a free joint the linear
 * velocity is that of the body's origin in the world, the angular one is in the body. */
static void velocity_at(const double *q, const double *v, const double point[3], double out[3]) {
  cross(v + 3, point, out);
  rotate(q + 3, 1, out, out);
  for (int i = 0; i < 3; i++) out[i] += v[i];
}

/* One step of one body: Newton at the centre of mass and Euler about it, in the principal
 * axes; velocities first, then the pose with the new ones. `wrench` acts at the centre of
 * mass, in the world; `joint` is the generalised force of the free joint. */
static void fly(const flyer *f, double *q, double *v, const double *gravity, const double *wrench,
                const double *joint, double dt) {
  double speed[3], arm[3], torque[3], push[3], spin[3], momentum[3], gyroscopic[3], centre[3], turning[3], angle = 0;
  velocity_at(q, v, f->com, speed);
  rotate(q + 3, 1, f->com, arm);
  /* A force at the origin also turns the body about its centre of mass. */
  rotate(q + 3, -1, joint, push);
  cross(push, f->com, push);
  rotate(q + 3, -1, wrench + 3, torque);
  for (int i = 0; i < 3; i++) torque[i] += joint[3 + i] + push[i];
  rotate(f->axes, -1, torque, torque);
  rotate(f->axes, -1, v + 3, spin);
  for (int i = 0; i < 3; i++) momentum[i] = f->moments[i] * spin[i];
  cross(spin, momentum, gyroscopic);
  for (int i = 0; i < 3; i++) {
    speed[i] += dt * (gravity[i] + (wrench[i] + joint[i]) / f->mass);
    spin[i] += dt * (torque[i] - gyroscopic[i]) / f->moments[i];
    centre[i] = q[i] + arm[i] + dt * speed[i];
    angle = hypot(angle, dt * spin[i]);
  }
  rotate(f->axes, 1, spin, v + 3);
  double half = angle > 0 ? sin(angle / 2) / angle * dt : 0;
  double turn[4] = {cos(angle / 2), half * v[3], half * v[4], half * v[5]};
  product(q + 3, turn, q + 3);
  normalise(q + 3);
  /* From the centre of mass back to the origin of the body. */
  rotate(q + 3, 1, f->com, arm);
  cross(v + 3, f->com, turning);
  rotate(q + 3, 1, turning, turning);
  for (int i = 0; i < 3; i++) q[i] = centre[i] - arm[i], v[i] = speed[i] - turning[i];
}

/* One step of one simulation; a state that makes no sense any more ends it. */
static void step(asid_batch *b, size_t sim, const asid_rollout *r, size_t row, size_t frame, size_t substep) {
  static const double nothing[6] = {0};
  const asid_model *m = b->model;
  state *s = &b->sims[sim].now;
  double joint[6 * MOST] = {0};
  asid_step_view view = {s->time, s->qpos, s->qvel, NULL, joint}; /* no commands: nu is 0 */
  if (r->hook) r->hook(r->hook_context, row, frame * r->substeps + substep, &view);
  s->time += m->timestep;
  b->steps++;
  for (size_t i = 0; i < m->n; i++) {
    const double *wrench = nothing;
    for (size_t k = 0; k < r->force_count; k++)
      if (r->forces[k].body == i + 1) wrench = r->forces[k].wrench + 6 * (row * r->frames + frame);
    double *q = s->qpos + 7 * i, *v = s->qvel + 6 * i;
    fly(&m->flyers[i], q, v, b->sims[sim].gravity, wrench, joint + 6 * i, m->timestep);
    for (int k = 0; k < 6; k++)
      if (!(fabs(q[k]) < 1e10 && fabs(v[k]) < 1e10)) { /* NaN is not below either */
        s->status.diverged = 1;
        s->status.time = s->time;
        snprintf(s->status.message, sizeof s->status.message, "body %d is beyond 1e10", (int)i + 1);
      }
  }
}

static void read_sensor(const sensor *s, const double *q, const double *v, double *out) {
  if (s->reading == POSITION) rotate(q + 3, 1, s->pos, out);
  for (int i = 0; i < 3 && s->reading == POSITION; i++) out[i] += q[i];
  if (s->reading == ORIENTATION) product(q + 3, s->quat, out);
  if (s->reading == VELOCITY) velocity_at(q, v, s->pos, out);
  if (s->reading == RATE) rotate(q + 3, 1, v + 3, out);
}

/* One row of readings of the state as it is now. */
static void record(const asid_batch *b, size_t sim, const asid_channel *channels, uint64_t count, uint64_t width,
                   double *out) {
  const state *now = &b->sims[sim].now;
  for (size_t i = 0; i < width && now->status.diverged; i++) out[i] = NAN;
  for (size_t i = 0; i < count && !now->status.diverged; i++) {
    const asid_channel *c = &channels[i];
    if (c->kind == ASID_CHANNEL_SENSOR) {
      const sensor *s = &b->model->sensors[c->a];
      read_sensor(s, now->qpos + 7 * s->flyer, now->qvel + 6 * s->flyer, out);
      out += s->reading == ORIENTATION ? 4 : 3;
    } else {
      memcpy(out, (c->kind == ASID_CHANNEL_QPOS ? now->qpos : now->qvel) + c->a, c->b * sizeof *out);
      out += c->b;
    }
  }
}

/* Refuses to record what this engine cannot read. */
static asid_code can_record(const asid_batch *b, const asid_channel *channels, uint64_t count, asid_error *error) {
  for (size_t i = 0; i < count; i++)
    if (channels[i].kind == ASID_CHANNEL_SENSOR && b->model->sensors[channels[i].a].reading == UNKNOWN)
      return fail(error, ASID_INCAPABLE, "read sensors other than poses and velocities of flying bodies", "");
  return ASID_OK;
}

static asid_code rollout(asid_batch *b, const asid_rollout *r, double *out, asid_error *error) {
  asid_code code = can_record(b, r->channels, r->channel_count, error);
  for (size_t row = 0; row < r->count && code == ASID_OK; row++)
    for (size_t frame = 0; frame < r->frames; frame++) {
      size_t sim = r->sims[row], cell = row * r->frames + frame;
      for (size_t i = 0; i < r->change_count; i++)
        if (r->changes[i].frame == frame)
          b->sims[sim].gravity[b->columns[r->changes[i].column]] = r->changes[i].values[row];
      for (size_t i = 0; i < r->substeps && !b->sims[sim].now.status.diverged; i++) step(b, sim, r, row, frame, i);
      record(b, sim, r->channels, r->channel_count, r->width, out + r->width * cell);
    }
  return code;
}

static asid_code read_now(asid_batch *b, const uint64_t *sims, uint64_t count, const asid_channel *channels,
                          uint64_t channel_count, uint64_t width, double *out, asid_error *error) {
  asid_code code = can_record(b, channels, channel_count, error);
  for (size_t i = 0; i < count && code == ASID_OK; i++)
    record(b, sims[i], channels, channel_count, width, out + width * i);
  return code;
}

static asid_code save(asid_batch *b, const uint64_t *sims, uint64_t count, asid_snapshot **snapshot,
                      asid_error *error) {
  asid_snapshot *s = calloc(1, sizeof *s + count * sizeof s->states[0]);
  if (!s) return fail(error, ASID_FAILED, "out of memory", "");
  for (s->count = 0; s->count < count; s->count++) s->states[s->count] = b->sims[sims[s->count]].now;
  *snapshot = s;
  return ASID_OK;
}

static asid_code restore(asid_batch *b, const asid_snapshot *s, const uint64_t *rows, const uint64_t *sims,
                         uint64_t count, asid_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) b->sims[sims[i]].now = s->states[rows[i]];
  return ASID_OK;
}

static void destroy_snapshot(asid_snapshot *s) { free(s); }

static void status(const asid_batch *b, uint64_t first, uint64_t count, asid_status *out) {
  for (size_t i = 0; i < count; i++) out[i] = b->sims[first + i].now.status;
}

static uint64_t diverged_count(const asid_batch *b) {
  uint64_t n = 0;
  for (size_t i = 0; i < b->size; i++) n += b->sims[i].now.status.diverged != 0;
  return n;
}

static uint64_t steps_taken(const asid_batch *b) { return b->steps; }

static const asid_backend TABLE = {
    .abi_major = ASID_ABI_MAJOR,
    .abi_minor = ASID_ABI_MINOR,
    .size = sizeof(asid_backend),
    .name = "flight",
    .version = "0.1",
    .about = "rigid bodies in free flight, in plain C",
    .capabilities = ASID_FREE_BODIES | ASID_EXTERNAL_FORCES | ASID_PARAMETER_CHANGES | ASID_STEP_HOOKS |
                    ASID_EXACT_SNAPSHOT | ASID_DOUBLE_PRECISION,
    .load = load,
    .destroy_model = destroy_model,
    .nominal = nominal,
    .make_batch = make_batch,
    .destroy_batch = destroy_batch,
    .set_parameters = set_parameters,
    .reset = reset,
    .set_state = set_state,
    .rollout = rollout,
    .read = read_now,
    .save = save,
    .restore = restore,
    .destroy_snapshot = destroy_snapshot,
    .status = status,
    .diverged_count = diverged_count,
    .steps_taken = steps_taken,
};

const asid_backend *asid_backend_entry(void) { return &TABLE; }
