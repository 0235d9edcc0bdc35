"""Corrections on disk: made from the result.h5 of `twin run`, written as correction.json for the control."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from twin.atomic import atomic_path
from twin.errors import TwinError
from twin.ordinary import ordinary
from twin.rom.hdf5_file import strings
from twin.run.correction import Correction, PoseErrors, Quality
from twin.run.correction_polynomial import NormalisedAxis, Polynomial
from twin.run.correction_rotary import RotaryCorrection
from twin.run.results import result_file

FORMAT, VERSION = "twin correction", 1
HOW = (
    "s = clip((position - centre) / half_range, -1, 1) per axis; error of a component = sum over terms of "
    "coefficient * product of s^exponent; offsets = offset_per_error @ errors; nominal position + offset"
)


def read_pose_errors(path: Path, artefact: str, time: float | None = None) -> tuple[PoseErrors, float]:
    """TCP errors at the poses in a result.h5 (or the folder it is in), and the time they belong to [s].

    artefact: sha256 of the model that the result must be of. time [s] since the start of the run: the nearest end of a
    step is taken; by default the last. Raises TwinError for other files, other artefacts, and times outside the run.
    """
    remedy = "give the folder of `twin run -o`, made with this artefact"
    with result_file(path, artefact, remedy) as (f, _):
        times = f["time"][...]
        row = len(times) - 1 if time is None else int(np.argmin(np.abs(times - times[0] - time)))
        last = float(times[-1] - times[0])
        if time is not None and not 0.0 <= time <= last:
            what = f"the run lasts {last / 3600:g} h"
            raise TwinError(what, "--time", f"write a time within, for example --time '{last / 7200:g} h'")
        axes, poses = strings(f["pose_axis"]), f["pose_position"][...]
        grid = tuple(np.unique(p) for p in poses.T)
        errors = PoseErrors(axes, grid, poses, f["tcp"][row], state=f["states"][row])
        return errors, float(times[row] - times[0])


def write_correction(
    path: Path,
    correction: Correction,
    quality: Quality,
    facts: Mapping[str, Any],
    rotary: RotaryCorrection | None = None,
) -> None:
    """Write correction.json, led by `facts`; rotary: with offsets of rotary axes, too.

    Raises TwinError if the file cannot be written.
    """
    axes = correction.polynomial.axes
    exponents = list(product(*(range(a.degree + 1) for a in axes)))
    told = {
        "format": FORMAT,
        "version": VERSION,
        **facts,
        "how": HOW,
        "units": {"position": "m", "coefficients": "m", "offset": "m"},
        "axes": [
            {"name": a.name, "centre_m": a.centre, "half_range_m": a.half_range, "degree": a.degree} for a in axes
        ],
        "components": [name.removeprefix("d") for name in quality.components],
        "tool_motion_per_axis_motion": correction.jacobian.T.tolist(),
        "offset_per_error": correction.offset_per_error.tolist(),
        "form": "full" if correction.form == "full" else "product (compressed)",
        "exponents": [list(e) for e in exponents],
        "coefficients_m": [c.ravel().tolist() for c in correction.polynomial.coefficients],
        "design_condition": quality.condition,
        **{f"{name}_um": (1e6 * value).tolist() for name, value in _lengths(quality).items()},
        "tilt_urad": None if quality.tilt is None else (1e6 * quality.tilt).tolist(),
        "orientation": "tilt of the tool against the work, largest at the poses: linear axes cannot cancel it",
    }
    if correction.factors:
        told["factors"] = [[f.tolist() for f in component] for component in correction.factors]
    if rotary is not None:
        told["with_rotary_axes"] = _rotary(rotary)
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")


def _rotary(rotary: RotaryCorrection) -> dict[str, Any]:
    """Instead of the offsets of the linear axes alone; degrees of the polynomials are their own."""
    axes = rotary.polynomial.axes
    return {
        "how": "offset of an axis = sum over terms of coefficient * product of s^exponent; s as above",
        "axes": list(rotary.axes),
        "units": ["m"] * len(axes) + ["rad"] * (len(rotary.axes) - len(axes)),
        "exponents": [list(e) for e in product(*(range(a.degree + 1) for a in axes))],
        "coefficients": [c.ravel().tolist() for c in rotary.polynomial.coefficients],
        "left_um": (1e6 * rotary.left).tolist(),
        "left_tilt_urad": (1e6 * rotary.left_tilt).tolist(),
    }


def _lengths(quality: Quality) -> dict[str, np.ndarray]:
    return {k: v for k, v in vars(quality).items() if isinstance(v, np.ndarray) and k != "tilt"}


def read_correction(path: Path) -> Correction:
    """The correction in a file, ready to be evaluated. Raises TwinError for other files and unknown versions."""
    remedy = "give a file written by `twin correction`"
    try:
        told = json.loads(ordinary(Path(path)).read_text(encoding="utf-8"))
        if told["format"] != FORMAT:
            raise TwinError("not a correction", str(path), remedy)
        if told["version"] != VERSION:
            raise TwinError(f"version {told['version']}; this program reads version {VERSION}", str(path), remedy)
        axes = tuple(
            NormalisedAxis(a["name"], float(a["centre_m"]), float(a["half_range_m"]), int(a["degree"]))
            for a in told["axes"]
        )
        shape = tuple(a.degree + 1 for a in axes)
        n = len(told["components"])
        coefficients = np.array(told["coefficients_m"], dtype=float).reshape(n, *shape)
        jacobian = np.array(told["tool_motion_per_axis_motion"], dtype=float).reshape(len(axes), n).T
        factors = tuple(tuple(np.array(f) for f in component) for component in told.get("factors", ()))
        form = "product" if factors else "full"
    except (OSError, ValueError, KeyError, TypeError) as e:
        raise TwinError("not a correction", str(path), remedy) from e
    return Correction(Polynomial(axes, coefficients), jacobian, form, factors)  # type: ignore[arg-type]
