/* asid_backend.h: the C ABI of a physics engine for ASID.
 *
 * An engine is a shared library that exports one function:
 *
 *     const asid_backend *asid_backend_entry(void);
 *
 * It returns a table of functions that stays valid for the life of the process
 * (libraries are never unloaded). The host checks the table before it calls
 * anything else, and turns it into a backend like the built-in ones.
 *
 * Rules that hold for every function:
 *
 *   - A call is about a whole batch. Arrays belong to the caller, are row-major
 *     `double`, one row a simulation, and are valid during the call only.
 *   - Units are SI: m, kg, s, rad, N. Quaternions are w x y z.
 *   - `sims` is a list of `count` indices of simulations, strictly increasing and
 *     below the size of the batch. The host has checked that, the lengths of
 *     all arrays, and that every number in them is finite.
 *   - A function that can fail returns ASID_OK or another asid_code, and then says
 *     why in `*error`, which is never NULL. A failed call changes nothing that a
 *     later call could see.
 *   - Nothing unwinds across the table: no C++ exception, no panic, no longjmp.
 *   - What goes wrong in one simulation (a state that is no longer finite) is not
 *     an error of the call: it is that simulation's status, and the others go on.
 *   - Threads: asid_backend and asid_model functions may be called from several
 *     threads at once, on the same model too. A batch, a snapshot that is being
 *     made, and what they point to are used by one thread at a time, which need
 *     not be the thread that made them. Each function repeats what holds for it.
 *   - Results depend on the arguments and on nothing else: not on the number of
 *     threads, on the time, on other batches, or on calls made long ago.
 *
 * Versions: ASID_ABI_MAJOR changes when something here changes its meaning or its
 * place, and a host refuses another major. ASID_ABI_MINOR grows when fields are
 * added at the end of a structure. A structure that may grow begins with its own
 * `size`, in bytes, as whoever filled it in knew it: read no field beyond it.
 */
#ifndef ASID_BACKEND_H
#define ASID_BACKEND_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ASID_ABI_MAJOR 1u
#define ASID_ABI_MINOR 0u

/* Marks the exported function where the compiler hides symbols by default. */
#if defined(_WIN32)
#define ASID_EXPORT __declspec(dllexport)
#else
#define ASID_EXPORT __attribute__((visibility("default")))
#endif

/* No index: an element that is not there. */
#define ASID_NONE UINT64_MAX

/* ------------------------------------------------------------------ errors */

/* What kind of thing went wrong. The host words its message by it. */
typedef int32_t asid_code;
enum {
  ASID_OK = 0,
  ASID_SCENE = 1,     /* the scene is refused; subject: where in it, or empty      */
  ASID_PARAMETER = 2, /* a target or its value makes no sense; subject: the target */
  ASID_CONFIG = 3,    /* a setting is out of its domain; subject: the setting      */
  ASID_INCAPABLE = 4, /* the engine cannot do this                                 */
  ASID_SHAPE = 5,     /* an array or an index does not fit                         */
  ASID_MISSING = 6,   /* something is not installed; subject: what                 */
  ASID_FAILED = 7,    /* anything else: the work had begun and failed              */
  ASID_PANIC = 8      /* a defect of the engine; the handle is of no use any more  */
};

/* Filled in by a function that fails: UTF-8, one line, terminated by a zero. Of a call
 * that succeeds it is not read. `subject` of a target is `element/name/attribute/index`.
 * It may stay empty: the host then names the scene, the targets or the engine. */
typedef struct asid_error {
  char subject[256];
  char message[1024];
} asid_error;

/* ------------------------------------------------------------ capabilities */

/* What an engine can do. Checks and algorithms look at these bits and never at
 * a name: claim what holds, and `asid conformance` tests just that. */
