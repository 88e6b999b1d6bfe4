/* scene.c: a mechanism from the host's reading of a document, what is refused, and what
 * of it can be a parameter. Nothing is parsed here: the host has done that. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mechanism.h"

asid_code refuse(asid_error *error, asid_code code, const char *subject, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  snprintf(error->subject, sizeof error->subject, "%s", subject);
  vsnprintf(error->message, sizeof error->message, format, arguments);
  va_end(arguments);
  return code;
}

/* What the document may hold beyond the structure without changing anything here: how
 * another engine integrates, and settings of contacts, of which there are none. */
static int harmless(const char *left_out) {
  static const char *const whole[] = {"option integrator", "option cone", "option impratio", "contact/exclude"};
  static const char *const geom[] = {" solref", " solimp", " solmix", " margin", " gap"};
  for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
    if (strcmp(left_out, whole[i]) == 0) return 1;
  const char *attribute = strrchr(left_out, ' ');
  int of_geom = strncmp(left_out, "geom", 4) == 0 || strncmp(left_out, "default/geom", 12) == 0;
  for (size_t i = 0; attribute && of_geom && i < sizeof geom / sizeof *geom; i++)
    if (strcmp(attribute, geom[i]) == 0) return 1;
  return 0;
}

/* The body that carries a body without joints; the world where nothing above it moves. */
static uint64_t carrier(const asid_world *world, uint64_t body) {
  for (; body != 0; body = world->bodies[body].parent)
    for (uint64_t j = 0; j < world->njoint; j++)
      if (world->joints[j].body == body) return body;
  return 0;
}

/* True where two geoms could touch, by MuJoCo's rules. */
static int could_touch(const asid_world *world, const asid_geom *a, const asid_geom *b) {
  uint64_t on_a = carrier(world, a->body), on_b = carrier(world, b->body);
  if (on_a == on_b) return 0;
  if (!(a->contype & b->conaffinity) && !(b->contype & a->conaffinity)) return 0;
  uint64_t above_a = on_a ? carrier(world, world->bodies[on_a].parent) : 0;
  uint64_t above_b = on_b ? carrier(world, world->bodies[on_b].parent) : 0;
  /* Parent and child may overlap at their joint, but not with the world. */
  return !((on_a && above_b == on_a) || (on_b && above_a == on_b));
}

static asid_code check(const asid_world *world, asid_error *error) {
  for (uint64_t i = 0; i < world->nleft_out; i++)
    if (!harmless(world->left_out[i]))
      return refuse(error, ASID_SCENE, "", "this engine lacks `%s`", world->left_out[i]);
  for (uint64_t i = 0; i < world->njoint; i++) {
    const asid_joint *j = &world->joints[i];
    int turns = j->kind == ASID_HINGE || j->kind == ASID_SLIDE;
    if (j->limited) return refuse(error, ASID_SCENE, "", "this engine has no limits of joints: joint `%s`", j->name);
    if (j->frictionloss != 0) return refuse(error, ASID_SCENE, "", "this engine has no dry friction: joint `%s`", j->name);
    if (j->stiffness != 0 && !turns)
      return refuse(error, ASID_SCENE, "", "this engine has springs on hinges and slides only: joint `%s`", j->name);
  }
  for (uint64_t i = 0; i < world->nactuator; i++) {
    const asid_actuator *a = &world->actuators[i];
    if (a->kind == ASID_OTHER || a->joint == ASID_NONE || world->joints[a->joint].kind < ASID_HINGE)
      return refuse(error, ASID_SCENE, "", "this engine drives hinges and slides by motor, position and velocity: not <%s> `%s`",
                    a->kind_name, a->name);
  }
  for (uint64_t i = 0; i < world->ngeom; i++)
    for (uint64_t k = 0; k < i; k++)
      if (could_touch(world, &world->geoms[k], &world->geoms[i]))
        return refuse(error, ASID_SCENE, "", "this engine has no contact: geoms `%s` and `%s` could touch (contype and conaffinity)",
                      world->geoms[k].name, world->geoms[i].name);
  return ASID_OK;
}

