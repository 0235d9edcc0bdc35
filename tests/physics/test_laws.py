"""What holds for every law of the table."""

from __future__ import annotations

import inspect
from pathlib import Path

import jax
import numpy as np
import pytest

from tests.physics.points import FILMS, JOINTS, LOSSES, POINTS, REST
from twin.physics.laws import LAWS
from twin.physics.page import laws_page
from twin.units import parse_unit

NAMES = sorted(LAWS)
PAGE = Path(__file__).parents[2] / "docs" / "laws.md"


def value(name: str, **changed: object) -> object:
    return LAWS[name].function(**(POINTS[name] | changed))


def test_every_law_has_a_point_of_its_kind():
    for kind, points in (("loss", LOSSES), ("film", FILMS), ("joint", JOINTS)):
        assert {name for name, law in LAWS.items() if law.kind == kind} == set(points)


@pytest.mark.parametrize("name", NAMES)
def test_row_fits_function(name):
    law = LAWS[name]
    arguments = list(inspect.signature(law.function).parameters)
    assert sorted(arguments) == sorted([*law.signals, *law.states, *law.parameters])
    assert law.function.__name__ == name
    assert law.function.__doc__
    assert law.source
    assert law.formula
    assert set(law.states) <= ({"temperature"} if law.kind == "loss" else {"surface", "ambient"})
    if law.validity is not None:
        assert list(inspect.signature(law.validity.holds).parameters) == arguments
        assert law.validity.text
    for argument in (*law.signals.values(), *law.states.values(), *law.parameters.values()):
        assert argument.meaning
        assert argument.low < argument.high
        assert parse_unit(argument.unit).factor == pytest.approx(1.0), argument.unit


@pytest.mark.parametrize("name", NAMES)
def test_holds_at_its_point(name):
    law = LAWS[name]
    if law.validity is not None:
        assert bool(law.validity.holds(**POINTS[name]))


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_those_of_differences(name):
    point = POINTS[name]
    gradient = jax.grad(lambda values: LAWS[name].function(**values))(point)
    names = list(point)
    at = np.zeros(24)  # one shape for all laws: JAX compiles each operation once
    at[: len(names)] = [point[argument] for argument in names]
    moved = 1e-6 * np.diag(np.abs(at))[: len(names)]
    above, below = (
        np.broadcast_to(value(name, **dict(zip(names, rows, strict=True))), at.shape)
        for rows in (at[: len(names), None] + moved, at[: len(names), None] - moved)
    )
    for k, argument in enumerate(names):
        scale = abs(float(value(name)) / at[k])
        slope = float(above[k] - below[k]) / (2e-6 * abs(at[k]))
        assert gradient[argument] == pytest.approx(slope, rel=2e-6, abs=1e-8 * scale), argument


@pytest.mark.parametrize("at_rest", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_finite_at_rest(name, at_rest):
    """All together, and each of them alone: the surface as warm as the air, the axis, the coolant at rest."""
    law, point = LAWS[name], POINTS[name]
    still = {
        argument: REST[argument] for argument in point if argument in REST and argument in {**law.signals, **law.states}
    }
    points = [point | still] if at_rest else [point | {argument: zero} for argument, zero in still.items()]
    for here in points:
        gradient = jax.grad(lambda values: law.function(**values))(here)
        assert np.all(np.isfinite(list(gradient.values()))), (here, gradient)


@pytest.mark.parametrize("name", sorted(FILMS) + sorted(JOINTS))
def test_films_and_joints_are_positive(name):
    law = LAWS[name]
    temperatures = np.array([-40.0, 0.0, 22.0, 22.0 + 1e-9, 22.5, 60.0, 140.0])
    for rest in ({}, {"speed": 0.0, "flow": 0.0}, {"speed": 1e-7, "flow": 1e-12}):
        changed = {k: v for k, v in rest.items() if k in POINTS[name]}
        if law.states:
            changed["surface"] = temperatures
        h = np.asarray(value(name, **changed))
        assert np.all(np.isfinite(h))
        assert np.all(h > 0.0), (rest, h)


@pytest.mark.parametrize("name", sorted(LOSSES))
def test_losses_are_not_negative(name):
    """Whatever the direction of motion, force and power."""
    law = LAWS[name]
    signs = np.array([1.0, -1.0, 1.0, -1.0])
    for other in (1.0, -1.0):
        changed = {}
        for k, argument in enumerate(law.signals):
            at = POINTS[name][argument]
            changed[argument] = at * (signs if k == 0 else other) if law.signals[argument].low < 0 else at
        assert np.all(np.asarray(value(name, **changed)) >= 0.0)


def samples_and_states(name: str) -> dict[str, np.ndarray]:
    """Two samples down, three states across, as a run evaluates them."""
    law, point = LAWS[name], POINTS[name]
    signals = {s: np.array([0.5, 1.0])[:, None] * point[s] for s in law.signals}
    return signals | {s: np.array([0.9, 1.0, 1.1])[None, :] * point[s] for s in law.states}


@pytest.fixture(scope="module")
def compiled() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Every law and its validity over samples and states, all in one compilation."""

    def every(points):
        return {
            name: (law.function(**points[name]), law.validity.holds(**points[name]) if law.validity else True)
            for name, law in LAWS.items()
        }

    return jax.jit(every)({name: POINTS[name] | samples_and_states(name) for name in LAWS})


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_arrays_and_jit(name, compiled):
    """The same numbers as one by one."""
    result, inside = compiled[name]
    one_by_one = {k: np.broadcast_to(v, (2, 3)).ravel() for k, v in samples_and_states(name).items()}
    expected = np.broadcast_to(value(name, **one_by_one), 6)
    np.testing.assert_allclose(np.broadcast_to(result, (2, 3)).ravel(), expected, rtol=1e-12)
    assert np.asarray(inside).dtype == bool
    np.broadcast_to(inside, (2, 3))


def test_the_page_is_in_step_with_the_table():
    assert PAGE.read_text(encoding="utf-8") == laws_page(), "run: python -m twin.physics.page > docs/laws.md"
    for name in LAWS:
        assert f"`{name}`" in laws_page()
