"""Tables of results as data frames, and the notebook that uses them."""

import json
from pathlib import Path

import matplotlib
import pytest

import hobble
from hobble.core.errors import HobbleError
from hobble.core.files import write_tables


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which the workflow has made the results of `test`."""
    folder, of_clip = tmp_path / "results/test", {"split": "train", "position_error_cm": 2.0}
    clips = [{"clip": clip, "mean": mean, **of_clip} for clip, mean in (("a", 0.1), ("b", 0.2))]
    laps = [{"mode": m, "milliseconds_total": 0.1 * n} for m in ("constant", "cubic") for n in (1, 3)]
    history = [{"pass": p, "section": s, "train_mse": 1 / (p + s)} for p in (1, 2) for s in (1, 2)]
    write_tables(folder / "evaluation/accuracy", {"clips": clips, "empty": []})
    write_tables(folder / "evaluation/responsivity", {"laps": laps})
    write_tables(folder / "network", {"history": history})
    write_tables(tmp_path / "results/compare/tables", {"stages": [{"stage": "training", "seconds": 3.5}]})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_each_table_is_a_data_frame_with_its_numbers(checkout: Path) -> None:
    assert sorted(hobble.results("test")) == ["accuracy/clips", "history", "responsivity/laps"]
    assert hobble.results("compare")["stages"]["seconds"].sum() == 3.5
    with pytest.raises(HobbleError, match=r"results/none has no tables. Make them: snakemake"):
        hobble.results("none")
    published = hobble.results("published")
    assert published["laps"]["holden"].std() == pytest.approx(0.0173, abs=5e-5)


def test_the_notebook_runs(checkout: Path, root: Path) -> None:
    matplotlib.use("agg")
    notebook = json.loads((root / "examples/results.ipynb").read_text())
    names: dict[str, object] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec("".join(cell["source"]), names)
    assert list(names["worst"]["clip"]) == ["b", "a"]
    assert names["laps"].loc["cubic", "std"] == pytest.approx(0.1 * 2**0.5)
