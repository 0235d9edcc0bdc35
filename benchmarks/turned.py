"""The five-axis machine with swivel and table turned, against its meshes turned and put together anew.

Warm as at the end of scenarios that a certificate draws, at random positions and angles. Bearings are octagons, which
lie on each other only eight times a turn: some of what differs is the outline.
"""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import full, machine
from twin.build.mesh import BodyMesh, body_mesh, part_mesh
from twin.build.pipeline import positions_off_grid
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.build.structure import Structure, assemble_structure
from twin.machine.description import Machine
from twin.machine.turning import turning_axes
from twin.rom.parallel import rotated

CASES, SEED = 5, 26


def main() -> None:
    whole, described = full(), machine()
    model, structure = whole.thermal, whole.structure
    assert isinstance(structure, Structure)
    stepper = CoupledStepper(model)
    places = positions_off_grid(model, SEED)[:CASES]
    names, n = (*model.pose_axes, *model.turning), len(model.pose_axes)
    told = []
    for k, place in enumerate(places):
        drive = draw(model.load_model, SEED + k, hours=1.0).drive
        x = stepper.steady_state(drive, drive.n_steps - 1)
        angles = dict(zip(model.turning, place[n:], strict=True))
        turned = assemble_structure(described, meshed_as_turned(described, whole.bodies, angles))
        linear = dict(zip(model.pose_axes, place[:n], strict=True))
        wanted, ours, straight = (
            turned.displacement(linear, x),
            structure.displacement(dict(zip(names, place, strict=True)), x),
            structure.displacement(linear, x),
        )
        told.append(np.abs([ours - wanted, straight - wanted, wanted]))
        at = ", ".join(f"{name} {np.rad2deg(v):.0f} deg" for name, v in angles.items())
        numbers = "  ".join(f"{1e6 * v:7.2f}" for v in (*wanted, *(ours - wanted)))
        print(f"   {at:<22} dx dy dz, error of each [um]: {numbers}")
    error, without, size = np.array(told).max(axis=(0, 2)) * 1e6
    print(f"   largest error {error:.2f} um of {size:.1f} um; with rotary axes left at zero {without:.1f} um")


def meshed_as_turned(
    described: Machine, bodies: tuple[BodyMesh, ...], angles: dict[str, float]
) -> tuple[BodyMesh, ...]:
    """The meshes with their nodes where rotary axes at angles [rad] bring them, the outermost axis first."""
    found = []
    for body in bodies:
        parts = []
        for part in body.parts:
            x = part.mesh.p.T
            for t in reversed(turning_axes(described)):
                if part.name in t.parts:
                    axis = described.axes[t.axis]
                    R = rotated(angles[t.axis] * np.array(axis.direction) / np.linalg.norm(axis.direction))
                    x = np.array(axis.point) + (x - axis.point) @ R.T
            mesh = type(part.mesh)(np.ascontiguousarray(x.T), part.mesh.t)
            parts.append(part_mesh(part.name, mesh, part.surfaces))
        found.append(body_mesh(body.name, tuple(parts)))
    return tuple(found)
