"""The descriptions of all measurements, and how their options become one section."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest

from hobble.core.section import Positive, Section
from hobble.evaluation.options import joined_sections
from hobble.measures.joints import JointOptions
from hobble.measures.measure import INPUTS, Measure
from hobble.measures.registry import MEASURES, channel_measures, measure_named, names_of_modules

NAMES = [one.name for one in MEASURES]
# Part -> its functions and what they are given.
FUNCTIONS = {
    "run": {"run": 2, "run_piece": 3},
    "page": {"section": 2, "figures": 2, "hints": 2},
    "comparison": {"compared": 2, "tables": 1},
    "comparison_page": {"section": 1, "columns": 1},
}


class Laps(Section):
    laps: Positive = 2


class Rounds(Section):
    laps: Positive = 3


class Far(JointOptions):
    far: Positive = 4


@pytest.mark.parametrize("one", MEASURES, ids=NAMES)
def test_each_measurement_has_known_inputs_and_the_called_functions(one: Measure) -> None:
    assert one.has_module("run")
    earlier = NAMES[: NAMES.index(one.name)]
    assert set(one.inputs) <= {*INPUTS, *earlier}
    assert measure_named(one.name) is one
    for part, functions in FUNCTIONS.items():
        module = one.import_module(part)
        present = {name for name in functions if hasattr(module, name)}
        assert present or module is None, f"{part} has none of {', '.join(functions)}"
        assert part != "run" or ("run_piece" in present) == (one.pieces is not None)
        for name in present:
            assert len(inspect.signature(getattr(module, name)).parameters) == functions[name], (part, name)


def test_measurements_of_channels_are_listed() -> None:
    brought = [one.name for one in MEASURES if one.package.startswith("hobble.channels.")]
    assert brought == ["injury", "limp", "recognition"] == [one.name for one in channel_measures()]


def test_names_of_measurements_are_unique() -> None:
    assert len(set(NAMES)) == len(NAMES)
    assert not set(NAMES) & set(INPUTS)
    assert len(names_of_modules("run")) == len(NAMES)


def test_the_registry_imports_nothing_slow() -> None:
    """Descriptions are read at planning and in every job of a cluster, so their imports must be fast."""
    code = "import sys, hobble.measures.registry, hobble.config.sections; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert [name for name in loaded if name in ("numpy", "numba", "torch") or name.endswith(".run")] == []


def test_the_options_of_all_measurements_form_one_section() -> None:
    both = joined_sections([JointOptions, Section, Far, Laps, JointOptions])
    assert both().model_dump() == {"joints": "all", "far": 4, "laps": 2}
    assert list(both.model_fields) == ["joints", "far", "laps"]
    with pytest.raises(ValueError, match="greater than 0"):
        both(laps=0)
    with pytest.raises(ValueError, match="Extra inputs"):
        both(lap=1)


def test_a_key_that_two_measurements_define_is_refused() -> None:
    with pytest.raises(TypeError, match="laps is a key of"):
        joined_sections([Laps, Rounds])
