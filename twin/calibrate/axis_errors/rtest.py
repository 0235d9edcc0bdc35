"""R-tests and probing in a run folder: rows of tcp.csv, one measurement after the other, and the axis errors of each.

Paper 000, 0.22 to 0.24: a ball stands on the table, a 3-D probe in the spindle; the rotary axes turn, the linear axes
follow, and the deviations dx, dy, dz (tool minus workpiece) are rows of tcp.csv. Measurements are distinguished by the
time between them, the places of the ball within one by the time it takes to put it elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.calibrate.axis_errors.chain import Chain, ChainAxis
from twin.calibrate.axis_errors.errors import Ranges
from twin.calibrate.axis_errors.fit import AxisErrorFit, fit_axis_errors, rows_needed
from twin.calibrate.axis_errors.htm import rotation, table_rotation
from twin.errors import LogError
from twin.logs.run import Run
from twin.nearest import did_you_mean

GAP = 600.0  # s between measurements
_PAUSE = 3.0  # times the usual interval: the ball has been put elsewhere
_OFF = 1e-3  # m: by how much the logged positions may miss a ball on the table


@dataclass(frozen=True)
class Readings:
    """The usable rows of tcp.csv as the chain needs them."""

    time: np.ndarray  # (n,) s
    position: np.ndarray  # (n, n_linear) m, in the order of `Chain.linear`
    displacement: np.ndarray  # (n, 3) m
    sigma: np.ndarray | None  # (n,) m
    angle: Mapping[str, np.ndarray]  # (n,) rad by letter of each rotary axis that is logged
    where: str  # the file, for messages
    dropped: int = 0  # rows of the file that lack a position, a deviation or a positive sigma

    def take(self, rows: np.ndarray) -> Readings:
        return Readings(
            self.time[rows],
            self.position[rows],
            self.displacement[rows],
            None if self.sigma is None else self.sigma[rows],
            {letter: values[rows] for letter, values in self.angle.items()},
            self.where,
            self.dropped,
        )


@dataclass(frozen=True)
class Measurement:
    """One R-test and what it says."""

    readings: Readings
    fit: AxisErrorFit | None  # None where there are too few rows
    needed: int  # rows for a fit
    balls: int  # places of the ball that were fitted; 0 where they are known

    @property
    def rms(self) -> np.ndarray:
        """(3,) m, of the deviations."""
        return np.asarray(np.sqrt(np.mean(self.readings.displacement**2, axis=0)))


def readings(run: Run, chain: Chain, sigma: float | None = None) -> Readings:
    """The rows of tcp.csv that have all positions and deviations, in order of time.

    sigma [m]: for rows where the file states none. Raises LogError: no tcp.csv, no column for an axis of the chain.
    """
    where = str(run.folder / "tcp.csv")
    tcp = run.tcp
    if tcp is None:
        raise LogError("no tcp.csv", str(run.folder), "R-tests are its rows: time, positions, dx, dy, dz")
    columns = [_column(axis, tcp.axes, where) for axis in chain.linear]
    position = tcp.position[:, columns]
    angles = {name.removesuffix("_position").upper(): values for name, values in tcp.angle.items()}
    angle = {axis.letter: angles[axis.letter] for axis in chain.rotary if axis.letter in angles}
    spread = tcp.sigma if sigma is None else np.full(len(tcp.time), sigma)
    usable = np.isfinite(np.column_stack([tcp.time, position, tcp.displacement])).all(axis=1)
    if spread is not None:
        usable &= np.isfinite(spread) & (spread > 0.0)
    rows = np.flatnonzero(usable)
    rows = rows[np.argsort(tcp.time[rows], kind="stable")]
    dropped = len(tcp.time) - len(rows)
    return Readings(tcp.time, position, tcp.displacement, spread, angle, where, dropped).take(rows)


def _column(axis: ChainAxis, columns: tuple[str, ...], where: str) -> int:
    for name in (axis.letter.lower(), axis.letter, f"{axis.letter.lower()}_position"):
        if name in columns:
            return columns.index(name)
    remedy = f"name it '{axis.letter.lower()} [mm]': {did_you_mean(axis.letter.lower(), columns, 'axis columns')}"
    raise LogError(f"no positions of axis {axis.letter}", where, remedy)


def parts(time: np.ndarray, gap: float) -> list[np.ndarray]:
    """Row numbers of the parts that longer breaks than `gap` [s] divide increasing times (n,) [s] into."""
    if not len(time):
        return []
    return np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) > gap) + 1)


def measurements(read: Readings, chain: Chain, gap: float = GAP, known_balls: bool = True) -> tuple[Measurement, ...]:
    """The axis errors of every measurement; breaks longer than `gap` [s] divide them.

    known_balls: the ball stands where the positions without errors say. Otherwise each placing has an offset of its own
    that is fitted too: this needs the rotary axes' angles. Ranges are those of all rows together, so that the errors of
    one measurement compare with those of the next.
    Raises LogError where no measurement has enough rows, and as `ball_columns`.
    """
    ranges = Ranges.of(chain, read.position) if len(read.time) else Ranges({}, {})
    found = []
    for rows in parts(read.time, gap):
        part = read.take(rows)
        balls = () if known_balls else ball_columns(part, chain)
        needed = rows_needed(chain, len(balls))
        fit = None
        if len(rows) >= needed:
            fit = fit_axis_errors(chain, ranges, part.position, part.displacement, part.sigma, balls)
        found.append(Measurement(part, fit, needed, len(balls)))
    if not any(m.fit for m in found):
        most = max((len(m.readings.time) for m in found), default=0)
        needed = max((m.needed for m in found), default=rows_needed(chain))
        raise LogError(
            f"{most} rows in the longest measurement; {needed} are needed",
            read.where,
            "measure at more poses, or join rows that belong together with a longer --gap",
        )
    return tuple(found)


def ball_columns(part: Readings, chain: Chain) -> tuple[np.ndarray, ...]:
    """Per placing of the ball what an offset of it on the table does to the readings, (n, 3, 3); zero in other rows.

    Raises LogError: angles missing; positions that do not follow balls on a table that turns by these angles.
    """
    missing = [axis.letter for axis in chain.rotary if axis.letter not in part.angle]
    if missing:
        what = f"no angles of axis {', '.join(missing)}"
        raise LogError(what, part.where, f"name the column '{missing[0].lower()} [deg]', or take the balls as known")
    bad = [letter for letter, values in part.angle.items() if not np.isfinite(values).all()]
    if bad:
        raise LogError(f"an angle of axis {bad[0]} is missing", part.where, "complete the row, or take it out")
    interval = float(np.median(np.diff(part.time))) if len(part.time) > 1 else 0.0
    places = parts(part.time, _PAUSE * interval)
    table = table_rotation(chain, part.angle, len(part.time))
    columns = []
    for rows in places:
        block = np.zeros((len(part.time), 3, 3))
        block[rows] = -table[rows]
        columns.append(block)
    _check_places(part, chain, columns)
    return tuple(columns)


def _check_places(part: Readings, chain: Chain, columns: list[np.ndarray]) -> None:
    """Raises LogError where the positions are not those of balls at fixed places on the table."""
    n = len(part.time)
    point = np.zeros((n, 3))
    for k, axis in enumerate(chain.linear):
        point[:, axis.coordinate] += axis.side * axis.sense * part.position[:, k]
    blocks, turn = [np.broadcast_to(np.eye(3), (n, 3, 3))], np.broadcast_to(np.eye(3), (n, 3, 3))
    for axis in chain.rotary[:-1]:  # where the next rotary axis stands on this one
        turn = turn @ rotation(axis.coordinate, axis.sense * part.angle[axis.letter])
        blocks.append(turn)
    design = np.concatenate([*blocks, *columns], axis=2).reshape(3 * n, -1)
    fitted, *_ = np.linalg.lstsq(design, point.ravel(), rcond=None)
    off = np.linalg.norm((point.ravel() - design @ fitted).reshape(n, 3), axis=1)
    worst = int(np.argmax(off))
    if off[worst] > _OFF:
        raise LogError(
            f"at {part.time[worst]:g} s the axes miss a ball on the table by {1e3 * off[worst]:.1f} mm",
            part.where,
            f"check the chain {chain}: a prime (C') turns a sense round. The ball is taken as moved where {_PAUSE:g} "
            "times the usual interval passes between rows",
        )
