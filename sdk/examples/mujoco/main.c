/* Streams the free bodies of a MuJoCo model: spheres and boxes. Users turn gravity and push, and the state can be saved.

       tandemd --engine './mujoco_engine pile.xml'                                                          */
#include "tandem/engine.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <sys/stat.h>

enum { MOST = 4096 };

static tandem_engine engine;
static mjModel* m;
static mjData* d;
static int body[MOST], bodies;
static char hello[64 * MOST];

static void add(const char* line) { strncat(hello, line, sizeof hello - strlen(hello) - 1); }

/* One type a shape, in the order of first use. */
static int type_of(int geom) {
  static char known[256][120];
  static int types;
  const mjtNum* size = m->geom_size + 3 * geom;
  const float* c = m->geom_rgba + 4 * geom;
  char line[120], name[40];
  const int sphere = m->geom_type[geom] == mjGEOM_SPHERE;
  const double radius = sphere ? size[0] : sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]);
  snprintf(line, sizeof line, "%g %02X%02X%02XFF %g %s", radius, (unsigned)(255 * c[0]), (unsigned)(255 * c[1]),
           (unsigned)(255 * c[2]), m->body_mass[m->geom_bodyid[geom]], sphere ? "sphere" : "box");
  if (!sphere) snprintf(line + strlen(line), sizeof line - strlen(line), " %g %g %g", size[0], size[1], size[2]);
  for (int i = 0; i < types; ++i)
    if (strcmp(known[i], line) == 0) return i;
  if (types == 256) return 0;
  strcpy(known[types], line);
  snprintf(name, sizeof name, "type shape%d ", types);
  add(name), add(line), add("\n");
  return types++;
}

static void find_bodies(void) {
  for (int b = 1; b < m->nbody && bodies < MOST; ++b) {
    const int joint = m->body_jntadr[b], geom = m->body_geomadr[b];
    if (joint < 0 || m->jnt_type[joint] != mjJNT_FREE || geom < 0) continue;
    if (m->geom_type[geom] == mjGEOM_SPHERE || m->geom_type[geom] == mjGEOM_BOX) body[bodies++] = b;
  }
}

static float* column(const char* name, unsigned axis) { return tandem_engine_column(&engine, name, axis); }

static void fill(void) {
  static const int order[4] = {1, 2, 3, 0}; /* MuJoCo: w x y z */
  unsigned char* const alive = tandem_engine_column(&engine, "alive", 0);
  unsigned short* const type = tandem_engine_column(&engine, "type", 0);
  for (int s = 0; s < bodies; ++s) {
    mjtNum velocity[6]; /* turning, then moving, along the axes of the world */
    mj_objectVelocity(m, d, mjOBJ_XBODY, body[s], velocity, 0);
    for (unsigned i = 0; i < 3; ++i) {
      column("position", i)[s] = (float)d->xpos[3 * body[s] + (int)i];
      column("velocity", i)[s] = (float)velocity[3 + i];
      column("angular_velocity", i)[s] = (float)velocity[i];
    }
    for (unsigned i = 0; i < 4; ++i) column("orientation", i)[s] = (float)d->xquat[4 * body[s] + order[i]];
    alive[s] = 1;
    type[s] = (unsigned short)type_of(m->body_geomadr[body[s]]);
  }
}

static void act(void) {
  const double* v = engine.values;
  if (engine.kind == TANDEM_ENGINE_GRAVITY) mju_copy3(m->opt.gravity, v);
  if (engine.kind != TANDEM_ENGINE_PUSH) return;
  for (int s = 0; s < bodies; ++s)
    if (mju_dist3(d->xpos + 3 * body[s], v) < v[3]) mju_addTo3(d->qvel + m->jnt_dofadr[m->body_jntadr[body[s]]], v + 4);
}

/* All that decides the next steps: positions, velocities, where the solver begins, gravity. */
static size_t state_bytes(void) { return sizeof(mjtNum) * (size_t)(m->nq + 2 * m->nv + 3); }

static uint64_t transfer(const char* path, int save) {
  FILE* const file = fopen(path, save ? "wb" : "rb");
  mjtNum* const part[4] = {d->qpos, d->qvel, d->qacc_warmstart, m->opt.gravity};
  const size_t count[4] = {(size_t)m->nq, (size_t)m->nv, (size_t)m->nv, 3};
  uint64_t bytes = 0;
  for (int i = 0; i < 4 && file != NULL; ++i)
    bytes += sizeof(mjtNum) * (save ? fwrite(part[i], sizeof(mjtNum), count[i], file) : fread(part[i], sizeof(mjtNum), count[i], file));
  if (file != NULL) fclose(file);
  return bytes;
}

int main(int argc, char** argv) {
  char error[300] = "give the path of a model", numbers[300];
  const double dt = 1.0 / 60;
  m = argc > 1 ? mj_loadXML(argv[1], NULL, error, sizeof error) : NULL;
  if (m == NULL) return fprintf(stderr, "%s\n", error), 2;
  d = mj_makeData(m);
  mj_forward(m, d);
  find_bodies();
  m->opt.timestep = dt / ceil(dt / m->opt.timestep);
  snprintf(numbers, sizeof numbers,
           "name mujoco\ncapacity %d\ndt %.17g\nup z\nturns 1\nsave 1\ngravity %g %g %g\ninput gravity 50\ninput push 50\nplane 0 0 1 0\n",
           bodies, dt, m->opt.gravity[0], m->opt.gravity[1], m->opt.gravity[2]);
  add(numbers);
  for (int s = 0; s < bodies; ++s) type_of(m->body_geomadr[body[s]]);
  if (tandem_engine_open(&engine, hello) != 0) return fprintf(stderr, "%s\n", engine.error), tandem_engine_close(&engine);
  fill();
  tandem_engine_start(&engine);
  for (;;) switch (tandem_engine_next(&engine)) {
      case TANDEM_ENGINE_INPUT:
        act();
        break;
      case TANDEM_ENGINE_STEP:
        for (double left = dt; left > m->opt.timestep / 2; left -= m->opt.timestep) mj_step(m, d);
        mj_forward(m, d); /* positions and velocities of bodies as of the end of the step */
        fill();
        tandem_engine_done(&engine, 0);
        break;
      case TANDEM_ENGINE_SAVE:
        tandem_engine_saved(&engine, transfer(engine.path, 1));
        break;
      case TANDEM_ENGINE_LOAD: {
        struct stat file;
        const int ours = stat(engine.path, &file) == 0 && (size_t)file.st_size == state_bytes();
        if (ours) transfer(engine.path, 0);
        mj_forward(m, d);
        fill();
        tandem_engine_loaded(&engine, ours);
        break;
      }
      default:
        if (engine.error[0] != 0) fprintf(stderr, "%s\n", engine.error);
        return tandem_engine_close(&engine);
    }
}
