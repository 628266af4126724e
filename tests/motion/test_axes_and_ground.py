"""Which way is up, where the figure faces, how high its floor is, and whether the world is tilted."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.ground import world_tilt
from hobble.motion.skeleton_file import load_skeleton
from tests.motion.other_rigs import PLAIN, rigged

X, _, Z = np.eye(3)
QUARTER = quat.from_axis_angle(X, np.pi / 2)


def turned(clip, world, rest=quat.IDENTITY):
    """The clip in a world that is turned, on a rig whose rest pose is turned."""
    rotations = quat.mul(quat.mul(rest, clip.rotations), quat.inv(rest))
    rotations[:, 0] = quat.mul(quat.mul(world, clip.rotations[:, 0]), quat.inv(rest))
    skeleton = replace(clip.skeleton, offsets=quat.rotate(rest, clip.skeleton.offsets))
    return replace(clip, skeleton=skeleton, rotations=rotations, root=quat.rotate(world, clip.root))


def z_up(clip):
    """The walk as a program with Z up writes it, with the rest pose along Z, too."""
    return turned(clip, QUARTER, QUARTER)


def left_handed(clip):
    flip = np.array([-1.0, 1, 1])
    skeleton = replace(clip.skeleton, offsets=clip.skeleton.offsets * flip)
    return replace(clip, skeleton=skeleton, rotations=clip.rotations * [1, 1, -1, -1], root=clip.root * flip)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (z_up, {"up": "+Z", "handedness": "right"}),
        (left_handed, {"up": "+Y", "handedness": "left"}),
        (lambda clip: turned(clip, quat.IDENTITY, quat.yaw(np.pi / 2)), {"up": "+Y", "handedness": "right"}),
        (lambda clip: left_handed(z_up(clip)), {"up": "+Z", "handedness": "left"}),
    ],
)
def test_other_axes_are_found_reported_and_converted(walk, bvh, make, change, said):
    clip, report = make(bvh(change(walk)))
    assert {key: report[key] for key in said} == said
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)
    assert quat.angle(clip.rotations, walk.rotations[::2]).max() < 1e-5


def crawl(skeleton):
    """A figure that crawls at 36 cm/s, aslant to the axes."""
    time, aslant = np.arange(181) / 60, np.radians(50)
    swing = 0.26 * np.sin(2 * np.pi * time)[:, None]
    rotations = np.tile(quat.IDENTITY, (len(time), len(skeleton.joints), 1))
    rotations[:, 0] = quat.mul(quat.yaw(aslant), quat.from_euler(np.full_like(swing, 1.31), "X"))
    for side, sign in (("left", 1), ("right", -1)):
        rotations[:, skeleton.role(f"{side}_hip")] = quat.from_euler(sign * swing - 1.31, "X")
        rotations[:, skeleton.role(f"{side}_knee")] = quat.from_euler(1.57 - sign * swing, "X")
    way = np.stack([36 * time * np.sin(aslant), 50 + 0 * time, 36 * time * np.cos(aslant)], 1)
    return Clip("crawl", skeleton, 60.0, rotations, way)


def test_a_figure_that_crawls_is_not_stood_on_end(holden31, bvh, make):
    crawling = crawl(holden31)
    for change, up in ((lambda clip: clip, "+Y"), (z_up, "+Z")):
        clip, report = make(bvh(change(crawling)))
        np.testing.assert_allclose(clip.positions, crawling.positions, atol=1e-4)
        (note,) = report["notes"]
        assert f"its rest pose along {up}. {up} was taken for up, because the body crawls" in note
    with pytest.raises(InputError, match=r"the up axis is in doubt.*Set motion.up"):
        make(bvh(rigged(crawling, PLAIN, rest="heap")[0]))


def raised(clip, height):
    return replace(clip, root=clip.root + np.multiply.outer(height, [0.0, 1.0, 0.0]))


def test_the_up_axis_can_be_set(walk, bvh, make):
    clip, _ = make(bvh(walk), up="Z", proportions="clip")
    np.testing.assert_allclose(clip.positions[..., 1], walk.positions[::2, :, 2], atol=1e-4)


@pytest.mark.parametrize(("height", "rig"), [(-93.0, "holden31"), (20.0, "holden31"), (120.0, "rig22")])
def test_a_floor_at_another_height_is_moved_to_0_and_reported(walker, bvh, make, root, height, rig):
    clip = walker(load_skeleton(root / f"config/skeletons/{rig}.yaml").skeleton, 121, 60.0)
    moved, report = make(bvh(raised(clip, height)))
    np.testing.assert_allclose(moved.positions, make(bvh(clip, name="level"))[0].positions, atol=1.5)
    assert [s for s in report["repairs"] if "The floor lies at" in s and s.endswith("so that it lies at 0.")]


def test_uneven_ground_stays_where_it_is_unless_it_is_far_below(walk, bvh, make):
    stairs = raised(walk, np.interp(walk.root[:, 2], [80, 120], [20, 60]))
    clip, report = make(bvh(stairs))
    assert "too uneven for flat ground: set `ground: rocky` for this clip" in report["unsure"][0]
    assert report["repairs"] == []
    np.testing.assert_allclose(clip.root, stairs.root[::2], atol=1e-6)
    clip, report = make(bvh(raised(stairs, -120.0)))
    assert "The floor lies at -10" in report["repairs"][0]
    assert np.percentile(clip.positions[:, clip.skeleton.role("left_toe"), 1], 10) == pytest.approx(2, abs=3)
    beam = bvh(raised(walk, 40.0), name="beam")
    clip, report = make(beam, ground="beam")
    assert report["repairs"] == report["notes"] == []
    np.testing.assert_allclose(clip.root[:, 1], walk.root[::2, 1] + 40, atol=1e-6)


def tilted(clip, axis, degrees):
    return turned(clip, quat.from_axis_angle(np.asarray(axis), np.radians(degrees)))


@pytest.mark.parametrize(("axis", "degrees"), [(X, -12.0), (X, 25.0), (Z, -12.0), ([0.6, 0.0, 0.8], 12.0)])
def test_a_tilted_world_is_refused(bvh, walk, make, axis, degrees):
    assert world_tilt(walk) is None
    assert world_tilt(tilted(walk, axis, degrees))[0] == pytest.approx(abs(degrees), abs=4.0)
    with pytest.raises(InputError, match=r"by \d+ degrees, so the whole world seems tilted"):
        make(bvh(tilted(walk, axis, degrees)))


def sloped(clip, degrees):
    """The clip on ground that goes up: each joint is moved upward by its own way ahead."""
    at = clip.positions + clip.positions[..., 2:] * [0.0, np.tan(np.radians(degrees)), 0.0]
    parents = [max(p, 0) for p in clip.skeleton.parents]
    none = np.broadcast_to(quat.IDENTITY, clip.rotations.shape)
    return replace(clip, rotations=none, root=at[:, 0], translations=at - at[:, parents])


# The made-up walk balances 5 degrees forward of its feet, so on 8 degrees down it would look tilted.
def test_a_slope_or_a_trunk_that_leans_aside_is_no_tilt(walk):
    rotations, spine = walk.rotations.copy(), walk.skeleton.role("spine")
    rotations[:, spine] = quat.mul(quat.from_axis_angle(Z, 0.35), rotations[:, spine])
    for clip in (sloped(walk, -14.0), sloped(walk, 8.0), replace(walk, rotations=rotations)):
        assert world_tilt(clip) is None
