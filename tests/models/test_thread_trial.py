"""One thread is chosen if it is clearly faster, never because other work took a processor."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from hobble.models import product_trial, thread_trial
from hobble.models.thread_trial import faster_thread_count, threads_for


class Machine:
    """A machine with two clocks. seconds: of a call. shares: busy processors meanwhile. Both by threads."""

    def __init__(self, seconds: dict[int, float], shares: dict[int, float]) -> None:
        self.seconds, self.shares = seconds, shares
        self.now = self.busy = 0.0
        self.threads, self.calls = 0, 0

    def use(self, threads: int) -> None:
        self.threads = threads

    def call(self) -> None:
        self.calls += 1
        self.now += self.seconds[self.threads]
        self.busy += self.seconds[self.threads] * self.shares[self.threads]

    def chosen(self) -> str:
        return faster_thread_count(self.call, 2, self.use, lambda: self.now, lambda: self.busy)


@pytest.mark.parametrize(
    ("seconds", "shares", "expected"),
    [
        ({1: 2e-3, 2: 1.1e-3}, {1: 1.0, 2: 2.0}, "2"),  # two cores
        ({1: 2e-3, 2: 2.2e-3}, {1: 1.0, 2: 2.0}, "1"),  # two processors that are one core
        ({1: 2e-3, 2: 2.02e-3}, {1: 1.0, 2: 2.0}, "2"),  # too near to tell
        ({1: 2e-3, 2: 2.2e-3}, {1: 1.0, 2: 1.4}, "2"),  # other work on one of two cores
        ({1: 4e-3, 2: 9e-3}, {1: 0.5, 2: 1.0}, "2"),  # other work on both
    ],
)
def test_one_thread_has_to_be_faster_on_a_machine_without_other_work(
    seconds: dict[int, float], shares: dict[int, float], expected: str
) -> None:
    machine = Machine(seconds, shares)
    assert machine.chosen() == expected
    assert machine.now < 0.5


def test_a_choice_is_kept_and_fits_the_size_of_the_batch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    asked = []

    def slower_with_two(call, most, use):  # type: ignore[no-untyped-def]
        asked.append(most)
        return "1"

    monkeypatch.setattr(thread_trial, "faster_thread_count", slower_with_two)
    before = torch.get_num_threads()
    assert [threads_for(batch, 2) for batch in (32, 30, 17)] == [1, 1, 1]
    assert asked == [2]
    assert threads_for(256, 2) == threads_for(32, 4) == 1
    assert asked == [2, 2, 4]
    assert len(json.loads(product_trial.choices_file().read_text())["ways"]) == 3
    assert threads_for(32, 1) == 1
    assert asked == [2, 2, 4]
    assert torch.get_num_threads() == before
