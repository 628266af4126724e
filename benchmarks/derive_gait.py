"""Writes the statistics with which `hobble.gait` judges walks, from the recordings that they come from.

    python benchmarks/derive_gait.py people WALKS.npz [PEOPLE.npz]
    python benchmarks/derive_gait.py healthy CMU_FOLDER [HEALTHY.npz]
    python benchmarks/derive_gait.py groups CMU_FOLDER --actor FERRE.bvh --patients PATIENTS.csv

people.npz has the profiles of the people whom Jun et al. (2020) recorded (`hobble.gait.profile`), and as
`curves` (6, 22, 50) the means of their curves over the people, rounded to float16. Of WALKS.npz it reads five
arrays: `gaits`, `curves`, `scalars`, the names GAITS, CURVES and SCALARS; `curve` (6, people, 22, 50) and
`scalar` (6, people, 8), medians over the cycles of each person in each gait.

healthy.npz says how much the features of healthy walks vary within one person: with the speed, on slight
curves, and from one window of 4 seconds to another. The motion was obtained from mocap.cs.cmu.edu, which was
funded by NSF EIA-0196217.

groups.json has the mean limps (`hobble.gait.judge`) of two groups of other people. Actors: CMU 105_25,
compared with the same person's healthy walks, and the clips after --actor (Ferre et al. 2019), compared with
people's normal walks. Patients: the clips of PATIENTS.csv (columns `file` and `diagnosis`; Rueangsirarak et
al. 2018), compared with the clips there whose diagnosis is `healthy`. The leg that stands shorter is the hurt
one.
"""

import argparse
import csv
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from hobble.cli.gait import read_clip
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.files import load_npz, save_npz
from hobble.core.quat import Array
from hobble.gait.cycles import CURVES, SCALARS, WalkCycles, measure_clip
from hobble.gait.judge import GROUPS_FILE, numbers
from hobble.gait.profile import (
    GAITS,
    PEOPLE_FILE,
    Profile,
    features,
    healthy_profile,
    mirror_profile,
    profile_of_curves,
    profile_of_walk,
)
from hobble.gait.recognise import HEALTHY_FILE, windows_with_cycles

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


def derive_people(walks: Path, out: Path) -> None:
    """Raises InputError if the names of gaits, curves or scalars are not the expected ones."""
    data = load_npz(walks)
    for name, expected in (("gaits", GAITS), ("curves", CURVES), ("scalars", SCALARS)):
        if tuple(map(str, data[name])) != tuple(expected):
            raise InputError(walks, f"`{name}` should be {', '.join(expected)}")
    profiles = [
        [list(profile_of_curves(c, s).values()) for c, s in zip(curves, scalars, strict=True)]
        for curves, scalars in zip(data["curve"].astype(float), data["scalar"].astype(float), strict=True)
    ]
    means = data["curve"].mean(axis=1, dtype=float)
    save_npz(out, profiles=np.array(profiles, np.float32), curves=means.astype(np.float16))


def healthy_windows(folder: Path, performer: str) -> Iterator[tuple[str, Profile, Profile]]:
    """(name of the clip, profile, profile of the reference) of each window of a performer's walks.

    The reference is the performer's walks in REFERENCE without the clip itself.
    """
    clips = {name: read_clip(folder / f"{name}.bvh") for name in REFERENCE[performer] + OTHERS[performer]}
    for name, clip in clips.items():
        healthy = healthy_profile([clips[other] for other in REFERENCE[performer] if other != name])
        for part in parts(clip):
            yield name, profile_of_walk(part), healthy


def parts(clip: Clip) -> list[WalkCycles]:
    """The cycles in each window. If no window has enough cycles, all cycles are one part."""
    walk = measure_clip(clip)
    return [part for _, part in windows_with_cycles(walk, len(clip), SECONDS)] or [walk] * bool(len(walk))


def covariance(compared_windows: Iterable[tuple[str, Profile, Profile]]) -> tuple[Array, int]:
    """The covariance (D, D) of the features of windows, and the number of clips.

    It is the mean of x x^T over the features x, because features of a walk that equals its reference are 0.
    Left and right count equally, and so do all clips.
    """
    by_clip: dict[str, list[Array]] = {}
    for name, walk, healthy in compared_windows:
        for pair in ((walk, healthy), (mirror_profile(walk), mirror_profile(healthy))):
            by_clip.setdefault(name, []).append(np.array(list(features(*pair).values())))
    squares = [np.einsum("ni,nj->ij", x, x) / len(x) for x in map(np.array, by_clip.values())]
    return np.mean(squares, axis=0), len(by_clip)


def derive_healthy(folder: Path, out: Path) -> None:
    found = [covariance(healthy_windows(folder, performer)) for performer in REFERENCE]
    squares, clips = map(np.array, zip(*found, strict=True))
    save_npz(out, performers=np.array(list(REFERENCE)), covariances=squares, clips=clips)


def derive_groups(folder: Path, actors: Iterable[Path], patients: Path, out: Path) -> None:
    rows = list(csv.DictReader(patients.read_text().splitlines()))
    files = {row["file"]: row["diagnosis"] for row in rows}
    clips = {name: read_clip(patients.parent / name) for name in files}
    healthy = healthy_profile([clip for name, clip in clips.items() if files[name] == "healthy"])
    own = healthy_profile([read_clip(folder / f"{name}.bvh") for name in REFERENCE["105"]])
    pairs = {
        "actors": [
            (read_clip(folder / "105_25.bvh"), own),
            *((read_clip(path), healthy_profile([])) for path in actors),
        ],
        "patients": [(clip, healthy) for name, clip in clips.items() if files[name] != "healthy"],
    }
    means = {}
    for group, compared in pairs.items():
        limps = [limp for clip, healthy in compared if (limp := numbers_of_clip(clip, healthy))]
        means[group] = {name: round(float(np.mean([limp[name] for limp in limps])), 4) for name in limps[0]}
    out.write_text(json.dumps(means, indent=1) + "\n")


def numbers_of_clip(clip: Clip, healthy: Profile) -> dict[str, float] | None:
    """The numbers of a limp; None if the clip has no cycle."""
    if not len(cycles := measure_clip(clip)):
        return None
    walk = profile_of_walk(cycles)
    pair = walk, healthy
    if walk["stance_share_R"] > walk["stance_share_L"]:
        pair = mirror_profile(walk), mirror_profile(healthy)
    return numbers(*pair)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", choices=("people", "healthy", "groups"))
    parser.add_argument("source", type=Path)
    parser.add_argument("out", type=Path, nargs="?")
    parser.add_argument("--actor", action="append", type=Path, default=[], help="a limp of an actor, as .bvh")
    parser.add_argument("--patients", type=Path, help="table of the patients' clips, as .csv")
    options = parser.parse_args()
    if options.which == "people":
        derive_people(options.source, options.out or PEOPLE_FILE)
    elif options.which == "groups":
        derive_groups(options.source, options.actor, options.patients, options.out or GROUPS_FILE)
    else:
        derive_healthy(options.source, options.out or HEALTHY_FILE)


if __name__ == "__main__":
    main()
