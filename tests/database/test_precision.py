"""Half precision rounds to the nearest number."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from hobble.core.errors import HobbleError
from hobble.database.chunks import to_floats, to_stored_type


@given(st.lists(st.floats(-(2.0**99), 2.0**99, width=32), min_size=1, max_size=40))
def test_bfloat16_rounding_equals_torchs(values):
    array = np.array(values, np.float32)
    expected = torch.from_numpy(array).to(torch.bfloat16)
    stored = to_stored_type(array, "bfloat16")
    np.testing.assert_array_equal(stored.view(np.int16), expected.view(torch.int16).numpy())
    np.testing.assert_array_equal(to_floats(stored), expected.float().numpy())


def test_values_too_large_for_float16_are_refused():
    with pytest.raises(HobbleError, match=r"7e\+04 does not fit float16.*bfloat16"):
        to_stored_type(np.array([1.0, -7e4]), "float16")
    assert to_floats(to_stored_type(np.array([-7e4]), "bfloat16"))[0] == pytest.approx(-7e4, rel=2**-8)
