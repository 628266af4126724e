/* The runtime of Hobble in C99; hobble.h explains how to use it. It computes what src/hobble/runtime and
   src/hobble/models compute in Python, in the same order, and a test holds both together. Parts of this file:

   1. Constants and small functions     5. The trajectory (trajectory.py, bounds.py, caller_targets.py)
   2. What a file holds                 6. Rows of the network (network_rows.py) and its prediction moved on
   3. Networks (predict.py)             7. Feet (leg_reach.py, feet.py)
   4. Motion matching (matching)        8. A frame (controller.py), and the functions of hobble.h

   X are the inputs of the network and Y its outputs. A column is one of them. State is in double precision,
   because a character may walk far from the origin; networks are in single precision. */
#include "hobble.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* ---- 1. Constants and small functions -------------------------------------------------------------------
 */

#define PI 3.14159265358979323846
#define GAITS HOBBLE_GAITS
#define RADIANS(degrees) ((degrees) * (PI / 180))

/* Limits of what a file may hold. Products of them fit 64 bits. */
enum { MOST_JOINTS = 1024, MOST_WINDOW = 4096, MOST_COLUMNS = 4096, MOST_CHANNELS = 64, MOST_LAYERS = 16 };
enum {
    MOST_UNITS = 1 << 16,
    MOST_SETS = 64,
    MOST_ROWS = 1 << 24,
    MOST_LEVELS = 64,
    MOST_CHARACTERS = 1 << 20
};
#define LARGEST_SOUND 1e8 /* a larger number is called unsound, like one that is not finite */
#define HIGHEST_GROUND 1e7
#define FARTHEST 1e7

/* Trajectory and targets. The Python modules say why these numbers were chosen. */
#define STEERING_LIMIT 2.0
#define TARGET_MIX 0.9
#define GAIT_MIX 0.1
#define CORRECTION_RATE 0.01
#define CORRECTION_WITHIN 0.8
#define MOST_CORRECTION 1.0
#define FURTHEST_TURN RADIANS(137)
#define STRAFE_FROM RADIANS(45)
#define STILL 0.1
#define FASTEST_TARGET 30.0
#define TURN_IN_PLACE RADIANS(20)
#define JOG_FROM 5.0
#define LAME_BELOW 2.2
#define HURRY_FACTOR 1.25
#define SUM_NORM 3.0
#define SLOWEST_SHARE 0.1
/* Poses. */
#define FASTEST_TURN RADIANS(25)
#define MOST_CLIMB 5.0
#define PULL 0.2
#define PULL_AHEAD 0.5
#define BACKWARD_LOSS 0.5
#define MOST_PUSH 0.3
#define CARRIED_SHARE 0.5
#define STANDING_SHARE 0.1
/* Feet. */
#define LOCK_AT 0.5
#define RELEASE 0.125
#define TOO_FAR 20.0
#define MISSED 1.0
#define TOO_FAR_ALONE 30.0
#define MISSED_ALONE 4.0
#define STEP_FRAMES 14
#define STEP_HEIGHT 5.0
#define HEIGHT_MIX 0.5
#define FEET_AHEAD 4.0
#define FASTEST_LIFT 8.0
#define STRETCH 0.96
#define UNDER 8.0
#define BEHIND 10.0
#define MOST_SINK 6.0
#define SINK_KEPT 0.85
#define BODY_MIX 0.15
#define BODY_FREE 3.0
#define BODY_MIN_CONTACT 0.3
#define FLOATING 3.0
#define BENDS_ABOVE 10.0
#define BENT 0.1
#define MOST_BENT 2.5
#define MOST_ADDED RADIANS(28)
#define KNEE_AHEAD 3.0
/* Networks and motion matching. */
#define NEGLIGIBLE_SHARE 1e-7f
#define FASTEST_PULL 0.002
enum { POINTS = 44, EARLIER = 12 }; /* where edges of stairs are looked for */
enum { SURROUNDING = 20, ROW = 0, SINCE = 1, OFFSETS = 2, OFFSETS_PER_JOINT = 12, BLOCK = 16 };

static double smaller(double a, double b) { return a < b ? a : b; }
static double larger(double a, double b) { return a > b ? a : b; }
static double clamp(double v, double low, double high) { return smaller(larger(v, low), high); }
static double length2(double x, double z) { return sqrt(x * x + z * z); }
static double length3(double x, double y, double z) { return sqrt(x * x + y * y + z * z); }
static double wrap(double angle) { return angle - 2 * PI * floor((angle + PI) / (2 * PI)); }

/* ---- 2. What a file holds --------------------------------------------------------------------------------

   A header of 64 bytes, a table of sections, and the sections, each aligned to 64 bytes. A section has a
   name, a type and a number of values. src/hobble/engine/hob.py writes the file. Everything is checked here
   before it is used. */

enum { I32 = 1, F32 = 2, F64 = 3, I16 = 4, U8 = 5 };
enum { HEADER = 64, ENTRY = 40, NAME = 16 };

/* The values of the section "sizes". EXTRA: 2 if the first layer gets sine and cosine of the phase after X,
   else 0. LATENT: of a gated network, the number of local phases, see `remember`. */
enum {
    JOINTS,
    WINDOW,
    STEP,
    COLUMNS,
    CHANNELS,
    X_SIZE,
    Y_SIZE,
    INPUTS,
    HIPS,
    FORM,
    STORAGE,
    EXTRA,
    LAYERS,
    SETS,
    BLENDED,
    GATE_LAYERS,
    GATE_INPUTS,
    ROWS,
    FEATURES,
    EVERY,
    LATENT,
    STEPPER_LAYERS,
    PROJECTOR_LAYERS,
    SIZES
};
/* The values of the section "numbers". */
enum { SIDE, STEERING, LOCKING, FASTEST, HIPS_LOW, HIPS_HIGH, START_PHASE, HALFLIFE, UPRIGHT, NUMBERS };
/* Where a prediction comes from. PHASED: sets of weights, of which those around the phase are blended. FIXED:
   one set. GATED: sets that a second network, the gate, blends. RECORDED: frames of clips. LEARNED: three
   networks that stand for such frames. See part 4. */
enum { PHASED, FIXED, GATED, RECORDED, LEARNED, FORMS };
enum { FLOAT32, INT16 }; /* how weights and frames are stored */
/* Blocks of X whose first columns are in the section "x_first". */
enum { X_POSITION, X_DIRECTION, X_GAIT, X_JOINTS, X_VELOCITIES, X_TERRAIN, X_BLOCKS };
enum { HIP, KNEE, HEEL, TOE }; /* columns of `legs` */
enum { FOOT = 1, TOES = 2 };   /* the part of a foot to which a joint belongs, in `parts` */

/* Layers with an ELU between them. Their weights are in panels: see `multiply`. */
typedef struct {
    int layers, sets, storage;
    int inputs[MOST_LAYERS], outputs[MOST_LAYERS];
    uint64_t weights_at[MOST_LAYERS]; /* index in `weights` where a layer's weights begin */
    const float *factors[MOST_LAYERS], *biases[MOST_LAYERS]; /* (sets, outputs) each */
    const void *weights;
    const float *mean, *std; /* of the last layer's outputs */
} stack;

/* Speed limits of the columns of a channel: speeds (GAITS, columns, levels), see speed_limits.py. */
typedef struct {
    int first, columns, levels; /* levels: 0 if the channel has no limits */
    const double *level, *usual, *speeds;
} channel;

typedef struct { /* a character file, read only */
    int size[SIZES];
    double number[NUMBERS];
    int samples, future, length; /* of the trajectory: in X, in Y, and in frames */
    int stand, walk, jog, crouch;
    int y_contacts, y_position, y_direction,
        y_joints; /* first columns in Y; 0 to 3 are velocity, turn, phase */
    const int32_t *inputs, *x_first, *x_channels, *parents, *legs, *arms, *channel_of; /* arms: find_arms */
    const uint8_t *parts, *slows; /* slows: for each channel, whether its values make a body limp */
    const uint8_t *leg;           /* for each column, the leg that hurts: 1 left, 2 right, 0 none */
    const char *names;            /* each ends with a 0 */
    const float *x_mean, *x_inverse, *x_low, *x_high, *y_low, *y_high;
    const double *offsets, *sole, *ahead, *rates, *scales, *highest, *defaults, *exponents;
    const double *start_path, *start_direction, *start_gait, *start_joints, *start_velocities,
        *start_rotations;
    channel channels[MOST_CHANNELS];
    stack network, gate;
    const int32_t *gate_columns;
    const double *remembered; /* local phases and rotations of a character that starts */
    /* Motion matching: the Y and the features of each recorded frame, and how many frames of its run follow.
     */
    const void *frames;
    const float *frame_scale, *features, *feature_weights, *phases;
    const int32_t *feature_columns, *remaining;
    const uint8_t *findable; /* whether a search may find a frame */
    /* Learned motion matching; `network` is the decompressor. Mean, standard deviation, its inverse and range
       of the weighted features. */
    stack stepper, projector;
    const float *feature_mean, *feature_std, *feature_inverse, *feature_low, *feature_high;
} model;

typedef struct {
    const unsigned char *bytes;
    uint64_t size;
    uint32_t sections;
    char *why;
    int failed;
} reader;

static void fail(reader *r, const char *what, const char *name) {
    if (!r->failed && r->why) snprintf(r->why, HOBBLE_WHY, "the character file %s%s", what, name);
    r->failed = 1;
}

static uint64_t read64(const unsigned char *at) {
    uint64_t value;
    memcpy(&value, at, 8);
    return value;
}

static uint32_t read32(const unsigned char *at) {
    uint32_t value;
    memcpy(&value, at, 4);
    return value;
}

/* The checksum Adler-32 (RFC 1950). 5552 sums of bytes fit 32 bits. */
static uint32_t checksum(const unsigned char *bytes, uint64_t count) {
    uint32_t a = 1, b = 0;
    for (uint64_t from = 0; from < count; from += 5552) {
        uint64_t end = count - from < 5552 ? count : from + 5552;
        for (uint64_t i = from; i < end; i++) b += a += bytes[i];
        a %= 65521;
        b %= 65521;
    }
    return b << 16 | a;
}

static void read_header(reader *r) {
    if ((uintptr_t)r->bytes % 8) fail(r, "is not aligned to 8 bytes", "");
    else if (r->size < HEADER) fail(r, "is shorter than its header", "");
    else if (memcmp(r->bytes, "HOBBLE\r\n", 8)) fail(r, "does not begin as one", "");
    else if (read32(r->bytes + 12) != 0x01020304) fail(r, "was written for another byte order", "");
    else if (read32(r->bytes + 8) != HOBBLE_FILE_VERSION)
        fail(r, "has another version than this runtime", "");
    else if (read64(r->bytes + 16) != r->size) fail(r, "has another size than it says", "");
    else if (read32(r->bytes + 24) != checksum(r->bytes + HEADER, r->size - HEADER))
        fail(r, "is damaged", "");
    else {
        r->sections = read32(r->bytes + 28);
        if (r->sections > (r->size - HEADER) / ENTRY) fail(r, "has a table that is too long", "");
    }
}

/* The section `name`, which must have this type and count. After a failure, NULL. */
static const void *section(reader *r, const char *name, unsigned type, uint64_t count) {
    static const unsigned char bytes_of[] = {0, 4, 4, 8, 2, 1};
    char padded[NAME] = {0};
    if (r->failed) return NULL;
    memcpy(padded, name, strlen(name));
    for (uint32_t i = 0; i < r->sections; i++) {
        const unsigned char *entry = r->bytes + HEADER + (uint64_t)ENTRY * i;
        if (memcmp(entry, padded, NAME)) continue;
        uint64_t offset = read64(entry + 24), found = read64(entry + 32);
        if (read64(entry + 16) != type || found != count)
            fail(r, "has another type or size in its section ", name);
        else if (offset % 64 || offset > r->size || count > (r->size - offset) / bytes_of[type])
            fail(r, "ends within its section ", name);
        return r->failed ? NULL : r->bytes + offset;
    }
    fail(r, "has no section ", name);
    return NULL;
}

/* The number of values of a section; 0 if there is none. */
static uint64_t count_of(const reader *r, const char *name) {
    char padded[NAME] = {0};
    memcpy(padded, name, strlen(name));
    for (uint32_t i = 0; !r->failed && i < r->sections; i++) {
        const unsigned char *entry = r->bytes + HEADER + (uint64_t)ENTRY * i;
        if (!memcmp(entry, padded, NAME)) return read64(entry + 32);
    }
    return 0;
}

/* A section of floats with absolute values up to `most`, or between `low` and `high`. */
static const float *floats(reader *r, const char *name, uint64_t count, float most) {
    const float *values = section(r, name, F32, count);
    for (uint64_t i = 0; values && i < count; i++)
        if (!(fabsf(values[i]) <= most)) {
            fail(r, "holds an impossible number in its section ", name);
            return NULL;
        }
    return values;
}

static const double *doubles(reader *r, const char *name, uint64_t count, double low, double high) {
    const double *values = section(r, name, F64, count);
    for (uint64_t i = 0; values && i < count; i++)
        if (!(values[i] >= low && values[i] <= high)) {
            fail(r, "holds an impossible number in its section ", name);
            return NULL;
        }
    return values;
}

static const int32_t *indices(reader *r, const char *name, uint64_t count, int64_t low, int64_t high) {
    const int32_t *values = section(r, name, I32, count);
    for (uint64_t i = 0; values && i < count; i++)
        if (values[i] < low || values[i] > high) {
            fail(r, "holds an impossible number in its section ", name);
            return NULL;
        }
    return values;
}

static const uint8_t *small(reader *r, const char *name, uint64_t count, int high) {
    const uint8_t *values = section(r, name, U8, count);
    for (uint64_t i = 0; values && i < count; i++)
        if (values[i] > high) {
            fail(r, "holds an impossible number in its section ", name);
            return NULL;
        }
    return values;
}

static void require(reader *r, int is_true, const char *name) {
    if (!is_true) fail(r, "holds an impossible number in its section ", name);
}

enum { WIDTH = 16 }; /* outputs in a panel of weights */
static uint64_t panels_of(uint64_t outputs) { return (outputs + WIDTH - 1) / WIDTH; }

/* Reads a stack of layers whose sections have the names `plan`, `weights` and `numbers`. */
static void read_stack(reader *r, stack *s, const char *const names[3], int inputs, int outputs) {
    const int32_t *plan = indices(r, names[0], 2 * (uint64_t)s->layers, 1, MOST_UNITS);
    uint64_t weights = 0, count = 2 * (uint64_t)outputs;
    if (!plan) return;
    for (int i = 0; i < s->layers; i++) {
        require(r, plan[2 * i] == (i ? plan[2 * i - 1] : inputs), names[0]);
        s->inputs[i] = plan[2 * i];
        s->outputs[i] = plan[2 * i + 1];
        s->weights_at[i] = weights;
        weights += s->sets * panels_of((uint64_t)s->outputs[i]) * WIDTH * (uint64_t)s->inputs[i];
        count += 2 * (uint64_t)s->sets * (uint64_t)s->outputs[i];
    }
    require(r, s->outputs[s->layers - 1] == outputs, names[0]);
    s->weights = s->storage == INT16 ? section(r, names[1], I16, weights)
                                     : (const void *)floats(r, names[1], weights, 1e6f);
    const float *numbers = floats(r, names[2], count, 1e20f);
    if (!numbers) return;
    s->mean = numbers;
    s->std = numbers + outputs;
    numbers += 2 * outputs;
    for (int i = 0; i < s->layers; i++) {
        s->factors[i] = numbers;
        s->biases[i] = numbers + (size_t)s->sets * (size_t)s->outputs[i];
        numbers += 2 * (size_t)s->sets * (size_t)s->outputs[i];
    }
}

static void read_sizes(reader *r, model *m) {
    static const int low[SIZES] = {1, 2, 1, 0, 0, 1, 1};
    static const int high[SIZES] = {MOST_JOINTS, MOST_WINDOW, MOST_WINDOW, MOST_COLUMNS,    MOST_CHANNELS,
                                    MOST_UNITS,  MOST_UNITS,  MOST_UNITS,  MOST_JOINTS - 1, FORMS - 1,
                                    INT16,       2,           MOST_LAYERS, MOST_SETS,       4,
                                    MOST_LAYERS, MOST_UNITS,  MOST_ROWS,   MOST_UNITS,      1000000,
                                    MOST_UNITS,  MOST_LAYERS, MOST_LAYERS};
    const int32_t *sizes = section(r, "sizes", I32, SIZES);
    const double *numbers = section(r, "numbers", F64, NUMBERS);
    if (!sizes || !numbers) return;
    for (int i = 0; i < SIZES; i++) {
        require(r, sizes[i] >= low[i] && sizes[i] <= high[i], "sizes");
        m->size[i] = sizes[i];
    }
    for (int i = 0; i < NUMBERS; i++) m->number[i] = numbers[i];
    if (r->failed) return;
    int joints = m->size[JOINTS], window = m->size[WINDOW], step = m->size[STEP], form = m->size[FORM];
    require(r, window % step == 0 && window / step >= 2 && m->size[HIPS] < joints, "sizes");
    if (r->failed) return;
    m->future = window / step;
    m->samples = 2 * m->future;
    m->length = 2 * window;
    m->y_contacts = 4;
    m->y_position = 8;
    m->y_direction = 8 + 2 * m->future;
    m->y_joints = 8 + 4 * m->future;
    int local = form == GATED ? m->size[LATENT] : 0;
    require(r, m->size[X_SIZE] == m->samples * (7 + GAITS) + joints * (local ? 9 : 6) + 2 * local + m->size[COLUMNS],
            "sizes");
    require(r, m->size[Y_SIZE] == m->y_joints + 9 * joints + 3 * local, "sizes");
    require(r, form == RECORDED ? m->size[ROWS] > 0 && m->size[EVERY] > 0 : m->size[LAYERS] > 0, "sizes");
    require(r, form != PHASED || m->size[BLENDED] == 1 || m->size[BLENDED] == 2 || m->size[BLENDED] == 4,
            "sizes");
    require(r, form == RECORDED || m->size[SETS] >= (form == PHASED ? m->size[BLENDED] : 1), "sizes");
    require(r, (form != FIXED || m->size[SETS] == 1) && m->size[EXTRA] != 1, "sizes");
    require(r, form != GATED || (m->size[GATE_LAYERS] > 0 && m->size[GATE_INPUTS] > 0), "sizes");
    require(r,
            form != LEARNED
                || (m->size[SETS] == 1 && m->size[EXTRA] == 0 && m->size[EVERY] > 0 && m->size[FEATURES] > 0
                    && m->size[STEPPER_LAYERS] > 0 && m->size[PROJECTOR_LAYERS] > 0),
            "sizes");
    const double *n = m->number;
    require(r, n[SIDE] >= 0 && n[SIDE] <= 1e4 && n[STEERING] >= 0 && n[STEERING] <= 1e6, "numbers");
    require(r, (n[LOCKING] == 0 || n[LOCKING] == 1) && n[FASTEST] > 0 && n[FASTEST] <= LARGEST_SOUND,
            "numbers");
    require(r, n[HIPS_LOW] >= -LARGEST_SOUND && n[HIPS_LOW] <= n[HIPS_HIGH] && n[HIPS_HIGH] <= LARGEST_SOUND,
            "numbers");
    require(r, n[UPRIGHT] >= n[HIPS_LOW] && n[UPRIGHT] <= LARGEST_SOUND, "numbers");
    require(r, n[START_PHASE] >= 0 && n[START_PHASE] <= 1 && n[HALFLIFE] > 0 && n[HALFLIFE] <= 1e6,
            "numbers");
}

