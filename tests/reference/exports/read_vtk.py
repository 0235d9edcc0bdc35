"""A series that `twin export A.h5 --format vtk|vtkhdf --result OUT` wrote, read by VTK and drawn by PyVista.

python read_vtk.py FOLDER/series.pvd PICTURE.png
"""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree


def frames_of_pvd(path):
    """(time [s], vtkUnstructuredGrid) of a .pvd, by VTK's own reader of VTU files."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    for entry in ElementTree.parse(path).iter("DataSet"):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(Path(path).parent / entry.get("file")))
        reader.Update()
        yield float(entry.get("timestep")), reader.GetOutput()


def frames_of_vtkhdf(path):
    """The same of a .vtkhdf."""
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.Update()
    for k in range(reader.GetNumberOfSteps()):
        reader.SetStep(k)
        reader.Update()
        grid = vtkUnstructuredGrid()
        grid.DeepCopy(reader.GetOutputDataObject(0))
        yield reader.GetTimeValue(), grid


def arrays(grid):
    """Points and point data of a grid as NumPy arrays."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = grid.GetPointData()
    named = {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}
    return vtk_to_numpy(grid.GetPoints().GetData()), named


def picture(path, target):
    """The last frame of a .pvd, coloured by temperature, drawn off-screen."""
    import pyvista

    *_, (time, grid) = frames_of_pvd(path)
    plotter = pyvista.Plotter(off_screen=True, window_size=(640, 480))
    plotter.add_mesh(pyvista.wrap(grid), scalars="temperature", cmap="inferno")
    plotter.add_text(f"{time / 3600:.1f} h", font_size=10)
    plotter.screenshot(str(target))
    plotter.close()


if __name__ == "__main__":
    for time, grid in frames_of_pvd(sys.argv[1]):
        temperature = arrays(grid)[1]["temperature"]
        print(f"{time / 3600:6.2f} h: {temperature.min():.2f} to {temperature.max():.2f} degC")
    picture(sys.argv[1], sys.argv[2])
