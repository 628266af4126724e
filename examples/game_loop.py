"""The loop of a game: a wish goes in, a pose comes out, 60 times a second.

python examples/game_loop.py results/injured/network
"""

import sys

import numpy as np

from hobble.runtime import ProceduralAnimation
from hobble.runtime.axes import Axes

# Unity's convention; Axes("left", "Z") is Unreal's, Axes("right", "Z", "m") Blender's.
character = ProceduralAnimation.load(sys.argv[1], axes=Axes("left", "Y", "m"), mode="cubic")
hurts = "injury" in character.network.channels


def hills(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Heights of the ground in metres."""
    return 0.1 * np.sin(x / 2) * np.cos(z / 3)


for frame in range(600):
    angle = 2 * np.pi * frame / 600  # the player's stick goes round once in ten seconds
    stick = np.array([np.sin(angle), np.cos(angle)])
    injury = {"LeftUpLeg-LeftLeg": 7} if hurts and frame >= 300 else None
    pose = character.next_pose(0.025 * stick, gait="walk", injury=injury, terrain=hills)  # metres a frame
    if frame % 60 == 0:  # here a game would set its bones from pose.positions and pose.rotations
        print(f"{frame / 60:2.0f} s at {pose.root.round(2)}, contacts {pose.contacts.round(1)}")
