/* See hobble_gait.h. cycles.py, profile.py and recognise.py explain the rules and the constants. */
#include "hobble_gait.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FPS 60.0
#define DEGREES (180 / 3.14159265358979323846)
#define STANDING_SPEED 0.35
#define LEAST_TRAVEL 0.2
#define LEAST_SWING 0.12
#define LEAST_SWING_SHARE 0.4
#define MOST_TURN 25.0
#define LEAST_AHEAD 0.7
#define LEAST_RANGE 3.0
#define MOST_RATIO 5.0

enum { SHORTEST = 24, LONGEST = 210, SIGMA = 30, REACH = 4 * SIGMA, SAMPLES = 50, MOST_CYCLES = 12 };
enum { FRAMES = HOBBLE_GAIT_FRAMES, FEATURES = HOBBLE_GAIT_FEATURES };
enum { HIP, KNEE, HEEL, SHOULDER, HAND }; /* places of a side in `joints` */
/* Curves: those of the left side, those of the right side, those of the middle. */
enum { HIP_FLEXION, HIP_ABDUCTION, KNEE_FLEXION, ANKLE_HEIGHT, ANKLE_FORWARD, ARM_FORWARD, LIMBS };
enum { TRUNK_FORWARD = 2 * LIMBS, TRUNK_LEFT, PELVIS_LEFT_UP, CURVES };
/* Measures of a cycle. */
enum { SECONDS, SPEED, LEFT_LANDING, STANCE_R, STANCE_L, STEP_R, STEP_L, STEP_WIDTH, SCALARS };
enum { RANGES = SCALARS, MEANS = SCALARS + CURVES };

/* A body over time, of which the lengths are in leg lengths and the angles in degrees. */
typedef struct {
    int count;
    double curve[CURVES][FRAMES], ankle_speed[2][FRAMES], across[2][FRAMES];
    double heading[FRAMES], ahead[FRAMES], hips[FRAMES][2];
} signals;

typedef struct { /* positions of joints, mirrored if `sign` is -1 */
    const double *frames;
    const int *joints;
    int count, width;
    double sign;
} body;

typedef struct {
    double scalars[SCALARS], curve[CURVES][SAMPLES];
} cycle;

/* A joint in a frame. joint: its place in the unmirrored `joints`. */
static void at(const body *b, int frame, int joint, double *out) {
    if (b->sign < 0 && joint >= HOBBLE_GAIT_LEFT)
        joint += joint < HOBBLE_GAIT_RIGHT ? HOBBLE_GAIT_RIGHT - HOBBLE_GAIT_LEFT
                                           : HOBBLE_GAIT_LEFT - HOBBLE_GAIT_RIGHT;
    memcpy(out, b->frames + 3 * ((size_t)frame * (size_t)b->width + (size_t)b->joints[joint]), 3 * sizeof *out);
    out[0] *= b->sign;
}

/* From joint a to joint b. */
static void way(const body *w, int frame, int a, int b, double *out) {
    double from[3];
    at(w, frame, a, from);
    at(w, frame, b, out);
    for (int i = 0; i < 3; i++) out[i] -= from[i];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static double size(const double *a) { return sqrt(dot(a, a)); }
static double angle(double opposite, double adjacent) { return atan2(opposite, adjacent) * DEGREES; }

static void make_unit(double *a) {
    double n = fmax(size(a), 1e-9);
    for (int i = 0; i < 3; i++) a[i] /= n;
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, ascending);
    return (values[(count - 1) / 2] + values[count / 2]) / 2;
}

/* Smooths vectors with a Gaussian; past the ends, the first and the last repeat. */
static void smooth(const double (*in)[3], int count, double (*out)[3]) {
    double weights[REACH + 1], total = -1;
    for (int i = 0; i <= REACH; i++)
        total += 2 * (weights[i] = exp(-0.5 * (double)i * i / ((double)SIGMA * SIGMA)));
    for (int f = 0; f < count; f++) {
        memset(out[f], 0, sizeof out[f]);
        for (int i = -REACH; i <= REACH; i++) {
            int k = f + i < 0 ? 0 : f + i < count ? f + i : count - 1;
            for (int x = 0; x < 3; x++) out[f][x] += weights[abs(i)] / total * in[k][x];
        }
    }
}

