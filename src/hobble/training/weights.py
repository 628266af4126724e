"""network/weights.npz: what the runtime needs of a trained network, and nothing else."""

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
from hobble.rows.layout import CONTACTS, GAITS
from hobble.training.network import Network

UNITS = "centimetres, 60 Hz frames, velocities per frame, right-handed, Y up, +Z forward, +X left"


def write_weights(
    path: Path, network: Network, database: Database, configuration: str, facts: Mapping[str, Any]
) -> None:
    """Write `W0` (K, out, in), `b0` (K, out), ..., `Xmean`, `Xstd`, `Ymean`, `Ystd` and `meta`, a JSON text.

    facts: numbers about the training that go into `meta` as they are. Equal networks give equal bytes.
    """
    arrays: dict[str, np.ndarray] = {}
    for number, layer in enumerate(network.layers):
        values = layer.cpu().numpy()
        arrays[f"W{number}"] = np.ascontiguousarray(values[:, :, :-1].swapaxes(0, 1))
        arrays[f"b{number}"] = np.ascontiguousarray(values[:, :, -1].T)
    s = database.statistics
    arrays |= {"Xmean": s.x_mean, "Xstd": s.x_std, "Ymean": s.y_mean, "Ystd": s.y_std}
    save_npz(path, **arrays, meta=np.array(meta(network, database, configuration, facts)))


def meta(network: Network, database: Database, configuration: str, facts: Mapping[str, Any]) -> str:
    """What the columns mean and where the network comes from, as JSON; the joints keep their order."""
    rig = Skeleton.from_dict(database.skeleton)
    channels = [channel(name) for name, _ in database.layout.channels]
    return json.dumps(
        {
            "configuration": configuration,
            "layout": database.layout.to_dict(),
            "skeleton": database.skeleton,
            "gaits": list(GAITS),
            "contacts": list(CONTACTS),
            "channels": {one.name: one.columns(rig) for one in channels},
            "control_points": network.control_points,
            "units": "; ".join([UNITS, *(f"{one.value} 0 to {one.highest:g}" for one in channels)]),
            "network": "y = W2 elu(W1 elu(W0 x + b0) + b1) + b2 on standardised x and y; W and b are cyclic "
            "Catmull-Rom splines of the phase through their control points at k / control_points",
            **facts,
        }
    )  # not sorted: the order of the skeleton's joints is that of the columns
