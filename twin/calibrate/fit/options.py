"""How runs are stepped and compared in a fit."""

from __future__ import annotations

from dataclasses import dataclass

from twin.calibrate.fit.measured import BIN


@dataclass(frozen=True)
class Options:
    """How runs are stepped and compared."""

    dt: float = 60.0  # s
    substeps: int = 1
    bin_length: float = BIN  # s, of temperature means
    temperature_sigma: float = 0.1  # K, noise of a single temperature sample
    tcp_sigma: float = 1e-6  # m, where tcp.csv has no sigma
    initial_sigma: float = 0.3  # K, prior of the parts' initial temperatures in runs that do not state theirs
    form_tolerance: float = (
        0.03  # by which every source's effect on every output may be wrong, see `twin.calibrate.fit.noise`
    )
    exclude: tuple[str, ...] = ()  # sensors
    weights: bool = True  # hours of a channel that fit far worse than its others lose weight
    tail: float = 5e-8  # share of the squared trajectories, in units of the noise, that the window model leaves out
    draws: int = 10  # of parameters, besides the nominal ones, that the window model is made from
    seed: int = 1
