"""Are the laws of a load model known here, with all their arguments and parameters within physical bounds?

A description is checked for the same when it is read (`twin.machine.wiring`); an artefact may come from another version
of the table of laws, or from an editor.
"""

from __future__ import annotations

from twin.errors import DescriptionError
from twin.nearest import did_you_mean
from twin.physics.laws import LAWS
from twin.rom.load_model import LawUse, LoadModel

WHERE = "load model"


def check_laws(load: LoadModel) -> str:
    """One line that says what was checked. Raises DescriptionError for the first law that cannot be evaluated."""
    for source in load.sources:
        _law(source.use, "loss", f"sources.{source.name}")
    for film in load.films:
        _law(film.use, "film", f"films.{film.name}")
    return f"{len(load.sources)} losses, {len(load.films)} films: laws known, arguments given, parameters within bounds"


def _law(use: LawUse, kind: str, where: str) -> None:
    """A law of this kind, all its arguments given, none that it does not have, parameters within their bounds."""
    law, place = LAWS.get(use.law), f"{WHERE}: {where}"
    if law is None or law.kind != kind:
        known = [name for name, other in LAWS.items() if other.kind == kind]
        raise DescriptionError(f"unknown law '{use.law}'", place, did_you_mean(use.law, known, "laws"))
    lacking = [n for n, a in law.parameters.items() if a.default is None and n not in use.parameters]
    lacking += [name for name in law.signals if name not in use.signals]
    foreign = [name for name in use.parameters if name not in law.parameters]
    foreign += [name for name in use.signals if name not in law.signals and name not in law.states]
    if lacking or foreign:
        what = f"lacks '{lacking[0]}'" if lacking else f"has no '{foreign[0]}'"
        raise DescriptionError(f"law '{use.law}' {what}", place, "build the artefact again with this version of twin")
    for name, value in use.parameters.items():
        bounds = law.parameters[name]
        if not bounds.low <= value <= bounds.high:
            what = f"{name} is {value:g}, not {bounds.low:g} .. {bounds.high:g} {bounds.unit}"
            raise DescriptionError(what, place, "correct the description and build again")
