"""What another discretisation of the same machine would show: model discrepancy that is this machine's own.

Two sensors beside one rail differ by 0.1 K between two meshes: no drawn coefficient looks like that, and a joint does.
So the machine is described once more, with linear elements, with rails in more segments, with bars of finer
elements, and with an inside for each heavy node; what both measure otherwise is known in shape and unknown in its
share.

    y_other(x) - y(x) = d + D x,      share ~ N(0, 1)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.build.mesh_error import OF_LINEAR
from twin.calibrate.fit.measured import Measured
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import Study, make_study
from twin.diagnose.model.surrogate import Surrogate, jacobian_of
from twin.logs.run import Run
from twin.machine.check_lumped import VOLUMETRIC, node_capacity
from twin.machine.description import Contact, Machine, Node
from twin.progress import Progress, silent
from twin.rom.parameter import Parameter

# times the elements of a bar. Twice as many have every old node, and a sensor or a nut that sits on one still does
# (in the shipped ball-screw axis all do): multiples of the golden ratio are the farthest from all simple fractions
# (Hurwitz' theorem; Hardy, Wright, An Introduction to the Theory of Numbers, 5th ed. 1979, 11.8)
BARS = (1.0 + 5.0**0.5) / 2.0
OF_BARS = 1.0 / (1.0 - BARS**-2)  # of the difference: the error of linear elements goes with the square of their size
# times the segments of a rail: what its sensors show depends on where in a segment they sit, otherwise in every
# division; its error goes with the length, 1 / (1 - 1 / times) of the difference. Chosen on the ball-screw axis with
# six other divisions of its screw: twice as many alone leave 1.19 times the variance that they should, both 1.09, and
# with 1.62 times as many 1.02, for another two minutes on a machine as large as five_axis
SEGMENTS = (BARS**0.5, 2.0)
DIFFUSIVITY = 1.3e-5  # m^2/s, of steel and cast iron (VDI Heat Atlas, 2nd ed., D6.1)
LONG = 2.0  # times the edge of a cube of its capacity that a node's heat has to go: machine parts are no cubes
SPLIT_FROM = 120.0  # s, of a node's inside behind its surface: two steps of 60 s


@dataclass(frozen=True)
class Difference:
    """m measurements, n parameters: another discretisation minus the described one, by one standard deviation."""

    d: np.ndarray  # (m,) K, m, at the description
    D: np.ndarray  # (m, n) by parameters in prior standard deviations

    def at(self, x: np.ndarray) -> np.ndarray:
        """(m,) at parameters x (n,)."""
        return np.asarray(self.d + self.D @ x)


def differences(
    machine: Machine, study: Study, surrogate: Surrogate, parameters: Sequence[Parameter], runs: Sequence[Run],
    plans: Sequence[Measured], progress: Progress = silent,
) -> tuple[Difference, ...]:  # fmt: skip
    """What other discretisations of a machine measure otherwise in the fitted runs of its study.

    plans: without numbers. Raises ModelError and DescriptionError as assembling the machine does.
    """
    x = np.zeros(len(parameters))
    J = surrogate.J * surrogate.rate(x)
    found = []
    for other, share, linear in _others(machine):
        known = [_acting(p, other) for p in parameters]
        probed = make_probed_model(other, known, runs, progress, linear)
        of_other = make_study(probed, plans, study.fitted)
        d, D = of_other.all_outputs(x) - surrogate.y0, jacobian_of(of_other, x) - J
        found.append(Difference(share * d, share * D))
    return tuple(found)


def _others(machine: Machine) -> Iterator[tuple[Machine, float, bool]]:
    """Other discretisations: a machine, the share of its difference that is one standard deviation, linear elements."""
    if not machine.lumped:
        yield machine, OF_LINEAR, True
    if not machine.lumped and (moving := {n: c for n, c in machine.contacts.items() if c.kind == "moving"}):
        for times in SEGMENTS:
            finer = {n: c.model_copy(update={"segments": round(times * c.segments)}) for n, c in moving.items()}
            yield machine.model_copy(update={"contacts": machine.contacts | finer}), 1.0 / (1.0 - 1.0 / times), False
    if machine.bars:
        bars = {n: b.model_copy(update={"elements": round(BARS * b.elements)}) for n, b in machine.bars.items()}
        yield machine.model_copy(update={"bars": bars}), OF_BARS, False
    for name in machine.nodes:
        if (split := with_inside(machine, name)) is not machine:
            yield split, 1.0, False


def with_inside(machine: Machine, name: str) -> Machine:
    """A lumped machine of which a heavy node has an inside of half its capacity, behind half a path of conduction; the
    machine itself where the node is light.

    Heat crosses a body of length l in l^2 / (pi^2 a), the time constant of the slowest cosine (Carslaw and Jaeger,
    Conduction of heat in solids, 2nd ed. 1959, 3.3); l is LONG times the edge of a cube of steel of its capacity.
    """
    node, capacity, inside = machine.nodes[name], node_capacity(machine, name), inside_of(name)
    settles = (LONG * (capacity / VOLUMETRIC) ** (1.0 / 3.0)) ** 2 / (np.pi**2 * DIFFUSIVITY)
    if settles < SPLIT_FROM or inside in machine.nodes or inside in machine.contacts:
        return machine
    halves = {
        name: Node(capacity=capacity / 2, area=node.area, position=node.position),
        inside: Node(capacity=capacity / 2),
    }
    between = Contact(kind="fixed", surfaces=(name, inside), total=capacity / (4.0 * settles))
    expansion = dict(machine.tcp.expansion)
    if (row := expansion.get(name)) is not None:
        expansion[name] = expansion[inside] = (row[0] / 2, row[1] / 2, row[2] / 2)
    return machine.model_copy(
        update={
            "nodes": machine.nodes | halves,
            "contacts": machine.contacts | {inside: between},
            "tcp": machine.tcp.model_copy(update={"expansion": expansion}),
        }
    )


def inside_of(node: str) -> str:
    """The name of its inside."""
    return f"{node}--inside"


def _acting(parameter: Parameter, other: Machine) -> Parameter:
    """The parameter in another discretisation: a capacity is that of the inside, too, and each half of a node that
    grows takes half of the change."""
    insides = [inside_of(t) for t in parameter.targets if inside_of(t) in other.nodes]
    if parameter.kind not in ("capacity", "expansion") or not insides:
        return parameter
    share = 0.5 if parameter.component >= 0 else 1.0
    return replace(parameter, targets=(*parameter.targets, *insides), sigma=share * parameter.sigma)
