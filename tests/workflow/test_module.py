"""Another workflow imports this one as a module; `snakemake --report`. (`make check` runs `--lint`.)"""

import subprocess

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.slow]
IMPORTING = """
module hobble:
    snakefile: "{checkout}/workflow/Snakefile"
    config: {{}}
    {prefix}

use rule * from hobble as hobble_*

rule mine:
    default_target: True
    input: "{place}results/test/pipeline.json"
"""


@pytest.mark.parametrize("place", ["", "walkers/"])
def test_a_module_makes_the_same_in_its_place(workflow, finished, tmp_path, place: str) -> None:
    prefix = f'prefix: "{place}"' if place else ""
    text = IMPORTING.format(checkout=workflow.folder, prefix=prefix, place=place)
    (tmp_path / "Snakefile").write_text(text)
    motion = f"{place}results/datasets/tiny/batches/motion/uneven-1"
    how = {**workflow.how(), "cwd": tmp_path, "capture_output": True, "text": True}
    for target in ("-n", motion):
        done = subprocess.run(workflow.command("-c2", target), **how)
        assert done.returncode == 0, done.stderr
    ours = finished.folder / "results/datasets/tiny/motion/uneven-1.npz"
    assert (tmp_path / motion / "motion/uneven-1.npz").read_bytes() == ours.read_bytes()


def test_snakemakes_own_report_shows_the_pages(copied) -> None:
    copied.run("--report", "own.html", "results/test/report.html")
    text = (copied.folder / "own.html").read_text()
    assert "results/test/report.html" in text
    assert "a character to steer and to hurt" in text
