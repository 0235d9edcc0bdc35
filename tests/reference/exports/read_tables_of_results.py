"""Results that `twin export A.h5 --format csv|json|xarray --result OUT` wrote, in pandas and xarray.

python read_tables_of_results.py RESULT.csv|RESULT.json|RESULT.nc
"""

from __future__ import annotations

import json
import sys

import numpy as np


def frame(path):
    """A pandas DataFrame over time [s]; units are in `attrs`."""
    import pandas

    table = pandas.read_csv(path)
    names = {column: column.partition(" [")[0] for column in table.columns}
    units = {names[c]: c.partition(" [")[2].rstrip("]") for c in table.columns}
    table = table.rename(columns=names).set_index("time")
    table.attrs["units"] = units
    return table


def dataset(path):
    """An xarray Dataset of a netCDF4 or JSON file."""
    import xarray

    if not str(path).endswith(".json"):
        return xarray.load_dataset(path, engine="h5netcdf")
    with open(path, encoding="utf-8") as file:
        told = json.load(file)
    tables = {n: (t["dims"], np.array(t["values"]), {"units": t["unit"]}) for n, t in told["tables"].items()}
    return xarray.Dataset(tables, {n: c["values"] for n, c in told["coordinates"].items()})


if __name__ == "__main__":
    print(frame(sys.argv[1]).describe() if sys.argv[1].endswith(".csv") else dataset(sys.argv[1]))
