"""Small dense machines with known structure, made from random numbers: bodies of a chain x, y, ... with rails and pads.

Every body comes from a random network of conductances, so that E, A0, A_k are what a finite-element model and its
Galerkin projections give: symmetric, positive (semi)definite, 1 in the null space of conduction and joints.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from twin.rom.load_model import (
    AxisWiring,
    EnvironmentWiring,
    Film,
    Joint,
    LawUse,
    LoadModel,
    Pair,
    Rail,
    Signal,
    Source,
)
from twin.rom.model import AffineBody, MachineModel

AXES = ("x", "y", "z")
NO_USE = LawUse("constant_film", {"natural": 8.0}, {})


def load_model(n_bodies: int = 3, n_segments: int = 8, pads: int = 2) -> LoadModel:
    """A chain: body b carries rail and screw of axis b, body b + 1 its carriages and nut; every second rail moves."""
    axes, signals, sources, films, rails, pairs, ports = [], [], [], [], [], [], []
    signals.append(Signal("ambient", "ambient", "degC", "value", 10.0, 40.0))
    for b in range(n_bodies - 1):
        a = AXES[b]
        axes.append(AxisWiring(a, tuple(np.eye(3)[b]), 0.0, 0.8, f"{a}_position"))
        signals += [
            Signal(f"{a}_position", f"{a}_position", "m", "value", 0.0, 0.8),
            Signal(f"{a}_speed", f"{a}_speed", "m/s", "value", -1.0, 1.0),
            Signal(f"{a}_current", f"{a}_current", "A", "rms", 0.0, 20.0),
        ]
        rail_moves = b % 2 == 1
        for kind, count in (("guide", pads), ("screw", 1)):
            # stations as seen from pads at 0.1 .. 0.3 m with 0.8 m stroke, on either side
            low, high = (-0.75, 0.35) if rail_moves else (0.05, 1.15)
            stations = tuple(np.linspace(low, high, n_segments))
            rails.append(Rail(f"{a}_{kind}", len(ports), stations))
            ports += [f"{a}_{kind}.rail[{i}]" for i in range(n_segments)]
            for i in range(count):
                pairs.append(
                    Pair(f"{a}_{kind}", b, len(rails) - 1, len(ports), 0.1 + 0.1 * i, rail_moves, 4e-3, 3e3 + 500.0 * i)
                )
                ports.append(f"{a}_{kind}.pad[{i}]")
        sources += [
            Source(
                f"{a}_motor", LawUse("motor_copper", {"resistance": 0.4}, {"current": f"{a}_current"}), 1.0, "", 0.5
            ),
            Source(
                f"{a}_nut",
                LawUse(
                    "screw_friction",
                    {"force": 500.0, "preload": 1500.0, "diameter": 0.04, "lead": 0.02},
                    {"speed": f"{a}_speed"},
                ),
                1.1,
                f"{a}_screw",
                0.6,
            ),
        ]
    for b in range(n_bodies):
        films.append(Film(f"body_{b}_natural", NO_USE, 0, 4.0, 16.0))
        if b:
            use = LawUse("forced_film", {"natural": 8.0, "forced": 10.0}, {"speed": f"{AXES[b - 1]}_speed"})
            films.append(Film(f"body_{b}_forced", use, 1, 4.0, 36.0))
    joints = (Joint("plate", 2000.0, 700.0, 6000.0),)
    environments = (EnvironmentWiring("hall", "ambient", 20.0), EnvironmentWiring("pit", "", 18.0))
    return LoadModel(
        tuple(signals), tuple(axes), environments, tuple(sources), tuple(films), joints,
        tuple(ports), tuple(rails), tuple(pairs),
    )  # fmt: skip


def _network(rng: np.random.Generator, n: int, scale: float) -> np.ndarray:
    """Laplacian (n, n) of a random network: a chain and some cross links; rows sum to zero."""
    laplacian = np.zeros((n, n))
    links = [(i, i + 1) for i in range(n - 1)] + [tuple(rng.choice(n, 2, replace=False)) for _ in range(n)]
    for i, j in links:
        g = scale * rng.uniform(0.5, 2.0)
        laplacian[[i, j, i, j], [i, j, j, i]] += [g, g, -g, -g]
    return laplacian


def _averages(rng: np.random.Generator, n: int, count: int) -> np.ndarray:
    """(n, count) columns >= 0 that sum to 1, each on a few nodes."""
    columns = np.zeros((n, count))
    for c in range(count):
        columns[rng.choice(n, min(4, n), replace=False), c] = rng.uniform(0.2, 1.0, min(4, n))
    return columns / columns.sum(axis=0)


def machine(
    n_bodies: int = 3, n: int = 12, n_segments: int = 8, pads: int = 2, grid: int = 3, seed: int = 1
) -> MachineModel:
    """A machine of `n_bodies` chain bodies with n states each and grid**n_axes poses."""
    rng = np.random.default_rng(seed)
    load = load_model(n_bodies, n_segments, pads)
    sensors = tuple(f"T{i:02d}" for i in range(4 * n_bodies))
    n_axes = len(load.axes)
    pose_grid = tuple(np.linspace(0.0, 0.8, grid) for _ in range(n_axes))
    poses = np.array(list(itertools.product(*pose_grid))).reshape(grid**n_axes, n_axes)
    bodies = []
    for b in range(n_bodies):
        prefixes = [f"{AXES[b]}_guide.rail", f"{AXES[b]}_screw.rail"] if b < n_bodies - 1 else []
        if b:
            prefixes += [f"{AXES[b - 1]}_guide.pad", f"{AXES[b - 1]}_screw.pad"]
        ports = tuple(i for i, name in enumerate(load.ports) if name.split("[")[0] in prefixes)
        sources = tuple(
            i for i, s in enumerate(load.sources) if not s.contact and b < n_bodies - 1 and s.name[0] == AXES[b]
        )
        theta = [k for k, f in enumerate(load.films) if f.name.startswith(f"body_{b}_")]
        A = [np.diag(rng.uniform(0.0, 0.1, n)) for _ in theta]
        M = [a @ np.ones(n) for a in A]
        if b == 0:
            theta.append(len(load.films))
            A.append(_network(rng, n, 1e-3))
            M.append(np.zeros(n))
        T = rng.standard_normal((n, n)) / np.sqrt(n) + 2.0 * np.eye(n)  # coordinates nothing can be read off from
        E = np.diag(rng.uniform(2e3, 2e4, n))
        one = np.linalg.solve(T, np.ones(n))
        rows = tuple(range(4 * b, 4 * b + 4))
        bodies.append(
            AffineBody(
                name=f"body_{b}",
                E=T.T @ E @ T,
                A0=T.T @ _network(rng, n, 20.0) @ T,
                A=tuple(T.T @ a @ T for a in A),
                theta=tuple(theta),
                M=T.T @ np.array(M).T,
                B=T.T @ _averages(rng, n, len(sources)),
                sources=sources,
                P=T.T @ _averages(rng, n, len(ports)),
                ports=ports,
                C=_averages(rng, n, 4).T @ T,
                sensors=rows,
                G=1e-6 * rng.standard_normal((len(poses), 3, n)) @ T,
                one=one,
                energy=T.T @ E @ np.ones(n),
            )
        )
    return MachineModel(
        "synthetic", tuple(bodies), load, 20.0, sensors, (("T_hall", 0),),
        tuple(a.name for a in load.axes), pose_grid, poses,
    )  # fmt: skip


def oblique(model: MachineModel, seed: int = 2) -> MachineModel:
    """The same machine in coordinates where columns and rows differ, as after an oblique projection."""
    rng = np.random.default_rng(seed)
    bodies = []
    for body in model.bodies:
        left = np.eye(body.n) + 0.3 * rng.standard_normal((body.n, body.n)) / np.sqrt(body.n)
        bodies.append(
            replace(
                body, E=left @ body.E, A0=left @ body.A0, A=tuple(left @ a for a in body.A), M=left @ body.M,
                B=left @ body.B, P=left @ body.P, P_out=body.P, B_out=body.B,
                H=None if body.H is None else left @ body.H,
            )
        )  # fmt: skip
    return replace(model, bodies=tuple(bodies))


def loads(
    load: LoadModel, hours: float = 1.0, sampling: float = 7.0, seed: int = 3
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time (m,) [s] and signals inside their ranges: axes sweep and rest, currents step, the hall warms."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * 3600.0 + sampling, sampling)
    m = len(time)
    moving = np.sin(2e-3 * time) > 0.0
    signals = {"ambient": 20.0 + 2.0 * time / 3600.0}
    for k, axis in enumerate(load.axes):
        phase = np.cumsum(moving) * (0.05 + 0.03 * k)
        position = 0.8 * np.abs((phase + 1.0) % 2.0 - 1.0)
        signals[f"{axis.name}_position"] = position
        signals[f"{axis.name}_speed"] = np.append(np.diff(position) / sampling, 0.0)
        signals[f"{axis.name}_current"] = np.repeat(rng.uniform(0.0, 20.0, m // 10 + 1), 10)[:m]
    return time, signals
