"""docs/description.md names every key that a description may have."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel

from twin.machine import description

PAGE = (Path(__file__).parents[2] / "docs" / "description.md").read_text(encoding="utf-8")
ELSEWHERE = {"Bar", "Node", "Strut", "Platform"}  # docs/lumped.md


def test_every_key_is_on_the_page():
    entries = [
        kind
        for name, kind in vars(description).items()
        if isinstance(kind, type) and issubclass(kind, BaseModel) and name not in ("Entry", "Machine", *ELSEWHERE)
    ]
    assert len(entries) > 15
    missing = [f"{e.__name__}.{key}" for e in entries for key in e.model_fields if f"`{key}`" not in PAGE]
    inline = {"Tcp.tool", "Tcp.work", "Tcp.platform"}  # headings of their own
    assert sorted(set(missing) - inline) == []


def test_every_section_is_on_the_page():
    assert [s for s in description.Machine.model_fields if s != "folder" and f"[{s}" not in PAGE] == []
