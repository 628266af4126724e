"""Speed limits: interpolation, several values at once, and learning from made-up cycles."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.channels.speed_limits import (
    CANNOT_HURRY,
    TOP,
    UNLIMITED,
    USUAL,
    LimitLearner,
    Limits,
    combine_limits,
)
from hobble.core.errors import InputError

WALK, JOG, GAITS = 1, 2, 6
LIMITS = Limits(
    np.array([0.0, 5.0, 10.0]), np.array([[[4.0, 3.0, 1.0], [4.0, 4.0, 2.0]]]), usual=np.array([3.5])
)


def rows(speeds, values, gait: int = WALK, each: int = 40, others: bool = False) -> dict[str, np.ndarray]:
    """Rows of cycles of `each` frames, straight ahead at `speeds` (N,), with `values` (N, L)."""
    speed = np.repeat(np.asarray(speeds, float), each)
    return {
        "gait": np.eye(GAITS)[np.full(len(speed), gait)],
        "velocity": np.stack([np.zeros_like(speed), speed], axis=1),
        "values": np.repeat(np.asarray(values, float), each, axis=0),
        "cycle": np.repeat(np.arange(len(speeds)), each),
        "others": np.full(len(speed), others),
    }


def pace(labels: int = 2, across=None) -> LimitLearner:
    return LimitLearner(10.0, np.arange(labels) if across is None else np.array(across), GAITS)


def test_a_hurt_version_is_compared_with_its_own_healthy_clip() -> None:
    """The source walks slowly. Compared with all healthy clips, the version would seem slower than it is."""
    found = pace()
    speeds = np.linspace(1.0, 3.0, 41)
    found.add("healthy", **rows(speeds, np.zeros((41, 2))))
    found.add("slow", **rows(np.full(400, 1.0), np.zeros((400, 2))))
    severity = np.tile([0.0, 2.5, 5.0, 7.5, 10.0], 80)
    hurt = rows(1.0 - 0.05 * severity, np.stack([severity, np.zeros(400)], axis=1))
    found.add("slow_hurt1", **hurt, source="slow")
    limits = found.learn()
    assert limits is not None
    healthy = np.concatenate(
        [speeds, np.full(400, 1.0), np.full(80, 1.0)]
    )  # 80 of the hurt version do not hurt
    (top, usual), share = np.percentile(healthy, [TOP, USUAL]), 1 - 0.05 * limits.levels
    slowed = usual * share + (top - usual) * np.maximum(share - CANNOT_HURRY, 0.0) / (1 - CANNOT_HURRY)
    np.testing.assert_allclose(limits.speeds[WALK, 0], slowed, atol=0.02)
    np.testing.assert_allclose(limits.speeds[WALK, 1], top)  # never hurt: as fast as the healthy
    # A gait in which nothing healthy goes is not limited; one that was never hurt keeps the same share.
    assert (limits.speeds[JOG] == UNLIMITED).all()


def test_learnt_limits_never_rise_with_severity_and_are_equal_on_both_sides() -> None:
    rng = np.random.default_rng(4)
    found = pace(3, across=[1, 0, 2])
    found.add("healthy", **rows(rng.uniform(1.5, 2.5, 200), np.zeros((200, 3))))
    values = np.zeros((300, 3))
    values[np.arange(300), rng.integers(0, 3, 300)] = rng.uniform(0.1, 10, 300)
    found.add("hurt", **rows(rng.uniform(0.2, 4.0, 300), values))
    limits = found.learn()
    assert limits is not None
    assert (np.diff(limits.speeds, axis=2) <= 0).all()
    assert (limits.speeds[WALK] <= limits.speeds[WALK, 0, 0]).all()
    np.testing.assert_array_equal(limits.speeds[:, 0], limits.speeds[:, 1])
    again = Limits.from_dict("net", "injury", limits.to_dict(), GAITS, 3, 10.0)
    np.testing.assert_allclose(again.speeds, limits.speeds, atol=1e-4)


def test_the_shares_of_speed_that_two_channels_allow_are_multiplied() -> None:
    free, half, third, fast = (np.full((1, 2), v) for v in (np.inf, 1.0, 2 / 3, 2.6))
    usual = np.array([2.0, 0.0])  # no body without values goes in the second gait
    for one in (free, half, fast):
        np.testing.assert_array_equal(combine_limits([one], usual), one)
        np.testing.assert_array_equal(combine_limits([one, free], usual), one)
    np.testing.assert_allclose(combine_limits([half, third], usual), [[1 / 3, 2 / 3]])
    np.testing.assert_allclose(combine_limits([third, fast, half], usual), [[1 / 3, 2 / 3]])
    np.testing.assert_allclose(combine_limits([fast, fast + 1], usual), [[2.6, 2.6]])


def test_the_slowness_of_one_channel_is_not_learnt_for_another() -> None:
    """A neutral clip moves at 2, a sad one at 1, and their hurt versions at .6 of that."""
    mood, injury = pace(), pace()
    none, sad = np.zeros((60, 2)), np.tile([10.0, 0.0], (60, 1))
    for name, speed, feels in (("plain", 2.0, none), ("sad", 1.0, sad)):
        mood.add(name, **rows(np.full(60, speed), feels))
        injury.add(name, **rows(np.full(60, speed), none, others=bool(feels.any())))
        mood.add(f"{name}_hurt1", **rows(np.full(60, 0.6 * speed), feels, others=True), source=name)
        slow = rows(np.full(60, 0.6 * speed), sad, others=bool(feels.any()))
        injury.add(f"{name}_hurt1", **slow, source=name)
    mood.add("limps sadly", **rows(np.full(60, 0.2), sad, others=True))
    found = [one.learn() for one in (mood, injury)]
    for limits, expected in zip(found, (1.0, 1.2), strict=True):
        assert limits is not None
        assert limits.usual[WALK] == 2.0
        assert limits.speeds[WALK, 0, -1] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"levels": np.array([0.0, 5.0, 9.0])}, "rise from 0 to 10"),
        ({"levels": np.array([0.0, 5.0])}, r"speeds has shape \(1, 2, 3\)"),
        ({"speeds": -LIMITS.speeds}, "below the limit"),
        ({"speeds": LIMITS.speeds * np.nan}, "not finite"),
        ({"speeds": LIMITS.speeds[..., ::-1]}, "stay the same or fall"),
        ({"usual": np.array([3.5, 3.5])}, "usual has shape"),
    ],
)
def test_a_malformed_table_of_limits_is_refused(changes, says: str) -> None:
    data = {key: value.tolist() for key, value in vars(replace(LIMITS, **changes)).items()}
    with pytest.raises(InputError, match=says):
        Limits.from_dict("net", "injury", data, 1, 2, 10.0)
    with pytest.raises(InputError, match="tables of numbers"):
        Limits.from_dict("net", "injury", {"levels": "all"}, 1, 2, 10.0)
