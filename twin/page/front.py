"""The front end as a page: with its files beside it from a server, or with everything inside one file."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from twin.atomic import atomic_path

STYLES = ("vendor/uplot.min.css", "page.css")
SCRIPTS = (
    "vendor/three.min.js", "vendor/uplot.min.js", "colours.js", "store.js", "stage.js", "surface.js", "workspace.js",
    "charts.js", "panels.js", "page.js", "live.js", "start.js",
)  # fmt: skip


@dataclass(frozen=True)
class Front:
    """Which files of the front end make a page; the last script starts it with `class Page`."""

    body: str  # within frame.html
    styles: tuple[str, ...]
    scripts: tuple[str, ...]


RESULT = Front("page.html", STYLES, SCRIPTS)
DESCRIBED = Front(
    "show.html",
    ("page.css", "show.css"),
    ("vendor/three.min.js", "store.js", "stage.js", "panels.js", "show.js", "network.js", "show_page.js", "start.js"),
)
_STRICT = "default-src 'none'; img-src data: blob:; base-uri 'none'; form-action 'none'"


@cache
def text(name: str) -> str:
    """A file of the front end."""
    return (resources.files("twin.page") / "front" / name).read_text(encoding="utf-8")


def served_page() -> str:
    """The page whose files a server has."""
    styles = "\n".join(f'<link rel="stylesheet" href="{name}">' for name in STYLES)
    scripts = "\n".join(f'<script src="{name}"></script>' for name in SCRIPTS)
    return _filled(RESULT, policy="", styles=styles, content="", scripts=scripts)


def frozen_page(content: Mapping[str, Any], front: Front = RESULT) -> str:
    """The page with its content and all it needs within; its policy allows these scripts and nothing from elsewhere."""
    script, style = "\n".join(text(name) for name in front.scripts), "\n".join(text(name) for name in front.styles)
    policy = f"{_STRICT}; script-src '{_hash(script)}'; style-src '{_hash(style)}'"
    # within a script element "</" and "<!--" would end it or hide its end
    data = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return _filled(
        front,
        policy=f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        styles=f"<style>{style}</style>",
        content=f'<script type="application/json" id="content">{data}</script>',
        scripts=f"<script>{script}</script>",
    )


def write_page(path: Path, content: Mapping[str, Any], front: Front = RESULT) -> None:
    """The frozen page as a file, whole or not at all. Raises TwinError where it cannot be written."""
    with atomic_path(path) as temporary:
        temporary.write_text(frozen_page(content, front), encoding="utf-8", newline="\n")


def _filled(front: Front, /, **parts: str) -> str:
    page = text("frame.html").replace("<!--body-->\n", text(front.body))
    for name, part in parts.items():
        page = page.replace(f"<!--{name}-->", part)
    return page


def _hash(code: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(code.encode("utf-8")).digest()).decode("ascii")
