"""Planted parameters recovered: 30 drawn from their priors, truth = full model on another mesh with noise, 20 seeds."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from benchmarks.five_axis import compact, machine
from benchmarks.recovery_truth import NOISE, SEEDS, draw, planted, truth
from twin.calibrate.fit.calibration import calibrate
from twin.calibrate.fit.fit import Fit
from twin.calibrate.fit.options import Options
from twin.machine.parameters import parameters
from twin.rom.artefact import Artefact

OPTIONS = Options(temperature_sigma=NOISE.temperature)


def artefact() -> Artefact:
    """The shipped machine in memory."""
    return Artefact(compact(), "", {}, {}, (), parameters(machine()), "", "")


def deviation(fit: Fit, values: dict[str, float]) -> np.ndarray:
    """Fitted minus planted in posterior standard deviations (30,)."""
    wanted = np.array([p.coordinate(values[p.path]) for p in planted()])
    return (fit.x - wanted) / fit.sigma


def main() -> None:
    print(f"   {len(planted())} parameters, {len(SEEDS)} seeds (truths are kept in the cache folder; 1 to 2 min each)")
    model, inside, deviations, learned = artefact(), [], [], []
    for seed in SEEDS:
        began = time.perf_counter()
        run, values = truth(seed), draw(seed)
        fit = calibrate(model, [run], planted(), OPTIONS).fit
        z = deviation(fit, values)
        inside.append(float(np.mean(np.abs(z) < 2.0)))
        deviations.append(z)
        learned.append(fit.sigma)
        print(f"   seed {seed}: {inside[-1]:.0%} within 2 sigma, stopped at {fit.stopped}, "
              f"{time.perf_counter() - began:.0f} s", flush=True)  # fmt: skip
    z = np.array(deviations)
    print(
        f"   within 2 sigma: {np.mean(inside):.1%} of {z.size} (to reach: 90 %); rms of z {np.sqrt(np.mean(z**2)):.2f}"
    )
    sigma = np.median(learned, axis=0)
    print(f"   posterior standard deviation: median {np.median(sigma):.2f} of the prior's, largest {sigma.max():.2f}")
    worst = np.argsort(-np.sqrt(np.mean(z**2, axis=0)))[:3]
    for k in worst:
        print(f"   {planted()[k].path}: rms z {np.sqrt(np.mean(z[:, k] ** 2)):.2f}, mean {np.mean(z[:, k]):+.2f}")
    blind = calibrate(model, [truth(0)], planted(), replace(OPTIONS, form_tolerance=0.0)).fit
    share = float(np.mean(np.abs(deviation(blind, draw(0))) < 2.0))
    print(f"   seed 0 without model discrepancy: {share:.0%} within 2 sigma")


if __name__ == "__main__":
    main()