#define ASID_ARTICULATION        (UINT64_C(1) << 0)  /* hinge, slide and ball joints in a tree     */
#define ASID_CONTACT             (UINT64_C(1) << 1)  /* contact between primitive shapes           */
#define ASID_JOINT_FRICTION      (UINT64_C(1) << 2)  /* dry friction of joints                     */
#define ASID_TORSIONAL_FRICTION  (UINT64_C(1) << 3)  /* torsional friction of contacts             */
#define ASID_ROLLING_FRICTION    (UINT64_C(1) << 4)  /* rolling friction of contacts               */
#define ASID_CONTACT_STIFFNESS   (UINT64_C(1) << 5)  /* softness of contacts can be set            */
#define ASID_ACTUATORS           (UINT64_C(1) << 6)  /* motors, position and velocity servos       */
#define ASID_EXACT_SNAPSHOT      (UINT64_C(1) << 7)  /* a saved state continues to the bit         */
#define ASID_EXTERNAL_FORCES     (UINT64_C(1) << 8)  /* wrenches on bodies during a rollout        */
#define ASID_PARAMETER_CHANGES   (UINT64_C(1) << 9)  /* parameters may change during a rollout     */
#define ASID_STEP_HOOKS          (UINT64_C(1) << 10) /* a function of the host before each step    */
#define ASID_CONTACT_FORCES      (UINT64_C(1) << 11) /* normal forces between bodies are recorded  */
#define ASID_DOUBLE_PRECISION    (UINT64_C(1) << 12) /* computes in double precision               */
#define ASID_JOINT_IMPEDANCE     (UINT64_C(1) << 13) /* springs, dampers, rotor inertia of joints  */
#define ASID_EQUALITY            (UINT64_C(1) << 14) /* equality constraints (weld, connect)       */
#define ASID_MESHES              (UINT64_C(1) << 15) /* triangle meshes                            */
#define ASID_FREE_BODIES         (UINT64_C(1) << 16) /* free joints                                */
#define ASID_JOINT_LIMITS        (UINT64_C(1) << 17) /* ranges of joints                           */
#define ASID_MASS_PARAMETERS     (UINT64_C(1) << 18) /* mass, centre, inertia can be parameters    */
#define ASID_JOINT_ANCHORS       (UINT64_C(1) << 19) /* anchors of joints can be parameters        */

/* -------------------------------------------------- the world of a document */

/* The host's own reading of an MJCF document: defaults resolved, angles in
 * radians, unnamed elements named, mass properties computed. An engine builds its
 * world from it, and need not parse anything. Indices are places in the arrays;
 * the order is the document's (bodies depth first). Everything stays valid until
 * `load` returns. */

enum { ASID_FREE = 0, ASID_BALL = 1, ASID_HINGE = 2, ASID_SLIDE = 3 };

enum {
  ASID_PLANE = 0, ASID_HEIGHT_FIELD = 1, ASID_SPHERE = 2, ASID_CAPSULE = 3,
  ASID_ELLIPSOID = 4, ASID_CYLINDER = 5, ASID_BOX = 6, ASID_MESH = 7
};

enum {
  ASID_MOTOR = 0,    /* force = command                            */
  ASID_POSITION = 1, /* force = kp (command - length) - kv speed   */
  ASID_VELOCITY = 2, /* force = kv (command - speed)               */
  ASID_OTHER = 3     /* something else: see `kind_name`            */
};

/* A body. Body 0 is the world: it has no mass and does not move. */
typedef struct asid_body {
  const char *name;
  uint64_t parent;    /* ASID_NONE for the world                               */
  double pos[3];      /* origin in the parent's frame, m                       */
  double quat[4];     /* parent_from_body                                      */
  double mass;        /* kg                                                    */
  double com[3];      /* centre of mass in the body's frame, m                 */
  double inertia[6];  /* about the centre, along the body's axes: xx yy zz xy xz yz, kg m2 */
  double moments[3];  /* the same as principal moments, kg m2                  */
  double iquat[4];    /* body_from_principal                                   */
  int32_t inertial;   /* 1: stated by the document; 0: the sum of its geoms    */
  int32_t padding;
} asid_body;

/* A joint: it moves its body against the body's parent. The joints of one body
 * act one after the other. */