/* The change of a joint per frame: half the difference of the frames before and after. */
static void change(const body *b, int frame, int joint, double *out) {
    int before = frame > 0 ? frame - 1 : 0, after = frame < b->count - 1 ? frame + 1 : frame;
    double from[3];
    at(b, before, joint, from);
    at(b, after, joint, out);
    for (int i = 0; i < 3; i++) out[i] = (out[i] - from[i]) / (after - before);
}

static double leg_length(const body *b) {
    static const int bones[2] = {HIP, KNEE};
    double lengths[FRAMES], bone[3], total = 0;
    for (int side = HOBBLE_GAIT_LEFT; side <= HOBBLE_GAIT_RIGHT; side += HOBBLE_GAIT_RIGHT - HOBBLE_GAIT_LEFT)
        for (int k = 0; k < 2; k++) {
            for (int f = 0; f < b->count; f++) {
                way(b, f, side + bones[k], side + bones[k] + 1, bone);
                lengths[f] = size(bone);
            }
            total += median(lengths, b->count) / 2;
        }
    return total;
}

/* The curves of one side in a frame. first: its first place in `joints`. out: direction away from the body. */
static void measure_side(const body *b, signals *s, int f, int side, const double *ahead, const double *left,
                         double leg) {
    int first = side ? HOBBLE_GAIT_RIGHT : HOBBLE_GAIT_LEFT;
    double thigh[3], shank[3], ankle[3], heel[3], arm[3], speed[3], (*curve)[FRAMES] = s->curve + LIMBS * side;
    way(b, f, first + HIP, first + KNEE, thigh);
    way(b, f, first + KNEE, first + HEEL, shank);
    way(b, f, HOBBLE_GAIT_HIPS, first + HEEL, ankle);
    at(b, f, first + HEEL, heel);
    change(b, f, first + HEEL, speed);
    double bend[3] = {thigh[1] * shank[2] - thigh[2] * shank[1], thigh[2] * shank[0] - thigh[0] * shank[2],
                      thigh[0] * shank[1] - thigh[1] * shank[0]};
    curve[HIP_FLEXION][f] = angle(dot(thigh, ahead), -thigh[1]);
    curve[HIP_ABDUCTION][f] = angle((side ? -1 : 1) * dot(thigh, left), -thigh[1]);
    curve[KNEE_FLEXION][f] = angle(size(bend), dot(thigh, shank));
    curve[ANKLE_HEIGHT][f] = heel[1] / leg;
    curve[ANKLE_FORWARD][f] = dot(ankle, ahead) / leg;
    curve[ARM_FORWARD][f] = 0;
    if (b->joints[HOBBLE_GAIT_LEFT + HAND] >= 0 && b->joints[HOBBLE_GAIT_RIGHT + HAND] >= 0) {
        way(b, f, first + SHOULDER, first + HAND, arm);
        curve[ARM_FORWARD][f] = angle(dot(arm, ahead), -arm[1]);
    }
    s->ankle_speed[side][f] = hypot(speed[0], speed[2]) * FPS / leg;
    s->across[side][f] = dot(ankle, left) / leg;
}

static void measure_signals(const body *b, signals *s) {
    double raw[FRAMES][3], ahead[FRAMES][3], facing[FRAMES][3], leg = leg_length(b), turns = 0;
    s->count = b->count;
    for (int f = 0; f < b->count; f++) change(b, f, HOBBLE_GAIT_HIPS, raw[f]);
    smooth((const double (*)[3])raw, b->count, ahead);
    for (int f = 0; f < b->count; f++) {
        double trunk[3], pelvis[3], shoulders[3], hips[3];
        ahead[f][1] = 0;
        make_unit(ahead[f]);
        double left[3] = {ahead[f][2], 0, -ahead[f][0]};
        for (int side = 0; side < 2; side++) measure_side(b, s, f, side, ahead[f], left, leg);
        way(b, f, HOBBLE_GAIT_HIPS, HOBBLE_GAIT_TRUNK, trunk);
        way(b, f, HOBBLE_GAIT_RIGHT + HIP, HOBBLE_GAIT_LEFT + HIP, pelvis);
        way(b, f, HOBBLE_GAIT_RIGHT + SHOULDER, HOBBLE_GAIT_LEFT + SHOULDER, shoulders);
        at(b, f, HOBBLE_GAIT_HIPS, hips);
        s->curve[TRUNK_FORWARD][f] = angle(dot(trunk, ahead[f]), trunk[1]);
        s->curve[TRUNK_LEFT][f] = angle(dot(trunk, left), trunk[1]);
        s->curve[PELVIS_LEFT_UP][f] = angle(pelvis[1], hypot(dot(pelvis, left), dot(pelvis, ahead[f])));
        s->hips[f][0] = hips[0] / leg;
        s->hips[f][1] = hips[2] / leg;
        double heading = angle(ahead[f][0], ahead[f][2]); /* without jumps of a whole turn */
        if (f) turns -= round((heading + 360 * turns - s->heading[f - 1]) / 360);
        s->heading[f] = heading + 360 * turns;
        make_unit(pelvis);
        make_unit(shoulders);
        raw[f][0] = -pelvis[2] - shoulders[2];
        raw[f][1] = 0;
        raw[f][2] = pelvis[0] + shoulders[0];
    }
    smooth((const double (*)[3])raw, b->count, facing);
    for (int f = 0; f < b->count; f++) {
        make_unit(facing[f]);
        s->ahead[f] = dot(facing[f], ahead[f]);
    }
}