/* Reads the columns of X, the skeleton, and the state in which a character starts. */
static void read_body(reader *r, model *m) {
    uint64_t joints = (uint64_t)m->size[JOINTS], x_size = (uint64_t)m->size[X_SIZE],
             y_size = (uint64_t)m->size[Y_SIZE];
    uint64_t inputs = (uint64_t)m->size[INPUTS], length = (uint64_t)m->length, last = joints - 1;
    const int block[X_BLOCKS] = {2 * m->samples,    2 * m->samples,    GAITS * m->samples,
                                 (int)(3 * joints), (int)(3 * joints), 3 * m->samples};
    m->inputs = indices(r, "inputs", inputs, 0, (int64_t)x_size - 1);
    m->x_mean = floats(r, "x_mean", inputs, 1e9f);
    m->x_inverse = floats(r, "x_inverse", inputs, 1e31f);
    m->x_low = floats(r, "x_low", x_size, 1e10f);
    m->x_high = floats(r, "x_high", x_size, 1e10f);
    m->y_low = floats(r, "y_low", y_size, 1e10f);
    m->y_high = floats(r, "y_high", y_size, 1e10f);
    m->x_first = indices(r, "x_first", X_BLOCKS, 0, (int64_t)x_size - 1);
    m->x_channels = indices(r, "x_channels", (uint64_t)m->size[COLUMNS], 0, (int64_t)x_size - 1);
    m->parents = indices(r, "parents", joints, -1, (int64_t)last);
    m->offsets = doubles(r, "offsets", 3 * joints, -1e5, 1e5);
    m->legs = indices(r, "legs", 8, 0, (int64_t)last);
    m->arms = indices(r, "arms", 4, 0, (int64_t)last);
    m->parts = small(r, "parts", 2 * joints, TOES);
    m->sole = doubles(r, "sole", 2, -1e6, 1e6);
    m->ahead = doubles(r, "ahead", 3, -1.001, 1.001);
    m->start_path = doubles(r, "start_path", 2 * length, -1e6, 1e6);
    m->start_direction = doubles(r, "start_facing", 2 * length, -1.001, 1.001);
    m->start_gait = doubles(r, "start_gait", GAITS * length, -1e3, 1e3);
    m->start_joints = doubles(r, "start_joints", 3 * joints, -1e6, 1e6);
    m->start_velocities = doubles(r, "start_speeds", 3 * joints, -1e6, 1e6);
    m->start_rotations = doubles(r, "start_turns", 4 * joints, -1.001, 1.001);
    if (r->failed) return;
    for (int i = 0; i < X_BLOCKS; i++) require(r, m->x_first[i] + block[i] <= (int)x_size, "x_first");
    for (uint64_t i = 0; i < x_size; i++) require(r, m->x_low[i] <= m->x_high[i], "x_low");
    for (uint64_t i = 0; i < y_size; i++) require(r, m->y_low[i] <= m->y_high[i], "y_low");
    for (int j = 0; j < (int)joints; j++)
        require(r, j ? m->parents[j] >= 0 && m->parents[j] < j : m->parents[j] == -1, "parents");
}

/* Reads the channels and their speed limits. */
static void read_channels(reader *r, model *m) {
    uint64_t columns = (uint64_t)m->size[COLUMNS], channels = (uint64_t)m->size[CHANNELS];
    m->channel_of = indices(r, "channel_of", columns, 0, (int64_t)channels - 1);
    m->rates = doubles(r, "rates", columns, 0, 1e9);
    m->scales = doubles(r, "scales", columns, 1e-9, 1e9);
    m->highest = doubles(r, "highest", columns, 1e-9, 1e6);
    m->exponents = doubles(r, "exponents", columns, 0.1, 10);
    m->defaults = doubles(r, "defaults", columns, 0, 1e6);
    m->slows = small(r, "slows", channels, 1);
    m->leg = small(r, "leg", columns, 2);
    const int32_t *levels = indices(r, "limit_levels", channels, 0, MOST_LEVELS);
    if (r->failed) return;
    for (uint64_t k = 1; k < columns; k++) require(r, m->channel_of[k - 1] <= m->channel_of[k], "channel_of");
    for (uint64_t k = columns; k-- > 0;) {
        m->channels[m->channel_of[k]].first = (int)k;
        m->channels[m->channel_of[k]].columns++;
    }
    uint64_t count = 0;
    for (uint64_t i = 0; i < channels; i++) {
        require(r, levels[i] != 1, "limit_levels");
        if (levels[i]) count += (uint64_t)levels[i] * (1 + GAITS * (uint64_t)m->channels[i].columns) + GAITS;
    }
    const double *limits = doubles(r, "limits", count, 0, 1e9);
    for (uint64_t i = 0; !r->failed && i < channels; i++) {
        channel *one = &m->channels[i];
        one->levels = levels[i];
        if (!one->levels) continue;
        one->level = limits;
        one->usual = one->level + one->levels;
        one->speeds = one->usual + GAITS;
        limits = one->speeds + GAITS * one->columns * one->levels;
        for (int l = 1; l < one->levels; l++) require(r, one->level[l - 1] < one->level[l], "limits");
        for (const double *speed = one->speeds; speed < limits; speed++) require(r, *speed > 0, "limits");
    }
}

static void read_matching(reader *r, model *m) {
    uint64_t rows = (uint64_t)m->size[ROWS], features = (uint64_t)m->size[FEATURES],
             y_size = (uint64_t)m->size[Y_SIZE];
    int findable = 0;
    m->frames = m->size[STORAGE] == INT16 ? section(r, "frames", I16, rows * y_size)
                                          : (const void *)floats(r, "frames", rows * y_size, 1e9f);
    m->frame_scale = floats(r, "frame_scale", y_size, 1e9f);
    m->features = floats(r, "features", rows * features, 1e15f);
    m->feature_columns = indices(r, "feature_columns", features, 0, m->size[X_SIZE] - 1);
    m->feature_weights = floats(r, "feature_weights", features, 1e9f);
    m->phases = floats(r, "phases", rows, 1);
    m->remaining = indices(r, "remaining", rows, 0, MOST_ROWS);
    m->findable = small(r, "findable", rows, 1);
    if (r->failed) return;
    for (uint64_t i = 0; i < rows; i++) {
        findable |= m->findable[i];
        /* With this check, a character that plays a run never gets beyond the end of the table. */
        require(r, m->remaining[i] == 0 || (i + 1 < rows && m->remaining[i + 1] == m->remaining[i] - 1),
                "remaining");
    }
    require(r, findable, "findable");
}

static void read_learned(reader *r, model *m) {
    static const char *const names[3][3] = {{"plan", "weights", "layers"},
                                            {"step_plan", "step_weights", "step_layers"},
                                            {"search_plan", "search_weights", "search_layers"}};
    int features = m->size[FEATURES], state = features + m->size[LATENT];
    stack *const stacks[3] = {&m->network, &m->stepper, &m->projector};
    const int layers[3] = {m->size[LAYERS], m->size[STEPPER_LAYERS], m->size[PROJECTOR_LAYERS]};
    const int inputs[3] = {state, state, features};
    /* The decompressor also gives sine and cosine of the frame's phase. */
    const int outputs[3] = {m->size[Y_SIZE] + 2, state, state};
    uint64_t count = (uint64_t)features;
    for (int i = 0; i < 3; i++) {
        stacks[i]->layers = layers[i];
        stacks[i]->sets = 1;
        stacks[i]->storage = m->size[STORAGE];
        read_stack(r, stacks[i], names[i], inputs[i], outputs[i]);
    }
    m->feature_columns = indices(r, "feature_columns", count, 0, m->size[X_SIZE] - 1);
    m->feature_weights = floats(r, "feature_weights", count, 1e9f);
    m->feature_mean = floats(r, "feature_mean", count, 1e15f);
    m->feature_std = floats(r, "feature_std", count, 1e15f);
    m->feature_inverse = floats(r, "feature_inverse", count, 1e31f);
    m->feature_low = floats(r, "feature_low", count, 1e15f);
    m->feature_high = floats(r, "feature_high", count, 1e15f);
}

/* Of a network with local phases: how many numbers it remembers of a character's last frame. */
static int remembered_count(const model *m) {
    return 2 * m->size[LATENT] + 3 * m->size[JOINTS];
}

static int name_count(const model *m) {
    return m->size[JOINTS] + GAITS + m->size[CHANNELS] + 2 * m->size[COLUMNS];
}

/* Finds the names of joints, gaits, channels, columns and their parts, one after another. */
static void read_names(reader *r, model *m) {
    int wanted = name_count(m), found = 0;
    uint64_t count = count_of(r, "names");
    const char *text = section(r, "names", U8, count), *name = text;
    static const char *const needed[4] = {"stand", "walk", "jog", "crouch"};
    int *const gaits[4] = {&m->stand, &m->walk, &m->jog, &m->crouch};
    if (!text) return;
    m->names = text;
    require(r, count > 0 && count < (1u << 28) && text[count - 1] == 0, "names");
    for (int i = 0; i < 4; i++) *gaits[i] = -1;
    while (!r->failed && found < wanted && name < text + count) {
        for (int i = 0; i < 4; i++)
            if (found >= m->size[JOINTS] && found < m->size[JOINTS] + GAITS && !strcmp(name, needed[i]))
                *gaits[i] = found - m->size[JOINTS];
        found++;
        name += strlen(name) + 1;
    }
    require(r, found == wanted && name == text + count, "names");
    for (int i = 0; i < 4; i++) require(r, *gaits[i] >= 0, "names");
}

/* Reads a character file. Returns whether it can be used; if not, `why` says why. */
static int read_model(const void *file, size_t bytes, model *m, char *why) {
    static const char *const network[3] = {"plan", "weights", "layers"}, *const gate[3] = {"gate_plan",
                                                                                           "gate_weights",
                                                                                           "gate_layers"};
    reader r = {(const unsigned char *)file, bytes, 0, why, 0};
    memset(m, 0, sizeof *m);
    read_header(&r);
    if (!r.failed) read_sizes(&r, m);
    if (!r.failed) read_names(&r, m);
    if (!r.failed) read_body(&r, m);
    if (!r.failed) read_channels(&r, m);
    if (r.failed) return 0;
    if (m->size[FORM] == RECORDED) {
        read_matching(&r, m);
        return !r.failed;
    }
    if (m->size[FORM] == LEARNED) {
        read_learned(&r, m);
        return !r.failed;
    }
    m->network.layers = m->size[LAYERS];
    m->network.sets = m->size[SETS];
    m->network.storage = m->size[STORAGE];
    read_stack(&r, &m->network, network, m->size[INPUTS] + m->size[EXTRA], m->size[Y_SIZE]);
    if (m->size[FORM] == GATED) {
        m->gate.layers = m->size[GATE_LAYERS];
        m->gate.sets = 1;
        m->gate.storage = FLOAT32;
        m->gate_columns = indices(&r, "gate_columns", (uint64_t)m->size[GATE_INPUTS], 0, m->size[INPUTS] - 1);
        if (m->size[LATENT]) {
            m->remembered = doubles(&r, "remembered", (uint64_t)remembered_count(m), -1e6, 1e6);
            require(&r, m->x_first[X_TERRAIN] + 3 * m->samples + remembered_count(m) <= m->size[X_SIZE],
                    "x_first");
        }
        read_stack(&r, &m->gate, gate, m->size[GATE_INPUTS], m->size[SETS]);
    }
    return !r.failed;
}

/* The state of a character between frames; `Character` in character.py explains each of these fields. */
typedef struct {
    double (*position)[2], (*direction)[2], (*gait)[GAITS], (*ground)[3];
    double (*joint_position)[3], (*joint_velocity)[3], (*joint_rotation)[4];
    double (*pose_position)[3], (*pose_rotation)[4];
    double *values, *targets, *memory;
    double root_height, phase, smoothed_velocity[2], smoothed_direction[2], strafe, correction[2],
        earlier[2];
    double foot_lock[2], foot_hold[2][2], foot_step[2], foot_missed[2], foot_lift[2], foot_added[2][2][4];
    double leg_shown[2][3][3], body_lift, hips_sink;
    double root[3], yaw, report[6]; /* report: what hobble_state returns */
    int placed;
    /* Steps that differ, see vary. pace and shown: factors of the change of phase and of the values. */
    double variation, pace, shown, knee_more[2], arm_more[2], arm_mean[2];
    uint32_t seed, step;
} character;

/* What a character shall do in a frame, after all corrections. */
typedef struct {
    double velocity[2], facing[2], strafe, gait[GAITS];
} goal;

struct hobble {
    model model;
    int characters, memory_size, wide; /* wide: see `multiply` */
    const char **names;
    character *state, *saved_state; /* saved: as before the frame, in case the ground is refused */
    double *numbers, *saved_numbers;
    size_t number_count;
    goal *goals;
    float *x, *z, *y, *shares, *gate_inputs, *room;
    int *members;
    size_t *slots;
    size_t widest;                         /* numbers that the widest layer needs for each character */
    double *points, *heights;              /* where the ground is looked up */
    double *powers, powers_strafe;         /* see blend_future */
    float *query, *block_low, *block_high; /* motion matching: see nearest_row */
    double *rows_old;                      /* four unpacked rows */
    float *states;                         /* learned motion matching: see predict_learned */
};

/* ---- 3. Networks -----------------------------------------------------------------------------------------

   A layer is linear before its activation, so the outputs of the sets of weights are blended, not the
   weights. Weights are in panels of WIDTH outputs, (sets, panels, inputs, WIDTH): the WIDTH weights of the
   same input are neighbours. Each output is one running sum over the inputs. A tile is a group of rows and
   panels whose sums stay in registers. */

#ifdef __wasm__ /* Sums of three rows fit into 16 registers of 128 bits: .82 of the time of six rows. */
enum { TILE_ROWS = 3 };
#else
enum { TILE_ROWS = 6 };
#endif
enum { DEPTH = 128, AHEAD_IN_MEMORY = 48, TILE_PANELS = 4 };

/* Three operations on WIDTH numbers: copy them, add an input's products with WIDTH weights, and convert WIDTH
   weights. wide: with one vector of AVX-512, which changes no bit. */
#if defined(__GNUC__) || defined(__clang__)
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#define FETCH(place) __builtin_prefetch(place, 0, 3)
typedef float v4 __attribute__((vector_size(16)));
typedef float v8 __attribute__((vector_size(32), aligned(4), may_alias));
typedef float v16 __attribute__((vector_size(64), aligned(4), may_alias));
typedef int32_t whole __attribute__((vector_size(32), aligned(4), may_alias));
typedef int16_t half __attribute__((vector_size(16), aligned(2), may_alias));

#if defined(__wasm__)
#include <wasm_simd128.h>
#undef FETCH
#define FETCH(place) ((void)0)
/* Clang converts a vector of short integers one by one; `asm` hides from it that these integers were short.
 */
static inline v8 floats_of(const int16_t *w) {
    v128_t low = wasm_i32x4_load16x4(w), high = wasm_i32x4_load16x4(w + 4);
    __asm__("" : "+r"(low), "+r"(high));
    low = wasm_f32x4_convert_i32x4(low);
    high = wasm_f32x4_convert_i32x4(high);
    return __builtin_shufflevector((v4)low, (v4)high, 0, 1, 2, 3, 4, 5, 6, 7);
}
#define FLOATS(w) floats_of(w)
#elif defined(__AVX2__) /* gcc needs three times as many instructions for a general conversion */
#include <immintrin.h>
#define FLOATS(w) _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)(w))))
#else
#define FLOATS(w) __builtin_convertvector(__builtin_convertvector(*(const half *)(w), whole), v8)
#endif

ALWAYS_INLINE void copy(const int wide, float *to, const float *from) {
    if (wide) *(v16 *)to = *(const v16 *)from;
    else *(v8 *)to = *(const v8 *)from, *(v8 *)(to + 8) = *(const v8 *)(from + 8);
}

ALWAYS_INLINE void add(const int wide, float *sums, float input, const float *w) {
    if (wide) *(v16 *)sums += input * *(const v16 *)w;
    else *(v8 *)sums += input * *(const v8 *)w, *(v8 *)(sums + 8) += input * *(const v8 *)(w + 8);
}

ALWAYS_INLINE void unpack(float *to, const int16_t *w) {
    *(v8 *)to = FLOATS(w), *(v8 *)(to + 8) = FLOATS(w + 8);
}
#else /* a compiler without vectors */
#define ALWAYS_INLINE static
#define FETCH(place) ((void)0)
ALWAYS_INLINE void copy(const int wide, float *to, const float *from) {
    for (int i = 0; i < WIDTH; i++) to[i] = from[i];
}

ALWAYS_INLINE void add(const int wide, float *sums, float input, const float *w) {
    for (int i = 0; i < WIDTH; i++) sums[i] += input * w[i];
}

ALWAYS_INLINE void unpack(float *to, const int16_t *w) {
    for (int i = 0; i < WIDTH; i++) to[i] = w[i];
}
#endif

/* Adds the products of `depth` inputs with `panels` panels of weights to `rows` rows of sums. wide, rows,
   panels and storage are constants where this is called, so that the compiler keeps the sums in registers.
   x_step, w_step: from one row of inputs, or panel of weights, to the next. */
