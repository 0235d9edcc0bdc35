"""Over 2,000 damaged logs: never anything but a LogError, and never a wrong number without a flag.

Each damage says what must become of it: `harmless` (the same numbers and nothing found), `refused` (an error that names
the file), or `flagged` (an error or a warning that names the file and, where a cell or column is hurt, line or column).
Random bytes fall in no class: whatever they do, a number that is wrong in silence must be a single plausible cell.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.logs.damaged import (
    ROWS,
    RUN_TOML,
    SENSORS,
    SIGNALS,
    STEP,
    STROKES,
    Log,
    change,
    column,
    differences,
    german,
    iso,
    sound,
    write,
)  # fmt: skip
from twin.errors import LogError, Problem
from twin.logs.check import check_run
from twin.logs.read import parse_run, read_run
from twin.logs.run import Run

SEEDS = 26  # of each damage
RANDOM_SEEDS = 80  # of each kind of random bytes
BASES = 12

Rng = np.random.Generator
Files = dict[str, bytes]


@dataclass(frozen=True)
class Damage:
    """One way to hurt a log, and what must come of it."""

    name: str
    apply: Callable[[Log, Rng], Log | Files]
    must: str  # "harmless", "refused", "flagged"
    says: tuple[str, ...] = ()  # any of these stands in a finding
    tables: str = "loads"  # the file that a finding must name


@cache
def base(k: int) -> Log:
    return sound(np.random.default_rng([7, k]))


@cache
def truth(k: int, folder: Path) -> Run:
    return read_run(write(folder / f"truth_{k}", base(k).files()))


def findings(folder: Path) -> tuple[Run | None, list[Problem]]:
    """What reading and checking say; no run where reading refuses it. Anything but a LogError fails the test."""
    try:
        run = parse_run(folder)
    except LogError as e:
        assert e.problems  # noqa: PT017 - either outcome is right
        return None, list(e.problems)
    return run, check_run(run, SIGNALS, ("x",), SENSORS, None, STROKES)


def rows_edit(name: str, edit: Callable[[list[list[str]], Rng], list[list[str]]]) -> Callable[[Log, Rng], Log]:
    """An edit of the rows under the header."""
    return lambda log, rng: change(log, name, lambda rows: [rows[0], *edit(rows[1:], rng)])


def some(rng: Rng, low: int = 20, high: int = ROWS - 20) -> int:
    return int(rng.integers(low, high))


def every_file(edit: Callable[[bytes], bytes]) -> Callable[[Log, Rng], Files]:
    return lambda log, rng: {k: edit(v) if k != "run.toml" else v for k, v in log.files().items()}


def one_line(log: Log, rng: Rng, edit: Callable[[str], str]) -> Files:
    files = log.files()
    lines = files["loads.csv"].decode().split("\n")
    k = some(rng)
    lines[k] = edit(lines[k])
    return files | {"loads.csv": "\n".join(lines).encode()}


def header(name: str, old: str, new: str) -> Callable[[Log, Rng], Log]:
    def edit(rows: list[list[str]]) -> list[list[str]]:
        assert any(old in cell for cell in rows[0])
        return [[cell.replace(old, new) for cell in rows[0]], *rows[1:]]

    return lambda log, rng: change(log, name, edit)


def one_cell(name: str, edit: Callable[[str, Rng], str], columns: tuple[int, ...]) -> Callable[[Log, Rng], Log]:
    def apply(log: Log, rng: Rng) -> Log:
        def edit_rows(rows: list[list[str]]) -> list[list[str]]:
            k, c = some(rng), int(rng.choice(columns))
            rows[k][c] = edit(rows[k][c], rng)
            return rows

        return change(log, name, edit_rows)

    return apply


def reset(rows: list[list[str]], rng: Rng) -> list[list[str]]:
    k = some(rng, 100)
    return rows[:k] + [[f"{STEP * i:.0f}", *row[1:]] for i, row in enumerate(rows[k:])]


def doubled(rows: list[list[str]], rng: Rng) -> list[list[str]]:
    k, n = some(rng), int(rng.integers(1, 30))
    return rows[: k + n] + rows[k:]


def shuffled(rows: list[list[str]], rng: Rng) -> list[list[str]]:
    k = some(rng)
    n = min(int(rng.integers(3, 60)), ROWS - k)
    return rows[:k] + [rows[k + i] for i in [1, 0, *(rng.permutation(n - 2) + 2)]] + rows[k + n :]


def lost(rows: list[list[str]], rng: Rng) -> list[list[str]]:
    k = some(rng)
    return rows[:k] + rows[k + int(rng.integers(1, 15)) :]


def on_change(rows: list[list[str]], rng: Rng) -> list[list[str]]:
    """What a subscription with dead bands stores: a row when a channel has moved, the others as they were stored."""
    bands = [np.quantile(np.abs(np.diff([float(r[c]) for r in rows])), 0.7) * 3.0 for c in range(1, len(rows[0]))]
    kept = [rows[0]]
    for row in rows[1:]:
        last = kept[-1]
        c = int(
            np.argmax([abs(float(a) - float(b)) - band for a, b, band in zip(row[1:], last[1:], bands, strict=True)])
        )
        if abs(float(row[1 + c]) - float(last[1 + c])) > bands[c]:
            kept.append([row[0], *(row[i] if i == 1 + c else last[i] for i in range(1, len(row)))])
    return kept


def frozen(header_name: str, table: str, rows: int) -> Callable[[Log, Rng], Log]:
    def apply(log: Log, rng: Rng) -> Log:
        k = some(rng, 20, 60)

        def freeze(values: np.ndarray) -> np.ndarray:
            return np.where((np.arange(len(values)) >= k) & (np.arange(len(values)) < k + rows), values[k], values)

        return column(log, table, header_name, freeze)

    return apply


def shifted(header_name: str, rows: int) -> Callable[[Log, Rng], Log]:
    return lambda log, rng: column(log, "loads", header_name, lambda v: np.roll(v, rows))


def tables_shifted(rows: int) -> Callable[[Log, Rng], Log]:
    """All temperatures some rows late against the loads; rows that would come from nowhere are left out."""

    def edit(table: list[list[str]], rng: Rng) -> list[list[str]]:
        late = range(max(0, rows), ROWS + min(0, rows))
        return [[table[k][0], *table[k - rows][1:]] for k in late]

    return rows_edit("temperatures", edit)


def times_slip(log: Log, rng: Rng) -> Log:
    return header("loads", "time [s]", f"time [{rng.choice(['ms', 'min', 'h'])}]")(log, rng)


def wrong_hour(log: Log, rng: Rng) -> Log:
    return replace(iso(log, "offset"), run=RUN_TOML.replace("+02:00", str(rng.choice(["+01:00", "+03:00", "Z"]))))


def zone_jump(log: Log, rng: Rng) -> Log:
    """The logger's zone changes while it runs: its wall clock goes on."""
    k, new = some(rng), str(rng.choice(["+01:00", "+03:00"]))

    def edit(rows: list[list[str]]) -> list[list[str]]:
        return rows[:k] + [[row[0].replace("+02:00", new), *row[1:]] for row in rows[k:]]

    return change(iso(log, "offset"), "loads", edit)


