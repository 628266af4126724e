"""A game loop: 60 times a second it passes a target velocity to the character and gets a pose.

Usage: python examples/game_loop.py results/injured/network
"""

import sys

import numpy as np

from hobble.runtime import ProceduralAnimation
from hobble.runtime.caller_targets import Axes

# axes: handedness, up axis and unit, here those of Unity. For Unreal use Axes("left", "Z"), for Blender
# Axes("right", "Z", "m").
# mode: how the weights of the network are computed from the phase; "cubic" is exact.
character = ProceduralAnimation.load(sys.argv[1], axes=Axes("left", "Y", "m"), mode="cubic")
can_be_hurt = "injury" in character.network.channels


def hills(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Heights of the ground at points x, z. All are in metres."""
    return 0.1 * np.sin(x / 2) * np.cos(z / 3)


for frame in range(600):
    angle = 2 * np.pi * frame / 600  # the player turns the stick once around in ten seconds
    stick = np.array([np.sin(angle), np.cos(angle)])
    injury = {"LeftUpLeg-LeftLeg": 7} if can_be_hurt and frame >= 300 else None
    velocity = 0.025 * stick  # metres a frame: 1.5 m/s
    pose = character.next_pose(velocity, gait="walk", injury=injury, terrain=hills)
    # A game would now set its bones from pose.positions and pose.rotations.
    if frame % 60 == 0:
        print(f"{frame / 60:2.0f} s at {pose.root.round(2)}, contacts {pose.contacts.round(1)}")
