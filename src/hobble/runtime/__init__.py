"""The character at run time: the next pose, every frame. `ProceduralAnimation` is what a game takes."""

from hobble.runtime.animation import Pose, ProceduralAnimation

__all__ = ["Pose", "ProceduralAnimation"]
