"""Walks a character of Hobble along a curve in Blender, and bakes the walk to an action.

The curve has the properties of the walk: speed, gait, and a custom property for each part of the body that
can be hurt. All of them can be keyed. The runtime in C does the walking; the add-on has it for each system.

Hobble has +Y up, +Z ahead, cm and 60 frames a second; Blender has +Z up, -Y ahead and metres.
"""

import platform
from collections.abc import Iterator
from ctypes import c_double
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty
from bpy_extras.io_utils import ImportHelper
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

from .hobble_ctypes import Characters, Ground, ground_from

bl_info = {
    "name": "Hobble",
    "description": "Walk a character that can be hurt along a curve",
    "author": "The authors of Hobble",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "View3D > Sidebar > Hobble",
    "category": "Animation",
}
HERE = Path(__file__).parent
RATE = 60  # frames a second of the runtime
AHEAD = 0.45  # seconds: the character walks to where the curve is after this time, but at least NEAR away
NEAR = 45.0  # cm
STEP = 5.0  # cm between the points of the curve that the character follows
EXACT = 1e-4  # m: a bone gets location keys if the runtime moves it by more than this from its place
TO_HOBBLE = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # from Blender's axes
GAITS = [
    ("by speed", "By Speed", "Walk or jog, by the speed"),
    *((name, name.capitalize(), "") for name in ("stand", "walk", "jog", "crouch", "jump")),
]


def library() -> Path:
    """The runtime for this computer."""
    system = {"Windows": "windows", "Darwin": "macos", "Linux": "linux"}.get(platform.system(), "")
    machine = "arm64" if platform.machine().lower() in ("arm64", "aarch64") else "x64"
    found = list((HERE / "libraries").glob(f"{system}-{machine}.*"))
    if not found:
        raise ValueError(f"Hobble has no library for {platform.system()} on {platform.machine()}")
    return found[0]


def load(file: str) -> Characters:
    """The character of a file character.hob. Raises ValueError for a file that is no character."""
    try:
        return Characters(library(), Path(bpy.path.abspath(file)).read_bytes())
    except OSError as error:
        raise ValueError(f"Hobble cannot read {file}: {error.strerror}") from None


def columns(character: Characters) -> dict[str, tuple[int, float]]:
    """What can be keyed besides speed and gait, such as "left thigh": name -> (column, highest value)."""
    out, c, handle = {}, character.library, character.handle
    c.hobble_highest.restype = c_double
    for column in range(c.hobble_columns(handle)):
        name = c.hobble_column_part(handle, column) or c.hobble_column_label(handle, column)
        name, channel = name.decode(), c.hobble_column_channel(handle, column).decode()
        out[name if channel == "injury" else f"{channel}: {name}"] = column, c.hobble_highest(handle, column)
    return out


class HobbleWalk(bpy.types.PropertyGroup):
    """The walk along a curve."""

    file: StringProperty(name="Character", description="The file character.hob", subtype="FILE_PATH")
    armature: PointerProperty(
        name="Armature", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE"
    )
    ground: PointerProperty(
        name="Ground",
        type=bpy.types.Object,
        poll=lambda _, thing: thing.type == "MESH",
        description="The mesh to walk on; without it the ground is flat",
    )
    speed: FloatProperty(name="Speed", default=1.5, min=0, max=6, unit="VELOCITY")
    gait: EnumProperty(name="Gait", items=GAITS, default="by speed")
    rigid: BoolProperty(
        name="Rigid Bones",
        description="Key rotations only, so that bones keep their lengths; joints are then some mm off",
    )


