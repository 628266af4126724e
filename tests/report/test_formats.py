from __future__ import annotations

import json

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.report.parts import embedded, json_data


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(st.text(), st.text() | st.floats(allow_nan=False, allow_infinity=False), max_size=4))
def test_embedded_json_comes_back_and_cannot_end_its_element(value: dict) -> None:
    text = str(embedded(value))
    assert json.loads(text) == value
    assert not set("<>&") & set(text)


def test_what_is_not_finite_becomes_null() -> None:
    value = {"a": np.array([1.0, np.nan]), "b": np.float32("inf"), "c": (np.int64(3), None)}
    assert json_data(value) == {"a": [1.0, None], "b": None, "c": [3, None]}