typedef struct asid_joint {
  const char *name;
  uint64_t body;
  int32_t kind;
  int32_t limited;
  uint64_t qpos;      /* first entry in a row of positions: 7, 4, 1, 1 by kind  */
  uint64_t qvel;      /* first entry in a row of velocities: 6, 3, 1, 1         */
  double pos[3];      /* anchor in the body's frame, m                          */
  double axis[3];     /* unit vector in the body's frame; hinge and slide       */
  double range[2];    /* where limited: rad or m                                */
  double ref;         /* position at which the body is where `pos`, `quat` say  */
  double springref;   /* position at which the spring is slack                  */
  double stiffness;   /* N m/rad or N/m                                         */
  double damping;     /* N m s/rad or N s/m                                     */
  double armature;    /* rotor inertia, kg m2 or kg                             */
  double frictionloss;/* dry friction, N m or N                                 */
} asid_joint;

/* A shape on a body. `size` is as in MJCF: radius; radius and half length; half
 * lengths. A `fromto` of the document is resolved. */
typedef struct asid_geom {
  const char *name;
  uint64_t body;
  int32_t kind;
  int32_t condim;
  double pos[3];
  double quat[4];     /* body_from_geom                                         */
  double size[3];
  double mass;        /* kg; 0 for a plane                                      */
  double inertia[3];  /* principal moments about its centre, kg m2              */
  double friction[3]; /* sliding, torsional (m), rolling (m)                    */
  uint32_t contype;
  uint32_t conaffinity;
  int32_t priority;
  int32_t padding;
} asid_geom;

/* A frame on a body that sensors can be attached to. */
typedef struct asid_site {
  const char *name;
  uint64_t body;
  double pos[3];
  double quat[4];     /* body_from_site */
} asid_site;

/* A drive. Length and speed are `gear` times the joint's position and velocity,
 * and the joint gets `gear` times the force. */
typedef struct asid_actuator {
  const char *name;
  const char *kind_name; /* MJCF element, such as `motor`                       */
  int32_t kind;
  int32_t ctrl_limited;
  int32_t force_limited;
  int32_t padding;
  uint64_t joint;        /* ASID_NONE where it drives something else            */
  double gear;
  double kp;
  double kv;
  double ctrl_range[2];
  double force_range[2];
} asid_actuator;

/* A sensor. `object_kind` is that of MJCF: `joint`, `body` (the frame of the
 * principal axes: `com`, `iquat`), `xbody` (the frame of the body), `geom`, `site`,
 * `actuator`. One that the engine cannot read is no reason to refuse a scene: recording
 * it is ASID_INCAPABLE. */
typedef struct asid_sensor {
  const char *name;
  const char *kind;        /* MJCF element, such as `framepos`                  */
  const char *object_kind; /* empty where it has none                           */
  uint64_t object;         /* index by that kind, ASID_NONE where it has none   */
  uint64_t address;        /* first entry in a row of all sensors               */
  uint64_t length;         /* entries                                           */
} asid_sensor;

/* A named starting state: `nq` positions, `nv` velocities, `nu` commands. */
typedef struct asid_keyframe {
  const char *name;
  const double *qpos;
  const double *qvel;
  const double *ctrl;
} asid_keyframe;

typedef struct asid_world {
  uint64_t size;
  double timestep;         /* s                                                 */
  double gravity[3];       /* m/s2                                              */
  uint64_t nq;             /* entries of a row of positions                     */
  uint64_t nv;             /* entries of a row of velocities                    */
  uint64_t nu;             /* entries of a row of commands: one an actuator     */
  uint64_t nsensordata;    /* entries of a row of all sensors                   */
  const double *qpos0;     /* `nq`: the state where no keyframe says otherwise  */
  uint64_t nbody;
  const asid_body *bodies;
  uint64_t njoint;
  const asid_joint *joints;
  uint64_t ngeom;
  const asid_geom *geoms;
  uint64_t nsite;
  const asid_site *sites;
  uint64_t nactuator;
  const asid_actuator *actuators;
  uint64_t nsensor;
  const asid_sensor *sensors;
  uint64_t nkeyframe;
  const asid_keyframe *keyframes;
  /* What the document holds and this structure does not, such as `equality/weld` or
   * `geom/arm solref`, one text each. An engine that builds its world from this
   * structure must refuse what it would otherwise silently leave out. Spelling:
   *     SECTION/ELEMENT             a whole element: equality/weld, tendon/fixed,
   *                                 contact/exclude, sensor/contact, body/composite
   *     ELEMENT/NAME ATTRIBUTE      geom/arm solref, joint/j springdamper, body/b
   *                                 gravcomp, actuator/m dyntype, sensor/s cutoff
   *     ELEMENT ATTRIBUTE           where it has no name: option integrator, flag contact
   *     default/ELEMENT ATTRIBUTE   in a class of defaults
   *     geom/NAME mesh              also hfield, sdf: a shape that is no primitive     */
  uint64_t nleft_out;
  const char *const *left_out;
} asid_world;

