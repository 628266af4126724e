"""Collects the types of the sections of data sets and configurations, for `hobble.config.models`.

A stage of the workflow is a package such as `hobble.motion`. Its `options.py` defines a class for each
section that the stage reads, with keys, defaults, units and ranges. Sections are validated before Snakemake
plans its jobs, and each job gets its section as an instance of this class.
"""

from typing import TYPE_CHECKING

from hobble.core.section import (
    Finite,
    Gait,
    Ground,
    PhaseMode,
    Positive,
    PositiveFloat,
    RelativePath,
    Section,
    Share,
)
from hobble.database.options import DatabaseOptions
from hobble.hurt.options import Hurt
from hobble.labels.options import LabelOptions
from hobble.measures.measure import all_measures, joined_options
from hobble.motion.options import Download, MotionOptions
from hobble.report import ReportOptions
from hobble.runtime.options import Runtime
from hobble.synthetic.options import Synthetic
from hobble.terrain.options import HeightmapOptions, Terrain
from hobble.training.options import Training

__all__ = [
    "COMPARED",
    "DatabaseOptions",
    "Download",
    "Evaluation",
    "Finite",
    "Gait",
    "Ground",
    "HeightmapOptions",
    "Hurt",
    "LabelOptions",
    "MotionOptions",
    "PhaseMode",
    "Positive",
    "PositiveFloat",
    "RelativePath",
    "ReportOptions",
    "Runtime",
    "Section",
    "Share",
    "Synthetic",
    "Terrain",
    "Training",
]

# Names of the configurations that are compared in results/compare/, unless --config compare=... names others:
# the published networks, and the character that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "ava", "ava-m", "injured")

if TYPE_CHECKING:  # a type checker cannot follow the class that is made below
    Evaluation = Section
else:
    Evaluation = joined_options([measure.options for measure in all_measures()])
