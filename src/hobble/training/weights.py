"""Write network/weights.npz, which holds everything that the runtime needs."""

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
    path: Path, network: FinishedNetwork, database: Database, configuration: str, facts: Mapping[str, Any]
) -> None:
    """Write the network's arrays, `Xmean`, `Xstd`, `Ymean`, `Ystd`, those of `TrainingFacts`, and `meta`.

    facts: numbers about the training, which are added to `meta`. Equal networks give equal bytes.
    """
    s = database.statistics
    arrays = {**network.arrays(), "Xmean": s.x_mean, "Xstd": s.x_std, "Ymean": s.y_mean, "Ystd": s.y_std}
    arrays |= TrainingFacts.of(database.layout, database.each_row(TRAIN), s).arrays()
    save_npz(path, **arrays, meta=np.array(meta(network, database, configuration, facts)))


def meta(network: FinishedNetwork, database: Database, configuration: str, facts: Mapping[str, Any]) -> str:
    """The array `meta` of the file, as JSON: meaning of the columns and origin of the network."""
    rig = Skeleton.from_dict(database.skeleton)
    channels = [channel(name) for name, _ in database.layout.channels]
    return json.dumps(
        {
            "kind": network.kind,
            "configuration": configuration,
            "layout": database.layout.to_dict(),
            "skeleton": database.skeleton,
            "gaits": list(GAITS),
            "contacts": list(CONTACTS),
            "channels": {one.name: one.columns(rig) for one in channels},
            "limits": database.manifest.limits,
            "units": "; ".join([UNITS, *(f"{one.value} 0 to {one.highest:g}" for one in channels)]),
            **network.about,
            **facts,
        }
    )  # keys not sorted: the order of the skeleton's joints is that of the columns
