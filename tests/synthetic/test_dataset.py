"""The synthetic data sets are complete and balanced, and held-out clips have similar ones in training."""

import pytest
import yaml

from hobble.synthetic.plan import GAITS, GROUND, RECIPES


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
