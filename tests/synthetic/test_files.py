"""The text files beside the BVH files match the motion, in the form of a user's files."""

import itertools

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.synthetic.generate_clip import Synthetic, write_clip


@pytest.mark.parametrize("recipe", ["walk-straight", "walk", "jog", "walk-jog-walk", "uneven", "crouch"])
def test_footsteps_are_landings_of_the_right_and_the_left_foot_in_turn(written, recipe):
    clip = written("any", recipe=recipe)
    order = clip.footsteps.ravel()
    assert (np.diff(order) > 10).all()
    for side in ("Right", "Left"):
        down = clip.down(side)
        for frame in clip.landings(side):  # in one of the next frames the foot may roll from heel to toe
            if 3 < frame < len(down) - 4:
                assert down[frame + 1 : frame + 4].sum() >= 2, f"{side} is not down after frame {frame}"
                assert not down[frame - 3 : frame - 1].any(), f"{side} is down before frame {frame}"


def test_equal_arguments_give_equal_bytes_and_others_another_walk(written, tmp_path, holden31):
    def write(name, seed):
        paths = {key: tmp_path / f"{name}{seed}{key}" for key in ("bvh", "footsteps", "gait")}
        write_clip(name, holden31.to_dict(), 240, "uneven", Synthetic(fps=120, seed=seed), **paths)
        return [path.read_bytes() for path in paths.values()]

    once = write("a", 1)
    assert write("a", 1) == once
    assert write("a", 2)[0] != once[0]
    assert write("b", 1)[0] != once[0]


def test_gait_keys_name_the_gait_and_fade_between_two(written):
    clip = written("any", recipe="walk-jog-walk")
    keys = [line.split() for line in clip.text("_gait.txt").splitlines()]
    frames = [int(frame) for frame, _ in keys]
    assert frames[0] == 1
    assert frames == sorted(set(frames))
    assert frames[-1] <= 2 * len(clip.positions)
    assert {label for _, label in keys} == {"walk", "jog"}
    hips = clip.joint("Hips")[:, [0, 2]]
    speed = np.linalg.norm(np.diff(hips, axis=0), axis=1) * 60
    for (a, label), (b, following) in itertools.pairwise(keys):
        if label == following:
            inner = speed[int(a) // 2 : int(b) // 2]
            assert (inner.mean() > 200) == (label == "jog")


def test_a_clip_too_short_for_a_step_is_refused_with_the_minimum(holden31, tmp_path):
    paths = {key: tmp_path / key for key in ("bvh", "footsteps", "gait")}
    options = Synthetic(frames=600, fps=120, seed=1)
    said = r"clip a: 16 frames at 60 Hz are too short for a step. Set synthetic.frames to 2250 or more"
    with pytest.raises(HobbleError, match=said):
        write_clip("a", holden31.to_dict(), 16, "walk", options, **paths)
    assert not list(tmp_path.iterdir())
