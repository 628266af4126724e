"""Rows compared with the original database, and with exact values for simple motions."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.config.load_configuration import Catalogue
from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.labels import LabelOptions
from hobble.labels.label import label_clip
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.rows.build_rows import build_clip_rows
from hobble.rows.clip_rows import ClipRows, pair_batches
from hobble.rows.layout import GAITS, RowLayout
from hobble.terrain import HeightSampling, Terrain
from hobble.terrain.clip_fits import clip_fits, cycle_frames
from hobble.terrain.heightmaps import TerrainMap
from hobble.terrain.patches import draw_patches

NAME = "LocomotionFlat09_000"
OPTIONS = {"window": 60, "step": 10, "facing_sigma": 20.0}
# The data set of the original release. Its options must give the original's rows.
RELEASE = Catalogue(Path(__file__).parents[2] / "config").dataset("pfnn")
IN_CENTIMETRES = ("position", "joint_position")


def flat_terrain(cycles: np.ndarray, levels: np.ndarray) -> dict[str, np.ndarray]:
    """Terrain fits of flat ground, as the terrain stage writes them."""
    frame, cycle = cycle_frames(cycles)
    return {
        "frame": frame,
        "cycle": cycle,
        "fits": np.ones(len(frame), np.int32),
        "heights": np.repeat(levels[cycle, None], 36, axis=1),
        "patch": np.full((len(cycles), 10), -1),
    }


@pytest.fixture(scope="module")
def original(shared: Path) -> dict[str, np.ndarray]:
    with np.load(shared / "reference" / f"original_rows_{NAME}.npz") as file:
        return dict(file)


def options(section: str, **changed: object) -> dict[str, Any]:
    """A section of the original's data set, as its stage gets it."""
    kept = getattr(RELEASE, section)
    return type(kept)(**kept.model_dump() | changed).model_dump(mode="json")


def rows_as_configured(shared: Path, root: Path, margins: str = "drop", **terrain: object) -> ClipRows:
    """The rows of the reference clip, made by all stages with the options of the configuration."""
    skeletons = root / "config" / "skeletons"
    folder = shared / "mocap" / "pfnn"
    bvh, skeleton, motion = folder / f"{NAME}.bvh", skeletons / "holden31.yaml", options("motion")
    clip, report = make_clip(bvh, skeleton, skeletons, NAME, "holden31", ClipMotion(**motion))
    files = [folder / f"{NAME}{end}" for end in (".phase", ".gait", "_footsteps.txt", "_gait.txt")]
    labelling = LabelOptions.model_validate(options("labels", margins=margins))
    labels = vars(label_clip(clip, files, report, "walk", "flat", labelling)[0])
    ground, database = options("terrain", **terrain), options("database")
    any_map = TerrainMap("any", np.zeros((200, 200)), ground["cell"])
    drawn = {name: ground[name] for name in ("cell", "size", "highest", "seed")}
    patches = draw_patches([any_map], count=10, **drawn)
    sampling = HeightSampling(**{name: database[name] for name in HeightSampling.model_fields})
    fits = clip_fits(clip, labels, patches, "flat", Terrain(**ground), sampling)
    severity = np.zeros((len(clip), len(clip.skeleton.links)), np.float32)
    window = {name: database[name] for name in OPTIONS}
    return build_clip_rows(NAME, clip, labels, {"injury": severity}, vars(fits), **window)


@pytest.fixture(scope="module")
def rows(shared: Path, root: Path) -> ClipRows:
    return rows_as_configured(shared, root)


@pytest.mark.shared
def test_every_column_equals_that_of_the_original_rows(rows, original):
    layout = replace(rows.layout, channels=())
    (pairs,) = pair_batches(rows, rows.layout.with_channels(()))
    np.testing.assert_array_equal(np.bincount(rows.cycle), original["cycle_length"])
    np.testing.assert_allclose(pairs.p, original["P"], atol=1e-6)
    for prefix, ours, theirs in (("x", pairs.x, original["X"]), ("y", pairs.y, original["Y"])):
        assert ours.shape == theirs.shape
        for block, columns in layout.blocks(prefix).items():
            allowed, said = 1e-2 if block in IN_CENTIMETRES else 1e-3, f"{prefix} {block}"
            np.testing.assert_allclose(
                ours[:, columns], theirs[:, columns], rtol=0, atol=allowed, err_msg=said
            )


