"""A result that differs from its source is refused, and a picture shows both."""

from __future__ import annotations

import re
import shutil
from xml.etree import ElementTree

import pytest

from hobble.cli.__main__ import main
from hobble.core.bvh import write_bvh
from hobble.motion.look import PICTURES, WRONG, retarget_picture
from hobble.motion.skeleton_file import load_skeleton

ROWS = 4


def lines(svg: str) -> list[dict[str, str]]:
    return [dict(one.attrib) for one in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}line")]


@pytest.mark.parametrize(("part", "bones"), [("left knee", 2), ("right forearm", 1), ("left hip", 1)])
def test_the_bones_of_the_wrong_joint_are_red(walk, part, bones):
    """At the hip the angle is between trunk and thigh. The trunk has no single bone from head to hip."""
    drawn = lines(retarget_picture(walk, walk, part, 20.0))
    assert sum(line["stroke"] == WRONG for line in drawn) == bones * PICTURES * ROWS


def test_a_wrong_map_is_refused_with_the_joint_and_a_picture(root, walker, tmp_path, capsys) -> None:
    """Here the left arm follows the right one."""
    maps = tmp_path / "skeletons"
    shutil.copytree(root / "config/skeletons", maps)
    file = maps / "mixamo55.yaml"
    text = file.read_text().replace("    LeftArm: LeftArm\n", "    LeftArm: RightArm\n")
    file.write_text(text.replace("    RightArm: RightArm\n", "    RightArm: LeftArm\n"))
    clip = tmp_path / "clip.bvh"
    write_bvh(clip, walker(load_skeleton(file).skeleton, 120, 60.0), decimals=6)
    given = ["look", str(clip), "--skeletons", str(maps), "--picture", str(tmp_path / "apart.svg")]
    assert main(given) == 1
    said = capsys.readouterr().out
    found = re.search(r"the (left|right) (upper arm|forearm|elbow) is \d+ degrees off its source", said)
    assert found, said
    assert "--picture apart.svg" in said
    assert found[0] in (tmp_path / "apart.svg").read_text()
