/* Damages a character file in many ways; each must be refused, or make a character whose poses are finite.

   mutate CHARACTER COUNT SEED: prints how many files were refused. Compiled with AddressSanitizer and UBSan.
 */
#include "hobble.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state;

static uint32_t random_below(uint32_t count) { /* splitmix64 */
    uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (uint32_t)((z ^ z >> 31) >> 16) % count;
}

static void write_checksum(unsigned char *file, size_t bytes) {
    uint32_t a = 1, b = 0, sum;
    for (size_t i = 64; i < bytes; i++) a = (a + file[i]) % 65521, b = (b + a) % 65521;
    sum = b << 16 | a;
    memcpy(file + 24, &sum, 4);
}

/* A place in the file: in the header, in the table, in the first bytes of a section, or anywhere. */
static size_t place(const unsigned char *file, size_t bytes, uint32_t sections) {
    uint64_t offset;
    const unsigned char *entry = file + 64 + 40 * random_below(sections);
    switch (random_below(8)) {
        case 0: return random_below(64);
        case 1: return 64 + random_below(40 * sections);
        case 2: return random_below((uint32_t)bytes);
        default: memcpy(&offset, entry + 24, 8);
    }
    return offset < bytes - 64 ? (size_t)offset + random_below(64) : 0;
}

static void damage(unsigned char *file, size_t bytes, uint32_t sections) {
    static const float floats[] = {NAN, INFINITY, -INFINITY, 1e30f, -1e30f, 0, -1, 1e8f, 3e38f};
    static const double doubles[] = {NAN, INFINITY, 1e300, -1e300, 0, -1, 1e8, 1e-300};
    static const int32_t integers[] = {-1, 0, 1, INT32_MAX, INT32_MIN, 65536, 2, 7};
    size_t at = place(file, bytes, sections) / 4 * 4;
    switch (random_below(4)) {
        case 0: memcpy(file + at, &floats[random_below(9)], 4); break;
        case 1: memcpy(file + (at < bytes - 8 ? at / 8 * 8 : 0), &doubles[random_below(8)], 8); break;
        case 2: memcpy(file + at, &integers[random_below(8)], 4); break;
        default: file[at] ^= (unsigned char)(1 << random_below(8));
    }
}

static void hills(void *user, int count, const double *points, double *heights) {
    (void)user;
    for (int i = 0; i < count; i++) heights[i] = 20 * sin(points[2 * i] / 50) + 0.1 * points[2 * i + 1];
}

/* Runs two characters for some frames. Returns whether all poses were finite. */
static int run(const unsigned char *file, size_t bytes, size_t size) {
    void *memory = malloc(size);
    hobble *h = hobble_create(file, bytes, 2, memory, size, NULL);
    hobble_ground ground = {.function = hills};
    int finite = h != NULL, numbers = h ? 7 * hobble_joints(h) : 0;
    double *bones = malloc((size_t)numbers * sizeof *bones + 1);
    for (int frame = 0; h && frame < 24; frame++) {
        hobble_target targets[2] = {{.velocity = {0, 2.5}, .gait = HOBBLE_BY_SPEED},
                                    {.velocity = {-7, 1}, .facing = {0, 1}, .gait = 1}};
        for (int k = 0; k < hobble_columns(h); k++) hobble_set(h, 1, k, hobble_highest(h, k) / 2);
        if (frame == 12) hobble_copy(h, 1, h, 0, 50, 50), hobble_reset(h, 0, 10, 20, 1);
        int error = hobble_frame(h, targets, frame % 2 ? &ground : NULL);
        if (error && error != HOBBLE_BAD_GROUND) finite = 0;
        for (int c = 0; c < 2; c++) {
            for (int i = 0; i < 3 * hobble_joints(h); i++) finite &= isfinite(hobble_positions(h, c)[i]) != 0;
            for (int i = 0; i < 4 * hobble_joints(h); i++) finite &= isfinite(hobble_rotations(h, c)[i]) != 0;
            hobble_bones(h, c, bones, bones + 3 * hobble_joints(h));
            for (int i = 0; i < numbers; i++) finite &= isfinite(bones[i]) != 0;
            for (int i = 0; i < 6; i++) finite &= isfinite(hobble_state(h, c)[i]) != 0;
            for (int i = 0; i < 3; i++) finite &= isfinite(hobble_root(h, c)[i]) != 0;
        }
    }
    free(bones);
    free(memory);
    return finite;
}

int main(int count, char **arguments) {
    FILE *input = count == 4 ? fopen(arguments[1], "rb") : NULL;
    long length = 0;
    int refused = 0, wrong = 0, files = count == 4 ? atoi(arguments[2]) : 0;
    if (!input || fseek(input, 0, SEEK_END) || (length = ftell(input)) < 64) return 2;
    size_t bytes = (size_t)length;
    unsigned char *whole = malloc(bytes);
    rewind(input);
    if (fread(whole, 1, bytes, input) != bytes) return 2;
    fclose(input);
    state = strtoull(arguments[3], NULL, 10);
    uint32_t sections;
    memcpy(&sections, whole + 28, 4);
    for (int i = 0; i < files; i++) {
        size_t kept = i % 16 ? bytes : random_below((uint32_t)bytes);
        unsigned char *file =
            malloc(kept ? kept : 1); /* of the exact size, so that reading beyond it is noticed */
        memcpy(file, whole, kept);
        if (kept == bytes)
            for (uint32_t k = 0; k <= random_below(3); k++) damage(file, bytes, sections);
        if (i % 8 && kept >= 64) write_checksum(file, kept);
        char why[HOBBLE_WHY];
        size_t size = hobble_size(file, kept, 2, why);
        if (!size) refused += why[0] != 0;
        else if (size < (1u << 30) && !run(file, kept, size))
            wrong++, printf("file %d: a pose is not finite\n", i);
        free(file);
    }
    free(whole);
    printf("%d of %d refused\n", refused, files);
    return wrong != 0;
}
