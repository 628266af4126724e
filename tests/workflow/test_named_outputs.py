"""The dictionary finds the rules that Snakemake's own search finds."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import pytest
import snakemake.api  # noqa: F401 - the first import of Snakemake: its other modules import each other
from snakemake.io import IOFile
from snakemake.output_index import OutputIndex

from hobble.workflow import named_outputs
from hobble.workflow.named_outputs import NamedOutputs


@dataclass(frozen=True)
class Rule:
    """What an index asks of Snakemake's rule."""

    name: str
    outputs: tuple[str, ...]

    def has_wildcards(self) -> bool:
        return "{" in self.outputs[0]

    def products(self) -> list[IOFile]:
        return [IOFile(file) for file in self.outputs]

    def is_producer(self, file: str) -> bool:
        return any(product.match(file) for product in self.products())


RULES = [
    Rule("batch 0", ("results/d/motion/a.npz", "results/d/motion/a+b.npz", "results/d/logs/0.log")),
    Rule("batch 1", ("results/d/motion/b.npz", "results/d/motion/b.json")),
    Rule("also batch 1", ("results/d/motion/b.json",)),
    Rule("page", ("results/{name}/look.html",)),
    Rule("folder", (r"results/{name}/database/{channels,[a-z]+}",)),
]
OTHERS = [
    "results/d/look.html",
    "results/d/database/injury",
    "results/d/motion/c.npz",
    "results/d/motion/aab.npz",
    "",
]


@pytest.mark.parametrize("file", [*chain(*(rule.outputs for rule in RULES)), *OTHERS])
def test_a_file_has_the_same_rules_as_without_this_module(file):
    assert NamedOutputs(RULES).match_producers(file) == OutputIndex(RULES).match_producers(file)


def test_rules_with_fixed_output_names_are_looked_up_directly(monkeypatch):
    checked = []
    monkeypatch.setattr(Rule, "is_producer", lambda rule, file: checked.append(rule.name))
    index = NamedOutputs(RULES)
    assert {rule.name for rule in index.match_producers("results/d/motion/b.json")} == {
        "batch 1",
        "also batch 1",
    }
    assert checked == []
    index.match_producers("results/d/look.html")
    assert set(checked) == {"page", "folder"}


def test_snakemake_plans_with_it(monkeypatch):
    monkeypatch.setattr(named_outputs.dag, "OutputIndex", OutputIndex)
    named_outputs.use_named_outputs()
    assert named_outputs.dag.OutputIndex is NamedOutputs
