"""The compiled reader gives the bits of Python's `float`, or leaves the text to the general reader."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hobble.motion import read_numbers as module
from hobble.motion.read_numbers import LARGE, read_numbers


@pytest.fixture(scope="module", autouse=True)
def any_length() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "LARGE", 0)
        yield


FORMS = ["%g", "%f", "%.4f", "%.15f", "%.17g", "%e", "%E", "%.1e", "+%g", "0%g", "%.30f"]
written = st.builds(
    lambda form, value: form % abs(value) if form[0] in "+0" else form % value,
    st.sampled_from(FORMS),
    st.floats(-1e6, 1e6) | st.floats(allow_nan=False, allow_infinity=False),
)
ODD = "0 -0 -0.0 .5 -.5 5. +5 1e5 1E+05 1e-400 1e400 1e99999999999999999999 9007199254740993 0.1e22 1e23"
odd = st.sampled_from(ODD.split(" "))
fraction = st.from_regex(r"-?[0-9]{0,25}\.[0-9]{1,25}(e[-+]?[0-9]{1,3})?", fullmatch=True)


@given(st.lists(st.tuples(written | odd | fraction, written | odd | fraction), min_size=1, max_size=6))
def test_numbers_have_the_bits_of_float(rows: list[tuple[str, str]]) -> None:
    filled = [("1.5", "2.5")] * 40  # so that long numbers are not too many
    rows = filled + rows
    data = "\n".join("\t ".join(row) for row in rows).encode()
    found = read_numbers(data, 0, 2, len(rows))
    expected = np.array([[float(word) for word in row] for row in rows])
    assert found is not None
    np.testing.assert_array_equal(found.view(np.int64), expected.view(np.int64))


@pytest.mark.parametrize(
    "text",
    ["1 2\n3 4\n", "1 2\r\n3 4", "\n\n 1\t2 \n \n3 4 \n\n", "1 2\n3 4\n\n\n"],
)
def test_blank_lines_and_ends_of_lines_count_for_nothing(text: str) -> None:
    data = b"MOTION\n" + text.encode()
    for declared in (1, 2, 3, 50):
        np.testing.assert_array_equal(read_numbers(data, 7, 2, declared), [[1, 2], [3, 4]])


@pytest.mark.parametrize(
    "text",
    [
        *("1 2 3\n", "1\n2\n", "1 2\n3", "1 x\n", "1 nan\n", "1 inf\n", "1 -\n", "1 .\n", "1 e5\n", "1 2e\n"),
        *(
            "1 2e+\n",
            "1 1_0\n",
            "1 1,5\n",
            "1 0x10\n",
            "1 2\r3 4\n",
            "1\x0b2\n",
            "1\xa02\n",
            "1 2-3\n",
            "1 1.2.3\n",
        ),
        *("1 2\n3 4\n5 6\n7 8\n", "1 2\0\n", "1 --2\n", "1 2\n\x1a"),
    ],
)
def test_anything_else_is_left_to_the_general_reader(text: str) -> None:
    assert read_numbers(text.encode("latin-1"), 0, 2, 2) is None


def test_many_long_numbers_are_left_to_the_general_reader() -> None:
    long = b"0.12345678901234567890 1\n"
    assert read_numbers(long * 100, 0, 2, 100) is None
    few = read_numbers(long + b"1 2\n" * 99, 0, 2, 100)
    assert few is not None
    assert few[0, 0] == float("0.12345678901234567890")


def test_a_short_text_does_not_load_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LARGE", LARGE)
    monkeypatch.delitem(sys.modules, "numba")
    assert read_numbers(b"1 2\n", 0, 2, 1) is None
