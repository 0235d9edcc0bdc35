"""An artefact stepped by what docs/artefact.md says, with h5py and NumPy; of `twin` only the laws and the log's reader.

Written from the page alone, not from `twin.run`: where both agree, the page suffices. What makes it long is what a log
may do: rows anywhere in a step, laws that read a temperature, contacts that move. The same in Octave:
`tests/reference/exports/step_log.m`.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np

from twin.logs.read import read_run
from twin.logs.run import Table
from twin.physics.laws import LAWS

DIFFERENCES = np.sign(np.arange(-32, 33)) * (np.arange(-32, 33) / 32) ** 4 * 100.0  # K, of films
TEMPERATURES = np.linspace(-50.0, 250.0, 121)  # degC, of losses
GAMMA, SIGMA = 0.3345, 5.670374419e-8
STAGES = (1.0, 1.066245258858536, -0.2172086370349149, 7.4015, -9.9478, 3.6868)  # b_i/gamma
AHEAD = (0.0, 1.0, 1.0, 1.0, 0.8994752608617009, 1.0)


def sensors_over(path: Path, folder: Path, dt: float = 60.0) -> np.ndarray:
    """Structural sensors (n + 1, n_sensors) [degC] at the edges of the steps."""
    with h5py.File(path) as f:
        load, certificate = (json.loads(f[name].asstr()[()]) for name in ("load_model", "certificate/json"))
        reference, n_sensors = float(f["reference_temperature"][()]), len(f["sensor"])
        bodies = [{k: v[...] for k, v in f[f"bodies/{name}"].items()} for name in f["body"].asstr()[...]]
    run, films = read_run(folder), load["films"]
    M = assembled(load, bodies, n_sensors)
    air, power, film, joint, gamma, port_heat, places = driven(load, run.loads, dt)
    around = [load["environments"][j["environment"]] for j in films]
    gradient, height, emissivity = np.array(
        [(e["gradient"], e["height"], j["emissivity"]) for e, j in zip(around, films, strict=True)]
    ).T
    left = np.linalg.solve(M["E"].T, M["energy"])
    area = left @ M["M"] + (left @ M["M"] <= 0.0)
    rows = left @ M["A"][: len(films)]
    x = (run.initial_temperature - reference) * M["one"]
    result, held, substeps = [reference + M["C"] @ x], np.array([-1.0]), int(certificate.get("substeps", 1))
    r = substeps / (GAMMA * dt)
    for n in range(len(air)):
        surface, radiant = reference + rows @ x / area, air[n, [j["radiant"] for j in films]]
        at_zero = air[n, [j["environment"] for j in films]] - gradient * height
        H = M["H"] + np.tensordot(places[n], M["raised"], 1)
        difference = surface - at_zero - gradient * (left @ H / area)
        large = np.maximum(np.abs(difference), 1e-6)
        place = 32.0 * (1.0 + difference / large * (large / 100.0) ** 0.25)
        h = np.array([read(table[n], place[k]) for k, table in enumerate(film)])
        s, t = surface + 273.15, radiant + 273.15
        radiation = emissivity * SIGMA * (s**2 + t**2) * (s + t)
        total = h + radiation
        outer = at_zero + radiation / (total + (total <= 0.0)) * (radiant - at_zero)
        theta = np.concatenate([total, joint[n]])
        if n % 64 == 0 or not np.array_equal(gamma[n], gamma[n - 1]) or np.any(np.abs(theta - held) > 0.2 * held):
            held = theta
            S = r * M["E"] + M["A0"] + np.tensordot(held, M["A"], 1) + M["P"] @ gamma[n] @ M["P_out"].T
            inverse = np.linalg.inv(S)
        rest, twice = np.tensordot(theta - held, M["A"], 1), np.any(np.abs(theta - held) > 0.1 * held)
        forcing = M["M"] @ (total * (outer - reference)) + H @ (h * gradient) + M["P"] @ port_heat[n]
        for _ in range(substeps):
            new = earlier = y = x
            for weight, ahead in zip(STAGES, AHEAD, strict=True):
                winding = reference + M["B_out"].T @ (y + ahead * (y - earlier))
                q = [read(table[n], (winding[s] + 50.0) / 2.5) for s, table in enumerate(power)]
                known = forcing + M["B"] @ q + r * M["E"] @ y
                made = inverse @ (known - rest @ y)
                if twice:
                    made = inverse @ (known - rest @ made)
                new, earlier, y = new + weight * (made - y), y, made
            x = new
        result.append(reference + M["C"] @ x)
    return np.array(result)


def assembled(load: dict, bodies: list[dict], n_sensors: int) -> dict[str, np.ndarray]:
    """One machine of all bodies: states one after the other, everything else at its index in the scales of the file."""
    ends, n_films = np.cumsum([len(b["one"]) for b in bodies]), len(load["films"])
    N, n_theta = ends[-1], n_films + len(load["joints"])
    columns = {"M": ("theta", n_theta), "H": ("theta", n_theta), "B": ("sources", len(load["sources"]))}
    columns |= {"B_out": columns["B"], "P": ("ports", len(load["ports"])), "P_out": ("ports", len(load["ports"]))}
    m = {key: np.zeros((N, count)) for key, (_, count) in columns.items()}
    m |= {"E": np.zeros((N, N)), "A0": np.zeros((N, N)), "A": np.zeros((n_theta, N, N)), "C": np.zeros((n_sensors, N))}
    m |= {key: np.concatenate([b[key] for b in bodies]) for key in ("one", "energy")}
    m["raised"] = np.zeros((len(load["axes"]), N, n_theta))
    for b, end in zip(bodies, ends, strict=True):
        at, b = slice(end - len(b["one"]), end), {"B_out": b["B"], "P_out": b["P"], "H": 0.0 * b["M"]} | b
        m["E"][at, at], m["A0"][at, at], m["A"][b["theta"], at, at] = b["E"], b["A0"], b["A"]
        m["C"][b["sensors"], at], m["raised"][:, at, b["theta"]] = b["C"], b.get("raised", 0.0)
        for key, (index, _) in columns.items():
            m[key][at, b[index]] = b[key]
    return m | {key: m[key][..., :n_films] for key in ("M", "H", "raised")}


class Cut:
    """The time of a log cut at all rows and step edges."""

    def __init__(self, time: np.ndarray, dt: float):
        self.n = max(1, int(np.ceil(time[-1] / dt - 1e-9)))
        edges = dt * np.arange(self.n + 1)
        self.borders = np.union1d(time[time < edges[-1]], edges)
        self.step = np.searchsorted(edges, self.borders[:-1], side="right") - 1
        self.row = np.searchsorted(time, self.borders[:-1], side="right") - 1  # that holds
        self.share, self.first = np.diff(self.borders) / dt, np.searchsorted(self.step, np.arange(self.n))

    def mean(self, v: np.ndarray) -> np.ndarray:
        """Over the steps (n, ...) of rows (n_rows, ...); what is constant stays so to the last digit."""
        base, share = v[self.row[self.first]], self.share.reshape(-1, *[1] * (v.ndim - 1))
        return base + np.add.reduceat((v[self.row] - base[self.step]) * share, self.first)


def signals(load: dict, columns: dict[str, np.ndarray], n_rows: int) -> dict[str, np.ndarray]:
    values = {}
    for s in load["signals"]:
        v = columns.get(s["column"], np.full(n_rows, s["default"]))
        v = v * s["factor"] / (2**0.5 if s["kind"] == "peak" else 1)
        last = np.maximum.accumulate(np.where(np.isfinite(v), np.arange(n_rows), -1))  # a gap holds what was before it
        values[s["name"]] = v[np.where(last < 0, np.argmax(np.isfinite(v)), last)]
    return values


def law(entry: dict, values: dict[str, np.ndarray], air: np.ndarray) -> np.ndarray:
    """Gain times a law at rows, (n_rows, 1), or its table over the temperature that it reads; air (n_rows,) degC."""
    row, use = LAWS[entry["use"]["law"]], entry["use"]
    grid = {"temperature": TEMPERATURES[None, :], "surface": air[:, None] + DIFFERENCES, "ambient": air[:, None]}
    given = {name: grid[name] for name in row.states} | {name: values[s][:, None] for name, s in use["signals"].items()}
    fixed = {name: p.default for name, p in row.parameters.items() if p.default is not None} | use["parameters"]
    found = np.atleast_1d(entry["gain"] * np.asarray(row.function(**given, **fixed)))
    return np.broadcast_to(found, (len(air), found.shape[-1]))


def driven(load: dict, loads: Table, dt: float) -> tuple:
    """What the log drives, step by step: air, losses, films, joints, contacts (n, ports, ports), their heat, places."""
    time, n_rows = loads.time - loads.time[0], len(loads.time)
    cut, values = Cut(time, dt), signals(load, loads.columns, n_rows)
    air = np.stack([(values[e["signal"]] if e["signal"] else np.full(n_rows, e["temperature"])) + e["offset"]
                    + e["switched_offset"] * (values[e["switch"]] if e["switch"] else 0.0)
                    for e in load["environments"]], axis=1)  # fmt: skip
    means = cut.mean(air)
    film = [cut.mean(law(j, values, air[:, j["environment"]])) if j["use"]["signals"]  # else only the air can vary
            else law(j, values, means[:, j["environment"]]) for j in load["films"]]  # fmt: skip
    rows = [law(s, values, air[:, 0]) for s in load["sources"]]
    power = [cut.mean(p) for p in rows]

    def conductance(e: dict) -> np.ndarray:
        on = cut.mean(np.clip(values[e["switch"]], 0.0, 1.0)) if e["switch"] else np.zeros(cut.n)
        return e.get("area", 1.0) * e["conductance"] * (1.0 + (e["switched"] - 1.0) * on)

    joint = np.array([conductance(j) for j in load["joints"]]).reshape(-1, cut.n).T
    gamma, heat = np.zeros((cut.n, *[len(load["ports"])] * 2)), np.zeros((cut.n, len(load["ports"])))
    for pair in load["pairs"]:
        way = np.interp(cut.borders, time, values[load["axes"][pair["axis"]]["position"]])
        way = pair["station"] + (-way if pair["rail_moves"] else way)
        own = [k for k, s in enumerate(load["sources"]) if s["contact"] == pair["contact"]]
        divisor = sum(e["contact"] == pair["contact"] for e in load["pairs"])
        q = [np.hstack([np.zeros((len(p[0]), 0)), *(p[k] for k in own)]) / divisor for p in (rows, power)]
        rail_share = np.array([load["sources"][k]["rail_share"] for k in own])
        add_pair(load["rails"][pair["rail"]], pair, cut, way, conductance(pair), rail_share, (*q, gamma, heat))
    on_surfaces = [p * (not s["contact"]) for p, s in zip(power, load["sources"], strict=True)]
    return means, on_surfaces, film, joint, gamma, heat, mean_places(load, values, cut, time)


def mean_places(load: dict, values: dict[str, np.ndarray], cut: Cut, time: np.ndarray) -> np.ndarray:
    """Where the axes stand in the mean over each step (n, n_axes) [m]."""
    ways = [np.interp(cut.borders, time, values[a["position"]]) for a in load["axes"]]
    places = [np.add.reduceat((w[1:] + w[:-1]) / 2 * cut.share, cut.first) for w in ways]
    return np.reshape(places, (-1, cut.n)).T


def add_pair(
    rail: dict, pair: dict, cut: Cut, way: np.ndarray, g: np.ndarray, rail_share: np.ndarray, of: tuple
) -> None:
    """Add a pair to gamma [W/K] and port heat [W]; of: its heat at the rows and its means, what is added to."""
    by_row, means, gamma, heat = of
    stations = np.array(rail["stations"])
    ports = np.array([*(rail["first_port"] + np.arange(len(stations))), pair["pad_port"]])
    for i, (begin, end) in enumerate(pairwise([*cut.first, len(cut.step)])):
        rests = np.ptp(way[begin : end + 1]) == 0.0
        for m in range(begin, begin + 1 if rests else end):
            w, part = facing(stations, pair["assignment"], way[m], way[m + 1])
            part, now = (part, means[i]) if rests else (part * cut.share[m], by_row[cut.row[m]])
            d = np.vstack([-w, np.ones(len(part))])
            gamma[np.ix_([i], ports, ports)] += g[i] * (d * part) @ d.T
            heat[i, ports[:-1]] += rail_share @ now * (w @ part)
        heat[i, pair["pad_port"]] += (1.0 - rail_share) @ means[i]


def facing(stations: np.ndarray, assignment: str, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the segments (stations, m) at points of a straight path, and the shares of its time: exact for w^2."""
    straight = assignment == "interpolated"
    cuts = stations if straight else (stations[1:] + stations[:-1]) / 2
    borders = np.unique(np.clip([start, end, *cuts], min(start, end), max(start, end)))
    s, part = borders, np.ones(1)
    if start != end:
        middle, half = (borders[1:] + borders[:-1]) / 2, np.diff(borders) / 2
        s = np.concatenate([middle - half / np.sqrt(3.0), middle + half / np.sqrt(3.0)])
        part = np.tile(half, 2) / abs(end - start)
    every = np.eye(len(stations))
    w = np.array([np.interp(s, stations, e) for e in every]) if straight else every[:, np.searchsorted(cuts, s)]
    return w, part


def read(table: np.ndarray, place: float) -> float:
    """A table at a place, held at its ends; of one number that."""
    return float(np.interp(place, np.arange(len(table)), table)) if len(table) > 1 else float(table[0])
