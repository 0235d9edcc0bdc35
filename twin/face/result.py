"""What a run yields: temperatures, TCP error, heat, with named dimensions; pictures; files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.face.inputs import Quantity, positive
from twin.face.labelled import Coordinates, labelled

if TYPE_CHECKING:
    import xarray

    from twin.face.model import Model
    from twin.face.plot import Plot
    from twin.run.results import Result as Numbers


@dataclass(frozen=True)
class Result:
    """A run on a model. Time counts in s as in the loads; displacements are tool side minus work side, in m."""

    model: Model
    numbers: Numbers = field(repr=False)  # the same as plain arrays
    facts: Mapping[str, Any] = field(repr=False)  # where it comes from, the head of summary.json

    @property
    def temperatures(self) -> xarray.DataArray:
        """(time, sensor) degC, at step ends."""
        return self._of(self.numbers.temperature, ("time", "sensor"), "temperatures", "degC", "temperature")

    @property
    def tcp(self) -> xarray.DataArray:
        """(time, one dimension per linear axis, component) m: the TCP error at every pose of the grid."""
        grid = self.model.artefact.model.pose_grid
        shape = (len(self.numbers.time), *(len(nodes) for nodes in grid), 3)
        dims = ("time", *self.numbers.pose_axes, "component")
        return self._of(self.numbers.tcp.reshape(shape), dims, "tcp", "m", "TCP error")

    @property
    def tcp_actual(self) -> xarray.DataArray:
        """(time, component) m: the TCP error where the axes are (of old artefacts interpolated between the poses)."""
        dims = ("time", "component")
        return self._of(self.numbers.tcp_actual, dims, "tcp_actual", "m", "TCP error at the actual position")

    @property
    def positions(self) -> xarray.DataArray:
        """(time, axis) m: where the axes are."""
        return self._of(self.numbers.position, ("time", "axis"), "positions", "m", "axis position")

    @property
    def heat(self) -> xarray.DataArray:
        """(step, source) W: the mean heat of every source in every step."""
        return self._of(self.numbers.power, ("step", "source"), "heat", "W", "heat of the sources")

    @property
    def balance_error(self) -> float:
        """The largest error of the heat balance (in = out + stored) of any step, as a share of the throughput."""
        return float(self.numbers.balance_error.max())

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Totals and extremes, what summary.json holds."""
        from twin.run.results import summary

        return {**self.facts, **summary(self.numbers)}

    @property
    def final_state(self) -> np.ndarray:
        """(N,) to go on from: `initial` of the next run, which takes the result itself, too."""
        return self.numbers.state

    @property
    def plot(self) -> Plot:
        """Pictures: `result.plot.workspace(at="4 h")`."""
        from twin.face.plot import Plot

        return Plot(self)

    def save(self, folder: str | Path) -> None:
        """Write result.h5, temperatures.csv, tcp.csv and summary.json. Raises TwinError for run folders."""
        from twin.run.results import write_results

        write_results(Path(folder), self.numbers, self.facts)

    def edge(self, at: Quantity | None) -> int:
        """The step end nearest to a time since the start ("4 h"), by default that of the largest TCP error."""
        n = self.numbers
        if at is None:
            return int(np.abs(n.tcp).max(axis=(1, 2)).argmax())
        return int(np.abs(n.time - n.time[0] - positive("at", at, "s", zero=True)).argmin())

    def __str__(self) -> str:
        told = self.summary
        largest = "no temperature moves the tool"
        if told["tcp"] is not None:
            worst = told["tcp"]["worst"]
            place = ", ".join(f"{axis} {1e3 * value:.0f} mm" for axis, value in worst["pose_m"].items())
            largest = (
                f"largest TCP error d{worst['component']} {1e6 * worst['value_m']:.1f} um after "
                f"{worst['time_s'] / 3600:.2f} h at {place or 'the only pose'}"
            )
        lines = [
            f"{told['steps']} steps of {told['step_s']:g} s; {largest}; "
            f"heat balance closes to {told['heat']['max_balance_error']:.1e} of the throughput"
        ]
        if not self.numbers.exact and len(self.numbers.poses) > 1:
            lines.append("TCP error at the actual position: interpolated, for the artefact is older; build it again")
        raised = {name: flag for name, flag in told["flags"].items() if flag["steps"]}
        if raised:
            lines.append(f"outside what was certified in {told['flagged_steps']} of {told['steps']} steps:")
            lines += [f"  {n}: {flag['steps']} steps, first at {flag['first_s']:g} s" for n, flag in raised.items()]
        return "\n".join(lines)

    def _of(self, values: np.ndarray, dims: tuple[str, ...], name: str, unit: str, long_name: str) -> xarray.DataArray:
        n = self.numbers
        known: Coordinates = {
            "time": (n.time, "s"),
            "step": (n.time[:-1], "s"),
            "sensor": (list(n.sensors), ""),
            "source": (list(n.sources), ""),
            "axis": (list(n.axes), ""),
            "component": (["x", "y", "z"], ""),
            **{
                axis: (nodes, "m") for axis, nodes in zip(n.pose_axes, self.model.artefact.model.pose_grid, strict=True)
            },
        }
        return labelled(values, dims, known, name, unit, long_name)