def across_the_change(log: Log, rng: Rng) -> Log:
    """Local times without a zone, in the night in which 02:00 .. 03:00 comes twice."""
    late = int(rng.integers(14_400, 17_900))  # s after 22:00
    moved = change(log, "loads", lambda rows: [rows[0], *([str(int(r[0]) + late), *r[1:]] for r in rows[1:])])
    return iso(moved, "naive")


def peaks(log: Log, rng: Rng) -> Log:
    """A current that rests at its limit for a while, logged as amplitude."""
    limit = 12.0 * np.sqrt(2.0)
    k = some(rng, 20, 200)

    def rest(v: np.ndarray) -> np.ndarray:
        v = v * np.sqrt(2.0)
        v[k : k + 20] = limit
        return v

    return column(log, "loads", "x_current", rest)


def factor(value: float) -> Callable[[str, Rng], str]:
    return lambda cell, rng: f"{float(cell) * value:.6g}"


def mixed_marks(log: Log, rng: Rng) -> Log:
    return one_cell("loads", lambda cell, rng: cell.replace(",", "."), (4, 6, 7))(german(log), rng)


def dropped_column(log: Log, rng: Rng) -> Log:
    c = int(rng.integers(1, len(log.loads[0])))
    return change(log, "loads", lambda rows: [row[:c] + row[c + 1 :] for row in rows])


