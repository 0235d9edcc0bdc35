"""What is special about a family, asked of objects: a `Family` per entry of the catalogue, a `Fault` per kind of
elementary cause that it has. Other rooms ask these and know no names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.faults.elements import Elements
from twin.diagnose.model.bank import Column, Nominal
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.spot import Spot
from twin.machine.effects.effect import Effect, Window

if TYPE_CHECKING:
    from twin.diagnose.faults.context import Context


class Curve(Enum):
    """What an amplitude is of the described quantity."""

    LINEAR = "a difference, in its unit"
    RELATIVE = "a relative change"
    LOGARITHM = "the logarithm of a factor"

    def told(self, amplitude: float) -> float:
        """An amplitude as reports take it: relative changes and logarithms as factors, others as they are."""
        if self is Curve.RELATIVE:
            return max(1.0 + amplitude, 0.0)
        return float(np.exp(amplitude)) if self is Curve.LOGARITHM else amplitude


@dataclass(frozen=True)
class Described:
    """How a report and an edit say a cause."""

    place: str
    size: tuple[float, float, float]  # value, low, high
    windows: tuple[Window, ...]
    settings: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Unit:
    """One amplitude of a cause: what it is, and when it acts."""

    fault: Fault
    place: str
    column: int  # a column of the bank of the same vector, -1 if none
    shapes: tuple[np.ndarray, ...]  # per run of the study (n,): history of unit amplitude


@dataclass(frozen=True)
class Slot:
    """Slot s of run k of the time integration, to be filled with a unit."""

    slots: Slots
    s: int
    unit: Unit
    k: int
    study: Study
    elements: Elements

    @property
    def shape(self) -> np.ndarray:
        """(n,) the unit's history in this run."""
        return self.unit.shapes[self.k]

    @property
    def place(self) -> int:
        """The number of its place."""
        return [place.name for place in self.study.probed.places].index(self.unit.place)

    @property
    def column(self) -> Column:
        return self.elements.columns[self.unit.column]

    @property
    def vector(self) -> np.ndarray:
        """(r,) or (n, r) of its column."""
        return self.elements.vectors[self.k][self.column.vector]

    def force(self, vector: np.ndarray, history: np.ndarray) -> None:
        """With a vector (r,) or (n, r) times a history (n,)."""
        flow = vector if vector.ndim == 2 else np.broadcast_to(vector, (len(history), len(vector)))
        self.slots.forcing[:, self.s] = flow * history[:, None]

    def film(self, A: np.ndarray, M: np.ndarray, environment: int) -> None:
        """With a film A (r, r), M (r,) to the air of an environment."""
        air = self.study.runs[self.k].run.drive.environment[:, environment]
        self.slots.A[self.s], self.slots.M[self.s], self.slots.gate[:, self.s] = A, M, self.shape
        self.slots.rise[:, self.s] = air - self.study.probed.base.reference_temperature


