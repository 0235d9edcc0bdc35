"""The worked example of docs/how_to_add_a_law.md runs, and what it says of the table holds."""

import importlib
import inspect
import re
import tomllib
from pathlib import Path

import pytest

from tests.physics import points
from twin.physics.laws import LAWS, Law

PAGE = (Path(__file__).parents[2] / "docs" / "how_to_add_a_law.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def example() -> dict[str, object]:
    names: dict[str, object] = {}
    for code in blocks("python"):
        exec(code, names)
    return names


def test_its_own_test_passes_and_can_fail(example):
    own = example["test_copper_loss_of_torque"]
    own()
    right = own.__globals__["motor_copper_of_torque"]
    own.__globals__["motor_copper_of_torque"] = lambda *given, **named: 1.01 * right(*given, **named)
    try:
        with pytest.raises(AssertionError):
            own()
    finally:
        own.__globals__["motor_copper_of_torque"] = right
    example["test_where_it_holds"]()


def test_its_row_fits_its_function_as_all_rows_do(example):
    row = example["row"]
    assert isinstance(row, Law)
    for name, law in {**LAWS, "motor_copper_of_torque": row}.items():
        arguments = list(inspect.signature(law.function).parameters)
        assert sorted(arguments) == sorted([*law.signals, *law.states, *law.parameters]), name
        assert law.kind in ("loss", "film", "joint"), name
        assert law.source, name
        assert law.formula, name
    assert list(inspect.signature(row.validity.holds).parameters) == list(inspect.signature(row.function).parameters)


def test_its_description_gives_every_argument_and_no_other(example):
    (text,) = blocks("toml")
    description = tomllib.loads(text)
    source = description["sources"]["y_motor"]
    row = example["row"]
    assert source["law"] == row.function.__name__
    assert set(source["parameters"]) == set(row.parameters)
    assert set(source["signals"]) == set(row.signals)
    assert set(source["signals"].values()) <= set(description["signals"])


def test_the_tables_and_the_point_it_names_are_those_of_the_project(example):
    for table, names in (("loss_table", ("LOSSES",)), ("film_table", ("FILMS", "JOINTS"))):
        module = importlib.import_module(f"twin.physics.{table}")
        assert f"`twin/physics/{table}.py`" in PAGE
        for name in names:
            assert f"`{name}`" in PAGE
            assert set(getattr(module, name)) == set(getattr(points, name))  # the points have the same keys
    ((name, point),) = example["point"].items()
    assert name == example["row"].function.__name__
    assert f'"{name}": Law(\n        motors.{name}, ' in PAGE
    assert example["row"].function(**point) > 0.0
    assert example["row"].validity.holds(**point)