LINE, COLUMN = ("(line", "(lines"), ("'",)
DAMAGES = [
    Damage("BOM", every_file(lambda b: b"\xef\xbb\xbf" + b), "harmless"),
    Damage("CRLF", every_file(lambda b: b.replace(b"\n", b"\r\n")), "harmless"),
    Damage("blank lines at the end", every_file(lambda b: b + b"\n\r\n \n"), "harmless"),
    Damage("UTF-16", every_file(lambda b: b.decode().encode("utf-16")), "harmless"),
    Damage("quotes", every_file(lambda b: b'"' + b.replace(b",", b'","').replace(b"\n", b'"\n"')[:-1]), "harmless"),
    Damage("delimiter at the end", every_file(lambda b: b.replace(b"\n", b",\n")), "harmless"),
    Damage("blanks in cells", every_file(lambda b: b.replace(b",", b" ,  ")), "harmless"),
    Damage("German", lambda log, rng: german(log), "harmless"),
    Damage("German with tabs", lambda log, rng: german(log, "\t"), "harmless"),
    Damage("ISO times", lambda log, rng: iso(log, str(rng.choice(["offset", "utc"]))), "harmless"),
    Damage("line cut short", lambda log, rng: one_line(log, rng, lambda s: s[: s.rindex(",")]), "refused", LINE),
    Damage("separators swapped", lambda log, rng: one_line(log, rng, lambda s: s.replace(",", ";")), "refused", LINE),
    Damage("decimal commas among commas", lambda log, rng: one_line(log, rng, lambda s: s.replace(".", ",")),
           "refused", LINE),
    Damage("mixed decimal marks", mixed_marks, "refused", LINE),
    Damage("thousands separators", one_cell("loads", lambda c, rng: "1.234,5", (4,)), "refused", LINE),
    Damage("text for a number", one_cell("loads", lambda c, rng: str(rng.choice(["#N/A", "---", "1_0", "0x1F", "?"])),
           tuple(range(8))), "refused", LINE),
    Damage("no time", one_cell("loads", lambda c, rng: str(rng.choice(["", "nan", "inf"])), (0,)), "refused", LINE),
    Damage("nul bytes", lambda log, rng: one_line(log, rng, lambda s: s[:9] + "\0" * int(rng.integers(1, 40)) + s[9:]),
           "refused", LINE),
    Damage("rows shuffled", rows_edit("loads", shuffled), "refused", LINE),
    Damage("rows reversed", rows_edit("loads", lambda rows, rng: rows[::-1]), "refused", LINE),
    Damage("rows doubled", rows_edit("loads", doubled), "refused", LINE),
    Damage("temperatures shuffled", rows_edit("temperatures", shuffled), "refused", LINE, "temperatures"),
    Damage("clock restarts", rows_edit("loads", reset), "refused", ("the clock starts again", "backwards")),
    Damage("a time twice", rows_edit("loads", lambda rows, rng: [
        [rows[k - 1][0], *row[1:]] if k == 77 else row for k, row in enumerate(rows)]), "refused", ("(line 79)",)),
    Damage("column missing", dropped_column, "refused", ("no column",)),
    Damage("unit lost from a header", header("loads", "x_speed [m/min]", "x_speed"), "refused", ("has no unit",)),
    Damage("unit of another kind", header("loads", "[A]", "[V]"), "refused", ("is in V",)),
    Damage("unknown unit", header("loads", "[kW]", "[kVV]"), "refused", ("unknown unit",)),
    Damage("header twice", header("loads", "x_speed", "x_motor_speed"), "refused", ("appears twice", "no column")),
    Damage("unit of time", times_slip, "refused", ("run.toml says",)),
    Damage("another day", rows_edit("temperatures", lambda rows, rng: [[str(86400 + int(r[0])), *r[1:]] for r in rows]),
           "refused", ("lie outside",), "temperatures"),
    Damage("clock change", across_the_change, "refused", ("twice on 2026-10-25",)),
    Damage("naive times, no zone", lambda log, rng: replace(iso(log, "naive"), run=RUN_TOML.replace("zone", "#")),
           "refused", ("has no zone",)),
    Damage("naive times", lambda log, rng: iso(log, "naive"), "flagged", ("without a zone",)),
    Damage("start of another zone", wrong_hour, "flagged", ("start in run.toml",)),
    Damage("zone changes", zone_jump, "flagged", ("backwards", "a gap")),
    Damage("rows lost", rows_edit("loads", lost), "flagged", ("a gap",)),
    Damage("rows on change only", rows_edit("loads", on_change), "flagged", ("only where something changes", "a gap")),
    Damage("values lost", one_cell("loads", lambda c, rng: str(rng.choice(["", "nan", "inf", "1e999"])), (1, 2, 4, 7)),
           "flagged", ("lacks",)),
    Damage("huge numbers", one_cell("loads", lambda c, rng: f"{rng.choice([-1, 1]) * 10.0 ** rng.uniform(5, 300):.5g}",
           (1, 2, 3, 4, 5, 6, 7)), "flagged", LINE),
    Damage("spikes of temperatures", one_cell("temperatures", lambda c, rng:
           f"{float(c) + rng.choice([-9, 9, 40]):.3f}", (1, 2, 3, 4)), "flagged", LINE, "temperatures"),
    Damage("minus lost", one_cell("loads", lambda c, rng: f"{-float(c) - 30:.3f}", (7,)), "flagged", LINE),
    *(
        Damage(f"header {old} for {new}", header(table, old, new), "flagged", COLUMN, table)
        for table, old, new in (
            ("loads", "x_position [mm]", "x_position [m]"), ("loads", "x_position [mm]", "x_position [um]"),
            ("loads", "x_position [mm]", "x_position [cm]"), ("loads", "[m/min]", "[m/s]"),
            ("loads", "[m/min]", "[mm/min]"), ("loads", "x_motor_speed [1/min]", "x_motor_speed [1/s]"),
            ("loads", "spindle_speed [1/min]", "spindle_speed [1/s]"), ("loads", "[A]", "[mA]"),
            ("loads", "spindle_speed [1/min]", "spindle_speed [1/h]"), ("loads", "[kW]", "[W]"),
            ("loads", "[degC]", "[degF]"), ("loads", "[degC]", "[K]"), ("temperatures", "front [degC]", "front [degF]"),
            ("temperatures", "shop [degC]", "shop [K]"), ("tcp", "[um]", "[mm]"), ("tcp", "x [mm]", "x [m]"),
        )
    ),
    Damage("currents in mA", lambda log, rng: column(log, "loads", "x_current", lambda v: 1e3 * v), "flagged", COLUMN),
    Damage("power in W", lambda log, rng: column(log, "loads", "spindle_power", lambda v: 1e3 * v), "flagged", COLUMN),
    Damage("peaks as rms", peaks, "flagged", ("rests at",)),
    Damage("negative rms", lambda log, rng: column(log, "loads", "x_current", lambda v: v - 2.0), "flagged",
           ("negative",)),
    Damage("channel dead", lambda log, rng: column(
        log, "loads", str(rng.choice(["x_current", "x_speed", "spindle_power"])), lambda v: 0 * v), "flagged",
        ("zero",)),
    Damage("sensor dead", lambda log, rng: column(log, "temperatures", "bed", lambda v: 0 * v + 21.3), "flagged",
           ("never changes",), "temperatures"),
    Damage("position stuck", frozen("x_position", "loads", 110), "flagged",
           ("rests while", "sample(s)", "times the speed")),
    Damage("current stuck", frozen("x_current", "loads", 110), "flagged", ("to the last digit",)),
    Damage("motor speed stuck", frozen("x_motor_speed", "loads", 110), "flagged",
           ("stands still", "moves while", "rests while")),
    Damage("sensor stuck", frozen("motor", "temperatures", 90), "flagged", ("stands still",), "temperatures"),
    Damage("speed a row late", shifted("x_speed", 1), "flagged", ("sample(s) late", "row(s)")),
    Damage("speed a row early", shifted("x_speed", -1), "flagged", ("sample(s) early", "row(s)")),
    Damage("motor a row late", shifted("x_motor_speed", 1), "flagged", ("row(s) after", "row(s) before")),
    Damage("temperatures a row early", tables_shifted(-1), "flagged", ("before they act",), "temperatures"),
    Damage("temperatures two rows late", tables_shifted(2), "flagged", ("late",), "temperatures"),
]  # fmt: skip