ALWAYS_INLINE void tile(const int wide, const int rows, const int panels, const int storage,
                        const void *weights, size_t w_step, const float *x, size_t x_step, int depth,
                        float *sums, const size_t *slots) {
    float sum[TILE_ROWS][TILE_PANELS * WIDTH], unpacked[WIDTH];
    for (int r = 0; r < rows; r++)
        for (int p = 0; p < panels; p++) copy(wide, sum[r] + WIDTH * p, sums + slots[r] + WIDTH * p);
    for (int k = 0; k < depth; k++)
        for (int p = 0; p < panels; p++) {
            size_t at = w_step * (size_t)p + WIDTH * (size_t)k;
            const int16_t *shorts = (const int16_t *)weights + at;
            const float *floats = (const float *)weights + at;
            if (rows == 1 && storage == INT16) FETCH(shorts + WIDTH * AHEAD_IN_MEMORY);
            if (rows == 1 && storage != INT16) FETCH(floats + WIDTH * AHEAD_IN_MEMORY);
            if (storage == INT16) unpack(unpacked, shorts), floats = unpacked;
            for (int r = 0; r < rows; r++)
                add(wide, sum[r] + WIDTH * p, x[x_step * (size_t)r + (size_t)k], floats);
        }
    for (int r = 0; r < rows; r++)
        for (int p = 0; p < panels; p++) copy(wide, sums + slots[r] + WIDTH * p, sum[r] + WIDTH * p);
}

/* Calls `tile` with constants. Wide are only tiles that do not wait for memory. */
ALWAYS_INLINE void tile_of(const int wide, int storage, int rows, int panels, const void *weights,
                           size_t w_step, const float *x, size_t x_step, int depth, float *sums,
                           const size_t *slots) {
#define TILE(R, P, STORAGE) \
    tile(wide && (R) > 1 && (STORAGE) == FLOAT32, R, P, STORAGE, weights, w_step, x, x_step, depth, sums, \
         slots)
#define TILES(R, P, STORAGE)                        \
    if ((P) > 1 && panels > 1) TILE(R, P, STORAGE); \
    else TILE(R, 1, STORAGE);                       \
    break
    switch (storage == INT16 ? -rows : rows) {
        case -3: TILES(3, 2, INT16);
        case -2: TILES(2, 2, INT16);
        case -1: TILES(1, 4, INT16);
        case 1: TILES(1, 4, FLOAT32);
        case 2: TILES(2, wide ? 4 : 2, FLOAT32);
        case 3: TILES(3, wide ? 4 : 2, FLOAT32);
        case 4: TILES(4, wide ? 4 : 1, FLOAT32);
        case 5: TILES(5, wide ? 4 : 1, FLOAT32);
        default: TILES(6, wide ? 4 : 1, FLOAT32);
    }
#undef TILES
#undef TILE
}

/* Adds W x to the sums of each row x of inputs. slots: index in `sums` where each row's sums begin. */
ALWAYS_INLINE void multiply(const int wide, int storage, const void *weights, int panels, int inputs,
                            const float *x, int rows, float *sums, const size_t *slots) {
    float unpacked[TILE_PANELS * DEPTH * WIDTH];
    int tiles = (rows + TILE_ROWS - 1) / TILE_ROWS, unpacks = storage == INT16 && rows > 3;
    int many = rows == 1 || (wide && (storage == FLOAT32 || unpacks));
    int together = many ? TILE_PANELS : rows <= 3 && TILE_ROWS > 3 ? 2 : 1;
    /* Inputs are taken in stretches whose weights in a panel stay in the L1 cache. A single row uses each
       weight once. */
    int stretches = rows == 1 ? 1 : (inputs + DEPTH - 1) / DEPTH;
    size_t bytes = storage == INT16 ? sizeof(int16_t) : sizeof(float);
    for (int s = 0; s < stretches; s++) {
        int first = inputs * s / stretches, depth = inputs * (s + 1) / stretches - first;
        for (int panel = 0, count; panel < panels; panel += count) {
            count = panel + together <= panels ? together : 1;
            const char *from =
                (const char *)weights + bytes * WIDTH * ((size_t)panel * (size_t)inputs + (size_t)first);
            size_t w_step = WIDTH * (size_t)inputs;
            if (unpacks) { /* once, for all tiles */
                const int16_t *shorts = (const int16_t *)from;
                for (int p = 0; p < count; p++)
                    for (int i = 0; i < WIDTH * depth; i += WIDTH)
                        unpack(unpacked + WIDTH * DEPTH * p + i, shorts + w_step * (size_t)p + i);
                from = (const char *)unpacked;
                w_step = WIDTH * DEPTH;
            }
            for (int t = 0; t < tiles; t++) {
                int row = rows * t / tiles, own = rows * (t + 1) / tiles - row;
                size_t at[TILE_ROWS];
                for (int r = 0; r < own; r++) at[r] = slots[row + r] + WIDTH * (size_t)panel;
                tile_of(wide, unpacks ? FLOAT32 : storage, own, count, from, w_step,
                        x + (size_t)row * (size_t)inputs + first, (size_t)inputs, depth, sums, at);
            }
        }
    }
}

static void multiply_narrow(int storage, const void *weights, int panels, int inputs, const float *x,
                            int rows, float *sums, const size_t *slots) {
    multiply(0, storage, weights, panels, inputs, x, rows, sums, slots);
}

#if defined(__GNUC__) && defined(__AVX2__) && defined(__FMA__)
#include <cpuid.h>
#ifdef __clang__ /* which prefers half of a vector where it is asked to compile for AVX-512 */
__attribute__((target("avx512f"), min_vector_width(512)))
#else
__attribute__((target("avx512f")))
#endif
static void
multiply_wide(int storage, const void *weights, int panels, int inputs, const float *x, int rows, float *sums,
              const size_t *slots) {
    multiply(1, storage, weights, panels, inputs, x, rows, sums, slots);
}

/* Whether processor and system have AVX-512. zig has no __builtin_cpu_supports. */
static int can_be_wide(void) {
    unsigned a, b, c, d, low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    __cpuid_count(7, 0, a, b, c, d);
    return (low & 0xe0) == 0xe0 && (b & bit_AVX512F);
}
#else
#define multiply_wide multiply_narrow
static int can_be_wide(void) { return 0; }
#endif

typedef union {
    uint32_t bits;
    float value;
} number;

/* e^x for x <= 0, with a relative error of 2e-7: see `_exp_below_0` in predict.py. x is limited as bits: gcc
   would make a branch of a limit in floats, and would not vectorise the loop around it. */
static inline float exp_below_0(float given) {
    const number lowest = {.value = -87.0f};
    number limited = {.value = given}, power;
    limited.bits = limited.bits < lowest.bits ? limited.bits : lowest.bits;
    float x = limited.value;
    int n = (int)(x * 1.44269504f - 0.5f); /* rounds, because x is not above 0 */
    float r = (x - (float)n * 0.693359375f) + (float)n * 2.12194440e-4f, p = 1.0f + r * (1.0f / 6);
    p = 1.0f + r * (1.0f / 5) * p;
    p = 1.0f + r * (1.0f / 4) * p;
    p = 1.0f + r * (1.0f / 3) * p;
    p = 1.0f + r * (1.0f / 2) * p;
    p = 1.0f + r * p;
    power.bits = (uint32_t)(n + 127) << 23;
    return p * power.value;
}

static void elu(float *y, size_t count) {
    for (size_t i = 0; i < count; i++) {
        number below = {.value = y[i]};
        below.bits = below.bits >> 31 ? below.bits : 0;
        y[i] = (y[i] > 0 ? y[i] : 0) + (exp_below_0(below.value) - 1);
    }
}

/* Writes the last layer's outputs of all characters, in raw units, into out (C, outputs). shares: (C, sets)
   of each set; a set with the share 0 is not computed. in: (C, inputs) standardised. */
static void run_stack(const hobble *h, const stack *s, const float *shares, const float *in, float *out) {
    size_t count = (size_t)h->characters, sets = (size_t)s->sets, all = count * h->widest;
    size_t bytes = s->storage == INT16 ? sizeof(int16_t) : sizeof(float);
    /* inputs, outputs: of a layer. own: the inputs of the characters that use a set; sums: their products
       with it. */
    float *inputs = h->room, *outputs = inputs + all, *own = outputs + all, *sums = own + all;
    memcpy(inputs, in, count * (size_t)s->inputs[0] * sizeof *in);
    for (int layer = 0; layer < s->layers; layer++) {
        size_t ins = (size_t)s->inputs[layer], outs = (size_t)s->outputs[layer], panels = panels_of(outs),
               padded = panels * WIDTH;
        memset(outputs, 0, count * outs * sizeof *outputs);
        for (size_t k = 0; k < sets; k++) {
            int rows = 0;
            for (size_t c = 0; c < count; c++)
                if (shares[c * sets + k] != 0) {
                    h->members[rows] = (int)c;
                    h->slots[rows] = padded * (size_t)rows;
                    rows++;
                }
            if (rows == 0) continue;
            for (int i = 0; i < rows && rows < (int)count; i++)
                memcpy(own + (size_t)i * ins, inputs + (size_t)h->members[i] * ins, ins * sizeof *own);
            memset(sums, 0, (size_t)rows * padded * sizeof *sums);
            uint64_t start = s->weights_at[layer] + k * padded * ins;
            const float *x = rows == (int)count ? inputs : own;
            const char *weights = (const char *)s->weights + start * bytes;
            (h->wide ? multiply_wide : multiply_narrow)(s->storage, weights, (int)panels, (int)ins, x, rows,
                                                        sums, h->slots);
            const float *factors = s->factors[layer] + k * outs, *biases = s->biases[layer] + k * outs;
            for (int i = 0; i < rows; i++) {
                float share = shares[(size_t)h->members[i] * sets + k],
                      *to = outputs + (size_t)h->members[i] * outs;
                const float *sum = sums + (size_t)i * padded;
                for (size_t o = 0; o < outs; o++) to[o] += share * (sum[o] * factors[o] + biases[o]);
            }
        }
        if (layer < s->layers - 1) elu(outputs, count * outs);
        float *swapped = inputs;
        inputs = outputs;
        outputs = swapped;
    }
    size_t outs = (size_t)s->outputs[s->layers - 1];
    for (size_t c = 0; c < count; c++)
        for (size_t o = 0; o < outs; o++) out[c * outs + o] = inputs[c * outs + o] * s->std[o] + s->mean[o];
}

/* Writes the shares (points) of the points around a phase; see `write_phase_shares` in predict.py. */
static void phase_shares(int blended, int points, double phase, float *shares) {
    double wrapped = phase == 1 ? phase : phase - floor(phase);
    double scaled = blended == 1 ? (double)((float)wrapped * (float)points) : wrapped * points;
    int first = (int)scaled < points - 1 ? (int)scaled : points - 1;
    double t = scaled - first;
    for (int k = 0; k < points; k++) shares[k] = 0;
    if (blended == 1) {
        shares[first] = 1;
    } else if (blended == 2) {
        shares[first] = (float)(1 - t);
        shares[(first + 1) % points] = (float)t;
    } else { /* the cubic spline of Catmull and Rom */
        shares[(first - 1 + points) % points] = (float)(((2 - t) * t - 1) * t / 2);
        shares[first] = (float)(((3 * t - 5) * t * t + 2) / 2);
        shares[(first + 1) % points] = (float)(((4 - 3 * t) * t + 1) * t / 2);
        shares[(first + 2) % points] = (float)((t - 1) * t * t / 2);
    }
}

/* Turns logits (count) into shares in place, by a softmax; a negligible share becomes 0. */
static void softmax(float *logits, int count) {
    float most = logits[0], total = 0;
    for (int k = 1; k < count; k++) most = logits[k] > most ? logits[k] : most;
    for (int k = 0; k < count; k++) {
        float below = logits[k] - most;
        total += logits[k] = exp_below_0(below > -87 ? below : -87); /* it may be no number */
    }
    for (int k = 0; k < count; k++) {
        float share = logits[k] / total;
        logits[k] = share > NEGLIGIBLE_SHARE ? share : 0;
    }
}

/* Local phases: each foot and hand has a phase of its own, a vector, which the network predicts with the
   pose. memory: ROW, which is 1 once the character was shown, then the vectors (LATENT, 2) and the rotations
   (JOINTS, 3) that were predicted. models/local/predictor.py explains it. Writes both into the input row x. */
static void write_remembered(const model *m, double *memory, float *x) {
    float *at = x + m->x_first[X_TERRAIN] + 3 * m->samples;
    for (int i = 0; i < remembered_count(m); i++) {
        if (memory[ROW] != 1) memory[ROW + 1 + i] = m->remembered[i];
        at[i] = (float)memory[ROW + 1 + i];
    }
    memory[ROW] = 1;
}

/* The local phases of the next frame, from the prediction y, and its rotations. */
static void remember(const model *m, double *memory, const float *y) {
    int count = m->size[LATENT];
    const float *predicted = y + m->y_joints + 9 * m->size[JOINTS], *change = predicted + 2 * count;
    for (int i = 0; i < count; i++) {
        double *vector = memory + ROW + 1 + 2 * i, x = predicted[2 * i], z = predicted[2 * i + 1];
        double cosine = cos(2 * PI * change[i]), sine = sin(2 * PI * change[i]);
        double mean_x = vector[0] * cosine - vector[1] * sine + x;
        double mean_z = vector[0] * sine + vector[1] * cosine + z;
        double length = sqrt(mean_x * mean_x + mean_z * mean_z);
        double factor = length > 1e-6 ? sqrt(x * x + z * z) / length : 0;
        vector[0] = factor > 0 ? mean_x * factor : x;
        vector[1] = factor > 0 ? mean_z * factor : z;
    }
    for (int i = 0; i < 3 * m->size[JOINTS]; i++)
        memory[ROW + 1 + 2 * count + i] = y[m->y_joints + 6 * m->size[JOINTS] + i];
}

/* Standardises the columns of X that the network reads, and writes Y of all characters. */
static void predict_blend(hobble *h) {
    const model *m = &h->model;
    int local = m->size[FORM] == GATED ? m->size[LATENT] : 0;
    size_t inputs = (size_t)m->size[INPUTS], extra = (size_t)m->size[EXTRA], sets = (size_t)m->size[SETS];
    for (int c = 0; c < h->characters; c++) {
        float *x = h->x + (size_t)c * (size_t)m->size[X_SIZE];
        float *z = h->z + (size_t)c * (inputs + extra);
        if (local) write_remembered(m, h->state[c].memory, x);
        for (size_t i = 0; i < inputs; i++) z[i] = (x[m->inputs[i]] - m->x_mean[i]) * m->x_inverse[i];
        if (extra) {
            z[inputs] = (float)sin(2 * PI * h->state[c].phase);
            z[inputs + 1] = (float)cos(2 * PI * h->state[c].phase);
        }
        if (m->size[FORM] == FIXED) {
            h->shares[c] = 1;
        } else if (m->size[FORM] == PHASED) {
            phase_shares(m->size[BLENDED], m->size[SETS], h->state[c].phase, h->shares + (size_t)c * sets);
        } else {
            float *gate = h->gate_inputs + (size_t)c * (size_t)m->size[GATE_INPUTS];
            for (int i = 0; i < m->size[GATE_INPUTS]; i++) gate[i] = z[m->gate_columns[i]];
            h->shares[c] = 1; /* of the gate's only set */
        }
    }
    if (m->size[FORM] == GATED) {
        /* The gate's own shares are overwritten by its outputs only at the end, so one array serves both. */
        run_stack(h, &m->gate, h->shares, h->gate_inputs, h->shares);
        for (int c = 0; c < h->characters; c++) softmax(h->shares + (size_t)c * sets, m->size[SETS]);
    }
    run_stack(h, &m->network, h->shares, h->z, h->y);
    for (int c = 0; local && c < h->characters; c++)
        remember(m, h->state[c].memory, h->y + (size_t)c * (size_t)m->size[Y_SIZE]);
}

/* ---- 4. Motion matching ----------------------------------------------------------------------------------

   Plays recorded frames; a search every few frames chooses where to go on. At a transition, the differences
   in pose and velocity become offsets, which decay like a critically damped spring.
   models/matching/network.py explains it. Learned motion matching has networks in the place of frames. */

/* Unpacks a recorded frame into y. */
static void read_frame(const model *m, int64_t row, double *y) {
    size_t width = (size_t)m->size[Y_SIZE], at = (size_t)row * width;
    for (size_t i = 0; i < width; i++)
        y[i] = m->size[STORAGE] == INT16 ? (float)((const int16_t *)m->frames)[at + i] * m->frame_scale[i]
                                         : ((const float *)m->frames)[at + i] * m->frame_scale[i];
}

/* The squared distance of a frame's features from the query. Stops adding above `most`. */
static double feature_distance(const model *m, const float *query, int64_t row, double most) {
    const float *features = m->features + (size_t)row * (size_t)m->size[FEATURES];
    double sum = 0;
    for (int i = 0; i < m->size[FEATURES] && sum <= most; i++) {
        double difference = (double)query[i] - features[i];
        sum += difference * difference;
    }
    return sum;
}

/* Finds the smallest and largest features in each block of BLOCK frames, for nearest_row. */
static void measure_blocks(hobble *h) {
    const model *m = &h->model;
    size_t n = (size_t)m->size[FEATURES], rows = (size_t)m->size[ROWS];
    for (size_t row = 0; row < rows; row++) {
        float *low = h->block_low + row / BLOCK * n, *high = h->block_high + row / BLOCK * n;
        const float *features = m->features + row * n;
        for (size_t i = 0; i < n; i++) {
            if (row % BLOCK == 0 || features[i] < low[i]) low[i] = features[i];
            if (row % BLOCK == 0 || features[i] > high[i]) high[i] = features[i];
        }
    }
}

/* The findable frame nearest to the query, or -1 if none is nearer than `most`, a squared distance. A block
   of frames is skipped if even the box around its features is too far away. */
static int64_t nearest_row(const hobble *h, double most) {
    const model *m = &h->model;
    int n = m->size[FEATURES], rows = m->size[ROWS];
    int64_t best = -1;
    for (int from = 0; from < rows; from += BLOCK) {
        const float *low = h->block_low + (size_t)(from / BLOCK) * (size_t)n,
                    *high = h->block_high + (size_t)(from / BLOCK) * (size_t)n;
        double sum = 0;
        for (int i = 0; i < n && sum <= most; i++) {
            double outside = clamp(h->query[i], low[i], high[i]) - (double)h->query[i];
            sum += outside * outside;
        }
        if (sum > most) continue;
        for (int row = from; row < rows && row < from + BLOCK; row++) {
            if (!m->findable[row]) continue;
            double distance = feature_distance(m, h->query, row, most);
            if (distance < most) {
                most = distance;
                best = row;
            }
        }
    }
    return best;
}

