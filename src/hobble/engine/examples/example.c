/* A character walks ahead, its left thigh begins to hurt, and it turns toward +X.

   cc -O3 -march=native -I.. example.c ../hobble.c -o example -lm && ./example ../character.hob */
#include "hobble.h"

#include <stdio.h>
#include <stdlib.h>

static void *read_file(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    void *data = NULL;
    if (!file) return NULL;
    if (fseek(file, 0, SEEK_END) == 0) {
        long size = ftell(file);
        rewind(file);
        data = size > 0 ? malloc((size_t)size) : NULL;
        *bytes = data ? fread(data, 1, (size_t)size, file) : 0;
    }
    fclose(file);
    return data;
}

int main(int count, char **arguments) {
    char why[HOBBLE_WHY] = "it cannot be read";
    size_t bytes = 0, size = 0;
    void *file = count == 2 ? read_file(arguments[1], &bytes) : NULL, *memory = NULL;
    hobble *h = NULL;
    if (file) size = hobble_size(file, bytes, 1, why);
    if (size) memory = malloc(size);
    if (memory) h = hobble_create(file, bytes, 1, memory, size, why);
    if (!h) {
        fprintf(stderr, "usage: example character.hob (%s)\n", why);
        free(memory);
        free(file);
        return 1;
    }
    hobble_target target = {.velocity = {0, 2.5}, .gait = HOBBLE_BY_SPEED};
    int hips = hobble_joint(h, "Hips"), thigh = hobble_column(h, "injury", "left thigh");
    for (int frame = 0; frame < 300; frame++) {
        if (frame == 120 && thigh >= 0) hobble_set(h, 0, thigh, 7);
        if (frame == 180) target.velocity[0] = 2.5, target.velocity[1] = 0;
        int error = hobble_frame(h, &target, NULL);
        if (error) fprintf(stderr, "%s\n", hobble_error(error));
        if (frame % 60 == 59) {
            const double *at = hobble_positions(h, 0) + 3 * (hips < 0 ? 0 : hips),
                         *state = hobble_state(h, 0);
            printf("%d s: hips at %7.1f %6.1f %7.1f cm, yaw %5.2f, phase %.2f\n", frame / 60 + 1, at[0],
                   at[1], at[2], state[0], state[1]);
        }
    }
    free(memory);
    free(file);
    return 0;
}