def assert_told_as_it_must(damage: Damage, problems: list[Problem], told: list[Problem], wrong: dict) -> None:
    """told: those of `problems` that speak of the damage; wrong: what the run holds that is not true."""
    if damage.must == "harmless":
        assert not wrong, wrong
        assert problems == []
    elif damage.must == "refused":
        assert any(not p.warning for p in told), problems
    else:
        assert told, problems
        assert all(p.remedy for p in told)


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda d: d.name)
def test_every_damage_comes_out_as_it_must(tmp_path, damage):
    outcomes: Counter[str] = Counter()
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, len(damage.name)])
        log = base(seed % BASES)
        hurt = damage.apply(log, rng)
        run, problems = findings(write(tmp_path / "run", hurt.files() if isinstance(hurt, Log) else hurt))
        told = [
            p for p in problems
            if damage.tables in p.where and any(s in f"{p.where} {p.what}" for s in damage.says or ("",))
        ]  # fmt: skip
        wrong = {} if run is None else differences(run, truth(seed % BASES, tmp_path))
        assert_told_as_it_must(damage, problems, told, wrong)
        outcomes["refused" if any(not p.warning for p in problems) else "flagged" if problems else "silent"] += 1
    expected = {"harmless": "silent", "refused": "refused"}.get(damage.must)
    assert outcomes["silent"] == (SEEDS if damage.must == "harmless" else 0)
    assert expected is None or outcomes[expected] == SEEDS


