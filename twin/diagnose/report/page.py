"""The report of a diagnosis: index.html, which needs nothing beside it, and report.json."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from twin.atomic import atomic_path, check_folder
from twin.diagnose.report import tables
from twin.diagnose.report import text as words
from twin.diagnose.report.evidence import candidates_picture, cosine_picture, nulls_picture, pulls_picture
from twin.diagnose.report.gain import channels_picture, gain_picture, overlay_picture, unknown_picture
from twin.diagnose.report.pictures import Picture, inline_svg, rms
from twin.diagnose.report.place import place_picture
from twin.diagnose.report.plan import plan_section
from twin.diagnose.report.residuals import RUNS, by_load_state, residual_map, whiteness_picture
from twin.diagnose.report.style import STYLE
from twin.diagnose.result.diagnosis import Diagnosis

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
# What follows from a verdict, for who acts on it
_FOLLOWS = {
    "named": "The extended model whose gain is shown below holds this.",
    "ambiguous": "The data allow more than one edit of the description; what to measure next is said below.",
    "unknown": "Where the heat enters is known, its law is not; look below at when it comes.",
    "out_of_tolerance": "The structure of the model holds; the declared values do not, or an effect hides in them.",
    "sensor": "The model of the machine is left as it is; correct the channel, or leave it out, before you calibrate.",
    "signal": "The laws of the machine are left as they are; correct what is logged or how it is declared.",
    "too_poor": "No cause is named: with such a model many would fit. Add what would help first, and diagnose again.",
    "nothing": "The model of the machine is left as it is. An effect below the following sizes could still be there.",
}


def _follows(d: Diagnosis) -> str:
    """What to do with a verdict."""
    if d.verdict == "unknown" and d.unknown is None:  # the sealed run refuted the name
        return "What was named does not predict the sealed run; see the notes."
    return _FOLLOWS[d.verdict]


def write_report(diagnosis: Diagnosis, folder: Path) -> None:
    """Write index.html and report.json into `folder`, each whole or not at all.

    report.json is `Diagnosis.to_json` with null where a number is not finite.
    Raises TwinError where the folder cannot be written.
    """
    check_folder(Path(folder))
    facts = json.dumps(plain(diagnosis.to_json()), indent=1, allow_nan=False, ensure_ascii=False)
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


@dataclass(frozen=True)
class Section:
    """A part of the page: what everybody reads, and what opens with a click. A link to it opens it."""

    name: str
    title: str
    shown: str = ""
    folded: str = ""

    def html(self) -> str:
        head = f"<h2>{self.title}</h2>"
        if not self.shown:
            inner = f'<section id="{self.name}">\n{self.folded}\n</section>'
            return f'<details class="part"><summary>{head}</summary>\n{inner}</details>'
        more = f"<details><summary>Pictures and tables</summary>\n{self.folded}\n</details>" if self.folded else ""
        return f'<section id="{self.name}">{head}\n{self.shown}\n{more}</section>'


def page(d: Diagnosis) -> str:
    """The whole page."""
    numbers = itertools.count(1)

    def show(*pictures: Picture | None) -> str:
        return "\n".join(_figure(picture, f"p{next(numbers)}") for picture in pictures if picture is not None)

    place = show(place_picture(d))
    sections = [
        Section("evidence", "What it rests on", _evidence(d)),
        Section("plan", "The next experiment", plan_section(d.plan)),
        Section("gain", "Gain on the sealed run", *_gain(d, show)),
        Section("residuals", "Residuals", folded=_residuals(d, show)),
        Section("channels", "Channels", folded=tables.channels_table(d) + show(channels_picture(d))),
        Section("decision", "How it was decided", folded=_decision(d, show)),
        Section("pulls", "Pulls", folded=_pulls(d, show)),
        Section("unknown", "Heat that nothing explains", *_unknown(d, show)),
        Section("limits", "Detection limits", *_limits(d)),
        Section("notes", "Notes and provenance", folded=_notes(d)),
    ]
    sections = [s for s in sections if s.shown or s.folded]
    if d.verdict == "nothing":  # what would have been seen is the result then
        sections.insert(0, sections.pop([s.name for s in sections].index("limits")))
    contents = " ".join(f'<a href="#{s.name}">{s.title}</a>' for s in sections)
    body = "\n".join(s.html() for s in sections)
    title = escape(f"{d.machine}: diagnosis")
    sentence = words.verdict_sentence(d)
    said = "".join(f"<p>{escape(text)}</p>" for text in d.summary if text.lower() not in sentence.lower())
    carried = f"<p>{escape(words.support_words(d.support))}</p>" if d.support else ""
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{STYLE}</style></head><body>
<h1>{title}</h1>
<div class="verdict {d.verdict}"><p class="label">{_LABELS[d.verdict]}</p>
<p class="sentence">{escape(sentence)}</p><p>{_follows(d)}</p>{carried}</div>
{place}
{said}
<nav>{contents}</nav>
{body}
</body></html>
"""


