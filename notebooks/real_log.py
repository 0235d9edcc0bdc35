# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From a real log to a twin
#
# A logger has recorded some days of a lathe: a dozen temperatures, the spindle speed, the displacement X and Z of the
# tool. Nobody described the machine, one sensor broke, and one file was put together from two. What now?
#
# The data here are made up, in the shape of a lathe's that was measured (`models/lathe`), so that we know what is true:
# a network of seven nodes stands for the machine, its numbers off by up to 20 %. Everything below is Python; the
# commands are `twin check`, `twin new`, `twin build`, `twin score` and `twin diagnose`.

# %%
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

import twin
from twin.face.new import from_log
from twin.logs.write import write_run

LATHE, OUT = Path("models/lathe"), Path("out/real_log")
shutil.rmtree(OUT, ignore_errors=True)
rng = np.random.default_rng(4)

# %% [markdown]
# ## The days
#
# Every day its own speeds (1/min, h) in a room that is never the same; a row a minute.

# %%
PLAN = {
    "monday": ((2000, 2.5), (1000, 2.5)),
    "tuesday": ((1000, 2.0), (0, 1.0), (1800, 2.0)),
    "wednesday": ((1500, 3.0), (0, 2.0)),
    "thursday": ((800, 2.0), (2000, 3.0)),
    "friday": ((1200, 2.0), (0, 1.0), (2000, 2.0)),
}
HOURS = 7.0  # simulated; five are logged, and what comes after is spliced into one of them

described = twin.load(LATHE)
lengths = {
    "motor": (1.5, -2.0),
    "headstock": (3.0, 2.5),
    "saddle": (-2.0, 1.0),
    "column": (2.0, -3.0),
    "bed": (-1.5, 3.5),
}
known = {
    f"tcp.expansion.{node}.{axis}": 1e-6 * v for node, xz in lengths.items() for axis, v in zip("xz", xz, strict=True)
}
off = {path: rng.uniform(0.8, 1.2) * value for path, value in described.parameters.items() if value}
real = described.edited(off | known, OUT / "real.toml")


def loads(folder: Path, plan: tuple[tuple[float, float], ...]) -> Path:
    """A run folder with what drives the machine."""
    time = np.arange(0.0, HOURS * 3600.0 + 1.0, 60.0)
    ends = 3600.0 * np.cumsum([hours for _, hours in plan])
    speed = np.array([*(s for s, _ in plan), 0.0])[np.searchsorted(ends, time, side="right")]
    room = rng.uniform(19.0, 25.0) + rng.uniform(0.5, 1.5) * np.sin(time / 3600.0 / rng.uniform(1.5, 3.0))
    cabin = room + 2.0 * np.convolve(speed / 2000.0, np.exp(-np.arange(90) / 20.0) / 20.0)[: len(time)]
    folder.mkdir(parents=True, exist_ok=True)
    header = "time [s],spindle_speed [1/min],feeding [1],TC04 [degC],TC08 [degC]"
    rows = np.column_stack([time, speed, speed > 0.0, cabin, room])
    np.savetxt(folder / "loads.csv", rows, "%.6g", ",", header=header, comments="")
    facts = 'sampling = "60 s"\nprovenance = "made by a notebook"\nsynthetic = ["loads"]\n'
    start = f'initial_temperature = "{room[0]:.3f} degC"\n'
    (folder / "run.toml").write_text(facts + start, encoding="utf-8")
    return folder


options = twin.SimulateOptions(noise="0.05 K", tcp_every="1 min", tcp_noise="0.3 um")
whole = {
    day: twin.simulate(real, loads(OUT / "loads" / day, plan), OUT / "whole" / day, replace(options, seed=k))
    for k, (day, plan) in enumerate(PLAN.items())
}

# %% [markdown]
# ## Two mishaps
#
# On Tuesday the sensor PT05 breaks after two hours: its readings are noise from then on. Wednesday's file goes on, from
# row 200 on, with rows of an hour and a half later.

# %%
ROWS = 300
BROKEN, BREAK, SPLICE, LATER = "PT05", 120, 200, 90


def logged(day: str) -> dict[str, np.ndarray]:
    """The columns of a day's file, five hours of it, mishaps included."""
    run = whole[day]
    at = np.arange(ROWS)
    if day == "wednesday":
        at = np.where(at < SPLICE, at, at + LATER)
    columns = {"Time": np.arange(ROWS, dtype=float)}
    columns |= {name: values[at] for name, values in run.temperatures.columns.items()}
    columns["Spindle speed"] = 60.0 * run.loads.columns["spindle_speed"][at]
    moved = np.column_stack([np.interp(60.0 * at, run.tcp.time, c) for c in run.tcp.displacement.T])
    columns |= {"Disp. X": 1e6 * (moved[:, 0] - moved[0, 0]), "Disp. Z": 1e6 * (moved[:, 2] - moved[0, 2])}
    if day == "tuesday":
        columns[BROKEN] = columns[BROKEN] + 8.0 * rng.standard_normal(ROWS) * (np.arange(ROWS) >= BREAK)
    return columns


