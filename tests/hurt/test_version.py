"""Hurt versions: which links hurt when, severities that match the motion, and cycles that are left out."""

import numpy as np
import pytest

from hobble.channels.channel import ClipSource
from hobble.channels.guarding import CHANNEL
from hobble.hurt import Hurt, version
from hobble.hurt.effects import part_of_link
from hobble.hurt.hurt_clip import hurt_clip
from hobble.hurt.version import ARMS, SEVERITY_TOLERANCE, UNCUT_SECONDS, hurt_version, schedule_severities
from hobble.labels.clip_labels import LabelReport
from hobble.labels.label import mirror_labels
from hobble.motion.edit import mirror_clip
from hobble.workflow.project import Project

REPORT = LabelReport("straight", "automatic", "automatic", "right", "extend", 0)
NAMED = {"name": "a", "version_number": 0, "ground": "flat"}


def test_hurt_versions_of_the_synthetic_clips_hurt_all_thirty_links(root, holden31) -> None:
    project, seconds = Project(root, {}), np.zeros(30)
    clips, held_out = project.dataset("synthetic"), project.catalogue.dataset("synthetic").held_out
    for name, number in clips.hurt_versions.items():
        if (clip := name.rpartition("_hurt")[0]) not in held_out:
            frames, options = clips.frames(clip), clips.hurt_options(clip)
            severity = schedule_severities(holden31, frames, 60.0, options, name, number)
            used = round(options.longest * frames) if frames >= UNCUT_SECONDS * 60 else frames
            seconds += (severity[:used] > 0).sum(axis=0) / 60
    seconds = seconds + seconds[list(holden31.mirror_links)]  # the data set has mirrors
    assert seconds.min() > 2
    parts = [part_of_link(holden31, link).name for link in holden31.links]
    assert min(s for s, part in zip(seconds, parts, strict=True) if part in ("thigh", "shank")) > 14


def test_the_versions_of_a_clip_use_each_card_once(holden31) -> None:
    cards = [version.CARDS_OF_PART.get(part_of_link(holden31, link).name, 1) for link in holden31.links]
    options = Hurt(at_once=1, severities=(10.0,))
    made = [schedule_severities(holden31, 1080, 60.0, options, "a", i) for i in range(sum(cards))]
    assert (np.sum(made, axis=(0, 1)) / 10_800).tolist() == cards


def test_a_version_has_the_options_links_and_never_too_many_at_once(holden31) -> None:
    arms = [part_of_link(holden31, link).name in ARMS for link in holden31.links]
    # Every 180th frame: each half of each stretch.
    out = schedule_severities(holden31, 360 * 400, 60.0, Hurt(), "a", 0)[::180] > 0
    assert 0.3 < (out[:, arms].any(axis=1) & (out.sum(axis=1) == 2)).mean() < 0.7
    assert out.sum(axis=1).max() == 2
    links = ("LeftUpLeg-LeftLeg", "Neck-Neck1")
    out = schedule_severities(holden31, 6000, 60.0, Hurt(links=links, severities=(4.0,), at_once=1), "a", 0)
    assert {holden31.link_names[i] for i in np.flatnonzero(out.any(axis=0))} == set(links)
    assert set(np.unique(out)) == {0.0, 4.0}


@pytest.mark.parametrize("mirrored", [False, True])
def test_without_in_between_no_cycle_has_a_severity_in_between(made, mirrored) -> None:
    clip, labels, _ = made("straight")
    shares = []
    for in_between in (False, True):
        options = Hurt(severities=(10.0,), seconds=5, at_once=1, in_between=in_between, longest=1)
        hurt, report, _ = hurt_version(clip, labels, REPORT, options, **NAMED)
        own = hurt.labels
        if mirrored:
            own, _ = mirror_labels(own, report, mirror_clip(hurt.clip, "image"))
        inside = np.concatenate([np.arange(a, b + 1) for a, b in own.cycles])
        assert len(inside) > 200
        shown = hurt.severity[inside]
        shares.append((np.minimum(shown, np.abs(shown - 10)) > SEVERITY_TOLERANCE).any(axis=1).mean())
    assert shares[0] == 0
    assert shares[1] > 0.01


def test_the_shown_severity_follows_the_requested_one(made, hurting, holden31) -> None:
    """The thigh hurts at 10 from 5 s on and at 3 from 12 s on."""
    clip, labels, flat = made("straight")
    wanted = hurting(len(clip), {"RightUpLeg-RightLeg": 10.0})
    wanted[:300] = 0.0
    wanted[720:] *= 0.3
    hurt = hurt_clip(clip, labels, wanted, flat=flat)
    when = np.clip(hurt.source_frames.astype(int), 0, len(wanted) - 1)
    near = [wanted[np.clip(when + d, 0, len(wanted) - 1)] for d in (-80, 0, 80)]
    calm = np.ptp(near, axis=0).max(axis=1) == 0
    assert calm.mean() > 0.6
    np.testing.assert_allclose(hurt.severity[calm], wanted[when][calm], atol=0.01)


def test_guarding_changes_in_a_version_and_the_channel_reads_its_course(made) -> None:
    """In one half of a stretch the body guards as much as it does not in the other half."""
    clip, labels, _ = made("straight")
    hurt, _, course = hurt_version(clip, labels, REPORT, Hurt(seconds=5), **NAMED)
    frames, values = np.array(course)
    assert (np.diff(frames) > 0).all()
    assert values[0] == values[1] != values[2]
    assert values[0] + values[2] == pytest.approx(1, abs=0.001)
    read, warnings = CHANNEL.read(hurt.clip, ClipSource("a"), {"guarding": course})
    assert not warnings
    assert read[[0, int(frames[1]), int(frames[2]), -1], 0] == pytest.approx(values[[0, 1, 2, -1]])
