"""Pictures of a result: matplotlib figures, which a notebook shows as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from twin.errors import TwinError
from twin.face.inputs import Quantity, positive

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from twin.face.result import Result
    from twin.machine.description import Machine
    from twin.pictures.result import Drawn


@dataclass(frozen=True)
class Plot:
    """Every method draws one figure. Raises TwinError where there is nothing to draw."""

    result: Result

    def temperatures(self) -> Figure:
        """Temperatures at the sensors over time; those that change most stand out."""
        from twin.pictures.temperatures import temperature_figure

        drawn = self._drawn
        air = [name for name, _ in self.result.model.artefact.model.ambient_sensors]
        return temperature_figure(drawn.hours, drawn.temperature, drawn.sensors, air)

    def tcp(self) -> Figure:
        """The TCP error over time: at every pose, in the middle of the workspace, and where the axes are."""
        from twin.pictures.tcp_error import tcp_figure

        self._refuse_still()
        drawn = self._drawn
        return tcp_figure(drawn.hours, drawn.tcp_actual, drawn.tcp, drawn.middle, drawn.outside)

    def workspace(self, at: Quantity | None = None) -> Figure:
        """The distorted workspace at a time since the start ("4 h"), by default when it is distorted most."""
        from twin.pictures.placed import poses_in_space
        from twin.pictures.workspace import workspace_figure

        self._refuse_still()
        drawn, machine, model = self._drawn, self._machine, self.result.model.artefact.model
        if len(drawn.poses) < 2:
            raise TwinError("has one pose only, so there is no workspace", model.name, "draw result.plot.tcp()")
        edge = self.result.edge(at)
        return workspace_figure(
            poses_in_space(machine, drawn.pose_axes, drawn.poses),
            drawn.tcp[edge],
            [len(nodes) for nodes in model.pose_grid],
            f"The workspace after {drawn.hours[edge]:.3g} h",
            "xyz".index(machine.machine.vertical),
        )

    def surface(self, at: Quantity | Sequence[Quantity] = ()) -> Figure:
        """The surface coloured by temperature, by default at four times over the run."""
        from twin.pictures.report import surface_of

        artefact = self.result.model.artefact
        if not artefact.fields:
            raise TwinError("is a lumped machine: no surface to draw", self.result.model.name, "draw temperatures()")
        times = [at] if isinstance(at, str | float | int) else at
        hours = tuple(positive("at", t, "s", zero=True) / 3600.0 for t in times)
        return surface_of(artefact, self._drawn, self._machine, hours)

    def _refuse_still(self) -> None:
        from twin.pictures.placed import no_tcp

        artefact = self.result.model.artefact
        if not artefact.model.moves:
            raise TwinError("no temperature moves the tool", self.result.model.name, no_tcp(artefact))

    @cached_property
    def _machine(self) -> Machine:
        from twin.pictures.placed import described

        return described(self.result.model.artefact)

    @cached_property
    def _drawn(self) -> Drawn:
        from twin.pictures.result import Drawn

        n = self.result.numbers
        return Drawn(
            hours=(n.time - n.time[0]) / 3600.0,
            sensors=n.sensors,
            temperature=n.temperature,
            axes=n.axes,
            position=n.position,
            pose_axes=n.pose_axes,
            poses=n.poses,
            tcp=n.tcp,
            tcp_actual=n.tcp_actual,
            flags=n.flags,
            flag_names=n.flag_names,
            states=n.states,
            angle=n.angle,
        )
