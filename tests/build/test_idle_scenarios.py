"""Scenarios in which next to nothing happens do not decide a certificate."""

from __future__ import annotations

import numpy as np
import pytest

from twin.build.comparison import Comparison
from twin.machine.description import Limits


def compared(sizes: list[float], errors: list[float]) -> Comparison:
    """One sensor and one place; sizes: K (and um) that scenarios move it by."""
    T, e = np.array(sizes)[:, None], np.array(errors)[:, None]
    flat = np.zeros_like(T)

    def at_place(values: np.ndarray) -> np.ndarray:
        return 1e-6 * np.repeat(values[:, None], 3, axis=2)

    labels = tuple(f"scenario {i}" for i in range(len(sizes)))
    return Comparison(labels, e, at_place(e), flat, T, at_place(flat), at_place(T))


def test_errors_of_scenarios_are_scaled_to_the_case():
    limits = Limits()
    T, u = compared([5.0, 2.5], [0.01, 0.01]).scaled(limits)
    assert T[0] == pytest.approx(0.01 * limits.at_temperature_range / 2.5)
    assert u.max() == pytest.approx(1e-8 * limits.at_displacement_range / 2.5e-6)


def test_a_scenario_of_next_to_nothing_counts_as_a_hundredth_of_the_largest():
    limits = Limits()
    T, u = compared([5.0, 0.004], [0.001, 0.001]).scaled(limits)
    assert T[0] == pytest.approx(0.001 * limits.at_temperature_range / 0.05)  # not / 0.004: 2.5 K
    assert u.max() == pytest.approx(1e-9 * limits.at_displacement_range / 0.05e-6)
    T, _ = compared([0.0, 0.0], [0.0, 0.0]).scaled(limits)
    assert T[0] == 0.0