static sensor resolve_sensor(const mechanism *m, const asid_world *world, const asid_sensor *from) {
  static const struct { const char *kind; int reading; } readings[] = {
      {"jointpos", READ_JOINT_POSITION}, {"jointvel", READ_JOINT_VELOCITY}, {"ballquat", READ_JOINT_POSITION},
      {"ballangvel", READ_JOINT_VELOCITY}, {"clock", READ_CLOCK}, {"framepos", READ_POSITION},
      {"framequat", READ_ORIENTATION}, {"framexaxis", READ_X}, {"frameyaxis", READ_Y}, {"framezaxis", READ_Z},
      {"framelinvel", READ_VELOCITY}, {"frameangvel", READ_RATE}, {"velocimeter", READ_OWN_VELOCITY},
      {"gyro", READ_OWN_RATE}};
  sensor s = {READ_NOTHING, (size_t)from->object, {0, 0, 0}, {1, 0, 0, 0}, 0, (size_t)from->length};
  for (size_t i = 0; i < sizeof readings / sizeof *readings; i++)
    if (strcmp(from->kind, readings[i].kind) == 0) s.reading = readings[i].reading;
  if (s.reading < READ_POSITION) return s;
  if (strcmp(from->object_kind, "site") == 0) {
    const asid_site *site = &world->sites[from->object];
    s.object = site->body;
    memcpy(s.pos, site->pos, sizeof s.pos);
    memcpy(s.quat, site->quat, sizeof s.quat);
  } else if (strcmp(from->object_kind, "geom") == 0) {
    s.object = world->geoms[from->object].body;
    s.parameter = m->geom_at + PER_GEOM * from->object + 1;
    memcpy(s.quat, world->geoms[from->object].quat, sizeof s.quat);
  } else if (strcmp(from->object_kind, "body") == 0) {
    /* The frame of the principal axes, at the centre of mass. */
    memcpy(s.quat, world->bodies[from->object].iquat, sizeof s.quat);
    s.parameter = m->body_at + PER_BODY * from->object + 1;
  } else if (strcmp(from->object_kind, "xbody") != 0) {
    s.reading = READ_NOTHING;
  }
  return s;
}

/* A copy of `count` things; the host's own are gone after `load`. */
static void *copy(const void *from, uint64_t count, size_t size) {
  void *to = calloc(count ? count : 1, size);
  if (to && count) memcpy(to, from, count * size);
  return to;
}

static void nominal_parameters(mechanism *m, const asid_world *world) {
  double *p = m->nominal;
  memcpy(p, world->gravity, sizeof world->gravity);
  for (size_t i = 0; i < m->njoint; i++) {
    const asid_joint *j = &m->joints[i];
    double values[PER_JOINT] = {j->damping, j->stiffness, j->armature};
    memcpy(p + m->joint_at + PER_JOINT * i, values, sizeof values);
  }
  for (size_t i = 0; i < m->nactuator; i++) {
    const asid_actuator *a = &m->actuators[i];
    double values[PER_ACTUATOR] = {a->gear, a->kp, a->kv};
    memcpy(p + m->actuator_at + PER_ACTUATOR * i, values, sizeof values);
  }
  for (size_t i = 0; i < m->nbody; i++) {
    double *at = p + m->body_at + PER_BODY * i;
    at[0] = m->bodies[i].mass;
    memcpy(at + 1, m->bodies[i].com, sizeof m->bodies[i].com);
    memcpy(at + 4, m->bodies[i].inertia, sizeof m->bodies[i].inertia);
    memcpy(at + 10, m->bodies[i].moments, sizeof m->bodies[i].moments);
  }
  for (size_t i = 0; i < m->ngeom; i++) {
    double *at = p + m->geom_at + PER_GEOM * i;
    at[0] = m->geoms[i].mass;
    memcpy(at + 1, m->geoms[i].pos, sizeof m->geoms[i].pos);
  }
}

