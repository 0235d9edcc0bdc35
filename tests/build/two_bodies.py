"""A small dense machine: a random bed with a rail of five ports and a slide with two pads, two films, one joint."""

from __future__ import annotations

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

STATIONS = (-0.4, -0.2, 0.0, 0.2, 0.4)


def load_model() -> LoadModel:
    copper = LawUse("motor_copper", {"resistance": 1.0}, {"current": "current"})
    guide = LawUse("guide_friction", {"friction": 0.0015, "load": 8000.0, "seal_drag": 20.0}, {"speed": "speed"})
    still = LawUse("constant_film", {"natural": 6.0}, {})
    moving = LawUse("forced_film", {"natural": 6.0, "forced": 12.0, "exponent": 0.8}, {"speed": "speed"})
    return LoadModel(
        signals=(
            Signal("x", "x", "m", "value", -0.35, 0.35),
            Signal("speed", "speed", "m/s", "value", 0.0, 1.0),
            Signal("current", "current", "A", "rms", 0.0, 10.0),
            Signal("air", "air", "degC", "value", 15.0, 30.0),
        ),
        axes=(AxisWiring("x", (1.0, 0.0, 0.0), -0.35, 0.35, "x"),),
        environments=(EnvironmentWiring("room", "air", 20.0),),
        sources=(Source("motor", copper, 1.0, "", 0.0), Source("guide", guide, 1.0, "guide", 0.6)),
        films=(Film("bed", still, 0, 3.0, 12.0), Film("slide", moving, 0, 3.0, 36.0)),
        joints=(Joint("plate", 3000.0, 1000.0, 9000.0),),
        ports=tuple(f"rail[{i}]" for i in range(5)) + ("pad_1", "pad_2"),
        rails=(Rail("rail", 0, STATIONS),),
        pairs=(
            Pair("guide", 0, 0, 5, -0.05, False, 0.004, 3000.0),
            Pair("guide", 0, 0, 6, 0.05, False, 0.004, 3000.0),
        ),
    )


def _network(rng: np.random.Generator, n: int) -> np.ndarray:
    """Conduction matrix of a random connected network, W/K; rows sum to zero."""
    K = np.zeros((n, n))
    for i in range(n):
        for j in {(i + 1) % n, int(rng.integers(n))} - {i}:
            g = rng.uniform(1.0, 20.0)
            K[[i, j], [i, j]] += g
            K[[i, j], [j, i]] -= g
    return K


def model(seed: int = 0, n: tuple[int, int] = (40, 30)) -> MachineModel:
    rng = np.random.default_rng(seed)
    bodies = []
    for b, name in enumerate(("bed", "slide")):
        m = n[b]
        E = np.diag(rng.uniform(200.0, 2000.0, m))
        area = rng.uniform(0.0, 0.05, m)
        joint = _network(rng, m) * 1e-5
        one = np.ones(m)

        def averages(count: int, m: int = m) -> np.ndarray:
            D = np.zeros((m, count))
            for k in range(count):
                D[rng.choice(m, 4, replace=False), k] = rng.dirichlet(np.ones(4))
            return D

        ports = (0, 1, 2, 3, 4) if b == 0 else (5, 6)
        bodies.append(
            AffineBody(
                name=name,
                E=E,
                A0=_network(rng, m),
                A=(np.diag(area), joint) if b == 0 else (np.diag(area),),
                theta=(0, 2) if b == 0 else (1,),
                M=np.column_stack([area, 0 * area]) if b == 0 else area[:, None],
                B=averages(1) if b == 0 else np.zeros((m, 0)),
                sources=(0,) if b == 0 else (),
                P=averages(len(ports)),
                ports=ports,
                C=averages(3).T,
                sensors=(0, 1, 2) if b == 0 else (3, 4, 5),
                G=1e-6 * rng.standard_normal((3, 3, m)),
                one=one,
                energy=E @ one,
            )
        )
    grid = np.array([-0.35, 0.0, 0.35])
    return MachineModel(
        "two bodies",
        tuple(bodies),
        load_model(),
        20.0,
        tuple(f"T{i}" for i in range(6)),
        (),
        ("x",),
        (grid,),
        grid[:, None],
    )
