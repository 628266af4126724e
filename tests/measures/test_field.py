"""The measurement `field`: paths and response of a figure known exactly; captured motion as itself."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hobble.measures import field_run as module
from hobble.measures.field import Options, hints, rows, section
from hobble.motion.skeleton_file import find_skeleton, load_skeleton
from hobble.runtime import Runtime
from hobble.synthetic.generate_clip import generate_walk


class Point:
    """A figure whose speed rises in `frames` frames to what is asked, and which turns at once."""

    frames = 1

    def __init__(
        self, network: Any, *, position: Any = (0.0, 0.0), facing: Any = None, **options: Any
    ) -> None:
        self.place, self.share = np.array(position, float), 0.0

    def next_pose(self, velocity: Any, gait: Any = None) -> SimpleNamespace:
        velocity = np.asarray(velocity, float)
        self.share = min(1.0, self.share + 1 / self.frames) if velocity.any() else 0.0
        self.place = self.place + self.share * velocity
        return SimpleNamespace(root=np.array([self.place[0], 0.0, self.place[1]]))


def test_a_point_that_does_as_asked_is_as_far_off_as_its_look_ahead_says(monkeypatch):
    monkeypatch.setattr(module, "ProceduralAnimation", Point)
    found = module.follow_path(None, Runtime(), module.paths()["circle"])
    # It goes on the circle from whose tangent the point ahead is seen: L^2 / 2R inside, with L = 40 cm.
    assert found["cm"] == pytest.approx(40**2 / 500, abs=0.3)
    assert found["degrees"] < 1.0


def test_response_is_the_time_to_most_of_the_asked_speed(monkeypatch):
    """The mean of the last 15 frames is .8 of the asked speed 12 frames after the start, and, for a speed
    that grows in 60 frames, 7 frames after it is .8."""
    monkeypatch.setattr(module, "ProceduralAnimation", Point)
    for frames, expected in ((1, 12 / 60), (60, (48 + 7) / 60), (10_000, None)):
        monkeypatch.setattr(Point, "frames", frames)
        assert module.response(None, Runtime(), "walk", 2.0) == pytest.approx(expected, abs=0.02)


def captured_commands() -> list[module.Command]:
    """Two synthetic walks, as if captured."""
    skeleton = load_skeleton(find_skeleton("holden31"), "holden31").skeleton
    out = []
    for seed in (1, 2):
        clip = generate_walk("a", skeleton, 400, "walk", 60.0, seed).clip
        velocity = np.gradient(clip.root[:, ::2], axis=0)
        gait = np.tile([0.0, 1, 0, 0, 0, 0], (len(clip), 1))
        out.append(module.Command(velocity, gait, velocity, (clip.positions, clip.rotations)))
    return out


def test_captured_motion_that_is_walked_again_exactly_is_equal_to_itself(monkeypatch):
    commands = captured_commands()
    monkeypatch.setattr(module, "walk_commands", lambda network, runtime, asked: [c.motion for c in asked])
    skeleton = load_skeleton(find_skeleton("holden31"), "holden31").skeleton
    found = module.compare_with_captured(SimpleNamespace(skeleton=skeleton), Runtime(), commands)
    assert found["character"].pop("frechet") == pytest.approx(0.0, abs=1e-6)
    assert found["captured"].pop("frechet") > 0
    assert found["character"] == found["captured"]
    assert found["captured"]["skating_toes"] < 0.2


def test_the_measurement_of_a_network_and_its_section(network):
    found = module.measure_field(network, Runtime(), Options(field_seconds=2), {"train": captured_commands()})
    published = {"field": [{"measure": "paths_circle_cm", "value": 2.98, "source": "MANN"}]}
    assert found["split"] == "train"
    assert found["asked"]["captured"]["jerk"] > 0
    table = {row["measure"]: row for row in rows(found, published["field"])}
    circle = table["distance from a circle, cm"]
    assert (circle["straight"], circle["published"]) == (found["paths"]["circle"]["cm"], "2.98 (MANN)")
    assert table["jerk, m/s3"]["captured"] == found["asked"]["captured"]["jerk"]
    assert section(found, SimpleNamespace(published=published)).parts
    found["asked"]["character"]["jerk"] = 2 * found["asked"]["captured"]["jerk"]
    assert any("jerk" in hint.head for hint in hints(found, None))
