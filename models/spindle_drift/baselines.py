"""What a twin of the spindle has to beat: regressions of the displacements, tuned on the training hours alone.

`python baselines.py DATA` prints the rms [um] on the hours after training. Needs numpy only. Every kind of baseline is
tried with many settings: exponents of the speed, time constants, strengths of the ridge. Settings are chosen in two
ways, both without the hours that are scored: by leaving out each speed in turn, and by predicting the third speed from
the first two. The second extrapolates as the test does.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from types import ModuleType

import numpy as np

CHANNELS = ("ch1", "ch3", "ch5")
HOURS = ((0.0, 8.0), (8.0, 16.0), (16.0, 24.0))  # one speed each
STEP = 8  # rows: a value every two minutes decides between settings
RIDGES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
EXPONENTS = (0.5, 1.0, 1.5, 2.0, 3.0)
LAGS = (0.05, 0.15, 0.4, 1.0, 2.5, 6.0, 15.0)  # h, of the spindle's heat
AIR_LAGS = (0.0, 0.15, 0.5, 1.5, 4.0, 10.0)  # h, of the air
SENSOR_LAG = 0.5  # h


@dataclass(frozen=True)
class Table:
    """A recording on one clock, n rows."""

    hour: np.ndarray  # (n,)
    speed: np.ndarray  # (n,) 1/min
    sensors: np.ndarray  # (n, 16) degC
    channels: Mapping[str, np.ndarray]  # (n,) um


@dataclass(frozen=True)
class Scored:
    """One kind of baseline, settings chosen in one way."""

    name: str
    chosen: str
    predicted: Mapping[str, np.ndarray]  # channel -> (m,) um at the rows of the test
    validation: Mapping[str, float]  # channel -> rms [um] on the training hours that chose the settings


def recording(data: Path) -> Table:
    """The measured tables, as make_runs.py reads them."""
    r = _make_runs().read_recording(data)
    sensors = np.column_stack([r.temperatures[f"t{i}"] for i in range(1, 17)])
    return Table(r.time / 3600.0, r.speed, sensors, {name: r.displacements[name] for name in CHANNELS})


def _make_runs() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_runs", Path(__file__).parent / "runs" / "make_runs.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(spec.name, module)  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def lagged(values: np.ndarray, hour: np.ndarray, lag: float) -> np.ndarray:
    """First-order lag [h] of values (n,), at rest at the first one."""
    if lag == 0.0:
        return values - values[0]
    keep = np.exp(-(hour[1] - hour[0]) / lag)
    result = np.zeros_like(values)
    for k in range(1, len(values)):
        result[k] = keep * result[k - 1] + (1.0 - keep) * (values[k - 1] - values[0])
    return result


def kinds(table: Table) -> dict[str, list[np.ndarray]]:
    """Per kind of baseline its candidates: features (n, k) at all rows."""
    hour, air = table.hour, table.sensors[:, 3]
    heat = {(p, a): lagged((table.speed / 5000.0) ** p, hour, a) for p in EXPONENTS for a in LAGS}
    room = {a: lagged(air, hour, a) for a in AIR_LAGS}

    def of_speed(most: int, exponents: Sequence[float]) -> Iterator[np.ndarray]:
        for p in exponents:
            for k in range(1, most + 1):
                for chosen in combinations(LAGS, k):
                    yield np.column_stack([heat[p, a] for a in chosen])

    def of_air() -> Iterator[np.ndarray]:
        for k in (1, 2):
            for chosen in combinations(AIR_LAGS, k):
                yield np.column_stack([room[a] for a in chosen])

    lags = np.column_stack([lagged(s, hour, SENSOR_LAG) for s in table.sensors.T])
    return {
        "spindle only": list(of_speed(3, EXPONENTS)),
        "air only": list(of_air()),
        "spindle and air": [np.hstack([s, a]) for s in of_speed(2, EXPONENTS[1:]) for a in of_air()],
        "16 sensors": [table.sensors],
        "16 sensors with lags": [np.hstack([table.sensors, lags])],
    }


def ridge(x: np.ndarray, y: np.ndarray, train: np.ndarray, strengths: Sequence[float]) -> list[np.ndarray]:
    """Predictions (n,) at all rows by ridge regressions of standardised features x (n, k) on the rows `train`."""
    mean, deviation = x[train].mean(axis=0), x[train].std(axis=0) + 1e-12
    z, level = (x - mean) / deviation, y[train].mean()
    A, b, n = z[train].T @ z[train], z[train].T @ (y[train] - level), int(train.sum())
    return [z @ np.linalg.solve(A + s * n * np.eye(len(A)), b) + level for s in strengths]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def baselines(table: Table) -> list[Scored]:
    """All of them, at the rows after the training hours."""
    hour, few = table.hour, np.arange(len(table.hour)) % STEP == 0
    train, test = hour <= HOURS[-1][1], hour > HOURS[-1][1]
    blocks = [(hour >= a) & (hour < b) for a, b in HOURS]
    folds = {
        "each speed left out": [(train & ~block, block) for block in blocks],
        "third speed predicted": [(hour < HOURS[-1][0], blocks[-1])],
    }
    zero = {c: np.full(int(test.sum()), table.channels[c][0]) for c in CHANNELS}
    last = {c: np.full(int(test.sum()), table.channels[c][train][-1]) for c in CHANNELS}
    nothing = {c: float("nan") for c in CHANNELS}
    found = [Scored("zero", "", zero, nothing), Scored("last of the training", "", last, nothing)]
    for name, candidates in kinds(table).items():
        thin = [x[few] for x in candidates]
        for how, splits in folds.items():
            predicted, validation = {}, {}
            for c in CHANNELS:
                y = table.channels[c]
                best = (np.inf, 0, 0.0)
                for i, x in enumerate(thin):
                    errors: list[list[np.ndarray]] = [[] for _ in RIDGES]
                    for learn, check in splits:
                        for k, p in enumerate(ridge(x, y[few], learn[few], RIDGES)):
                            errors[k].append((p - y[few])[check[few]])
                    for strength, e in zip(RIDGES, errors, strict=True):
                        best = min(best, (rms(np.concatenate(e)), i, strength))
                validation[c] = best[0]
                predicted[c] = ridge(candidates[best[1]], y, train, [best[2]])[0][test]
            found.append(Scored(name, how, predicted, validation))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with loads.csv, temperatures.csv and displacement.csv")
    table = recording(parser.parse_args().data)
    test = table.hour > HOURS[-1][1]
    print(f"{'rms [um], in brackets on the hours that chose':48}" + "".join(f"{c:>15}" for c in CHANNELS))
    for b in baselines(table):
        cells = [f"{rms(b.predicted[c] - table.channels[c][test]):7.2f} ({b.validation[c]:5.2f})" for c in CHANNELS]
        print(f"  {b.name:22}{b.chosen:24}" + "".join(f"{cell:>15}" for cell in cells).replace("(  nan)", "       "))


if __name__ == "__main__":
    main()
