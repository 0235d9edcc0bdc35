"""Symmetric machines: an output that moves by the asymmetry of a mesh alone fails no certificate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.build.certificate import relative_errors
from twin.cli.main import run
from twin.rom.artefact import read_artefact

STEEL = """
conductivity = "50 W/(m*K)"
density = "7200 kg/m^3"
heat_capacity = "500 J/(kg*K)"
youngs_modulus = "120 GPa"
poisson_ratio = 0.26
expansion = "10e-6 1/K"
"""


def mill(seed: int) -> str:
    """A column with a motor on a bed, mirrored in x = 0: nothing but the mesh says which side is which."""
    rng = np.random.default_rng(seed)
    width, depth, height, column = (
        rng.uniform(0.6, 1.0),
        rng.uniform(0.6, 1.0),
        rng.uniform(0.1, 0.2),
        rng.uniform(0.6, 1.0),
    )
    thick, power, film = rng.uniform(0.15, 0.25), rng.uniform(100.0, 400.0), rng.uniform(5.0, 15.0)
    boxes = {
        "bed": ([-width / 2, -depth / 2, 0.0], [width, depth, height], [5, 4, 2]),
        "column": ([-width / 4, depth / 2 - thick, height], [width / 2, thick, column], [3, 2, 5]),
        "head": (
            [-width / 6, depth / 2 - thick - 0.3, height + 0.7 * column],
            [width / 3, 0.3, 0.2 * column],
            [3, 2, 2],
        ),
    }
    feet = [f"foot_{k}" for k in range(4)]
    for k, name in enumerate(feet):
        x, y = (width / 2 - 0.06) * (1, -1)[k % 2] - 0.04, (depth / 2 - 0.06) * (1, -1)[k // 2] - 0.04
        boxes[name] = ([x, y, -0.05], [0.08, 0.08, 0.05], [1, 1, 1])
    parts = "".join(
        f'[parts.{name}]\nmaterial = "iron"\nadiabatic = {["z_min"] if name in feet else []}\n'
        f"box = {{ origin = {[round(float(v), 4) for v in origin]}, size = {[round(float(v), 4) for v in size]}, "
        f"divisions = {divisions} }}\n"
        for name, (origin, size, divisions) in boxes.items()
    )
    stands = "".join(
        f'[contacts.{name}]\nkind = "fixed"\nsurfaces = ["bed.z_min", "{name}.z_max"]\n'
        'conductance = "2000 W/(m^2*K)"\n'
        f'[supports.{name}]\nsurface = "{name}.z_min"\nstiffness = ["50 N/um", "50 N/um", "200 N/um"]\n'
        for name in feet
    )
    return f"""
[machine]
name = "mill"
reference_temperature = "20 degC"
[materials.iron]{STEEL}{parts}
[contacts.foot]
kind = "fixed"
surfaces = ["bed.z_max", "column.z_min"]
conductance = "2000 W/(m^2*K)"
[contacts.flange]
kind = "fixed"
surfaces = ["column.y_min", "head.y_max"]
conductance = "2000 W/(m^2*K)"
[signals.current]
unit = "A"
kind = "rms"
range = ["0 A", "10 A"]
[signals.air]
unit = "degC"
range = ["10 degC", "30 degC"]
[environment.hall]
signal = "air"
[sources.motor]
law = "motor_copper"
surface = "column.y_max"
parameters = {{ resistance = "{power / 300.0:.3f} ohm" }}
signals = {{ current = "current" }}
[films.all]
law = "constant_film"
emissivity = 0.0
surfaces = ["bed.*", "column.*", "head.*", "foot_0.*", "foot_1.*", "foot_2.*", "foot_3.*"]
environment = "hall"
parameters = {{ natural = "{film:.2f} W/(m^2*K)" }}
[sensors.column]
part = "column"
position = [0.0, {depth / 2 - thick:.4f}, {height + column / 2:.4f}]
[sensors.head]
part = "head"
position = [0.0, {depth / 2 - thick - 0.3:.4f}, {height + 0.8 * column:.4f}]
[tcp.tool]
surface = "head.z_min"
point = [0.0, {depth / 2 - thick - 0.15:.4f}, {height + 0.5 * column:.4f}]
[tcp.work]
surface = "bed.z_max"
{stands}"""


def absolute(certificate: dict[str, Any]) -> bool:
    """Whether the limits in K and m hold."""
    return bool(
        certificate["max_temperature_error_in_case"] <= certificate["limit_temperature"]
        and certificate["max_displacement_error_in_case"] <= certificate["limit_displacement"]
    )


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 20))])
def test_build_and_verify_judge_a_symmetric_machine_by_its_absolute_limits(tmp_path: Path, seed: int) -> None:
    """A reduced model of few states, near its limits, whose dx is wrong by many percent of next to nothing."""
    machine, artefact = tmp_path / "machine.toml", tmp_path / "mill.h5"
    machine.write_text(mill(seed), encoding="utf-8")
    build = ["build", str(machine), "-o", str(artefact), "--states", "48", "--training", "4"]
    for command in (build, ["verify", str(artefact)]):
        status = run(command)
        told = read_artefact(artefact).certificate
        error, span = (np.max(told[f"displacement_{k}"], axis=0) for k in ("error", "range"))
        assert error[0] > told["limit_relative"] * span[0]
        assert span[0] < 0.02 * span[1]  # it hardly moves to its side
        assert status == (0 if absolute(told) else 1)


def test_an_output_counts_where_it_moves_more_than_its_error_may_be() -> None:
    error, span = np.array([0.035, 0.5]), np.array([0.85, 481.0])  # um: dx and dy of a mill
    in_case = 38.0 * span / 481.0
    assert relative_errors(error, span, in_case, 0.2) == pytest.approx([0.0, 0.5 / 481.0])
    assert relative_errors(error, span, in_case, 0.05)[0] == pytest.approx(0.035 / 0.85)