def _figure(picture: Picture, name: str) -> str:
    return (
        f"<figure><h3>{escape(picture.title)}</h3>\n{inline_svg(picture.figure, name)}\n"
        f'<figcaption id="{name}_caption">{escape(picture.caption)}</figcaption></figure>'
    )


def _items(texts: Iterable[str]) -> str:
    items = "\n".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<ul>\n{items}\n</ul>" if items else ""


def _evidence(d: Diagnosis) -> str:
    parts = []
    if d.causes:
        heads = [f"{words.place_words(c.place)}, {words.what(c.family)}" for c in d.causes]
        told = _items(f"{head}: {words.cause_evidence(d, c)}" for head, c in zip(heads, d.causes, strict=True))
        parts += [tables.causes_table(d.causes), told]
    if d.unknown:
        parts.append(_items([words.evidence_sentence(d, "unknown", d.unknown.statistic, d.unknown.threshold)]))
    if d.verdict == "out_of_tolerance":
        parts.append(_items(_pull_sentences(d)))
    if not parts:
        withdrawn, none = "The sealed run refuted what was named.", "No family of causes passes its threshold."
        parts.append(f"<p>{withdrawn if d.verdict == 'unknown' else none}</p>")
        shares = {k: v / d.thresholds[k] for k, v in d.observed.items() if d.thresholds.get(k, 0) > 0}
        if best := max(shares, key=lambda k: shares[k], default=None):
            text = words.evidence_sentence(d, best, d.observed[best], d.thresholds[best])
            parts.append(f"<p>{escape(f'The nearest is {words.what(best)}. {text}')}</p>")
    return "\n".join([*parts, _rivals(d)])


def _pull_sentences(d: Diagnosis) -> list[str]:
    """What is out of tolerance first, whatever else is pulled farther."""
    causes = [p for p in (words.pull_of(d, c) for c in d.causes) if p]
    return [
        f"{p.path} lies {p.pull:+.1f} standard deviations from what was declared; a right declaration does so "
        f"once in {_once(abs(p.pull))}."
        for p in [*causes, *(p for p in words.beyond(d.pulls, 2.0) if p not in causes)][:5]
    ]


def _once(sigmas: float) -> str:
    chance = math.erfc(sigmas / math.sqrt(2))
    return f"{1 / chance:.0f}" if chance > 1e-6 else "more than a million"


def _rivals(d: Diagnosis) -> str:
    parts = []
    for c in d.causes:
        if c.rivals:
            parts.append(f"<h3>{escape(f'Rivals of {words.what(c.family)} at {words.place_words(c.place)}')}</h3>")
            parts.append(tables.rivals_table(c.rivals, False, d))
    if words.remedies(d):
        parts.append("<h3>What would tell them apart</h3>" + _items(words.remedies(d)))
    elif d.verdict == "ambiguous":
        parts.append("<p>No single measurement is known that would tell them apart.</p>")
    return "\n".join(parts)


