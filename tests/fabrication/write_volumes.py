"""Writes one block of tetrahedra, one of hexahedra, in every way that VTK, meshio and Gmsh know, into a folder.

The mesh: nodes at (i, j, k) * (10, 8, 6) + (0.1, 0.2, 0.3), i = 0..3, j = 0..2, k = 0..1, the first running fastest; each
cell one hexahedron, or six tetrahedra round its diagonal. Label of an element: 1 where its cell has i = 0, 2 elsewhere.
"""

import sys
from itertools import product
from pathlib import Path

try:
    import meshio
    import numpy as np
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk
except ImportError as error:
    print(f"{error}: pip install -r tests/fabrication/requirements.txt", file=sys.stderr)
    sys.exit(77)

folder = Path(sys.argv[1])
ni, nj, nk = 4, 3, 2
points = np.array([(10.0 * i + 0.1, 8.0 * j + 0.2, 6.0 * k + 0.3) for k, j, i in product(range(nk), range(nj), range(ni))])


def node(i, j, k):
    return i + ni * (j + nj * k)


def ring(i, j, k):
    return [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)]


hexahedra, of_cell = [], []
for k, j, i in product(range(nk - 1), range(nj - 1), range(ni - 1)):
    hexahedra.append(ring(i, j, k) + ring(i, j, k + 1))
    of_cell.append(1 if i == 0 else 2)
kuhn = [[0, 1, 2, 6], [0, 5, 1, 6], [0, 4, 5, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6]]
tetrahedra = [[cell[c] for c in tet] for cell in hexahedra for tet in kuhn]
labels = {"hexahedron": of_cell, "tetra": [label for label in of_cell for _ in kuhn]}
cells = {"hexahedron": np.array(hexahedra), "tetra": np.array(tetrahedra)}

for kind, connectivity in cells.items():
    own = np.array(labels[kind], dtype=np.int32)
    mesh = meshio.Mesh(points, [(kind, connectivity)], cell_data={"gmsh:physical": [own], "gmsh:geometrical": [own]})
    mesh.field_data = {"first": np.array([1, 3]), "rest": np.array([2, 3])}
    for binary in (False, True):
        word = "binary" if binary else "ascii"
        meshio.gmsh.write(folder / f"{kind}-meshio22-{word}.msh", mesh, "2.2", binary=binary)
    plain = meshio.Mesh(points, [(kind, connectivity)], cell_data={"label": [own]})
    # Without labels: meshio writes no entities to MSH 4.1.
    bare = meshio.Mesh(points, [(kind, connectivity)])
    for binary in (False, True):
        word = "binary" if binary else "ascii"
        meshio.gmsh.write(folder / f"{kind}-meshio41-{word}.msh", bare, "4.1", binary=binary)
    meshio.vtu.write(folder / f"{kind}-meshio-ascii.vtu", plain, binary=False)
    meshio.vtu.write(folder / f"{kind}-meshio-binary.vtu", plain, binary=True, compression=None)
    meshio.vtu.write(folder / f"{kind}-meshio-zlib.vtu", plain, binary=True, compression="zlib")

    for type_name, header, compressed, mode, big in product(
        (np.float32, np.float64), (32, 64), (False, True), ("ascii", "binary", "raw", "base64"), (False, True)
    ):
        grid = vtk.vtkUnstructuredGrid()
        own_points = vtk.vtkPoints()
        own_points.SetData(numpy_to_vtk(points.astype(type_name), deep=True))
        grid.SetPoints(own_points)
        for cell in connectivity:
            ids = vtk.vtkIdList()
            # A voxel lists its corners row by row.
            voxel = kind == "hexahedron" and header == 32
            order = [0, 1, 3, 2, 4, 5, 7, 6] if voxel else range(len(cell))
            for c in order:
                ids.InsertNextId(int(cell[c]))
            number = {"tetra": vtk.VTK_TETRA, "hexahedron": vtk.VTK_VOXEL if voxel else vtk.VTK_HEXAHEDRON}[kind]
            grid.InsertNextCell(number, ids)
        label = numpy_to_vtk(own, deep=True)
        label.SetName("label")
        grid.GetCellData().AddArray(label)
        writer = vtk.vtkXMLUnstructuredGridWriter()
        name = f"{kind}-vtk-{np.dtype(type_name).name}-{header}-{'zlib' if compressed else 'plain'}-{mode}-{'big' if big else 'little'}"
        writer.SetFileName(str(folder / f"{name}.vtu"))
        writer.SetInputData(grid)
        writer.SetHeaderTypeToUInt32() if header == 32 else writer.SetHeaderTypeToUInt64()
        writer.SetCompressorTypeToZLib() if compressed else writer.SetCompressorTypeToNone()
        # Small blocks, so that there are several.
        writer.SetBlockSize(256)
        writer.SetByteOrderToBigEndian() if big else writer.SetByteOrderToLittleEndian()
        if mode == "ascii":
            writer.SetDataModeToAscii()
        elif mode == "binary":
            writer.SetDataModeToBinary()
        else:
            writer.SetDataModeToAppended()
            writer.SetEncodeAppendedData(mode == "base64")
        assert writer.Write() == 1

try:
    import gmsh
except (ImportError, OSError) as error:
    print(f"without gmsh: {error}")
    sys.exit(0)
gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 0)
for order, version, binary in product((1, 2), (2.2, 4.1), (0, 1)):
    gmsh.clear()
    box = gmsh.model.occ.addBox(0, 0, 0, 30, 20, 10)
    core = gmsh.model.occ.addSphere(15, 10, 5, 3)
    gmsh.model.occ.fragment([(3, box)], [(3, core)])
    gmsh.model.occ.synchronize()
    near = gmsh.model.getEntitiesInBoundingBox(11, 6, 1, 19, 14, 9, 3)
    shell = [entity for entity in gmsh.model.getEntities(3) if entity not in near]
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in near], 1, "core")
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in shell], 2, "shell")
    bottom = gmsh.model.getEntitiesInBoundingBox(-1, -1, -0.1, 31, 21, 0.1, 2)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in bottom], 9, "bottom")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 5)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(folder / f"gmsh-{order}-{version}-{'binary' if binary else 'ascii'}.msh"))
gmsh.finalize()
