"""Hobble in any Python program, by ctypes: needs hobble.c compiled to a shared library, and no package.

cc -O3 -march=native -shared -fPIC hobble.c -o libhobble.so -lm
python hobble_ctypes.py libhobble.so character.hob
"""

import ctypes
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

BY_SPEED, SHARES = -1, -2  # values of a target's gait besides the number of a gait


class Target(ctypes.Structure):
    """hobble_target: velocity and facing are x and z."""

    _fields_ = [
        ("velocity", ctypes.c_double * 2),
        ("facing", ctypes.c_double * 2),
        ("shares", ctypes.c_double * 6),
        ("gait", ctypes.c_int),
    ]


Doubles = ctypes.POINTER(ctypes.c_double)
GroundFunction = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, Doubles, Doubles)


class Ground(ctypes.Structure):
    """hobble_ground: a function, or a grid of heights."""

    _fields_ = [
        ("function", GroundFunction),
        ("user", ctypes.c_void_p),
        ("heights", ctypes.POINTER(ctypes.c_float)),
        ("rows", ctypes.c_int),
        ("columns", ctypes.c_int),
        ("cell", ctypes.c_double),
        ("centre", ctypes.c_double * 2),
    ]


class Characters:
    """Characters driven by one character file. Raises ValueError for a file that is refused."""

    def __init__(self, library: str | Path, file: bytes, count: int = 1) -> None:
        self.library, self.count = ctypes.CDLL(str(library)), count
        self.library.hobble_size.restype = ctypes.c_size_t
        self.library.hobble_create.restype = ctypes.c_void_p
        self.library.hobble_error.restype = ctypes.c_char_p
        for name in ("joint_name", "gait_name", "column_channel", "column_label", "column_part"):
            getattr(self.library, f"hobble_{name}").restype = ctypes.c_char_p
        # The bytes have to stay where they are, at a multiple of 8.
        self._file = (ctypes.c_uint64 * (len(file) // 8 + 1))()
        ctypes.memmove(self._file, file, len(file))
        why, size = ctypes.create_string_buffer(160), ctypes.c_size_t(len(file))
        needed = self.library.hobble_size(self._file, size, count, why)
        if not needed:
            raise ValueError(why.value.decode())
        self._memory = (ctypes.c_uint64 * (needed // 8 + 1))()
        self.handle = ctypes.c_void_p(
            self.library.hobble_create(self._file, size, count, self._memory, ctypes.c_size_t(needed), why)
        )
        self.joints = self.library.hobble_joints(self.handle)
        self.targets = (Target * count)()

    def array(self, name: str, character: int, size: int) -> ctypes.Array[ctypes.c_double]:
        """A view of the numbers that a function such as hobble_positions returns."""
        function = getattr(self.library, f"hobble_{name}")
        function.restype = ctypes.c_void_p
        return (ctypes.c_double * size).from_address(function(self.handle, character))

    def check(self, code: int) -> int:
        """Raise ValueError for an error; else return the number."""
        if code < 0:
            raise ValueError(self.library.hobble_error(code).decode())
        return code

    def set(self, character: int, channel: str, part: str, value: float) -> None:
        """Set the value of a column, such as ("injury", "left thigh")."""
        column = self.check(self.library.hobble_column(self.handle, channel.encode() or None, part.encode()))
        self.check(self.library.hobble_set(self.handle, character, column, ctypes.c_double(value)))

    def aim(
        self,
        character: int,
        velocity: Sequence[float],
        facing: Sequence[float] = (0, 0),
        gait: str | None = None,
    ) -> None:
        """Say what a character shall do: velocity and facing are x and z; without a gait it walks or jogs."""
        target = self.targets[character]
        target.velocity[:], target.facing[:] = list(velocity), list(facing)
        number = self.library.hobble_gait(self.handle, gait.encode()) if gait else BY_SPEED
        target.gait = self.check(number) if gait else number

    def reset(self, character: int, x: float, z: float, yaw: float) -> None:
        """Start a character again."""
        numbers = map(ctypes.c_double, (x, z, yaw))
        self.check(self.library.hobble_reset(self.handle, character, *numbers))

    def vary(self, character: int, amount: float, seed: int) -> None:
        """How much its steps differ: 0 not at all, 1 as those of people do. A seed gives the same walk."""
        self.check(self.library.hobble_vary(self.handle, character, ctypes.c_double(amount), seed))

    def frame(self, ground: Ground | None = None) -> None:
        """Run one frame of all characters."""
        pointer = None if ground is None else ctypes.byref(ground)
        self.check(self.library.hobble_frame(self.handle, self.targets, pointer))


def ground_from(height: Callable[[float, float], float]) -> Ground:
    """A ground from a function of x and z, cm."""

    def look_up(user: int, count: int, points: Sequence[float], heights: list[float]) -> None:
        for i in range(count):
            heights[i] = height(points[2 * i], points[2 * i + 1])

    return Ground(function=GroundFunction(look_up))


if __name__ == "__main__":
    characters = Characters(sys.argv[1], Path(sys.argv[2]).read_bytes())
    characters.aim(0, (0, 2.5))
    for frame in range(120):
        characters.frame(ground_from(lambda x, z: 0.05 * z))
        x, y, z = characters.array("root", 0, 3)
        if frame % 30 == 29:
            print(f"after {frame + 1} frames the root is at {x:.1f}, {y:.1f}, {z:.1f} cm")
