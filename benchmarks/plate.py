"""A plate of steel, 1 kW on its bottom, built and run with the defaults: everywhere against a finer mesh and steps.

0.5 x 1 x 0.05 m, 8000 kg/m3, 500 J/(kg K), 50 W/(m K), 10 W/(m2 K) to 20 degC everywhere but below, 36,000 s. The tests
hold four places of it against a series (docs/references.md).
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from twin.build.full_model import FullModel, assemble_meshed
from twin.build.mesh import body_mesh
from twin.build.pipeline import BuildOptions, compact_model, enough_substeps, full_model, rich_model
from twin.build.refine import refined
from twin.build.stepper import CoupledStepper
from twin.machine.load import load_machine
from twin.progress import bar
from twin.rom.drive import evaluate, split
from twin.rom.model import MachineModel

DESCRIPTION = """
[machine]
name = "plate"
[materials.steel]
conductivity = "50 W/(m*K)"
density = "8000 kg/m^3"
heat_capacity = "500 J/(kg*K)"
[parts.plate]
material = "steel"
adiabatic = ["z_min"]
box = { origin = [0.0, 0.0, 0.0], size = [0.5, 1.0, 0.05], divisions = [3, 6, 2] }
[environment.shop]
temperature = "20 degC"
[sources.heater]
law = "constant_heat"
surface = "plate.z_min"
parameters = { power = "1 kW" }
[films.air]
law = "constant_film"
emissivity = 0.0
surfaces = ["plate.*"]
environment = "shop"
parameters = { natural = "10 W/(m^2*K)" }
[sensors.top]
part = "plate"
position = [0.25, 0.5, 0.05]
"""
SECONDS, STEP = 36_000.0, 60.0
FINER = 4  # steps of the reference in one; how much that matters is printed


def surface(model: MachineModel, substeps: int, finer: int) -> np.ndarray:
    """Temperatures (n_steps, m) degC of the vertices of the surface at every full minute."""
    (body,) = model.bodies
    assert body.F is not None
    stepper = CoupledStepper(model)
    drive = evaluate(model.load_model, np.array([0.0, SECONDS]), {}, STEP)
    made = stepper.run(split(drive, finer), stepper.uniform(20.0), substeps)
    return model.reference_temperature + np.array([body.F @ x[0] for k, x, _ in made if (k + 1) % finer == 0])


def main() -> None:
    options = BuildOptions()
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "machine.toml"
        path.write_text(DESCRIPTION, encoding="utf-8")
        machine = load_machine(path)
        full = full_model(machine, bar)
        compact = compact_model(machine, rich_model(machine, full, options.rich, bar), options, bar)
        finer = assemble_meshed(machine, tuple(body_mesh(b.name, tuple(map(refined, b.parts))) for b in full.bodies))
    substeps = enough_substeps(compact, machine.limits, options)
    ours, coarse = surface(compact, substeps, 1), surface(full.thermal, 1, FINER)
    exact, halved = (surface(finer.thermal, 1, n)[:, _same(full, finer)] for n in (FINER, FINER // 2))
    error = np.abs(ours - exact)
    minute, where = np.unravel_index(error.argmax(), error.shape)
    x, y, z = full.surfaces[0].points[where]
    print(f"   {full.thermal.n} nodes, {compact.n} states, steps of {STEP / substeps:g} s: at most {error.max():.4f} K "
          f"anywhere on the surface at any minute of {SECONDS:.0f} s (at {x:.2f}, {y:.2f}, {z:.2f} m after "
          f"{minute + 1} min), at a rise of {np.ptp(exact):.1f} K")  # fmt: skip
    print(f"   against {finer.thermal.n} nodes in steps of {STEP / FINER:g} s, which steps twice as long change by "
          f"{np.abs(halved - exact).max():.4f} K; the mesh of {full.thermal.n} nodes is "
          f"{np.abs(coarse - exact).max():.4f} K from it in equal steps")  # fmt: skip


def _same(coarse: FullModel, fine: FullModel) -> np.ndarray:
    """Which vertices of the finer surface are those of the coarser one."""
    distance, index = cKDTree(fine.surfaces[0].points).query(coarse.surfaces[0].points)
    assert distance.max() < 1e-9
    return np.asarray(index)
