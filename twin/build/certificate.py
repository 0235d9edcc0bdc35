"""The certificate: maximum error per output over held-out scenarios, the box it was tested in.

"Scenario-certified": with N exchangeable held-out scenarios a new one exceeds the observed maximum with probability
<= 1/(N + 1) (Vovk et al. 2005, conformal prediction); N = 19 gives 95 %. It is no bound: the rigorous energy-norm
residual bound overestimates by 45 to 65,000 here and would be ignored. Outside the box every result is flagged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from twin.build.scenario import Scenario
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.rom.model import MachineModel


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


def compare(
    reference: MachineModel,
    candidate: MachineModel,
    scenarios: Sequence[Scenario],
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Step both models through the scenarios and, at their ends, to the steady state of the last loads."""
    a, b = CoupledStepper(reference), CoupledStepper(candidate)
    rows = []
    for scenario in scenarios:
        drive = scenario.drive
        T_err, u_err = np.zeros(len(reference.sensors)), np.zeros((len(reference.poses), 3))
        T_low, T_high = np.full_like(T_err, np.inf), np.full_like(T_err, -np.inf)
        u_low, u_high = np.full_like(u_err, np.inf), np.full_like(u_err, -np.inf)

        def account(xa: list[np.ndarray], xb: list[np.ndarray]) -> None:
            T, u = sensor_temperatures(reference, xa), tcp_at_poses(reference, xa)
            np.maximum(T_err, np.abs(T - sensor_temperatures(candidate, xb)), out=T_err)  # noqa: B023
            np.maximum(u_err, np.abs(u - tcp_at_poses(candidate, xb)), out=u_err)  # noqa: B023
            for value, low, high in ((T, T_low, T_high), (u, u_low, u_high)):  # noqa: B023
                np.minimum(low, value, out=low)
                np.maximum(high, value, out=high)

        runs = zip(
            a.run(drive, a.uniform(scenario.start)), b.run(drive, b.uniform(scenario.start)), strict=True
        )
        for (_, xa, _), (_, xb, _) in runs:
            account(xa, xb)
        last = drive.n_steps - 1
        account(a.steady_state(drive, last), b.steady_state(drive, last))
        rows.append((T_err, u_err, T_low, T_high, u_low, u_high))
        progress(scenario.label)
    T_err, u_err, T_low, T_high, u_low, u_high = (np.array(column) for column in zip(*rows, strict=True))
    return Comparison(tuple(s.label for s in scenarios), T_err, u_err, T_low, T_high, u_low, u_high)


@dataclass(frozen=True)
class Certificate:
    """What the artefact claims about itself; errors are compact against full where known, else against rich."""

    scenarios: tuple[str, ...]
    full_scenarios: tuple[str, ...]  # those on which the rich model was compared with the full one
    confidence: float  # N/(N + 1)
    hours: float
    step: float  # s
    sensors: tuple[str, ...]
    temperature_error: tuple[float, ...]  # K per sensor: compact-rich maximum plus rich-full maximum
    temperature_range: tuple[float, ...]  # K per sensor over all scenarios
    displacement_error: tuple[tuple[float, float, float], ...]  # m per pose and axis, same sum
    displacement_range: tuple[tuple[float, float, float], ...]
    worst_temperature: str  # "sensor T07 in seed 3: ..."
    worst_displacement: str
    rich_temperature_error: float  # K, rich against full, maximum
    rich_displacement_error: float  # m
    limit_temperature: float
    limit_displacement: float

    @property
    def max_temperature_error(self) -> float:
        return max(self.temperature_error, default=0.0)

    @property
    def max_displacement_error(self) -> float:
        return max((e for row in self.displacement_error for e in row), default=0.0)

    @property
    def worst_relative(self) -> float:
        """The largest error of any output as a share of that output's own range."""
        error = np.concatenate([np.ravel(self.temperature_error), np.ravel(self.displacement_error)])
        span = np.concatenate([np.ravel(self.temperature_range), np.ravel(self.displacement_range)])
        return float((error / span).max())

    @property
    def passed(self) -> bool:
        return (
            self.max_temperature_error <= self.limit_temperature
            and self.max_displacement_error <= self.limit_displacement
        )

    def to_json(self) -> dict:
        return asdict(self)


def certify(
    model: MachineModel,
    compact: Comparison,
    rich: Comparison | None,
    limits: tuple[float, float],
    hours: float,
    step: float,
) -> Certificate:
    """Certificate from compact-against-rich (all scenarios) and rich-against-full (some). limits: (K, m)."""
    T, u = compact.temperature_error.max(axis=0), compact.displacement_error.max(axis=0)
    if rich is not None:
        T, u = T + rich.temperature_error.max(axis=0), u + rich.displacement_error.max(axis=0)
    s, j = np.unravel_index(compact.temperature_error.argmax(), compact.temperature_error.shape)
    k, p, c = np.unravel_index(compact.displacement_error.argmax(), compact.displacement_error.shape)
    place = ", ".join(f"{a} {1e3 * v:.0f} mm" for a, v in zip(model.pose_axes, model.poses[p], strict=True))
    return Certificate(
        scenarios=compact.labels,
        full_scenarios=rich.labels if rich is not None else (),
        confidence=len(compact.labels) / (len(compact.labels) + 1),
        hours=hours,
        step=step,
        sensors=model.sensors,
        temperature_error=tuple(T.tolist()),
        temperature_range=tuple(compact.temperature_range.tolist()),
        displacement_error=tuple(map(tuple, u.tolist())),
        displacement_range=tuple(map(tuple, compact.displacement_range.tolist())),
        worst_temperature=f"sensor {model.sensors[j]} in {compact.labels[s]}",
        worst_displacement=f"d{'xyz'[c]} at {place} in {compact.labels[k]}",
        rich_temperature_error=float(rich.temperature_error.max()) if rich is not None else float("nan"),
        rich_displacement_error=float(rich.displacement_error.max()) if rich is not None else float("nan"),
        limit_temperature=limits[0],
        limit_displacement=limits[1],
    )
