"""3MF: each mesh stored once, placed by build items; written by lib3mf."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import lib3mf
import numpy as np

from drkid.mesh import Floats, TriMesh

_NAMESPACE = uuid5(NAMESPACE_URL, "drkid")  # lib3mf's own identifiers are random: the same plate, the same bytes


@dataclass(frozen=True, eq=False)
class PlateObject:
    """A mesh on a plate: its name, colour #RRGGBB, and a matrix (4, 4) for each copy."""

    name: str
    colour: str
    mesh: TriMesh
    transforms: Sequence[Floats]


def three_mf_bytes(title: str, objects: Sequence[PlateObject]) -> bytes:
    """The objects as a 3MF in millimetres; colours are base materials, one for each."""
    wrapper = lib3mf.Wrapper()
    model: Any = wrapper.CreateModel()  # typed as if it could be None
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    model.SetBuildUUID(str(uuid5(_NAMESPACE, title)))
    model.GetMetaDataGroup().AddMetaData("", "Title", title, "xs:string", True)
    model.GetMetaDataGroup().AddMetaData("", "Application", "drkid", "xs:string", True)
    materials = model.AddBaseMaterialGroup()
    for one in objects:
        stored = _added(model, one.mesh)
        stored.SetName(one.name)
        stored.SetUUID(str(uuid5(_NAMESPACE, f"{title}/{one.name}")))
        red, green, blue = bytes.fromhex(one.colour[1:])
        material = materials.AddMaterial(one.name, wrapper.RGBAToColor(red, green, blue, 255))
        stored.SetObjectLevelProperty(materials.GetResourceID(), material)
        for number, transform in enumerate(one.transforms, 1):
            item = model.AddBuildItem(stored, _transform(transform))
            item.SetPartNumber(f"{one.name} {number}")
            item.SetUUID(str(uuid5(_NAMESPACE, f"{title}/{one.name}/{number}")))
    return bytes(model.QueryWriter("3mf").WriteToBuffer())


def read_three_mf(content: bytes) -> list[PlateObject]:
    """The mesh objects of a 3MF, each with the matrices of its build items; colours are left out.

    Raises:
        ValueError: it is no 3MF, or an item is none of its meshes.
    """
    model: Any = lib3mf.Wrapper().CreateModel()
    try:
        model.QueryReader("3mf").ReadFromBuffer(content)
        items = model.GetBuildItems()
        found: dict[int, tuple[str, TriMesh, list[Floats]]] = {}
        while items.MoveNext():
            item = items.GetCurrent()
            number = item.GetObjectResourceID()
            if number not in found:
                stored = model.GetMeshObjectByID(number)
                vertices = np.array([list(p.Coordinates) for p in stored.GetVertices()], np.float64)
                faces = np.array([list(t.Indices) for t in stored.GetTriangleIndices()], np.int64)
                found[number] = stored.GetName(), TriMesh(vertices, faces), []
            matrix = np.eye(4)
            matrix[:3] = np.array([list(row) for row in item.GetObjectTransform().Fields], np.float64).T
            found[number][2].append(matrix)
    except lib3mf.ELib3MFException as error:
        message = str(error)
        raise ValueError(message) from error
    return [PlateObject(name, "", mesh, transforms) for name, mesh, transforms in found.values()]


def _added(model: Any, mesh: TriMesh) -> Any:
    """The mesh as an object of the model; its structures are filled in one go."""
    stored = model.AddMeshObject()
    positions = (lib3mf.Position * len(mesh.vertices))()
    np.frombuffer(memoryview(positions).cast("B"), np.float32)[:] = mesh.vertices.ravel()
    triangles = (lib3mf.Triangle * len(mesh.faces))()
    np.frombuffer(memoryview(triangles).cast("B"), np.uint32)[:] = mesh.faces.ravel()
    stored.SetGeometry(list(positions), list(triangles))
    return stored


def _transform(matrix: Floats) -> lib3mf.Transform:
    """lib3mf multiplies row vectors: three rows of the turn's columns, then the shift."""
    transform = lib3mf.Transform()
    for column in range(4):
        transform.Fields[column] = (ctypes.c_float * 3)(*matrix[:3, column].tolist())
    return transform
