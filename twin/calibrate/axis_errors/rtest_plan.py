"""Plans of dynamic R-tests: where the axes stand while the probe follows a ball on the turning table.

Two ways of "circular movements by turning both rotary axes" (paper 000, section 3.3):

- "indexed": the table stands at 0 and 180 degrees, the swivel sweeps: one linear axis then only ever stands at two
  positions, and its straightness, a parabola, cannot be told from the shift: 15 of 21 errors;
- "circles": the table goes full circle with the swivel at zero, then the swivel sweeps: 17 of 21.

The paper says that it obtains 15 and not by which plan; docs/axis_errors.md has the ranks of more plans.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.calibrate.axis_errors.chain import Chain
from twin.calibrate.axis_errors.htm import table_rotation
from twin.errors import ModelError
from twin.logs.run import Tcp

Kind = Literal["indexed", "circles"]
PER_SWEEP, PER_CIRCLE = 7, 12  # rows
MOVE = 4.0  # times the interval between rows that it takes to put the ball elsewhere


@dataclass(frozen=True)
class Plan:
    """Rows of an R-test."""

    chain: Chain
    time: np.ndarray  # (n,) s
    position: np.ndarray  # (n, n_linear) m, in the order of `Chain.linear`
    angle: Mapping[str, np.ndarray]  # (n,) rad by letter
    ball: np.ndarray  # (n,) int: which placing of the ball

    def tcp(self, displacement: np.ndarray, sigma: float | None = None) -> Tcp:
        """Rows of tcp.csv with these readings (n, 3) [m] and their standard deviation [m]."""
        order = sorted(range(len(self.chain.linear)), key=lambda k: self.chain.linear[k].letter)
        return Tcp(
            self.time,
            tuple(self.chain.linear[k].letter.lower() for k in order),
            self.position[:, order],
            displacement,
            None if sigma is None else np.full(len(self.time), sigma),
            angle={letter.lower(): values for letter, values in self.angle.items()},
        )


def planned(plans: Sequence[Plan], sigma: float | None = None) -> Tcp:
    """Rows of tcp.csv of R-tests one after the other, deviations NaN: for truth to be filled in by `replace`.

    `twin.calibrate.score.compare.simulated_tcp` computes them at these times and positions. sigma [m]: of every
    component.
    """
    rows = [plan.tcp(np.full((len(plan.time), 3), np.nan), sigma) for plan in plans]
    return Tcp(
        np.concatenate([t.time for t in rows]),
        rows[0].axes,
        np.vstack([t.position for t in rows]),
        np.vstack([t.displacement for t in rows]),
        None if sigma is None else np.concatenate([np.full(len(t.time), sigma) for t in rows]),
        angle={name: np.concatenate([t.angle[name] for t in rows]) for name in rows[0].angle},
    )


def rtest_plan(
    chain: Chain,
    kind: Kind = "indexed",
    stands: Sequence[float] = (-0.3, -0.42),
    radius: float = 0.15,
    swing: float = np.deg2rad(30.0),
    centre: Mapping[str, float] | None = None,
    start: float = 0.0,
    interval: float = 9.0,
) -> Plan:
    """A plan for a machine with three linear axes and two rotary axes that turn the table: swivel, then table.

    stands [m]: one placing of the ball each, its distance from the swivel's axis along the table's (negative: against
    the machine coordinate). radius [m]: from the table's axis, halfway between the other two coordinates. swing [rad]:
    of the swivel to either side. centre [m]: by letter, positions where the tool would stand where the two rotary axes
    cross, zero by default. start, interval [s]: of the rows; between placings `MOVE` intervals pass.
    Raises ModelError for other chains, and rotary axes about the same coordinate.
    """
    if len(chain.linear) != 3 or len(chain.rotary) != 2 or chain.rotary[0].letter == chain.rotary[1].letter:
        what = f"no plan for the chain {chain}"
        raise ModelError(what, "chain", "plans are for X, Y, Z, a swivel and a table, for example w-C-B-Z-b-X-Y-t")
    swivel, table = chain.rotary
    sweep = np.linspace(-swing, swing, PER_SWEEP)
    zeros = np.zeros(PER_SWEEP)
    if kind == "indexed":
        swivels, tables = np.concatenate([sweep, sweep[::-1]]), np.concatenate([zeros, zeros + np.pi])
    else:
        round_table = np.linspace(0.0, 2.0 * np.pi, PER_CIRCLE, endpoint=False)
        swivels, tables = np.concatenate([0.0 * round_table, sweep]), np.concatenate([round_table, zeros])
    n, balls = len(swivels), len(stands)
    angle = {swivel.letter: np.tile(swivels, balls), table.letter: np.tile(tables, balls)}
    places = np.full((balls, 3), radius / np.sqrt(2.0))
    places[:, table.coordinate] = stands
    ball = np.repeat(np.arange(balls), n)
    point = np.einsum("nij,nj->ni", table_rotation(chain, angle, n * balls), places[ball])
    position = np.column_stack(
        [a.side * a.sense * point[:, a.coordinate] + (centre or {}).get(a.letter, 0.0) for a in chain.linear]
    )
    time = start + interval * (np.arange(n * balls) + (MOVE - 1.0) * ball)
    return Plan(chain, time, position, angle, ball)
