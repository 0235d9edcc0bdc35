"""Units at the border."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest

from twin.units import parse_unit, to_si


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        ("120 mm", "m", 0.12),
        ("120mm", "m", 0.12),
        (3, "m", 3.0),
        ("25 W/(m^2*K)", "W/(m^2*K)", 25.0),
        ("293.15 K", "degC", 20.0),
        ("68 °F", "degC", 20.0),
        ("20 K", "K", 20.0),
        ("20 mK", "K", 0.02),
        ("3000 rpm", "1/s", 50.0),  # revolutions, never rad/s
        ("3000 U/min", "1/s", 50.0),
        ("5 µm", "m", 5e-6),
        ("8 g/cm³", "kg/m^3", 8000.0),
        ("1 t/mm^3", "kg/m^3", 1e12),
        ("50 N/um", "N/m", 5e7),
        ("5 kN/cm", "N/m", 5e5),  # this one and the next are left to pint
        ("1 mW/(cm*K)", "W/(m*K)", 0.1),
        ("3 ft", "m", 0.9144),
        ("7", "1", 7.0),
    ],
)
def test_quantities_become_si(value, unit, expected):
    assert to_si(value, unit) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        ("3 rad/s", "1/s"), ("1 rad/h", "1/s"), ("20 degC", "K"), ("2 deg", "m"), ("1 foo", "m"), ("m", "m"), ("", "m"),
        (math.nan, "m"), (math.inf, "m"), (True, "m"), ("nan m", "m"), ("1 m 2", "m"), ("1 m^9^9^9^9^9", "m"),
        ("1 __import__", "m"), ([1], "m"), ("7", "m"),
    ],
)  # fmt: skip
def test_what_is_no_quantity_of_the_unit_is_refused(value, unit):
    with pytest.raises(ValueError):
        to_si(value, unit)


def test_table_agrees_with_pint():
    """Each row of the table, against pint's own definitions."""
    import pint

    from twin.units import _TABLE

    pint_units = pint.UnitRegistry()
    ours = {
        "%",
        "permille",
        "-",
        "",
        "rps",
        "Nm",
        "W/mK",
        "W/m^2K",
        "J/kgK",
        "mohm",
        "delta_degF",
        "ppm/K",
        "h",
        "d",
        "1",
        "t",
        "C",
    }
    for si, row in _TABLE.items():
        if si.startswith("rad"):
            continue
        for text, factor in row.items():
            if text in ours or "rev" in text or text == "rpm":
                continue
            expected = (
                pint_units.Quantity(1, text).to(pint_units.parse_units(si if si != "K" else "delta_degC")).magnitude
            )
            assert factor == pytest.approx(expected, rel=1e-12), text


def test_every_unit_knows_its_si_unit():
    assert parse_unit("m/min").si == "m/s"
    assert parse_unit("°C").si == "degC"
    assert parse_unit("K").si == "degC"
    assert parse_unit("hp").si == "W"
    assert parse_unit("").si == "1"


def test_common_units_do_not_import_pint():
    use = "from twin.units import to_si, parse_unit; to_si('3 m/min', 'm/s'); parse_unit('°C')"
    code = f"import sys; {use}; sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
