"""The synthetic data sets are complete and balanced, and held-out clips have similar ones in training."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from hobble.synthetic.plan import GAITS, GROUND, RECIPES, plan


def plans(data):
    """clip -> (entry, its plan at the length it has)."""
    total = sum(entry.get("share", 1) for entry in data["clips"].values())
    for name, entry in data["clips"].items():
        frames = data["synthetic"]["frames"] * entry.get("share", 1) / total
        yield name, entry, frames, plan(entry["recipe"], 2 * frames, 120, data["synthetic"]["seed"], name)


@pytest.mark.parametrize("name", ["synthetic", "tiny"])
def test_the_data_set_names_only_existing_recipes(root, name):
    data = yaml.safe_load((root / f"config/datasets/{name}.yaml").read_text())
    for clip, entry in data["clips"].items():
        assert entry["recipe"] in RECIPES
        assert (entry.get("ground", "flat") == "rocky") == (entry.get("recipe") in GROUND), clip
        assert entry["gait"] in GAITS
    training = [entry for clip, entry in data["clips"].items() if clip not in data["held_out"]]
    for clip in data["held_out"]:
        entry = data["clips"][clip]
        if name == "synthetic":
            assert any(e["recipe"] == entry["recipe"] for e in training), f"nothing like {clip} is trained on"


def test_left_and_right_turns_balance_and_every_gait_has_its_share(dataset):
    seconds = dict.fromkeys(GAITS, 0.0)
    left = right = 0.0
    for _, _, frames, segments in plans(dataset):
        begun = 0.0
        for s in segments:
            inside = np.clip((frames / 60 - begun) / s.seconds, 0, 1)
            begun += s.seconds
            seconds[s.gait] += inside * s.seconds
            left, right = left + max(s.turn, 0) * inside, right + max(-s.turn, 0) * inside
    assert 0.7 < left / right < 1.4
    assert min(left, right) > 720
    share = {gait: t / sum(seconds.values()) for gait, t in seconds.items()}
    assert share["walk"] > 0.5
    assert share["jog"] > 0.1
    assert share["crouch"] > 0.02
    assert share["stand"] > 0.02