/* A document to load. */
typedef struct asid_scene asid_scene;
struct asid_scene {
  uint64_t size;
  const char *name;        /* path or name, for messages                        */
  const char *xml;         /* the whole MJCF document, includes spliced in      */
  const char *directory;   /* where relative asset paths start; NULL for none   */
  /* The host's reading of the document, or NULL and `*error` where it cannot be
   * read. Callable while `load` runs, from the thread that `load` runs on. */
  const asid_world *(*world)(const asid_scene *scene, asid_error *error);
};

/* -------------------------------------------------------------------- layout */

/* Names and places of a loaded scene, by which the host resolves everything. It
 * must be what the document says: `nbody` names in its order, the world first, and
 * so on; unnamed elements are `body3`, `geom0`, `joint2`, `actuator0`, `sensor1`,
 * `key0`, counted from 0 within their kind. Addresses follow from the order. */
typedef struct asid_layout_joint {
  const char *name;
  const char *body;
  int32_t kind;
  int32_t padding;
} asid_layout_joint;

typedef struct asid_layout_actuator {
  const char *name;
  int32_t ctrl_limited;
  int32_t padding;
  double ctrl_range[2];
} asid_layout_actuator;

typedef struct asid_layout_sensor {
  const char *name;
  const char *kind;
  uint64_t length;
} asid_layout_sensor;

typedef struct asid_layout {
  uint64_t size;
  double timestep;
  uint64_t nbody;
  const char *const *bodies;
  uint64_t ngeom;
  const char *const *geoms;
  uint64_t njoint;
  const asid_layout_joint *joints;
  uint64_t nactuator;
  const asid_layout_actuator *actuators;
  uint64_t nsensor;
  const asid_layout_sensor *sensors;
  uint64_t nkeyframe;
  const asid_keyframe *keyframes;
} asid_layout;

/* ------------------------------------------------------------ batches, rollouts */

typedef struct asid_model asid_model;       /* a loaded scene, the engine's own   */
typedef struct asid_batch asid_batch;       /* n simulations, the engine's own    */
typedef struct asid_snapshot asid_snapshot; /* some saved states, the engine's own */

/* What a parameter changes: `geom/puck/friction/0` is element, name, attribute and
 * index; `option/gravity/2` has no name. `object` is the element's place in the
 * host's reading of the document, ASID_NONE for `option` or where it is not there. */
typedef struct asid_target {
  const char *element;
  const char *name;
  const char *attribute;
  uint64_t index;
  uint64_t object;
} asid_target;

/* How a batch is made. */
typedef struct asid_batch_config {
  uint64_t size;
  uint64_t batch_size;        /* simulations, at least 1                         */
  uint64_t threads;           /* 0 for one a core; results do not depend on it   */
  uint64_t target_count;      /* columns of set_parameters                       */
  const asid_target *targets;
} asid_batch_config;

/* What is recorded: entries of a row, one channel after the other. */
enum {
  ASID_CHANNEL_SENSOR = 0,  /* all entries of sensor `a`                         */
  ASID_CHANNEL_QPOS = 1,    /* `b` positions from `a` on                         */
  ASID_CHANNEL_QVEL = 2,    /* `b` velocities from `a` on                        */
  ASID_CHANNEL_CONTACT = 3  /* sum of the normal forces between bodies a and b, N;
                               never asked for unless ASID_CONTACT_FORCES         */
};
typedef struct asid_channel {
  int32_t kind;
  int32_t padding;
  uint64_t a;
  uint64_t b;
} asid_channel;

/* A wrench on one body, constant over each frame: force (N), then torque (N m), in
 * the world frame, at the body's centre of mass. A body has at most one entry. */
