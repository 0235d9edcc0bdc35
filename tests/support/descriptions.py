"""Edited copies of the small machine of the tests."""

from __future__ import annotations

from pathlib import Path

SLIDE = Path(__file__).parents[1] / "machines" / "slide" / "machine.toml"
MACHINES = sorted(
    p for root in ("models", "tests/machines") for p in Path(__file__).parents[2].glob(f"{root}/*/machine.toml")
)


def edited(folder: Path, *edits: tuple[str, str]) -> Path:
    """A copy of the slide's description in `folder` with texts replaced."""
    text = SLIDE.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path
