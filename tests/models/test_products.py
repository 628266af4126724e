"""Products in every way are the product, and a way that was chosen once is taken ever after."""

from __future__ import annotations

import json
import multiprocessing
from pathlib import Path

import pytest
import torch

from hobble.models import product_trial, products
from hobble.models.product_trial import choices_file, choose_once, fastest_way


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache folder, and no choice in memory."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    products._chosen_way.cache_clear()
    product_trial._warn_once.cache_clear()
    return tmp_path


def factors(dtype: torch.dtype, rows: int = 33) -> list[tuple[torch.Tensor, torch.Tensor]]:
    """As in a step: for outputs, for the gradient of weights, for the gradient of inputs."""
    generator = torch.Generator().manual_seed(1)
    e, w, d = (
        torch.randn(size, generator=generator).to(dtype) for size in ((rows, 700), (310, 700), (rows, 310))
    )
    return [(e, w), (d.T, e.T), (d, w.T)]


@pytest.mark.parametrize(
    ("way", "dtype"), [(way, dtype) for dtype in products.TYPES for way in products.working_ways(dtype)]
)
def test_every_way_of_multiplying_gives_the_product(
    way: str, dtype: torch.dtype, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(products, "_chosen_way", lambda *_: way)
    for a, b in factors(dtype):
        exact = a.double() @ b.double().T
        scale = float(exact.abs().max())
        out = torch.full(exact.shape, torch.nan, dtype=dtype)
        for found in (products.product(a, b), products.product(a, b, out)):
            assert found.dtype == dtype
            assert float((found.double() - exact).abs().max()) < scale * (1e-5 if a.itemsize == 4 else 0.01)


@pytest.mark.parametrize("dtype", products.TYPES)
def test_a_way_that_this_cpu_does_not_have_is_never_tried(
    dtype: torch.dtype, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The other ways have their trial, and its result is stored."""

    def refuses(a: torch.Tensor, b: torch.Tensor, out: torch.Tensor) -> torch.Tensor:
        raise RuntimeError("could not create a primitive descriptor")

    monkeypatch.setitem(products.WAYS, "linear", refuses)
    products.working_ways.cache_clear()
    try:
        for a, b in factors(dtype):
            products.product(a, b)
        ways = json.loads(choices_file().read_text())["ways"]
        assert len(ways) == 3
        assert set(ways.values()) <= {"plain", "turned"}
        assert not caplog.records
    finally:
        products.working_ways.cache_clear()


def test_the_choice_in_the_file_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []
    for name, way in products.WAYS.items():
        monkeypatch.setitem(
            products.WAYS, name, lambda a, b, out, n=name, way=way: (taken.append(n), way(a, b, out))[1]
        )
    cases = factors(torch.float32)
    for a, b in cases:
        products.product(a, b)
    file = choices_file()
    content = json.loads(file.read_text())
    assert len(content["ways"]) == len(cases)
    for way in products.WAYS:
        file.write_text(json.dumps({**content, "ways": dict.fromkeys(content["ways"], way)}))
        products._chosen_way.cache_clear()
        taken.clear()
        for a, b in cases:
            products.product(a, b)
        assert taken == [way] * len(cases)


def test_batches_of_nearly_the_same_size_share_a_choice() -> None:
    for rows in (33, 50, 64):
        for a, b in factors(torch.float32, rows):
            products.product(a, b)
    assert len(json.loads(choices_file().read_text())["ways"]) == 3
    products.product(*factors(torch.float32, 65)[0])
    assert len(json.loads(choices_file().read_text())["ways"]) == 4


def test_a_trial_uses_no_random_numbers_of_the_training() -> None:
    cases = factors(torch.float32)
    torch.manual_seed(3)
    expected = torch.rand(4)
    torch.manual_seed(3)
    for a, b in cases:
        products.product(a, b)
    assert torch.equal(torch.rand(4), expected)


def test_a_choice_is_never_made_twice() -> None:
    ways = ("plain", "turned")
    assert choose_once("a", lambda: "turned", ways, "plain") == "turned"
    assert choose_once("a", lambda: "plain", ways, "plain") == "turned"
    assert choose_once("b", lambda: "plain", ways, "plain") == "plain"
    assert choose_once("a", lambda: "plain", ways, "plain") == "turned"


@pytest.mark.parametrize(
    "content", ["", "{", "[]", '{"ways": 3}', '{"ways": {"a": "gone"}}', '{"ways": {"a": []}}']
)
def test_a_damaged_file_is_made_again(content: str) -> None:
    file = choices_file()
    file.parent.mkdir()
    file.write_text(content)
    assert choose_once("a", lambda: "turned", ("plain", "turned"), "plain") == "turned"
    assert choose_once("a", lambda: "plain", ("plain", "turned"), "plain") == "turned"


def test_without_a_cache_folder_a_fixed_way_is_used_without_trial(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (cache_folder / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache_folder / "file"))
    for _ in range(2):
        assert choose_once("a", lambda: pytest.fail("tried"), ("plain", "turned"), "plain") == "plain"
    assert len(caplog.records) == 1


def test_each_machine_setting_has_its_own_file_of_choices(monkeypatch: pytest.MonkeyPatch) -> None:
    assert choose_once("a", lambda: "turned", ("plain", "turned"), "plain") == "turned"
    monkeypatch.setenv("ONEDNN_MAX_CPU_ISA", "SSE41")
    assert choose_once("a", lambda: "plain", ("plain", "turned"), "plain") == "plain"


def ask(way: str, start: multiprocessing.Barrier, answers: multiprocessing.Queue) -> None:  # type: ignore[name-defined]
    start.wait()
    answers.put(choose_once("a", lambda: way, ("0", "1", "2", "3"), "none"))


def test_processes_that_start_together_make_the_same_choice() -> None:
    context = multiprocessing.get_context("spawn")
    start, answers = context.Barrier(4), context.Queue()
    processes = [context.Process(target=ask, args=(str(n), start, answers)) for n in range(4)]
    for process in processes:
        process.start()
    found = {answers.get(timeout=120) for _ in processes}
    for process in processes:
        process.join()
    assert len(found) == 1
    assert found < {"0", "1", "2", "3"}


def test_the_fastest_is_the_one_with_the_shortest_call() -> None:
    now = [0.0]
    cost = {"slow": [2.0], "noisy": [9.0, 9.0, 1.0, 9.0], "steady": [1.5], "late": [3.0, 0.1]}
    calls = dict.fromkeys(cost, 0)

    def call(name: str) -> None:
        now[0] += cost[name][min(calls[name], len(cost[name]) - 1)]
        calls[name] += 1

    def found(*names: str) -> str:
        calls.update(dict.fromkeys(cost, 0))
        return fastest_way({name: lambda name=name: call(name) for name in names}, lambda: now[0])

    assert found("slow", "steady") == "steady"
    assert found("slow", "late") == "late"
    assert found("steady", "slow") == "steady"
    assert found("slow", "noisy") == "slow"  # given up after two calls
    assert calls["noisy"] == 2


def test_an_earlier_way_stays_if_a_later_one_gains_little() -> None:
    now = [0.0]

    def call(seconds: float) -> None:
        now[0] += seconds

    clock = lambda: now[0]  # noqa: E731
    assert fastest_way({"a": lambda: call(1.0), "b": lambda: call(0.98)}, clock) == "a"
    assert fastest_way({"a": lambda: call(1.0), "b": lambda: call(0.95)}, clock) == "b"
