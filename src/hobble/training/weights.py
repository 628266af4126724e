"""network/weights.npz: what the runtime needs of a trained network, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import save_npz
from hobble.database.layout import CONTACTS, GAITS
from hobble.database.reader import Database
from hobble.models.trainable import Trainable

UNITS = (
    "centimetres, 60 Hz frames, velocities per frame, right-handed, Y up, +Z forward, +X left, "
    "severities 0 to 10"
)


def write_weights(
    path: Path, network: Trainable, database: Database, configuration: str, facts: Mapping[str, Any]
) -> None:
    """Write the network's arrays, `Xmean`, `Xstd`, `Ymean`, `Ystd` and `meta`, a JSON text.

    facts: numbers about the training and its rows that go into `meta` as they are. Equal networks give equal
    bytes.
    """
    s = database.statistics
    arrays = {**network.arrays(), "Xmean": s.x_mean, "Xstd": s.x_std, "Ymean": s.y_mean, "Ystd": s.y_std}
    save_npz(path, **arrays, meta=np.array(meta(network, database, configuration, facts)))


def meta(network: Trainable, database: Database, configuration: str, facts: Mapping[str, Any]) -> str:
    """What the columns mean and where the network comes from, as JSON; the joints keep their order."""
    links = ["-".join(link) for link in database.skeleton["links"]] if database.layout.links else []
    return json.dumps(
        {
            "kind": network.kind,
            "configuration": configuration,
            "layout": database.layout.to_dict(),
            "skeleton": database.skeleton,
            "gaits": list(GAITS),
            "contacts": list(CONTACTS),
            "links": links,
            "units": UNITS,
            **network.about,
            **facts,
        }
    )  # not sorted: the order of the skeleton's joints is that of the columns
