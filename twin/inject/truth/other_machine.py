"""Another machine than the described one: what a real machine differs by from its description.

Its own mesh, other laws of its films, other emissivities, sensors some millimetres aside, gains, conductances,
capacities and expansions off by what a designer does not know. What is hidden comes on top, as an edit of its text.
"""

from __future__ import annotations

import re

import numpy as np

from twin.build.remesh import remesh
from twin.inject.experiment import Experiment
from twin.inject.truth.other_films import FILMS, OtherFilm
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.parameters import parameters
from twin.rom.parameter import Parameter

OTHER_MESH = 0.16  # m, element size: the artefact's mesh has 0.12
ASIDE = 0.008  # m, the largest distance of a sensor from where the description has it
# Half widths of uniform factors around 1, by kind of parameter
OFF: dict[str, float] = {
    "source": 0.15, "film": 0.15, "joint": 0.15, "contact": 0.15, "capacity": 0.05, "expansion": 0.03,
}  # fmt: skip
EXPONENT = 0.08  # half width of what is added to exponents of films


def other_text(experiment: Experiment, seed: int) -> str:
    """The description [text of a machine.toml] of the other machine of a seed; it has the names of the shipped one."""
    rng = np.random.default_rng(seed)
    pieces = re.split(r"(?m)^(?=\[)", experiment.text)
    for i, piece in enumerate(pieces):
        header = re.match(r"\[(\w+)\.(\w+)\]", piece)
        if header and header[1] == "films":
            pieces[i] = _film_table(piece, FILMS[header[2]], rng.uniform(-EXPONENT, EXPONENT))
        elif header and header[1] == "sensors" and (place := re.search(r"position = \[(.*)\]", piece)):
            shift = rng.standard_normal(3)
            shift *= ASIDE * rng.uniform() ** (1.0 / 3.0) / np.linalg.norm(shift)
            moved = np.array([float(v) for v in place[1].split(",")]) + shift
            pieces[i] = piece.replace(place[0], f"position = [{', '.join(f'{v:.4f}' for v in moved)}]")
    text = "".join(pieces)
    own = [p for p in parameters(experiment.another(text)) if p.kind in OFF]
    return edited(text, {p.path: p.nominal * (1.0 + rng.uniform(-OFF[p.kind], OFF[p.kind])) for p in own})


def other_machine(experiment: Experiment, text: str, size: float = OTHER_MESH) -> Machine:
    """The machine of a description's text on a mesh of `size` [m]; needs gmsh where that mesh is not in the cache."""
    return remesh(experiment.another(text), size)


def other_parameters(experiment: Experiment, seed: int) -> dict[str, tuple[Parameter, float]]:
    """What the other machine of a seed is off by: path -> (the parameter as described, its value there [SI]).

    A film's gain is there that of another law: it is not what a calibration should find.
    """
    described = {p.path: p for p in parameters(experiment.machine)}
    there = parameters(experiment.another(other_text(experiment, seed)))
    return {p.path: (described[p.path], p.nominal) for p in there if p.path in described}


def _film_table(piece: str, film: OtherFilm, exponent: float) -> str:
    """The table of a film with another law; surfaces, environment and comments stay."""
    gain = re.search(r"(?m)^gain = ([\d.]+)", piece)
    kept = re.sub(r"(?m)^(law|gain|emissivity|parameters|signals) = .*\n", "", piece).rstrip("\n")
    values = {k: v + exponent if isinstance(v, float) else v for k, v in film.parameters.items()}
    shown = ", ".join(f"{k} = " + (f'"{v}"' if isinstance(v, str) else f"{v:.3f}") for k, v in values.items())
    own, after = _before_comment(kept)
    lines = [own, f'law = "{film.law}"', f"gain = {(float(gain[1]) if gain else 1.0) * film.gain:g}",
             f"emissivity = {film.emissivity:g}", f"parameters = {{ {shown} }}"]  # fmt: skip
    if film.signal:
        lines.append(f'signals = {{ speed = "{film.signal}" }}')
    return "\n".join(lines) + "\n" + after + "\n"


def _before_comment(table: str) -> tuple[str, str]:
    """A table and the heading of the next section that stands behind it."""
    cut = re.search(r"(?m)^# ---", table)
    return (table, "") if cut is None else (table[: cut.start()].rstrip("\n"), "\n" + table[cut.start() :] + "\n")
