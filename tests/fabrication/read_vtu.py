"""Reads a VTU file with VTK; prints its cells, points and arrays as JSON."""

import json
import sys

try:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)

reader = vtkXMLUnstructuredGridReader()
problems = []
reader.AddObserver("ErrorEvent", lambda *_: problems.append("error"))
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()


def arrays(data):
    seen = {}
    for i in range(data.GetNumberOfArrays()):
        array = data.GetArray(i)
        rows = [array.GetTuple(k) for k in (0, array.GetNumberOfTuples() - 1)]
        seen[array.GetName()] = {
            "tuples": array.GetNumberOfTuples(),
            "type": array.GetDataTypeAsString(),
            "first": rows[0],
            "last": rows[1],
        }
    return seen


cells = [grid.GetCell(i) for i in (0, grid.GetNumberOfCells() - 1)]
json.dump(
    {
        "errors": problems,
        "points": grid.GetNumberOfPoints(),
        "cells": grid.GetNumberOfCells(),
        "bounds": grid.GetBounds(),
        "types": [c.GetCellType() for c in cells],
        "last_cell": [cells[1].GetPointId(k) for k in range(cells[1].GetNumberOfPoints())],
        "vectors": grid.GetPointData().GetVectors().GetName() if grid.GetPointData().GetVectors() else None,
        "point_data": arrays(grid.GetPointData()),
        "cell_data": arrays(grid.GetCellData()),
    },
    sys.stdout,
)
