"""Writes network/weights.npz, which holds everything that is needed to run the network."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.files import save_npz
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.model import FinishedNetwork
from hobble.models.training_facts import TrainingFacts
from hobble.rows.layout import CONTACTS, GAITS
from hobble.training.batches import TRAIN

UNITS = "centimetres, 60 Hz frames, velocities per frame, right-handed, Y up, +Z forward, +X left"


def write_weights(
    path: Path,
    network: FinishedNetwork,
    database: Database,
    configuration: str,
    about_training: Mapping[str, Any],
) -> None:
    """Write the arrays of the network, of the standardisation and of `TrainingFacts`, and `meta`.

    configuration: its name. about_training: facts such as the numbers of passes and samples, which are added
    to `meta`. (`TrainingFacts`, in contrast, are arrays about the training rows.) Equal arguments give a file
    with equal bytes.
    """
    statistics = database.statistics
    arrays = {
        **network.arrays(),
        "Xmean": statistics.x_mean,
        "Xstd": statistics.x_std,
        "Ymean": statistics.y_mean,
        "Ystd": statistics.y_std,
    }
    arrays |= TrainingFacts.from_rows(database.layout, database.each_row(TRAIN), statistics).arrays()
    save_npz(
        path, **arrays, meta=np.array(network_metadata(network, database, configuration, about_training))
    )


def network_metadata(
    network: FinishedNetwork, database: Database, configuration: str, about_training: Mapping[str, Any]
) -> str:
    """The text of the array `meta`: JSON that says what each column means and how the network was made."""
    skeleton = Skeleton.from_dict(database.skeleton)
    channels = [channel(name) for name, _ in database.layout.channels]
    return json.dumps(
        {
            "kind": network.kind,
            "configuration": configuration,
            "layout": database.layout.to_dict(),
            "skeleton": database.skeleton,
            "gaits": list(GAITS),
            "contacts": list(CONTACTS),
            "channels": {c.name: c.columns(skeleton) for c in channels},
            "limits": database.manifest.limits,
            "units": "; ".join([UNITS, *(f"{c.value_word} 0 to {c.highest:g}" for c in channels)]),
            **network.file_metadata,
            **about_training,
        }
    )  # keys are not sorted, because the skeleton's joints must keep the order of the columns