/* The chain of degrees of freedom from each towards the world. */
static void chains(mechanism *m, int *last_of_body) {
  for (size_t i = 0; i < m->nbody; i++)
    last_of_body[i] = -2;
  last_of_body[0] = -1;
  size_t next = 0;
  for (size_t i = 1; i < m->nbody; i++) {
    int last = last_of_body[m->bodies[i].parent];
    for (; next < m->njoint && m->joints[next].body == i; next++) {
      size_t end = next + 1 < m->njoint ? m->joints[next + 1].qvel : m->nv;
      for (size_t d = m->joints[next].qvel; d < end; d++) {
        m->dof_parent[d] = last;
        last = (int)d;
      }
    }
    last_of_body[i] = last;
  }
}

asid_code mechanism_new(const asid_world *world, mechanism **made, asid_error *error) {
  asid_code code = check(world, error);
  if (code != ASID_OK) return code;
  mechanism *m = calloc(1, sizeof *m);
  if (!m) return refuse(error, ASID_FAILED, "", "out of memory");
  m->timestep = world->timestep;
  m->nq = world->nq, m->nv = world->nv, m->nbody = world->nbody, m->njoint = world->njoint;
  m->ngeom = world->ngeom, m->nactuator = world->nactuator, m->nsensor = world->nsensor;
  m->joint_at = 3;
  m->actuator_at = m->joint_at + PER_JOINT * m->njoint;
  m->body_at = m->actuator_at + PER_ACTUATOR * m->nactuator;
  m->geom_at = m->body_at + PER_BODY * m->nbody;
  m->nparameter = m->geom_at + PER_GEOM * m->ngeom;
  m->bodies = copy(world->bodies, world->nbody, sizeof *m->bodies);
  m->joints = copy(world->joints, world->njoint, sizeof *m->joints);
  m->geoms = copy(world->geoms, world->ngeom, sizeof *m->geoms);
  m->actuators = copy(world->actuators, world->nactuator, sizeof *m->actuators);
  m->sensors = calloc(m->nsensor + 1, sizeof *m->sensors);
  m->dof_parent = calloc(m->nv + 1, sizeof *m->dof_parent);
  m->start = calloc(m->nq + m->nv + 1, sizeof *m->start);
  m->nominal = calloc(m->nparameter, sizeof *m->nominal);
  int *last = calloc(m->nbody, sizeof *last);
  if (!m->bodies || !m->joints || !m->geoms || !m->actuators || !m->sensors || !m->dof_parent || !m->start ||
      !m->nominal || !last) {
    free(last);
    mechanism_free(m);
    return refuse(error, ASID_FAILED, "", "out of memory");
  }
  chains(m, last);
  free(last);
  nominal_parameters(m, world);
  for (size_t i = 0; i < m->nsensor; i++) m->sensors[i] = resolve_sensor(m, world, &world->sensors[i]);
  const asid_keyframe *key = world->nkeyframe ? &world->keyframes[0] : NULL;
  memcpy(m->start, key ? key->qpos : world->qpos0, m->nq * sizeof *m->start);
  if (key) memcpy(m->start + m->nq, key->qvel, m->nv * sizeof *m->start);
  mechanism_normalise(m, m->start);
  *made = m;
  return ASID_OK;
}

void mechanism_free(mechanism *m) {
  free(m->bodies);
  free(m->joints);
  free(m->geoms);
  free(m->actuators);
  free(m->sensors);
  free(m->dof_parent);
  free(m->start);
  free(m->nominal);
  free(m);
}

/* What can be a parameter: where its numbers lie, how many there are, which sign they
 * must have, and when they are set. The mass of a body follows from its geoms, and its
 * inertia from its mass, unless a parameter says otherwise: so these come in passes. */
