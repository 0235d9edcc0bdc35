"""The report of a diagnosis: its sections, which page (index.html, which needs nothing beside it) and terminal share,
and report.json."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from twin.atomic import atomic_path, check_folder
from twin.diagnose.faults.table import what
from twin.diagnose.report import tables
from twin.diagnose.report import text as words
from twin.diagnose.report.heat import heat_picture
from twin.diagnose.report.pictures import PAGE_RC, Picture
from twin.diagnose.report.place import place_html
from twin.diagnose.report.plan import plan_section
from twin.diagnose.report.residuals import drawn_runs, residual_map
from twin.diagnose.report.style import STYLE
from twin.diagnose.result.diagnosis import Diagnosis
from twin.pictures.channels import CAPTION, channel_figure

_LABELS = {
    "named": "cause named",
    "ambiguous": "ambiguous",
    "unknown": "unknown heat",
    "out_of_tolerance": "out of tolerance",
    "sensor": "sensor at fault",
    "signal": "signal at fault",
    "nothing": "nothing found",
    "too_poor": "model too poor",
}
LINES, AT_MOST = 10, {"gain": 2, "notes": 0}  # of a terminal, and of a section in it


@dataclass(frozen=True)
class Section:
    """A part of the report: what everybody reads, also in a terminal, and what opens with a click or a link to it."""

    name: str
    title: str
    lines: list[str]
    more: Callable[[], str]  # HTML
    opened: bool = False

    def html(self) -> str:
        """Empty where there is nothing to say."""
        more = self.more()
        if not self.lines and not more:
            return ""
        lines = "".join(f"<span>{escape(line)}</span>" for line in self.lines)
        summary = f"<summary><h2>{self.title}</h2>{lines}</summary>"
        opened = " open" if self.opened else ""
        return f'<details{opened}>{summary}\n<section id="{self.name}">\n{more}\n</section></details>'


def sections(d: Diagnosis) -> list[Section]:
    """In their order; after "nothing" what would have been seen comes first, as it is the result then."""
    quiet, told = d.verdict in ("nothing", "too_poor"), words.evidence_lines(d)
    return sorted(
        [
            Section("evidence", "Evidence", told, lambda: _evidence(d), not told),
            Section("unknown", "Heat that nothing explains", words.unknown_lines(d), lambda: _unknown(d), True),
            Section("plan", "The next experiment", [], lambda: plan_section(d.plan), True),
            Section("gain", "Gain on the sealed run", words.gain_lines(d),
                    lambda: tables.gain_table(d) or f"<p>{words.no_gain(d)}</p>", not d.gain),
            Section("pulls", "Fitted values", words.pull_lines(d), lambda: tables.pulls_table(d)),
            Section("limits", "Detection limits", words.limit_lines(d) if quiet else [],
                    lambda: tables.limits_table(d), quiet),
            Section("residuals", "Residuals", words.whiteness_lines(d), lambda: _residuals(d)),
            Section("channels", "Channels", [], lambda: _channels(d)),
            Section("decision", "How it was decided", [],
                    lambda: tables.families_table(d) + tables.rivals_table(d.ranked, d)),
            Section("notes", "Notes and provenance", list(d.notes[:1]), lambda: _notes(d)),
        ],
        key=lambda s: d.verdict == "nothing" and s.name != "limits",
    )  # fmt: skip


def summary_lines(d: Diagnosis) -> list[str]:
    """At most LINES lines for a terminal: verdict, and what the sections tell."""
    lines = [f"{d.machine}: {d.verdict.replace('_', ' ')}", words.verdict_sentence(d)]
    lines += [line for s in sections(d) for line in s.lines[: AT_MOST.get(s.name)]]
    if d.notes:
        lines.append(f"Note: {d.notes[0]}" + (f" ({len(d.notes) - 1} more in the report)" if len(d.notes) > 1 else ""))
    return [" ".join(line.split()) for line in lines[:LINES]]


def write_report(diagnosis: Diagnosis, folder: Path) -> None:
    """Write index.html and report.json into `folder`, each whole or not at all.

    report.json is `Diagnosis.to_json` with `summary_lines`, and null where a number is not finite.
    Raises TwinError where the folder cannot be written.
    """
    check_folder(Path(folder))
    told = diagnosis.to_json() | {"summary": summary_lines(diagnosis)}
    facts = json.dumps(plain(told), indent=1, allow_nan=False, ensure_ascii=False)
    for name, text in (("index.html", page(diagnosis)), ("report.json", facts + "\n")):
        with atomic_path(Path(folder) / name) as temporary:
            # a lone surrogate of an odd file name must not lose the report
            temporary.write_text(text, encoding="utf-8", errors="replace")


def plain(value: Any) -> Any:
    """`value` as JSON knows it: lists, dicts with text keys, None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Iterable):
        return [plain(v) for v in value]
    return str(value)


