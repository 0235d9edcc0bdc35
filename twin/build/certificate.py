"""The certificate: maximum error per output over held-out scenarios, the box it was tested in.

"Scenario-certified": with N exchangeable held-out scenarios a new one exceeds the observed maximum of any one quantity
with probability <= 1/(N + 1) (Vovk et al. 2005, conformal prediction); N = 19 gives 95 %. This holds for compact
against rich; rich against full, added from a few scenarios chosen by cost, is a check without a probability. It is no
bound: the rigorous energy-norm residual bound overestimates by 45 to 65,000 here and would be ignored. Outside the box
every result is flagged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from twin.build.scenario import Scenario
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.build.workers import LONG, each
from twin.machine.description import Limits
from twin.rom.model import MachineModel

TINY = 1e-12  # K or m: an output that does not move at all has no relative error


@dataclass(frozen=True)
class Comparison:
    """Maximum error of `candidate` against `reference` per scenario and output; both stepped alike."""

    labels: tuple[str, ...]
    temperature_error: np.ndarray  # (n_scenarios, n_sensors) K
    displacement_error: np.ndarray  # (n_scenarios, n_poses, 3) m
    temperature_low: np.ndarray  # (n_scenarios, n_sensors) degC, of the reference
    temperature_high: np.ndarray
    displacement_low: np.ndarray  # (n_scenarios, n_poses, 3) m, of the reference
    displacement_high: np.ndarray

    @property
    def temperature_range(self) -> np.ndarray:
        """(n_sensors,) K over all scenarios."""
        return self.temperature_high.max(axis=0) - self.temperature_low.min(axis=0)

    @property
    def displacement_range(self) -> np.ndarray:
        """(n_poses, 3) m over all scenarios."""
        return self.displacement_high.max(axis=0) - self.displacement_low.min(axis=0)

    @property
    def temperature_case(self) -> np.ndarray:
        """(n_scenarios,) K: the size of each scenario: largest change of any sensor, steady state included."""
        return (self.temperature_high - self.temperature_low).max(axis=1, initial=0.0)

    @property
    def displacement_case(self) -> np.ndarray:
        """(n_scenarios,) m: the largest change of the TCP displacement at any pose in each scenario."""
        return (self.displacement_high - self.displacement_low).max(axis=(1, 2), initial=0.0)

    def scaled(self, limits: Limits) -> tuple[np.ndarray, np.ndarray]:
        """Maximum error per sensor (n_sensors,) K and TCP row (n_poses, 3) m with every scenario scaled to the case.

        Exact for scenarios with given films, because the models are linear in loads and air temperatures then: the
        scenario with all of them scaled has all responses and errors scaled. An estimate where films follow the
        surface: scaled loads have other films, in both models alike.
        """
        T = self.temperature_error * (limits.at_temperature_range / np.maximum(self.temperature_case, TINY))[:, None]
        u = (
            self.displacement_error
            * (limits.at_displacement_range / np.maximum(self.displacement_case, TINY))[:, None, None]
        )
        return T.max(axis=0), u.max(axis=0)


def compare(
    reference: MachineModel,
    candidate: MachineModel,
    scenarios: Sequence[Scenario],
    substeps: int = 4,
    progress: Callable[[str], None] = lambda _: None,
    long: float = LONG,
) -> Comparison:
    """Step both models through the scenarios and, at their ends, to the steady state of the last loads.

    substeps: implicit Euler steps per step, as many as the runtime takes: short steps excite faster modes. long: s of
    work left that are worth another process (`twin.build.workers`); the result does not depend on it.
    """
    pair = (CoupledStepper(reference), CoupledStepper(candidate), substeps)
    rows = each(_compared, pair, scenarios, lambda scenario: progress(scenario.label), long)
    T_err, u_err, T_low, T_high, u_low, u_high = (np.array(column) for column in zip(*rows, strict=True))
    return Comparison(tuple(s.label for s in scenarios), T_err, u_err, T_low, T_high, u_low, u_high)


def _compared(pair: tuple[CoupledStepper, CoupledStepper, int], scenario: Scenario) -> tuple[np.ndarray, ...]:
    """Largest errors and the range of the reference in one scenario: the columns of `Comparison` after the labels."""
    a, b, substeps = pair
    reference, candidate, drive = a.model, b.model, scenario.drive
    T_err, u_err = np.zeros(len(reference.sensors)), np.zeros((len(reference.poses), 3))
    T_low, T_high = np.full_like(T_err, np.inf), np.full_like(T_err, -np.inf)
    u_low, u_high = np.full_like(u_err, np.inf), np.full_like(u_err, -np.inf)

    def account(xa: list[np.ndarray], xb: list[np.ndarray]) -> None:
        T, u = sensor_temperatures(reference, xa), tcp_at_poses(reference, xa)
        np.maximum(T_err, np.abs(T - sensor_temperatures(candidate, xb)), out=T_err)
        np.maximum(u_err, np.abs(u - tcp_at_poses(candidate, xb)), out=u_err)
        for value, low, high in ((T, T_low, T_high), (u, u_low, u_high)):
            np.minimum(low, value, out=low)
            np.maximum(high, value, out=high)

    for stepper in (a, b):
        stepper.forget()
    runs = zip(
        a.run(drive, a.uniform(scenario.start), substeps),
        b.run(drive, b.uniform(scenario.start), substeps),
        strict=True,
    )
    for (_, xa, _), (_, xb, _) in runs:
        account(xa, xb)
    last = drive.n_steps - 1
    account(a.steady_state(drive, last), b.steady_state(drive, last))
    for stepper in (a, b):
        stepper.forget()  # factors of a full model need not wait for the next scenario
    return T_err, u_err, T_low, T_high, u_low, u_high


@dataclass(frozen=True)
class Certificate:
    """What the artefact claims about itself. Errors are compact-rich plus, after `twin verify`, rich-full maxima."""

    scenarios: tuple[str, ...]
    full_scenarios: tuple[str, ...]  # those on which the rich model was compared with the full one
    confidence: float  # N/(N + 1)
    hours: float
    step: float  # s
    substeps: int  # implicit Euler steps per step
    sensors: tuple[str, ...]
    case_temperature: float  # K: size of the case the limits are for
    case_displacement: float  # m
    limit_temperature: float  # K
    limit_displacement: float  # m
    limit_relative: float  # of an output's own range
    temperature_error_in_case: tuple[float, ...]  # K per sensor, every scenario scaled to the case
    displacement_error_in_case: tuple[tuple[float, float, float], ...]  # m per pose and axis
    temperature_error: tuple[float, ...]  # K per sensor as drawn, anywhere in the certified box
    temperature_range: tuple[float, ...]  # K per sensor over all scenarios
    displacement_error: tuple[tuple[float, float, float], ...]  # m per pose and axis as drawn
    displacement_range: tuple[tuple[float, float, float], ...]
    worst_temperature: str  # "sensor T07 in seed 3: ...", as drawn
    worst_displacement: str
    rich_temperature_error: float | None  # K in the case, rich against full; None before `twin verify`
    rich_displacement_error: float | None  # m

    @property
    def max_temperature_error(self) -> float:
        """K, in the case."""
        return max(self.temperature_error_in_case, default=0.0)

    @property
    def max_displacement_error(self) -> float:
        """m, in the case."""
        return max((e for row in self.displacement_error_in_case for e in row), default=0.0)

    @property
    def worst_relative(self) -> float:
        """The largest error of any output as a share of that output's own range."""
        error = np.concatenate([np.ravel(self.temperature_error), np.ravel(self.displacement_error)])
        span = np.concatenate([np.ravel(self.temperature_range), np.ravel(self.displacement_range)])
        return float((error / np.maximum(span, TINY)).max(initial=0.0))

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
            "worst_relative": self.worst_relative,
            "passed": self.passed,
        }


