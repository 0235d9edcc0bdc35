"""Where an artefact is linear: axis positions and film coefficients held.

The artefact's equations are affine in film coefficients and contact positions. With both held they are one linear
state space. Held values come from a result of `twin run` at one time, or from the artefact alone: the middle of what it
is certified for, axes at position zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import TwinError
from twin.export.options import ExportOptions
from twin.nearest import did_you_mean
from twin.rom.artefact import Artefact
from twin.rom.hdf5_file import strings
from twin.rom.load_model import Film, LoadModel
from twin.run.results import result_file
from twin.units import to_si


@dataclass(frozen=True)
class OperatingPoint:
    """Axis positions and film coefficients."""

    position: np.ndarray  # (n_axes,) m, in the order of LoadModel.axes
    films: np.ndarray  # (n_films,) W/(m^2 K), radiation included, in the order of LoadModel.films


def chosen(artefact: Artefact, options: ExportOptions) -> OperatingPoint:
    """What the options ask for. Raises TwinError as `of_result` and `moved`, and for positions that are none."""
    load = artefact.model.load_model
    if options.result is None and options.time is not None:
        raise TwinError("a time of no run", "--time", "name the folder of `twin run` with --result")
    point = middle(load)
    if options.result is not None:
        point = of_result(options.result, artefact.digest, load, options.time)
    return moved(point, load, positions(options.at or ""))


def positions(text: str) -> dict[str, float]:
    """Positions [m] in "x=100 mm, y=0 mm". Raises TwinError for anything else."""
    found = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = item.partition("=")
        if name.strip() in found:
            raise TwinError(f"axis '{name.strip()}' is named twice", "--at", "write --at 'x=100 mm, y=0 mm'")
        try:
            found[name.strip()] = to_si(value.strip(), "m") if equals else to_si("", "m")
        except ValueError as e:
            raise TwinError(f"'{item}' is no position: {e}", "--at", "write --at 'x=100 mm, y=0 mm'") from e
    return found


def middle(load: LoadModel) -> OperatingPoint:
    """Axes at zero, or where the stroke comes closest to it; films in the middle of their certified ranges."""
    position = [min(max(0.0, axis.low), axis.high) for axis in load.axes]
    return OperatingPoint(np.array(position, dtype=float), np.array([_middle(f) for f in load.films], dtype=float))


def _middle(film: Film) -> float:
    """Of a range of coefficients the geometric mean, as their effect counts by ratios; not where it starts at zero."""
    return float(np.sqrt(film.low * film.high)) if film.low > 0.0 else (film.low + film.high) / 2


def of_result(path: Path, artefact: str, load: LoadModel, time: float | None = None) -> OperatingPoint:
    """Where films and axes were in a result of `twin run`, in the step that ends nearest to `time` [s], else the last.

    artefact: sha256 of the model that the result must be of. Raises TwinError for other files and results of other
    artefacts, and for times outside the run.
    """
    remedy = "give the folder of `twin run -o`, made with this artefact"
    with result_file(path, artefact, remedy) as (f, _):
        ends = f["time"][1:] - f["time"][0]
        if time is not None and not 0.0 <= time <= ends[-1]:
            what = f"the run lasts {ends[-1] / 3600:g} h"
            raise TwinError(what, "--time", f"write a time within, for example --time '{ends[-1] / 7200:g} h'")
        step = len(ends) - 1 if time is None else int(np.abs(ends - time).argmin())
        films = dict(zip(strings(f["film"]), f["film_coefficient"][step], strict=True))
        axes = dict(zip(strings(f["axis"]), f["position"][step + 1], strict=True))
    return OperatingPoint(
        np.array([axes[a.name] for a in load.axes], dtype=float),
        np.array([films[f.name] for f in load.films], dtype=float),
    )


def moved(point: OperatingPoint, load: LoadModel, positions: Mapping[str, float]) -> OperatingPoint:
    """The same with some axes elsewhere [m]. Raises TwinError for unknown axes and positions outside their stroke."""
    names = [axis.name for axis in load.axes]
    position = point.position.copy()
    for name, value in positions.items():
        if name not in names:
            raise TwinError(f"no axis '{name}'", "--at", did_you_mean(name, names, "axes"))
        axis = load.axes[names.index(name)]
        if not axis.low <= value <= axis.high:
            stroke = f"{1e3 * axis.low:g} to {1e3 * axis.high:g} mm"
            raise TwinError(
                f"{name} = {1e3 * value:g} mm is outside its stroke", "--at", f"write a position in {stroke}"
            )
        position[names.index(name)] = value
    return OperatingPoint(position, point.films)
