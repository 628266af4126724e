"""A clip on a flat floor gets flat ground, adapted only where feet are in it or as the options say."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hobble.terrain.clip_fits import clip_fits
from hobble.terrain.patches import Patches
from tests.terrain.grounds import GROUNDS


def test_flat_ground_is_zero_and_one_fit(made: SimpleNamespace, patches: Patches) -> None:
    walk = made.walk(GROUNDS["level"])
    fits = clip_fits(walk.clip, walk.labels, patches, "flat", made.options(), made.database())
    assert np.all(fits.fits == 1)
    assert fits.heights.shape == (len(fits.frame), 36)
    assert np.all(fits.heights == 0)
    assert np.all(fits.patch == -1)
    assert fits.foot_error.shape == (len(walk.labels["cycles"]), 10, 2)
    assert fits.foot_error.max() < 0.01


@pytest.mark.parametrize("bent", [True, False])
def test_an_uneven_floor_is_adapted_only_if_configured(
    made: SimpleNamespace, patches: Patches, caplog: pytest.LogCaptureFixture, bent: bool
) -> None:
    walk = made.walk(GROUNDS["waves"])
    options = made.options(bend_flat=bent)
    fits = clip_fits(walk.clip, walk.labels, patches, "flat", options, made.database())
    assert np.all(fits.fits == 1)
    assert np.any(fits.heights != 0) is np.bool_(bent)
    assert (fits.foot_error[..., 0].max() < 1) is np.bool_(bent)
    assert (fits.foot_below.max() <= 1) is np.bool_(bent)
    assert ("feet in contact are" in caplog.text) is not bent


def test_a_foot_below_a_flat_floor_makes_only_a_local_pit(made: SimpleNamespace, patches: Patches) -> None:
    walk = made.walk(GROUNDS["level"])
    contacts = walk.labels["contacts"]
    frame = np.flatnonzero(~contacts[:, 1] & (np.arange(420) > 100))[5]
    feet = walk.clip.positions[:, -4:].copy()
    feet[frame, 1, 1] = 2.5 - 4
    clip = made.figure(feet, walk.clip.root)
    fits = clip_fits(clip, walk.labels, patches, "flat", made.options(), made.database())
    assert np.all(fits.heights == 0)
    assert fits.foot_error.max() < 0.01
    assert 0 < fits.foot_below.max() <= 1
    options = made.options(bend_flat=False)
    as_it_is = clip_fits(clip, walk.labels, patches, "flat", options, made.database())
    assert as_it_is.foot_below.max() == pytest.approx(4)


def test_a_heel_held_up_over_its_standing_toe_is_not_on_a_flat_floor(
    made: SimpleNamespace, patches: Patches
) -> None:
    """Like a crouch on the balls of the feet: heels that do not move are labelled as contacts."""
    walk = made.walk(GROUNDS["level"])
    feet = walk.clip.positions[:, -4:].copy()
    feet[:, [0, 2], 1] += 5
    clip = made.figure(feet, walk.clip.root)
    fits = clip_fits(clip, walk.labels, patches, "flat", made.options(), made.database())
    assert np.all(fits.heights == 0)
    assert fits.foot_error.max() < 0.01


def test_flat_ground_can_be_at_the_height_of_the_feet_as_in_the_original(
    made: SimpleNamespace, patches: Patches
) -> None:
    walk = made.walk(lambda x, z: np.full_like(z, 3.0))
    for level, expected in (("zero", 0.0), ("feet", 3.0)):
        options = made.options(flat_level=level, deepest=None)
        fits = clip_fits(walk.clip, walk.labels, patches, "flat", options, made.database())
        assert np.allclose(fits.heights, expected, atol=1e-5)
