"""The window model of a diagnosis beside the rich one it is made from: heat at every place, one at a time.

Blocks of 10 W in the second run, none of which the window was trained with, on the five-axis machine: sensors, and the
TCP at 125 poses, in rms over the run.
"""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import EXPERIMENT, machine
from twin.build.acting import Acting
from twin.build.place_training import EVERY, Shared, stepped
from twin.build.places import pruned
from twin.build.workers import each
from twin.calibrate.fit.measured import measured
from twin.diagnose.model.probed_model import ProbedModel, drive_of, make_probed_model
from twin.diagnose.model.rich_probed_model import rich_probed_model
from twin.diagnose.model.study import Study, make_study
from twin.inject.draw.trial import draw
from twin.machine.parameters import parameters
from twin.progress import bar

RUN, STEP = 1, 120.0  # s
POWER = 10.0  # W
BLOCKS = ((0.05, 0.3, 1.0), (0.45, 0.6, 0.7), (0.8, 0.95, 1.0))  # shares of the run, share of the power


def history(n: int) -> np.ndarray:
    """(n,) W."""
    watts = np.zeros(n)
    for start, end, share in BLOCKS:
        watts[round(start * n) : round(end * n)] = POWER * share
    return watts


def rich(shared: Shared, place: str) -> np.ndarray:
    """(N, m) states of the rich model, with heat at a place, or at none ("")."""
    drive = shared.drives[RUN]
    acting = Acting({place: history(drive.n_steps)}) if place else Acting()
    return stepped(shared, drive, shared.starts[RUN], {}, acting, np.zeros(shared.rich.n))


def window(study: Study, place: int) -> np.ndarray:
    """(n + 1, r) states of the window model, with heat at a place; -1: at none."""
    slots, x = study.slots(RUN), np.zeros(len(study.probed.parameters))
    n = len(slots.gate)
    if place >= 0:
        slots.forcing[:, 0] = history(n)[:, None] * study.probed.B[place]
    return study.states(RUN, x, slots, [1.0])


def rows(probed: ProbedModel, shared: Shared) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sensors and the TCP at every pose [m] over the states of the rich model, then of the window."""
    names, first = list(shared.rich.sensors), 0
    C = np.zeros((len(names), shared.rich.n))
    for body in shared.rich.bodies:
        C[list(body.sensors), first : first + body.n] = body.C
        first += body.n
    G = np.concatenate([b.G.reshape(-1, b.n) for b in shared.rich.bodies], axis=1)
    (own,) = probed.base.bodies
    return C[[names.index(s) for s in probed.base.sensors]], G, np.asarray(own.C), np.asarray(own.G).reshape(-1, own.n)


def main() -> None:
    described, runs = machine(), draw(EXPERIMENT, "null", 1.0, 0).runs
    model = rich_probed_model(described)
    probed = make_probed_model(described, parameters(described), runs)
    plans = [measured(probed.base, run, b.drive, b.name) for run, b in zip(runs, probed.runs, strict=True)]
    study = make_study(probed, plans, range(2))
    base = pruned(model.rich)
    drives = tuple(drive_of(base, run, STEP) for run in runs)
    starts = tuple(b.start for b in probed.runs)
    shared = Shared(model.rich, base, probed.parameters, probed.places, drives, starts)
    names = ["", *(p.name for p in probed.places)]
    with bar("rich model with heat at one place", len(names)) as advance:
        wanted = each(rich, shared, names, lambda name: advance(name or "none"))
    C, G, C_small, G_small = rows(probed, shared)
    every = round(STEP / 60.0) * EVERY
    still, found = window(study, -1), []
    for p, place in enumerate(probed.places):
        X, Z = wanted[p + 1] - wanted[0], (window(study, p) - still)[::every].T
        m = min(X.shape[1], Z.shape[1])
        sizes = [_worst(R @ X[:, :m]) for R in (C, G)]
        errors = [_worst(R @ X[:, :m] - S @ Z[:, :m]) for R, S in ((C, C_small), (G, G_small))]
        found.append((errors[0], errors[1], errors[0] / sizes[0], errors[1] / sizes[1], place.name))
    T, w, T_share, w_share = np.array([f[:4] for f in found]).T
    print(f"   {probed.base.n} states, {len(found)} places, {POWER:g} W at one of them; worst output of each, rms:")
    for name, values, unit in (
        ("temperature", 1e3 * T, "mK"), ("TCP", 1e6 * w, "um"),
        ("temperature, of its largest", 1e2 * T_share, "%"), ("TCP, of its largest", 1e2 * w_share, "%"),
    ):  # fmt: skip
        median, most, worst = np.quantile(values, (0.5, 0.9, 1.0))
        where = found[int(np.argmax(values))][4]
        print(f"   {name}: median {median:.3g}, nine tenths below {most:.3g}, largest {worst:.3g} {unit} ({where})")


def _worst(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2, axis=1)).max())
