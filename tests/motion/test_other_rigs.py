"""Clips on rigs of other programs, studios and languages give the same result as the original clip, or are
refused.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.errors import InputError
from hobble.motion.make import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import load_skeleton
from tests.motion.other_rigs import (
    CLOTHES,
    GAME,
    HIND,
    KIT,
    MECHANISM,
    PLAIN,
    ROLLS,
    TRUNK,
    crawling,
    dog,
    human,
    nameless,
    rezeroed,
    rigged,
)
from tests.motion.scramble import compare

PELVIS = PLAIN.replace("thigh_l|hips", "thigh_l|pelvis").replace("thigh_r|hips", "thigh_r|pelvis")
RIGS = {
    "Xsens, right first": (
        human(
            "{S}{n}",
            "Pelvis=Hips L5=LowerBack L3=Spine T12=Spine+0,4,0 T8=Spine1 Neck=Neck1 Head=Head",
            "UpperLeg LowerLeg Foot Toe",
            "Shoulder UpperArm ForeArm Hand",
            "RL",
        ),
        {},
    ),
    "LaFAN, bones along one axis": (
        human(
            "{S}{n}",
            "Hips=Hips Spine=LowerBack Spine1=Spine Spine2=Spine1 Neck=Neck1 Head=Head",
            "UpLeg Leg Foot Toe",
            "Shoulder Arm ForeArm Hand",
        ),
        {"rest": "one axis"},
    ),
    "Japanese": (
        human(
            "{J}{n}",
            TRUNK.format("センター", "上半身", "上半身2", "首", "頭"),
            "足 ひざ 足首 つま先",
            "肩 腕 ひじ 手首",
        ),
        {},
    ),
    "Spanish, bones along one axis": (
        human(
            "{n}_{l}",
            TRUNK.format("Cadera", "Columna", "Pecho", "Cuello", "Cabeza"),
            "Muslo Pierna Pie Dedos",
            "Hombro Brazo Antebrazo Mano",
        ),
        {"rest": "one axis"},
    ),
    "rolls in every limb": (ROLLS, {}),
    "KIT, a joint for each axis": (KIT, {}),
    "KIT, bones along one axis": (KIT, {"rest": "one axis"}),
    "roots and metres": (
        "Armature|-|ground\nReference|Armature|ground\n" + PLAIN.replace("hips|-|", "hips|Reference|"),
        {"unit": "m"},
    ),
    "game with targets for feet, Z up": (
        "root|-|ground\n" + PLAIN.replace("hips|-|", "hips|root|") + GAME,
        {"z_up": True},
    ),
    "pelvis beside the spine": (PELVIS.replace("thigh_l|", "pelvis|hips|Hips\nthigh_l|", 1), {}),
    "skirt, hair, wings and tail": (PLAIN + CLOTHES, {}),
    "legs of a mechanism, and heels": (PLAIN + MECHANISM, {}),
    "hind limbs and wide wings": (PLAIN + HIND, {}),
    "skirt, hair, wings and tail, without names": (nameless(PLAIN + CLOTHES), {"rest": "one axis"}),
}  # fmt: skip


@pytest.fixture(scope="module")
def clip(root, shared):
    """Five seconds of a CMU walk on its own rig."""
    maps = root / "config/skeletons"
    path = shared / "mocap/cmu/07_01.bvh"
    whole = load_source(read_bvh(path), load_skeleton(maps / "holden31.yaml"), maps, ClipMotion()).clip
    return replace(whole, rotations=whole.rotations[:600], root=whole.root[:600])


@pytest.fixture
def outcome(clip, tmp_path, make):
    """The results for a clip on another rig and for the original clip: both clips, and the joints' names."""

    def run(rig, source=None, **how):
        rewritten, names = rigged(source or clip, rig, **how)
        write_bvh(tmp_path / "plain.bvh", source or clip, decimals=6)
        write_bvh(tmp_path / "other.bvh", rewritten, "YZX", decimals=8)
        return make(tmp_path / "plain.bvh")[0], make(tmp_path / "other.bvh"), names

    return run