typedef struct asid_force {
  uint64_t body;
  const double *wrench;       /* count x frames x 6                              */
} asid_force;

/* A parameter that takes another value from some frame on, and keeps it. */
typedef struct asid_change {
  uint64_t frame;
  uint64_t column;
  const double *values;       /* count: one a simulation of the rollout          */
} asid_change;

/* What the host sees of a simulation before a physics step, and may change. An array
 * of no entries may be NULL: `ctrl` where nu is 0. What the host leaves in `ctrl` and
 * `force` holds over the whole step, whatever the order of the integrator. */
typedef struct asid_step_view {
  double time;                /* simulated time of the state, s                  */
  const double *qpos;         /* nq                                              */
  const double *qvel;         /* nv                                              */
  double *ctrl;               /* nu: the command, for this step only             */
  double *force;              /* nv: generalised force to add, zero on entry     */
} asid_step_view;

/* Called before each physics step. `row` is the row of the rollout (not the
 * simulation's number), `step` the physics step since its start. Threads: may be
 * called for different rows at once; the steps of one row come in order. */
typedef void (*asid_step_hook)(void *context, uint64_t row, uint64_t step, asid_step_view *view);

/* Commands in, readings out. A frame is the interval at which commands change and
 * readings are taken; it takes `substeps` physics steps. */
typedef struct asid_rollout {
  uint64_t size;
  uint64_t count;             /* simulations                                     */
  const uint64_t *sims;
  uint64_t frames;
  uint64_t substeps;
  const double *control;      /* count x frames x nu; frames x nu where shared   */
  int32_t shared_control;     /* 1: one trajectory for all simulations           */
  int32_t padding;
  uint64_t force_count;       /* 0 unless ASID_EXTERNAL_FORCES is claimed        */
  const asid_force *forces;
  uint64_t change_count;      /* 0 unless ASID_PARAMETER_CHANGES is claimed      */
  const asid_change *changes;
  asid_step_hook hook;        /* NULL for none, and unless ASID_STEP_HOOKS       */
  void *hook_context;
  uint64_t channel_count;
  const asid_channel *channels;
  uint64_t width;             /* entries of a row of readings                    */
} asid_rollout;

/* State of one simulation. */
typedef struct asid_status {
  int32_t diverged;           /* 0: it runs; 1: it stands still until it is reset,
                                 loaded or copied into                           */
  int32_t padding;
  double time;                /* where diverged: simulated time at which, s      */
  char message[256];          /* where diverged: why, one line                   */
} asid_status;

/* --------------------------------------------------------------------- table */

