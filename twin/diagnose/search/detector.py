"""The detector of a study: what calibration can absorb, model discrepancy, null distribution and thresholds.

Made from synthetic measurements without a cause (`nulls`), once per machine, loads, plan of measurements and
instruments, and cached: noise and the low-rank covariance of model discrepancy from some of them, the null distribution
of every family's best statistic from the others. Thresholds are Gumbel tails at one probability for all families,
chosen so that ALARM of all measurements without a cause pass any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.build.workers import each
from twin.calibrate.fit.measured import Measured
from twin.calibrate.fit.noise import Channels, estimated
from twin.diagnose.evidence.discretisation import Difference
from twin.diagnose.evidence.fitter import Fitted, Fitter
from twin.diagnose.evidence.formal import known_forms
from twin.diagnose.evidence.loss_exponents import other_exponents
from twin.diagnose.evidence.nulls import SPREAD, Form, Instruments, drawn, null
from twin.diagnose.evidence.pulls import Pulls, tails
from twin.diagnose.evidence.settled import settled_nearly
from twin.diagnose.evidence.sight import Columns, sight
from twin.diagnose.evidence.unknown import heat_of
from twin.diagnose.evidence.whiten import Whitener, missing, offsets
from twin.diagnose.faults.catalogue import Family
from twin.diagnose.faults.context import Context
from twin.diagnose.faults.elements import Elements, elements_of, slim
from twin.diagnose.faults.forms import clocks, described_forms
from twin.diagnose.faults.lost import Lost, lost_conductances
from twin.diagnose.faults.readings import readings_of
from twin.diagnose.model.bank import Nominal, nominal_run, respond
from twin.diagnose.model.study import Planned, Study, with_measured
from twin.diagnose.model.surrogate import Surrogate, make_surrogate
from twin.progress import Progress, silent

if TYPE_CHECKING:  # what searches by a detector decides nothing about it
    from twin.diagnose.search.policy import SearchPolicy

# synthetic measurements: of those of the campaign's detector (five_axis, 200 for thresholds), either half alone gives
# thresholds that 2.0 and 2.5 % of all pass (ALARM is 3 %), and quarters ones that 1.5 to 3 % pass
FORM, NULLS = 60, 100
MODES = 30
OFFSET = 0.1  # K, prior of every sensor's constant error
TCP_ZERO = 0.5e-6  # m, prior of every TCP component's constant error
LATE = 60.0  # s, by which light parts and sensors respond earlier or later than their models: one step
ALARM = 0.03
FLOOR = 36.0  # of thresholds: some families never pass in synthetic measurements, and would at the first surprise

Differences = Sequence[Difference]


@dataclass(frozen=True)
class _Made:
    """What no measured value changes; n columns (elements, then readings)."""

    elements: Elements
    nominal: tuple[Nominal, ...]
    index: dict[tuple[str, str, str], int]
    columns: Columns
    nulls: dict[str, np.ndarray]  # per family, and "unknown": largest statistic in every null
    thresholds: dict[str, float]
    lost: Lost
    pulls: Pulls

    @property
    def made(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(_Made)}


@dataclass(frozen=True)
class Derivatives:
    """Of the outputs by the parameters, what a surrogate does not know: beyond its bounds, or beside causes."""

    causes: tuple[tuple[str, str, str, int], ...]  # family, place, signal and number of windows
    there: np.ndarray  # prior standard deviations (n,), then what tells the causes' sizes and hours
    J: np.ndarray  # (m, n) less that of the surrogate


@dataclass(frozen=True)
class Detector(_Made):
    """Of m measured numbers."""

    study: Study
    fitter: Fitter
    policy: SearchPolicy  # that it is searched with: no number of its own depends on it
    least: float = 0.0  # statistic that any cause needs, where the model is wrong in its form (`dispersion`)
    poor: bool = False  # its model discrepancy holds what the model leaves of these very runs (`dispersion`)
    derivatives: list[Derivatives] = field(default_factory=list)  # that a diagnosis has made: each takes seconds
    heated: dict[str, np.ndarray] = field(default_factory=dict)  # by surface: responses to heat (`any_heat`), made once

    @property
    def no_evidence(self) -> float:
        """Statistic up to which nothing speaks for a cause in a poor model, nor against one that has passed."""
        return self.least if self.poor else 0.0

    @property
    def whiten(self) -> Whitener:
        return self.fitter.whiten

    def at_least(self, least: float) -> Detector:
        """The same where no cause is named that explains less."""
        return replace(self, least=least, thresholds={name: max(v, least) for name, v in self.thresholds.items()})


@dataclass(frozen=True)
class StoredDetector(_Made):
    """A detector without the study, whose measurements come later: what the cache keeps."""

    surrogate: Surrogate
    channels: tuple[tuple[Channels, Channels], ...]
    others: np.ndarray  # (m, q) white

    def of(self, study: Study, policy: SearchPolicy) -> Detector:
        """The detector of a study that differs from the one it was made for in its measured values alone."""
        fitter = Fitter(study, self.surrogate, Whitener(study, self.channels), self.others)
        return Detector(**self.made, study=study, fitter=fitter, policy=policy)


def stored(detector: Detector) -> StoredDetector:
    fitter = detector.fitter
    return StoredDetector(
        **detector.made, surrogate=fitter.surrogate, channels=fitter.whiten.channels, others=fitter.others
    )


_Nulls = tuple[Fitter, list[np.ndarray], Instruments, Form, Differences]  # what they are made and fitted with


def _fitted_null(shared: _Nulls, seed: int) -> Fitted:
    fitter, J, instruments, form, differences = shared
    return fitter(null(fitter.study, J, seed, instruments, form, differences=differences))


def _null_residual(shared: _Nulls, seed: int) -> np.ndarray:
    """What a calibration leaves of a null (m,)."""
    fitter, fitted = shared[0], _fitted_null(shared, seed)
    return fitter.whiten.colour(fitted.projector(fitter.whiten(fitted.residual)))


@dataclass(frozen=True)
class _OfNull:
    """What is seen in a null: the largest statistic of every family, its parameters and what two calibrations say."""

    largest: dict[str, float]
    drawn: np.ndarray  # (n,)
    fitted: np.ndarray  # (n,)
    settled: np.ndarray  # (n,)


def _of_null(shared: tuple[_Nulls, Columns], seed: int) -> _OfNull:
    (fitter, *_), columns = shared[0], shared[1]
    fitted = _fitted_null(shared[0], seed)
    seen = sight(columns, fitted.projector, fitter.whiten(fitted.residual))
    return _OfNull(seen.largest(), drawn(fitter.study, seed), fitted.x, settled_nearly(fitter, fitted))


def instruments_of(study: Study, temperature: float, tcp: float) -> Instruments:
    """White noise of the instruments: TCP as the runs tell, where they do."""
    told = [m.tcp_sigma for m in (study.runs[k].measured for k in study.fitted) if m.tcp_sigma is not None]
    good = np.concatenate([t[np.isfinite(t) & (t > 0.0)] for t in told]) if told else np.zeros(0)
    return Instruments(temperature, float(np.median(good)) if len(good) else tcp)


def make_detector(
    study: Study,
    families: Sequence[Family],
    instruments: Instruments,
    policy: SearchPolicy,
    form: Form = Form(),
    counts: tuple[int, int] = (FORM, NULLS),
    progress: Progress = silent,
    differ: Callable[[Surrogate], Differences] = lambda _: (),
) -> Detector:
    """The detector of a study; differ: what other discretisations measure otherwise."""
    surrogate = make_surrogate(study, progress)
    other = (*differ(surrogate), *other_exponents(study, form))
    J = surrogate.J * surrogate.rate(np.zeros(len(study.probed.parameters)))
    J_of, y_of = ([values[own] for own in study.rows] for values in (J, surrogate.y0))
    with progress("responses of elementary causes", 2) as advance:
        nominal = tuple(nominal_run(study, k) for k in range(len(study.runs)))
        elements = elements_of(study, nominal)
        advance("elements")
        readings, of_reading = readings_of(study, nominal[: len(y_of)], y_of, J_of)
        raw = np.hstack([respond(study, nominal, elements.vectors, elements.columns), readings])
        advance("responses")
    first = len(elements.columns)
    index = {**elements.index, **{key: first + c for key, c in of_reading.items()}}
    floors = _floors(study, instruments)
    whiten = Whitener(study, tuple((Channels(s, np.zeros(len(s))), Channels(w, np.zeros(3))) for s, w in floors))
    bare = np.hstack([*bare_forms(study, raw, index), first_rows(study, instruments.tcp)])
    described = described_forms(study, elements, raw, form)

    def fitter_of(whiten: Whitener, *modes: np.ndarray) -> Fitter:
        discretised = [o.columns(whiten, SPREAD) for o in other]
        known = known_forms(study, described, nominal, raw, J, whiten, form)
        return Fitter(study, surrogate, whiten, np.hstack([whiten(bare), *discretised, known, *modes]))

    fitter = fitter_of(whiten)
    with progress("fault-free simulations: discrepancy", counts[0]) as advance:
        shared = (fitter, J_of, instruments, form, other)
        left = np.stack(each(_null_residual, shared, list(range(counts[0])), lambda _: advance("")), axis=1)
    whiten = Whitener(study, _channels(study, left, floors))
    U, s, _ = np.linalg.svd(whiten(left), full_matrices=False)
    variance = s**2 / max(counts[0], 1)
    kept = min(MODES, int(np.sum(variance > 3.0)))
    modes = U[:, :kept] * np.sqrt(np.maximum(variance[:kept] - 1.0, 0.0))
    fitter = fitter_of(whiten, modes)
    context = Context(study, elements, index)
    batches = [b for f in families for b in f.batches(context) if b.columns.size]
    columns = Columns.of(
        _whitened(whiten, raw), batches, heat_of(study, elements.histories.blocks, elements.heat_blocks), fitter.others
    )
    with progress("fault-free simulations: thresholds", counts[1]) as advance:
        seeds = list(range(10_000, 10_000 + counts[1]))
        shared = (fitter, J_of, instruments, form, other)
        seen = each(_of_null, (shared, columns), seeds, lambda _: advance(""))
    names = [*(f.name for f in families), "unknown"]
    nulls = {name: np.array([of_null.largest.get(name, 0.0) for of_null in seen]) for name in names}
    told = np.array([(o.drawn, o.fitted, o.settled) for o in seen])  # (nulls, 3, n)
    pulls = Pulls.of(study.probed.parameters, *told.transpose(1, 0, 2))
    small = tuple(replace(own, inverse=np.zeros((0, 0, 0))) for own in nominal)
    lost = lost_conductances(study, elements, whiten, progress)
    made = slim(elements), small, index, columns, nulls, thresholds_of(nulls), lost, pulls
    return Detector(*made, study, fitter, policy)


def bare_forms(study: Study, raw: np.ndarray, index: dict[tuple[str, str, str], int]) -> list[np.ndarray]:
    """Columns (m, k) of unit prior variance that no model is needed for: constant errors of channels, and lateness."""
    return [
        OFFSET * offsets(study)[0],
        TCP_ZERO * (study.joined(lambda _: (-1, range(3)))[:, None] == np.arange(3)),
        _together(raw, index),
    ]


def first_rows(study: Study, tcp: float) -> np.ndarray:
    """(m, k) columns of unit prior variance: the noise [m] of the first TCP row of a run, which all its others have
    with the other sign where deviations count from it."""
    names = [name for name, _ in study.fitted_runs]

    def column_of(planned: Planned) -> tuple[int, np.ndarray]:
        w = np.tile(3 * names.index(planned.run.name) + np.arange(3), (planned.shapes[1][0], 1))
        w[: 1 if planned.measured.from_first else None] = -1
        return -1, w

    number = study.joined(column_of)
    return tcp * (number[:, None] == np.unique(number[number >= 0]))


def _together(raw: np.ndarray, index: dict[tuple[str, str, str], int]) -> np.ndarray:
    """(m, 1) what all clocks by LATE do: what comes early or late in every run is a light part's or a sensor's time
    constant. (m, 0) where there is one run alone."""
    own = clocks(index)
    if len(own) < 2:
        return np.zeros((len(raw), 0))
    return np.asarray(LATE * raw[:, own].astype(float).sum(axis=1, keepdims=True))


def _whitened(whiten: Whitener, raw: np.ndarray) -> np.ndarray:
    """Columns (m, n) in white units, some thousand at a time: in double precision they are gigabytes."""
    result = np.empty_like(raw)
    for first in range(0, raw.shape[1], 1000):
        result[:, first : first + 1000] = whiten(raw[:, first : first + 1000].astype(float))
    return result


def thresholds_of(nulls: dict[str, np.ndarray], alarm: float = ALARM) -> dict[str, float]:
    """Per family what `alarm` of all nulls pass any of."""
    tailed = [name for name, values in nulls.items() if len(values) and values.max() > 0.0]
    limits = tails(np.stack([nulls[name] for name in tailed], axis=1), alarm) if tailed else ()
    found = dict(zip(tailed, limits, strict=True))
    return {name: float(max(found.get(name, FLOOR), FLOOR)) for name in nulls}


def _floors(study: Study, instruments: Instruments) -> list[tuple[np.ndarray, np.ndarray]]:
    """Per fitted run the standard deviations of bin means (s,) and of TCP components (3,)."""
    result = []
    for k in study.fitted:
        m = study.runs[k].measured
        count = np.median(np.where(m.count > 0, m.count, np.nan), axis=0) if len(m.count) else np.ones(len(m.sensors))
        sensors = instruments.temperature / np.sqrt(np.nan_to_num(count, nan=1.0).clip(1.0))
        result.append((sensors, np.full(3, instruments.tcp)))
    return result


def _channels(
    study: Study, residuals: np.ndarray, floors: list[tuple[np.ndarray, np.ndarray]]
) -> tuple[tuple[Channels, Channels], ...]:
    """Noise of every channel from residuals (m, sets): memory of what the modes of form will not hold, capped."""
    return tuple(
        (_pooled(T, sensors), _pooled(w, tcp))
        for (_, T, w), (sensors, tcp) in zip(study.split(residuals), floors, strict=True)
    )


def _pooled(values: np.ndarray, floor: np.ndarray) -> Channels:
    """From (rows, channels, sets): sets one after the other, kept apart by a missing row."""
    if not values.size:
        return Channels(floor, np.zeros(len(floor)))
    _, channels, sets = values.shape
    apart = np.concatenate([values, np.full((1, channels, sets), np.nan)])
    return estimated(apart.transpose(2, 0, 1).reshape(-1, channels), floor, cap=0.9)


def emptied(detector: Detector, plans: list[Measured]) -> Detector:
    """The detector where these measurements have gaps that its own do not have; thresholds stay as they are.

    For campaigns: `twin diagnose` makes a new one, which takes minutes.
    """
    study = with_measured(detector.study, plans)
    kept = ~missing(study)
    if not np.any(~kept & ~missing(detector.study)):
        return detector
    whiten = replace(detector.whiten, study=study)
    own = replace(detector, study=study, fitter=replace(detector.fitter, study=study, whiten=whiten))
    return weighted(own, kept.astype(float))


def weighted(detector: Detector, weight: np.ndarray) -> Detector:
    """The detector where each number counts by a weight (m,): the standard deviation that it has by that it really
    has, 0 where it is not measured. Thresholds stay as they are."""
    own = detector.whiten.weight
    whiten = replace(detector.whiten, weight=weight if own is None else weight * own)
    others = weight[:, None] * detector.fitter.others
    raw = weight[:, None].astype(np.float32) * detector.columns.raw
    return replace(
        detector,
        fitter=replace(detector.fitter, whiten=whiten, others=others),
        columns=Columns.of(raw, detector.columns.batches, detector.columns.heat, others),
        lost=replace(detector.lost, responses=weight[:, None] * detector.lost.responses),
    )
