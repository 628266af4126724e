"""The descriptions of all measurements, and how their options become one section."""

import inspect
import subprocess
import sys

import pytest

from hobble.channels import CHANNEL_NAMES
from hobble.core.section import Positive, Section
from hobble.measures.measure import INPUTS, JointOptions, Measure, all_measures, joined_options

NAMES = [one.name for one in all_measures()]
# Function that a measurement may have -> how many arguments it is given.
FUNCTIONS = {
    "section": 2,
    "figures": 2,
    "hints": 2,
    "compared": 2,
    "tables": 1,
    "compared_section": 1,
    "compared_values": 1,
}


class Laps(Section):
    laps: Positive = 2


class Rounds(Section):
    laps: Positive = 3


class Far(JointOptions):
    far: Positive = 4


@pytest.mark.parametrize("one", all_measures(), ids=NAMES)
def test_each_measurement_has_known_inputs_and_the_called_functions(one: Measure) -> None:
    assert NAMES.count(one.name) == 1
    assert one.name not in INPUTS
    assert set(one.inputs) <= {*INPUTS, *NAMES} - {one.name}
    assert one.channel in ("", *CHANNEL_NAMES)
    found = {name: one.function(name) for name in FUNCTIONS}
    for name, function in found.items():
        assert function is None or len(inspect.signature(function).parameters) == FUNCTIONS[name], name
    assert len(inspect.signature(one.runner().run).parameters) == 2


def test_planning_imports_nothing_slow() -> None:
    """Descriptions are read at planning and in every job of a cluster, so their imports must be fast."""
    code = "import sys, hobble.config.models; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    slow = {"numba", "torch", "pandas", "jinja2", "scipy"}
    assert [name for name in done.stdout.split() if name in slow or name.endswith("_run")] == []


def test_the_options_of_all_measurements_form_one_section() -> None:
    both = joined_options([JointOptions, Section, Far, Laps, JointOptions])
    assert both().model_dump() == {"joints": "all", "far": 4, "laps": 2}
    assert list(both.model_fields) == ["joints", "far", "laps"]
    with pytest.raises(ValueError, match="greater than 0"):
        both(laps=0)
    with pytest.raises(ValueError, match="Extra inputs"):
        both(lap=1)
    with pytest.raises(TypeError, match="laps is a key of"):
        joined_options([Laps, Rounds])