/* The frame to show for the input row x. following: the next frame of the run, or -1 if it ends. */
static int64_t search_row(hobble *h, const float *x, int64_t following) {
    const model *m = &h->model;
    for (int i = 0; i < m->size[FEATURES]; i++)
        h->query[i] = x[m->feature_columns[i]] * m->feature_weights[i];
    int64_t found =
        nearest_row(h, following < 0 ? INFINITY : feature_distance(m, h->query, following, INFINITY));
    if (following >= 0
        && (found < 0 || (found - following <= SURROUNDING && following - found <= SURROUNDING)))
        return following;
    for (int64_t row = 0; found < 0; row++) /* features that overflow: no distance was finite */
        if (m->findable[row]) found = row;
    return found;
}

/* The quaternion q of the rotation vector v (3), an axis times half the angle. */
static void quaternion_of(const double *v, double *q) {
    double half_angle = length3(v[0], v[1], v[2]),
           scale = half_angle > 1e-8 ? sin(half_angle) / half_angle : 1;
    q[0] = cos(half_angle);
    for (int i = 0; i < 3; i++) q[i + 1] = v[i] * scale;
}

/* The rotation vector v of the product a b, the shorter way round. */
static void vector_of_product(const double *a, const double *b, double *v) {
    double w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
           x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    double y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
           z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
    double sign = w < 0 ? -1 : 1, length = length3(x, y, z),
           scale = sign * (length > 1e-8 ? atan2(length, sign * w) / length : 1);
    v[0] = x * scale;
    v[1] = y * scale;
    v[2] = z * scale;
}

/* The rotation vector v that leads from the rotation vector `earlier` to `now`. */
static void vector_between(const double *earlier, const double *now, double *v) {
    double q[4], p[4];
    quaternion_of(now, q);
    quaternion_of(earlier, p);
    for (int i = 1; i < 4; i++) p[i] = -p[i];
    vector_of_product(q, p, v);
}

/* Adds the pose `old` minus the pose `now`, rows of Y, to the offsets of positions, velocities, rotations. */
static void add_difference(const model *m, double *offsets, const double *old, const double *now) {
    int joints = m->size[JOINTS];
    for (int j = 0; j < joints; j++) {
        double *offset = offsets + OFFSETS_PER_JOINT * j, turn[3], q[4], p[4];
        int position = m->y_joints + 3 * j, velocity = position + 3 * joints,
            rotation = velocity + 3 * joints;
        for (int i = 0; i < 3; i++) {
            offset[i] += old[position + i] - now[position + i];
            offset[3 + i] += old[velocity + i] - now[velocity + i];
        }
        vector_between(now + rotation, old + rotation, turn);
        quaternion_of(offset + 6, p);
        quaternion_of(turn, q);
        vector_of_product(p, q, offset + 6);
    }
}

/* Adds to the offsets the difference between two poses: the one that would have come next, minus that of
   `row`. If the run has ended, the last pose shown takes the place of the next one. */
static void start_transition(hobble *h, double *offsets, int64_t before, int64_t following, int64_t row) {
    const model *m = &h->model;
    int joints = m->size[JOINTS];
    size_t width = (size_t)m->size[Y_SIZE];
    double *old = h->rows_old, *now = old + width, *before_old = now + width,
           *before_now = before_old + width;
    read_frame(m, following >= 0 ? following : before, old);
    read_frame(m, row, now);
    add_difference(m, offsets, old, now);
    if (following < 0) return;
    read_frame(m, before, before_old);
    read_frame(m, row > 0 ? row - 1 : 0, before_now);
    for (int j = 0; j < joints; j++) {
        double *speed = offsets + OFFSETS_PER_JOINT * j + 9, turn[3];
        int rotation = m->y_joints + 6 * joints + 3 * j;
        vector_between(before_old + rotation, old + rotation, turn);
        for (int i = 0; i < 3; i++) speed[i] += turn[i];
        vector_between(before_now + rotation, now + rotation, turn);
        for (int i = 0; i < 3; i++) speed[i] -= turn[i];
    }
}

/* What to add to the change of a phase so that it approaches the phase `wanted`. */
static float pull(double wanted, double phase) {
    double lag = wanted - phase;
    lag -= floor(lag + 0.5); /* at most half a cycle, forwards or backwards */
    return (float)clamp(lag, -FASTEST_PULL, FASTEST_PULL);
}

/* Advances the offsets by a frame and adds them to the pose in y (Y). */
static void add_offsets(const model *m, double *offsets, float *y) {
    double damping = 2 * log(2.0) / m->number[HALFLIFE], fade = exp(-damping);
    int joints = m->size[JOINTS];
    for (int k = 0; k < OFFSETS_PER_JOINT * joints; k += 6) /* three offsets, then their three speeds */
        for (int i = k; i < k + 3; i++) {
            double j = offsets[i + 3] + offsets[i] * damping;
            offsets[i] = fade * (offsets[i] + j);
            offsets[i + 3] = fade * (offsets[i + 3] - j * damping);
        }
    for (int j = 0; j < joints; j++) {
        const double *offset = offsets + OFFSETS_PER_JOINT * j;
        float *position = y + m->y_joints + 3 * j, *velocity = position + 3 * joints,
              *rotation = velocity + 3 * joints;
        double q[4], p[4], turn[3] = {rotation[0], rotation[1], rotation[2]};
        quaternion_of(offset + 6, q);
        quaternion_of(turn, p);
        vector_of_product(q, p, turn);
        for (int i = 0; i < 3; i++) {
            position[i] += (float)offset[i];
            velocity[i] += (float)offset[3 + i];
            rotation[i] = (float)turn[i];
        }
    }
}

/* Writes Y of all characters, and updates their memories. */
static void predict_matching(hobble *h) {
    const model *m = &h->model;
    for (int c = 0; c < h->characters; c++) {
        const float *x = h->x + (size_t)c * (size_t)m->size[X_SIZE];
        float *y = h->y + (size_t)c * (size_t)m->size[Y_SIZE];
        double *memory = h->state[c].memory, *unpacked = h->rows_old;
        int valid = memory[ROW] >= 1 && memory[ROW] <= m->size[ROWS];
        int64_t before = valid ? (int64_t)memory[ROW] - 1 : -1;
        int64_t following = valid && m->remaining[before] > 0 ? before + 1 : -1;
        int due = following < 0 || !(memory[SINCE] + 1 < m->size[EVERY]);
        int64_t row = due ? search_row(h, x, following) : following;
        if (before < 0) memset(memory, 0, (size_t)h->memory_size * sizeof *memory);
        else if (row != following) start_transition(h, memory + OFFSETS, before, following, row);
        read_frame(m, row, unpacked);
        for (int i = 0; i < m->size[Y_SIZE]; i++) y[i] = (float)unpacked[i];
        if (before >= 0) {
            add_offsets(m, memory + OFFSETS, y);
            y[3] += pull(m->phases[row], h->state[c].phase);
        }
        memory[ROW] = (double)(row + 1);
        memory[SINCE] = due ? 0 : memory[SINCE] + 1;
    }
}

/* Writes the features (FEATURES) that the input row x wishes for, standardised. */
static void write_wish(const model *m, const float *x, float *wish) {
    for (int i = 0; i < m->size[FEATURES]; i++) {
        float value = x[m->feature_columns[i]] * m->feature_weights[i];
        value = value > m->feature_low[i] ? value : m->feature_low[i];
        value = value < m->feature_high[i] ? value : m->feature_high[i];
        wish[i] = (value - m->feature_mean[i]) * m->feature_inverse[i];
    }
}

/* The squared distance of a state's features from the wish. */
static float wish_distance(const model *m, const float *wish, const float *state) {
    float sum = 0;
    for (int i = 0; i < m->size[FEATURES]; i++) {
        float difference = (wish[i] - state[i]) * m->feature_std[i];
        sum += difference * difference;
    }
    return sum;
}

enum { NEW, SHOWN, JUMPING }; /* values of memory[ROW] in learned motion matching */

/* Where a search is due, finds the state for the wish and goes on from there if it is nearer. states, found:
   (C, FEATURES + LATENT), wishes: (C, FEATURES) of all characters; the last two are written. Marks a jump
   with JUMPING. Returns whether any character jumps. */
static int search_states(hobble *h, float *states, float *found, float *wishes) {
    const model *m = &h->model;
    size_t n = (size_t)m->size[FEATURES], size = n + (size_t)m->size[LATENT],
           x_size = (size_t)m->size[X_SIZE];
    int jumps = 0, due = 0;
    for (int c = 0; c < h->characters; c++) due |= h->state[c].memory[SINCE] == 0;
    if (!due) return 0;
    for (size_t c = 0; c < (size_t)h->characters; c++) write_wish(m, h->x + c * x_size, wishes + c * n);
    run_stack(h, &m->projector, h->shares, wishes, found);
    for (size_t c = 0; c < (size_t)h->characters; c++) {
        double *memory = h->state[c].memory;
        const float *wish = wishes + c * n;
        float *state = states + c * size;
        if (memory[SINCE] != 0) continue;
        if (memory[ROW] == SHOWN) {
            if (!(wish_distance(m, wish, found + c * size) < wish_distance(m, wish, state))) continue;
            memory[ROW] = JUMPING;
            jumps = 1;
        }
        memcpy(state, found + c * size, size * sizeof *state);
    }
    return jumps;
}

/* Writes Y of all characters by learned motion matching, and updates their memories: ROW, SINCE, the state,
   which is features and latent numbers, and the offsets. models/learned/network.py explains it. */
static void predict_learned(hobble *h) {
    const model *m = &h->model;
    size_t count = (size_t)h->characters, n = (size_t)m->size[FEATURES], size = n + (size_t)m->size[LATENT],
           width = (size_t)m->size[Y_SIZE], shown_width = width + 2;
    float *states = h->states, *following = states + count * size, *found = following + count * size,
          *wishes = found + count * size, *shown = wishes + count * n,
          *expected = shown + count * shown_width;
    for (size_t c = 0; c < count; c++) {
        double *memory = h->state[c].memory;
        int due = memory[ROW] != SHOWN || !(memory[SINCE] + 1 < m->size[EVERY]);
        if (memory[ROW] != SHOWN) memset(memory, 0, (size_t)h->memory_size * sizeof *memory);
        memory[SINCE] = due ? 0 : memory[SINCE] + 1;
        h->shares[c] = 1;
        for (size_t i = 0; i < size; i++) states[c * size + i] = (float)memory[OFFSETS + i];
    }
    run_stack(h, &m->stepper, h->shares, states, found);
    for (size_t i = 0; i < count * size; i++) following[i] = states[i] += found[i];
    int jumps = search_states(h, states, found, wishes);
    run_stack(h, &m->network, h->shares, states, shown);
    if (jumps) run_stack(h, &m->network, h->shares, following, expected);
    for (size_t c = 0; c < count; c++) {
        double *memory = h->state[c].memory, *offsets = memory + OFFSETS + size, *old = h->rows_old,
               *now = old + width;
        const float *pose = shown + c * shown_width;
        float *y = h->y + c * width;
        for (size_t i = 0; i < width; i++) {
            y[i] = pose[i];
            now[i] = pose[i];
            old[i] = expected[c * shown_width + i];
        }
        if (memory[ROW] == JUMPING) add_difference(m, offsets, old, now);
        add_offsets(m, offsets, y);
        if (memory[ROW] != NEW)
            y[3] += pull(atan2(pose[width], pose[width + 1]) / (2 * PI), h->state[c].phase);
        for (size_t i = 0; i < size; i++) memory[OFFSETS + i] = states[c * size + i];
        memory[ROW] = SHOWN;
    }
}

/* ---- 5. The trajectory and the caller's target -----------------------------------------------------------

   A trajectory has an entry for each frame; the first half is past, and entry `middle` is the present. */

static double yaw_of(const double *direction) { return atan2(direction[0], direction[1]); }

/* The highest speeds (GAITS) that the values of one channel allow, cm a frame; INFINITY if all are 0. */
static void channel_speeds(const channel *one, const double *values, double *highest) {
    for (int g = 0; g < GAITS; g++) {
        const double *speeds = one->speeds + g * one->columns * one->levels;
        double healthy = 0, lost = 0, lowest = INFINITY;
        int above = 0;
        for (int l = 0; l < one->columns; l++) healthy = larger(healthy, speeds[l * one->levels]);
        for (int l = 0; l < one->columns; l++) {
            double value = values[one->first + l];
            if (!(value > 0)) continue;
            int below = 0;
            while (below < one->levels - 2 && one->level[below + 1] <= value) below++;
            const double *speed = speeds + l * one->levels + below;
            double weight = (value - one->level[below]) / (one->level[below + 1] - one->level[below]);
            double limit = speed[0] + weight * (speed[1] - speed[0]);
            lowest = smaller(lowest, limit);
            lost += pow(1 - smaller(limit / healthy, 1), SUM_NORM);
            above++;
        }
        highest[g] = above > 1 ? smaller(lowest, healthy * larger(1 - pow(lost, 1 / SUM_NORM), SLOWEST_SHARE))
                               : lowest;
    }
}

/* Limits the target's speed, and its gait, to what a body with these channel values can reach: see bounds.py.
 */
static void limit_target(const model *m, const double *values, goal *target) {
    double allowed[GAITS], share[GAITS], of_channel[GAITS];
    const channel *first = NULL;
    for (int g = 0; g < GAITS; g++) allowed[g] = INFINITY, share[g] = 1;
    for (int i = 0; i < m->size[CHANNELS]; i++) {
        const channel *one = &m->channels[i];
        if (!one->levels) continue;
        if (!first) first = one;
        channel_speeds(one, values, of_channel);
        for (int g = 0; g < GAITS; g++) {
            allowed[g] = smaller(allowed[g], of_channel[g]);
            if (first->usual[g] > 0) share[g] *= smaller(1, of_channel[g] / first->usual[g]);
        }
    }
    if (!first) return;
    double total = 0, weighted = 0, usual = 0, hurry = 1;
    for (int g = 0; g < GAITS; g++)
        if (allowed[g] < first->usual[g]) allowed[g] = first->usual[g] * share[g];
    if (allowed[m->jog] < LAME_BELOW) {
        hurry += (HURRY_FACTOR - 1) * target->gait[m->jog];
        target->gait[m->walk] += target->gait[m->jog];
        target->gait[m->jog] = 0;
    }
    for (int g = 0; g < GAITS; g++)
        if (g != m->stand && target->gait[g] > 0) {
            total += target->gait[g];
            weighted += target->gait[g] * allowed[g];
            usual += target->gait[g] * first->usual[g];
        }
    double highest = total > 0 ? hurry * weighted / larger(total, 1e-9) : INFINITY;
    /* A target below the usual speed is slowed by the same share as the usual speed would be. */
    double asked = length2(target->velocity[0], target->velocity[1]),
           usual_speed = usual / larger(total, 1e-9);
    double held = smaller(1, highest / larger(larger(asked, usual_speed), 1e-9));
    target->velocity[0] *= held;
    target->velocity[1] *= held;
}

/* Whether a standing character that faces `heading` has to step on the spot to face `direction`. */
static int steps_around(const double *heading, const double *direction) {
    double across = direction[0] * heading[1] - direction[1] * heading[0],
           along = direction[0] * heading[0] + direction[1] * heading[1];
    return fabs(atan2(across, along)) > TURN_IN_PLACE;
}

/* Converts the caller's target into velocity, facing, strafe share and gait shares. Returns HOBBLE_OK or an
   error. */
static int read_target(const model *m, const character *c, const hobble_target *given, goal *target) {
    double x = given->velocity[0], z = given->velocity[1], speed = length2(x, z), fx = given->facing[0],
           fz = given->facing[1];
    int gait = given->gait, moves = speed >= STILL;
    if (!(speed <= FASTEST_TARGET) || !(fabs(fx) < INFINITY) || !(fabs(fz) < INFINITY))
        return HOBBLE_BAD_TARGET;
    if (gait < HOBBLE_SHARES || gait >= GAITS) return HOBBLE_BAD_TARGET;
    target->velocity[0] = x;
    target->velocity[1] = z;
    if (fx == 0 && fz == 0) {
        target->strafe = 0;
        target->facing[0] = moves ? x : c->smoothed_direction[0];
        target->facing[1] = moves ? z : c->smoothed_direction[1];
    } else {
        double aside = fabs(wrap(atan2(x, z) - atan2(fx, fz)));
        target->strafe = moves ? smaller(1, aside / STRAFE_FROM) : 1;
        target->facing[0] = fx;
        target->facing[1] = fz;
    }
    for (int g = 0; g < GAITS; g++) {
        target->gait[g] = gait == HOBBLE_SHARES ? given->shares[g] : 0;
        if (!(target->gait[g] >= 0 && target->gait[g] <= 1)) return HOBBLE_BAD_TARGET;
    }
    if (gait == HOBBLE_SHARES) return HOBBLE_OK;
    if (gait == HOBBLE_BY_SPEED) gait = speed >= JOG_FROM ? m->jog : m->walk;
    if (!moves) {
        int steps = steps_around(c->direction[m->length / 2], target->facing);
        target->gait[steps ? m->walk : m->stand] = 1;
        if (gait != m->crouch) return HOBBLE_OK;
    }
    target->gait[gait] = 1;
    return HOBBLE_OK;
}

/* The velocity (x, z) to ask the network for, so that the character reaches the target (x, z): see
   `_ask_velocity` in trajectory.py. A share of the present error is added, and a steady error is integrated
   in `correction`, from the error of the target `earlier`. */
static void ask_velocity(double steering, const double (*position)[2], int middle, double *correction,
                         double *earlier, double *asked) {
    int span = middle / 2;
    double x = asked[0], z = asked[1], speed = length2(x, z);
    double lack_x = x - (position[middle][0] - position[middle - span][0]) / span;
    double lack_z = z - (position[middle][1] - position[middle - span][1]) / span;
    double more_x = steering * lack_x, more_z = steering * lack_z;
    earlier[0] += (x - earlier[0]) / ((span + 1) / 2.0);
    earlier[1] += (z - earlier[1]) / ((span + 1) / 2.0);
    lack_x += earlier[0] - x;
    lack_z += earlier[1] - z;
    if (speed < STILL) {
        correction[0] = correction[1] = 0;
    } else {
        more_x += correction[0] * x + correction[1] * z;
        more_z += correction[0] * z - correction[1] * x;
        /* Do not integrate while the character turns or starts: that error goes away by itself. */
        if (lack_x * lack_x + lack_z * lack_z < CORRECTION_WITHIN * speed * (CORRECTION_WITHIN * speed)) {
            double rate = steering * CORRECTION_RATE / (speed * speed);
            correction[0] =
                clamp(correction[0] + rate * (lack_x * x + lack_z * z), -MOST_CORRECTION, MOST_CORRECTION);
            correction[1] =
                clamp(correction[1] + rate * (lack_x * z - lack_z * x), -MOST_CORRECTION, MOST_CORRECTION);
        }
    }
    double limit = smaller(1, STEERING_LIMIT * speed / larger(length2(more_x, more_z), 1e-6));
    asked[0] = x + more_x * limit;
    asked[1] = z + more_z * limit;
}

