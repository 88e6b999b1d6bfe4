/* engine.c: the engine as the host sees it, function by function in the order of the
 * table. There is no physics in it: put your own behind the calls of mechanism.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mechanism.h"

struct asid_model {
  mechanism *mechanism;
};

/* One row of each a simulation. A state is qpos, then qvel, then the time. */
struct asid_batch {
  const mechanism *m;
  size_t size, ncolumn, nstate;
  column *columns;
  double *values;     /* of the columns, as set                                     */
  double *parameters; /* all of the mechanism's                                     */
  double *states;
  asid_status *status;
  uint64_t steps;
  double *ctrl, *force, *wrench; /* of the step that is being taken                 */
  workspace work;
};

struct asid_snapshot {
  double *states;
  asid_status *status;
};

/* -------------------------------------------------------------------- models */

static asid_code load(const asid_scene *scene, asid_model **model, asid_error *error) {
  const asid_world *world = scene->world(scene, error);
  if (!world) return ASID_SCENE; /* the host has filled in `error` */
  asid_model *made = calloc(1, sizeof *made);
  if (!made) return refuse(error, ASID_FAILED, "", "out of memory");
  asid_code code = mechanism_new(world, &made->mechanism, error);
  if (code != ASID_OK) free(made);
  else *model = made;
  return code;
}

static void destroy_model(asid_model *model) {
  mechanism_free(model->mechanism);
  free(model);
}

static asid_code nominal(const asid_model *model, const asid_target *target, double *value, asid_error *error) {
  column found;
  asid_code code = column_find(model->mechanism, target, &found, error);
  if (code == ASID_OK) *value = model->mechanism->nominal[found.at];
  return code;
}

/* ------------------------------------------------------------------- batches */

static void destroy_batch(asid_batch *b) {
  free(b->columns);
  free(b->values);
  free(b->parameters);
  free(b->states);
  free(b->status);
  free(b->ctrl);
  free(b->force);
  free(b->wrench);
  free(b->work.bodies);
  free(b->work.axes);
  free(b->work.mass);
  free(b->work.force);
  free(b);
}

static void start(asid_batch *b, size_t sim) {
  double *state = b->states + b->nstate * sim;
  memcpy(state, b->m->start, (b->nstate - 1) * sizeof *state);
  state[b->nstate - 1] = 0;
  memset(&b->status[sim], 0, sizeof b->status[sim]);
}

static asid_code make_batch(const asid_model *model, const asid_batch_config *config, asid_batch **batch,
                            asid_error *error) {
  const mechanism *m = model->mechanism;
  asid_batch *b = calloc(1, sizeof *b);
  if (!b) return refuse(error, ASID_FAILED, "", "out of memory");
  size_t n = config->batch_size, columns = config->target_count;
  b->m = m, b->size = n, b->ncolumn = columns, b->nstate = m->nq + m->nv + 1;
  b->columns = calloc(columns + 1, sizeof *b->columns);
  b->values = calloc(n * columns + 1, sizeof *b->values);
  b->parameters = calloc(n, m->nparameter * sizeof *b->parameters);
  b->states = calloc(n, b->nstate * sizeof *b->states);
  b->status = calloc(n, sizeof *b->status);
  b->ctrl = calloc(m->nactuator + 1, sizeof *b->ctrl);
  b->force = calloc(m->nv + 1, sizeof *b->force);
  b->wrench = calloc(6 * m->nbody, sizeof *b->wrench);
  b->work.bodies = calloc(m->nbody, sizeof *b->work.bodies);
  b->work.axes = calloc(m->nv + 1, sizeof *b->work.axes);
  b->work.mass = calloc(m->nv * m->nv + 1, sizeof *b->work.mass);
  b->work.force = calloc(m->nv + 1, sizeof *b->work.force);
  asid_code code = ASID_OK;
  if (!b->columns || !b->values || !b->parameters || !b->states || !b->status || !b->ctrl || !b->force ||
      !b->wrench || !b->work.bodies || !b->work.axes || !b->work.mass || !b->work.force)
    code = refuse(error, ASID_FAILED, "", "out of memory");
  if (code == ASID_OK) code = columns_find(m, config->targets, columns, b->columns, error);
  if (code != ASID_OK) {
    destroy_batch(b);
    return code;
  }
  for (size_t sim = 0; sim < n; sim++) {
    for (size_t i = 0; i < columns; i++) b->values[columns * sim + i] = m->nominal[b->columns[i].at];
    memcpy(b->parameters + m->nparameter * sim, m->nominal, m->nparameter * sizeof *m->nominal);
    start(b, sim);
  }
  *batch = b;
  return ASID_OK;
}

