"""What `twin export A.h5 --format npz -o A.npz` wrote, stepped with SciPy and as a system of python-control.

python read_npz.py A.npz
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.signal import cont2discrete


def explicit(path):
    """A, B, C, D of x' = A x + B u, y = C x + D u: the descriptor matrix E is solved with."""
    with np.load(path) as f:
        E, A, B, C, D = (f[name] for name in "EABCD")
    return np.linalg.solve(E, A), np.linalg.solve(E, B), C, D


def step_response(path, u, seconds, steps):
    """Outputs (steps + 1, p) from rest, inputs (m,) held: exact, as nothing else changes."""
    Ad, Bd, C, D, _ = cont2discrete(explicit(path), seconds / steps, method="zoh")
    x, y = np.zeros(len(Ad)), [D @ u]
    for _ in range(steps):
        x = Ad @ x + Bd @ u
        y.append(C @ x + D @ u)
    return np.array(y)


def control_system(path):
    """The same as a python-control StateSpace, with the names of its channels."""
    import control

    with np.load(path) as f:
        names = {"inputs": f["inputs"].tolist(), "outputs": f["outputs"].tolist()}
    # python-control splits signal names at periods
    plain = {kind: [name.replace(".", "_") for name in list_] for kind, list_ in names.items()}
    return control.ss(*explicit(path), **plain)


if __name__ == "__main__":
    with np.load(sys.argv[1]) as f:
        inputs, outputs, units, u = (f[n] for n in ("inputs", "outputs", "output_units", "input_rest"))
    u[0] = 100.0  # W into the first source
    y = step_response(sys.argv[1], u, 3600.0, 60)[-1]
    print(f"after an hour of 100 W in {inputs[0]}:")
    print("\n".join(f"  {name}: {value:.3g} {unit}" for name, value, unit in zip(outputs, y, units, strict=True)))