logs = {}
for day in PLAN:
    columns = logged(day)
    logs[day] = OUT / f"{day}.csv"
    rows = np.column_stack([*columns.values()])
    np.savetxt(logs[day], rows, "%.3f", ",", header=",".join(columns), comments="")
print(logs["monday"].read_text("utf-8")[:260])

# %% [markdown]
# ## A twin from nothing but the files
#
# Columns are taken for what their headers and values say. A column that broke is used in no run, and of a spliced file
# what comes before the splice; both are listed. What remains: bodies that follow a logged temperature or heat with some
# lag and move the tool. Friday is sealed.

# %%
training = ["monday", "tuesday", "wednesday", "thursday"]
new = from_log([logs[day] for day in training], OUT / "proposed", sealed=[logs["friday"]])
print(new)

# %%
model = twin.build(OUT / "proposed")
print(twin.score(model, OUT / "proposed" / "runs" / "monday", sealed=[OUT / "proposed" / "runs" / "friday"]))

# %% [markdown]
# ## What is wrong with the files
#
# The same files as run folders: `twin check` names sensor and line.

# %%
runs = {}
for day in PLAN:
    run, columns = whole[day], logged(day)
    time, of_row = 60.0 * columns["Time"], np.arange(ROWS)
    temperatures = {n: columns[n] for n in run.temperatures.columns}
    driven = {n: v[:ROWS] for n, v in run.loads.columns.items()}
    displacement = np.column_stack([1e-6 * columns["Disp. X"], np.full(ROWS, np.nan), 1e-6 * columns["Disp. Z"]])[::5]
    tcp = replace(
        run.tcp, time=time[::5], position=np.zeros((len(time[::5]), 0)), displacement=displacement, sigma=None
    )
    made = replace(
        run, loads=replace(run.loads, time=time, columns=driven), tcp=tcp, tcp_reference="first", machine=None,
        temperatures=replace(run.temperatures, time=time, columns=temperatures), folder=OUT / "runs" / day,
    )  # fmt: skip
    write_run(OUT / "runs" / day, made)
    runs[day] = OUT / "runs" / day

found = {day: twin.check(runs[day], machine=LATHE) for day in ("tuesday", "wednesday", "thursday")}
for findings in found.values():
    print(findings)

# %% [markdown]
# ## What a diagnosis makes of it
#
# Somebody has described the lathe after all (`models/lathe`, with the lengths that move the tool). Its numbers are
# those of a designer, up to 20 % off. A diagnosis of Tuesday and Wednesday must not invent heat for a broken sensor,
# nor for rows of another time.

# %%
lathe = described.edited(known, OUT / "described.toml")
diagnosis = twin.diagnose(
    twin.build(lathe), [runs["tuesday"], runs["wednesday"]], options=twin.DiagnoseOptions(noise="0.05 K", nulls=20)
)
print(diagnosis)
for note in diagnosis.findings.notes:
    print(note)

# %% [markdown]
# Every channel beside the model; orange readings were not used.

# %%
from twin.pictures.channels import channel_figure

channel_figure([t for t in diagnosis.findings.traces if t.channel in ("PT05", "PT02", "dx", "dz")])

# %% [markdown]
# The numbers above are asserted whenever this notebook is executed.

# %%
figure = {f.axis: f for f in new.figures if f.part == "sealed"}
assert any(BROKEN in line and "tuesday" in line for line in new.not_used)
assert any("of another time" in line and "wednesday" in line for line in new.not_used)
assert BROKEN not in (OUT / "proposed" / "machine.toml").read_text("utf-8")
for axis in figure.values():
    assert axis.network < 0.4 * axis.zero, axis

broken, spliced, sound = (str(found[day]) for day in ("tuesday", "wednesday", "thursday"))
assert f"'{BROKEN}' leaps to and fro" in broken
assert f"rows of another time from line {SPLICE + 2} on" in spliced  # its header is line 1
assert BROKEN not in sound
assert "another time" not in sound

assert diagnosis.verdict == "sensor"
assert [(c.family, c.place) for c in diagnosis.causes] == [("sensor", f"sensors.{BROKEN}")]
assert any("rows of another time" in note for note in diagnosis.findings.notes)
kept = {(r["run"], r["channel"]): r["kept"] for r in diagnosis.findings.channels}
assert kept["tuesday", BROKEN] < 0.5
assert kept["tuesday", "PT02"] > 0.9
