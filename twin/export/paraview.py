"""A series for ParaView: series.pvd and a VTU per time, written by meshio; compressed, nothing rounded."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

from twin.atomic import atomic_folder, check_folder
from twin.errors import TwinError
from twin.export.frames import frames_of
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact


def export_vtk(artefact: Artefact, folder: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `vtk`: a new folder, or over an older one of this format; open series.pvd.

    Raises TwinError as `frames_of`, and where the folder holds anything else.
    """
    import meshio

    _refuse_other_files(folder)
    series = frames_of(artefact, options)
    entries = []
    with atomic_folder(folder) as temporary:
        for k, frame in enumerate(series.frames):
            name = f"frame_{k:04d}.vtu"
            mesh = meshio.Mesh(frame.points, [(series.cell_type, series.cells)], point_data=frame.data)
            mesh.write(temporary / name, file_format="vtu")
            entries.append(f"<DataSet timestep={quoteattr(repr(frame.time))} part='0' file={quoteattr(name)}/>")
        note = [f"<!-- {series.note.replace('--', '')} -->"] if series.note else []
        lines = ["<?xml version='1.0'?>", *note, "<VTKFile type='Collection' version='0.1'>", "<Collection>"]
        text = "\n".join([*lines, *entries, "</Collection>", "</VTKFile>", ""])
        (temporary / "series.pvd").write_text(text, encoding="ascii")
    what = ", ".join([*frame.data, *([series.note] if series.note else [])])
    return (f"{folder}/series.pvd: {series.count} times, {len(series.cells)} cells ({series.cell_type}), {what}",)


def _refuse_other_files(folder: Path) -> None:
    check_folder(folder)
    for path in folder.iterdir() if folder.exists() else ():
        if path.name != "series.pvd" and not (path.name.startswith("frame_") and path.suffix == ".vtu"):
            what = f"holds '{path.name}', which is no frame of this export, so it is not replaced"
            raise TwinError(what, str(folder), "choose another folder with -o")
