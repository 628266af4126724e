"""Uses the small networks of the runtime's tests."""

from tests.runtime.conftest import hurtable, make_network, network, steady  # noqa: F401
