"""Writes people.npz from the walks that Jun et al. (2020) recorded (see people.py).

python -m hobble.gait.derive_people WALKS.npz [PEOPLE.npz]

WALKS.npz has five arrays. `gaits`, `curves` and `scalars` are the names in people.GAITS, signals.CURVES and
cycles.SCALARS. `curve` (6, people, 22, 50) and `scalar` (6, people, 8) have the values of these 22 curves at
50 times of the cycle and of these 8 scalars, for each of the 6 gaits and each person. The values are medians
over the person's cycles.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import load_npz, save_npz
from hobble.gait.cycles import SCALARS
from hobble.gait.people import GAITS, PEOPLE_FILE
from hobble.gait.profile import profile_of_curves
from hobble.gait.signals import CURVES


def derive(walks: str | Path, out: str | Path = PEOPLE_FILE) -> None:
    """Write the mean and standard deviation over people of each curve and scalar, and each person's profile.

    walks: path of WALKS.npz. Raises InputError if its gaits, curves or scalars are not the expected ones.
    """
    data = load_npz(walks)
    for name, expected in (("gaits", GAITS), ("curves", CURVES), ("scalars", SCALARS)):
        if tuple(map(str, data[name])) != tuple(expected):
            raise InputError(walks, f"`{name}` should be {', '.join(expected)}")
    curve, scalar = data["curve"].astype(float), data["scalar"].astype(float)
    profiles = [
        [list(profile_of_curves(c, s).values()) for c, s in zip(gait_curve, gait_scalar, strict=True)]
        for gait_curve, gait_scalar in zip(curve, scalar, strict=True)
    ]
    save_npz(
        out,
        profiles=np.array(profiles, np.float32),
        curve_mean=curve.mean(axis=1).astype(np.float16),
        curve_spread=curve.std(axis=1).astype(np.float16),
        scalar_mean=scalar.mean(axis=1).astype(np.float32),
        scalar_spread=scalar.std(axis=1).astype(np.float32),
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns the exit status."""
    paths = sys.argv[1:] if arguments is None else list(arguments)
    if len(paths) not in (1, 2):
        print("Usage: python -m hobble.gait.derive_people WALKS.npz [PEOPLE.npz]", file=sys.stderr)
        return 2
    try:
        derive(*paths)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