@pytest.mark.shared
@pytest.mark.parametrize(
    "change", [{"flat_level": "zero"}, {"held_up": 2.0}, {"heel_height": "auto"}, {"toe_height": "auto"}]
)
def test_every_setting_of_the_original_changes_the_rows(shared, root, original, change):
    """`deepest` and `bend_flat` do not matter, because the feet of this clip are never that far off."""
    other = rows_as_configured(shared, root, **change)
    with pytest.raises(AssertionError, match="x joint_position"):
        test_every_column_equals_that_of_the_original_rows(other, original)


@pytest.fixture(scope="module")
def walk() -> Clip:
    """A rigid figure that moves 2 cm a frame along +X and turns by 0.01 radians a frame."""
    names = ("Hips", "LeftUpLeg", "RightUpLeg", "LeftArm", "RightArm")
    offsets = np.array([[0, 0, 0], [10, -5, 0], [-10, -5, 0], [20, 40, 3], [-20, 40, 3]], float)
    kinds = ("hips", "left_hip", "right_hip", "left_shoulder", "right_shoulder")
    links, roles = (("Hips", "LeftUpLeg"), ("Hips", "LeftArm")), dict(zip(kinds, names, strict=True))
    skeleton, t = Skeleton("stiff", names, (-1, 0, 0, 0, 0), offsets, roles, links), np.arange(300)
    rotations = np.tile(quat.IDENTITY, (300, 5, 1))
    rotations[:, 0] = quat.yaw(0.01 * t)
    root = np.stack([2.0 * t, np.full(300, 90.0), np.zeros(300)], axis=1)
    return Clip("walk", skeleton, 60.0, rotations, root)


@pytest.fixture
def labels() -> dict[str, np.ndarray]:
    t = np.arange(300)
    gait = np.zeros((300, 6))
    gait[:, 1], gait[:, 4] = 1 - t / 300, t / 300
    contacts = np.stack([t % 2 == 0, t % 3 == 0, t % 5 == 0, t % 7 == 0], axis=1)
    return {
        "cycles": np.array([[60, 100], [100, 130], [200, 239]]),
        "phase": (t / 37) % 1,
        "gait": gait,
        "contacts": contacts,
    }


@pytest.fixture
def terrain(labels) -> dict[str, np.ndarray]:
    return flat_terrain(labels["cycles"], np.array([3.0, 4.0, 5.0]))


def build(clip: Clip, labels, terrain=None, severity=None, **changed) -> ClipRows:
    """The rows of a clip, by default on flat ground and without an injury."""
    cycles = labels["cycles"]
    terrain = flat_terrain(cycles, np.zeros(len(cycles))) if terrain is None else terrain
    severity = np.zeros((len(clip), 2)) if severity is None else severity
    return build_clip_rows("walk", clip, labels, {"injury": severity}, terrain, **OPTIONS | changed)


def test_rows_of_a_rigid_turning_figure_are_exact(walk, labels, terrain):
    severity = np.random.default_rng(0).random((300, 2)) * 10
    rows = build(walk, labels, terrain, severity, facing_sigma=0.0)
    layout, frame = rows.layout, rows.frame
    assert layout == RowLayout(5, channels=(("injury", 2),))
    np.testing.assert_array_equal(frame, np.r_[60:101, 100:131, 200:240])
    (pairs,) = pair_batches(rows, rows.layout)
    x, y = ({n: v[:, s] for n, s in layout.blocks(p).items()} for p, v in (("x", pairs.x), ("y", pairs.y)))
    ahead = np.arange(-60, 60, 10)
    turned = 0.01 * frame[:, None]  # facing (sin, 0, cos); the root's x axis is (cos, 0, -sin)
    expected = np.concatenate([2 * ahead * np.cos(turned), 2 * ahead * np.sin(turned)], axis=1)
    np.testing.assert_allclose(x["position"], expected, atol=1e-3)
    direction = np.concatenate([np.sin(0.01 * ahead), np.cos(0.01 * ahead)])
    np.testing.assert_allclose(x["direction"], np.tile(direction, (len(frame), 1)), atol=1e-4)
    local = walk.skeleton.offsets + np.array([0, 90, 0])
    local = np.tile(local, (len(frame), 1, 1))
    local[..., 1] -= np.array([3.0, 4.0, 5.0])[rows.cycle][:, None]
    np.testing.assert_allclose(x["joint_position"], local.reshape(len(frame), -1), atol=1e-3)
    np.testing.assert_allclose(y["joint_position"], x["joint_position"], atol=1e-3)
    np.testing.assert_allclose(y["joint_rotation"], 0, atol=1e-4)
    along = np.stack([2 * np.cos(turned[:, 0]), 2 * np.sin(turned[:, 0])], axis=1)
    np.testing.assert_allclose(y["root_velocity"], along, atol=1e-3)
    np.testing.assert_allclose(y["turn"][:, 0], -0.01, atol=1e-4)  # the runtime applies its negative
    before = np.stack([2 * np.cos(turned[:, 0] - 0.01), 2 * np.sin(turned[:, 0] - 0.01)], axis=1)
    np.testing.assert_allclose(x["joint_velocity"][:, [0, 2]], before, atol=1e-3)
    future = np.arange(0, 60, 10)
    next_turn = turned + 0.01
    expected = np.concatenate([2 * future * np.cos(next_turn), 2 * future * np.sin(next_turn)], axis=1)
    np.testing.assert_allclose(y["position"], expected, atol=1e-3)
    np.testing.assert_allclose(y["contacts"], labels["contacts"][frame])
    np.testing.assert_allclose(x["injury"], 10 * (severity[frame] / 10) ** 0.42, rtol=1e-5)
    np.testing.assert_allclose(x["terrain"], 0, atol=1e-5)
    shares = x["gait"].reshape(len(frame), len(GAITS), 12)
    np.testing.assert_allclose(shares[:, 4], (frame[:, None] + ahead) / 300, atol=1e-6)
    np.testing.assert_allclose(shares[:, 1], 1 - shares[:, 4], atol=1e-6)
    assert not shares[:, [0, 2, 3, 5]].any()
    np.testing.assert_allclose(y["phase_change"][:, 0], 1 / 37, atol=1e-6)


