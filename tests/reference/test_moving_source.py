"""A nut that heats a bar while it moves along it: once along most of it, and to and fro within every minute.

Exact: Green's function of the rod with insulated ends and loss from its side, as a cosine series (Carslaw and Jaeger,
Conduction of Heat in Solids, 2nd ed., Oxford 1959, chapter 14), integrated over the path. It is held against the
quasi-steady field around a source that moves along an infinite rod (Rosenthal, Trans. ASME 68, 1946; Carslaw and
Jaeger, section 10.7).

The model shares a pad's heat between the segments next to it, which on average spreads it with the second moment h^2/12
+ h^2/6 of segments of length h: that of a pad of length 3^(1/2) h.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.reference import described as d
from tests.reference.models import Steps, run_both
from tests.reference.row import Case, judge
from twin.build.pipeline import BuildOptions
from twin.build.rich_basis import RichOptions

pytestmark = pytest.mark.slow

SOURCE = "Carslaw, Jaeger 1959, ch. 14 and 10.7; Rosenthal 1946"
AT = (0.05, 0.2, 0.3, 0.45)  # m
SEGMENTS = 60
STATES = 60
LOW, HIGH = 0.1, 0.5  # m, stroke
SPAN = 0.02  # m: two segments. Nearer to the nut the model spreads its heat over them, and nothing is compared


@dataclass(frozen=True)
class Rod:
    """Insulated at its ends; one side loses heat to zero. Where nothing is said, numbers of the tests."""

    length: float = 0.6  # m
    width: float = 0.02
    thickness: float = 0.002
    conductivity: float = 160.0  # W/(m K)
    capacity: float = 2700.0 * 900.0  # J/(m^3 K)
    film: float = 5.0  # W/(m^2 K)

    @property
    def diffusivity(self) -> float:
        return self.conductivity / self.capacity

    @property
    def loss(self) -> float:
        """1/s: rate at which the rod cools."""
        return self.film / (self.capacity * self.thickness)

    @property
    def per_watt(self) -> float:
        """K m/(W s): rise of a metre of the rod by a watt in a second."""
        return 1.0 / (self.capacity * self.width * self.thickness)

    def swept(
        self, x: float, time: np.ndarray, start: float, speed: float, pad: float, terms: int = 2000
    ) -> np.ndarray:
        """K (n,) per watt at x, of a pad of that length [m] that leaves `start` at time zero with `speed`."""
        n = np.arange(terms)
        k = n * np.pi / self.length
        decay = self.diffusivity * k**2 + self.loss
        norm = np.where(n == 0, 1.0, 2.0) / self.length
        spread = np.sinc(n * pad / (2 * self.length))
        # int_0^t exp(-decay (t - tau)) cos(k (start + speed tau)) dtau
        turned = np.exp(1j * k * speed * time[:, None]) - np.exp(-decay * time[:, None])
        memory = (np.exp(1j * k * start) * turned / (decay + 1j * k * speed)).real
        return np.asarray(self.per_watt * memory @ (norm * spread * np.cos(k * x)))

    def heated(self, x: float, time: np.ndarray, low: float, high: float, terms: int = 2000) -> np.ndarray:
        """K (n,) per watt at x, of heat spread evenly between low and high [m] from time zero on."""
        return self.swept(x, time, (low + high) / 2, 0.0, high - low, terms)

    def quasi_steady(self, ahead: np.ndarray, speed: float) -> np.ndarray:
        """K per watt in an infinite rod at distances [m] ahead of a point source that has always moved."""
        root = np.sqrt(speed**2 + 4 * self.diffusivity * self.loss)
        return self.per_watt / root * np.exp(-(speed * ahead + root * np.abs(ahead)) / (2 * self.diffusivity))


ROD = Rod()


def moving(name: str, segments: int, *pairs: tuple[str, str]) -> str:
    return (
        f'[contacts.{name}]\nkind = "moving"\naxis = "x"\npairs = {[list(p) for p in pairs]}\nsegments = {segments}\n'
        "conductance = 1e-6\nstiffness = { axial = 1e7, normal = 1e7, lateral = 1e7 }\n"
    )


def description() -> str:
    """The rod as a rail, with a nut that hardly touches it and gives all of a source's heat, 1 W, to it."""
    size, sides = (ROD.length, ROD.width, ROD.thickness), "x_min x_max y_min y_max"
    rigid = (1e15, 0.3, 1e-5)  # as good as that: heat alone counts
    return (
        d.head("rod")
        + d.material("aluminium", ROD.conductivity, 2700.0, 900.0, rigid)
        + d.box("rod", "aluminium", size, (SEGMENTS, 1, 1), f"{sides} z_max")
        + d.box("nut", "aluminium", (0.02, 0.02, 0.01), (1, 1, 1), "z_min",
                (-0.01, 0.0, ROD.thickness))
        + f'[axes.x]\ndirection = [1.0, 0.0, 0.0]\nstroke = {[LOW, HIGH]}\ncarries = ["nut"]\nposition = "x"\n'
        + f'[signals.x]\nunit = "m"\nrange = {[LOW, HIGH]}\n'
        + moving("nut", SEGMENTS, ("rod.z_max", "nut.z_min"))
        # what the nut hangs on: a body that moves along one bar alone would be free to tilt
        + d.box("guide", "aluminium", (ROD.length, 1.0, 0.1), (4, 1, 1), "y_min y_max",
                (0.0, -0.5, 0.5))
        + moving("guide", 4, ("guide.y_min", "nut.y_min"), ("guide.y_max", "nut.y_max"))
        + d.held("guide").replace("[supports.", "[supports.guide_")
        + '[sources.nut]\nlaw = "constant_heat"\ncontact = "nut"\nrail_share = 1.0\nparameters = { power = 1.0 }\n'
        + d.constant_air("air", 0.0)
        + d.film("air", ROD.film, "rod.z_min", "air")
        # training goes to steady states, and a body that only moving contacts join to others has none by itself
        + d.film("others", ROD.film, "nut.* guide.*", "air")
        # where a side heated from above, q (z^2 / 2 t - t / 6) / k, is as warm as its mean
        + "".join(d.sensor(f"s{i}", "rod", (x, ROD.width / 2, ROD.thickness / 3.0**0.5)) for i, x in enumerate(AT))
        + d.displaced("nut.z_max", (0.0, 0.0, 0.02), "rod.x_min")
        + d.held("rod", "x_min", "z_min", "y_max")
    )  # fmt: skip