/* The least movement that counts as a step at a frame. */
static double least_swing(const double *forward, int count, int frame) {
    double low = forward[frame], high = low;
    for (int i = frame - LONGEST / 2; i <= frame + LONGEST / 2; i++) {
        if (i < 0 || i >= count) continue;
        low = fmin(low, forward[i]);
        high = fmax(high, forward[i]);
    }
    return fmax(LEAST_SWING, LEAST_SWING_SHARE * (high - low));
}

/* Writes the frames in which an ankle is furthest ahead, and returns their number. */
static int find_landings(const double *forward, int count, int *landed) {
    int high = 0, low = 0, rising = 1, found = 0;
    for (int i = 0; i < count; i++) {
        if (rising) {
            if (forward[i] > forward[high]) high = i;
            if (forward[high] - forward[i] < least_swing(forward, count, high)) continue;
            if (high > 0) landed[found++] = high;
            rising = 0;
            low = i;
        } else {
            if (forward[i] < forward[low]) low = i;
            if (forward[i] - forward[low] < least_swing(forward, count, low)) continue;
            rising = 1;
            high = i;
        }
    }
    return found;
}

/* The share of the time from frame a to frame b in which values are below a limit. */
static double share_below(const double *values, int a, int b, double limit) {
    double total = 0;
    for (int i = a; i < b; i++) {
        double under = fmax(limit - values[i], 0) + fmax(limit - values[i + 1], 0);
        if (under > 0) total += under / (fabs(limit - values[i]) + fabs(limit - values[i + 1]));
    }
    return total / (b - a);
}

/* Measures the cycle of the right leg from frame a to frame b. other: the frame in which the left foot lands. */
static void measure_cycle(const signals *s, int a, int other, int b, cycle *out) {
    const double *right = s->curve[LIMBS + ANKLE_FORWARD], *left = s->curve[ANKLE_FORWARD];
    double seconds = (b - a) / FPS,
           speed = hypot(s->hips[b][0] - s->hips[a][0], s->hips[b][1] - s->hips[a][1]) / seconds;
    double width = s->across[0][a] - s->across[1][a] + s->across[0][other] - s->across[1][other];
    const double scalars[SCALARS] = {seconds,
                                     speed,
                                     (double)(other - a) / (b - a),
                                     share_below(s->ankle_speed[1], a, b, STANDING_SPEED * speed),
                                     share_below(s->ankle_speed[0], a, b, STANDING_SPEED * speed),
                                     right[a] - left[a],
                                     left[other] - right[other],
                                     width / 2};
    memcpy(out->scalars, scalars, sizeof scalars);
    for (int k = 0; k < SAMPLES; k++) {
        double t = a + (double)(b - a) * k / SAMPLES;
        int f = (int)t < b - 1 ? (int)t : b - 1;
        for (int c = 0; c < CURVES; c++)
            out->curve[c][k] = s->curve[c][f] + (t - f) * (s->curve[c][f + 1] - s->curve[c][f]);
    }
}

/* Whether the figure walks straight ahead from frame a to frame b. */
static int walks_straight(const signals *s, int a, int b) {
    double travel = 0, ahead = 0;
    for (int f = a; f < b; f++) {
        travel += hypot(s->hips[f + 1][0] - s->hips[f][0], s->hips[f + 1][1] - s->hips[f][1]);
        ahead += s->ahead[f] / (b - a);
    }
    return travel >= LEAST_TRAVEL && fabs(s->heading[b] - s->heading[a]) <= MOST_TURN && ahead >= LEAST_AHEAD;
}

