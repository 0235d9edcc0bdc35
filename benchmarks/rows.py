"""Rows of campaigns, one per trial: kept in files, judged, and counted."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from twin.atomic import atomic_path

Row = dict[str, Any]
Place = tuple[str, str]  # family, place
# K, m: what a fault in the machine must do to be asked for, in means of an hour, or of three TCP rows
VISIBLE = 0.5, 3e-6


def written(path: Path, rows: Iterable[Row]) -> None:
    """Write rows, a line each, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")


def read(path: Path) -> list[Row]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def kept(path: Path, make: Callable[[], Sequence[Row]]) -> list[Row]:
    """The rows of a file; they are made where there is none."""
    if not path.exists():
        written(path, make())
    return read(path)


def of_seeds(folder: Path, name: str, seeds: Iterable[int], make: Callable[[int], Sequence[Row]]) -> list[Row]:
    """The rows of folder/NAME_SEED.jsonl with their seed; those of files that are not there are made."""
    return [
        row | {"seed": seed} for seed in seeds for row in kept(folder / f"{name}_{seed}.jsonl", partial(make, seed))
    ]


def visible(row: Row) -> bool:
    """Whether what is hidden moves a sensor or the TCP by VISIBLE; faults of sensors always do."""
    return any(m >= least for m, least in zip(row.get("moved", VISIBLE), VISIBLE, strict=True))


def worth(named: Sequence[Place], others: Iterable[Place], right: set[Place]) -> str:
    """What causes are worth: "right" (the first one is), "among" (another one, or one of the others that cannot be
    distinguished from them) or "wrong"."""
    if named and named[0] in right:
        return "right"
    return "among" if right & {*named, *others} else "wrong"


def counts(answers: Iterable[str]) -> str:
    """As "3 right, 1 wrong"."""
    return ", ".join(f"{n} {answer}" for answer, n in Counter(answers).most_common())


def counted(
    rows: Sequence[Row], answer: Callable[[Row], str], kind: Callable[[Row], str],
    seen: Callable[[Row], bool] = visible,
) -> None:  # fmt: skip
    """Print the answers, and how many there are of each by kind of what is hidden: of all, and of what is visible."""
    for row in rows:
        told = "" if seen(row) else "(not visible) "
        told += f"dispersion {row['dispersion']:.2f}, best {row['best']:.0f}, " if "dispersion" in row else ""
        print(row["seed"], row["hidden"], answer(row), row["verdict"], row["causes"], f"{told}{row['seconds']:.0f} s")
    for title, own in (("of all", rows), ("of those that are visible", list(filter(seen, rows)))):
        print(title)
        for one in dict.fromkeys(map(kind, own)):
            print(f"   {one:<22} {counts(answer(row) for row in own if kind(row) == one)}")
