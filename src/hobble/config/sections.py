"""The typed sections of a data set and of a configuration, each from the stage that reads it.

The keys of a section, their defaults, units and ranges are in `options.py` of its stage. They are
validated before the DAG is built, and each job gets its own section as that same type.
"""

from hobble.core.section import (
    Finite,
    Gait,
    Ground,
    Inside,
    PhaseMode,
    Positive,
    PositiveFloat,
    Section,
    Share,
)
from hobble.database.options import Database
from hobble.evaluation.options import Evaluation
from hobble.hurt.options import Hurt
from hobble.labels.options import Labels
from hobble.motion.options import Download, Motion
from hobble.report.options import Report
from hobble.runtime.options import Runtime
from hobble.synthetic.options import Synthetic
from hobble.terrain.options import Heightmap, Terrain
from hobble.training.options import Training

__all__ = [
    "COMPARED",
    "Database",
    "Download",
    "Evaluation",
    "Finite",
    "Gait",
    "Ground",
    "Heightmap",
    "Hurt",
    "Inside",
    "Labels",
    "Motion",
    "PhaseMode",
    "Positive",
    "PositiveFloat",
    "Report",
    "Runtime",
    "Section",
    "Share",
    "Synthetic",
    "Terrain",
    "Training",
]

# What results/compare/ sets side by side where --config compare names nothing else: the published sizes and
# passes, and the figure that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "injured")