def both_models(folder: Path, time: np.ndarray, x: np.ndarray, steps: Steps) -> tuple[np.ndarray, ...]:
    """Times (n,) [s], and temperatures (n, k) of the full and of the reduced model for a nut at x [m]."""
    # compressed as a machine is, with fewer training scenarios: a rich model of up to 500 states is kept whole
    options = BuildOptions(states=STATES, training=9, rich=RichOptions(shift_high=1.0 / (0.343 * steps.dt)))
    both = run_both(folder, description(), time, {"x": ("m", x)}, steps, options)
    assert both.states == STATES
    models = (both.full, both.reduced)
    return both.full.time[1:], *(np.column_stack([m.temperature[f"s{i}"][1:] for i in range(len(AT))]) for m in models)


@pytest.mark.long
def test_nut_moves_once_along_a_bar(tmp_path: Path):
    # in steps of a quarter of a minute: within a step the heat is spread evenly over the way of the nut
    duration, pad = 7200.0, 3.0**0.5 * ROD.length / SEGMENTS
    speed = (HIGH - LOW) / duration
    time, full, reduced = both_models(tmp_path, np.array([0.0, duration]), np.array([LOW, HIGH]), Steps(dt=15.0))
    exact = np.column_stack([ROD.swept(x, time, LOW, speed, pad) for x in AT])
    away = np.abs(np.array(AT) - (LOW + speed * time)[:, None]) > SPAN
    assert 0.8 < away.mean() < 1.0
    judge(
        Case("nut moves once along a bar", SOURCE, "T at 4 places, every 15 s of 2 h, 20 mm and more from the nut"),
        exact[away], full[away], reduced[away],
    )  # fmt: skip


@pytest.mark.long
def test_nut_moves_to_and_fro(tmp_path: Path):
    turns = 720
    x = np.where(np.arange(turns + 1) % 2, 0.45, 0.15)
    time, full, reduced = both_models(tmp_path, np.arange(turns + 1) * 10.0, x, Steps())
    exact = np.column_stack([ROD.heated(x, time, 0.15, 0.45) for x in AT])
    judge(
        Case("nut moves to and fro, 20 s a cycle", SOURCE, "T at 4 places, every minute of 2 h"), exact, full, reduced
    )


def test_the_series_has_the_quasi_steady_field_of_an_infinite_rod():
    long, speed, time = Rod(length=8.0), 1e-4, np.array([20000.0])
    for ahead in (-0.3, -0.05, 0.02, 0.1):
        at = 1.0 + speed * time[0] + ahead
        exact = long.quasi_steady(np.array([ahead]), speed)
        assert long.swept(at, time, 1.0, speed, 1e-6, 20000) == pytest.approx(exact, rel=1e-4)
