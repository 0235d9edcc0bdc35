"""The correction in the control's cycle: 81 coefficients at one position, beside what they leave (limit 10 us)."""

from __future__ import annotations

import itertools
import time

import numpy as np

from twin.run.correction import Form, PoseErrors, fit_correction, quality

CALLS = 20_000
LIMIT = 10.0  # us, paper 001: a small part of an interpolation cycle of 2 ms


def field(position: np.ndarray) -> np.ndarray:
    """A smooth TCP error (m, 3) [m] of some 40 um over a cube of 0.8 m."""
    x, y, z = position.T / 0.4
    return 1e-6 * np.column_stack(
        [12.0 * np.sin(x) + 6.0 * y * z, 10.0 * np.exp(0.5 * x * y) - 5.0, 25.0 * np.cos(z) + 5.0 * x]
    )


def main() -> None:
    grid = (np.linspace(-0.4, 0.4, 5),) * 3
    poses = np.array(list(itertools.product(*grid)))
    errors = PoseErrors(("x", "y", "z"), grid, poses, field(poses))
    places = np.random.default_rng(0).uniform(-0.4, 0.4, (CALLS, 3)).tolist()
    forms: tuple[Form, ...] = ("full", "product")
    for form in forms:
        began = time.perf_counter()
        correction = fit_correction(errors, np.eye(3), form=form)
        fitted = time.perf_counter() - began
        found = quality(correction, errors)
        print(
            f"   {form}: fitted to {len(poses)} poses in {1e3 * fitted:.1f} ms; misfit at the poses "
            f"{1e6 * found.residual.max():.3f} um of {1e6 * found.before.max():.0f} um, condition {found.condition:.0f}"
        )
    correction = fit_correction(errors, np.eye(3))
    correction.offset(places[0])
    times = []
    for block in np.array_split(np.arange(CALLS), 20):
        began = time.perf_counter()
        for i in block:
            correction.offset(places[i])
        times.append((time.perf_counter() - began) / len(block))
    size = correction.polynomial.coefficients.size
    print(f"   {size} coefficients at one position: {1e6 * np.median(times):.1f} us (limit {LIMIT:g} us)")
    began = time.perf_counter()
    correction.offsets(np.array(places))
    print(f"   the same for {CALLS} positions at once: {1e9 * (time.perf_counter() - began) / CALLS:.0f} ns each")


if __name__ == "__main__":
    main()
