"""Opens a 3MF file with the reference library in strict mode and with trimesh; prints what both saw as JSON."""

import json
import sys

try:
    import lib3mf
    import lxml  # noqa: F401  (trimesh reads 3MF with it)
    import networkx  # noqa: F401
    import trimesh
    from lib3mf import get_wrapper
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)

path = sys.argv[1]
wrapper = get_wrapper()
model = wrapper.CreateModel()
reader = model.QueryReader("3mf")
reader.SetStrictModeActive(True)
reader.ReadFromFile(path)
warnings = [reader.GetWarning(i) for i in range(reader.GetWarningCount())]

groups = {}
iterator = model.GetBaseMaterialGroups()
while iterator.MoveNext():
    group = iterator.GetCurrentBaseMaterialGroup()
    groups[group.GetResourceID()] = group

metadata = model.GetMetaDataGroup()
seen = {
    "warnings": [str(w) for w in warnings],
    "unit": str(model.GetUnit()),
    "metadata": {
        metadata.GetMetaData(i).GetName(): metadata.GetMetaData(i).GetValue()
        for i in range(metadata.GetMetaDataCount())
    },
    "objects": [],
    "items": 0,
}
items = model.GetBuildItems()
while items.MoveNext():
    seen["items"] += 1

objects = model.GetMeshObjects()
while objects.MoveNext():
    mesh = objects.GetCurrentMeshObject()
    resource, material, has = mesh.GetObjectLevelProperty()
    colour = groups[resource].GetDisplayColor(material)
    seen["objects"].append(
        {
            "name": mesh.GetName(),
            "valid": mesh.IsValid(),
            "manifold": mesh.IsManifoldAndOriented(),
            "triangles": mesh.GetTriangleCount(),
            "has_material": has,
            "material": groups[resource].GetName(material),
            "colour": [colour.Red, colour.Green, colour.Blue, colour.Alpha],
        }
    )

scene = trimesh.load(path, file_type="3mf", process=False)
seen["trimesh"] = {
    name: {"watertight": bool(mesh.is_watertight), "winding": bool(mesh.is_winding_consistent), "volume": mesh.volume}
    for name, mesh in scene.geometry.items()
}
seen["stl"] = []
for stl in sys.argv[2:]:
    mesh = trimesh.load(stl)
    seen["stl"].append({"watertight": bool(mesh.is_watertight), "volume": mesh.volume})
json.dump(seen, sys.stdout)