/* Writes the profile of the cycles of the right leg, and returns their number. */
static int profile_right(const body *b, double *profile) {
    signals s;
    cycle cycles[MOST_CYCLES];
    int right[FRAMES], left[FRAMES], found = 0;
    double values[MOST_CYCLES];
    measure_signals(b, &s);
    int rights = find_landings(s.curve[LIMBS + ANKLE_FORWARD], s.count, right),
        lefts = find_landings(s.curve[ANKLE_FORWARD], s.count, left);
    for (int i = 1; i < rights && found < MOST_CYCLES; i++) {
        int start = right[i - 1], end = right[i], between = 0, other = 0;
        for (int k = 0; k < lefts; k++)
            if (start < left[k] && left[k] < end) between++, other = left[k];
        if (between == 1 && end - start >= SHORTEST && end - start <= LONGEST && walks_straight(&s, start, end))
            measure_cycle(&s, start, other, end, &cycles[found++]);
    }
    if (!found) return 0;
    for (int k = 0; k < SCALARS; k++) {
        for (int i = 0; i < found; i++) values[i] = cycles[i].scalars[k];
        profile[k] = median(values, found);
    }
    for (int c = 0; c < CURVES; c++) {
        double low = INFINITY, high = -INFINITY, total = 0;
        for (int k = 0; k < SAMPLES; k++) {
            for (int i = 0; i < found; i++) values[i] = cycles[i].curve[c][k];
            double value = median(values, found);
            low = fmin(low, value);
            high = fmax(high, value);
            total += value;
        }
        profile[RANGES + c] = high - low;
        profile[MEANS + c] = total / SAMPLES;
    }
    return found;
}

/* The place of a number of a profile in the profile of the mirrored walk. */
static int mirrored(int k) {
    if (k == STANCE_R || k == STEP_R) return k + 1;
    if (k == STANCE_L || k == STEP_L) return k - 1;
    int curve = (k - RANGES) % CURVES;
    if (k < RANGES || curve >= 2 * LIMBS) return k;
    return curve < LIMBS ? k + LIMBS : k - LIMBS;
}

int hobble_gait_profile(const double *frames, int count, int width, const int *joints, double *profile) {
    double right[HOBBLE_GAIT_PROFILE], left[HOBBLE_GAIT_PROFILE];
    body b = {frames, joints, count, width, 1};
    if (count < SHORTEST || count > FRAMES) return 0;
    int rights = profile_right(&b, right);
    b.sign = -1;
    int lefts = rights ? profile_right(&b, left) : 0;
    if (!rights || !lefts) return 0;
    for (int k = 0; k < HOBBLE_GAIT_PROFILE; k++) {
        double other = left[mirrored(k)];
        if (k == LEFT_LANDING) other = 1 - other;
        if (k == MEANS + TRUNK_LEFT || k == MEANS + PELVIS_LEFT_UP) other = -other;
        profile[k] = (right[k] + other) / 2;
    }
    return rights < lefts ? rights : lefts;
}

/* The range of a curve as a share of its healthy range. */
static double range_ratio(const double *walk, const double *healthy, int curve) {
    return fmin(fmax(walk[RANGES + curve], LEAST_RANGE) / fmax(healthy[RANGES + curve], LEAST_RANGE),
                MOST_RATIO);
}

/* Writes the features (FEATURES) of a walk, in the order of `features` in profile.py. */
static void write_features(const double *walk, const double *healthy, double *out) {
    static const int means[6] = {LIMBS + KNEE_FLEXION, KNEE_FLEXION,          LIMBS + HIP_FLEXION,
                                 HIP_FLEXION,          LIMBS + HIP_ABDUCTION, HIP_ABDUCTION};
    double by[HOBBLE_GAIT_PROFILE];
    for (int k = 0; k < HOBBLE_GAIT_PROFILE; k++) by[k] = walk[k] - healthy[k];
    *out++ = by[STANCE_L] - by[STANCE_R];
    *out++ = by[LEFT_LANDING];
    *out++ = by[STEP_R] - by[STEP_L];
    *out++ = by[STEP_WIDTH];
    *out++ = by[RANGES + LIMBS + HIP_ABDUCTION] - by[RANGES + HIP_ABDUCTION];
    *out++ = by[RANGES + LIMBS + ANKLE_HEIGHT] - by[RANGES + ANKLE_HEIGHT];
    *out++ = range_ratio(walk, healthy, LIMBS + KNEE_FLEXION) - range_ratio(walk, healthy, KNEE_FLEXION);
    *out++ = range_ratio(walk, healthy, LIMBS + HIP_FLEXION) - range_ratio(walk, healthy, HIP_FLEXION);
    double arms = log(range_ratio(walk, healthy, LIMBS + ARM_FORWARD) / range_ratio(walk, healthy, ARM_FORWARD));
    *out++ = fmin(fmax(arms, -log(MOST_RATIO)), log(MOST_RATIO));
    for (int i = 0; i < 6; i++) *out++ = by[MEANS + means[i]];
    for (int c = TRUNK_FORWARD; c < CURVES; c++) {
        *out++ = by[RANGES + c];
        *out++ = by[MEANS + c];
    }
}

