/* An engine in which nothing moves, and what can be wrong with one: each macro
 * spoils one thing. Compiled by the tests of refusals. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "asid_backend.h"

struct asid_batch {
  uint64_t size;
  double q;
};

static asid_code say(asid_error *error, asid_code code, const char *message) {
  snprintf(error->message, sizeof error->message, "%s", message);
  return code;
}

static asid_code load(const asid_scene *scene, asid_model **model, asid_error *error) {
  const asid_world *world = scene->world(scene, error);
  if (!world) return ASID_SCENE;
#ifdef LOAD_FAILS
  return say(error, ASID_SCENE, "this engine\n  likes no scene");
#elif defined(LOAD_GIVES_NULL)
  return ASID_OK;
#else
  *model = malloc(1);
  return *model ? ASID_OK : say(error, ASID_FAILED, "no memory");
#endif
}

static void destroy_model(asid_model *model) { free(model); }

static asid_code nominal(const asid_model *model, const asid_target *target, double *value,
                         asid_error *error) {
  (void)model;
#ifdef NOMINAL_IS_NAN
  (void)error;
  (void)target;
  *value = 0.0 / 0.0;
  return ASID_OK;
#else
  (void)value;
  return say(error, ASID_PARAMETER, target->object == ASID_NONE ? "not there" : "fixed");
#endif
}

static asid_code make_batch(const asid_model *model, const asid_batch_config *config,
                            asid_batch **batch, asid_error *error) {
  (void)model;
  *batch = calloc(1, sizeof **batch);
  if (!*batch) return say(error, ASID_FAILED, "no memory");
  (*batch)->size = config->batch_size;
  return ASID_OK;
}

static void destroy_batch(asid_batch *batch) { free(batch); }

static asid_code set_parameters(asid_batch *batch, const uint64_t *sims, uint64_t count,
                                const double *values, asid_error *error) {
  (void)batch, (void)sims, (void)count, (void)values, (void)error;
  return ASID_OK;
}

static asid_code reset(asid_batch *batch, const uint64_t *sims, uint64_t count,
                       asid_error *error) {
  (void)batch, (void)sims, (void)count, (void)error;
#ifdef SILENT_ERROR
  return 77;
#else
  return ASID_OK;
#endif
}

static asid_code set_state(asid_batch *batch, const uint64_t *sims, uint64_t count,
                           const double *qpos, const double *qvel, asid_error *error) {
  (void)batch, (void)sims, (void)count, (void)qpos, (void)qvel, (void)error;
  return ASID_OK;
}

static asid_code rollout(asid_batch *batch, const asid_rollout *r, double *out,
                         asid_error *error) {
  uint64_t i;
  (void)batch, (void)error;
  for (i = 0; i < r->count * r->frames * r->width; i++) out[i] = 0.25;
#ifdef ROLLOUT_CRASHES
  *(volatile int *)0 = 1;
#endif
#ifdef READS_NAN
  out[r->count * r->frames * r->width - 1] = 0.0 / 0.0;
#endif
#ifdef ROLLOUT_FAILS
  return say(error, ASID_FAILED, "the licence has expired");
#else
  return ASID_OK;
#endif
}

static asid_code read_state(asid_batch *batch, const uint64_t *sims, uint64_t count,
                            const asid_channel *channels, uint64_t channel_count,
                            uint64_t width, double *out, asid_error *error) {
  uint64_t i;
  (void)batch, (void)sims, (void)channels, (void)channel_count, (void)error;
  for (i = 0; i < count * width; i++) out[i] = 0.25;
  return ASID_OK;
}

static void status(const asid_batch *batch, uint64_t first, uint64_t count, asid_status *out) {
  (void)batch, (void)first;
  memset(out, 0, count * sizeof *out);
}

static uint64_t none(const asid_batch *batch) {
  (void)batch;
  return 0;
}

static const asid_backend table = {
#ifdef OTHER_MAJOR
    .abi_major = ASID_ABI_MAJOR + 1,
#else
    .abi_major = ASID_ABI_MAJOR,
#endif
    .abi_minor = ASID_ABI_MINOR,
#ifdef CUT_SHORT
    .size = sizeof(asid_backend) / 2,
#else
    .size = sizeof(asid_backend),
#endif
    .name = "still",
    .version = "1",
    .about = "an engine in which nothing moves",
#ifdef UNKNOWN_CLAIM
    .capabilities = ASID_ARTICULATION | UINT64_C(1) << 40,
#else
    .capabilities = ASID_ARTICULATION,
#endif
    .load = load,
    .destroy_model = destroy_model,
    .nominal = nominal,
    .make_batch = make_batch,
    .destroy_batch = destroy_batch,
    .set_parameters = set_parameters,
    .reset = reset,
    .set_state = set_state,
#ifndef LACKS_ROLLOUT
    .rollout = rollout,
#endif
    .read = read_state,
    .status = status,
    .diverged_count = none,
    .steps_taken = none,
};

#ifdef NO_SYMBOL
const asid_backend *another_entry(void);
const asid_backend *another_entry(void) { return &table; }
#else
const asid_backend *asid_backend_entry(void) {
#ifdef NULL_TABLE
  return NULL;
#else
  return &table;
#endif
}
#endif
