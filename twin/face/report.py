"""Pictures of a result as files, and its page."""

from __future__ import annotations

from pathlib import Path

from twin.progress import Progress, silent


def report(artefact: str | Path, output: str | Path, progress: Progress = silent) -> list[Path]:
    """Write temperatures.png, tcp.png, workspace.png, surface.png and index.html beside a result; returns their paths.

    artefact: A.h5. output: folder that `twin run -o` left. Pictures of what the machine lacks are left out, and the
    page says so. It needs nothing beside it. Raises TwinError where the folder holds no result of this artefact.
    """
    from twin.page.finished import finished_told
    from twin.page.front import write_page
    from twin.pictures.report import write_pictures
    from twin.rom.artefact import read_artefact

    read, folder = read_artefact(Path(artefact)), Path(output)
    written = write_pictures(read, folder, progress)
    page = folder / "index.html"
    write_page(page, finished_told(read, folder))
    return [*written, page]
