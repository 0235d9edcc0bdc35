"""The names and arrays that `mat` and `npz` hold: the state space at one operating point, and the affine terms.

The affine terms are those of the artefact (docs/artefact.md): the state space at any other film state follows.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.export.operating_point import OperatingPoint
from twin.export.state_space import StateSpace, conductance_matrix
from twin.rom.artefact import Artefact
from twin.rom.model import AffineBody


def described(path: Path, space: StateSpace) -> tuple[str, ...]:
    """What was written, in a line."""
    sizes = f"{len(space.states)} states, {len(space.inputs)} inputs, {len(space.outputs)} outputs"
    return (f"{path}: {sizes}, films and positions held; and the affine terms",)


def state_space_arrays(space: StateSpace) -> dict[str, np.ndarray]:
    """Matrices, and text arrays of names and units."""
    return {
        "E": space.E,
        "A": space.A,
        "B": space.B,
        "C": space.C,
        "D": space.D,
        "states": np.array(space.states),
        "inputs": np.array([c.name for c in space.inputs]),
        "input_units": np.array([c.unit for c in space.inputs]),
        "input_rest": np.array([c.rest for c in space.inputs]),
        "outputs": np.array([c.name for c in space.outputs]),
        "output_units": np.array([c.unit for c in space.outputs]),
    }


def machine_arrays(artefact: Artefact, point: OperatingPoint) -> dict[str, Any]:
    """What the affine terms refer to, and the operating point: names in order, values with their units in the names."""
    model = artefact.model
    load = model.load_model
    return {
        "machine": model.name,
        "artefact_sha256": artefact.digest,
        "reference_temperature_degC": model.reference_temperature,
        "axes": np.array([axis.name for axis in load.axes]),
        "position_m": point.position,
        "theta": np.array(load.theta_names),
        "theta_W_per_m2K": np.concatenate([point.films, [joint.conductance for joint in load.joints]]),
        "sources": np.array([source.name for source in load.sources]),
        "environments": np.array([environment.name for environment in load.environments]),
        "film_environment": np.array([load.environments[f.environment].name for f in load.films]),
        "film_emissivity": np.array([f.emissivity for f in load.films]),
        "sensors": np.array(model.sensors),
        "ports": np.array(load.ports),
        "signals": np.array([signal.name for signal in load.signals]),
        "signal_units": np.array([signal.unit for signal in load.signals]),
        "signal_low": np.array([signal.low for signal in load.signals]),
        "signal_high": np.array([signal.high for signal in load.signals]),
        "pose_axes": np.array(model.pose_axes),
        "poses_m": model.poses,
        "gamma_W_per_K": conductance_matrix(load, point.position),
    }


def body_arrays(body: AffineBody) -> dict[str, np.ndarray]:
    """The affine terms of a body, with the (zero-based) places of its terms, sources, ports and sensors."""
    arrays = {
        "E": body.E,
        "A0": body.A0,
        "A": np.stack(body.A) if body.A else np.zeros((0, body.n, body.n)),  # (theta, n, n) m^2
        "M": body.M,
        "B": body.B,
        "B_out": body.source_rows.T,
        "P": body.P,
        "P_out": body.port_rows.T,
        "C": body.C,
        "G": body.G,  # (pose, 3, n) m/K
        "one": body.one,
        "energy": body.energy,
        "theta": np.array(body.theta, dtype=np.int64),
        "sources": np.array(body.sources, dtype=np.int64),
        "ports": np.array(body.ports, dtype=np.int64),
        "sensors": np.array(body.sensors, dtype=np.int64),
    }
    optional = {"H": body.H, "raised": body.raised}  # (n, theta) m^3, (axis, n, theta) m^2
    return arrays | {name: array for name, array in optional.items() if array is not None}
