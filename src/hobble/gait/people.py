"""Statistics of ten people who walked normally and imitated five impairments of the right leg.

They were recorded with a Kinect. Source: Jun et al. (2020), "Pathological gait classification using Kinect v2
and gated recurrent neural networks", IEEE Access 8. The statistics are in `people.npz`, which
`derive_people.py` writes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.gait.cycles import SCALARS
from hobble.gait.profile import PROFILE_NAMES, Profile
from hobble.gait.signals import CURVES

PEOPLE_FILE = Path(__file__).with_name("people.npz")
SOURCE = "Jun et al. 2020, IEEE Access 8, ten people"
NORMAL = "normal"
GAITS = (NORMAL, "antalgic", "stiff_legged", "steppage", "trendelenburg", "lurch")


@dataclass(frozen=True)
class People:
    """Ten people walking in the six ways of GAITS, with the impaired leg on the right.

    profiles: (6, 10, 52) profile of each gait and person, columns as PROFILE_NAMES. curve_mean, curve_spread:
    (6, 22, 50) mean and standard deviation over people, for each gait, curve of CURVES and sample, in degrees
    or leg lengths. A curve starts as the right foot lands. scalar_mean, scalar_spread: (6, 8) mean and
    standard deviation for each gait and scalar of SCALARS.
    """

    profiles: Array = field(repr=False)
    curve_mean: Array = field(repr=False)
    curve_spread: Array = field(repr=False)
    scalar_mean: Array = field(repr=False)
    scalar_spread: Array = field(repr=False)

    @property
    def count(self) -> int:
        """The number of people."""
        return self.profiles.shape[1]

    def profile(self, gait: str, person: int) -> Profile:
        """One person's profile of a gait."""
        row = self.profiles[GAITS.index(gait), person]
        return dict(zip(PROFILE_NAMES, map(float, row), strict=True))

    def normal_profile(self) -> Profile:
        """The mean of the people's normal walks. A figure without a healthy walk is compared with it."""
        return dict(zip(PROFILE_NAMES, map(float, self.profiles[0].mean(axis=0)), strict=True))

    def curve(self, gait: str, name: str) -> tuple[Array, Array]:
        """Mean (50,) and standard deviation (50,) over people of one curve."""
        g, c = GAITS.index(gait), CURVES.index(name)
        return self.curve_mean[g, c], self.curve_spread[g, c]

    def scalar(self, gait: str, name: str) -> tuple[float, float]:
        """Mean and standard deviation over people of one scalar."""
        g, s = GAITS.index(gait), SCALARS.index(name)
        return float(self.scalar_mean[g, s]), float(self.scalar_spread[g, s])


@cache
def read_people() -> People:
    """The statistics in `people.npz`."""
    data = load_npz(PEOPLE_FILE)
    names = ("profiles", "curve_mean", "curve_spread", "scalar_mean", "scalar_spread")
    return People(*(data[name].astype(float) for name in names))
