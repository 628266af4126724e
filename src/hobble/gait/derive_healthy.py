"""Writes healthy.npz from walks of the CMU database.

python -m hobble.gait.derive_healthy CMU_FOLDER [HEALTHY.npz]

The file says how much the features (features.py) of healthy walks vary within one person: with the speed, on
slight curves, and from one window of 4 seconds to another. The motion was obtained from mocap.cs.cmu.edu,
which was funded by NSF EIA-0196217.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.gait.comparison import healthy_profile, measure_clip
from hobble.gait.cycles import WalkCycles
from hobble.gait.features import features
from hobble.gait.limp_grade import HEALTHY_FILE
from hobble.gait.profile import Profile, mirror_profile, profile_of_walk
from hobble.gait.read_clip import SKELETONS, read_clip
from hobble.gait.recogniser import windows_with_cycles

# Clips of CMU, all of healthy walks. REFERENCE: performer -> the walks with which this performer's walks are
# compared. OTHERS: performer -> further walks: slow, quick, on curves.
REFERENCE = {
    "105": ("105_29", "105_31", "105_34", "105_36"),
    "07": ("07_01", "07_02", "07_03", "07_06"),
    "08": ("08_01", "08_02", "08_05", "08_06", "08_08"),
    "16": ("16_15", "16_21", "16_31"),
}
OTHERS = {
    "105": ("105_02", "105_10", "105_17", "105_22", "105_27"),
    "07": ("07_04", "07_05", "07_09", "07_12"),
    "08": ("08_03", "08_04", "08_09", "08_11"),
    "16": ("16_11", "16_13", "16_17", "16_23", "16_25"),
}
SECONDS = 4.0  # length of a window


def healthy_windows(
    folder: str | Path, performer: str, skeletons: str | Path = SKELETONS
) -> Iterator[tuple[str, Profile, Profile]]:
    """Yield (name of the clip, profile, profile of the reference) for each window of a performer's walks.

    The reference is the performer's walks in REFERENCE without the clip itself. folder: the folder with the
    BVH files of CMU. skeletons: folder of the skeleton files.
    """
    names = REFERENCE[performer] + OTHERS[performer]
    clips = {name: read_clip(Path(folder, f"{name}.bvh"), skeletons) for name in names}
    for name, clip in clips.items():
        healthy = healthy_profile([clips[other] for other in REFERENCE[performer] if other != name])
        for part in _parts(clip):
            yield name, profile_of_walk(part), healthy


def _parts(clip: Clip) -> list[WalkCycles]:
    """The cycles in each window of a clip. If no window has enough cycles, all cycles are one part.

    The list is empty if the clip has no cycle.
    """
    walk = measure_clip(clip)
    parts = [part for _, part in windows_with_cycles(walk, len(clip), SECONDS)]
    return parts or [walk] * bool(len(walk))


def covariance(compared_windows: Iterable[tuple[str, Profile, Profile]]) -> tuple[Array, int]:
    """The covariance (D, D) of the D features of windows, and the number of clips.

    It is the mean of x x^T over the features x (D,), because features of a walk that equals its reference are
    0. Left and right count equally, and so do all clips. compared_windows: what `healthy_windows` yields.
    """
    by_clip: dict[str, list[Array]] = {}
    for name, walk, healthy in compared_windows:
        for pair in ((walk, healthy), (mirror_profile(walk), mirror_profile(healthy))):
            by_clip.setdefault(name, []).append(np.array(list(features(*pair).values())))
    squares = [np.einsum("ni,nj->ij", x, x) / len(x) for x in map(np.array, by_clip.values())]
    return np.mean(squares, axis=0), len(by_clip)


def derive(folder: str | Path, out: str | Path = HEALTHY_FILE) -> None:
    """Write each performer's covariance and number of clips to the file `out`.

    folder: the folder with the BVH files of CMU.
    """
    of_performers = [covariance(healthy_windows(folder, performer)) for performer in REFERENCE]
    save_npz(
        out,
        performers=np.array(list(REFERENCE)),
        covariances=np.array([square for square, _ in of_performers]),
        clips=np.array([clips for _, clips in of_performers]),
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns the exit status."""
    paths = sys.argv[1:] if arguments is None else list(arguments)
    if len(paths) not in (1, 2):
        print("Usage: python -m hobble.gait.derive_healthy CMU_FOLDER [HEALTHY.npz]", file=sys.stderr)
        return 2
    try:
        derive(*paths)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
