"""An artefact stepped by what docs/artefact.md says, with h5py and NumPy; of `twin` only the laws and the log's reader.

Written from the page alone, not from `twin.run`: where both agree, the page suffices.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np

from tests.reference.log_by_the_page import drive, states_of
from twin.logs.read import read_run

GAMMA, LAST = 0.3345, (17.3493, -13.6346, 3.6868)
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


def of(load: dict, film: dict, key: str) -> float:
    environment = load["environments"][film["environment"]]
    return film["environment"] if key == "at" else environment[key]


def read(table: np.ndarray, place: float) -> float:
    i = min(int(place), len(table) - 2)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


def difference_place(difference: float) -> float:
    size = max(abs(difference), 1e-6)
    return float(np.clip(32.0 * (1.0 + difference / size * (size / 100.0) ** 0.25), 0.0, 64.0))
