"""Loops drawn without a browser: no seam, injuries coloured on request, readable by other programs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hobble.channels.injury import shown as injury_shown
from hobble.core import quat
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.figure.mesh import body_mesh
from hobble.figure.pack import links_of_bones
from hobble.models.network import Network
from hobble.motion.read import read_bvh
from hobble.report import raster, stimuli
from hobble.report.raster import BODY, BodyRenderer, Camera
from hobble.runtime import Runtime

UPRIGHT = np.tile(quat.IDENTITY, (19, 1))


@pytest.fixture(scope="module")
def studio(holden31: Skeleton) -> BodyRenderer:
    return BodyRenderer(holden31, links_of_bones(holden31, holden31.link_names))


@pytest.fixture(scope="module")
def standing(holden31: Skeleton) -> np.ndarray:
    place = rest_positions(holden31)
    return place[body_mesh(holden31).bones] - [0, place[:, 1].min() - 2.7, 0]


def test_the_body_stands_where_the_camera_says_and_its_injured_part_is_coloured(
    studio: BodyRenderer, standing: np.ndarray, holden31: Skeleton
) -> None:
    camera = Camera(np.array([0.0, 82.0, 0.0]), yaw=0.0, pitch=0.1, size=200)
    severity = np.array([float(link == "LeftLeg-LeftFoot") for link in holden31.link_names])
    plain, shown = (studio.draw(standing, UPRIGHT, camera, v).astype(int) for v in (None, severity))
    bare = studio.draw(standing + np.array([0, 0, -5000.0]), UPRIGHT, camera).astype(int)
    drawn = np.abs(plain - bare).max(axis=-1) > 25
    x, y, _ = camera.project(standing).T
    rows, columns = np.nonzero(drawn)
    assert columns.min() == pytest.approx(x.min(), abs=22)  # hands reach on past the wrists
    assert rows.max() == pytest.approx(y.max(), abs=10)  # and toes past their joints
    assert all(drawn[int(y[joint]), int(x[joint])] for joint in range(len(standing)))
    assert np.ptp(plain[int(y[0]), int(x[0])] / 255 / BODY) < 0.05, "grey, lighter or darker"
    red, before = (picture[..., 0] - picture[..., 2] for picture in (shown, plain))
    rows, columns = np.nonzero((red > 50) & (before <= 20))
    assert len(rows) > 50
    keep = body_mesh(holden31).bones.tolist()
    knee, heel = (keep.index(holden31.joints.index(name)) for name in ("LeftLeg", "LeftFoot"))
    assert y[knee] - 10 < rows.min() <= rows.max() < y[heel] + 10
    assert np.all(np.abs(columns - x[knee]) < 15)


def test_a_loop_is_written_as_pictures_and_bvh(
    network: Network, runtime: Runtime, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(injury_shown, "PLAIN_LOOPS", {"healthy": (), "left-foot": ("left foot",)})
    monkeypatch.setattr(injury_shown, "PRESETS", {"Bad back": {"lower back": 8}})
    x_mean = network.x_mean.copy()
    x_mean[network.layout.x_channel("injury")][network.channels["injury"].index("LeftFoot-LeftToeBase")] = 0.5
    network = replace(network, x_mean=x_mean)  # a network that learnt from a hurt left foot, and nothing else
    stimuli.write_stimuli(network, tmp_path / "a", runtime, size=64)
    names = ["healthy", "left-foot", "preset-bad-back", "guarding"]
    assert {p.name for p in (tmp_path / "a").iterdir()} == {"stimuli.json"} | {
        f"{n}.{kind}" for n in names for kind in ("webp", "bvh")
    }
    listed = json.loads((tmp_path / "a/stimuli.json").read_text())["stimuli"]
    assert [row["name"] for row in listed] == names
    assert [row["untrained"] for row in listed[:3]] == [[], [], ["Hips-LowerBack"]]
    assert listed[0]["from_plain_cm"] == 0 != listed[1]["from_plain_cm"]
    with Image.open(tmp_path / "a/left-foot.webp") as image:
        frames = len(read_bvh(tmp_path / "a/left-foot.bvh"))
        assert image.n_frames == frames // raster.FRAME_STEP
        assert image.info["loop"] == 0
        assert frames / 60 == pytest.approx(listed[1]["seconds"])