static const struct known {
  const char *element, *attribute;
  size_t offset, entries;
  int sign, pass;
} KNOWN[] = {
    {"option", "gravity", 0, 3, 0, 0},  {"joint", "damping", 0, 1, 1, 0}, {"joint", "stiffness", 1, 1, 1, 0},
    {"joint", "armature", 2, 1, 1, 0},  {"actuator", "gear", 0, 1, 0, 0}, {"actuator", "kp", 1, 1, 1, 0},
    {"actuator", "kv", 2, 1, 1, 0},     {"geom", "mass", 0, 1, 1, 1},     {"geom", "pos", 1, 3, 0, 1},
    {"body", "mass", 0, 1, 2, 2},       {"body", "ipos", 1, 3, 0, 3},     {"body", "inertia", 10, 3, 2, 4}};

/* True where a sensor reads the directions of a body's principal axes. */
static int axes_are_read(const mechanism *m, size_t body) {
  for (size_t i = 0; i < m->nsensor; i++) {
    int r = m->sensors[i].reading;
    int oriented = r == READ_ORIENTATION || r == READ_X || r == READ_Y || r == READ_Z;
    if (oriented && m->sensors[i].parameter == m->body_at + PER_BODY * body + 1) return 1;
  }
  return 0;
}

/* Why a target cannot be set although there is such a thing; NULL where it can. */
static const char *obstacle(const mechanism *m, const struct known *k, size_t i) {
  if (strcmp(k->element, "geom") == 0) {
    const asid_geom *g = &m->geoms[i];
    if (g->body == 0 || m->bodies[g->body].inertial) return "no mass follows from this geom";
    if (g->mass <= 0) return "the geom has no mass that could be scaled";
    if (axes_are_read(m, g->body)) return "a sensor reads the principal axes of its body, which would turn";
  }
  if (strcmp(k->element, "body") == 0) {
    if (i == 0) return "the world has no mass";
  }
  if (strcmp(k->element, "joint") == 0 && strcmp(k->attribute, "stiffness") == 0 && m->joints[i].kind < ASID_HINGE)
    return "springs are for hinges and slides";
  if (strcmp(k->element, "actuator") == 0) {
    int kind = m->actuators[i].kind;
    if (strcmp(k->attribute, "kp") == 0 && kind != ASID_POSITION) return "this actuator has no such gain";
    if (strcmp(k->attribute, "kv") == 0 && kind == ASID_MOTOR) return "this actuator has no such gain";
  }
  return NULL;
}

asid_code column_find(const mechanism *m, const asid_target *target, column *found, asid_error *error) {
  for (size_t i = 0; i < sizeof KNOWN / sizeof *KNOWN; i++) {
    const struct known *k = &KNOWN[i];
    if (strcmp(target->element, k->element) != 0 || strcmp(target->attribute, k->attribute) != 0) continue;
    size_t start = 0, object = 0;
    if (strcmp(k->element, "option") != 0) {
      if (target->object == ASID_NONE)
        return refuse(error, ASID_PARAMETER, "", "there is no %s `%s`", k->element, target->name);
      object = (size_t)target->object;
      start = strcmp(k->element, "joint") == 0      ? m->joint_at + PER_JOINT * object
              : strcmp(k->element, "actuator") == 0 ? m->actuator_at + PER_ACTUATOR * object
              : strcmp(k->element, "body") == 0     ? m->body_at + PER_BODY * object
                                                    : m->geom_at + PER_GEOM * object;
    }
    if (target->index >= k->entries)
      return refuse(error, ASID_PARAMETER, "", "the index is out of 0..%d", (int)k->entries);
    const char *why = obstacle(m, k, object);
    if (why) return refuse(error, ASID_PARAMETER, "", "%s", why);
    size_t body = strcmp(k->element, "geom") == 0 ? m->geoms[object].body : strcmp(k->element, "body") == 0 ? object : 0;
    *found = (column){start + k->offset + target->index, k->pass, k->sign, body};
    return ASID_OK;
  }
  return refuse(error, ASID_PARAMETER, "", "this engine has no such parameter");
}

