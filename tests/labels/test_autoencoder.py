"""Local phases that a periodic autoencoder finds in motion."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.labels.autoencoder import (
    RATE,
    SAMPLES,
    PhaseAutoencoder,
    load_autoencoder,
    save_autoencoder,
    train,
    wave_of,
)
from hobble.labels.local_phase import MIRRORED_PARTS
from hobble.motion.edit import mirror_clip

SWAPPED = list(MIRRORED_PARTS)
HZ, LARGE, SMALL = 1.5, 0.6, 0.3  # radians by which the arms swing


@pytest.fixture(scope="module")
def swinging(holden31: Skeleton) -> Callable[[float], Clip]:
    """Makes a clip of a figure on the spot, whose left arm swings, and the right one half a cycle later."""

    def make(amplitude: float, frames: int = 480) -> Clip:
        rotations = np.tile(quat.IDENTITY, (frames, len(holden31.joints), 1))
        angle = 2 * np.pi * HZ * np.arange(frames) / 60
        for side in ("left", "right"):  # the same turn: one arm ahead, the other back
            joint = holden31.role(f"{side}_shoulder")
            rotations[:, joint] = quat.yaw(amplitude * np.sin(angle))
        return Clip("swing", holden31, 60.0, rotations, np.tile([0.0, 93.0, 0.0], (frames, 1)))

    return make


@pytest.fixture(scope="module")
def trained(swinging: Callable[[float], Clip]) -> PhaseAutoencoder:
    return train([swinging(LARGE), swinging(SMALL)], steps=80)


def test_the_wave_of_a_sine_has_its_amplitude_and_frequency() -> None:
    seconds = torch.arange(SAMPLES) / RATE
    frequency = 3 * RATE / SAMPLES
    found = wave_of(0.7 * torch.sin(2 * torch.pi * frequency * seconds + 0.4) + 0.2)
    np.testing.assert_allclose([float(value) for value in found], [0.7, frequency, 0.2], rtol=1e-3)


def test_a_planted_swing_is_found(trained: PhaseAutoencoder, swinging: Callable[[float], Clip]) -> None:
    middle, lengths = slice(100, 380), []
    for amplitude in (LARGE, SMALL):
        vectors, change = trained.local_phases(swinging(amplitude))
        np.testing.assert_allclose(change[middle].mean(axis=0), HZ / 60, rtol=0.05)
        lengths.append(np.linalg.norm(vectors[middle], axis=-1).mean(axis=0))
    assert (lengths[0] > 1.1 * lengths[1]).all(), "a larger swing has longer vectors"
    assert lengths[0].max() > 1.5 * lengths[1].max()
    angle = np.arctan2(vectors[middle, :, 1], vectors[middle, :, 0]) / (2 * np.pi)
    apart = np.abs((angle[:, 0::2] - angle[:, 1::2] + 0.5) % 1 - 0.5)
    np.testing.assert_allclose(apart.mean(axis=0), 0.5, atol=0.06)
    still, _ = trained.local_phases(swinging(0.0))
    assert np.abs(still).max() < 0.1 * lengths[0].min()


def test_a_mirrored_clip_has_the_phases_of_the_other_side(
    trained: PhaseAutoencoder, walker: Callable[..., Clip]
) -> None:
    clip = walker(300, limp=0.4)
    vectors, change = trained.local_phases(clip)
    mirrored, mirrored_change = trained.local_phases(mirror_clip(clip, "mirrored"))
    np.testing.assert_allclose(mirrored, vectors[:, SWAPPED], atol=1e-3)
    np.testing.assert_allclose(mirrored_change, change[:, SWAPPED], atol=1e-3)
    assert np.abs(vectors - vectors[:, SWAPPED]).max() > 0.1


def test_the_same_seed_gives_the_same_file(
    swinging: Callable[[float], Clip], tmp_path: Path, holden31: Skeleton
) -> None:
    short = swinging(LARGE, 100)
    files = [tmp_path / name for name in ("one.npz", "two.npz", "other.npz")]
    for file, seed in zip(files, (1, 1, 2), strict=True):
        save_autoencoder(file, train([short, replace(short, name="again")], seed=seed, steps=3))
    one, two, other = (file.read_bytes() for file in files)
    assert one == two
    assert one != other
    trained = train([short], seed=1, steps=3)
    save_autoencoder(files[0], trained)
    again = load_autoencoder(files[0], holden31).local_phases(short)
    np.testing.assert_array_equal(again[0], trained.local_phases(short)[0])
