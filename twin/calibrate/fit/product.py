"""The artefact with fitted parameters, its description edited likewise, and the report of the fit as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from twin import __version__
from twin.atomic import atomic_path
from twin.calibrate.channels.judge import Judgement, words
from twin.calibrate.fit.calibration import Calibration
from twin.calibrate.fit.channel_table import channel_table
from twin.calibrate.fit.experiments import propose
from twin.calibrate.fit.fit import Fit
from twin.calibrate.fit.separation import Separation, sentences, separation
from twin.logs.run import Run
from twin.logs.trace import Trace
from twin.rom.apply import with_values
from twin.rom.artefact import Artefact, write_artefact
from twin.rom.parameter import Parameter

SIGNIFICANT = 2.0  # a pull beyond it is worth a look
LEARNED = 0.5  # share of the prior variance that the data must take away for a value to be theirs


def rows(fit: Fit, found: Separation) -> list[dict[str, Any]]:
    """One entry per parameter: value with its standard deviation, pull, what the data knew of it, flags."""
    problem = fit.problem
    result = []
    for k, p in enumerate(problem.parameters):
        value = p.value(float(fit.x[k]))
        spread = p.sigma * float(fit.sigma[k]) * (value if p.scale == "log" else 1.0)
        flags = [
            text
            for wrong, text in (
                (fit.at_bound[k], "at its bound"),
                (found.learned[k] < LEARNED, "mostly its prior: these data hardly see it"),
                (abs(fit.x[k]) > SIGNIFICANT, "far from its prior"),
            )
            if wrong
        ]
        result.append(
            {
                "path": p.path,
                "unit": p.unit,
                "nominal": p.nominal,
                "value": value,
                "sigma": spread,
                "pull": float(fit.x[k]),
                "prior_sigma": p.sigma,
                "scale": p.scale,
                "learned": float(found.learned[k]),
                "low": p.low,
                "high": p.high,
                "flags": flags,
            }
        )
    return result


def told(
    result: Calibration, runs: Sequence[Run], experiments: bool = True, judgement: Judgement | None = None,
    traces: Sequence[Trace] = (),
) -> dict[str, Any]:  # fmt: skip
    """What there is to report about a calibration, as JSON values. judgement: of the channels of its runs; traces: of
    all channels, beside the runs as logged."""
    fit = result.fit
    found = separation(fit.problem.names, fit.information)
    proposals = propose(fit, found.combinations) if experiments else {}
    n = len(fit.problem.parameters)
    sizes = np.sqrt(np.diag(fit.covariance))
    return {
        "stopped": fit.stopped,
        "iterations": len(fit.history),
        "rounds": result.rounds,
        "seconds": result.seconds,
        "cost": [{"iteration": i.number, "cost": i.cost, "seconds": i.seconds} for i in fit.history],
        "window_model": {
            "states": fit.problem.model.n,
            "rms_temperature_K": result.agreement.temperature,
            "rms_displacement_m": result.agreement.displacement,
            "enough": result.agreement.enough,
        },
        "runs": [
            {
                "name": run.name,
                "folder": str(original.folder),
                "temperatures": run.measured.n_temperature,
                "tcp_rows": len(run.measured.tcp),
                "rms_temperature_K": _rms(T),
                "rms_displacement_m": _rms(w),
                "not_used": list(run.measured.skipped),
            }
            for run, original, (T, w) in zip(fit.problem.runs, runs, fit.residual, strict=True)
        ],
        "set_aside": [words(f, [r.name for r in fit.problem.runs]) for f in judgement.findings] if judgement else [],
        "channels": channel_table(fit, judgement, traces),
        "parameters": rows(fit, found),
        "initial": [
            {"path": name, "unit": "K", "value": float(fit.x[n + i] * s.sigma), "sigma": float(sizes[n + i] * s.sigma)}
            for i, (name, s) in enumerate(zip(fit.problem.names[n:], fit.problem.starts, strict=True))
        ],
        "correlation": (fit.covariance / np.outer(sizes, sizes)).tolist(),
        "names": list(fit.problem.names),
        "not_separated": sentences(found),
        "experiments": {
            name: [{"do": e.name, "sigma_before": e.sigma_before, "sigma_after": e.sigma_after} for e in best]
            for name, best in proposals.items()
        },
    }


def _rms(values: np.ndarray) -> float | None:
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else None


def calibrated(artefact: Artefact, parameters: Sequence[Parameter], values: dict[str, float]) -> tuple[Any, Any]:
    """The model at these values, and the parameters with these values as their nominal ones."""
    model = with_values(artefact.model, parameters, values)
    now = tuple(replace(p, nominal=values.get(p.path, p.nominal)) for p in artefact.parameters)
    return model, now


def write_calibrated(
    artefact: Artefact, target: Path, report: dict[str, Any], parameters: Sequence[Parameter], command: str
) -> str:
    """Write the artefact with the fitted values; returns its description; the report notes whether that was edited.

    The certificate stays what it was, marked as that of the values before: `twin verify` makes one for the new ones.
    Raises TwinError if the file cannot be written.
    """
    values = {row["path"]: row["value"] for row in report["parameters"]}
    model, now = calibrated(artefact, parameters, values)
    text, report["description_edited"] = edited_description(artefact.description, report)
    certificate = {**artefact.certificate, "holds_for": f"the values before calibration, model {artefact.digest[:16]}"}
    provenance = {
        **artefact.provenance,
        "calibrated_from": artefact.digest,
        "calibrated_on": ", ".join(run["folder"] for run in report["runs"]),
        "calibrated_with": f"twin {__version__}",
        "command": command,
        "calibration": json.dumps({k: report[k] for k in ("stopped", "iterations", "parameters")}),
    }
    fields = artefact.fields
    if any(p.kind == "expansion" and values.get(p.path, p.nominal) != p.nominal for p in parameters):
        # how far each part moves the surface is not in the artefact: `twin build` of the new description tells
        fields = tuple(replace(f, displacement=None, flexibility=None) for f in fields)
    write_artefact(target, model, text, certificate, provenance, fields, parameters=now)
    return text


def edited_description(text: str, report: dict[str, Any]) -> tuple[str, bool]:
    """The description at the fitted values, each with a remark; as it was, and False, where pydantic is missing."""
    if not text.strip():
        return text, False
    try:
        from twin.machine.edit import edited
    except ModuleNotFoundError:  # the edge has no pydantic: the numbers are in the artefact all the same
        return text, False
    changed = {row["path"]: row for row in report["parameters"]}
    remarks = {
        path: f"calibrated: {row['value']:.4g} +- {row['sigma']:.2g} {row['unit']} (was {row['nominal']:.4g})"
        for path, row in changed.items()
    }
    return edited(text, {path: row["value"] for path, row in changed.items()}, remarks, digits=9), True


def write_report(path: Path, report: dict[str, Any]) -> None:
    """Write the report, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
