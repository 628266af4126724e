from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.report.body import body
from hobble.report.loft import triangles, vertices
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


def coloured(dressed: dict[str, Any], link: int) -> set[int]:
    """Joints between which the sections lie that a link colours."""
    found = set()
    for tube in dressed["tubes"]:
        for section in tube["sections"]:
            if link in dressed["parts"][section[-1]]:
                found |= set(tube.get("ends") or section[:2])
    return {dressed["keep"][j] for j in found}


def test_a_link_colours_the_part_that_it_is(holden31: Skeleton) -> None:
    dressed = body(holden31.joints, holden31.parents, holden31.roles, holden31.link_names)

    def between(link: str) -> set[str]:
        return {holden31.joints[j] for j in coloured(dressed, holden31.link_names.index(link))}

    assert between("LeftUpLeg-LeftLeg") == {"LeftUpLeg", "LeftLeg"}
    assert between("RightArm-RightForeArm") == {"RightArm", "RightForeArm"}
    assert between("Hips-LowerBack") == {"Hips", "Spine1"}
    assert {i for part in dressed["parts"] for i in part} == set(range(len(holden31.links)))


def test_a_body_of_unknown_roles_has_every_bone() -> None:
    dressed = body(("a", "b", "c"), (-1, 0, 1), {}, ("b-c",))
    assert [tube["sections"][0][:2] for tube in dressed["tubes"]] == [[0, 1], [1, 2]]
    assert coloured(dressed, 0) == {1, 2}


def test_links_of_joints_with_hyphens() -> None:
    assert coloured(body(("a-b", "c"), (-1, 0), {}, ("a-b-c",)), 0) == {0, 1}


def test_the_surface_of_a_body_is_closed_and_of_a_grown_persons_volume(holden31: Skeleton) -> None:
    dressed = body(holden31.joints, holden31.parents, holden31.roles)
    place = np.zeros((len(holden31.joints), 3))
    for j, p in enumerate(holden31.parents):
        place[j] = holden31.offsets[j] + (place[p] if p >= 0 else 0)
    corners, faces = vertices(dressed, place[dressed["keep"]]), triangles(dressed)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges), "every edge is walked once each way"
    assert {tuple(e) for e in edges.tolist()} == {tuple(e[::-1]) for e in edges.tolist()}
    a, b, c = corners[faces].transpose(1, 0, 2)
    assert 45 < (a * np.cross(b, c)).sum() / 6 / 1000 < 75  # litres; positive, so seen from outside
    size = corners.max(axis=0) - corners.min(axis=0)
    assert size[1] == pytest.approx(164, abs=4)
    mirrored = corners * [-1, 1, 1]
    assert np.abs(np.sort(mirrored[:, 0]) - np.sort(corners[:, 0])).max() < 1e-6
