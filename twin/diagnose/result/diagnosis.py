"""What a diagnosis says: verdict, causes with their evidence, limits, gain. Plain numbers, SI but for what has a unit
beside it (a sensor drifts by K/day); times in s since a run's start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from twin.diagnose.result.place import Scene, Support
from twin.diagnose.result.plan import Plan
from twin.logs.trace import Trace
from twin.machine.effects.effect import Window

Verdict = Literal["named", "ambiguous", "unknown", "out_of_tolerance", "sensor", "signal", "nothing", "too_poor"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


@dataclass(frozen=True)
class Rival:
    """Another explanation of the same data."""

    family: str
    place: str
    history: str
    amplitude: float  # in `unit`
    unit: str
    statistic: float  # log-likelihood ratio, twice: as that of the cause it rivals
    cosine: float  # with that cause, after everything that can be calibrated is projected out
    remedy: str = ""  # the sensor or the experiment that would separate them; "" where the data do
    ci95: tuple[float, float] = (math.nan, math.nan)  # of the amplitude, from the statistic alone


@dataclass(frozen=True)
class Cause:
    """One thing missing or wrong in the description, or one channel at fault."""

    family: str  # name in the catalogue: "heat_source"
    place: str  # "bed.x_motor", "films.bed", "contacts.x_guide", "sensors.x_nut", "signals.x_current", "runs.NAME"
    parameter: str  # dotted path in the extended description; "" where none changes
    amplitude: float  # in `unit`
    ci95: tuple[float, float]  # likewise
    unit: str
    statistic: float
    threshold: float
    history: str = "always"  # in words: "x_current^2", "from 4.0 h of run_1 on"
    signal: str = ""  # the logged signal that it follows, if one
    exponent: float = 1.0  # of that signal
    windows: tuple[Window, ...] = ()  # empty: always
    settings: Mapping[str, float | str] = field(default_factory=dict)  # what else its edit needs: medium temperature
    rivals: tuple[Rival, ...] = ()


@dataclass(frozen=True)
class Pull:
    """How far the fit moved a declared parameter from its nominal value."""

    path: str
    nominal: float  # SI
    value: float
    sigma: float  # posterior standard deviation, of the coordinate: in prior standard deviations
    pull: float  # posterior shift in prior standard deviations
    unit: str
    freed: bool = False  # of its tolerance: it is the size of a cause, not what calibration made of it
    # K or m rms over a run, of each sensor and TCP component, that the shift alone changes, to first order
    changes: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Limit:
    """The smallest size of a cause that passes its threshold in these data with a probability of 95 %."""

    family: str
    place: str  # the place with the median limit of the family
    size: float  # median over places, in `unit`
    smallest: float
    largest: float
    unit: str


@dataclass(frozen=True)
class Unknown:
    """Heat that enters somewhere, and nothing in the catalogue explains."""

    part: str
    surface: str  # the surface of the part that takes most of it
    statistic: float
    threshold: float
    history: Mapping[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]]  # per run: s, W, sigma W
    correlated_signals: tuple[tuple[str, float], ...]  # logged signals with their correlation, best first
    besides: tuple[str, ...] = ()  # other surfaces where heat enters with a history of its own


@dataclass(frozen=True)
class Gain:
    """Root mean square of what a model leaves of one channel of a sealed run, noise included."""

    run: str
    channel: str  # a sensor, or "dx", "dy", "dz"
    unit: str  # K or m
    delivered: float  # all in unit
    recalibrated: float
    extended: float
    ci95: tuple[float, float]  # of recalibrated - extended, block bootstrap
    affected: bool  # whether the causes move this channel noticeably
    ci95_delivered: tuple[float, float] = (math.nan, math.nan)  # of delivered - extended, block bootstrap


@dataclass(frozen=True)
class Series:
    """Residuals of one run, measured minus simulated, for the pictures."""

    run: str
    time: np.ndarray  # (b,) s
    sensors: tuple[str, ...]
    delivered: np.ndarray  # (b, s) K
    recalibrated: np.ndarray
    extended: np.ndarray
    tcp_time: np.ndarray  # (k,) s
    tcp_delivered: np.ndarray  # (k, 3) m
    tcp_recalibrated: np.ndarray
    tcp_extended: np.ndarray
    loads: Mapping[str, np.ndarray]  # signals (b,) in SI at `time`, for the load strip
    sealed: bool = False


@dataclass(frozen=True)
class Diagnosis:
    """Everything that a report shows."""

    machine: str
    verdict: Verdict
    causes: tuple[Cause, ...]
    pulls: tuple[Pull, ...]
    detection_limits: tuple[Limit, ...]
    unknown: Unknown | None
    gain: tuple[Gain, ...]
    ranked: tuple[Rival, ...]  # the best candidates of the first step, cosines with the first
    cosine: np.ndarray  # (n, n) among the ranked
    nulls: Mapping[str, np.ndarray]  # per family: its largest statistic in every null
    thresholds: Mapping[str, float]  # per family
    observed: Mapping[str, float]  # per family: its largest statistic in these data, first step
    whiteness: tuple[tuple[str, float, float], ...]  # channel, lag-1 correlation before, after
    series: tuple[Series, ...]
    notes: tuple[str, ...]  # what was excluded, extrapolated, held
    seed: int
    catalogue: str  # version
    provenance: Mapping[str, Any]
    plan: Plan | None = None  # of the next experiment, where one was asked for
    support: Support | None = None  # of the first cause
    scene: Scene | None = None  # where it is, for the picture
    traces: tuple[Trace, ...] = ()  # every channel of every run, measured beside the extended model
    channels: tuple[Mapping[str, Any], ...] = ()  # a row each: run, channel, unit, rms, kept, leaps, wrong

    def to_json(self) -> dict[str, Any]:
        """What report.json holds: everything but the series."""
        d = asdict(replace(self, series=(), scene=None, traces=()))
        del d["series"], d["scene"], d["traces"]
        if self.unknown:
            d["unknown"] = {"place": self.unknown.surface, **d["unknown"]}  # as a cause says where it is
        d["cosine"] = self.cosine.tolist()
        d["nulls"] = {family: np.round(np.sort(values), 3).tolist() for family, values in self.nulls.items()}
        return d
