"""What we write uses the field's terms: no word of the last table of docs/nomenclature.md stands anywhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NOMENCLATURE = ROOT / "docs" / "nomenclature.md"
HEADING = "## Words we do not use"
ROOTS = (
    "README.md",
    "CHANGELOG.md",
    "docs/**/*.md",
    "models/*/README.md",
    *(f"{folder}/**/*.py" for folder in ("twin", "tests", "benchmarks", "models", "notebooks")),
)
FILES = sorted({path for pattern in ROOTS for path in ROOT.glob(pattern)} - {Path(__file__)})


def table() -> list[list[str]]:
    """Cells of the table: words that are not written, terms, exceptions."""
    lines = NOMENCLATURE.read_text(encoding="utf-8").split(HEADING)[1].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return rows[2:]


WORDS = [word.strip() for old, _, _ in table() for word in old.split(",")]
EXCEPTIONS = [name for _, _, exceptions in table() for name in re.findall(r"`([^`]+)`", exceptions)]
FORBIDDEN = re.compile(r"(?<!\w)(" + "|".join(word.replace(" ", r"\s+") for word in WORDS) + r")(?!\w)", re.IGNORECASE)


def prose(text: str) -> str:
    """Text in words: identifiers at their underscores and capitals, lines joined without marks of comments."""
    text = re.sub(r"\s*\n\s*(?:#+|>)?\s*", " ", text)
    for name in EXCEPTIONS:
        text = text.replace(name, " ")
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|_", " ", text)


def found(text: str) -> list[str]:
    """Every forbidden word of a text, with what stands around it."""
    words = prose(text)
    return [words[max(m.start() - 40, 0) : m.end() + 40] for m in FORBIDDEN.finditer(words)]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_uses_the_terms_of_the_field(path):
    text = path.read_text(encoding="utf-8")
    if path == NOMENCLATURE:
        text = text.split(HEADING)[0]
    assert found(text) == []
    assert found(str(path.relative_to(ROOT))) == []


def test_every_old_word_has_a_term():
    assert len(WORDS) > 20
    assert all(old and term for old, term, _ in table())


@pytest.mark.parametrize(
    "text",
    [
        "class Yardstick:", "def make_yardstick(a):", "from twin.diagnose.march import x", "tests/test_march.py",
        "a dearer step", "MENDED = 1", "errors\n    # of form", "`bench.runs`", "it lives\nthrough a run",
    ],
)  # fmt: skip
def test_old_words_are_found(text):
    assert len(found(text)) == 1


@pytest.mark.parametrize(
    "text", ["python -m benchmarks step", "make bench", "amended", "an endearing name", "the form of a law"]
)
def test_other_words_are_not(text):
    assert found(text) == []
