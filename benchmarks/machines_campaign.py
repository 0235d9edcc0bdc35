"""Effects hidden in other machines than the five-axis one, and looked for: `python -m benchmarks.machines_campaign
[MINUTES [FIRST [KIND ...]]]`; `make campaign-machines`.

KINDS: drawn networks (lumped) and machines of boxes, the ball-screw axis as nodes, and shipped machines of parts. A
piece is one real machine, with nothing hidden twice and with one fault of each kind (benchmarks.drawn_machines,
benchmarks.shipped_machines); its rows go to out/machines/KIND_SEED.jsonl, and what is there is not made again. Seeds
below FIRST were looked at while the search was made. With SCHEDULER=tcp://host:port pieces go to the workers of a Dask
scheduler (twin.build.spread).
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import jax

from benchmarks import drawn_machines, shipped_machines
from benchmarks.drawn_machines import answer, headlined
from benchmarks.rows import Row, read, visible, written
from twin.build.spread import spread
from twin.inject.judge.figures import Share
from twin.progress import bar

OUT = Path("out/machines")
FIRST = 531  # seed: none of a drawn machine that was looked at (docs/campaign.md)
COUNTS = {"lumped": 20, "nodes": 10, "boxes": 4, "ball_screw_axis": 4, "ram_borer": 4, "transfer_unit": 4}

Piece = tuple[str, int]  # kind, seed


def rows_of(deadline: float, piece: Piece) -> list[Row]:
    """A row per trial of one machine; none after the deadline, as `time.time` counts."""
    if time.time() > deadline:
        return []
    kind, seed = piece
    judged = shipped_machines.judged if kind in shipped_machines.TOGETHER else drawn_machines.judged
    rows = judged(kind, seed)
    jax.clear_caches()  # of this machine: after a dozen the system refuses LLVM more mapped memory
    return rows


def pieces(first: int, kinds: Sequence[str]) -> list[Piece]:
    return [(kind, seed) for kind in kinds for seed in range(first, first + COUNTS[kind])]


def path_of(piece: Piece) -> Path:
    return OUT / f"{piece[0]}_{piece[1]}.jsonl"


def results(known: Iterable[Piece]) -> Iterator[tuple[str, Row]]:
    """Kind and row of every trial that was made."""
    for piece in known:
        if path_of(piece).exists():
            yield from ((piece[0], row) for row in read(path_of(piece)))


def table(rows: Sequence[tuple[str, Row]]) -> str:
    """Markdown: what was said of machines with nothing hidden, and of visible faults, by kind of machine."""
    lines = [
        "| machine | nothing hidden: false alarms | 95 % interval | visible: detected | of these right "
        "| or ambiguous with it |",
        6 * "|---" + "|",
    ]
    for kind in [*dict.fromkeys(k for k, _ in rows), ""]:
        own = [row for k, row in rows if kind in (k, "")]
        nulls = [answer(r) for r in own if r["hidden"][0] == "nothing"]
        told = [answer(r) for r in own if r["hidden"][0] != "nothing" and visible(r)]
        alarms = Share(nulls.count("false alarm"), len(nulls))
        found = Share(len(told) - told.count("missed"), len(told))
        right = Share(told.count("right"), found.k)
        among = Share(told.count("right") + told.count("among"), found.k)
        lines.append(f"| {kind or 'all'} | {alarms.of} | {alarms.interval} | {found.of} ({found.text}) | "
                     f"{right.of} ({right.text}) | {among.of} ({among.text}) |")  # fmt: skip
    lines += [
        "",
        "| hidden, visible | right | among ambiguous | unknown | wrong | missed | of these in the headline |",
        7 * "|---" + "|",
    ]
    for family in dict.fromkeys(r["hidden"][0] for _, r in rows if r["hidden"][0] != "nothing"):
        own = [r for _, r in rows if r["hidden"][0] == family and visible(r)]
        said = Counter(map(answer, own)) + Counter({"headline": sum(map(headlined, own))})
        shown = (str(said[name]) for name in ("right", "among", "unknown", "wrong", "missed", "headline"))
        lines.append(f"| {family} | {' | '.join(shown)} |")
    return "\n".join(lines)


def main(minutes: float = float("inf"), first: int = FIRST, kinds: Sequence[str] = tuple(COUNTS)) -> None:
    every = pieces(first, kinds)
    todo = [p for p in every if not path_of(p).exists()]
    with bar("machines", len(todo)) as advance:

        def done(piece: Piece, rows: list[Row]) -> None:
            if rows:
                written(path_of(piece), rows)
            advance(f"{piece[0]} of seed {piece[1]}")

        spread(rows_of, time.time() + 60.0 * minutes, todo, done)
    print(table(list(results(every))), flush=True)


if __name__ == "__main__":
    from benchmarks.machines_campaign import main as called  # helpers import functions by the name of their module

    given = sys.argv[1:]
    called(
        float(given[0]) if given else float("inf"),
        int(given[1]) if len(given) > 1 else FIRST,
        given[2:] or tuple(COUNTS),
    )
