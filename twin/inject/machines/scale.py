"""How large the powers of a drawn machine are: so that sensors and TCP move as those of real ones do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.build.simulate import simulate_run
from twin.errors import ModelError
from twin.logs.run import Run
from twin.machine.description import Machine

STEP = 1200.0  # s, of these estimates, and between their TCP rows: what takes hours matters
FACTORS = np.geomspace(0.02, 50.0, 400)  # that are tried; steps of 2 %
ALLOWED = (0.06, 6.0)  # factors of powers: beyond, they are no longer those of machines


@dataclass(frozen=True)
class Wanted:
    """What the warmest sensor [K] and the TCP [m] shall do in a run: ranges, and where in its range the first lies."""

    warmest: float
    rise: tuple[float, float] = (4.0, 11.0)  # K, of the warmest sensor
    moved: tuple[float, float] = (8e-6, 42e-6)  # m, of the TCP; the other machine of a description differs by some 30 %


@dataclass(frozen=True)
class Response:
    """Sensors [K] (n, sensors) and TCP [m] (m, 3) since the start."""

    sensors: np.ndarray
    tcp: np.ndarray

    @property
    def rise(self) -> float:
        """K, of the sensor on the machine that gets warmest."""
        return float(self.sensors.max())

    @property
    def moved(self) -> float:
        """m, the longest displacement of the TCP."""
        return float(np.linalg.norm(self.tcp, axis=1).max())


def response(machine: Machine, run: Run) -> Response:
    """Temperatures of sensors on the machine and displacements of its TCP in a run, less those at the start."""
    temperatures, tcp = run.temperatures, run.tcp
    assert temperatures is not None
    assert tcp is not None  # of simulated runs of machines with a TCP
    parts = [name for name, s in machine.sensors.items() if s.part is not None]
    seen = np.column_stack([temperatures.columns[name] for name in parts])
    return Response(seen - seen[0], tcp.displacement - tcp.displacement[0])


def power_factor(machine: Machine, run: Run, wanted: Wanted) -> float | None:
    """The factor of all sources that brings the warmest sensor nearest to what is wanted, with all in its range.

    From simulations of the full model in steps of STEP: without heat, with the powers as they are, and with the factor
    that these two give where responses are linear. Laws that follow temperatures are not: the last one corrects it.
    None where no factor of ALLOWED will do, and where the powers as they are make it infinitely warm.
    """
    cold, factor = response(machine, simulated(machine, run, 0.0)), 1.0
    for last in (False, True):
        try:
            hot = response(machine, simulated(machine, run, factor))
        except ModelError:  # thermal runaway: a winding whose resistance grows faster than it is cooled
            return None
        better = _better(cold, hot, wanted, strict=last)
        if better is None:
            return None
        factor = min(max(better * factor, ALLOWED[0]), ALLOWED[1]) if not last else better * factor
    return factor if ALLOWED[0] <= factor <= ALLOWED[1] else None


def _better(cold: Response, hot: Response, wanted: Wanted, strict: bool) -> float | None:
    """A factor of the powers of `hot` between and beyond which responses are linear; strict: with all in range."""
    each = [_mixed(cold, hot, f) for f in FACTORS]
    rise, moved = np.array([r.rise for r in each]), np.array([r.moved for r in each])
    good = (wanted.rise[0] <= rise) & (rise <= wanted.rise[1]) & (wanted.moved[0] <= moved) & (moved <= wanted.moved[1])
    if not good.any():
        if strict:
            return None
        good[:] = True
    off = np.where(good, np.abs(np.log(np.maximum(rise, 1e-3) / wanted.warmest)), np.inf)
    return float(FACTORS[off.argmin()])


def simulated(machine: Machine, run: Run, gain: float = 1.0, step: float = STEP) -> Run:
    """The run with what the full model of a machine does in it; gain: of all sources, step [s]."""
    sources = {n: s.model_copy(update={"gain": gain * s.gain}) for n, s in machine.sources.items()}
    return simulate_run(machine.model_copy(update={"sources": sources}), run, step, tcp_every=step)[0]


def _mixed(cold: Response, hot: Response, factor: float) -> Response:
    return Response(cold.sensors + factor * (hot.sensors - cold.sensors), cold.tcp + factor * (hot.tcp - cold.tcp))
