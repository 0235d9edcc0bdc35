"""The certificate of a model: how far it may be from the full one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from twin.rom.certificate_table import table


class Certificate(Mapping[str, Any]):
    """Figures of a certificate by name, as the artefact stores them (docs/artefact.md); K and m."""

    def __init__(self, figures: Mapping[str, Any]):
        self._figures = figures

    def __getitem__(self, name: str) -> Any:
        return self._figures[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._figures)

    def __len__(self) -> int:
        return len(self._figures)

    @property
    def passed(self) -> bool:
        """Whether every error is within the machine's limits; False where there is no certificate."""
        return bool(self.get("passed", False))

    @property
    def temperature_error(self) -> float:
        """K: the largest error of any sensor, in a case of the size that the limits are for."""
        return float(self["max_temperature_error_in_case"])

    @property
    def displacement_error(self) -> float:
        """m: the largest error of the TCP displacement at any pose or random position, likewise."""
        return float(self["max_displacement_error_in_case"])

    def __str__(self) -> str:
        return "\n".join(self.lines()) if self else "no certificate"

    def __repr__(self) -> str:
        return f"Certificate(passed={self.passed})"

    def lines(self, every_output: bool = False) -> list[str]:
        """Summary lines, one per figure; with `every_output` also a table of all outputs."""
        error_T, span_T = (_largest(self[f"temperature_{k}"]) for k in ("error", "range"))
        error_u, span_u = (_largest(self[f"displacement_{k}"]) for k in ("error", "range"))
        text = [
            f"certificate over {len(self['scenarios'])} held-out scenarios of {self['hours']:g} h and their steady "
            f"states (compact against rich, a new one exceeds any one maximum with probability <= "
            f"{1 - self['confidence']:.0%}):",
            f"  sensors   {self.temperature_error:.4f} K in a {self['case_temperature']:g} K case "
            f"(limit {self['limit_temperature']:g} K); as drawn {error_T:.3f} K at ranges up to {span_T:.0f} K: "
            f"{self['worst_temperature']}",
        ]
        if span_u > 0.0:
            text.append(
                f"  TCP       {1e6 * self.displacement_error:.3f} um in a {1e6 * self['case_displacement']:g} um case "
                f"(limit {1e6 * self['limit_displacement']:g} um); as drawn {1e6 * error_u:.2f} um at ranges up to "
                f"{1e6 * span_u:.0f} um: {self['worst_displacement']}"
            )
        text.append(
            f"  relative to its own range {100 * self['worst_relative']:.2f} % "
            f"(limit {100 * self['limit_relative']:g} %): {self.get('worst_relative_output') or 'any output'}"
        )
        text += self._parts()
        if not self["full_scenarios"]:
            text.append("  the full model is not in this chain yet: twin verify puts it there")
        if every_output:
            text += table(self)
        return [*text, "passed"] if self.passed else [*text, *(f"FAILED: {reason}" for reason in self.reasons())]

    def _parts(self) -> list[str]:
        """Where the error arises, largest figures in the case; artefacts of before 0.7 do not say."""
        text = []
        for part in self.get("parts", ()):
            T, u = (_largest(part[f"{k}_error_in_case"]) for k in ("temperature", "displacement"))
            of_tcp = f"  {1e6 * u:7.3f} um" if _largest(self["displacement_range"]) > 0.0 else ""
            beside = "" if part["counts"] else ", not in the sums"
            halved = self.get("step_halved", 0.0) if part["name"] == "time step" else 0.0
            more = f" (halving these changes it by {100 * halved:.0f} %, counted)" if halved else ""
            text.append(
                f"    {part['name']:<11} {T:.4f} K{of_tcp}  {part['between']}{more}, "
                f"{len(part['scenarios'])} scenarios{beside}"
            )
        return ["  in the case, of it:", *text] if text else []

    def reasons(self) -> list[str]:
        """Why it has not passed: which limit of the description, by how much, and the remedy; empty where it has."""
        T, u = self.temperature_error, self.displacement_error
        compared = (
            ("temperature", T, self["limit_temperature"], self._in_case("temperature")),
            ("displacement", u, self["limit_displacement"], self._in_case("displacement")),
            ("relative", self["worst_relative"], self["limit_relative"], self.get("worst_relative_output", "")),
        )
        return [
            f"{100 * error / limit:.0f} % of limits.{name} ({output}): {self._remedy(name)}, or allow more in "
            "[limits] of the description"
            for name, error, limit, output in compared
            if error > limit
        ]

    def _in_case(self, quantity: str) -> str:
        """The output with the largest error in the case; artefacts of before 0.7 know it as drawn alone."""
        return f"in the case; {self.get(f'worst_{quantity}_in_case') or self[f'worst_{quantity}']}"

    def _remedy(self, name: str) -> str:
        """What makes the largest part of an error smaller."""
        output = name if name != "relative" else self.get("worst_relative_output", "")
        quantity = "displacement" if output.startswith("d") else "temperature"
        parts = [p for p in self.get("parts", ()) if p["counts"]]
        worst = max(parts, key=lambda p: _largest(p[f"{quantity}_error_in_case"]), default={"name": "reduction"})
        return {
            "reduction": "build it with more --states",
            "time step": "most of it is the time step: build it with more --substeps",
            "poses": "most of it lies between the poses of the grid: more [poses], or build it with more --states",
            "rich basis": "most of it is the rich basis: build it with more --samples",
        }[worst["name"]]


def _largest(table: Any) -> float:
    return float(np.max(table, initial=0.0))
