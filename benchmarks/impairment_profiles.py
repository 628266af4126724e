"""Derives people.json, the profiles of impaired walks, from recordings of people.

python benchmarks/impairment_profiles.py IMPAIRED_WALKS.npz
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, write_json
from hobble.core.quat import Array
from hobble.hurt.effects import CURVES, HARMONICS, PROFILES_FILE

NORMAL = "normal"  # name of the walk without an impairment
SOURCE = "Jun et al. 2020, IEEE Access 8: means over ten people who imitated impairments of the right leg"


def derive_profiles(walks: str | Path, path: str | Path = PROFILES_FILE) -> None:
    """Derive the profiles from a file of recorded walks, and write them to `path`.

    walks: npz file. Its arrays `gaits`, `curves` and `scalars` hold names: of the kinds of walk (NORMAL and
    the impairments), of the curves, and of the measures that are one number for a person's walk. `curve` is
    (gaits, people, curves, 50): 50 samples over a cycle that begins when the right foot lands. `scalar` is
    (gaits, people, scalars). Raises InputError if an array is missing.
    """
    data = load_npz(walks)
    gaits = [str(name) for name in data["gaits"]]
    derived = {
        gait: _derive_profile(data, i, gaits.index(NORMAL)) for i, gait in enumerate(gaits) if gait != NORMAL
    }
    for profile in derived.values():
        for name, value in profile.items():
            profile[name] = _round(value)
    write_json(path, {"source": SOURCE, "profiles": derived})


def _derive_profile(data: Any, gait: int, normal: int) -> dict[str, Any]:
    """Compare two kinds of walk. gait, normal: their indices in the arrays of `data`.

    In the recordings the right side (R) is hurt and the left side (L) is sound.
    """
    scalars = {str(n): data["scalar"][:, :, i] for i, n in enumerate(data["scalars"])}
    curves = {str(n): data["curve"][:, :, i] for i, n in enumerate(data["curves"])}

    def ratio(values: Array) -> float:
        return float(values[gait].mean() / values[normal].mean())

    def difference(name: str) -> float:
        return float(np.mean(scalars[name][gait] - scalars[name][normal]))

    def ratio_of_ranges(name: str) -> float:
        return ratio(np.ptp(curves[name].astype(float), axis=-1))

    strike = scalars["left_strike_phase"]
    return {
        "speed": ratio(scalars["speed_per_leg"]),
        "stride": ratio(scalars["stride_seconds"]),
        "strike": difference("left_strike_phase"),
        "stance_hurt": difference("stance_share_R"),
        "stance_sound": difference("stance_share_L"),
        "step_hurt": ratio(scalars["step_R"]),
        "step_sound": ratio(scalars["step_L"]),
        "width": difference("step_width"),
        "knee": ratio_of_ranges("knee_flexion_R"),
        "arm_hurt": ratio_of_ranges("arm_forward_R"),
        "arm_sound": ratio_of_ranges("arm_forward_L"),
        "curves": {
            name: list(
                _fit_harmonics(curves[name][gait], strike[gait])
                - _fit_harmonics(curves[name][normal], strike[normal])
            )
            for name in CURVES
        },
    }


def _fit_harmonics(curve: Array, strike: Array) -> Array:
    """(5,) mean of a curve, then the factors of cosine and sine of each harmonic, averaged over people.

    curve: (people, 50). strike: (people,) phase at which the left foot lands. Before the fit, the time of
    each person's cycle is warped so that this foot lands at phase .5.
    """
    samples = curve.shape[-1]
    phase = np.arange(samples) / samples
    waves = [np.ones(samples)]
    for h in range(1, HARMONICS + 1):
        waves += [np.cos(2 * np.pi * h * phase), np.sin(2 * np.pi * h * phase)]
    # Fourier coefficients: a curve (50,) times these weights (50, 5) gives its mean and factors.
    weights = np.stack(waves, axis=1) * np.array([1.0] + [2.0] * 2 * HARMONICS) / samples
    out = []
    for values, landing in zip(curve, strike, strict=True):
        warped = np.interp(phase, [0.0, 0.5, 1.0], [0.0, landing, 1.0])
        out.append(np.interp(warped, np.append(phase, 1.0), np.append(values, values[0])) @ weights)
    return np.mean(out, axis=0)


def _round(value: Any) -> Any:
    """Round a value of a profile, a number or the curves, so that the file stays short."""
    if isinstance(value, dict):
        return {name: [round(float(x), 2) for x in row] for name, row in value.items()}
    return round(float(value), 3)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("walks")
    derive_profiles(parser.parse_args().walks)