static void fill(asid_batch *b, size_t sim) {
  parameters_fill(b->m, b->columns, b->ncolumn, b->values + b->ncolumn * sim, b->parameters + b->m->nparameter * sim);
}

static asid_code set_parameters(asid_batch *b, const uint64_t *sims, uint64_t count, const double *values,
                                asid_error *error) {
  /* All are looked at before any is set: a failed call changes nothing. */
  for (size_t i = 0; i < count * b->ncolumn; i++) {
    asid_code code = column_check(&b->columns[i % b->ncolumn], values[i], error);
    if (code != ASID_OK) return code;
  }
  for (size_t i = 0; i < count; i++) {
    memcpy(b->values + b->ncolumn * sims[i], values + b->ncolumn * i, b->ncolumn * sizeof *values);
    fill(b, sims[i]);
  }
  return ASID_OK;
}

static asid_code reset(asid_batch *b, const uint64_t *sims, uint64_t count, asid_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) start(b, sims[i]);
  return ASID_OK;
}

static asid_code set_state(asid_batch *b, const uint64_t *sims, uint64_t count, const double *qpos,
                           const double *qvel, asid_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) {
    double *state = b->states + b->nstate * sims[i];
    memcpy(state, qpos + b->m->nq * i, b->m->nq * sizeof *qpos);
    memcpy(state + b->m->nq, qvel + b->m->nv * i, b->m->nv * sizeof *qvel);
    mechanism_normalise(b->m, state);
  }
  return ASID_OK;
}

/* ------------------------------------------------------------------ readings */

static asid_code can_record(const asid_batch *b, const asid_channel *channels, uint64_t count, asid_error *error) {
  for (size_t i = 0; i < count; i++) {
    if (channels[i].kind == ASID_CHANNEL_SENSOR && b->m->sensors[channels[i].a].reading == READ_NOTHING)
      return refuse(error, ASID_INCAPABLE, "", "read sensor number %d of this scene", (int)channels[i].a);
  }
  return ASID_OK;
}

static void record(asid_batch *b, size_t sim, const asid_channel *channels, uint64_t count, uint64_t width,
                   double *out) {
  const double *qpos = b->states + b->nstate * sim, *qvel = qpos + b->m->nq;
  const double *p = b->parameters + b->m->nparameter * sim;
  if (b->status[sim].diverged) {
    for (size_t i = 0; i < width; i++) out[i] = NAN;
    return;
  }
  /* The state has moved since the step began, so bodies are placed anew. */
  mechanism_move(b->m, p, qpos, qvel, &b->work);
  for (size_t i = 0; i < count; i++) {
    const asid_channel *c = &channels[i];
    if (c->kind == ASID_CHANNEL_SENSOR) {
      const sensor *s = &b->m->sensors[c->a];
      sensor_read(b->m, s, p, qpos, qvel, qpos[b->nstate - 1], &b->work, out);
      out += s->length;
    } else {
      memcpy(out, (c->kind == ASID_CHANNEL_QPOS ? qpos : qvel) + c->a, c->b * sizeof *out);
      out += c->b;
    }
  }
}

static asid_code read_now(asid_batch *b, const uint64_t *sims, uint64_t count, const asid_channel *channels,
                          uint64_t channel_count, uint64_t width, double *out, asid_error *error) {
  asid_code code = can_record(b, channels, channel_count, error);
  for (size_t i = 0; i < count && code == ASID_OK; i++)
    record(b, sims[i], channels, channel_count, width, out + width * i);
  return code;
}

/* ------------------------------------------------------------------ rollouts */

static void step(asid_batch *b, size_t sim, const asid_rollout *r, size_t row, size_t number, const double *control,
                 const double *wrench) {
  double *qpos = b->states + b->nstate * sim, *qvel = qpos + b->m->nq, *time = &qpos[b->nstate - 1];
  if (b->m->nactuator) memcpy(b->ctrl, control, b->m->nactuator * sizeof *control);
  memset(b->force, 0, b->m->nv * sizeof *b->force);
  if (r->hook) {
    asid_step_view view = {*time, qpos, qvel, b->ctrl, b->force};
    r->hook(r->hook_context, row, number, &view);
  }
  const char *why = mechanism_step(b->m, b->parameters + b->m->nparameter * sim, qpos, qvel, b->ctrl, b->force,
                                   wrench, &b->work);
  *time += b->m->timestep;
  b->steps++;
  if (why) {
    b->status[sim].diverged = 1;
    b->status[sim].time = *time;
    snprintf(b->status[sim].message, sizeof b->status[sim].message, "%s", why);
  }
}

