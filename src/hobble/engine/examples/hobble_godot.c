/* Hobble in Godot 4.2 or later as a GDExtension: the class HobbleCharacter, for GDScript and C#.

   `godot --dump-gdextension-interface` writes gdextension_interface.h (from 4.6 on, Godot's script
   make_interface_header.py makes it from the JSON that --dump-gdextension-interface-json writes). Then

   cc -O3 -march=x86-64-v3 -shared -fPIC -I. -I.. hobble_godot.c ../hobble.c -o libhobble_godot.so -lm

   Put the library, hobble.gdextension and character.hob into the project:

       var walker := HobbleCharacter.new()
       func _ready(): assert(walker.open(FileAccess.get_file_as_bytes("res://character.hob")) == "")
       func _physics_process(_delta):                        # 60 times a second
           walker.set_value("left thigh", 7)
           walker.step(Vector3(0, 0, -1.5), func(x, z): return 0.0)   # m/s; the height of the ground in m
           for j in walker.joint_count():
               get_node(walker.joint_name(j)).global_transform = walker.joint(j)

   Compiled with gcc and clang, and called through a stand-in for Godot's functions; not run in Godot. */
#include "gdextension_interface.h"
#include "hobble.h"

#include <stdlib.h>
#include <string.h>

#ifndef HOBBLE_GODOT_REAL
#define HOBBLE_GODOT_REAL float /* double for a Godot that was built with precision=double */
#endif

/* Godot's String and StringName are a pointer; its Variant has 24 bytes, or 40 with precision=double. */
typedef struct {
    void *place;
} text;
typedef struct {
    uint64_t place[5];
} value;

typedef struct {
    void *file, *memory;
    double *positions, *rotations; /* with bones that keep their lengths */
    hobble *h;
} walker;

static GDExtensionClassLibraryPtr library;
static GDExtensionInterfaceVariantCall variant_call;
static GDExtensionInterfaceVariantDestroy variant_destroy;
static GDExtensionInterfaceGetVariantFromTypeConstructor from_type;
static GDExtensionInterfaceGetVariantToTypeConstructor to_type;
static GDExtensionInterfaceVariantGetPtrDestructor destructor;
static GDExtensionInterfaceStringNewWithUtf8Chars new_string;
static GDExtensionInterfaceStringToUtf8Chars read_string;
static GDExtensionInterfaceStringNameNewWithLatin1Chars new_name;
static GDExtensionInterfacePackedByteArrayOperatorIndexConst byte_at;
static GDExtensionInterfaceClassdbConstructObject construct;
static GDExtensionInterfaceObjectSetInstance set_instance;
static GDExtensionInterfaceClassdbRegisterExtensionClass2 register_class;
static GDExtensionInterfaceClassdbRegisterExtensionClassMethod register_method;
static GDExtensionInterfaceClassdbUnregisterExtensionClass unregister_class;

static text name_of(const char *latin1) {
    text name;
    new_name(&name, latin1, 0);
    return name;
}

static void drop(GDExtensionVariantType type, void *it) { destructor(type)(it); }

/* Reads a value of a type that needs no destructor. */
static void take(GDExtensionVariantType type, GDExtensionConstVariantPtr given, void *found) {
    to_type(type)(found, (void *)given);
}

static void give_text(GDExtensionVariantPtr result, const char *utf8) {
    text said;
    new_string(&said, utf8);
    from_type(GDEXTENSION_VARIANT_TYPE_STRING)(result, &said);
    drop(GDEXTENSION_VARIANT_TYPE_STRING, &said);
}

static void give_error(GDExtensionVariantPtr result, int code) {
    give_text(result, code ? hobble_error(code) : "");
}

/* Calls a method of a value, and reads what it returns into `found`, which stays as it is after an error. */
static void call(GDExtensionConstVariantPtr self, const char *method, const GDExtensionConstVariantPtr *given,
                 int count, GDExtensionVariantType type, void *found) {
    text name = name_of(method);
    GDExtensionCallError error = {GDEXTENSION_CALL_OK, 0, 0};
    value result;
    variant_call((void *)self, &name, given, count, &result, &error);
    if (error.error == GDEXTENSION_CALL_OK) take(type, &result, found);
    variant_destroy(&result);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &name);
}

static void close_file(walker *w) {
    free(w->file), free(w->memory), free(w->positions), free(w->rotations);
    memset(w, 0, sizeof *w);
}

static void read_pose(walker *w) { hobble_bones(w->h, 0, w->positions, w->rotations); }