class HOBBLE_OT_add(bpy.types.Operator, ImportHelper):
    """Add a character of Hobble, and a path for it."""

    bl_idname, bl_label, bl_options = "hobble.add", "Hobble Character", {"REGISTER", "UNDO"}
    filename_ext = ".hob"
    filter_glob: StringProperty(default="*.hob", options={"HIDDEN"})

    def invoke(self, context, event):
        """Offer the character that the add-on comes with."""
        if not self.filepath and (HERE / "character.hob").exists():
            self.filepath = str(HERE / "character.hob")
        return super().invoke(context, event)

    def execute(self, context):
        """Import the body beside the chosen file, and make the path."""
        body = Path(self.filepath).with_name("character.glb")
        if not body.exists():  # in the export, the file is in a folder beside the body
            body = Path(self.filepath).parent.with_name("character.glb")
        try:
            found = columns(load(self.filepath))
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not body.exists():
            self.report({"ERROR"}, "There is no character.glb beside the file")
            return {"CANCELLED"}
        known = set(bpy.data.objects)
        bpy.ops.import_scene.gltf(filepath=str(body))
        armature = next(thing for thing in set(bpy.data.objects) - known if thing.type == "ARMATURE")
        armature.animation_data_clear()
        curve = bpy.data.curves.new(f"{armature.name} path", "CURVE")
        curve.dimensions = "3D"
        line = curve.splines.new("BEZIER")
        line.bezier_points.add(1)
        for point, y in zip(line.bezier_points, (0.0, -5.0), strict=True):
            point.co, point.handle_left_type, point.handle_right_type = (0, y, 0), "AUTO", "AUTO"
        path = bpy.data.objects.new(curve.name, curve)
        context.collection.objects.link(path)
        path.hobble.file, path.hobble.armature = self.filepath, armature
        for name, (_, highest) in found.items():
            path[name] = 0.0
            path.id_properties_ui(name).update(min=0.0, max=highest, soft_max=highest)
        for thing in context.selected_objects:
            thing.select_set(False)
        path.select_set(True)
        context.view_layer.objects.active = path
        return {"FINISHED"}