/* Moves the smoothed target toward the caller's, and the present gait toward the target gait. */
static void follow_target(const model *m, character *c, const goal *target) {
    int middle = m->length / 2;
    double steering = m->number[STEERING], asked[2] = {target->velocity[0], target->velocity[1]},
           goal_yaw = yaw_of(target->facing);
    if (steering > 0) {
        if (length2(asked[0], asked[1]) >= STILL) {
            double turn = wrap(goal_yaw - yaw_of(c->direction[middle])),
                   room = larger(FURTHEST_TURN - fabs(turn), 0);
            goal_yaw += clamp(0.5 * steering * turn, -room, room);
        }
        ask_velocity(steering, (const double (*)[2])c->position, middle, c->correction, c->earlier, asked);
    }
    for (int i = 0; i < 2; i++) c->smoothed_velocity[i] += TARGET_MIX * (asked[i] - c->smoothed_velocity[i]);
    double yaw = yaw_of(c->smoothed_direction);
    yaw += TARGET_MIX * wrap(goal_yaw - yaw);
    c->smoothed_direction[0] = sin(yaw);
    c->smoothed_direction[1] = cos(yaw);
    c->strafe += TARGET_MIX * (target->strafe - c->strafe);
    for (int g = 0; g < GAITS; g++) c->gait[middle][g] += GAIT_MIX * (target->gait[g] - c->gait[middle][g]);
}

/* Bends the predicted future toward the smoothed target, more at later times: see trajectory.py. */
static void blend_future(hobble *h, character *c) {
    int length = h->model.length, middle = length / 2;
    double *shares = h->powers, *facing_shares = shares + length, goal_yaw = yaw_of(c->smoothed_direction);
    if (c->strafe
        != h->powers_strafe) { /* powers take long, and most characters have the same share of strafing */
        h->powers_strafe = c->strafe;
        for (int i = middle + 1; i < length; i++) {
            double remaining = 1 - (double)(i - middle) / middle;
            shares[i] = 1 - pow(remaining, 0.5 + 0.5 * c->strafe);
            facing_shares[i] = 1 - pow(remaining, 2 - 1.5 * c->strafe);
        }
    }
    double old[2] = {c->position[middle][0], c->position[middle][1]};
    for (int i = middle + 1; i < length; i++) {
        for (int k = 0; k < 2; k++) {
            double step = c->position[i][k] - old[k];
            old[k] = c->position[i][k];
            c->position[i][k] = c->position[i - 1][k] + step + shares[i] * (c->smoothed_velocity[k] - step);
        }
        double yaw = yaw_of(c->direction[i]);
        yaw += facing_shares[i] * wrap(goal_yaw - yaw);
        c->direction[i][0] = sin(yaw);
        c->direction[i][1] = cos(yaw);
        memcpy(c->gait[i], c->gait[middle], sizeof c->gait[i]);
    }
}

/* Writes the points (samples, 3, 2) where the ground is looked up: left of the path, on it, right of it. */
static void sample_points(const model *m, const character *c, double *points) {
    double side = m->number[SIDE];
    for (int s = 0; s < m->samples; s++, points += 6) {
        const double *at = c->position[s * m->size[STEP]], *facing = c->direction[s * m->size[STEP]];
        for (int k = 0; k < 3; k++) {
            points[2 * k] = at[0] + (1 - k) * side * facing[1];
            points[2 * k + 1] = at[1] - (1 - k) * side * facing[0];
        }
    }
}

/* ---- 6. Rows of the network ------------------------------------------------------------------------------
 */

/* Writes the state into the input row x: trajectory, gait, ground, the last pose, and the channel values. */
static void write_inputs(const model *m, const character *c, float *x) {
    int middle = m->length / 2, samples = m->samples;
    const int32_t *first = m->x_first;
    const double *origin = c->position[middle]; /* the trajectory is relative to the present root */
    double cosine = c->direction[middle][1], sine = c->direction[middle][0];
    for (int s = 0; s < samples; s++) {
        int i = s * m->size[STEP];
        double dx = c->position[i][0] - origin[0], dz = c->position[i][1] - origin[1];
        x[first[X_POSITION] + s] = (float)(dx * cosine - dz * sine);
        x[first[X_POSITION] + samples + s] = (float)(dx * sine + dz * cosine);
        dx = c->direction[i][0];
        dz = c->direction[i][1];
        x[first[X_DIRECTION] + s] = (float)(dx * cosine - dz * sine);
        x[first[X_DIRECTION] + samples + s] = (float)(dx * sine + dz * cosine);
        for (int g = 0; g < GAITS; g++) x[first[X_GAIT] + g * samples + s] = (float)c->gait[i][g];
        for (int side = 0; side < 3; side++)
            x[first[X_TERRAIN] + side * samples + s] = (float)(c->ground[s][side] - c->root_height);
    }
    origin =
        c->position[middle - 1]; /* the pose is still that of the frame before, and relative to its root */
    cosine = c->direction[middle - 1][1];
    sine = c->direction[middle - 1][0];
    for (int j = 0; j < m->size[JOINTS]; j++) {
        float *position = x + first[X_JOINTS] + 3 * j, *velocity = x + first[X_VELOCITIES] + 3 * j;
        double dx = c->joint_position[j][0] - origin[0], dz = c->joint_position[j][2] - origin[1];
        position[0] = (float)(dx * cosine - dz * sine);
        position[1] = (float)(c->joint_position[j][1] - c->root_height);
        position[2] = (float)(dx * sine + dz * cosine);
        dx = c->joint_velocity[j][0];
        dz = c->joint_velocity[j][2];
        velocity[0] = (float)(dx * cosine - dz * sine);
        velocity[1] = (float)c->joint_velocity[j][1];
        velocity[2] = (float)(dx * sine + dz * cosine);
    }
    for (int k = 0; k < m->size[COLUMNS]; k++) { /* see read_through_curve in channel.py */
        double share = c->values[k] * c->shown / m->highest[k];
        x[m->x_channels[k]] = (float)(m->highest[k] * pow(share, m->exponents[k]));
    }
}

/* Limits a row to the range of the training data. An unsound number becomes the middle of its range. */
static void limit_row(float *row, const float *low, const float *high, int count) {
    int unsound = 0;
    for (int k = 0; k < count; k++) unsound |= !(fabsf(row[k]) < (float)LARGEST_SOUND);
    for (int k = 0; k < count && unsound; k++)
        if (!(fabsf(row[k]) < (float)LARGEST_SOUND)) row[k] = 0.5f * (low[k] + high[k]);
    for (int k = 0; k < count; k++) {
        float value = row[k] > low[k] ? row[k] : low[k];
        row[k] = value < high[k] ? value : high[k];
    }
}

/* Moves a joint toward the predicted position `to`, by at most `fastest` cm. The mean of the predicted
   position and the old position plus the predicted velocity is taken. climbed: change of the ground's height,
   which does not count. */
static void move_joint(double *place, const double *velocity, const double *to, double climbed,
                       double fastest) {
    double step[3];
    for (int i = 0; i < 3; i++) step[i] = CARRIED_SHARE * (place[i] + velocity[i] + to[i]) - place[i];
    double moved = length3(step[0], step[1] - climbed, step[2]);
    if (moved > fastest) {
        step[0] *= fastest / moved;
        step[1] = climbed + (step[1] - climbed) * fastest / moved;
        step[2] *= fastest / moved;
    }
    for (int i = 0; i < 3; i++) place[i] += step[i];
}

/* Turns a joint's world rotation to the predicted one, by at most FASTEST_TURN. v: the predicted axis times
   half the angle, relative to the root. half_cos, half_sin: of half the root's yaw. */
static void turn_joint(double *rotation, const float *v, double half_cos, double half_sin) {
    double half = length3(v[0], v[1], v[2]), scale = half > 1e-8 ? sin(half) / half : 1;
    double w = cos(half), x = v[0] * scale, y = v[1] * scale, z = v[2] * scale;
    double to[4] = {half_cos * w - half_sin * y, half_cos * x + half_sin * z, half_cos * y + half_sin * w,
                    half_cos * z - half_sin * x};
    double dot = rotation[0] * to[0] + rotation[1] * to[1] + rotation[2] * to[2] + rotation[3] * to[3],
           keep = 0, take = 1;
    if (fabs(dot) < cos(FASTEST_TURN / 2)) { /* along the shorter way (slerp) */
        half = acos(fabs(dot));
        keep = sin(half - FASTEST_TURN / 2) / sin(half);
        take = sin(FASTEST_TURN / 2) / sin(half) * (dot >= 0 ? 1 : -1);
    }
    for (int i = 0; i < 4; i++) rotation[i] = keep * rotation[i] + take * to[i];
}

/* Turns the prediction y into the pose before foot placement, and into the pose to draw. */
static void write_pose(const model *m, character *c, const float *y) {
    int middle = m->length / 2, joints = m->size[JOINTS];
    double sine = c->direction[middle][0], cosine = c->direction[middle][1],
           climbed = c->root_height - c->root[1];
    c->body_lift += clamp(climbed, -MOST_CLIMB, MOST_CLIMB) - climbed;
    c->root[0] = c->position[middle][0];
    c->root[1] = c->root_height;
    c->root[2] = c->position[middle][1];
    c->yaw = atan2(sine, cosine);
    double half_cos = cos(c->yaw / 2), half_sin = sin(c->yaw / 2);
    for (int j = 0; j < joints; j++) {
        const float *p = y + m->y_joints + 3 * j, *v = p + 3 * joints, *r = v + 3 * joints;
        double *velocity = c->joint_velocity[j];
        velocity[0] = v[0] * cosine + v[2] * sine;
        velocity[1] = v[1];
        velocity[2] = v[2] * cosine - v[0] * sine;
        double to[3] = {p[0] * cosine + p[2] * sine + c->root[0], p[1] + c->root[1],
                        p[2] * cosine - p[0] * sine + c->root[2]};
        move_joint(c->joint_position[j], velocity, to, climbed, m->number[FASTEST]);
        turn_joint(c->joint_rotation[j], r, half_cos, half_sin);
    }
    memcpy(c->pose_position, c->joint_position, (size_t)joints * sizeof *c->pose_position);
    memcpy(c->pose_rotation, c->joint_rotation, (size_t)joints * sizeof *c->pose_rotation);
}

/* The root's movement, so that the body follows its target: see controller.py. past: `last` + 1 places. */
static void keep_up(double loss, const double *target, const double (*past)[2], int last, double *move) {
    double squared = target[0] * target[0] + target[1] * target[1];
    if (loss == 0 || squared < STILL * STILL) {
        move[0] *= 1 - loss;
        move[1] *= 1 - loss;
        return;
    }
    double more = -loss * smaller(0, move[0] * target[0] + move[1] * target[1]) / squared,
           way[2] = {past[last][0] - past[0][0], past[last][1] - past[0][1]},
           lack = 1 - (way[0] * target[0] + way[1] * target[1]) / (last * squared);
    more += clamp(lack, 0, MOST_PUSH / sqrt(squared));
    move[0] += more * target[0];
    move[1] += more * target[1];
}

/* The root's movement brought nearer to the target's, by a limited share of its length: see controller.py. */
static void pull_to_target(double share, const double *target, double *move) {
    double most = share * length2(move[0], move[1]), size = length2(target[0], target[1]);
    double ahead[2] = {size >= STILL ? target[0] / size : 0, size >= STILL ? target[1] / size : 0};
    double lack[2] = {target[0] - move[0], target[1] - move[1]},
           along = lack[0] * ahead[0] + lack[1] * ahead[1];
    for (int k = 0; k < 2; k++) lack[k] -= along * ahead[k]; /* what is left is across the target */
    along = clamp(along, -PULL_AHEAD * most, PULL_AHEAD * most);
    double across = smaller(1, most / larger(length2(lack[0], lack[1]), 1e-9));
    for (int k = 0; k < 2; k++) move[k] += along * ahead[k] + across * lack[k];
}

/* Advances trajectory and phase by a frame, as the prediction y says. */
static void advance(const model *m, character *c, const float *y, const double *target) {
    int middle = m->length / 2, future = m->future, recorded = m->size[FORM] >= RECORDED,
        steered = m->number[STEERING] > 0;
    memmove(c->position, c->position + 1, (size_t)middle * sizeof *c->position);
    memmove(c->direction, c->direction + 1, (size_t)middle * sizeof *c->direction);
    memmove(c->gait, c->gait + 1, (size_t)middle * sizeof *c->gait);
    double moving = recorded ? 1 : pow(larger(0, 1 - c->gait[middle][0]), 0.25),
           yaw = yaw_of(c->direction[middle]);
    double sine = sin(yaw), cosine = cos(yaw);
    double move[2] = {moving * (y[0] * cosine + y[1] * sine), moving * (y[1] * cosine - y[0] * sine)};
    double asked[2] = {moving * target[0], moving * target[1]};
    keep_up(steered && !recorded ? BACKWARD_LOSS : 0, asked, (const double (*)[2])c->position, middle - 1,
            move);
    pull_to_target(steered && recorded ? PULL : 0, target, move);
    double *root = c->position[middle];
    root[0] += move[0];
    root[1] += move[1];
    yaw -= moving * y[2]; /* the network predicts the turn of the world seen from the root */
    sine = c->direction[middle][0] = sin(yaw);
    cosine = c->direction[middle][1] = cos(yaw);
    for (int i = middle + 1; i < m->length; i++) {
        double place = (double)(i - middle) / m->size[STEP];
        int k = (int)place < future - 2 ? (int)place : future - 2; /* beyond the last sample, extrapolate */
        double t = place - k;
        const float *p = y + m->y_position + k, *d = y + m->y_direction + k;
        double x = (1 - t) * p[0] + t * p[1], z = (1 - t) * p[future] + t * p[future + 1];
        c->position[i][0] = root[0] + x * cosine + z * sine;
        c->position[i][1] = root[1] + z * cosine - x * sine;
        x = (1 - t) * d[0] + t * d[1];
        z = (1 - t) * d[future] + t * d[future + 1];
        double norm = larger(length2(x, z), 1e-6);
        c->direction[i][0] = (x * cosine + z * sine) / norm;
        c->direction[i][1] = (z * cosine - x * sine) / norm;
    }
    c->phase += ((1 - STANDING_SHARE) * moving + STANDING_SHARE) * (float)(y[3] * c->pace);
    c->phase -= floor(c->phase);
}

/* ---- 7. Feet ---------------------------------------------------------------------------------------------

   Holds a foot in contact where it landed, and bends the leg so that the foot gets there; feet.py and
   leg_reach.py explain the rules. "The network's foot" is the foot where the network predicts it. */

typedef struct { /* a leg in the last frame, as it was drawn; heights are above `base`, the height of the body
                  */
    double (*shown)[3];
    double base, fastest;
} last_frame;