/* All columns of a batch, each with the name of its target in what is said of it. */
asid_code columns_find(const mechanism *m, const asid_target *targets, size_t count, column *found,
                       asid_error *error) {
  for (size_t i = 0; i < count; i++) {
    const asid_target *t = &targets[i];
    asid_code code = column_find(m, t, &found[i], error);
    /* A body follows its geoms or its own numbers: both at once would have two answers. */
    for (size_t k = 0; k < i && code == ASID_OK; k++)
      if (found[i].body != 0 && found[i].body == found[k].body && (found[i].pass == 1) != (found[k].pass == 1))
        code = refuse(error, ASID_PARAMETER, "", "sets the same mass properties as another parameter: use one of them");
    if (code != ASID_OK) {
      snprintf(error->subject, sizeof error->subject, "%s%s%s/%s/%d", t->element, *t->name ? "/" : "", t->name,
               t->attribute, (int)t->index);
      return code;
    }
  }
  return ASID_OK;
}

asid_code column_check(const column *c, double value, asid_error *error) {
  if ((c->sign == 1 && value < 0) || (c->sign == 2 && value <= 0))
    return refuse(error, ASID_PARAMETER, "", "%g is not physical here", value);
  return ASID_OK;
}

/* Mass, centre and inertia of a body from its geoms, by the parallel axis theorem. */
static void body_of_geoms(const mechanism *m, size_t body, double *p) {
  double sum[10] = {0};
  for (size_t i = 0; i < m->ngeom; i++) {
    const asid_geom *g = &m->geoms[i];
    const double *value = p + m->geom_at + PER_GEOM * i;
    if (g->body != body || g->mass <= 0) continue;
    motion at = {{value[1], value[2], value[3]}, {0}, {0}, {0}, {0}, {0}};
    memcpy(at.quat, g->quat, sizeof at.quat);
    double own[10] = {value[0]}, moved[10];
    for (int k = 0; k < 3; k++) own[4 + k] = g->inertia[k] * value[0] / g->mass;
    inertia_at_origin(&at, own, moved);
    for (int k = 0; k < 10; k++) sum[k] += moved[k];
  }
  double *out = p + m->body_at + PER_BODY * body, mass = sum[0];
  if (mass <= 0) return;
  const double c[3] = {sum[1] / mass, sum[2] / mass, sum[3] / mass};
  double square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
  double back[6] = {square - c[0] * c[0], square - c[1] * c[1], square - c[2] * c[2],
                    -c[0] * c[1], -c[0] * c[2], -c[1] * c[2]};
  out[0] = mass;
  memcpy(out + 1, c, sizeof c);
  for (int k = 0; k < 6; k++) out[4 + k] = sum[4 + k] - mass * back[k];
}

/* Sets a principal moment, the axes as they are. */
static void set_moment(const mechanism *m, const column *c, double value, double *p) {
  static const int row[6] = {0, 1, 2, 0, 0, 1}, col[6] = {0, 1, 2, 1, 2, 2};
  size_t at = m->body_at + PER_BODY * c->body;
  double unit[3] = {0}, axis[3], change = value - p[c->at];
  unit[c->at - at - 10] = 1;
  quat_rotate(m->bodies[c->body].iquat, unit, axis);
  for (int k = 0; k < 6; k++) p[at + 4 + k] += change * axis[row[k]] * axis[col[k]];
}

void parameters_fill(const mechanism *m, const column *columns, size_t count, const double *values, double *p) {
  memcpy(p, m->nominal, m->nparameter * sizeof *p);
  for (int pass = 0; pass < 5; pass++)
    for (size_t i = 0; i < count; i++) {
      const column *c = &columns[i];
      if (c->pass != pass) continue;
      if (pass == 2) /* the inertia grows with the mass */
        for (int k = 0; k < 9; k++) p[c->at + 4 + k] *= values[i] / p[c->at];
      if (pass == 4) set_moment(m, c, values[i], p);
      p[c->at] = values[i];
      if (pass == 1) body_of_geoms(m, c->body, p);
    }
}
