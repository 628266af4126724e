"""When each link hurts: every link in some training clip, always at the same times, within the options."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.hurt.effects import part_of_link
from hobble.hurt.options import Hurt
from hobble.hurt.version import ARMS, UNCUT_SECONDS, schedule_severities
from hobble.workflow.project import Project


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
    clips = project.clips
    frames = {clip: project.datasets.frames("synthetic", clip) for clip in clips.listed_entries("synthetic")}
    versions = {
        name: turn
        for name, turn in clips.hurt_versions("synthetic").items()
        if name.rpartition("_hurt")[0] not in held_out
    }
    seconds = seconds_hurt(holden31, versions, frames, lambda clip: clips.hurt_options("synthetic", clip))
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
    parts = [part_of_link(holden31, link).name for link in holden31.links]
    assert sorted(set(parts)) == sorted(
        [
            "pelvis",
            "hip",
            "thigh",
            "shank",
            "foot",
            "back",
            "neck",
            "shoulder",
            "upper arm",
            "forearm",
            "hand",
        ]
    )
