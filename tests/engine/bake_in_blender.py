"""Installs the add-on in Blender, walks, bakes, and prints what the runtime got and where the joints are.

python bake_in_blender.py hobble_blender.zip: run by test_blender.py.
"""

import json
import sys
from pathlib import Path

import bpy

FRAMES = 60


def main() -> None:
    """Print one line of JSON."""
    repositories = bpy.context.preferences.extensions.repos
    repository = next(each for each in repositories if not each.use_remote_url)
    bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo=repository.module)
    name = f"bl_ext.{repository.module}.hobble_blender"
    addon = sys.modules[name]
    targets, frame = [], addon.Characters.frame

    def spied(character, ground=None):
        targets.append(list(character.targets[0].velocity))
        frame(character, ground)

    addon.Characters.frame = spied
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 60, 1, FRAMES
    bpy.ops.hobble.add(filepath=str(Path(addon.__file__).with_name("character.hob")))
    path = bpy.context.object
    for at, speed, hurt in ((1, 0.5, 0.0), (FRAMES, 2.0, 8.0)):
        path.hobble.speed, path["left thigh"] = speed, hurt
        path.hobble.keyframe_insert("speed", frame=at)
        path.keyframe_insert('["left thigh"]', frame=at)
    path.data.splines[0].bezier_points[1].co = (2, -4, 0)
    assert bpy.ops.hobble.bake() == {"FINISHED"}
    armature, positions = path.hobble.armature, []
    joints = [bone.name for bone in armature.pose.bones]
    hurt = []
    for number in range(1, FRAMES + 1):
        scene.frame_set(number)
        hurt.append(path["left thigh"])
        places = [armature.matrix_world @ bone.head for bone in armature.pose.bones]
        positions.append([[100 * x, 100 * z, -100 * y] for x, y, z in places])
    actions = [action.name for action in bpy.data.actions]
    given = {"joints": joints, "positions": positions, "targets": targets, "hurt": hurt, "actions": actions}
    print(json.dumps(given))


main()