class HOBBLE_OT_bake(bpy.types.Operator):
    """Walk along the path in the frames of the scene, and make an action of it."""

    bl_idname, bl_label, bl_options = "hobble.bake", "Bake Walk", {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Whether a path with a character is selected."""
        return context.object and context.object.type == "CURVE" and context.object.hobble.armature

    def execute(self, context):
        """Walk and bake."""
        path = context.object
        try:
            character = load(path.hobble.file)
            joints = [
                character.library.hobble_joint_name(character.handle, j).decode()
                for j in range(character.joints)
            ]
            if missing := [name for name in joints if name not in path.hobble.armature.data.bones]:
                raise ValueError(f"The armature has no bone {missing[0]}. It is of another character.")
            poses = list(walk(context, path, character))
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        bake(context, path.hobble, joints, poses)
        return {"FINISHED"}


def track(context, path, armature) -> np.ndarray:
    """(N, 2) x and z of points on the path, STEP apart, as the character sees them."""
    made = path.evaluated_get(context.evaluated_depsgraph_get())
    to_armature = armature.matrix_world.inverted() @ path.matrix_world
    mesh = made.to_mesh()
    points = np.array([to_armature @ v.co for v in mesh.vertices]).reshape(-1, 3)
    made.to_mesh_clear()
    if len(points) < 2:
        raise ValueError("The path has no points to walk along")
    points = 100 * (points @ TO_HOBBLE.T)[:, [0, 2]]
    if path.data.splines[0].use_cyclic_u:
        points = np.concatenate([points, points[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.arange(0.0, way[-1] + STEP, STEP)
    return np.stack([np.interp(at, way, points[:, i]) for i in (0, 1)], axis=1)


def ground_of(context, walk_of, armature) -> Ground | None:
    """The ground as the runtime wants it."""
    if not walk_of.ground:
        return None
    tree = BVHTree.FromObject(walk_of.ground, context.evaluated_depsgraph_get())
    inwards = walk_of.ground.matrix_world.inverted() @ armature.matrix_world
    outwards, down = inwards.inverted(), (inwards.to_3x3() @ Vector((0, 0, -1))).normalized()

    def height(x: float, z: float) -> float:
        place = tree.ray_cast(inwards @ Vector((x / 100, -z / 100, 1000)), down)[0]
        return 100 * (outwards @ place).z if place else 0.0

    return ground_from(height)


def walk(context, path, character: Characters) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The pose in each frame of the scene: positions (J, 3), rotations (J, 4), root (x, y, z, yaw), in cm."""
    scene, settings, names = context.scene, path.hobble, columns(character)
    points, ground = track(context, path, settings.armature), ground_of(context, settings, settings.armature)
    is_round = path.data.splines[0].use_cyclic_u
    ahead = points[1] - points[0]
    character.reset(0, *points[0], float(np.arctan2(ahead[0], ahead[1])))
    at, done, keyed, before = 0, -1, scene.frame_current, None
    rate = scene.render.fps / scene.render.fps_base

    def pose() -> np.ndarray:
        views = (("positions", 3), ("rotations", 4))
        joints = [
            np.array(character.array(name, 0, n * character.joints)).reshape(-1, n) for name, n in views
        ]
        root = np.array([*character.array("root", 0, 3), character.array("state", 0, 6)[0]])
        return np.concatenate([np.concatenate(joints, axis=1).ravel(), root])

    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        due = (frame - scene.frame_start) / rate * RATE
        for name, (column, highest) in names.items():
            value = min(max(float(path.get(name, 0.0)), 0.0), highest)
            character.check(character.library.hobble_set(character.handle, 0, column, c_double(value)))
        while done < due - 1e-6:
            root = np.array(character.array("root", 0, 3))[[0, 2]]
            speed = 100 * settings.speed / RATE  # cm a frame
            near = (
                np.arange(at, at + 60) % len(points) if is_round else np.arange(at, min(at + 60, len(points)))
            )
            at = int(near[np.linalg.norm(points[near] - root, axis=1).argmin()])
            reach = at + int(max(NEAR, speed * AHEAD * RATE) / STEP)
            way = points[reach % len(points) if is_round else min(reach, len(points) - 1)] - root
            left = np.inf if is_round else STEP * (len(points) - 1 - at)
            speed = min(speed, left / 20) if left > 2 * STEP else 0.0  # it slows down before the end
            gait = None if settings.gait == "by speed" else settings.gait
            character.aim(0, speed * way / max(np.linalg.norm(way), 1e-9), gait=gait)
            before = pose() if done >= 0 else None
            character.frame(ground)
            done += 1
        now, share = pose(), done - due  # how far the scene's frame is before the runtime's last frame
        if before is not None and share > 1e-6:
            now = blend(now, before, share, character.joints)
        joints = now[:-4].reshape(character.joints, 7)
        yield joints[:, :3], joints[:, 3:], now[-4:]
    scene.frame_set(keyed)


def blend(now: np.ndarray, before: np.ndarray, share: float, joints: int) -> np.ndarray:
    """A pose between two frames of the runtime. share: 0 gives `now`."""
    before = before.copy()
    a, b = now[:-4].reshape(joints, 7), before[:-4].reshape(joints, 7)
    b[:, 3:] *= np.sign((a[:, 3:] * b[:, 3:]).sum(axis=1, keepdims=True) + 1e-12)  # q and -q are one rotation
    before[-1] += 2 * np.pi * np.round((now[-1] - before[-1]) / (2 * np.pi))
    return (1 - share) * now + share * before


def matrices(turns: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) of quaternions (..., 4), w first, of any length."""
    w, x, y, z = np.moveaxis(turns / np.linalg.norm(turns, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def bake(context, settings, joints: list[str], poses: list) -> None:
    """Make an action of the poses, and give it to the armature."""
    armature, scene, count = settings.armature, context.scene, len(poses)
    places, turns, roots = (np.array(part) for part in zip(*poses, strict=True))
    goal = {}  # bone -> matrices (F, 4, 4) in the armature's space
    yaw = np.stack(
        [np.cos(roots[:, 3] / 2), *np.zeros((1, count)), np.sin(roots[:, 3] / 2), np.zeros(count)], -1
    )
    for name, place, turn in [
        ("root", roots[:, :3], yaw),
        *((name, places[:, j], turns[:, j]) for j, name in enumerate(joints)),
    ]:
        if name in armature.data.bones:
            rest = np.array(armature.data.bones[name].matrix_local)
            goal[name] = np.tile(np.eye(4), (count, 1, 1))
            goal[name][:, :3, :3] = TO_HOBBLE.T @ matrices(turn) @ TO_HOBBLE @ rest[:3, :3]
            goal[name][:, :3, 3] = 0.01 * place @ TO_HOBBLE
    data = armature.animation_data_create()
    data.action = bpy.data.actions.new(f"{armature.name} walk")
    data.action.use_fake_user = True
    frames = np.arange(scene.frame_start, scene.frame_end + 1, dtype=float)
    reached = {}  # where the bones are with the keys so far
    for bone in armature.pose.bones:  # parents come first
        rest, parent = np.array(bone.bone.matrix_local), bone.parent
        base = np.tile(rest, (count, 1, 1))
        if parent:
            base = reached[parent.name] @ (np.linalg.inv(np.array(parent.bone.matrix_local)) @ rest)
        reached[bone.name] = base
        if bone.name not in goal:
            continue
        own = np.linalg.inv(base) @ goal[bone.name]
        bone.rotation_mode = "QUATERNION"
        for name, values in (
            ("location", own[:, :3, 3]),
            ("rotation_quaternion", quaternions(own[:, :3, :3])),
        ):
            is_placed = not settings.rigid or bone.name in ("root", joints[0])
            if name == "location" and not (is_placed and np.abs(values).max() > EXACT):
                own[:, :3, 3] = 0
                bone.location = (0, 0, 0)
                continue
            key(bone, name, frames, values, data)
        reached[bone.name] = base @ own


def quaternions(turns: np.ndarray) -> np.ndarray:
    """Quaternions (F, 4) of matrices (F, 3, 3); from frame to frame they do not change their sign."""
    out = np.array([Matrix(turn).to_quaternion() for turn in turns])
    flips = np.cumprod(np.sign((out[1:] * out[:-1]).sum(axis=1) + 1e-12))
    out[1:] *= flips[:, None]
    return out


def key(bone, name: str, frames: np.ndarray, values: np.ndarray, data) -> None:
    """Key a property of a bone in all frames. values: (F, 3 or 4)."""
    setattr(bone, name, values[0])
    bone.keyframe_insert(name, frame=frames[0], group=bone.name)
    action, where = data.action, bone.path_from_id(name)
    if hasattr(action, "fcurves"):
        curves = action.fcurves
    else:  # since Blender 5
        curves = action.layers[0].strips[0].channelbag(data.action_slot).fcurves
    for i in range(values.shape[1]):
        curve = curves.find(where, index=i)
        curve.keyframe_points.add(len(frames) - 1)
        curve.keyframe_points.foreach_set("co", np.stack([frames, values[:, i]], axis=1).ravel())
        kind = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value
        curve.keyframe_points.foreach_set("interpolation", np.full(len(frames), kind))
        curve.update()


class HOBBLE_PT_walk(bpy.types.Panel):
    """The walk of the selected path."""

    bl_label, bl_space_type, bl_region_type, bl_category = "Hobble", "VIEW_3D", "UI", "Hobble"

    def draw(self, context):
        """Draw the properties of the walk."""
        layout, path = self.layout, context.object
        layout.operator(HOBBLE_OT_add.bl_idname, icon="ARMATURE_DATA")
        if not HOBBLE_OT_bake.poll(context):
            return
        layout.use_property_split = True
        for name in ("armature", "ground", "speed", "gait", "rigid"):
            layout.prop(path.hobble, name)
        for name, value in path.items():
            if isinstance(value, float):
                layout.prop(path, f'["{name}"]', slider=True)
        layout.operator(HOBBLE_OT_bake.bl_idname, icon="ACTION")


CLASSES = (HobbleWalk, HOBBLE_OT_add, HOBBLE_OT_bake, HOBBLE_PT_walk)


def menu(self, context):
    """The entry in File > Import."""
    self.layout.operator(HOBBLE_OT_add.bl_idname, text="Hobble Character (.hob)")


def register():
    """Called by Blender when the add-on is switched on."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.hobble = PointerProperty(type=HobbleWalk)
    bpy.types.TOPBAR_MT_file_import.append(menu)


def unregister():
    """Called by Blender when the add-on is switched off."""
    bpy.types.TOPBAR_MT_file_import.remove(menu)
    del bpy.types.Object.hobble
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
