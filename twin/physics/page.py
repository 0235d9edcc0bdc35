"""The page docs/laws.md, made from the table: python -m twin.physics.page > docs/laws.md"""

from __future__ import annotations

from collections.abc import Mapping

from twin.physics.laws import LAWS, Argument, Law

_KINDS = {
    "loss": ("Losses [W]", "Heat into a surface or a moving contact: `law` of a source."),
    "film": (
        "Films [W/(m² K)]",
        "Convection of a group of surfaces: `law` of a film. Radiation is added to it (emissivity 0.9 unless the film\n"
        "says otherwise), except where the table says that the surface sees no surroundings.",
    ),
    "joint": ("Joints [W/(m² K)]", "Conductance of a fixed contact from its bolts and surfaces: `joint` of a contact."),
}
_HEAD = """# Laws

Made from the table `twin.physics.laws.LAWS` by `python -m twin.physics.page > docs/laws.md`; do not edit.
`twin losses MACHINE --explain sources.NAME` prints the same for a source, film or joint, with its numbers.

- Signals are logged; their names are those of the law's arguments. Speeds count by their size, in both directions.
- States are filled in by the model, one step late: `surface` and `ambient` of a film, `temperature` of a source's
  surface. A signal that measures them can be wired instead.
- Parameters show their default; one without must be given. Numbers are SI or strings with a unit.
- Outside its validity a law is evaluated all the same, and the step is flagged. Air is taken from a table from 0 to 80
  degC at the film temperature; down to -40 and up to 150 degC the table is extrapolated linearly, beyond that it
  is held.
- Errata (E-...) are mistakes of the papers; what was printed and why it is wrong stands with each function.
"""


def laws_page() -> str:
    """The page as text."""
    parts = [_HEAD]
    for kind, (title, meaning) in _KINDS.items():
        parts.append(f"\n## {title}\n\n{meaning}\n")
        parts += [_section(name, law) for name, law in LAWS.items() if law.kind == kind]
    return "".join(parts)


def _section(name: str, law: Law) -> str:
    lines = [f"\n### `{name}`\n", f"    {law.formula}\n"]
    lines += _arguments("signals", law.signals) + _arguments("states", law.states)
    lines += _arguments("parameters", law.parameters)
    lines.append(f"- source: {law.source}")
    lines.append(f"- validity: {law.validity.text if law.validity else 'no published limits'}")
    if not law.radiates:
        lines.append("- no radiation is added")
    return "\n".join(lines) + "\n"


def _arguments(title: str, arguments: Mapping[str, Argument]) -> list[str]:
    if not arguments:
        return []
    told = []
    for name, argument in arguments.items():
        default = f" = {argument.default:g}" if argument.default is not None else ""
        told.append(f"`{name}`{default} [{argument.unit}] {argument.meaning}")
    return [f"- {title}: " + "; ".join(told)]


if __name__ == "__main__":
    print(laws_page(), end="")
