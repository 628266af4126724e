"""Products of a few rows are right, and a row has the same bits next to any other rows."""

import numpy as np
import pytest
from numba import njit

from hobble.models.predict import DEPTH, ROWS, WIDTH, aligned_zeros, in_panels, multiply


@njit
def product(weights, panels, inputs, x, rows, y, places):
    multiply(weights, 0, panels, inputs, x, rows, y, places)


def times(weights: np.ndarray, x: np.ndarray) -> np.ndarray:
    """x W' computed in tiles. The sums are stored in reverse order, to check that `places` is used."""
    outputs, inputs = weights.shape
    panels = -(-outputs // WIDTH)
    flat = aligned_zeros(panels * WIDTH * inputs, weights.dtype)
    flat[:] = in_panels(weights).ravel()
    y = np.zeros((len(x), panels * WIDTH), np.float32)
    places = np.arange(len(x))[::-1] * panels * WIDTH
    product(flat, panels, inputs, np.ascontiguousarray(x).ravel(), len(x), y.ravel(), places)
    assert not y[:, outputs:].any()
    return y[::-1, :outputs]


def in_order(weights: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The running sums by definition. A product of two float32 numbers is exact in float64."""
    y = np.zeros((len(x), len(weights)), np.float32)
    for k in range(x.shape[1]):
        y = (x[:, k : k + 1].astype(float) * weights[:, k].astype(float) + y).astype(np.float32)
    return y


@pytest.mark.parametrize("dtype", ["float32", "int16"])
@pytest.mark.parametrize("inputs", [1, 7, DEPTH + 30])
@pytest.mark.parametrize("outputs", [3, 16, 16 * 7 + 5])
def test_products_do_not_depend_on_the_number_of_rows(dtype: str, inputs: int, outputs: int) -> None:
    rng = np.random.default_rng(inputs + outputs)
    weights = rng.integers(-99, 99, (outputs, inputs)).astype(dtype)
    if dtype == "float32":
        weights += rng.normal(size=weights.shape).astype(np.float32)
    x = rng.normal(size=(2 * ROWS + 1, inputs)).astype(np.float32)
    together = times(weights, x)
    np.testing.assert_allclose(together, in_order(weights, x), rtol=1e-6, atol=1e-5 * np.abs(weights).max())
    for rows in range(1, len(x)):
        np.testing.assert_array_equal(times(weights, x[:rows]), together[:rows])
        np.testing.assert_array_equal(times(weights, x[-rows:]), together[-rows:])
