/* Hobble in your engine: one character, or a crowd of them, driven by one character file (character.hob).

   It is C99 and needs only libm. It allocates nothing: you give it the memory. It has no global state. Load,
   then call hobble_frame sixty times a second:

       char why[HOBBLE_WHY];
       size_t size = hobble_size(file, bytes, 1, why);       // 0: the file is refused, `why` says why
       hobble *h = hobble_create(file, bytes, 1, malloc(size), size, why);
       hobble_target target = {.velocity = {0, 2.5}, .gait = HOBBLE_BY_SPEED};
       hobble_set(h, 0, hobble_column(h, "injury", "left thigh"), 7);
       hobble_frame(h, &target, NULL);
       const double *positions = hobble_positions(h, 0);

   Axes are right-handed: +Y up, +Z ahead, +X left. Lengths are in cm, speeds in cm a frame (1/60 s).
   Quaternions are w, x, y, z. Functions that return int return HOBBLE_OK or an error, which hobble_error puts
   into words; after an error nothing has changed. Characters are numbered from 0. */
#ifndef HOBBLE_H
#define HOBBLE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef HOBBLE_API
#ifdef _WIN32
#define HOBBLE_API
#else
#define HOBBLE_API __attribute__((visibility("default")))
#endif
#endif

#define HOBBLE_FILE_VERSION 5 /* of the character files that this runtime reads */
#define HOBBLE_WHY 160        /* size of the text that says why a file is refused */
#define HOBBLE_GAITS 6        /* every character has stand, walk, jog, crouch, jump and bump */

enum {
    HOBBLE_OK = 0,
    HOBBLE_NO_SUCH = -1,
    HOBBLE_BAD_VALUE = -2,
    HOBBLE_BAD_TARGET = -3,
    HOBBLE_BAD_GROUND = -4
};

/* Values of hobble_target.gait besides the number of a gait. */
enum {
    HOBBLE_BY_SPEED = -1, /* walk or jog, by the speed of the target */
    HOBBLE_SHARES = -2
}; /* the mixture hobble_target.shares */

typedef struct hobble hobble;

/* What a character shall do in the next frame. */
typedef struct {
    double velocity[2];          /* x and z, cm a frame; at most 30. Below .1 it stands. */
    double facing[2];            /* x and z of the direction to look in, of any length; 0, 0: where it goes */
    double shares[HOBBLE_GAITS]; /* 0 to 1 each; read only if gait is HOBBLE_SHARES */
    int gait;                    /* from hobble_gait, or HOBBLE_BY_SPEED, or HOBBLE_SHARES */
} hobble_target;

/* Writes the heights of the ground at `count` points. points: x and z of each, cm. heights: cm. */
typedef void (*hobble_ground_function)(void *user, int count, const double *points, double *heights);

/* The ground: a function, or a grid of heights (rows along z, columns along x) around a centre. Outside the
   grid, the heights at its border continue. */
typedef struct {
    hobble_ground_function function; /* NULL: the grid is used */
    void *user;                      /* what the function gets as its first argument */
    const float *heights;            /* rows * columns, row by row, cm */
    int rows, columns;               /* 2 or more of each */
    double cell;                     /* cm between two rows or columns */
    double centre[2];                /* x and z of the middle of the grid */
} hobble_ground;

/* The memory that hobble_create needs for this file and number of characters, in bytes. Checks the whole
   file. Returns 0 for a file that is damaged or not a character, and writes the reason into `why` (HOBBLE_WHY
   chars, or NULL). file: the bytes of character.hob, aligned to 8. */
HOBBLE_API size_t hobble_size(const void *file, size_t bytes, int characters, char *why);
/* Starts the characters at the origin, facing +Z. The file's bytes and the memory (aligned to 8) must stay
   where they are as long as the characters are used. Returns NULL as hobble_size returns 0, or for too little
   memory. */
HOBBLE_API hobble *hobble_create(const void *file, size_t bytes, int characters, void *memory, size_t size,
                                 char *why);
HOBBLE_API const char *hobble_error(int code);

/* Starts a character again: x, z in cm, yaw in radians (0 faces +Z, pi / 2 faces +X). */
HOBBLE_API int hobble_reset(hobble *h, int character, double x, double z, double yaw);
/* Makes character `to` of `h` a copy of character `from` of `other`, moved by x, z. Both have the same file.
 */