def test_fits_of_a_row_differ_only_in_the_ground(walk, labels, terrain):
    rng = np.random.default_rng(1)
    n = len(terrain["frame"])
    hilly = {**terrain, "fits": np.full(n, 10), "heights": rng.normal(0, 9, (10 * n, 36))}
    rows = build(walk, labels, hilly)
    layout, pairs = rows.layout, pair_batches(rows, rows.layout.with_channels(()))
    x, y = (np.concatenate(parts) for parts in list(zip(*pairs, strict=True))[:2])
    centre = hilly["heights"][:, 12:24].mean(axis=1)
    np.testing.assert_allclose(x[:, layout.x_terrain], hilly["heights"] - centre[:, None], atol=1e-4)
    hips = y[:, layout.y_joint_position.start + 1]
    np.testing.assert_allclose(hips, 90 - centre, atol=1e-3)
    np.testing.assert_allclose(y[::10, -5:], y[5::10, -5:])


def test_a_clip_without_cycles_has_no_rows(walk, labels):
    rows = build(walk, {**labels, "cycles": np.zeros((0, 2), int)})
    rows.check("walk")
    assert len(rows) == 0
    assert list(pair_batches(rows, rows.layout)) == []


def test_what_does_not_belong_together_is_refused(walk, labels, terrain):
    other = {"cycles": np.array([[60, 100], [100, 130], [200, 241]])}
    for changed, severity, message in (
        ({"phase": np.zeros(299)}, None, r"phase has shape \(299,\).* expected \(300\)"),
        (other, None, "other cycles"),
        ({}, np.zeros((300, 3)), r"injury has shape \(300, 3\).* expected \(300, 2\)"),
    ):
        with pytest.raises(InputError, match=f"^walk: .*{message}"):
            build(walk, {**labels, **changed}, terrain, severity)
    for cycle, frame in (([0, 40], 0), ([260, 299], 299)):
        with pytest.raises(InputError, match=f"walk, frame {frame}: the clip has no frame before or after"):
            build(walk, {**labels, "cycles": np.array([cycle])})


def test_beyond_the_clip_the_root_continues_straight_with_the_same_gait(walk, labels):
    """Rows near an end equal those of a longer clip that really continues like this."""
    ends = {**labels, "cycles": np.array([[1, 40], [260, 298]])}
    still = replace(walk, rotations=np.tile(walk.rotations[:1], (300, 1, 1)))
    once = build(still, ends)
    n = np.arange(-70, 370)
    longer = replace(
        still,
        rotations=np.tile(walk.rotations[:1], (440, 1, 1)),
        root=np.stack([2.0 * n, np.full(440, 90.0), np.zeros(440)], axis=1),
    )
    held = {name: values[np.clip(n, 0, 299)] for name, values in labels.items() if len(values) == 300}
    held["cycles"] = ends["cycles"] + 70
    twice = build(longer, held)
    np.testing.assert_allclose(once.x, twice.x, atol=1e-4)
    np.testing.assert_allclose(once.y, twice.y, atol=1e-4)
