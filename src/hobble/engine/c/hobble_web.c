/* The part of the runtime that only WebAssembly needs: a frame whose ground is a function in JavaScript. */
#ifdef __wasm__
#include "hobble.h"

__attribute__((import_module("hobble"), import_name("ground"))) void page_ground(int count, const double *points,
                                                                                 double *heights);

static void look_up(void *user, int count, const double *points, double *heights) {
    (void)user;
    page_ground(count, points, heights);
}

HOBBLE_API int hobble_web_frame(hobble *h, const hobble_target *targets, int has_ground) {
    hobble_ground ground = {.function = look_up};
    return hobble_frame(h, targets, has_ground ? &ground : NULL);
}
#endif
