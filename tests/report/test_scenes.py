from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.report.body import capsules
from hobble.report.scenes import UNIT, pack_positions


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_positions_come_back_within_a_tenth_of_a_millimetre() -> None:
    rng = np.random.default_rng(0)
    world = rng.uniform(-90, 90, (7, 5, 3)) + rng.uniform(-4000, 4000, (7, 1, 3))
    packed = pack_positions(world)
    root = unpacked(packed["root"], "<f4").reshape(7, 1, 3)
    pose = unpacked(packed["pose"], "<i2").reshape(7, 5, 3)
    assert np.abs(root + pose * UNIT - world).max() < 0.01


def test_every_scenario_is_thinned_to_thirty_hertz(play: dict[str, Any]) -> None:
    assert play["fps"] == 30
    walk, hurt = play["scenarios"][0], play["scenarios"][-1]
    assert (walk["name"], walk["frames"]) == ("Walk", 300)
    assert len(unpacked(walk["pose"], "<i2")) == 300 * play["joints"] * 3
    assert play["joints"] < 31, "joints that are not drawn need not lie in the page"
    assert len(unpacked(walk["contacts"], "u1")) == 300
    assert "severity" not in walk
    severity = unpacked(hurt["severity"], "u1").reshape(hurt["frames"], len(play["links"]))
    knee = play["links"].index("LeftUpLeg-LeftLeg")
    assert severity[-1, knee] == pytest.approx(249, abs=2)
    assert not np.delete(severity, knee, axis=1).any()


def test_a_link_colours_the_part_that_it_is(holden31: Skeleton) -> None:
    parts = capsules(holden31.joints, holden31.parents, holden31.roles, holden31.link_names)

    def coloured(link: str) -> set[tuple[str, str]]:
        i = holden31.link_names.index(link)
        return {(holden31.joints[p["a"]], holden31.joints[p["b"]]) for p in parts if i in p["links"]}

    assert coloured("LeftUpLeg-LeftLeg") == {("LeftUpLeg", "LeftLeg")}
    assert coloured("RightArm-RightForeArm") == {("RightArm", "RightForeArm")}
    assert coloured("Hips-LowerBack") == {("Hips", "Spine1")}
    covered = {i for p in parts for i in p["links"]}
    assert covered == set(range(len(holden31.links)))


def test_a_body_of_unknown_roles_has_every_bone() -> None:
    parts = capsules(("a", "b", "c"), (-1, 0, 1), {}, ("b-c",))
    assert [(p["a"], p["b"], p["links"]) for p in parts] == [(0, 1, []), (1, 2, [0])]


def test_links_of_joints_with_hyphens() -> None:
    parts = capsules(("a-b", "c"), (-1, 0), {}, ("a-b-c",))
    assert parts[0]["links"] == [0]
