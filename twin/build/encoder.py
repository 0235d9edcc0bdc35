"""What a linear scale changes: the control keeps the reader at the scale's mark, whatever the screw does.

Paper 004, eq (27), with the signs of erratum E-004-6. e(position) = actual - indicated, tool relative to workpiece.
Without a scale, the nut on the screw is the axial datum of all that the axis carries. With one, the reader must stay
at its mark, so the carried side, further axes included, moves as a whole along the axis by

    -r,   r = u_reader - (u_fix + int_fix^s alpha_s (T_s - T_ref) dx)        (the reader is carried)
    +r                                                                      (the scale is carried)

u_reader: axial displacement of the reader's patch, carried rigidly to the scale's line; u_fix: of the scale's host at
the scale's fixing point; s: the coordinate on the scale that faces the reader at the pose; T_s: the host's temperature
under the scale. The scale grows from its fixing point and slides on its host elsewhere. The shift strains nothing where
the drive alone holds the carried side along the axis (`twin.machine.encoders` refuses guides that do so too), so this
is exact, and linear in temperature: it changes the rows of the TCP and nothing else.

A warm scale lets the tool go too far (+), if the axis carries the tool; if it carries the work, tool minus work changes
its sign.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from twin.build.elastic_ports import PortTable, fitted_slope
from twin.build.mesh import BodyMesh
from twin.errors import DescriptionError, Problem
from twin.machine.description import Machine
from twin.machine.kinematics import direction, displacement, linear_axes
from twin.rom.scales import LinearEncoder, ScaleStrip

SLICES = 24  # along a scale: means over whole slices are exact, only within a slice is a field taken as linear

FAR = 0.1  # m between a reader and its scale's line


@dataclass(frozen=True)
class EncoderTerms:
    """The parts of an axis' error e(position) = actual - indicated along the axis, tool relative to workpiece [m].

    Paper 004, eq (27). The first two depend on where the nut stands on the screw, their sum does not.
    """

    tcp: float  # of the TCP with the nut as datum: all there is with a rotary encoder
    reader: float  # the reader's motion relative to the scale's fixing point
    scale: float  # the scale's own growth

    @property
    def total(self) -> float:
        return self.tcp + self.reader + self.scale

    def __str__(self) -> str:
        parts = ", ".join(f"{name} {getattr(self, name) * 1e6:+.2f}" for name in ("tcp", "reader", "scale"))
        return f"{self.total * 1e6:+.2f} um ({parts})"


def linear_encoders(
    machine: Machine, ports: PortTable, shifts: np.ndarray, slices: int = SLICES
) -> tuple[LinearEncoder, ...]:
    """The linear scales of a machine; adds the ports they need to `ports`.

    shifts (n_bodies, n_axes, 3): translation of a body per axis position. Raises DescriptionError: surfaces that do not
    exist, a fixing point off the scale, a scale shorter than the stroke.
    """
    found = []
    for k, name in enumerate(linear_axes(machine)):
        encoder = machine.axes[name].encoder
        if encoder.kind != "linear":
            continue
        where = f"axes.{name}.encoder"
        assert encoder.scale is not None, "the description was not checked"
        assert encoder.reader is not None, "the description was not checked"
        along = direction(machine, name)
        body, offset, pieces = ports.slices(encoder.scale, along, slices)
        reader = ports.rigid(encoder.reader)
        nodes = np.unique(np.concatenate([p.nodes for p in pieces]))
        mean, slope = np.zeros((2, len(pieces), len(nodes)))
        for i, p in enumerate(pieces):
            columns = np.searchsorted(nodes, p.nodes)
            mean[i, columns], slope[i, columns] = p.mean, fitted_slope(p, along)
        borders = ports.extent(encoder.scale, along, slices)
        slack = 1e-6 * (borders[-1] - borders[0])
        if not borders[0] - slack <= encoder.fixed_at <= borders[-1] + slack:
            raise DescriptionError(
                f"the scale is fixed at {encoder.fixed_at:g} m, but '{encoder.scale}' reaches from {borders[0]:.4g} to"
                f" {borders[-1]:.4g} m along axis '{name}'",
                f"{where}.fixed_at",
                "give a coordinate of the scale along the axis, machine coordinates, all axes at zero",
            )
        holds = int(np.clip(np.searchsorted(borders, encoder.fixed_at, side="right") - 1, 0, slices - 1))
        found.append(
            LinearEncoder(
                axis=k,
                along=along,
                sign=-1.0 if (shifts[reader.body, k] != 0).any() else 1.0,
                reader=reader,
                fixing=ports.axial(encoder.scale, along, encoder.fixed_at, pieces[holds]),
                fixed_at=encoder.fixed_at,
                expansion=encoder.expansion,
                strip=ScaleStrip(
                    body, nodes + offset, borders, np.array([p.centroid @ along for p in pieces]), mean, slope
                ),
            )
        )
        for position in machine.axes[name].stroke:
            at = found[-1].facing(position * (shifts[reader.body, k] - shifts[body, k]))
            if not borders[0] - slack <= at <= borders[-1] + slack:
                raise DescriptionError(
                    f"at {position:g} m the reader faces {at:.4g} m along axis '{name}', where '{encoder.scale}' with"
                    f" its {borders[0]:.4g} .. {borders[-1]:.4g} m has no scale",
                    where,
                    "name a surface that is as long as the stroke, the reader's own, or shorten the stroke",
                )
    return tuple(found)


def scale_gaps(machine: Machine, bodies: tuple[BodyMesh, ...]) -> Iterator[Problem]:
    """Warnings for readers that are far from their scales: their tilt counts over that distance.

    Raises DescriptionError like `linear_encoders`.
    """
    axes = linear_axes(machine)
    shifts = np.array([[displacement(machine, b.name, {a: 1.0}) for a in axes] for b in bodies])
    for e in linear_encoders(machine, PortTable(bodies), shifts.reshape(len(bodies), len(axes), 3)):
        across = e.reader.centroid - e.fixing.point
        gap = float(np.linalg.norm(across - (across @ e.along) * e.along))
        if gap > FAR:
            encoder = machine.axes[axes[e.axis]].encoder
            yield Problem(
                f"the middle of '{encoder.reader}' is {gap * 1e3:.3g} mm beside the scale's line on '{encoder.scale}'",
                f"axes.{axes[e.axis]}.encoder",
                "name the small surface that carries the reading head: its tilt counts over this distance",
                warning=True,
            )
