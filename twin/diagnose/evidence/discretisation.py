"""What another discretisation of the same machine would show: model discrepancy that is this machine's own.

Two sensors beside one rail differ by 0.1 K between two meshes: no drawn coefficient looks like that, and a joint does.
So the machine is described once more, with elements of half the size, with rails in more segments, with bars of finer
elements, and with an inside for each heavy node; what both measure otherwise is known in shape and unknown in its
share, which every channel of a machine of parts has for itself.

    y_real(x) - y(x) = share (d + D x),      share ~ N(0, 1)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.build.mesh import load_body_meshes
from twin.build.mesh_error import LARGEST, OF_FINER, OF_LINEAR, refined_bytes, refined_unknowns
from twin.build.workers import LONG as WORTH_HELP
from twin.build.workers import each
from twin.calibrate.fit.measured import Measured
from twin.diagnose.evidence.leading import channel_of, leading_of_each
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.rich_probed_model import Mesh
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
# times the segments of a rail. What its sensors show depends on where in a segment they sit, otherwise in every
# division, and a few of them do not span what another one does (of the screw of the shipped axis six leave a third):
# two of three are known, and synthetic measurements come from the others
SEGMENTS = tuple(2.0 ** (k / 9.0) for k in range(1, 10))
BYTES = 10e9  # of a machine on a mesh of half the size: what a computer of 16 GB has to spare
DIFFUSIVITY = 1.3e-5  # m^2/s, of steel and cast iron (VDI Heat Atlas, 2nd ed., D6.1)
LONG = 2.0  # times the edge of a cube of its capacity that a node's heat has to go: machine parts are no cubes
SPLIT_FROM = 120.0  # s, of a node's inside behind its surface: two steps of 60 s


@dataclass(frozen=True)
class Difference:
    """m measurements, n parameters: other discretisations minus the described one, by one standard deviation."""

    known: np.ndarray  # (m, k) K, m, at the description
    real: np.ndarray  # (m, l) the same of those that a real machine may be like
    D: np.ndarray  # (m, n) by the numbers of the description in prior standard deviations
    share: np.ndarray  # (m,) 0, 1, ...: which of the shares every measurement has

    def drawn(self, rng: np.random.Generator, x: np.ndarray) -> np.ndarray:
        """(m,) at parameters x (n,), with shares drawn; of several real ones it is one of them, with signs drawn."""
        shares, several = int(self.share.max()) + 1, self.real.shape[1]
        size = rng.choice([-1.0, 1.0], shares) if several > 1 else rng.standard_normal(shares)
        one = int(rng.integers(several)) if several > 1 else 0
        return np.asarray(size[self.share] * (self.real[:, one] + self.D @ x[: self.D.shape[1]]))

    def columns(self, white: Callable[[np.ndarray], np.ndarray], spread: float) -> np.ndarray:
        """(m, k) of unit prior variance, at parameters of a spread of prior standard deviations."""
        return leading_of_each(self.share, white(np.hstack([self.known, spread * self.D])))


def differences(
    machine: Machine, study: Study, surrogate: Surrogate, parameters: Sequence[Parameter], runs: Sequence[Run],
    plans: Sequence[Measured], progress: Progress = silent,
) -> tuple[Difference, ...]:  # fmt: skip
    """What other discretisations of a machine measure otherwise in the fitted runs of its study.

    plans: without numbers. Raises ModelError and DescriptionError as assembling the machine does.
    """
    x = np.zeros(len(parameters))
    J = surrogate.J[:, : len(x)] * surrogate.rate(np.zeros(len(surrogate.scale)))[: len(x)]
    # elements err about each sensor by itself: refined at once, a bearing in a coarse box would hide the castings
    apart = np.zeros(len(J), dtype=int) if machine.lumped else np.unique(channel_of(study), return_inverse=True)[1]

    step = study.runs[0].run.step
    # sealed ones too: the plans count positions of the TCP that any run has
    known = _Known(tuple(parameters), tuple(runs), tuple(plans), tuple(study.fitted), machine.lumped, step)
    every = list(_others(machine))
    # two windows made alike are off alike: as described it is made once more
    asked = [*(o for others in every for o in others), *([] if machine.lumped else [_Other(machine)])]
    with progress("other discretisations", len(asked)) as advance:
        # at once, as the first one is the finest, and takes as long as all others
        shown = each(_outputs, known, asked, lambda _: advance(""), long=WORTH_HELP if machine.lumped else 0.0)
    y, found, first = surrogate.y0 if machine.lumped else shown[-1], list[Difference](), 0
    for others in every:
        outputs, first = shown[first : first + len(others)], first + len(others)
        d = np.stack([o.share * (own - y) for o, own in zip(others, outputs, strict=True)], axis=1)
        D = others[0].share * (jacobian_of(known.study(others[0]), x) - J) if machine.lumped else np.zeros_like(J)
        real = np.arange(len(others)) % 3 == 1
        found.append(Difference(d[:, ~real], d[:, real], D, apart) if real.any() else Difference(d, d, D, apart))
    return tuple(found)


@dataclass(frozen=True)
class _Other:
    """Another discretisation."""

    machine: Machine
    share: float = 1.0  # of its difference that is one standard deviation
    mesh: Mesh = Mesh.DESCRIBED


@dataclass(frozen=True)
class _Known:
    """What is the same of every discretisation."""

    parameters: tuple[Parameter, ...]
    runs: tuple[Run, ...]
    plans: tuple[Measured, ...]
    fitted: tuple[int, ...]
    lumped: bool
    step: float  # s

    def study(self, other: _Other) -> Study:
        acting = [_acting(p, other.machine) for p in self.parameters]
        alone = () if self.lumped else self.fitted
        probed = make_probed_model(other.machine, acting, self.runs, silent, other.mesh, alone, self.step)
        return make_study(probed, self.plans, self.fitted)


def _outputs(known: _Known, other: _Other) -> np.ndarray:
    """(m,) what it measures as described."""
    return known.study(other).all_outputs(np.zeros(len(known.parameters)))


def _others(machine: Machine) -> Iterator[list[_Other]]:
    """Other discretisations, by what is divided otherwise."""
    if not machine.lumped:
        finer = finer_fits(machine)
        yield [_Other(machine, OF_FINER, Mesh.FINER) if finer else _Other(machine, OF_LINEAR, Mesh.LINEAR)]
        if any(c.kind == "moving" for c in machine.contacts.values()):
            yield [_Other(with_segments(machine, times)) for times in SEGMENTS]
    if machine.bars:
        bars = {n: b.model_copy(update={"elements": round(BARS * b.elements)}) for n, b in machine.bars.items()}
        yield [_Other(machine.model_copy(update={"bars": bars}), OF_BARS)]
    for name in machine.nodes:
        if (split := with_inside(machine, name)) is not machine:
            yield [_Other(split)]


def with_segments(machine: Machine, times: float) -> Machine:
    """The machine with rails and screws in so many times the segments, in one more at least."""
    moving = {n: c for n, c in machine.contacts.items() if c.kind == "moving"}
    more = {n: max(round(times * c.segments), c.segments + 1) for n, c in moving.items()}
    contacts = machine.contacts | {n: c.model_copy(update={"segments": more[n]}) for n, c in moving.items()}
    return machine.model_copy(update={"contacts": contacts})


def finer_fits(machine: Machine) -> bool:
    """Whether the machine on a mesh of half the size is made in minutes, in the memory of an ordinary computer."""
    bodies = load_body_meshes(machine)
    return refined_bytes(bodies) <= BYTES and refined_unknowns(bodies) <= LARGEST


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
