/* Checks a runtime against golden traces (*.trace), which src/hobble/engine/traces.py explains.

   cc -O3 -march=native -I.. check_traces.c ../hobble.c -o check_traces -lm
   ./check_traces ../character.hob ../traces/walk.trace ../traces/hills.trace ...

   Prints the largest distance of a joint from where it should be, after 60 frames and in all, and the largest
   difference of a rotation. Exits with 1 if a distance is above 1e-3 cm after 60 frames, or above .5 cm
   later. */
#include "hobble.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *read_file(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    void *data = NULL;
    if (!file || fseek(file, 0, SEEK_END)) return NULL;
    long size = ftell(file);
    rewind(file);
    data = size > 0 ? malloc((size_t)size) : NULL;
    *bytes = data ? fread(data, 1, (size_t)size, file) : 0;
    fclose(file);
    return data;
}

/* Runs one trace. Returns whether the runtime agrees with it. */
static int check(hobble *h, const char *path) {
    size_t bytes = 0;
    unsigned char *data = read_file(path, &bytes);
    uint32_t head[7];
    double variation = 0;
    hobble_ground ground = {0};
    if (!data || bytes < 52 || memcmp(data, "HOBTRACE", 8)) return free(data), 0;
    memcpy(head, data + 8, sizeof head);
    memcpy(&variation, data + 36, sizeof variation);
    memcpy(&ground.cell, data + 44, sizeof ground.cell);
    size_t frames = head[1], joints = head[2], columns = head[3], grid = (size_t)head[4] * head[5],
           record = 14 + columns + 7 * joints;
    int fits = head[0] == 2 && (int)joints == hobble_joints(h) && (int)columns == hobble_columns(h)
               && bytes == 52 + 4 * (grid + frames * record);
    if (!fits) return free(data), 0;
    const float *numbers = (const float *)(data + 52);
    ground.heights = numbers;
    ground.rows = (int)head[4];
    ground.columns = (int)head[5];
    numbers += grid;
    double early = 0, late = 0, turns = 0;
    hobble_reset(h, 0, 0, 0, 0);
    hobble_vary(h, 0, variation, head[6]);
    for (size_t f = 0; f < frames; f++, numbers += record) {
        hobble_target target = {{numbers[0], numbers[1]}, {numbers[2], numbers[3]}, {0}, (int)numbers[4]};
        for (size_t k = 0; k < columns; k++) hobble_set(h, 0, (int)k, numbers[5 + k]);
        if (hobble_frame(h, &target, grid ? &ground : NULL)) return free(data), 0;
        const float *positions = numbers + 14 + columns, *rotations = positions + 3 * joints;
        for (size_t i = 0; i < 3 * joints; i++)
            late = fmax(late, fabs(hobble_positions(h, 0)[i] - positions[i]));
        for (size_t i = 0; i < 4 * joints; i++)
            turns = fmax(turns, fabs(hobble_rotations(h, 0)[i] - rotations[i]));
        if (f == 59) early = late;
    }
    printf("%s: %.2g cm after 60 frames, %.2g cm after %d, rotations %.2g\n", path, early, late, (int)frames,
           turns);
    free(data);
    return early <= 1e-3 && late <= 0.5;
}

int main(int count, char **arguments) {
    char why[HOBBLE_WHY] = "it cannot be read";
    size_t bytes = 0, size = 0;
    void *file = count > 1 ? read_file(arguments[1], &bytes) : NULL, *memory;
    if (file) size = hobble_size(file, bytes, 1, why);
    memory = size ? malloc(size) : NULL;
    hobble *h = memory ? hobble_create(file, bytes, 1, memory, size, why) : NULL;
    if (!h) fprintf(stderr, "usage: check_traces character.hob TRACE... (%s)\n", why);
    int agree = h != NULL;
    for (int i = 2; h && i < count; i++)
        if (!check(h, arguments[i])) {
            printf("%s: the runtime does not agree with it\n", arguments[i]);
            agree = 0;
        }
    free(memory);
    free(file);
    return !agree;
}