static asid_code rollout(asid_batch *b, const asid_rollout *r, double *out, asid_error *error) {
  const size_t nu = b->m->nactuator;
  asid_code code = can_record(b, r->channels, r->channel_count, error);
  for (size_t i = 0; i < r->change_count; i++)
    for (size_t row = 0; row < r->count && code == ASID_OK; row++)
      code = column_check(&b->columns[r->changes[i].column], r->changes[i].values[row], error);
  if (code != ASID_OK) return code;
  for (size_t row = 0; row < r->count; row++) {
    size_t sim = r->sims[row];
    for (size_t frame = 0; frame < r->frames; frame++) {
      size_t cell = row * r->frames + frame;
      for (size_t i = 0; i < r->change_count; i++)
        if (r->changes[i].frame == frame) {
          b->values[b->ncolumn * sim + r->changes[i].column] = r->changes[i].values[row];
          fill(b, sim);
        }
      memset(b->wrench, 0, 6 * b->m->nbody * sizeof *b->wrench);
      for (size_t i = 0; i < r->force_count; i++)
        memcpy(b->wrench + 6 * r->forces[i].body, r->forces[i].wrench + 6 * cell, 6 * sizeof *b->wrench);
      const double *control = r->control + nu * (r->shared_control ? frame : cell);
      for (size_t i = 0; i < r->substeps && !b->status[sim].diverged; i++)
        step(b, sim, r, row, frame * r->substeps + i, control, r->force_count ? b->wrench : NULL);
      record(b, sim, r->channels, r->channel_count, r->width, out + r->width * cell);
    }
  }
  return ASID_OK;
}

/* ----------------------------------------------------------------- snapshots */

static void destroy_snapshot(asid_snapshot *s) {
  free(s->states);
  free(s->status);
  free(s);
}

static asid_code save(asid_batch *b, const uint64_t *sims, uint64_t count, asid_snapshot **snapshot,
                      asid_error *error) {
  asid_snapshot *s = calloc(1, sizeof *s);
  if (!s) return refuse(error, ASID_FAILED, "", "out of memory");
  s->states = calloc(count * b->nstate + 1, sizeof *s->states);
  s->status = calloc(count + 1, sizeof *s->status);
  if (!s->states || !s->status) {
    destroy_snapshot(s);
    return refuse(error, ASID_FAILED, "", "out of memory");
  }
  for (size_t i = 0; i < count; i++) {
    memcpy(s->states + b->nstate * i, b->states + b->nstate * sims[i], b->nstate * sizeof *s->states);
    s->status[i] = b->status[sims[i]];
  }
  *snapshot = s;
  return ASID_OK;
}

static asid_code restore(asid_batch *b, const asid_snapshot *s, const uint64_t *rows, const uint64_t *sims,
                         uint64_t count, asid_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) {
    memcpy(b->states + b->nstate * sims[i], s->states + b->nstate * rows[i], b->nstate * sizeof *s->states);
    b->status[sims[i]] = s->status[rows[i]];
  }
  return ASID_OK;
}

/* -------------------------------------------------------------------- status */

static void status(const asid_batch *b, uint64_t first, uint64_t count, asid_status *out) {
  memcpy(out, b->status + first, count * sizeof *out);
}

static uint64_t diverged_count(const asid_batch *b) {
  uint64_t n = 0;
  for (size_t i = 0; i < b->size; i++) n += b->status[i].diverged != 0;
  return n;
}

static uint64_t steps_taken(const asid_batch *b) { return b->steps; }

/* --------------------------------------------------------------------- table */

static const asid_backend TABLE = {
    .abi_major = ASID_ABI_MAJOR,
    .abi_minor = ASID_ABI_MINOR,
    .size = sizeof(asid_backend),
    .name = "mechanism",
    .version = "1.0",
    .about = "trees of joints without contact, in plain C",
    .capabilities = ASID_ARTICULATION | ASID_FREE_BODIES | ASID_ACTUATORS | ASID_JOINT_IMPEDANCE |
                    ASID_MASS_PARAMETERS | ASID_EXACT_SNAPSHOT | ASID_EXTERNAL_FORCES | ASID_PARAMETER_CHANGES |
                    ASID_STEP_HOOKS | ASID_DOUBLE_PRECISION,
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