def page(d: Diagnosis) -> str:
    """The whole page."""
    made = [(s, html) for s in sections(d) if (html := s.html())]
    contents = " ".join(f'<a href="#{s.name}">{s.title}</a>' for s, _ in made)
    body = "\n".join(html for _, html in made)
    title = escape(f"{d.machine}: diagnosis")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{STYLE}</style></head><body>
<h1>{title}</h1>
<div class="verdict {d.verdict}"><p class="label">{_LABELS[d.verdict]}</p>
<p class="sentence">{escape(words.verdict_sentence(d))}</p><p>{words.follows(d)}</p></div>
{place_html(d)}
<nav>{contents}</nav>
{body}
</body></html>
"""


def _evidence(d: Diagnosis) -> str:
    if not d.causes and d.unknown is None:
        refuted, none = "The sealed run refuted what was named.", "No family of causes passes its threshold."
        return f"<p>{refuted if d.verdict == 'unknown' else none}</p>"
    acts = [
        f"{c.place}: {words.when(c)}" + (f"; {c.parameter} in machine.toml" if c.parameter else "")
        for c in d.causes if c.windows or c.parameter
    ]  # fmt: skip
    parts = [tables.items(acts)]
    parts += [
        f"<h3>{escape(f'Rivals of {what(c.family)} at {words.place_words(c.place)}')}</h3>"
        + tables.rivals_table(c.rivals, d)
        for c in d.causes if c.rivals
    ]  # fmt: skip
    remedies = words.remedies(d)
    if remedies[1:]:
        parts.append("<h3>Other ways to separate them</h3>" + tables.items(remedies[1:]))
    elif d.verdict == "ambiguous" and not remedies:
        parts.append("<p>No single measurement is known that would separate them.</p>")
    return "\n".join(parts)


def _unknown(d: Diagnosis) -> str:
    if d.unknown is None:
        return ""
    rows = [[name, f"{correlation:+.2f}"] for name, correlation in d.unknown.correlated_signals]
    return _shown(heat_picture(d.unknown)) + tables.table(["logged signal", "correlation with this heat"], rows, (1,))


def _residuals(d: Diagnosis) -> str:
    drawn = drawn_runs(d)
    left_out = [s.run for s in d.series if s not in drawn]
    more = f"<p>{escape('Runs with smaller residuals, not drawn: ' + ', '.join(left_out))}</p>" if left_out else ""
    return "\n".join([_shown(residual_map(s)) for s in drawn]) + more


def _channels(d: Diagnosis) -> str:
    told = tables.channels_table(d)
    if not d.traces:
        return told
    with matplotlib.rc_context(PAGE_RC):
        return told + Picture("Measured and computed", CAPTION, channel_figure(d.traces)).html()


def _shown(picture: Picture | None) -> str:
    return picture.html() if picture else ""


def _notes(d: Diagnosis) -> str:
    facts = {**d.provenance, "catalogue": d.catalogue, "seed": d.seed}
    rows = [[str(key), _fact(value)] for key, value in facts.items()]
    return tables.items(d.notes[1:]) + tables.table(["", ""], rows)


def _fact(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(plain(value), ensure_ascii=False)
    return text if len(text) <= 300 else text[:300] + " … (all of it in report.json)"
