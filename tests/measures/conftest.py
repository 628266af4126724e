"""Uses the small networks of the runtime's tests."""

from __future__ import annotations

import importlib.util
from pathlib import Path

_spec = importlib.util.spec_from_file_location(
    "runtime_networks", Path(__file__).parents[1] / "runtime" / "conftest.py"
)
assert _spec is not None
assert _spec.loader is not None
_networks = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_networks)

make_network, network = _networks.make_network, _networks.network
steady, hurtable = _networks.steady, _networks.hurtable