typedef struct asid_backend {
  uint32_t abi_major;         /* ASID_ABI_MAJOR                                  */
  uint32_t abi_minor;         /* ASID_ABI_MINOR                                  */
  uint64_t size;              /* sizeof(asid_backend)                            */
  const char *name;           /* on the command line: a-z, 0-9, -                */
  const char *version;        /* of the engine                                   */
  const char *about;          /* one line for `asid list`                        */
  uint64_t capabilities;      /* ASID_ARTICULATION | ...                         */

  /* Something more than this table, by name; NULL for what is not known. May be
   * NULL itself. Threads: any. */
  const void *(*get_extension)(const char *name);

  /* Compiles a scene. ASID_SCENE where the engine refuses it, or would ignore a
   * part of it that changes the physics. Threads: any. */
  asid_code (*load)(const asid_scene *scene, asid_model **model, asid_error *error);

  /* Frees a model, after all its batches and snapshots. Threads: any. */
  void (*destroy_model)(asid_model *model);

  /* Names and places; valid until the model is destroyed. May be NULL, or return
   * NULL: the host's own reading of the document then holds. Threads: any. */
  const asid_layout *(*layout)(const asid_model *model);

  /* Value of a target in the scene as it is. ASID_PARAMETER where there is no such
   * thing or the engine cannot change it. Threads: any. */
  asid_code (*nominal)(const asid_model *model, const asid_target *target, double *value,
                       asid_error *error);

  /* Makes a batch: every simulation reset, with nominal parameters. Errors as
   * `nominal`, for each target. Threads: any. */
  asid_code (*make_batch)(const asid_model *model, const asid_batch_config *config,
                          asid_batch **batch, asid_error *error);

  /* Frees a batch. Threads: the batch is not in use. */
  void (*destroy_batch)(asid_batch *batch);

  /* Sets parameters, count x target_count; states stay as they are.
   * ASID_PARAMETER for a value that is not physical. Threads: one a batch. */
  asid_code (*set_parameters)(asid_batch *batch, const uint64_t *sims, uint64_t count,
                              const double *values, asid_error *error);

  /* Puts simulations into the first keyframe, or `qpos0` at rest where there is
   * none: time zero, no memory of before, running. Parameters stay.
   * Threads: one a batch. */
  asid_code (*reset)(asid_batch *batch, const uint64_t *sims, uint64_t count,
                     asid_error *error);

  /* Sets positions (count x nq) and velocities (count x nv) and normalises
   * quaternions. Warm starts and other memory of before are cleared; time,
   * parameters and status stay. Threads: one a batch. */
  asid_code (*set_state)(asid_batch *batch, const uint64_t *sims, uint64_t count,
                         const double *qpos, const double *qvel, asid_error *error);

  /* Runs a rollout and writes count x frames x width readings, each of the state
   * at the end of its frame, before any later command acts. A simulation that
   * diverges stands still and records NaN from that frame on. ASID_INCAPABLE for a
   * sensor that the engine cannot read. The engine uses its own threads within the
   * call. Threads: one a batch. */
  asid_code (*rollout)(asid_batch *batch, const asid_rollout *rollout, double *out,
                       asid_error *error);

  /* Reads the present state without a step, count x width, and disturbs nothing.
   * Sensors that depend on a command see the last one. A row of a simulation that has
   * diverged is NaN, and the call ASID_OK. Errors as `rollout`. Threads: one a batch. */
  asid_code (*read)(asid_batch *batch, const uint64_t *sims, uint64_t count,
                    const asid_channel *channels, uint64_t channel_count, uint64_t width,
                    double *out, asid_error *error);

  /* Saves the states of some simulations, without their parameters: `count` rows,
   * usable in every batch of the same model. This and the next two may be NULL
   * where ASID_EXACT_SNAPSHOT is not claimed. Threads: one a batch. */
  asid_code (*save)(asid_batch *batch, const uint64_t *sims, uint64_t count,
                    asid_snapshot **snapshot, asid_error *error);

  /* Restores states: sims[i] takes row rows[i], its status included, and keeps its
   * parameters. Threads: one a batch; several batches may read a snapshot at once. */
  asid_code (*restore)(asid_batch *batch, const asid_snapshot *snapshot, const uint64_t *rows,
                       const uint64_t *sims, uint64_t count, asid_error *error);

  /* Frees a snapshot. Threads: any, when it is not in use. */
  void (*destroy_snapshot)(asid_snapshot *snapshot);

  /* Copies states within a batch: to[i] takes state and status of from[i], and
   * keeps its parameters. `to` is strictly increasing and shares no index with
   * `from`. May be NULL: the host then saves and restores. Threads: one a batch. */
  asid_code (*copy_state)(asid_batch *batch, const uint64_t *from, const uint64_t *to,
                          uint64_t count, asid_error *error);

  /* Writes the status of `count` simulations from number `first` on. Threads: one
   * a batch. */
  void (*status)(const asid_batch *batch, uint64_t first, uint64_t count, asid_status *out);

  /* Number of simulations that have diverged, so that the host need not ask for
   * each status after each call. Threads: one a batch. */
  uint64_t (*diverged_count)(const asid_batch *batch);

  /* Physics steps taken by all simulations since the batch was made: steps that were
   * taken, the last one of a simulation that diverged among them, and none after it.
   * Threads: one a batch. */
  uint64_t (*steps_taken)(const asid_batch *batch);
} asid_backend;

/* The one exported function. Threads: called once, before anything else. It
 * returns NULL where the engine cannot work on this machine. */
ASID_EXPORT const asid_backend *asid_backend_entry(void);

#ifdef __cplusplus
}
#endif

#endif /* ASID_BACKEND_H */