def certify(
    model: MachineModel,
    compact: Comparison,
    rich: Comparison | None,
    limits: Limits,
    hours: float,
    step: float,
    substeps: int,
) -> Certificate:
    """Certificate from compact-against-rich (all scenarios) and rich-against-full (some)."""
    T, u = compact.temperature_error.max(axis=0), compact.displacement_error.max(axis=0)
    T_case, u_case = compact.scaled(limits)
    rich_T = rich_u = None
    if rich is not None:
        T, u = T + rich.temperature_error.max(axis=0), u + rich.displacement_error.max(axis=0)
        T_rich, u_rich = rich.scaled(limits)
        T_case, u_case = T_case + T_rich, u_case + u_rich
        rich_T, rich_u = float(T_rich.max(initial=0.0)), float(u_rich.max(initial=0.0))
    return Certificate(
        scenarios=compact.labels,
        full_scenarios=rich.labels if rich is not None else (),
        confidence=len(compact.labels) / (len(compact.labels) + 1),
        hours=hours,
        step=step,
        substeps=substeps,
        sensors=model.sensors,
        case_temperature=limits.at_temperature_range,
        case_displacement=limits.at_displacement_range,
        limit_temperature=limits.temperature,
        limit_displacement=limits.displacement,
        limit_relative=limits.relative,
        temperature_error_in_case=tuple(T_case.tolist()),
        displacement_error_in_case=_rows(u_case),
        temperature_error=tuple(T.tolist()),
        temperature_range=tuple(compact.temperature_range.tolist()),
        displacement_error=_rows(u),
        displacement_range=_rows(compact.displacement_range),
        worst_temperature=_worst_sensor(model, compact),
        worst_displacement=_worst_pose(model, compact),
        rich_temperature_error=rich_T,
        rich_displacement_error=rich_u,
    )


def _rows(table: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in table)


def _worst_sensor(model: MachineModel, c: Comparison) -> str:
    if c.temperature_error.size == 0:
        return "no sensors"
    s, j = np.unravel_index(c.temperature_error.argmax(), c.temperature_error.shape)
    return f"sensor {model.sensors[j]} in {c.labels[s]}"


def _worst_pose(model: MachineModel, c: Comparison) -> str:
    s, p, axis = np.unravel_index(c.displacement_error.argmax(), c.displacement_error.shape)
    place = ", ".join(f"{a} {1e3 * v:.0f} mm" for a, v in zip(model.pose_axes, model.poses[p], strict=True))
    return f"d{'xyz'[axis]} at {place or 'the only pose'} in {c.labels[s]}"
