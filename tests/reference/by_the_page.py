"""An artefact stepped by what docs/artefact.md says, with h5py and NumPy; of `twin` only the laws and the log's reader.

Written from the page alone, not from `twin.run`: where both agree, the page suffices.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.logs.read import read_run
from twin.logs.run import Run
from twin.physics.laws import LAWS

GAMMA, LAST = 0.3345, (17.3493, -13.6346, 3.6868)
DIFFERENCES = np.sign(np.arange(-32, 33)) * (np.arange(-32, 33) / 32) ** 4 * 100.0
TEMPERATURES = np.linspace(-50.0, 250.0, 121)
SIGMA, ZERO = 5.670374419e-8, 273.15


def sensors_over(path: Path, folder: Path, dt: float = 60.0) -> np.ndarray:
    """Structural sensors (n + 1, n_sensors) [degC] at the edges of the steps."""
    with h5py.File(path) as f:
        load = json.loads(f["load_model"].asstr()[()])
        certificate = json.loads(f["certificate/json"].asstr()[()])
        reference = float(f["reference_temperature"][()])
        bodies = [{k: v[...] for k, v in f[f"bodies/{name}"].items()} for name in f["body"].asstr()[...]]
        n_sensors = len(f["sensor"])
    M = assembled(load, bodies, n_sensors)
    run = read_run(folder)
    D = drive(load, run, dt)
    x = (run.initial_temperature - reference) * M["one"]
    b, ahead = tableau()
    result, held, inverse = [reference + M["C"] @ x], np.zeros(0), np.zeros((0, 0))
    substeps = int(certificate.get("substeps", 1))
    r = substeps / (GAMMA * dt)
    n_films, film = len(load["films"]), load["films"]
    follows = [k for k, s in enumerate(load["sources"]) if states_of(s["use"])]
    for n in range(len(D["power"])):
        # films at the surface temperatures of the step's start
        environment, h = D["environment"][n], D["film"][n].copy()
        at, gradient, height = (np.array([of(load, j, key) for j in film]) for key in ("at", "gradient", "height"))
        radiant = environment[[j["radiant"] for j in film]]
        surface = reference + (M["rows"] @ x) / M["area"]
        air = environment[at.astype(int)] + gradient * (M["moment"] / M["area"] - height)
        for k, table in D["film_table"].items():
            h[k] = read(table[n], difference_place(surface[k] - air[k]))
        emissivity = np.array([j["emissivity"] for j in film])
        s, t = surface + ZERO, radiant + ZERO
        hr = emissivity * SIGMA * (s**2 + t**2) * (s + t)
        at_zero = environment[at.astype(int)] - gradient * height
        share = hr / np.where(h + hr > 0.0, h + hr, 1.0)
        rise = at_zero + share * (radiant - at_zero) - reference
        theta = np.concatenate([h + hr, D["joint"][n]])

        def powers(state: np.ndarray, n: int = n) -> np.ndarray:
            q = D["power"][n].copy()
            for k in follows:
                place = np.clip((reference + M["Bo"][k] @ state + 50.0) / 2.5, 0.0, 120.0)
                q[k] = read(D["power_table"][k][n], place)
            return q

        # the factor is kept while contacts stay and no coefficient has left it by a fifth, for 64 steps at most
        stays = n % 64 > 0 and np.array_equal(D["gamma"][n], D["gamma"][n - 1])
        if not stays or np.any(np.abs(theta - held) > 0.2 * held):
            held = theta
            A = M["A0"] + np.tensordot(held, M["A"], 1) + M["P"] @ D["gamma"][n] @ M["Po"]
            inverse = np.linalg.inv(r * M["E"] + A)
        rest = np.tensordot(theta - held, M["A"], 1)
        twice = np.any(np.abs(theta - held) > 0.1 * held)
        forcing = M["M"] @ (theta[:n_films] * rise) + M["H"] @ (h * gradient) + M["P"] @ D["port_heat"][n]
        for _ in range(substeps):
            new = earlier = y = x
            for k, weight in enumerate(b):
                f = forcing + M["B"] @ powers(y + ahead[k] * (y - earlier)) + r * M["E"] @ y
                made = inverse @ (f - rest @ y)
                if twice:
                    made = inverse @ (f - rest @ made)
                new = new + weight / GAMMA * (made - y)
                earlier, y = y, made
            x = new
        result.append(reference + M["C"] @ x)
    return np.array(result)


def tableau() -> tuple[np.ndarray, np.ndarray]:
    """Weights b of the six stages, and by how much of the last change each reads its sources ahead."""
    i = np.arange(1.0, 7.0)
    conditions = np.stack([i**0, GAMMA * i, GAMMA**2 * i * (i + 1.0)])
    beta = np.array([*np.linalg.solve(conditions[:, :3], 1.0 - conditions[:, 3:] @ LAST), *LAST])
    b = GAMMA * beta[::-1].cumsum()[::-1]
    c = np.where(i == 1.0, 0.0, GAMMA * i)
    most = np.argmax(np.abs(b))
    c[most] += (0.5 - b @ c) / b[most]
    return b, np.array([0.0, *(c[1:] / GAMMA - i[:-1])])


def assembled(load: dict, bodies: list[dict], n_sensors: int) -> dict[str, np.ndarray]:
    """One machine of all bodies: states one after the other, columns and rows at their global index."""
    sizes = [len(b["one"]) for b in bodies]
    N, ends = sum(sizes), np.cumsum([0, *sizes])
    count = {"theta": len(load["films"]) + len(load["joints"]), "ports": len(load["ports"])}
    count |= {"sources": len(load["sources"]), "films": len(load["films"])}
    M = {key: np.zeros((N, N)) for key in ("E", "A0")} | {"A": np.zeros((count["theta"], N, N))}
    M |= {"M": np.zeros((N, count["films"])), "H": np.zeros((N, count["films"])), "B": np.zeros((N, count["sources"]))}
    M |= {"P": np.zeros((N, count["ports"])), "Po": np.zeros((count["ports"], N)), "C": np.zeros((n_sensors, N))}
    M |= {"Bo": np.zeros((count["sources"], N)), "one": np.zeros(N), "rows": np.zeros((count["films"], N))}
    M |= {"area": np.zeros(count["films"]), "moment": np.zeros(count["films"])}
    for b, (i, j) in zip(bodies, pairwise(ends), strict=True):
        s = slice(i, j)
        left = b["one"] if "P_out" not in b else np.linalg.solve(b["E"].T, b["energy"])
        M["E"][s, s], M["A0"][s, s], M["one"][s] = b["E"], b["A0"], b["one"]
        M["B"][s, b["sources"]], M["Bo"][b["sources"], s] = b["B"], b.get("B_out", b["B"]).T
        M["P"][s, b["ports"]], M["Po"][b["ports"], s] = b["P"], b.get("P_out", b["P"]).T
        M["C"][b["sensors"], s] = b["C"]
        for column, k in enumerate(b["theta"]):
            M["A"][k, s, s] = b["A"][column]
            if k < count["films"]:
                M["M"][s, k] = b["M"][:, column]
                M["rows"][k, s] = left @ b["A"][column]
                M["area"][k] += left @ b["M"][:, column]
                if "H" in b:
                    M["H"][s, k] = b["H"][:, column]
                    M["moment"][k] += left @ b["H"][:, column]
    M["area"][M["area"] <= 0.0] = 1.0
    return M


def states_of(use: dict) -> list[str]:
    return [name for name in LAWS[use["law"]].states if name not in use["signals"]]


def of(load: dict, film: dict, key: str) -> float:
    environment = load["environments"][film["environment"]]
    return film["environment"] if key == "at" else environment[key]


def read(table: np.ndarray, place: float) -> float:
    i = min(int(place), len(table) - 2)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


def difference_place(difference: float) -> float:
    size = max(abs(difference), 1e-6)
    return float(np.clip(32.0 * (1.0 + difference / size * (size / 100.0) ** 0.25), 0.0, 64.0))


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