/* open(bytes: PackedByteArray) -> String: empty, or why the file is refused. */
static void open_file(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    char why[HOBBLE_WHY] = "the file is empty, or there is not enough memory";
    int64_t bytes = 0;
    value array;
    close_file(w);
    call(given[0], "size", NULL, 0, GDEXTENSION_VARIANT_TYPE_INT, &bytes);
    if (bytes > 0 && (w->file = malloc((size_t)bytes))) {
        take(GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY, given[0], &array);
        memcpy(w->file, byte_at(&array, 0), (size_t)bytes);
        drop(GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY, &array);
    }
    size_t size = w->file ? hobble_size(w->file, (size_t)bytes, 1, why) : 0;
    if (size && (w->memory = malloc(size)))
        w->h = hobble_create(w->file, (size_t)bytes, 1, w->memory, size, why);
    if (w->h) {
        size_t joints = (size_t)hobble_joints(w->h);
        w->positions = malloc(3 * joints * sizeof(double));
        w->rotations = malloc(4 * joints * sizeof(double));
    }
    if (w->positions && w->rotations) {
        read_pose(w);
        give_text(result, "");
    } else {
        close_file(w);
        give_text(result, why);
    }
}

/* set_value(name: String, value: float) -> String: empty, or what is wrong. name: "left thigh", or a label.
 */
static void set_value(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    char name[256] = "";
    double amount;
    text string;
    take(GDEXTENSION_VARIANT_TYPE_STRING, given[0], &string);
    read_string(&string, name, sizeof name - 1);
    drop(GDEXTENSION_VARIANT_TYPE_STRING, &string);
    take(GDEXTENSION_VARIANT_TYPE_FLOAT, given[1], &amount);
    give_error(result, hobble_set(w->h, 0, hobble_column(w->h, NULL, name), amount));
}

/* Asks a Callable(x: float, z: float) -> float for heights. Godot looks along -Z and counts in metres. */
static void ask_ground(void *callable, int count, const double *points, double *heights) {
    for (int i = 0; i < count; i++) {
        value at[2];
        for (int k = 0; k < 2; k++) {
            double metres = -points[2 * i + k] / 100;
            from_type(GDEXTENSION_VARIANT_TYPE_FLOAT)(&at[k], &metres);
        }
        const GDExtensionConstVariantPtr given[] = {&at[0], &at[1]};
        double metres = 0;
        call(callable, "call", given, 2, GDEXTENSION_VARIANT_TYPE_FLOAT, &metres);
        heights[i] = 100 * metres;
    }
}

/* step(velocity: Vector3, height: Callable) -> String: empty, or what is wrong. */
static void step(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    HOBBLE_GODOT_REAL velocity[3];
    hobble_ground ground = {.function = ask_ground, .user = (void *)given[1]};
    take(GDEXTENSION_VARIANT_TYPE_VECTOR3, given[0], velocity);
    hobble_target target = {.gait = HOBBLE_BY_SPEED};
    target.velocity[0] = -velocity[0] * 100 / 60;
    target.velocity[1] = -velocity[2] * 100 / 60;
    int error = hobble_frame(w->h, &target, &ground);
    read_pose(w);
    give_error(result, error);
}

/* joint_count() -> int */
static void joint_count(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    int64_t count = hobble_joints(w->h);
    (void)given;
    from_type(GDEXTENSION_VARIANT_TYPE_INT)(result, &count);
}

static int joint_of(walker *w, GDExtensionConstVariantPtr given) {
    int64_t joint;
    take(GDEXTENSION_VARIANT_TYPE_INT, given, &joint);
    return joint >= 0 && joint < hobble_joints(w->h) ? (int)joint : -1;
}

/* joint_name(joint: int) -> String */
static void joint_name(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    const char *name = hobble_joint_name(w->h, joint_of(w, given[0]));
    give_text(result, name ? name : "");
}

/* joint(joint: int) -> Transform3D, in the world */
static void joint(walker *w, const GDExtensionConstVariantPtr *given, GDExtensionVariantPtr result) {
    HOBBLE_GODOT_REAL rows[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
    int j = joint_of(w, given[0]);
    if (j >= 0) {
        const double *p = w->positions + 3 * j, *q = w->rotations + 4 * j;
        double r = q[0], x = -q[1], y = q[2], z = -q[3];
        double numbers[12] = {
            1 - 2 * (y * y + z * z), 2 * (x * y - r * z), 2 * (x * z + r * y), 2 * (x * y + r * z),
            1 - 2 * (x * x + z * z), 2 * (y * z - r * x), 2 * (x * z - r * y), 2 * (y * z + r * x),
            1 - 2 * (x * x + y * y), -p[0] / 100,         p[1] / 100,          -p[2] / 100};
        for (int i = 0; i < 12; i++) rows[i] = (HOBBLE_GODOT_REAL)numbers[i];
    }
    from_type(GDEXTENSION_VARIANT_TYPE_TRANSFORM3D)(result, rows);
}

typedef struct {
    const char *name;
    void (*run)(walker *, const GDExtensionConstVariantPtr *, GDExtensionVariantPtr);
    int count;
    GDExtensionVariantType given[2], result;
} method;

static method methods[] = {
    {"open", open_file, 1, {GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY}, GDEXTENSION_VARIANT_TYPE_STRING},
    {"set_value",
     set_value,
     2,
     {GDEXTENSION_VARIANT_TYPE_STRING, GDEXTENSION_VARIANT_TYPE_FLOAT},
     GDEXTENSION_VARIANT_TYPE_STRING},
    {"step",
     step,
     2,
     {GDEXTENSION_VARIANT_TYPE_VECTOR3, GDEXTENSION_VARIANT_TYPE_CALLABLE},
     GDEXTENSION_VARIANT_TYPE_STRING},
    {"joint_count", joint_count, 0, {0}, GDEXTENSION_VARIANT_TYPE_INT},
    {"joint_name", joint_name, 1, {GDEXTENSION_VARIANT_TYPE_INT}, GDEXTENSION_VARIANT_TYPE_STRING},
    {"joint", joint, 1, {GDEXTENSION_VARIANT_TYPE_INT}, GDEXTENSION_VARIANT_TYPE_TRANSFORM3D},
};

/* Methods are registered as if they had any number of arguments: then Godot always calls them by this. */
static void run(void *userdata, GDExtensionClassInstancePtr self, const GDExtensionConstVariantPtr *given,
                GDExtensionInt count, GDExtensionVariantPtr result, GDExtensionCallError *error) {
    const method *called = userdata;
    walker *w = self;
    error->error = GDEXTENSION_CALL_OK;
    error->expected = called->count;
    if (count < called->count) error->error = GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS;
    else if (count > called->count) error->error = GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS;
    else if (!w->h && called->run != open_file) give_text(result, "no character is open");
    else called->run(w, given, result);
}

static GDExtensionObjectPtr create(void *userdata) {
    text parent = name_of("RefCounted"), class = name_of("HobbleCharacter");
    GDExtensionObjectPtr object = construct(&parent);
    (void)userdata;
    set_instance(object, &class, calloc(1, sizeof(walker)));
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &parent);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &class);
    return object;
}

