"""What a log drives an artefact with, by what docs/artefact.md says: means over the steps, tables, contacts."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from twin.logs.run import Run
from twin.physics.laws import LAWS

DIFFERENCES = np.sign(np.arange(-32, 33)) * (np.arange(-32, 33) / 32) ** 4 * 100.0
TEMPERATURES = np.linspace(-50.0, 250.0, 121)


def states_of(use: dict) -> list[str]:
    return [name for name in LAWS[use["law"]].states if name not in use["signals"]]


@dataclass(frozen=True)
class Cut:
    """The time of a log cut at all rows and step edges."""

    borders: np.ndarray  # (k + 1,) s
    step: np.ndarray  # (k,)
    sample: np.ndarray  # (k,) the row that holds
    share: np.ndarray  # (k,) of its step
    first: np.ndarray  # (n,) interval of each step

    @classmethod
    def of(cls, time: np.ndarray, dt: float) -> Cut:
        edges = dt * np.arange(max(1, int(np.ceil(time[-1] / dt - 1e-9))) + 1)
        borders = np.union1d(time[(time > 0.0) & (time < edges[-1])], edges)
        step = np.searchsorted(edges, borders[:-1], side="right") - 1
        sample = np.searchsorted(time, borders[:-1], side="right") - 1
        return cls(borders, step, sample, np.diff(borders) / dt, np.searchsorted(step, np.arange(len(edges) - 1)))

    def mean(self, of_rows: np.ndarray) -> np.ndarray:
        """Over the steps (n, ...) of held rows (m, ...); what is constant stays so to the last digit."""
        held = of_rows[self.sample]
        base, share = held[self.first], self.share.reshape(-1, *[1] * (held.ndim - 1))
        return base + np.add.reduceat((held - base[self.step]) * share, self.first, axis=0)

    def switched(self, entries: list[dict], values: dict[str, np.ndarray]) -> np.ndarray:
        """Factors (n, len(entries)) of conductances."""
        factor = np.ones((len(self.first), len(entries)))
        for k, e in enumerate(entries):
            if e["switch"]:
                factor[:, k] += (e["switched"] - 1.0) * self.mean(np.clip(values[e["switch"]], 0.0, 1.0))
        return factor


def signals(load: dict, columns: dict[str, np.ndarray], n: int) -> dict[str, np.ndarray]:
    values = {}
    for s in load["signals"]:
        if s["column"] not in columns:
            values[s["name"]] = np.full(n, s["default"])
            continue
        logged = s["factor"] * columns[s["column"]] / (np.sqrt(2.0) if s["kind"] == "peak" else 1.0)
        lost = ~np.isfinite(logged)  # a gap holds the value before it, at the start the one after it
        last = np.maximum.accumulate(np.where(lost, -1, np.arange(n)))
        values[s["name"]] = logged[np.where(last < 0, np.argmin(lost), last)]
    return values


def law(entry: dict, values: dict[str, np.ndarray], n: int, **states: np.ndarray) -> np.ndarray:
    """Gain times the law of a source or film at n rows, (n,) or (n, m) over m values of its states."""
    use, row = entry["use"], LAWS[entry["use"]["law"]]
    parameters = {name: a.default for name, a in row.parameters.items() if a.default is not None} | use["parameters"]
    given = {name: values[s][:, None] if states else values[s] for name, s in use["signals"].items()}
    found = np.asarray(row.function(**given, **states, **parameters))
    return entry["gain"] * np.broadcast_to(found, (n, found.shape[-1]) if states else (n,))


def drive(load: dict, run: Run, dt: float) -> dict[str, Any]:
    """Means over the steps of all that the log drives."""
    time = run.loads.time - run.loads.time[0]
    n, cut = len(time), Cut.of(time, dt)
    values = signals(load, run.loads.columns, n)
    air = np.stack([(values[e["signal"]] if e["signal"] else np.full(n, e["temperature"])) + e["offset"]
                    + (e["switched_offset"] * values[e["switch"]] if e["switch"] else 0.0)
                    for e in load["environments"]], axis=1)  # fmt: skip
    D: dict[str, Any] = {"environment": cut.mean(air), "film_table": {}, "power_table": {}}
    power, film = np.zeros((n, len(load["sources"]))), np.zeros((n, len(load["films"])))
    for k, s in enumerate(load["sources"]):
        if states_of(s["use"]):
            D["power_table"][k] = cut.mean(law(s, values, n, temperature=TEMPERATURES[None, :]))
        else:
            power[:, k] = law(s, values, n)
    for k, j in enumerate(load["films"]):
        if not states_of(j["use"]):
            film[:, k] = law(j, values, n)
            continue
        alone = not j["use"]["signals"]  # nothing but the air varies within a step: its mean will do
        around = (D["environment"] if alone else air)[:, j["environment"], None]
        grid = {"surface": around + DIFFERENCES, "ambient": around}
        table = law(j, values, len(around), **{name: grid[name] for name in states_of(j["use"])})
        D["film_table"][k] = table if alone else cut.mean(table)
    D |= {"film": cut.mean(film), "gamma": np.zeros((len(cut.first), *[len(load["ports"])] * 2))}
    D["power"] = cut.mean(power) * np.array([not s["contact"] for s in load["sources"]], dtype=float)
    D["joint"] = np.array([j["conductance"] for j in load["joints"]]) * cut.switched(load["joints"], values)
    D["port_heat"] = np.zeros((len(cut.first), len(load["ports"])))
    conductance = cut.switched(load["pairs"], values)
    for k, pair in enumerate(load["pairs"]):
        position = np.interp(cut.borders, time, values[load["axes"][pair["axis"]]["position"]])
        way = pair["station"] + (-1.0 if pair["rail_moves"] else 1.0) * position
        of_contact = [j for j, s in enumerate(load["sources"]) if s["contact"] == pair["contact"]]
        q = power[:, of_contact] / sum(p["contact"] == pair["contact"] for p in load["pairs"])
        rail_share = np.array([load["sources"][j]["rail_share"] for j in of_contact])
        add_pair(load, pair, cut, way, q, rail_share, pair["area"] * pair["conductance"] * conductance[:, k], D)
    return D


def add_pair(
    load: dict,
    pair: dict,
    cut: Cut,
    way: np.ndarray,
    q: np.ndarray,
    rail_share: np.ndarray,
    conductance: np.ndarray,
    D: dict[str, Any],
) -> None:
    """Add a pair to `gamma` (n, ports, ports) [W/K] and `port_heat` (n, ports) [W].

    way (k + 1,) m of the pad on its rail; q (m, s) W of its sources at the rows; conductance (n,) W/K.
    """
    rail = load["rails"][pair["rail"]]
    stations, means = np.array(rail["stations"]), cut.mean(q)
    place, pad = rail["first_port"] + np.arange(len(stations)), pair["pad_port"]
    for i in range(len(cut.first)):
        inside = np.flatnonzero(cut.step == i)
        rests = len({*way[inside], *way[inside + 1]}) == 1
        weight, square, beside = np.zeros((3, len(stations)))
        under = np.zeros((q.shape[1], len(stations)))
        for m in inside[:1] if rests else inside:
            for s, part in dwelling(stations, pair["assignment"], way[m], way[m + 1]):
                w = weights(stations, pair["assignment"], s)
                part *= 1.0 if rests else cut.share[m]
                weight, square, beside = (
                    weight + part * w,
                    square + part * w**2,
                    beside + part * w * np.append(w[1:], 0),
                )
                under += part * np.outer(means[i] if rests else q[cut.sample[m]], w)
        g, gamma, heat = conductance[i], D["gamma"][i], D["port_heat"][i]
        gamma[place, place] += g * square
        gamma[place[1:], place[:-1]] += g * beside[:-1]
        gamma[place[:-1], place[1:]] += g * beside[:-1]
        gamma[place, pad] -= g * weight
        gamma[pad, place] -= g * weight
        gamma[pad, pad] += g
        heat[place] += rail_share @ under
        heat[pad] += (1.0 - rail_share) @ means[i]


def dwelling(stations: np.ndarray, assignment: str, start: float, end: float) -> list[tuple[float, float]]:
    """Points of a straight path and their shares of its time: exact for w^2 between two stations (Gauss)."""
    if start == end:
        return [(start, 1.0)]
    cuts = stations if assignment == "interpolated" else (stations[1:] + stations[:-1]) / 2
    low, high = min(start, end), max(start, end)
    borders = np.unique([low, high, *cuts[(cuts > low) & (cuts < high)]])
    half = 0.5 / np.sqrt(3.0)
    return [
        (a + g * (b - a), 0.5 * (b - a) / (high - low)) for a, b in pairwise(borders) for g in (0.5 - half, 0.5 + half)
    ]


def weights(stations: np.ndarray, assignment: str, s: float) -> np.ndarray:
    w = np.zeros(len(stations))
    if assignment == "segment":
        w[np.searchsorted((stations[1:] + stations[:-1]) / 2, s)] = 1.0
        return w
    left = int(np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2))
    right = np.clip((s - stations[left]) / (stations[left + 1] - stations[left]), 0.0, 1.0)
    w[left], w[left + 1] = 1.0 - right, right
    return w