@pytest.mark.shared
@pytest.mark.parametrize("name", RIGS)
def test_a_clip_on_another_rig_is_retargeted_within_a_centimetre(outcome, name):
    rig, how = RIGS[name]
    first, (second, report), names = outcome(rig, **how)
    off = compare(first, second, names)
    assert off.mean() < 1.0, (name, report["roles"])
    assert off.max() < 1.5, dict(zip(names, off.round(1), strict=True))


@pytest.mark.shared
@pytest.mark.parametrize("rest", ["own", "one axis"])
def test_arms_that_hang_from_the_neck_as_in_3ds_max_belong_to_the_chest(outcome, rest):
    rig = PLAIN.replace("shoulder_l|chest", "shoulder_l|neck").replace("shoulder_r|chest", "shoulder_r|neck")
    first, (second, report), names = outcome(rig, rest=rest)
    assert (report["roles"]["chest"], report["roles"]["neck"]) == ("chest", "neck")
    assert not any("neck" in note for note in report["unsure"])
    assert compare(first, second, names).max() < 1.5


@pytest.mark.shared
@pytest.mark.parametrize(
    ("without", "why"),
    [
        (("shoulder", "upper_arm", "forearm", "hand"), "two equal legs and two equal arms"),
        (("thigh", "shin", "foot", "toe"), "two equal legs and two equal arms"),
        (("upper_arm_r", "forearm_r", "hand_r"), "two equal legs and two equal arms"),
        (("neck", "head"), "no joint for the head"),
    ],
)
def test_a_body_without_limbs_or_head_is_refused_with_a_draft(outcome, without, why):
    rig = "\n".join(line for line in PLAIN.splitlines() if not line.startswith(without))
    with pytest.raises(InputError, match=rf"in doubt: .*{why}[\s\S]*roles:"):
        outcome(rig)


@pytest.mark.shared
def test_two_figures_under_one_root_are_refused(outcome):
    one = PLAIN.replace("hips|-|", "hips|scene|")
    other = "\n".join(
        "|".join((f"other_{name}", parent if parent == "scene" else f"other_{parent}", joint))
        for name, parent, joint in (line.split("|") for line in one.splitlines())
    )
    with pytest.raises(InputError, match=r"two figures, \w*hips and \w*hips. Export each figure on its own"):
        outcome(f"scene|-|ground\n{one}\n{other}")


@pytest.mark.shared
def test_a_crawling_figure_is_right_or_refused_with_a_question(outcome, clip):
    crawl = crawling(clip)
    first, (second, _), names = outcome(PLAIN, crawl)
    assert compare(first, second, names).mean() < 1.0
    with pytest.raises(InputError, match=r"the up axis is in doubt.*Set motion.up"):
        outcome(PLAIN, crawl, rest="heap")


def test_a_figure_on_four_legs_is_refused(tmp_path, make):
    write_bvh(tmp_path / "dog.bvh", dog())
    with pytest.raises(InputError, match=r"dog.bvh: the figure goes on four legs"):
        make(tmp_path / "dog.bvh")


@pytest.mark.shared
@pytest.mark.parametrize(("down", "note"), [(0, None), (-20, "18 degrees flatter.*3.7 cm"), (-70, "nobody")])
def test_a_zero_pose_on_tiptoe_gets_a_note(clip, tmp_path, make, down, note):
    turn = quat.from_axis_angle(np.array([1.0, 0, 0]), np.radians(down))
    write_bvh(tmp_path / "a.bvh", rezeroed(rigged(clip, PLAIN)[0], ("foot", "toe"), turn), decimals=8)
    unsure = " ".join(make(tmp_path / "a.bvh")[1]["unsure"])
    assert re.search(note, unsure) if note else not unsure
