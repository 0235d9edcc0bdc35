"""The certificate: maximum error per output over held-out scenarios, the box it was tested in, and where errors arise.

"Scenario-certified": with N exchangeable held-out scenarios a new one exceeds the observed maximum of any one quantity
with probability <= 1/(N + 1) (Vovk et al. 2005, conformal prediction); N = 19 gives 95 %. This holds for compact
against rich, and for the time step in shorter scenarios; rich against full, added from a few scenarios chosen by cost,
is a check without a probability. It is no bound: the rigorous energy-norm residual bound overestimates by 45 to 65,000
here and would be ignored. Outside the box every result is flagged.

Errors add up, about: |compact in steps - full in fine steps| ~ |compact in steps - compact in fine steps| + |compact -
rich| + |rich - full|, the last two in the runtime's steps. The first is that of the modes that the compact model has,
against a reference in finite steps: it is enlarged by what halving these changes (`in_finer_steps`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from twin.build.comparison import FINER, TINY, Comparison
from twin.machine.description import Limits
from twin.rom.model import MachineModel

# names of parts
REDUCTION, STEP, RICH, POSES, MESH = "reduction", "time step", "rich basis", "poses", "mesh"


@dataclass(frozen=True)
class Part:
    """A part of the error: a comparison over held-out scenarios, and whether it counts in the sum that limits are for.

    The mesh does not: its error is that of the full model, which the reduced one is measured by.
    """

    name: str
    between: str  # "compact against rich"
    errors: Comparison
    counts: bool = True


@dataclass(frozen=True)
class PartError:
    """What a part contributes in the case."""

    name: str
    between: str
    counts: bool
    scenarios: tuple[str, ...]
    temperature_error_in_case: tuple[float, ...]  # K per sensor
    displacement_error_in_case: tuple[float, float, float]  # m along x, y, z, at the worst pose


@dataclass(frozen=True)
class Certificate:
    """What the artefact claims about itself. Errors are the sums of the parts that count."""

    scenarios: tuple[str, ...]
    full_scenarios: tuple[str, ...]  # those on which the rich model was compared with the full one
    confidence: float  # N/(N + 1)
    hours: float
    step: float  # s
    substeps: int  # of the time integrator per step
    finest_step: float  # s: of the integrator, that the steps were compared with
    step_halved: float  # share of the time step's error by which it changes when the reference's steps are halved
    sensors: tuple[str, ...]
    case_temperature: float  # K: size of the case the limits are for
    case_displacement: float  # m
    limit_temperature: float  # K
    limit_displacement: float  # m
    limit_relative: float  # of an output's own range, where that is above the limit of its error
    temperature_error_in_case: tuple[float, ...]  # K per sensor, every scenario scaled to the case
    displacement_error_in_case: tuple[tuple[float, float, float], ...]  # m per pose and axis
    positions: tuple[tuple[float, ...], ...]  # m of the axes: random ones, between the poses of the grid
    displacement_error_at_positions: tuple[tuple[float, float, float], ...]  # m per position and axis, as drawn
    displacement_error_at_positions_in_case: tuple[tuple[float, float, float], ...]
    temperature_error: tuple[float, ...]  # K per sensor as drawn, anywhere in the certified box
    temperature_range: tuple[float, ...]  # K per sensor over all scenarios
    displacement_error: tuple[tuple[float, float, float], ...]  # m per pose and axis as drawn
    displacement_range: tuple[tuple[float, float, float], ...]
    temperature_range_in_case: tuple[float, ...]  # K per sensor, all scenarios together scaled to it
    displacement_range_in_case: tuple[tuple[float, float, float], ...]  # m per pose and axis
    worst_relative: float  # largest error, as drawn, of any output as a share of its own range: `relative_errors`
    worst_relative_output: str  # "dy at x 100 mm", the one that it is of
    worst_temperature: str  # "sensor T07 in seed 3: ...", as drawn
    worst_displacement: str
    worst_temperature_in_case: str  # "sensor T07": where the sum of the parts is largest in the case
    worst_displacement_in_case: str  # "dx at x 100 mm"
    parts: tuple[PartError, ...]

    @property
    def max_temperature_error(self) -> float:
        """K, in the case."""
        return max(self.temperature_error_in_case, default=0.0)

    @property
    def max_displacement_error(self) -> float:
        """m, in the case, at any pose and any of the positions between them."""
        rows = (*self.displacement_error_in_case, *self.displacement_error_at_positions_in_case)
        return max((e for row in rows for e in row), default=0.0)

    @property
    def passed(self) -> bool:
        return (
            self.max_temperature_error <= self.limit_temperature
            and self.max_displacement_error <= self.limit_displacement
            and self.worst_relative <= self.limit_relative
        )

    def to_json(self) -> dict[str, Any]:
        """JSON values, with the derived figures."""
        return asdict(self) | {
            "max_temperature_error_in_case": self.max_temperature_error,
            "max_displacement_error_in_case": self.max_displacement_error,
            "passed": self.passed,
        }


def certify(
    model: MachineModel,
    parts: Sequence[Part],
    limits: Limits,
    hours: float,
    step: float,
    substeps: int,
    step_halved: float,
    positions: np.ndarray,
) -> Certificate:
    """Certificate from the parts of the error; the first one is compact against rich, on all scenarios.

    positions: (m, n_axes) m, perhaps with angles [rad] behind; the comparisons have the displacement at the poses of
    the grid, then there.
    """
    compact, counted = parts[0].errors, [part.errors for part in parts if part.counts]
    T = np.sum([c.temperature_error.max(axis=0) for c in counted], axis=0)
    u = np.sum([c.displacement_error.max(axis=0) for c in counted], axis=0)
    T_case, u_case = (np.sum(errors, axis=0) for errors in zip(*(c.scaled(limits) for c in counted), strict=True))
    T_range, u_range = compact.range_in_case(limits)
    n, places = len(model.poses), [*model.poses, *positions]
    made = [_part_error(part, limits, n) for part in parts]
    if len(positions):
        # what positions between the poses add to the errors at the poses
        x, y, z = np.maximum(u_case[n:].max(axis=0) - u_case[:n].max(axis=0), 0.0).tolist()
        between = f"at {len(positions)} random positions, beyond the poses of the grid"
        made.append(PartError(POSES, between, True, compact.labels, (0.0,) * len(model.sensors), (x, y, z)))
    full = [part.errors.labels for part in parts if part.name == RICH]
    shares = (
        relative_errors(T, compact.temperature_range, T_range, limits.temperature),
        relative_errors(u, compact.displacement_range, u_range, limits.displacement),
    )
    return Certificate(
        scenarios=compact.labels,
        full_scenarios=full[0] if full else (),
        confidence=len(compact.labels) / (len(compact.labels) + 1),
        hours=hours,
        step=step,
        substeps=substeps,
        finest_step=step / substeps / FINER,
        step_halved=step_halved,
        sensors=model.sensors,
        case_temperature=limits.at_temperature_range,
        case_displacement=limits.at_displacement_range,
        limit_temperature=limits.temperature,
        limit_displacement=limits.displacement,
        limit_relative=limits.relative,
        temperature_error_in_case=tuple(T_case.tolist()),
        displacement_error_in_case=_rows(u_case[:n]),
        positions=tuple(tuple(row) for row in positions.tolist()),
        displacement_error_at_positions=_rows(u[n:]),
        displacement_error_at_positions_in_case=_rows(u_case[n:]),
        temperature_error=tuple(T.tolist()),
        temperature_range=tuple(compact.temperature_range.tolist()),
        displacement_error=_rows(u[:n]),
        displacement_range=_rows(compact.displacement_range[:n]),
        temperature_range_in_case=tuple(T_range.tolist()),
        displacement_range_in_case=_rows(u_range[:n]),
        worst_relative=max(float(share.max(initial=0.0)) for share in shares),
        worst_relative_output=_worst_output(model, places, *shares),
        worst_temperature=_worst_sensor(model, compact),
        worst_displacement=_worst_pose(model, places, compact),
        worst_temperature_in_case=f"sensor {model.sensors[int(T_case.argmax())]}" if T_case.size else "no sensors",
        worst_displacement_in_case=_tcp_row(model, places[int(u_case.argmax()) // 3], int(u_case.argmax()) % 3),
        parts=tuple(made),
    )


def with_part(known: Certificate, part: Part, limits: Limits) -> Certificate:
    """The certificate with one more part that does not count; in the place of one of the same name."""
    others = tuple(p for p in known.parts if p.name != part.name)
    return replace(known, parts=(*others, _part_error(part, limits, len(known.displacement_error))))


def known_parts(stored: Mapping[str, Any], name: str) -> tuple[PartError, ...]:
    """The parts of a name in the figures of a stored certificate."""
    return tuple(
        PartError(
            part["name"], part["between"], bool(part["counts"]), tuple(part["scenarios"]),
            tuple(map(float, part["temperature_error_in_case"])),
            _rows(np.asarray([part["displacement_error_in_case"]]))[0],
        )
        for part in stored.get("parts", ()) if part["name"] == name
    )  # fmt: skip


def _part_error(part: Part, limits: Limits, n_poses: int) -> PartError:
    T, u = part.errors.scaled(limits)
    x, y, z = u[:n_poses].max(axis=0, initial=0.0).tolist()
    return PartError(part.name, part.between, part.counts, part.errors.labels, tuple(T.tolist()), (x, y, z))


def relative_errors(error: np.ndarray, span: np.ndarray, in_case: np.ndarray, limit: float) -> np.ndarray:
    """Errors as shares of the outputs' own ranges, zero for outputs that move less in the case than their error may be.

    An output that moves less is zero within the accuracy that is asked for: how far a symmetric machine bends to its
    side is a matter of how its mesh is numbered, and a share of it means nothing.
    """
    return np.where(in_case > limit, error / np.maximum(span, TINY), 0.0)


def _rows(table: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in table)


def _worst_sensor(model: MachineModel, c: Comparison) -> str:
    if c.temperature_error.size == 0:
        return "no sensors"
    s, j = np.unravel_index(c.temperature_error.argmax(), c.temperature_error.shape)
    return f"sensor {model.sensors[j]} in {c.labels[s]}"


def _worst_pose(model: MachineModel, places: Sequence[np.ndarray], c: Comparison) -> str:
    s, p, axis = np.unravel_index(c.displacement_error.argmax(), c.displacement_error.shape)
    return f"{_tcp_row(model, places[int(p)], int(axis))} in {c.labels[s]}"


def _worst_output(
    model: MachineModel, places: Sequence[np.ndarray], temperatures: np.ndarray, displacements: np.ndarray
) -> str:
    """The output with the largest relative error; empty where none counts."""
    sensor, row = temperatures.max(initial=0.0), displacements.max(initial=0.0)
    if max(sensor, row) == 0.0:
        return ""
    if sensor >= row:
        return f"sensor {model.sensors[int(temperatures.argmax())]}"
    p, axis = np.unravel_index(displacements.argmax(), displacements.shape)
    return _tcp_row(model, places[int(p)], int(axis))


def _tcp_row(model: MachineModel, at: np.ndarray, axis: int) -> str:
    n = len(model.pose_axes)
    place = [f"{a} {1e3 * v:.0f} mm" for a, v in zip(model.pose_axes, at[:n], strict=True)]
    place += [f"{a} {np.rad2deg(v):.0f} deg" for a, v in zip(model.turning, at[n:], strict=False)]
    return f"d{'xyz'[axis]} at {', '.join(place) or 'the only pose'}"
