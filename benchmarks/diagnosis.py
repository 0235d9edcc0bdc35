"""`twin diagnose` as a user calls it, on the five-axis machine: the first time on new loads, and after that.

The runs are those of a trial in tests/hidden: 14 W at the bed's left face, truth from the full model of another mesh.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from benchmarks.five_axis import EXPERIMENT, FOLDER, TRUTHS
from benchmarks.machines import twin
from twin.inject.experiment import RUNS
from twin.inject.stored.recipe import trial_of
from twin.inject.stored.table import table
from twin.logs.write import write_run

TRIAL = "heat_source"


def main() -> None:
    trial = trial_of(EXPERIMENT, table(EXPERIMENT)[TRIAL], TRUTHS)
    (hidden,) = trial.hidden
    print(f"   hidden: {hidden.family} at {hidden.place}, {hidden.size:g} {hidden.unit}")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        artefact, report = folder / "machine.h5", folder / "report"
        for name, run in zip(RUNS, trial.runs, strict=True):
            write_run(folder / name, run)
        twin(["build", str(FOLDER), "-o", str(artefact)], folder)
        looked_at = [str(folder / name) for name in RUNS[:2]]
        asked = ["diagnose", str(artefact), *looked_at, "--sealed", str(folder / RUNS[2]), "--noise", "0.08 K"]
        first = twin([*asked, "-o", str(report), "--no-build"], folder)
        again = twin([*asked, "-o", str(report), "--no-build"], folder)
        built = twin([*asked, "-o", str(report)], folder)
        verify = twin(["verify", str(report / "extended.h5")], folder)
        found = json.loads((report / "report.json").read_text(encoding="utf-8"))
    print(f"   {found['verdict']}")
    for c in found["causes"]:
        low, high = c["ci95"]
        size = f"{c['amplitude']:.1f} [{low:.1f}, {high:.1f}] {c['unit']}"
        print(f"   {c['family']} at {c['place']}, {c['history']}: {size}")
    helped = [g for g in found["gain"] if g["ci95"][0] > 0.0]
    best = max(found["gain"], key=lambda g: g["recalibrated"] / g["extended"])
    print(f"   sealed run: {len(helped)} of {len(found['gain'])} channels significantly better; ", end="")
    print(f"most {best['channel']}, rms", end="")
    print("".join(f" {best[m]:.3g} {best['unit']} {m}" for m in ("delivered", "recalibrated", "extended")))
    print(
        f"   first diagnosis on these loads {first:.0f} s, the next {again:.0f} s, with the extended artefact "
        f"{built:.0f} s; twin verify of it passes in {verify:.0f} s"
    )


if __name__ == "__main__":
    main()
