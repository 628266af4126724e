"""Measures the walker from its files."""

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.motion.read import decode_channels, read_bvh
from hobble.synthetic.generate_clip import Synthetic, write_clip

Array = np.ndarray
CONTACT = 0.02  # cm2 per 60 Hz frame


@dataclass(frozen=True)
class Files:
    """The three files of a clip. Frames count from 0 at 60 Hz (every second frame of the BVH file)."""

    folder: Path
    name: str

    def text(self, ending: str) -> str:
        return (self.folder / f"{self.name}{ending}").read_text()

    @cached_property
    def clip(self) -> Clip:
        return decode_channels(read_bvh(self.folder / f"{self.name}.bvh"))[0].part(slice(None, None, 2))

    @property
    def positions(self) -> Array:
        return self.clip.positions

    def joint(self, name: str) -> Array:
        return self.positions[:, self.clip.skeleton.index(name)]

    @cached_property
    def footsteps(self) -> Array:
        """(N, 2) 1-based frames of the file: right lands, left lands."""
        return np.loadtxt(self.folder / f"{self.name}_footsteps.txt", int)

    def landings(self, side: str) -> Array:
        return (self.footsteps[:, 0 if side == "Right" else 1]) // 2

    @cached_property
    def facing(self) -> Array:
        arms, hips = (self.joint(f"Left{part}") - self.joint(f"Right{part}") for part in ("Arm", "UpLeg"))
        ahead = np.cross(arms + hips, [0.0, 1.0, 0.0])
        return ahead / np.linalg.norm(ahead, axis=1, keepdims=True)

    def ahead(self, vectors: Array) -> Array:
        return np.sum(vectors * self.facing, axis=1)

    def contact(self, joint: str) -> Array:
        moved = np.sum(np.diff(self.joint(joint), axis=0) ** 2, axis=1)
        return np.append(moved, moved[-1]) < CONTACT

    def down(self, side: str) -> Array:
        return self.contact(f"{side}Foot") | self.contact(f"{side}ToeBase")

    def angles(self, side: str) -> dict[str, Array]:
        """Degrees in the sagittal plane: thigh from the vertical, knee bend, ankle from the standing foot."""

        def slope(above: str, below: str) -> Array:
            bone = self.joint(f"{side}{below}") - self.joint(f"{side}{above}")
            return np.degrees(np.arctan2(self.ahead(bone), -bone[:, 1]))

        thigh, shank, foot = slope("UpLeg", "Leg"), slope("Leg", "Foot"), slope("Foot", "ToeBase")
        flat = np.degrees(np.arctan2(13.5, 4.5))
        return {"hip": thigh, "knee": thigh - shank, "ankle": foot - shank - flat}

    def cycles(self, side: str, slowest: float = 0.0, fastest: float = np.inf) -> list[tuple[int, int]]:
        """First and last frame of each cycle of a foot whose mean speed lies between the two, cm/s."""
        hips = self.joint("Hips")[:, [0, 2]]
        out = []
        for a, b in itertools.pairwise(self.landings(side)):
            speed = np.sum(np.linalg.norm(np.diff(hips[a : b + 1], axis=0), axis=1)) / (b - a) * 60
            if slowest <= speed <= fastest:
                out.append((int(a), int(b)))
        return out


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory, holden31: Skeleton) -> Callable[..., Files]:
    """Writes a clip once a session: `written(name, recipe, frames)`."""
    folder = tmp_path_factory.mktemp("synthetic")

    @functools.cache
    def write(name: str, recipe: str, frames: int = 600) -> Files:
        paths: dict[str, Any] = {"bvh": (here := folder / f"{frames}-{recipe}") / f"{name}.bvh"}
        paths |= {ending: here / f"{name}_{ending}.txt" for ending in ("footsteps", "gait")}
        write_clip(name, holden31.to_dict(), frames, recipe, Synthetic(), **paths)
        return Files(here, name)

    return write