HOBBLE_API int hobble_copy(hobble *h, int to, const hobble *other, int from, double x, double z);
/* How much the steps of a character differ from each other: 0 not at all, 1 as those of people do, 10 at most.
   The same seed gives the same walk. Both stay when the character starts again. */
HOBBLE_API int hobble_vary(hobble *h, int character, double amount, unsigned seed);
/* Runs one frame of all characters. targets: one for each. ground: NULL for flat ground at 0. */
HOBBLE_API int hobble_frame(hobble *h, const hobble_target *targets, const hobble_ground *ground);

/* Channels, such as injury or mood. Each has columns, and each column a value from 0 to hobble_highest. The
   values approach what is set with hobble_set, in a second or so. */
HOBBLE_API int hobble_columns(const hobble *h);
/* The number of a column. channel: such as "injury", or NULL for any. name: a label such as
   "LeftUpLeg-LeftLeg", or the name of a part such as "left thigh". HOBBLE_NO_SUCH if there is none. */
HOBBLE_API int hobble_column(const hobble *h, const char *channel, const char *name);
HOBBLE_API const char *hobble_column_channel(const hobble *h, int column);
HOBBLE_API const char *hobble_column_label(const hobble *h, int column);
HOBBLE_API const char *hobble_column_part(const hobble *h, int column);
HOBBLE_API double hobble_highest(const hobble *h, int column);
HOBBLE_API int hobble_set(hobble *h, int character, int column, double value);

/* Joints and gaits. Names are UTF-8. A function that gets no valid number returns NULL or HOBBLE_NO_SUCH. */
HOBBLE_API int hobble_characters(const hobble *h);
HOBBLE_API int hobble_joints(const hobble *h);
HOBBLE_API int hobble_joint(const hobble *h, const char *name);
HOBBLE_API const char *hobble_joint_name(const hobble *h, int joint);
HOBBLE_API int hobble_joint_parent(const hobble *h, int joint); /* -1 for the root */
HOBBLE_API const double *hobble_joint_offset(const hobble *h,
                                             int joint); /* (3) from its parent at rest, cm */
HOBBLE_API int hobble_gait(const hobble *h, const char *name);
HOBBLE_API const char *hobble_gait_name(const hobble *h, int gait);

/* The pose of a character after the last frame, in the world. The arrays stay where they are. */
HOBBLE_API const double *hobble_positions(const hobble *h, int character); /* (joints, 3) cm */
HOBBLE_API const double *hobble_rotations(const hobble *h, int character); /* (joints, 4) quaternions */
HOBBLE_API const double *hobble_root(const hobble *h, int character); /* (3) on the ground below the hips */
/* (6) yaw of the root in radians, phase of the gait in cycles, and whether left heel, left toe, right heel
   and right toe touch the ground, 0 to 1. */
HOBBLE_API const double *hobble_state(const hobble *h, int character);
/* Writes the pose with bones that keep their lengths, for a skeleton in your engine; those of a predicted pose
   change a little. The root and the toes are where the pose has them. positions: (joints, 3). rotations:
   (joints, 4), in the world. */
HOBBLE_API int hobble_bones(const hobble *h, int character, double *positions, double *rotations);

/* What happens inside, to draw or to debug. */
HOBBLE_API int hobble_path_frames(const hobble *h);                   /* half of them past, half to come */
HOBBLE_API const double *hobble_path(const hobble *h, int character); /* (frames, 2) x and z of the path */
HOBBLE_API const double *hobble_path_directions(const hobble *h, int character);  /* (frames, 2) facing */
HOBBLE_API const double *hobble_path_gaits(const hobble *h, int character);       /* (frames, 6) shares */
HOBBLE_API const double *hobble_ground_samples(const hobble *h, int character);   /* (samples, 3) heights */
HOBBLE_API const double *hobble_joint_velocities(const hobble *h, int character); /* (joints, 3) cm a frame */
HOBBLE_API const double *hobble_values(const hobble *h, int character);           /* (columns) now */
HOBBLE_API const double *hobble_feet(const hobble *h,
                                     int character); /* (2) 1: held where it landed, 0: free */

#ifdef __cplusplus
}
#endif

#endif
