"""The descriptions of all measurements, and how their options become one section."""

import subprocess
import sys

import pytest

from hobble.channels import CHANNEL_NAMES
from hobble.core.section import Positive, Section
from hobble.measures.measure import INPUTS, SampleOptions, all_measures, joined_options

NAMES = [one.name for one in all_measures()]


class Laps(Section):
    laps: Positive = 2


class Rounds(Section):
    laps: Positive = 3


class Far(SampleOptions):
    far: Positive = 4


def test_each_measurement_has_known_inputs() -> None:
    for one in all_measures():
        assert NAMES.count(one.name) == 1
        assert one.name not in INPUTS
        assert set(one.inputs) <= {*INPUTS, *NAMES} - {one.name}
        assert one.channel in ("", *CHANNEL_NAMES)


def test_planning_imports_nothing_slow() -> None:
    """Descriptions are read at planning and in every job of a cluster, so their imports must be fast."""
    code = "import sys, hobble.config.models; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    slow = {"numba", "torch", "pandas", "jinja2", "scipy"}
    assert [name for name in done.stdout.split() if name in slow or name.endswith("_run")] == []


def test_the_options_of_all_measurements_form_one_section() -> None:
    both = joined_options([SampleOptions, Section, Far, Laps, SampleOptions])
    assert both().model_dump() == {"sample_frames": 500_000, "far": 4, "laps": 2}
    assert list(both.model_fields) == ["sample_frames", "far", "laps"]
    with pytest.raises(ValueError, match="greater than 0"):
        both(laps=0)
    with pytest.raises(ValueError, match="Extra inputs"):
        both(lap=1)
    with pytest.raises(TypeError, match="laps is a key of"):
        joined_options([Laps, Rounds])