@dataclass(frozen=True)
class Fault:
    """One kind of cause of a family: how its size enters, its range, and what searches must know of it."""

    family: str
    kind: str  # of the elementary causes that its columns are, see `elements` and `readings`
    unit: str
    prefix: str = ""  # of its places, before the name that its columns have
    sign: int = 0  # of the first amplitude; 0: either
    least: float = 0.0  # first amplitude worth naming
    # beyond which the model is wrong, not the machine: generous, chosen without looking at cases but for the one named
    largest: float | None = None
    positive: bool = False  # no amplitude is below nought
    fixed: bool = False  # amplitudes are one
    own: float = 0.05  # relative standard deviation of its size, by what the form of the model may have wrong
    curve: Curve = Curve.LINEAR
    conducts: bool = False  # its size is that of a conductance: temperatures are nearly linear in a / (1 + a)
    parameter: bool = False  # it is a declared parameter beyond its tolerance, moved and not added
    bent: bool = False  # in the machine, and not in proportion to its size
    saturates: bool = False  # the larger it is, the worse is linearity
    wets: bool = False  # a film and its heat: two amplitudes, of which linearity tells the first badly
    grows: bool = True  # in windows, of which the data may ask for more
    several: bool = False  # comes part by part: one of them explains a share
    leaves: float = 0.005  # of its statistic: heat that it may leave in windows because the model is not the machine
    faint: bool = False  # its score by the derivative is small when it is many times as large
    read: bool = False  # acts on what is read, not in the machine
    sizes: tuple[float, ...] = ()  # of what is read and not in proportion to its size: at which it is scored, too
    moves: bool = False  # a reading to another place, in proportion to its size: by how much, parameters change
    called: str = ""  # what its history is called, where it is not that of its columns
    exchanges: bool = False  # two channels, exactly
    corrects: bool = False  # a logged signal, by an exact factor
    lasts: bool = False  # of a reading: goes on in runs that were not looked at
    everywhere: bool = False  # of no one place: it may switch as often as the weather
    elsewhere: bool = False  # all of a source's heat at another place, compared with the description
    replaces: bool = False  # a law of another shape: what its source emits as described has no tolerance beside it
    beside: bool = False  # beside another of its family and unit, whose detection limit alone is told
    partner: str = ""  # what the second of the two names of its place is called in settings

    @property
    def declared(self) -> bool:
        """Whether its size is that of a declared parameter, whose place it takes."""
        return self.parameter or self.conducts

    @property
    def curved(self) -> bool:
        """Whether it acts on what is read, and not in proportion to its size."""
        return bool(self.sizes)

    @property
    def stepped(self) -> bool:
        """Whether what is read otherwise is asked of `change`, of the motion at hand, and no column has it for all."""
        return self.curved or self.moves

    def bare(self, name: str) -> str:
        """The name that its columns have, of a place of a hypothesis."""
        return name.removeprefix(self.prefix)

    def batches(
        self, rows: Sequence[tuple[str, Sequence[int]]], histories: Sequence[History],
        largest: float | Sequence[float] | None = None,
    ) -> list[Batch]:  # fmt: skip
        """A batch of its hypotheses at places (name, columns), none without places or histories.

        largest: of each place, `self.largest` by default.
        """
        if not rows or not histories:
            return []
        bound = self.largest if largest is None else largest
        of_places = () if bound is None else tuple(np.broadcast_to(np.asarray(bound, dtype=float), len(rows)).tolist())
        return [Batch(
            self.family, self.kind, self.unit, tuple(self.prefix + p for p, _ in rows),
            np.array([c for _, c in rows], dtype=int), tuple(histories), self.sign, self.fixed, self.least, of_places,
            self.positive,
        )]  # fmt: skip

    def log_change(self, amplitude: float, sigma: float = 0.0) -> tuple[float, float]:
        """An amplitude of a declared parameter as the logarithm of its factor, with its standard deviation."""
        return (float(np.log1p(amplitude)), sigma / (1.0 + amplitude)) if self.conducts else (amplitude, sigma)

    def amplitude(self, change: float, sigma: float = 0.0) -> tuple[float, float]:
        """The inverse of `log_change`."""
        return (float(np.expm1(change)), float(np.exp(change)) * sigma) if self.conducts else (change, sigma)

    def uncertain(self, value: float) -> float:
        """Standard deviation of an amplitude by what the form of the model may have wrong."""
        return self.own * value

    # exact terms in the machine
    def units(self, h: Hypothesis, shapes: Callable[[int], tuple[np.ndarray, ...]]) -> tuple[Unit, ...]:
        """The amplitudes of a hypothesis; shapes: of each, per run of the study. None for readings."""
        if self.read:
            return ()
        columns, weights = h.combination()
        leads = [int(columns[np.flatnonzero(row)[0]]) if row.any() else int(columns[0]) for row in weights]
        return tuple(Unit(self, self.bare(h.name), lead, shapes(i)) for i, lead in enumerate(leads))

    def fill(self, slot: Slot) -> None:
        """By default with a forcing that the bank knows: the vector of its column, in the unit's own history."""
        slot.force(slot.vector, slot.shape)

    # what exact refits know beforehand
    def prior(self, q: int) -> tuple[np.ndarray, np.ndarray]:
        """(q,) means and inverse variances of amplitudes."""
        return np.zeros(q), np.zeros(q)

    def lowest(self, study: Study, nominal: Sequence[Nominal], h: Hypothesis) -> np.ndarray:
        """(q,) below which no amplitude goes."""
        return np.full(h.batch.q, 0.0 if self.positive else -np.inf)

    def limited(self, study: Study, name: str, a: np.ndarray) -> np.ndarray:
        """(q,) amplitudes that physics allows together."""
        return a

    def vanished(self, a: np.ndarray) -> bool:
        """Whether amplitudes (q,) are another cause's."""
        return False

    def left_open(self, units: Sequence[Unit], a: np.ndarray) -> list[Unit] | None:
        """What the shape of a cause leaves open at amplitudes (q,), one standard deviation each; None: its
        history's."""
        return None

    # readings
    def change(self, study: Study, states: Callable[[int], np.ndarray], name: str, size: float) -> np.ndarray:
        """(m,) what the fitted runs read otherwise, of what is `stepped`; states: of run k, (n + 1, r)."""
        raise NotImplementedError(f"{self.kind} is in proportion to its size")

    def read_in(
        self, one: Study, states: np.ndarray, name: str, size: float, known: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """(size,) what it adds to the reading of the one run of a study, of states (n + 1, r); known: its columns of
        that run, by name."""
        if self.stepped:
            return self.change(one, lambda _: states, name, size)
        column = known.get(self.bare(name))
        return np.zeros(one.runs[0].size) if column is None else np.asarray(size * column)

    # words
    def factor(self, name: str) -> tuple[str, float]:
        """What is corrected, and by what, of a place of what `corrects`."""
        raise NotImplementedError(f"{self.kind} has no exact factor")

    def described(self, study: Study, d: Described, a: np.ndarray, covariance: np.ndarray) -> Described:
        """A cause as reports and edits take it, of one at its place with the size of its first amplitude as told."""
        if not self.partner:
            return d
        spot = Spot.read(d.place)
        return replace(d, place=spot.owner, settings={self.partner: spot.partner})


def as_found(cause: Cause, study: Study) -> Effect:
    """A cause as descriptions take it, nothing turned; its reference in SI."""
    settings = {key: value for key, value in cause.settings.items() if key != "reference_unit"}
    return Effect(
        cause.family, cause.place, cause.amplitude, cause.unit, cause.history, cause.signal, cause.exponent,
        cause.windows, settings,
    )  # fmt: skip


def nothing_more(cause: Cause) -> list[str]:
    return []


def never(cause: Cause) -> bool:
    return False


@dataclass(frozen=True)
class Family:
    """An entry of the catalogue."""

    number: int
    name: str
    title: str
    physics: str
    operator: str
    signature: str
    smallest: str  # size worth naming, with unit
    sign: str
    searched: str  # places and histories
    group: str  # "machine", "sensor", "signal", "reading": which verdict and which edit
    batches: Callable[[Context], list[Batch]]
    file: str = ""  # text of the user's file that it is from: what was made with another text is made again
    what: str = ""  # the subject of "... at PLACE: SIZE" in a report; its name by default
    times: str = ""  # what a size without a unit multiplies
    declared: bool = False  # always, it is a declared number out of its tolerance
    channel: bool = False  # it is said as "sensor x_nut is at fault"
    weighed: bool = False  # its statistic is twice the gain of ln evidence, free numbers integrated out
    kind_told: bool = False  # its history says what kind it is, before its size
    said: Callable[[Cause], list[str]] = nothing_more  # what its size holds for, in words
    last: Callable[[Cause], bool] = never  # whether it is asked after all others, and of no synthetic measurements
    edit: Callable[[Cause, Study], Effect] = as_found  # how the description says it
    told_of_edit: Callable[[Cause], list[str]] = nothing_more  # what the edit leaves to be done by hand
    editable: Callable[[Cause], bool] | None = None  # whether a description says it; of the machine's all, by default

    def changes(self, cause: Cause) -> bool:
        """Whether a description says such a cause."""
        return self.group == "machine" if self.editable is None else self.editable(cause)