static void destroy(void *userdata, GDExtensionClassInstancePtr self) {
    (void)userdata;
    close_file(self);
    free(self);
}

static void add_method(text *class, method *added) {
    text nothing = name_of(""), name = name_of(added->name), hint;
    new_string(&hint, "");
    GDExtensionPropertyInfo of[3];
    for (int i = 0; i < 3; i++) {
        GDExtensionVariantType type = i < 2 ? added->given[i] : added->result;
        of[i] = (GDExtensionPropertyInfo){type, &nothing, &nothing, 0, &hint, 6}; /* PROPERTY_USAGE_DEFAULT */
    }
    GDExtensionClassMethodArgumentMetadata plain[2] = {0};
    GDExtensionClassMethodInfo info = {.name = &name,
                                       .method_userdata = added,
                                       .call_func = run,
                                       .method_flags =
                                           GDEXTENSION_METHOD_FLAG_NORMAL | GDEXTENSION_METHOD_FLAG_VARARG,
                                       .has_return_value = 1,
                                       .return_value_info = &of[2],
                                       .argument_count = (uint32_t)added->count,
                                       .arguments_info = of,
                                       .arguments_metadata = plain};
    register_method(library, class, &info);
    drop(GDEXTENSION_VARIANT_TYPE_STRING, &hint);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &name);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &nothing);
}

static void start(void *userdata, GDExtensionInitializationLevel level) {
    (void)userdata;
    if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
    text class = name_of("HobbleCharacter"), parent = name_of("RefCounted");
    GDExtensionClassCreationInfo2 info = {
        .is_exposed = 1, .create_instance_func = create, .free_instance_func = destroy};
    register_class(library, &class, &parent, &info);
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) add_method(&class, &methods[i]);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &parent);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &class);
}

static void end(void *userdata, GDExtensionInitializationLevel level) {
    (void)userdata;
    if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
    text class = name_of("HobbleCharacter");
    unregister_class(library, &class);
    drop(GDEXTENSION_VARIANT_TYPE_STRING_NAME, &class);
}

/* Where each of Godot's functions is kept. */
static const struct {
    const char *name;
    void *place;
} needed[] = {
    {"variant_call", &variant_call},
    {"variant_destroy", &variant_destroy},
    {"get_variant_from_type_constructor", &from_type},
    {"get_variant_to_type_constructor", &to_type},
    {"variant_get_ptr_destructor", &destructor},
    {"string_new_with_utf8_chars", &new_string},
    {"string_to_utf8_chars", &read_string},
    {"string_name_new_with_latin1_chars", &new_name},
    {"packed_byte_array_operator_index_const", &byte_at},
    {"classdb_construct_object", &construct},
    {"object_set_instance", &set_instance},
    {"classdb_register_extension_class2", &register_class},
    {"classdb_register_extension_class_method", &register_method},
    {"classdb_unregister_extension_class", &unregister_class},
};

HOBBLE_API GDExtensionBool hobble_godot(GDExtensionInterfaceGetProcAddress find,
                                        GDExtensionClassLibraryPtr self, GDExtensionInitialization *how) {
    library = self;
    *how = (GDExtensionInitialization){GDEXTENSION_INITIALIZATION_SCENE, NULL, start, end};
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        GDExtensionInterfaceFunctionPtr function = find(needed[i].name);
        if (!function) return 0;
        memcpy(needed[i].place, &function, sizeof function);
    }
    return 1;
}
