"""Hurt versions: which links hurt when, severities that match the motion, and cycles that are left out."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.hurt.effects import part_of_link
from hobble.hurt.hurt_clip import hurt_clip
from hobble.hurt.options import Hurt
from hobble.hurt.version import ARMS, SEVERITY_TOLERANCE, UNCUT_SECONDS, hurt_version, schedule_severities
from hobble.labels.clip_labels import LabelReport
from hobble.labels.label import mirror_labels
from hobble.motion.edit import mirror_clip
from hobble.workflow.project import Project

REPORT = LabelReport("straight", "automatic", "automatic", "right", "extend", 0)
THIGH = "RightUpLeg-RightLeg"


@pytest.fixture(scope="module")
def changing(made, hurting):
    """A walk of 20 s whose thigh hurts at 10 from 5 s on and at 3 from 12 s on: the request, the result."""
    clip, labels, flat = made("straight")
    wanted = hurting(len(clip), {THIGH: 10.0})
    wanted[:300] = 0.0
    wanted[720:] *= 0.3
    return wanted, hurt_clip(clip, labels, wanted, flat=flat)


def test_severities_far_from_a_change_are_the_requested_ones(changing, holden31) -> None:
    wanted, hurt = changing
    column = holden31.link_names.index(THIGH)
    when = np.clip(hurt.source_frames.astype(int), 0, len(wanted) - 1)
    calm = np.ptp([wanted[np.clip(when + d, 0, len(wanted) - 1), column] for d in (-80, 0, 80)], axis=0) == 0
    assert calm.mean() > 0.6
    np.testing.assert_allclose(hurt.severity[calm], wanted[when][calm], atol=0.01)
    assert not np.delete(hurt.severity, column, axis=1).any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_without_in_between_no_cycle_has_a_severity_in_between(made, mirrored) -> None:
    clip, labels, _ = made("straight")
    options = Hurt(severities=(10.0,), seconds=5, at_once=1, in_between=False, longest=1)
    hurt, report = hurt_version(
        clip, labels, REPORT, options, name="a_hurt1", version_number=0, ground="flat"
    )
    severity, own = hurt.severity, hurt.labels
    if mirrored:
        own, _ = mirror_labels(own, report, mirror_clip(hurt.clip, "image"))
    inside = np.concatenate([np.arange(a, b + 1) for a, b in own.cycles])
    assert len(inside) > 200
    shown = severity[inside]
    assert (np.minimum(shown, np.abs(shown - 10)) <= SEVERITY_TOLERANCE).all()
    assert (shown > 9).any(axis=1).mean() > 0.9
    kept, _ = hurt_version(
        clip, labels, REPORT, options.model_copy(update={"in_between": True}), name="a_hurt1",
        version_number=0, ground="flat",
    )  # fmt: skip
    everything = np.concatenate([np.arange(a, b + 1) for a, b in kept.labels.cycles])
    assert (np.abs(kept.severity[everything] - 5) < 3).any()


def seconds_hurt(skeleton, versions, frames, options):
    """(30,) seconds for which each link hurts in versions (name -> turn) of clips of so many frames."""
    out = np.zeros(len(skeleton.links))
    for name, turn in versions.items():
        clip = name.rpartition("_hurt")[0]
        severity = schedule_severities(skeleton, frames[clip], 60.0, options(clip), name, turn)
        if len(severity) >= UNCUT_SECONDS * 60:
            severity = severity[: round(options(clip).longest * len(severity))]
        out += (severity > 0).sum(axis=0) / 60
    return out


def test_hurt_versions_of_the_synthetic_clips_hurt_all_thirty_links(root, holden31) -> None:
    project = Project(root, {})
    held_out = project.catalogue.dataset("synthetic").held_out
    clips = project.dataset("synthetic")
    frames = {clip: clips.frames(clip) for clip in clips.listed}
    versions = {
        name: turn
        for name, turn in clips.hurt_versions.items()
        if name.rpartition("_hurt")[0] not in held_out
    }
    seconds = seconds_hurt(holden31, versions, frames, clips.hurt_options)
    seconds = seconds + seconds[list(holden31.mirror_links)]  # the data set has mirrors
    assert seconds.min() > 2
    legs = [
        i for i, link in enumerate(holden31.links) if part_of_link(holden31, link).name in ("thigh", "shank")
    ]
    assert seconds[legs].min() > 14


def test_an_injury_has_the_highest_severity_for_half_of_its_time(holden31) -> None:
    options = Hurt(links=("LeftUpLeg-LeftLeg",), at_once=1)
    out = schedule_severities(holden31, 360 * 40, 60.0, options, "a", 0)
    column = out[:, holden31.link_names.index("LeftUpLeg-LeftLeg")].reshape(40, 2, 180)
    assert np.ptp(column, axis=2).max() == 0  # two halves of three seconds
    halves = column[:, :, 0]
    assert (halves.max(axis=1) == 10).all()
    assert set(halves.min(axis=1)) == {3.0, 5.0, 7.0}
    assert {tuple(pair) for pair in halves == 10} == {(True, False), (False, True)}


def test_a_short_version_has_one_severity_and_half_of_them_have_the_highest(holden31) -> None:
    out = [schedule_severities(holden31, 200, 60.0, Hurt(), f"c{n}", n) for n in range(400)]
    assert all(np.ptp(severity, axis=0).max() == 0 for severity in out)
    highest = np.mean([severity.max() == 10 for severity in out])
    assert 0.4 < highest < 0.85  # above one half, because a second link may have the highest
    assert {float(severity.max()) for severity in out} == {3.0, 5.0, 7.0, 10.0}
    assert np.ptp(schedule_severities(holden31, 260, 60.0, Hurt(), "c", 0), axis=0).max() > 0


def test_arms_are_often_hurt_beside_another_part_but_never_too_many_at_once(holden31) -> None:
    arms = [part_of_link(holden31, link).name in ARMS for link in holden31.links]
    # Every 180th frame: each half of each stretch.
    out = schedule_severities(holden31, 360 * 400, 60.0, Hurt(), "a", 0)[::180] > 0
    assert 0.3 < (out[:, arms].any(axis=1) & (out.sum(axis=1) == 2)).mean() < 0.7
    assert out.sum(axis=1).max() == 2
    alone = schedule_severities(holden31, 360 * 400, 60.0, Hurt(at_once=1), "a", 0)[::180] > 0
    assert alone.sum(axis=1).max() == 1
    legs = schedule_severities(holden31, 360 * 400, 60.0, Hurt(links=("LeftUpLeg-LeftLeg",)), "a", 0)
    assert not legs[:, arms].any()


def test_only_the_configured_links_are_hurt(holden31) -> None:
    links = ("LeftUpLeg-LeftLeg", "Neck-Neck1")
    out = schedule_severities(holden31, 6000, 60.0, Hurt(links=links, severities=(4.0,), at_once=1), "a", 0)
    hurt = {holden31.link_names[i] for i in np.flatnonzero(out.any(axis=0))}
    assert hurt == set(links)
    assert set(np.unique(out)) == {0.0, 4.0}
    with pytest.raises(HobbleError, match="holden31 has no link LeftKnee-LeftShin"):
        schedule_severities(holden31, 600, 60.0, Hurt(links=("LeftKnee-LeftShin",)), "a", 0)


def test_every_link_belongs_to_a_part_and_its_mirror_image_to_the_same(holden31) -> None:
    for link, other in zip(holden31.links, holden31.mirror_links, strict=True):
        one, two = part_of_link(holden31, link), part_of_link(holden31, holden31.links[other])
        assert one.name == two.name
        assert (one.side is None) == (two.side is None)
        assert one.side is None or one.side != two.side