def flip(data: bytearray, k: int, rng: Rng) -> None:
    data[k] ^= 1 << int(rng.integers(8))


def overwrite(data: bytearray, k: int, rng: Rng) -> None:
    data[k] = int(rng.integers(256))


def digit(data: bytearray, k: int, rng: Rng) -> None:
    data[k] = int(rng.choice(list(b"0123456789.,;-e \n")))


def delete(data: bytearray, k: int, rng: Rng) -> None:
    del data[k]


def insert(data: bytearray, k: int, rng: Rng) -> None:
    data[k:k] = bytes([int(rng.choice(list(b"0123456789.,;-e \n\x00\xff")))])


def assert_one_plausible_cell(wrong: dict, name: str, true: Run, run: Run) -> None:
    """What differs is one cell of the table `name`, and within three spreads of its column."""
    ((table, channel), rows), *more = wrong.items()
    assert not more
    assert rows.tolist() != [-1]
    assert len(rows) == 1, (channel, rows)
    assert table == name
    if name != "tcp" and channel != "time":
        was, now = (getattr(r, name).columns[channel] for r in (true, run))
        assert was.min() - 3.5 * np.ptp(was) <= now[rows[0]] <= was.max() + 3.5 * np.ptp(was)
    elif channel == "time":
        assert name == "tcp" or rows[0] == ROWS - 1  # the beat of other tables gives a wrong time away


@pytest.mark.parametrize("how", [flip, overwrite, digit, delete, insert])
def test_one_random_byte_is_told_or_harmless(tmp_path, how):
    """What stays silent is one cell with a plausible number, within three spreads of its column: docs/run_folder.md."""
    outcomes: Counter[str] = Counter()
    for seed in range(RANDOM_SEEDS):
        rng = np.random.default_rng([seed, 99])
        log = base(seed % BASES)
        files = log.files()
        name = str(rng.choice(["loads", "loads", "temperatures", "tcp"]))
        data = bytearray(files[f"{name}.csv"])
        # the header is short: every third byte that is hurt is one of it
        k = int(rng.integers(data.index(b"\n") if seed % 3 == 0 else len(data)))
        how(data, k, rng)
        run, problems = findings(write(tmp_path / "run", files | {f"{name}.csv": bytes(data)}))
        true = truth(seed % BASES, tmp_path)
        wrong = {} if run is None else differences(run, true)
        if problems:
            outcomes["told"] += 1
            assert any(name in p.where for p in problems)
        elif not wrong:
            outcomes["no number changed"] += 1
        else:
            outcomes["silent"] += 1
            assert_one_plausible_cell(wrong, name, true, run)
    assert outcomes["told"] > 0.3 * RANDOM_SEEDS, outcomes
    assert outcomes["silent"] < 0.6 * RANDOM_SEEDS, outcomes


def test_damage_upon_damage(tmp_path):
    """Several damages at once, and noise: nothing but a LogError, and no silence where a number is wrong."""
    loud = [d for d in DAMAGES if d.must != "harmless"]
    outcomes: Counter[str] = Counter()
    for seed in range(RANDOM_SEEDS):
        rng = np.random.default_rng([seed, 5])
        log = base(seed % BASES)
        hurt: Log | Files = log
        for k in rng.permutation(len(loud)):
            if not isinstance(hurt, Log):
                break
            try:
                hurt = loud[k].apply(hurt, rng)
            except (AssertionError, ValueError, IndexError, StopIteration):
                continue  # a damage that finds nothing left to hurt
            if rng.random() < 0.4:
                break
        files = dict(hurt.files() if isinstance(hurt, Log) else hurt)
        for _ in range(int(rng.integers(4))):
            name = str(rng.choice(list(files)))
            data = bytearray(files[name])
            at = int(rng.integers(len(data)))
            data[at : at + int(rng.integers(1, 50))] = rng.bytes(int(rng.integers(60)))
            files[name] = bytes(data)
        run, problems = findings(write(tmp_path / "run", files))
        wrong = {} if run is None else differences(run, truth(seed % BASES, tmp_path))
        outcomes["told" if problems else "silent and right" if not wrong else "silent and wrong"] += 1
    assert outcomes["silent and wrong"] == 0, outcomes
    assert outcomes["told"] > 0.95 * RANDOM_SEEDS


def test_over_two_thousand_logs_are_thrown():
    assert SEEDS * len(DAMAGES) + 6 * RANDOM_SEEDS >= 2000
    assert Counter(d.must for d in DAMAGES).keys() == {"harmless", "refused", "flagged"}