/* The logarithm of a normal density of the features x, up to a constant, and their squared distance from its
   mean, in standard deviations. strength: by which `mean` is multiplied, and the root of `spread`. */
static double log_density(const double *healthy, const double *mean, const double *spread, double strength,
                          const double *x, double *squared) {
    double low[FEATURES][FEATURES], z[FEATURES], peak = 0; /* low: the factor of Cholesky */
    *squared = 0;
    for (int i = 0; i < FEATURES; i++) {
        z[i] = x[i] - (mean ? strength * mean[i] : 0);
        for (int j = 0; j <= i; j++) {
            double sum = healthy[FEATURES * i + j];
            if (spread) sum += strength * strength * spread[FEATURES * i + j];
            for (int k = 0; k < j; k++) sum -= low[i][k] * low[j][k];
            low[i][j] = i == j ? sqrt(sum) : sum / low[j][j];
            if (j < i) z[i] -= low[i][j] * z[j];
        }
        z[i] /= low[i][i];
        *squared += z[i] * z[i];
        peak -= log(low[i][i]);
    }
    return peak - 0.5 * *squared;
}

void hobble_gait_recognise(const double *learnt, const double *walk, const double *healthy, double *answer) {
    enum { MOST_STRENGTHS = 16, SQUARE = FEATURES * FEATURES, KIND = 1 + FEATURES + SQUARE };
    int kinds = (int)fmin(learnt[0], HOBBLE_GAIT_KINDS), tried = (int)fmin(learnt[1], MOST_STRENGTHS);
    const double *strength = learnt + 2, *spread = strength + tried, *kind = spread + SQUARE;
    double x[FEATURES], scores[HOBBLE_GAIT_KINDS * MOST_STRENGTHS], of_label[HOBBLE_GAIT_KINDS] = {0};
    double nearest, squared, *probability = answer + 4, prior = -log((double)(kinds * tried));
    write_features(walk, healthy, x);
    double normal = log_density(spread, NULL, NULL, 0, x, &nearest), most = normal;
    for (int i = 0; i < kinds * tried; i++) {
        const double *one = kind + KIND * (i / tried);
        scores[i] =
            prior + log_density(spread, one + 1, one + 1 + FEATURES, strength[i % tried], x, &squared);
        if (scores[i] <= most) continue;
        most = scores[i];
        nearest = squared;
    }
    double total = normal = exp(normal - most), best = normal;
    for (int k = 0; k < kinds; k++) {
        probability[k] = 0;
        for (int s = 0; s < tried; s++) probability[k] += exp(scores[tried * k + s] - most);
        total += probability[k];
    }
    for (int k = 0; k < kinds; k++)
        for (int i = 0; i < kinds; i++)
            if (kind[KIND * i] == kind[KIND * k]) of_label[k] += probability[i];
    int found = -1; /* of the likeliest limp, both sides together, its likelier side */
    for (int k = 0; k < kinds; k++) {
        int same = found >= 0 && kind[KIND * found] == kind[KIND * k];
        if (same ? probability[k] <= probability[found] : of_label[k] <= best) continue;
        best = of_label[k];
        found = k;
    }
    answer[0] = found;
    answer[1] = 0;
    for (int s = 0; found >= 0 && s < tried; s++)
        answer[1] += strength[s] * exp(scores[tried * found + s] - most) / probability[found];
    answer[2] = sqrt(nearest / FEATURES);
    answer[3] = normal / total;
    for (int k = 0; k < kinds; k++) probability[k] /= total;
}