/* The smallest rotation q from direction a to b; the identity if they are opposite. */
static void rotation_between(const double *a, const double *b, double *q) {
    double w = sqrt((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
    w += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    double norm = sqrt(w * w + x * x + y * y + z * z);
    int opposite = norm < 1e-9;
    q[0] = opposite ? 1 : w / norm;
    q[1] = opposite ? 0 : x / norm;
    q[2] = opposite ? 0 : y / norm;
    q[3] = opposite ? 0 : z / norm;
}

/* Turns a rotation toward another, by at most MOST_ADDED. Returns whether it does not get there. */
static int turn_toward(double *rotation, const double *to) {
    double dot = rotation[0] * to[0] + rotation[1] * to[1] + rotation[2] * to[2] + rotation[3] * to[3],
           sign = dot < 0 ? -1 : 1;
    double half = acos(smaller(sign * dot, 1)), keep = 0, take = sign;
    int limited = half > 0.5 * MOST_ADDED;
    if (limited) {
        keep = sin(half - 0.5 * MOST_ADDED) / sin(half);
        take = sign * sin(0.5 * MOST_ADDED) / sin(half);
    }
    for (int i = 0; i < 4; i++) rotation[i] = keep * rotation[i] + take * to[i];
    return limited;
}

/* Turns a vector by the rotation `by`. */
static void turn_vector(const double *by, const double *v, double *out) {
    double w = by[0], a = by[1], b = by[2], c = by[3], x = v[0], y = v[1], z = v[2];
    double p = 2 * (b * z - c * y), q = 2 * (c * x - a * z), r = 2 * (a * y - b * x);
    out[0] = x + w * p + b * r - c * q;
    out[1] = y + w * q + c * p - a * r;
    out[2] = z + w * r + a * q - b * p;
}

/* Turns a rotation by the rotation `by`. */
static void turn_rotation(const double *by, double *rotation) {
    double w = by[0], x = by[1], y = by[2], z = by[3], a = rotation[0], b = rotation[1], c = rotation[2],
           d = rotation[3];
    rotation[0] = w * a - x * b - y * c - z * d;
    rotation[1] = w * b + x * a + y * d - z * c;
    rotation[2] = w * c - x * d + y * a + z * b;
    rotation[3] = w * d + x * c - y * b + z * a;
}

static void minus(const double *a, const double *b, double *out) {
    for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Moves the heel by `shift`, by bending the knee; bones keep their lengths. ahead: where a straight knee
   bends to. */
static void move_heel(const double *hip, double *knee, double *heel, const double *shift,
                      const double *ahead) {
    /* thigh, shank: from hip to knee and from knee to heel. line: from hip to heel. to: from hip to the
       shifted heel. */
    double thigh[3], shank[3], line[3], to[3], out[3], forward[3];
    minus(knee, hip, thigh);
    minus(heel, knee, shank);
    for (int i = 0; i < 3; i++) line[i] = thigh[i] + shank[i], to[i] = line[i] + shift[i];
    double upper = sqrt(dot3(thigh, thigh)), lower = sqrt(dot3(shank, shank)),
           before = sqrt(dot3(line, line)), distance = sqrt(dot3(to, to));
    if (smaller(smaller(before, distance), smaller(upper, lower)) < 1e-6) return;
    for (int i = 0; i < 3; i++) line[i] /= before, to[i] /= distance;
    distance = smaller(larger(distance, fabs(upper - lower) * 1.001 + 1e-6), (upper + lower) * 0.999);
    double cosine =
        clamp((upper * upper + distance * distance - lower * lower) / (2 * upper * distance), -1, 1);
    /* out: from the line between hip and heel to the knee. forward: the part of `ahead` across this line. */
    double along = dot3(thigh, line), along_ahead = dot3(ahead, line);
    for (int i = 0; i < 3; i++)
        out[i] = thigh[i] - along * line[i], forward[i] = ahead[i] - along_ahead * line[i];
    double size = larger(sqrt(dot3(forward, forward)), 1e-6),
           more = larger(KNEE_AHEAD - dot3(out, forward) / size, 0);
    if (more == 0 && fabs(shift[0]) + fabs(shift[1]) + fabs(shift[2]) < 1e-9) return;
    for (int i = 0; i < 3; i++) out[i] += more * forward[i] / size;
    /* Turn `out` by the smallest rotation from the old line to the new one. */
    double factor = dot3(out, to) / larger(1 + dot3(line, to), 1e-6);
    for (int i = 0; i < 3; i++) out[i] -= factor * (line[i] + to[i]);
    size = sqrt(dot3(out, out));
    if (size < 1e-6) return;
    double sine = sqrt(1 - cosine * cosine) / size;
    for (int i = 0; i < 3; i++) {
        knee[i] = hip[i] + upper * (to[i] * cosine + out[i] * sine);
        heel[i] = hip[i] + to[i] * distance;
    }
}

/* Moves a point until it is at most `fastest` from where it was drawn, at `shown` above `base`. Returns
   whether. */
static int hold_back(double *at, const double *shown, double base, double fastest) {
    double away[3] = {at[0] - shown[0], at[1] - shown[1] - base, at[2] - shown[2]},
           far = length3(away[0], away[1], away[2]);
    if (far <= fastest) return 0;
    for (int i = 0; i < 3; i++) at[i] -= (1 - fastest / far) * away[i];
    return 1;
}

/* Moves the heel by `shift`, but changes the rotations `added` to thigh and shank by at most MOST_ADDED in a
   frame. */
static void bend_leg(character *c, const int32_t *leg, const double *shift, const double *ahead,
                     double (*added)[4], const last_frame *last) {
    double *hip = c->pose_position[leg[HIP]], *knee = c->pose_position[leg[KNEE]],
           *heel = c->pose_position[leg[HEEL]];
    double thigh[3], shank[3], now[3], to[4], bends[3];
    minus(knee, hip, thigh);
    minus(heel, knee, shank);
    turn_vector(c->pose_rotation[leg[HIP]], ahead, bends);
    move_heel(hip, knee, heel, shift, bends);
    minus(knee, hip, now);
    rotation_between(thigh, now, to);
    int limited = turn_toward(added[0], to);
    minus(heel, knee, now);
    rotation_between(shank, now, to);
    limited |= turn_toward(added[1], to);
    if (limited) {
        turn_vector(added[0], thigh, now);
        for (int i = 0; i < 3; i++) knee[i] = hip[i] + now[i];
        turn_vector(added[1], shank, now);
        for (int i = 0; i < 3; i++) heel[i] = knee[i] + now[i];
    }
    limited = hold_back(knee, last->shown[0], last->base, last->fastest);
    limited |= hold_back(heel, last->shown[1], last->base, last->fastest);
    if (limited) { /* the rotations that fit the limited positions */
        minus(knee, hip, now);
        rotation_between(thigh, now, added[0]);
        minus(heel, knee, now);
        rotation_between(shank, now, added[1]);
    }
    turn_rotation(added[0], c->pose_rotation[leg[HIP]]);
    turn_rotation(added[1], c->pose_rotation[leg[KNEE]]);
}

/* The shift of a toe at x, z, changed if the toe would get farther than `fastest` from where it was drawn. */
static void limit_shift(double *shift, double x, double z, const double *shown, double fastest) {
    double to_x = x + shift[0] - shown[0], to_z = z + shift[1] - shown[2], far = length2(to_x, to_z);
    if (far <= fastest) return;
    shift[0] = shown[0] + to_x * fastest / far - x;
    shift[1] = shown[2] + to_z * fastest / far - z;
}

/* The share of a held foot's place in where it is shown: 1 to 0 with `lock`, slowly at both ends. */
static double held_share(double lock) {
    return lock * lock * (3 - 2 * lock);
}

/* Decides whether foot `f` is held, let go, or steps. Writes how far to move the network's toe into shift (x,
   z). */
static void hold_foot(const model *m, character *c, int f, double contact, double *shift) {
    const double *toe = c->pose_position[m->legs[4 * f + TOE]], *shown = c->leg_shown[f][2];
    double x = toe[0], z = toe[2], fastest = m->number[FASTEST], *lock = &c->foot_lock[f],
           *step = &c->foot_step[f], *hold = c->foot_hold[f];
    double away[2] = {hold[0] - x, hold[1] - z}, far = length2(away[0], away[1]);
    shift[0] = shift[1] = 0;
    if (!(m->number[LOCKING] > 0)) {
        *lock = *step = 0;
        return;
    }
    if (*lock < 1 && far > TOO_FAR_ALONE) { /* in the air, the hold follows the network's foot */
        for (int k = 0; k < 2; k++) away[k] *= TOO_FAR_ALONE / far;
        hold[0] = x + away[0];
        hold[1] = z + away[1];
    }
    if (*step > 0) {
        *step += 1.0 / STEP_FRAMES;
        if (*step > 1 - 1e-6) *step = *lock = 0;
    }
    if (*step == 0) {
        if (contact < LOCK_AT) {
            *lock = larger(0, *lock - RELEASE);
        } else if (*lock < 1) { /* hold the foot where it is shown now */
            for (int k = 0; k < 2; k++) away[k] *= held_share(*lock);
            limit_shift(away, x, z, shown, fastest);
            hold[0] = x + away[0];
            hold[1] = z + away[1];
            *lock = 1;
        } else {
            int other = c->foot_lock[1 - f] == 1;
            if (far >= (other ? TOO_FAR : TOO_FAR_ALONE)
                || c->foot_missed[f] > (other ? MISSED : MISSED_ALONE))
                *step = 1.0 / STEP_FRAMES;
        }
    }
    if (*step > 0) *lock = 1 - *step;
    shift[0] = held_share(*lock) * away[0];
    shift[1] = held_share(*lock) * away[1];
    limit_shift(shift, x, z, shown, fastest);
}

/* Squares of the lengths of thigh and shank, and of the distance from hip to heel. */
static void leg_squares(const double *hip, const double *knee, const double *heel, double *squares) {
    double thigh[3], shank[3], line[3];
    minus(knee, hip, thigh);
    minus(heel, knee, shank);
    minus(heel, hip, line);
    squares[0] = dot3(thigh, thigh), squares[1] = dot3(shank, shank), squares[2] = dot3(line, line);
}

/* The square of the distance from hip to heel that a held foot may stretch its leg to. */
static double allowed_square(const double *hip, const double *knee, const double *heel) {
    double squares[3];
    leg_squares(hip, knee, heel, squares);
    double longest = STRETCH * (sqrt(squares[0]) + sqrt(squares[1]));
    return larger(squares[2], longest * longest);
}

/* Raises the heel of a foot that `shift` moves behind the hip, so that the leg is not stretched: see feet.py.
   The foot turns about its toe by the rotation `roll`, and the heel's movement is added to `shift`. */
static void raise_heel(const double *hip, const double *knee, const double *heel, const double *toe,
                       double *shift, double *roll) {
    double most = allowed_square(hip, knee, heel), needed = 0; /* square of the distance after the shift */
    for (int i = 0; i < 3; i++) needed += (heel[i] + shift[i] - hip[i]) * (heel[i] + shift[i] - hip[i]);
    double fx = toe[0] - heel[0], fz = toe[2] - heel[2], along = length2(fx, fz), high = heel[1] - toe[1];
    if (needed <= most || along < 1e-6) return;
    fx /= along;
    fz /= along;
    /* The shifted toe is at (wx, up, wz) from the hip, and `ahead` of it in the direction of the foot. */
    double wx = toe[0] + shift[0] - hip[0], wz = toe[2] + shift[2] - hip[2], ahead = wx * fx + wz * fz,
           up = toe[1] + shift[1] - hip[1];
    if (ahead >= UNDER) return;
    most += larger(1 + (ahead - UNDER) / BEHIND, 0) * (needed - most);
    /* The angle of the turn about the toe after which the squared distance from hip to heel is `most`. */
    double cosine = up * high - ahead * along, sine = ahead * high + up * along, size = length2(cosine, sine);
    double right = 0.5 * (most - wx * wx - up * up - wz * wz - along * along - high * high);
    if (!(size > 0)) return;
    double angle = clamp(atan2(sine, cosine) + acos(clamp(right / size, -1, 1)), 0, MOST_ADDED);
    double forward = along * (1 - cos(angle)) + high * sin(angle);
    shift[0] += forward * fx;
    shift[1] += along * sin(angle) - high * (1 - cos(angle));
    shift[2] += forward * fz;
    roll[0] = cos(angle / 2);
    roll[1] = sin(angle / 2) * fz;
    roll[3] = -sin(angle / 2) * fx;
}

/* Moves a foot along with its heel, which was at `old`, and turns it by `roll`. The toes move, but do not
   turn. */
static void carry_foot(const model *m, character *c, int f, const double *old, const double *roll) {
    const uint8_t *parts = m->parts + f * m->size[JOINTS];
    const double *heel = c->pose_position[m->legs[4 * f + HEEL]],
                 *toe = c->pose_position[m->legs[4 * f + TOE]];
    double from[3], move[3], turned[3];
    minus(toe, old, from);
    turn_vector(roll, from, move);
    for (int i = 0; i < 3; i++) move[i] += heel[i] - toe[i];
    turn_rotation(roll, c->pose_rotation[m->legs[4 * f + HEEL]]);
    for (int j = 0; j < m->size[JOINTS]; j++) {
        double *place = c->pose_position[j];
        if (parts[j] == TOES) {
            for (int i = 0; i < 3; i++) place[i] += move[i];
        } else if (parts[j] == FOOT) {
            minus(place, old, from);
            turn_vector(roll, from, turned);
            for (int i = 0; i < 3; i++) place[i] = heel[i] + turned[i];
            turn_rotation(roll, c->pose_rotation[j]);
        }
    }
}

/* Limits how far the toe moves in a frame, and moves the joints below it along. */
static void hold_toes_back(const model *m, character *c, int f, const last_frame *last) {
    int toe = m->legs[4 * f + TOE];
    double old[3], *at = c->pose_position[toe];
    memcpy(old, at, sizeof old);
    if (!hold_back(at, last->shown[2], last->base, last->fastest)) return;
    for (int j = 0; j < m->size[JOINTS]; j++)
        if (m->parts[f * m->size[JOINTS] + j] == TOES && j != toe)
            for (int i = 0; i < 3; i++) c->pose_position[j][i] += at[i] - old[i];
}

/* How deep foot `f` is in the ground, cm; negative above it. ground: heights under its heel and toe. */
static double sole_depth(const model *m, const character *c, int f, const double *ground) {
    const int32_t *leg = m->legs + 4 * f;
    return larger(ground[0] + m->sole[0] - c->pose_position[leg[HEEL]][1],
                  ground[1] + m->sole[1] - c->pose_position[leg[TOE]][1]);
}

/* Raises or lowers the whole body, so that it stands on the ground under its feet. ground: (5) heights under
   left heel, left toe, right heel, right toe and hips. y: the prediction. */
static void carry_body(const model *m, character *c, const float *y, const double *ground) {
    const float *contacts = y + m->y_contacts;
    double rises = 0, weight = 0;
    for (int f = 0; f < 2; f++) {
        double rise = sole_depth(m, c, f, ground + 2 * f);
        double stands = clamp(larger(contacts[2 * f], contacts[2 * f + 1]), 0, 1);
        rises += stands * (larger(rise - BODY_FREE, 0) + smaller(rise + BODY_FREE, 0));
        weight += stands;
    }
    if (weight > BODY_MIN_CONTACT) c->body_lift += BODY_MIX * (rises / weight - c->body_lift);
    double above = c->pose_position[m->size[HIPS]][1] - ground[4];
    double predicted = y[m->y_joints + 3 * m->size[HIPS] + 1];
    double lowest = larger(m->number[HIPS_LOW], smaller(m->number[UPRIGHT], predicted));
    c->body_lift = clamp(c->body_lift, lowest - above, m->number[HIPS_HIGH] - above);
    for (int j = 0; j < m->size[JOINTS]; j++) c->pose_position[j][1] += c->body_lift;
}

/* How the heel moves if the knee bends by `more` radians more: see heel_of_bend in feet.py. */
static void heel_of_bend(const double *hip, const double *knee, const double *heel, double more,
                         double *move) {
    double squares[3];
    leg_squares(hip, knee, heel, squares);
    double upper = squares[0], lower = squares[1], before = squares[2], both = 2 * sqrt(upper * lower);
    if (before < 1 || both < 1) return;
    double bent = acos(clamp((before - upper - lower) / both, -1, 1));
    bent = clamp(bent + more, smaller(bent, BENT), larger(bent, MOST_BENT));
    double share = sqrt((upper + lower + both * cos(bent)) / before) - 1;
    for (int i = 0; i < 3; i++) move[i] = share * (heel[i] - hip[i]);
}

/* Lets the arms swing further, or less: see swing_arms in variation.py. */
static void swing_arms(const model *m, character *c) {
    if (c->arm_more[0] == 0 && c->arm_more[1] == 0) return;
    double sine = sin(c->yaw), cosine = cos(c->yaw);
    for (int side = 0; side < 2; side++) {
        int first = m->arms[2 * side];
        double bone[3], *shoulder = c->pose_position[first];
        minus(c->pose_position[m->arms[2 * side + 1]], shoulder, bone);
        double ahead = (bone[0] * sine + bone[2] * cosine) / larger(sqrt(dot3(bone, bone)), 1e-6);
        c->arm_mean[side] += (ahead - c->arm_mean[side]) / 60;
        double half = c->arm_more[side] * (ahead - c->arm_mean[side]) / 2;
        double turn[4] = {cos(half), -cosine * sin(half), 0, sine * sin(half)};
        for (int j = first; j < m->size[JOINTS]; j++) {
            int above = j;
            double from[3];
            while (above > first) above = m->parents[above];
            if (above != first) continue;
            minus(c->pose_position[j], shoulder, from);
            turn_vector(turn, from, bone);
            for (int i = 0; i < 3; i++) c->pose_position[j][i] = shoulder[i] + bone[i];
            turn_rotation(turn, c->pose_rotation[j]);
        }
    }
}

/* By how much the hips have to sink so that a held foot beside or ahead of them does not stretch its leg: see
   feet.py. The foot moves by `hold` along x and z, and up by `rise`. */
static double needed_sink(const model *m, const character *c, int f, const double *hold, double rise) {
    const int32_t *leg = m->legs + 4 * f;
    const double *hip = c->pose_position[leg[HIP]], *knee = c->pose_position[leg[KNEE]],
                 *heel = c->pose_position[leg[HEEL]], *toe = c->pose_position[leg[TOE]];
    double most = allowed_square(hip, knee, heel);
    /* The held heel is at (wx, wz) from the hip, `down` below it. */
    double wx = heel[0] + hold[0] - hip[0], wz = heel[2] + hold[1] - hip[2], down = hip[1] - heel[1] - rise,
           across = wx * wx + wz * wz;
    double fx = toe[0] - heel[0], fz = toe[2] - heel[2], along = length2(fx, fz);
    if (across + down * down <= most || along < 1e-6) return 0;
    double ahead = (wx * fx + wz * fz) / along + along;
    return clamp(1 + (ahead - UNDER) / BEHIND, 0, 1)
           * clamp(down - sqrt(larger(most - across, 0)), 0, MOST_SINK);
}

/* Lets the hips sink for feet that move by `holds` along x and z. The feet, which are `depths` deep in the
   ground, are placed afterwards. */
static void sink_hips(const model *m, character *c, double (*holds)[2], const double *depths) {
    c->hips_sink *= SINK_KEPT;
    for (int f = 0; f < 2; f++)
        c->hips_sink = larger(c->hips_sink, needed_sink(m, c, f, holds[f], larger(depths[f], 0)));
    for (int j = 0; j < m->size[JOINTS]; j++) c->pose_position[j][1] -= c->hips_sink;
}

/* Moves foot `f` by `held` along x and z, and keeps it out of the ground, in which it is `depth` deep. Writes
   contact 0 for a foot that steps. */
static void place_foot(const model *m, character *c, int f, const double *held, double depth, float *contacts,
                       const double *ground) {
    const int32_t *leg = m->legs + 4 * f;
    double shift[3], roll[4] = {1, 0, 0, 0}, old[3], *heel = c->pose_position[leg[HEEL]];
    double done = c->foot_step[f], bend[3] = {0};
    if (c->knee_more[f] != 0) { /* only in the air */
        double near = larger(c->foot_lock[f], smaller(contacts[2 * f + 1] / LOCK_AT, 1));
        double high = (heel[1] - ground[2 * f] - m->sole[0]) / BENDS_ABOVE;
        double in_air = (1 - held_share(near)) * held_share(clamp(high, 0, 1));
        heel_of_bend(c->pose_position[leg[HIP]], c->pose_position[leg[KNEE]], heel, in_air * c->knee_more[f],
                     bend);
        depth -= bend[1];
    }
    double rise = larger(depth, 0);
    if (done == 0) rise += held_share(c->foot_lock[f]) * smaller(depth + FLOATING, 0);
    double change = rise - c->foot_lift[f];
    if (change < 0) change *= HEIGHT_MIX;
    c->foot_lift[f] += clamp(change, -FASTEST_LIFT, FASTEST_LIFT);
    shift[0] = held[0] + bend[0];
    shift[1] = c->foot_lift[f] + bend[1] + c->hips_sink;
    shift[2] = held[1] + bend[2];
    if (done > 0) { /* the foot leaves the ground slowly, and comes back slowly */
        double share = 4 * done * (1 - done);
        shift[1] += larger(STEP_HEIGHT * share * share - larger(-depth, 0), 0);
        contacts[2 * f] = contacts[2 * f + 1] = 0;
    }
    if (c->foot_lock[f] > 0)
        raise_heel(c->pose_position[leg[HIP]], c->pose_position[leg[KNEE]], heel, c->pose_position[leg[TOE]],
                   shift, roll);
    memcpy(old, heel, sizeof old);
    last_frame last = {c->leg_shown[f], c->root_height + c->body_lift, m->number[FASTEST]};
    bend_leg(c, leg, shift, m->ahead, c->foot_added[f], &last);
    carry_foot(m, c, f, old, roll);
    hold_toes_back(m, c, f, &last);
    const double *toe = c->pose_position[leg[TOE]];
    c->foot_missed[f] =
        c->foot_lock[f] == 1 ? length2(c->foot_hold[f][0] - toe[0], c->foot_hold[f][1] - toe[2]) : 0;
    for (int i = 0; i < 3; i++) {
        memcpy(c->leg_shown[f][i], c->pose_position[leg[i + 1]], sizeof c->leg_shown[f][i]);
        c->leg_shown[f][i][1] -= last.base;
    }
}

/* ---- 8. A frame, and the functions of hobble.h -----------------------------------------------------------
 */

/* Puts a character at x, z, facing `yaw`, in the start pose. Its channel targets stay. */
static void start_character(const hobble *h, character *c, double x, double z, double yaw) {
    const model *m = &h->model;
    double sine = sin(yaw), cosine = cos(yaw), facing[4] = {cos(yaw / 2), 0, sin(yaw / 2), 0};
    character fresh = {0};
    fresh.position = c->position, fresh.direction = c->direction, fresh.gait = c->gait,
    fresh.ground = c->ground;
    fresh.joint_position = c->joint_position, fresh.joint_velocity = c->joint_velocity,
    fresh.joint_rotation = c->joint_rotation;
    fresh.pose_position = c->pose_position, fresh.pose_rotation = c->pose_rotation;
    fresh.values = c->values, fresh.targets = c->targets, fresh.memory = c->memory;
    fresh.variation = c->variation, fresh.seed = c->seed, fresh.pace = fresh.shown = 1;
    *c = fresh;
    for (int i = 0; i < m->length; i++) {
        const double *p = m->start_path + 2 * i, *d = m->start_direction + 2 * i;
        c->position[i][0] = p[0] * cosine + p[1] * sine + x;
        c->position[i][1] = p[1] * cosine - p[0] * sine + z;
        c->direction[i][0] = d[0] * cosine + d[1] * sine;
        c->direction[i][1] = d[1] * cosine - d[0] * sine;
    }
    memcpy(c->gait, m->start_gait, (size_t)m->length * sizeof *c->gait);
    memset(c->ground, 0, (size_t)m->samples * sizeof *c->ground);
    for (int j = 0; j < m->size[JOINTS]; j++) {
        const double *p = m->start_joints + 3 * j, *v = m->start_velocities + 3 * j;
        c->joint_position[j][0] = p[0] * cosine + p[2] * sine + x;
        c->joint_position[j][1] = p[1];
        c->joint_position[j][2] = p[2] * cosine - p[0] * sine + z;
        c->joint_velocity[j][0] = v[0] * cosine + v[2] * sine;
        c->joint_velocity[j][1] = v[1];
        c->joint_velocity[j][2] = v[2] * cosine - v[0] * sine;
        memcpy(c->joint_rotation[j], m->start_rotations + 4 * j, sizeof c->joint_rotation[j]);
        turn_rotation(facing, c->joint_rotation[j]);
    }
    memcpy(c->pose_position, c->joint_position, (size_t)m->size[JOINTS] * sizeof *c->pose_position);
    memcpy(c->pose_rotation, c->joint_rotation, (size_t)m->size[JOINTS] * sizeof *c->pose_rotation);
    memcpy(c->values, m->defaults, (size_t)m->size[COLUMNS] * sizeof *c->values);
    memset(c->memory, 0, (size_t)h->memory_size * sizeof *c->memory);
    c->phase = m->number[START_PHASE];
    c->smoothed_direction[0] = sine;
    c->smoothed_direction[1] = cosine;
    for (int f = 0; f < 2; f++) {
        c->foot_added[f][0][0] = c->foot_added[f][1][0] = 1;
        for (int i = 0; i < 3; i++)
            memcpy(c->leg_shown[f][i], c->joint_position[m->legs[4 * f + i + 1]], sizeof c->leg_shown[f][i]);
    }
    c->root[0] = x;
    c->root[2] = z;
    c->report[0] = c->yaw = yaw;
    c->report[1] = c->phase;
}

/* A number with mean 0 and standard deviation 1: see `step_noise` in variation.py. */
static double step_noise(uint32_t seed, uint32_t step, uint32_t stream) {
    uint32_t x = seed * 0x9E3779B1u + step * 0x85EBCA77u + stream * 0xC2B2AE3Du, total = 0;
    x = (x ^ x >> 16) * 0x7FEB352Du;
    x = (x ^ x >> 15) * 0x846CA68Bu;
    x ^= x >> 16;
    for (int byte = 0; byte < 4; byte++) total += x >> 8 * byte & 0xFF;
    return (total - 510.0) / 147.8;
}

/* Makes each step of a character take a little more or less time and way: see variation.py, which has the
   same numbers and streams of random numbers. */
static void vary(const model *m, character *c, goal *target) {
    enum { TIME, LENGTH, SHOWN, PERSON, KNEE_MORE, ARM_MORE, STREAMS };
    static const double healthy[STREAMS] = {0.035, 0.03, 0, 0, 0.066, 0.1},
                        hurt[STREAMS] = {0.11, 0.08, 0.12, 0, 0.17, 0.2},
                        sides_differ[STREAMS] = {0.015, 0, 0, 0, 0.052, 0.225}, swing_mix = 0.15;
    double most = 0, more[STREAMS];
    uint32_t half = (uint32_t)(2 * c->phase) % 2;
    c->pace = 1;
    if (!(c->variation > 0)) return;
    c->step += half != c->step % 2;
    for (int k = 0; k < m->size[COLUMNS]; k++)
        if (m->slows[m->channel_of[k]] && m->highest[k] > 0)
            most = larger(most, c->values[k] / m->highest[k]);
    most = smaller(most, 1);
    uint32_t side = c->step % 2;
    for (uint32_t s = 0; s < STREAMS; s++) {
        double spread = healthy[s] + most * (hurt[s] - healthy[s]);
        double person = sides_differ[s] * (side ? -1 : 1) * step_noise(c->seed, s, PERSON);
        more[s] = c->variation * (spread * step_noise(c->seed, c->step, s) + person);
    }
    c->pace = 1 + more[TIME];
    c->shown = 1 + more[SHOWN];
    c->knee_more[side] += swing_mix * (more[KNEE_MORE] - c->knee_more[side]);
    c->arm_more[side] += swing_mix * (more[ARM_MORE] - c->arm_more[side]);
    for (int i = 0; i < 2; i++) target->velocity[i] *= 1 + more[LENGTH];
}

/* Whether `count` numbers are finite and not too large. */
static int sound(const void *numbers, size_t count) {
    const double *values = numbers;
    double totals[4] = {0}; /* additions to one would wait for each other */
    for (size_t i = 0; i < count; i++) totals[i % 4] += fabs(values[i]);
    /* false for a sum that is not finite */
    return totals[0] + totals[1] + totals[2] + totals[3] <= LARGEST_SOUND * (double)count;
}

static int sound_character(const hobble *h, const character *c) {
    size_t length = (size_t)h->model.length, joints = (size_t)h->model.size[JOINTS];
    return sound(c->position, 2 * length) && sound(c->direction, 2 * length) && sound(c->gait, GAITS * length)
           && sound(c->joint_position, 3 * joints) && sound(c->joint_velocity, 3 * joints)
           && sound(c->joint_rotation, 4 * joints) && sound(c->values, (size_t)h->model.size[COLUMNS])
           && sound(c->memory, (size_t)h->memory_size) && sound(&c->phase, 1)
           && sound(c->smoothed_velocity, 2) && sound(c->smoothed_direction, 2) && sound(c->correction, 2)
           && sound(c->earlier, 2) && sound(c->foot_hold, 4) && sound(c->foot_lift, 2)
           && sound(c->foot_added, 16) && sound(c->leg_shown, 18) && sound(&c->body_lift, 1)
           && sound(&c->hips_sink, 1);
}

/* The height of a grid of heights at x, z, bilinear. */
static double grid_height(const hobble_ground *ground, double x, double z) {
    int rows = ground->rows, columns = ground->columns;
    double u = clamp((x - ground->centre[0]) / ground->cell + (columns - 1) / 2.0, 0, columns - 1);
    double v = clamp((z - ground->centre[1]) / ground->cell + (rows - 1) / 2.0, 0, rows - 1);
    int i = (int)u < columns - 2 ? (int)u : columns - 2, j = (int)v < rows - 2 ? (int)v : rows - 2;
    const float *low = ground->heights + (size_t)j * (size_t)columns + i, *high = low + columns;
    u -= i;
    v -= j;
    return (low[0] * (1 - u) + low[1] * u) * (1 - v) + (high[0] * (1 - u) + high[1] * u) * v;
}

/* Looks up the heights of `count` points of h->points. Returns HOBBLE_OK or an error. */
static int look_up(hobble *h, const hobble_ground *ground, int count) {
    if (!ground) {
        memset(h->heights, 0, (size_t)count * sizeof *h->heights);
        return HOBBLE_OK;
    }
    if (ground->function) ground->function(ground->user, count, h->points, h->heights);
    else
        for (int i = 0; i < count; i++)
            h->heights[i] = grid_height(ground, h->points[2 * i], h->points[2 * i + 1]);
    for (int i = 0; i < count; i++)
        if (!(fabs(h->heights[i]) <= HIGHEST_GROUND)) return HOBBLE_BAD_GROUND;
    return HOBBLE_OK;
}

/* Bends the paths toward the targets, looks up the ground along them, and moves the channel values. */
static int prepare(hobble *h, const hobble_ground *ground) {
    const model *m = &h->model;
    int samples = 3 * m->samples;
    for (int i = 0; i < h->characters; i++) {
        character *c = &h->state[i];
        follow_target(m, c, &h->goals[i]);
        blend_future(h, c);
        sample_points(m, c, h->points + 2 * (size_t)samples * (size_t)i);
        for (int k = 0; k < m->size[COLUMNS]; k++)
            c->values[k] += clamp(c->targets[k] - c->values[k], -m->rates[k], m->rates[k]);
    }
    int error = look_up(h, ground, samples * h->characters);
    for (int i = 0; !error && i < h->characters; i++) {
        character *c = &h->state[i];
        double total = 0;
        memcpy(c->ground, h->heights + (size_t)samples * (size_t)i, (size_t)samples * sizeof(double));
        for (int s = 0; s < m->samples; s++) total += c->ground[s][1];
        c->root_height = total / m->samples;
        if (c->placed) continue;
        c->placed = 1; /* once, at the start: lift the joints to the ground, which may have any height */
        c->root[1] = c->root_height;
        for (int j = 0; j < m->size[JOINTS]; j++) c->joint_position[j][1] += c->root_height;
    }
    return error;
}

/* Turns the predictions into poses on the ground. */
static int place(hobble *h, const hobble_ground *ground) {
    const model *m = &h->model;
    for (int i = 0; i < h->characters; i++) {
        character *c = &h->state[i];
        const int32_t *l = m->legs;
        const int under[5] = {l[HEEL], l[TOE], l[4 + HEEL], l[4 + TOE], m->size[HIPS]};
        write_pose(m, c, h->y + (size_t)i * (size_t)m->size[Y_SIZE]);
        double (*points)[2] = (double (*)[2])(h->points + 18 * i);
        for (int k = 0; k < 5; k++)
            for (int a = 0; a < 2; a++) points[k][a] = c->pose_position[under[k]][2 * a];
        for (int k = 0; k < 4; k++)
            for (int a = 0; a < 2; a++) {
                /* a held foot is where it is held, not where the network predicts it */
                double lock = held_share(c->foot_lock[k / 2]);
                points[k][a] += lock * (c->foot_hold[k / 2][a] - c->pose_position[under[k | 1]][2 * a]);
                /* a foot in the air rises in time for the ground that it will be over */
                points[5 + k][a] = points[k][a] + FEET_AHEAD * (1 - lock) * c->joint_velocity[under[k]][2 * a];
            }
    }
    int error = look_up(h, ground, 9 * h->characters);
    for (int i = 0; !error && i < h->characters; i++) {
        character *c = &h->state[i];
        float *y = h->y + (size_t)i * (size_t)m->size[Y_SIZE], *contacts = y + m->y_contacts;
        double *heights = h->heights + 9 * i;
        for (int k = 0; k < 4; k++) heights[k] = larger(heights[k], heights[5 + k]);
        carry_body(m, c, y, heights);
        swing_arms(m, c);
        double holds[2][2], depths[2];
        for (int f = 0; f < 2; f++) {
            hold_foot(m, c, f, contacts[2 * f + 1], holds[f]);
            depths[f] = sole_depth(m, c, f, heights + 2 * f);
        }
        sink_hips(m, c, holds, depths);
        for (int f = 0; f < 2; f++) place_foot(m, c, f, holds[f], depths[f], contacts, heights);
        for (int k = 0; k < 4; k++) c->report[2 + k] = clamp(contacts[k], 0, 1);
    }
    return error;
}

/* The mean distance between edges of stairs at most 80 cm ahead, cm; infinite if there are fewer than two.
   edges: whether an edge is at each point. */
static double tread(const int *edges, double apart) {
    int first = -1, last = -1, count = 0;
    for (int k = 1; k < POINTS; k++)
        if (edges[k] && apart * (k - EARLIER) <= 80) {
            if (count++ == 0) first = k;
            last = k;
        }
    return count > 1 ? apart * (last - first) / (count - 1) : INFINITY;
}

/* Lets the right leg go first on stairs: see stairs.py, which has the same numbers. */
static int time_steps(hobble *h, const hobble_ground *ground) {
    static const double apart = 5, edge = 4, over_edge = 20, first_down = 14,
                        cycle_frames = 80, slowest = 0.3, treads = 1.2, most = 3, pace = 0.5, speed = 4,
                        fastest = 3, join_from = 5, join_at = 7, lands[2] = {0.5, 0.0};
    const model *m = &h->model;
    int now = m->size[WINDOW], span = now / 2;
    for (int i = 0; i < h->characters; i++) {
        character *c = &h->state[i];
        double *v = h->goals[i].velocity, worst[2] = {0}, share[2];
        for (int k = 0; k < m->size[COLUMNS]; k++)
            if (m->leg[k]) worst[m->leg[k] - 1] = larger(worst[m->leg[k] - 1], c->values[k]);
        for (int leg = 0; leg < 2; leg++) {
            double x = clamp((worst[leg] - join_from) / (join_at - join_from), 0, 1);
            share[leg] = x * x * (3 - 2 * x);
        }
        double join = share[1] - share[0], size = larger(hypot(v[0], v[1]), 1e-6), best = 0;
        if (join == 0) continue;
        for (int k = 0; k < POINTS; k++)
            for (int a = 0; a < 2; a++)
                h->points[2 * k + a] = c->position[now][a] + apart * (k - EARLIER) * (v[a] / size);
        int edges[POINTS] = {0}, first = 1, error = look_up(h, ground, POINTS);
        if (error) return error;
        for (int k = 1; k < POINTS; k++) edges[k] = fabs(h->heights[k] - h->heights[k - 1]) >= edge;
        double slower = pow(smaller(treads * tread(edges, apart) / cycle_frames / size, 1), fabs(join));
        for (int a = 0; a < 2; a++) v[a] *= slower;
        double over = over_edge;
        int on_stairs = 0;
        for (int k = 1; k < POINTS && apart * (k - EARLIER) <= first_down; k++) on_stairs |= edges[k];
        for (; first < POINTS; first++) {
            over = !on_stairs && h->heights[first] < h->heights[first - 1] ? first_down : over_edge;
            if (edges[first] && apart * (first - EARLIER) > over) break;
        }
        if (first == POINTS) continue;
        double x = c->position[now][0] - c->position[now - span][0],
               z = c->position[now][1] - c->position[now - span][1];
        double cycles = (apart * (first - EARLIER) - over) / (larger(hypot(x, z) / span, slowest) * cycle_frames);
        int right_leads = (h->heights[first] > h->heights[first - 1]) == (join < 0);
        double wait = lands[right_leads] - c->phase;
        wait -= floor(wait);
        for (int k = 0; k < 3; k++) {
            double factor = larger(wait + k, 1e-3) / larger(cycles, 0.05);
            if (k == 0 || fabs(log(factor)) < fabs(log(best))) best = factor;
        }
        best = pow(clamp(best, 1 / most, most), fabs(join));
        c->pace *= pow(best, pace);
        for (int a = 0; a < 2; a++) v[a] *= smaller(pow(best, -speed), fastest);
    }
    return HOBBLE_OK;
}

/* Runs a frame whose targets are in h->goals. */
static int run_frame(hobble *h, const hobble_ground *ground) {
    const model *m = &h->model;
    int error = prepare(h, ground);
    if (error) return error;
    for (int i = 0; i < h->characters; i++) {
        float *x = h->x + (size_t)i * (size_t)m->size[X_SIZE];
        write_inputs(m, &h->state[i], x);
        limit_row(x, m->x_low, m->x_high, m->size[X_SIZE]);
    }
    if (m->size[FORM] == RECORDED) predict_matching(h);
    else if (m->size[FORM] == LEARNED) predict_learned(h);
    else predict_blend(h);
    for (int i = 0; i < h->characters; i++)
        limit_row(h->y + (size_t)i * (size_t)m->size[Y_SIZE], m->y_low, m->y_high, m->size[Y_SIZE]);
    error = place(h, ground);
    if (error) return error;
    for (int i = 0; i < h->characters; i++) {
        character *c = &h->state[i];
        advance(m, c, h->y + (size_t)i * (size_t)m->size[Y_SIZE], h->goals[i].velocity);
        c->report[0] = c->yaw;
        c->report[1] = c->phase;
    }
    return HOBBLE_OK;
}

int hobble_frame(hobble *h, const hobble_target *targets, const hobble_ground *ground) {
    size_t count = (size_t)h->characters;
    int error = HOBBLE_OK;
    if (ground && !ground->function
        && (!ground->heights || ground->rows < 2 || ground->columns < 2 || !(ground->cell > 0)))
        return HOBBLE_BAD_GROUND;
    if (ground) { /* only a ground can fail in the middle of a frame */
        memcpy(h->saved_state, h->state, count * sizeof *h->state);
        memcpy(h->saved_numbers, h->numbers, count * h->number_count * sizeof *h->numbers);
    }
    for (size_t i = 0; i < count; i++) {
        error = read_target(&h->model, &h->state[i], &targets[i], &h->goals[i]);
        if (error) return error;
        limit_target(&h->model, h->state[i].values, &h->goals[i]);
    }
    for (size_t i = 0; i < count; i++) {
        character *c = &h->state[i];
        vary(&h->model, c, &h->goals[i]);
        if (!sound_character(h, c)) start_character(h, c, c->root[0], c->root[2], c->yaw);
    }
    error = ground ? time_steps(h, ground) : HOBBLE_OK;
    if (!error) error = run_frame(h, ground);
    if (error) {
        memcpy(h->state, h->saved_state, count * sizeof *h->state);
        memcpy(h->numbers, h->saved_numbers, count * h->number_count * sizeof *h->numbers);
    }
    return error;
}

/* Hands out pieces of the caller's memory; without memory, it only adds up their sizes. */
typedef struct {
    unsigned char *base;
    uint64_t used;
} arena;

static void *take(arena *a, uint64_t count, size_t bytes) {
    uint64_t at = (a->used + 7) / 8 * 8;
    a->used = at + count * bytes;
    return a->base ? a->base + at : NULL;
}

/* The numbers of one character, from `at` on: sets the pointers of its state, and returns how many there are.
 */
static size_t lay_out(const hobble *h, character *c, double *at) {
    const model *m = &h->model;
    size_t length = (size_t)m->length, joints = (size_t)m->size[JOINTS], columns = (size_t)m->size[COLUMNS];
    const size_t counts[12] = {2 * length, 2 * length, GAITS * length, 3 * (size_t)m->samples,
                               3 * joints, 3 * joints, 4 * joints,     3 * joints,
                               4 * joints, columns,    columns,        (size_t)h->memory_size};
    double *starts[12];
    size_t used = 0;
    for (int i = 0; i < 12; i++) {
        starts[i] = at ? at + used : NULL;
        used += counts[i];
    }
    c->position = (double (*)[2])starts[0];
    c->direction = (double (*)[2])starts[1];
    c->gait = (double (*)[GAITS])starts[2];
    c->ground = (double (*)[3])starts[3];
    c->joint_position = (double (*)[3])starts[4];
    c->joint_velocity = (double (*)[3])starts[5];
    c->joint_rotation = (double (*)[4])starts[6];
    c->pose_position = (double (*)[3])starts[7];
    c->pose_rotation = (double (*)[4])starts[8];
    c->values = starts[9];
    c->targets = starts[10];
    c->memory = starts[11];
    return used;
}

static size_t widest_layer(const stack *s) {
    size_t widest = 0;
    for (int i = 0; i < s->layers; i++) {
        size_t padded = (size_t)panels_of((uint64_t)s->outputs[i]) * WIDTH, inputs = (size_t)s->inputs[i];
        widest = padded > widest ? padded : widest;
        widest = inputs > widest ? inputs : widest;
    }
    return widest;
}

/* Distributes the memory. h: filled except for its pointers; of the memory's beginning, or a copy to measure.
 */
static void distribute(hobble *h, arena *a) {
    const model *m = &h->model;
    uint64_t count = (uint64_t)h->characters,
             look_ups = (uint64_t)m->samples * 3 > POINTS ? (uint64_t)m->samples * 3 : POINTS;
    uint64_t blocks = ((uint64_t)m->size[ROWS] + BLOCK - 1) / BLOCK * (uint64_t)m->size[FEATURES];
    const stack *const stacks[4] = {&m->network, &m->gate, &m->stepper, &m->projector};
    int plays = m->size[FORM] >= RECORDED, learned = m->size[FORM] == LEARNED;
    uint64_t state = learned ? (uint64_t)m->size[FEATURES] + (uint64_t)m->size[LATENT] : 0;
    uint64_t of_states = 3 * state + (uint64_t)m->size[FEATURES] + 2 * ((uint64_t)m->size[Y_SIZE] + 2);
    character one;
    h->widest = 0;
    for (int i = 0; i < 4; i++) {
        size_t widest = widest_layer(stacks[i]);
        h->widest = widest > h->widest ? widest : h->widest;
    }
    h->memory_size = plays ? OFFSETS + (int)state + OFFSETS_PER_JOINT * m->size[JOINTS]
                     : m->size[FORM] == GATED && m->size[LATENT] ? ROW + 1 + remembered_count(m)
                                                                 : 0;
    h->number_count = lay_out(h, &one, NULL);
    h->names = take(a, (uint64_t)name_count(m), sizeof *h->names);
    h->state = take(a, count, sizeof *h->state);
    h->saved_state = take(a, count, sizeof *h->state);
    h->numbers = take(a, count * h->number_count, sizeof(double));
    h->saved_numbers = take(a, count * h->number_count, sizeof(double));
    h->goals = take(a, count, sizeof *h->goals);
    h->points = take(a, count * look_ups * 2, sizeof(double));
    h->heights = take(a, count * look_ups, sizeof(double));
    h->powers = take(a, 2 * (uint64_t)m->length, sizeof(double));
    h->rows_old = take(a, plays ? 4 * (uint64_t)m->size[Y_SIZE] : 0, sizeof(double));
    h->states = take(a, learned ? count * of_states : 0, sizeof(float));
    h->slots = take(a, count, sizeof *h->slots);
    h->members = take(a, count, sizeof *h->members);
    h->x = take(a, count * (uint64_t)m->size[X_SIZE], sizeof(float));
    h->z = take(a, count * ((uint64_t)m->size[INPUTS] + 2), sizeof(float));
    h->y = take(a, count * (uint64_t)m->size[Y_SIZE], sizeof(float));
    h->shares = take(a, count * ((uint64_t)m->size[SETS] + 1), sizeof(float));
    h->gate_inputs = take(a, count * (uint64_t)m->size[GATE_INPUTS], sizeof(float));
    h->room = take(a, 4 * count * h->widest, sizeof(float));
    h->query = take(a, (uint64_t)m->size[FEATURES], sizeof(float));
    h->block_low = take(a, blocks, sizeof(float));
    h->block_high = take(a, blocks, sizeof(float));
}

/* Reads the file into `h`, and measures the memory that `characters` need; 0 if the file is refused. */
static size_t measure(hobble *h, const void *file, size_t bytes, int characters, char *why) {
    arena measured = {NULL, sizeof *h};
    if (why) why[0] = 0;
    if (characters < 1 || characters > MOST_CHARACTERS) {
        if (why) snprintf(why, HOBBLE_WHY, "%d characters: 1 to %d are allowed", characters, MOST_CHARACTERS);
        return 0;
    }
    if (!read_model(file, bytes, &h->model, why)) return 0;
    h->characters = characters;
    distribute(h, &measured);
    if (measured.used > SIZE_MAX / 2) {
        if (why) snprintf(why, HOBBLE_WHY, "%d characters need more memory than there can be", characters);
        return 0;
    }
    return (size_t)measured.used;
}

size_t hobble_size(const void *file, size_t bytes, int characters, char *why) {
    hobble h = {0};
    return measure(&h, file, bytes, characters, why);
}

hobble *hobble_create(const void *file, size_t bytes, int characters, void *memory, size_t size, char *why) {
    hobble read = {0}, *h = memory;
    size_t needed = measure(&read, file, bytes, characters, why);
    if (!needed) return NULL;
    if (!memory || size < needed || (uintptr_t)memory % 8) {
        if (why) snprintf(why, HOBBLE_WHY, "the memory is too small or not aligned to 8 bytes");
        return NULL;
    }
    arena a = {memory, sizeof *h};
    memset(memory, 0, needed);
    *h = read;
    h->wide = can_be_wide();
    distribute(h, &a);
    const char *name = h->model.names;
    for (int i = 0; i < name_count(&h->model); i++, name += strlen(name) + 1) h->names[i] = name;
    h->powers_strafe = -1; /* no share of strafing */
    if (h->model.size[FORM] == RECORDED) measure_blocks(h);
    for (int i = 0; i < characters; i++) {
        lay_out(h, &h->state[i], h->numbers + (size_t)i * h->number_count);
        hobble_reset(h, i, 0, 0, 0);
    }
    return h;
}

const char *hobble_error(int code) {
    switch (code) {
        case HOBBLE_OK: return "no error";
        case HOBBLE_NO_SUCH: return "there is no such character, joint, gait or column";
        case HOBBLE_BAD_VALUE: return "the value is not a number in the allowed range";
        case HOBBLE_BAD_TARGET:
            return "the target is not finite, is faster than 30 cm a frame, or has no such gait";
        case HOBBLE_BAD_GROUND:
            return "the ground has no heights, or heights that are not finite or above 100 km";
        default: return "unknown error";
    }
}

static int has_character(const hobble *h, int i) { return i >= 0 && i < h->characters; }

int hobble_reset(hobble *h, int i, double x, double z, double yaw) {
    if (!has_character(h, i)) return HOBBLE_NO_SUCH;
    if (!(fabs(x) <= FARTHEST) || !(fabs(z) <= FARTHEST) || !(fabs(yaw) <= 1e6)) return HOBBLE_BAD_VALUE;
    memcpy(h->state[i].targets, h->model.defaults, (size_t)h->model.size[COLUMNS] * sizeof(double));
    start_character(h, &h->state[i], x, z, yaw);
    return HOBBLE_OK;
}

int hobble_copy(hobble *h, int to, const hobble *other, int from, double x, double z) {
    if (!has_character(h, to) || !has_character(other, from)) return HOBBLE_NO_SUCH;
    if (!(fabs(x) <= FARTHEST) || !(fabs(z) <= FARTHEST)
        || memcmp(h->model.size, other->model.size, sizeof h->model.size))
        return HOBBLE_BAD_VALUE;
    character *c = &h->state[to];
    double *numbers = h->numbers + (size_t)to * h->number_count;
    memmove(numbers, other->numbers + (size_t)from * h->number_count, h->number_count * sizeof *numbers);
    *c = other->state[from];
    lay_out(h, c, numbers);
    for (int i = 0; i < h->model.length; i++) c->position[i][0] += x, c->position[i][1] += z;
    for (int j = 0; j < h->model.size[JOINTS]; j++) {
        c->joint_position[j][0] += x, c->joint_position[j][2] += z;
        c->pose_position[j][0] += x, c->pose_position[j][2] += z;
    }
    for (int f = 0; f < 2; f++) {
        c->foot_hold[f][0] += x, c->foot_hold[f][1] += z;
        for (int i = 0; i < 3; i++) c->leg_shown[f][i][0] += x, c->leg_shown[f][i][2] += z;
    }
    c->root[0] += x;
    c->root[2] += z;
    return HOBBLE_OK;
}

/* Name number `at` of the names that begin with number `first`; NULL unless 0 <= at < count. */
static const char *name_at(const hobble *h, int first, int at, int count) {
    return at >= 0 && at < count ? h->names[first + at] : NULL;
}

/* The number of the name among `count` names that begin with number `first`. */
static int number_of(const hobble *h, int first, int count, const char *name) {
    for (int i = 0; name && i < count; i++)
        if (!strcmp(h->names[first + i], name)) return i;
    return HOBBLE_NO_SUCH;
}

static int first_gait(const hobble *h) { return h->model.size[JOINTS]; }
static int first_channel(const hobble *h) { return first_gait(h) + GAITS; }
static int first_column(const hobble *h) { return first_channel(h) + h->model.size[CHANNELS]; }

int hobble_characters(const hobble *h) { return h->characters; }
int hobble_joints(const hobble *h) { return h->model.size[JOINTS]; }
int hobble_joint(const hobble *h, const char *name) { return number_of(h, 0, h->model.size[JOINTS], name); }
const char *hobble_joint_name(const hobble *h, int joint) {
    return name_at(h, 0, joint, h->model.size[JOINTS]);
}
int hobble_joint_parent(const hobble *h, int joint) {
    return hobble_joint_name(h, joint) ? h->model.parents[joint] : HOBBLE_NO_SUCH;
}
const double *hobble_joint_offset(const hobble *h, int joint) {
    return hobble_joint_name(h, joint) ? h->model.offsets + 3 * joint : NULL;
}
int hobble_gait(const hobble *h, const char *name) { return number_of(h, first_gait(h), GAITS, name); }
const char *hobble_gait_name(const hobble *h, int gait) { return name_at(h, first_gait(h), gait, GAITS); }

int hobble_columns(const hobble *h) { return h->model.size[COLUMNS]; }
const char *hobble_column_label(const hobble *h, int column) {
    return name_at(h, first_column(h), column, hobble_columns(h));
}
const char *hobble_column_part(const hobble *h, int column) {
    return name_at(h, first_column(h) + hobble_columns(h), column, hobble_columns(h));
}
double hobble_highest(const hobble *h, int column) {
    return hobble_column_label(h, column) ? h->model.highest[column] : HOBBLE_NO_SUCH;
}

const char *hobble_column_channel(const hobble *h, int column) {
    return hobble_column_label(h, column) ? h->names[first_channel(h) + h->model.channel_of[column]] : NULL;
}

int hobble_column(const hobble *h, const char *channel_name, const char *name) {
    for (int k = 0; name && k < hobble_columns(h); k++) {
        if (channel_name && strcmp(channel_name, hobble_column_channel(h, k))) continue;
        if (!strcmp(name, hobble_column_label(h, k)) || !strcmp(name, hobble_column_part(h, k))) return k;
    }
    return HOBBLE_NO_SUCH;
}

int hobble_set(hobble *h, int i, int column, double value) {
    if (!has_character(h, i) || !hobble_column_label(h, column)) return HOBBLE_NO_SUCH;
    if (!(value >= 0 && value <= h->model.highest[column])) return HOBBLE_BAD_VALUE;
    h->state[i].targets[column] = value / h->model.scales[column];
    return HOBBLE_OK;
}

int hobble_vary(hobble *h, int i, double amount, unsigned seed) {
    if (!has_character(h, i)) return HOBBLE_NO_SUCH;
    if (!(amount >= 0 && amount <= 10)) return HOBBLE_BAD_VALUE;
    character *c = &h->state[i];
    c->variation = amount;
    c->seed = seed;
    c->pace = c->shown = 1;
    if (amount == 0) {
        memset(c->knee_more, 0, sizeof c->knee_more);
        memset(c->arm_more, 0, sizeof c->arm_more);
    }
    return HOBBLE_OK;
}

const double *hobble_positions(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].pose_position[0] : NULL;
}
const double *hobble_rotations(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].pose_rotation[0] : NULL;
}
const double *hobble_root(const hobble *h, int i) { return has_character(h, i) ? h->state[i].root : NULL; }
const double *hobble_state(const hobble *h, int i) { return has_character(h, i) ? h->state[i].report : NULL; }
/* Places all joints but the root from the positions and rotations of their parents. */
static void place_joints(const model *m, double *positions, const double *rotations) {
    for (int j = 1; j < m->size[JOINTS]; j++) {
        const double *parent = positions + 3 * m->parents[j];
        double *place = positions + 3 * j;
        turn_vector(rotations + 4 * m->parents[j], m->offsets + 3 * j, place);
        for (int i = 0; i < 3; i++) place[i] += parent[i];
    }
}

/* Turns thigh and shank so that the heel moves by `shift` (law of cosines); the foot keeps its rotation. */
static void reach(const int32_t *leg, const double *positions, double *rotations, const double *shift) {
    const double *hip = positions + 3 * leg[HIP], *knee = positions + 3 * leg[KNEE],
                 *heel = positions + 3 * leg[HEEL];
    double thigh[3], shank[3], line[3], turn[4];
    minus(knee, hip, thigh);
    minus(heel, knee, shank);
    for (int i = 0; i < 3; i++) line[i] = heel[i] + shift[i] - hip[i];
    double upper = sqrt(dot3(thigh, thigh)), lower = sqrt(dot3(shank, shank)),
           size = larger(sqrt(dot3(line, line)), 1e-9);
    for (int i = 0; i < 3; i++) line[i] /= size;
    double distance = clamp(size, fabs(upper - lower) * 1.001 + 1e-6, (upper + lower) * 0.999);
    double cosine =
        clamp((upper * upper + distance * distance - lower * lower) / (2 * upper * distance), -1, 1);
    double sine = sqrt(1 - cosine * cosine), along = dot3(thigh, line), out[3], bent[3];
    for (int i = 0; i < 3; i++) out[i] = thigh[i] - along * line[i];
    double wide = larger(sqrt(dot3(out, out)), 1e-9);
    for (int i = 0; i < 3; i++) {
        bent[i] = upper * (line[i] * cosine + out[i] / wide * sine);
        line[i] = line[i] * distance - bent[i];
    }
    rotation_between(thigh, bent, turn);
    turn_rotation(turn, rotations + 4 * leg[HIP]);
    rotation_between(shank, line, turn);
    turn_rotation(turn, rotations + 4 * leg[KNEE]);
}

int hobble_bones(const hobble *h, int i, double *positions, double *rotations) {
    if (!has_character(h, i)) return HOBBLE_NO_SUCH;
    const model *m = &h->model;
    const character *c = &h->state[i];
    memcpy(rotations, c->pose_rotation, 4 * (size_t)m->size[JOINTS] * sizeof *rotations);
    memcpy(positions, c->pose_position, 3 * sizeof *positions);
    place_joints(m, positions, rotations);
    for (int f = 0; f < 2; f++) {
        const int32_t *leg = m->legs + 4 * f;
        double shift[3];
        minus(c->pose_position[leg[TOE]], positions + 3 * leg[TOE], shift);
        reach(leg, positions, rotations, shift);
    }
    place_joints(m, positions, rotations);
    return HOBBLE_OK;
}

int hobble_path_frames(const hobble *h) { return h->model.length; }
const double *hobble_path(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].position[0] : NULL;
}
const double *hobble_path_directions(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].direction[0] : NULL;
}
const double *hobble_path_gaits(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].gait[0] : NULL;
}
const double *hobble_ground_samples(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].ground[0] : NULL;
}
const double *hobble_joint_velocities(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].joint_velocity[0] : NULL;
}
const double *hobble_values(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].values : NULL;
}
const double *hobble_feet(const hobble *h, int i) {
    return has_character(h, i) ? h->state[i].foot_lock : NULL;
}
