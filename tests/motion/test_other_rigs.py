"""Clips on rigs of other programs give the same result as the original clip, or are refused."""

import re

import pytest

from hobble.core.errors import InputError
from tests.motion import other_rigs as rigs
from tests.motion.other_rigs import PLAIN, both
from tests.motion.scramble import compare, outcome, source_of

SLOW = pytest.mark.slow
RIGS = {
    "KIT, a joint for each axis": (rigs.KIT, {}),
    "game with targets for feet, Z up": (
        "root|-|ground\n" + PLAIN.replace("hips|-|", "hips|root|") + rigs.GAME,
        {"z_up": True},
    ),
    "skirt, hair, wings and tail, without names": (rigs.nameless(PLAIN + rigs.CLOTHES), {"rest": "one axis"}),
}


@pytest.fixture(scope="module")
def clip(shared):
    """Five seconds of a CMU walk on its own rig."""
    return source_of(shared / "mocap/cmu/07_01.bvh", 600)


@pytest.mark.shared
@pytest.mark.parametrize("name", RIGS)
def test_a_clip_on_another_rig_is_retargeted_within_a_centimetre(clip, tmp_path, make, name):
    rig, how = RIGS[name]
    first, second, report, names = both(clip, rig, tmp_path, make, **how)
    off = compare(first, second, names)
    assert off.mean() < 1.0, (name, report["roles"])
    assert off.max() < 1.5, dict(zip(names, off.round(1), strict=True))


def without(*joints: str) -> str:
    return "\n".join(line for line in PLAIN.splitlines() if not line.startswith(joints))


def two_figures() -> str:
    one = PLAIN.replace("hips|-|", "hips|scene|")
    other = re.sub(r"^(\w+)\|(?!scene)", r"other_\1|other_", one, flags=re.M)
    return f"scene|-|ground\n{one}\n{other.replace('hips|scene', 'other_hips|scene', 1)}"


PAIRS = r"in doubt .*two equal legs and two equal arms\. .* cannot be used"


@pytest.mark.shared
@pytest.mark.parametrize(
    ("rig", "why"),
    [
        (without("shoulder", "upper_arm", "forearm", "hand"), PAIRS),
        (without("thigh", "shin", "foot", "toe"), PAIRS),
        (without("neck", "head"), r"in doubt .*no joint for the head"),
        (two_figures(), r"two figures, \w*hips and \w*hips. Export each figure on its own"),
    ],
)
def test_no_body_or_two_are_refused(clip, tmp_path, make, rig, why):
    with pytest.raises(InputError, match=why):
        both(clip, rig, tmp_path, make)


@pytest.mark.shared
@pytest.mark.parametrize(
    "seed", [*range(0, 24, 4), *(pytest.param(k, marks=SLOW) for k in range(24) if k % 4)]
)
def test_a_clip_on_a_scrambled_rig_is_recovered(shared, tmp_path, seed):
    """`python -m tests.motion.scramble` tests more."""
    name = ("02_01", "16_11", "07_04", "105_16", "09_03", "08_03")[seed % 6]
    one = outcome(shared / f"mocap/cmu/{name}.bvh", seed, tmp_path, 420)
    assert one.right, one