def _gain(d: Diagnosis, show: Any) -> tuple[str, str]:
    """What is read, and what is folded."""
    pictures = show(*(p for s in d.series if s.sealed for p in (gain_picture(d, s.run), overlay_picture(d, s))))
    if not d.gain:
        sealed = any(s.sealed for s in d.series)
        why = "nothing was measured in the run kept aside" if sealed else "no run was kept aside"
        return f"<p>There is no gain to report: {why}.</p>", pictures
    runs = words.sealed_runs(d)
    told = f"Run {runs[0]} was" if len(runs) == 1 else f"Runs {', '.join(runs)} were"
    head = f"<p>{escape(f'{told} opened once, after everything was decided.')}</p>"
    return head + _items(words.gain_sentences(d)), pictures + tables.gain_table(d)


def _residuals(d: Diagnosis, show: Any) -> str:
    order = sorted(d.series, key=lambda s: (s.sealed, -float(np.nan_to_num(rms(s.delivered.ravel())))))
    drawn = {s.run for s in order[:RUNS]} | {s.run for s in d.series if s.sealed}
    maps = [residual_map(s) for s in d.series if s.run in drawn]
    shown = show(*maps, by_load_state(d.series), whiteness_picture(d))
    left_out = [s.run for s in d.series if s.run not in drawn]
    if left_out:
        shown += f"<p>{escape('Runs with smaller residuals, not drawn: ' + ', '.join(left_out))}</p>"
    return shown or "<p>There are no residuals to draw.</p>"


def _decision(d: Diagnosis, show: Any) -> str:
    if not (d.observed or d.thresholds or d.ranked):
        return "<p>No candidate was tried.</p>"
    families = tables.families_table(d) if d.observed or d.thresholds else ""
    parts = [show(nulls_picture(d)), families, show(candidates_picture(d))]
    if d.ranked:
        parts.append(tables.rivals_table(d.ranked, True, d))
    return "\n".join([*parts, show(cosine_picture(d))])


def _pulls(d: Diagnosis, show: Any) -> str:
    if not d.pulls:
        return "<p>No declared parameter was fitted.</p>"
    if not words.beyond(d.pulls, 2.0) and not any(p.freed for p in d.pulls):
        return "<p>No declared parameter was pulled by more than 2 standard deviations.</p>" + show(pulls_picture(d))
    return show(pulls_picture(d)) + tables.pulls_table(d)


def _unknown(d: Diagnosis, show: Any) -> tuple[str, str]:
    if d.unknown is None:
        return "", "<p>No heat remained that the catalogue does not explain.</p>"
    rows = [[name, f"{correlation:+.2f}"] for name, correlation in d.unknown.correlated_signals]
    follows = tables.table(["logged signal", "correlation with this heat"], rows, (1,)) if rows else ""
    return show(unknown_picture(d)) + follows, ""


def _limits(d: Diagnosis) -> tuple[str, str]:
    """The result where nothing is found; else folded."""
    if not d.detection_limits:
        return "", "<p>Detection limits were not determined.</p>"
    text = (
        "The smallest size of each effect that would have been named in these data; smaller ones may be there unseen."
    )
    every = f"<p>{text}</p>{tables.limits_table(d)}"
    if d.verdict not in ("nothing", "too_poor"):
        return "", every
    sizes = _items(map(words.limit_words, d.detection_limits))
    lead = "At half of all places these data would have shown, in 95 of 100 cases:"
    return f"<p><strong>{lead}</strong></p>{sizes}", every


def _notes(d: Diagnosis) -> str:
    facts = [[str(key), _fact(value)] for key, value in d.provenance.items()]
    facts += [["catalogue", d.catalogue], ["seed", str(d.seed)]]
    return (_items(d.notes) or "<p>Nothing was excluded or held.</p>") + tables.table(["", ""], facts)


def _fact(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(plain(value), ensure_ascii=False)
    return text if len(text) <= 300 else text[:300] + " … (all of it in report.json)"
