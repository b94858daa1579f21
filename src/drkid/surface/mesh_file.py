"""The mesh route: load, weld, choose a body, orient, check."""

import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import igl
import numpy as np
import trimesh
from lxml.etree import XMLSyntaxError

from drkid.errors import InputError, SpecError
from drkid.formats import MESH_SUFFIXES, checked_suffix, sha256_of
from drkid.kit import Source, Surface
from drkid.mesh import Floats, Ints, TriMesh
from drkid.progress import Progress
from drkid.spec import KitSpec
from drkid.surface.bodies import outermost, signed_volumes
from drkid.surface.handle import MOST_TOLD, handles_kept
from drkid.surface.loop_surgery import ClosedHandle, without_mesh_handles
from drkid.surface.welding import welded

STL_HEADER, STL_TRIANGLE = 84, 50  # bytes of a binary STL
FLAT_DIAGONALS = 1e-9  # a face whose altitude is below this times the diagonal has no direction

_FAULTS: tuple[type[Exception], ...] = (
    OSError,
    EOFError,
    ImportError,  # trimesh asks for a guesser of encodings when a text is none
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    NotImplementedError,
    MemoryError,
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
    XMLSyntaxError,
)


def surface_of_mesh_file(path: Path, spec: KitSpec, progress: Progress) -> Surface:
    """The chosen body of a mesh file, in the file's coordinates; `spec.unit` says what they are in.

    Raises:
        SpecError: label, threshold or spacing is given, which are for volumes.
        InputError: a mesh that cannot be read, is empty, not finite, open, not manifold or not orientable, or has
            more handles than `spec.max_genus` that cannot be closed.
    """
    _refuse_volume_parameters(spec)
    suffix = checked_suffix(path, MESH_SUFFIXES)
    progress("reading the mesh", 0.0)
    vertices, faces = _loaded(path, suffix)
    progress("welding", 0.4)
    mesh = welded(vertices, faces)
    body, rank, count = _chosen_body(mesh, spec, path.name)
    progress("orienting", 0.7)
    body = _oriented(body)
    _check(body, path.name)
    body, _ = outermost(body)
    closed: tuple[ClosedHandle, ...] = ()
    if spec.max_genus is not None:
        progress("closing handles", 0.8)
        body, closed = without_mesh_handles(body, spec.max_genus)
    progress("surface", 1.0)
    notes = _closings(closed, spec.unit or "units")
    if count > 1:
        notes.insert(0, f"body {rank + 1} of {count} taken; the other{'s' * (count > 2)} left out (--component)")
    if body.genus and spec.max_genus is None:
        notes.append(handles_kept(body.genus))
    source = Source(path.name, sha256_of(path), voxel_unit=spec.unit, component=rank + 1)
    return Surface(body, source, components=count, debris_dropped=count - 1, notes=tuple(notes))


def _refuse_volume_parameters(spec: KitSpec) -> None:
    given = [name for name in ("label", "threshold", "spacing") if getattr(spec, name) is not None]
    if given:
        raise SpecError(
            f"{' and '.join(given)} {'is' if len(given) == 1 else 'are'} for volumes, this is a mesh",
            remedy="leave it out; --unit says what the coordinates of a mesh are in",
        )


def _loaded(path: Path, suffix: str) -> tuple[Floats, Ints]:
    try:
        mesh: Any = trimesh.load(path, file_type=suffix[1:], process=False, force="mesh", skip_materials=True)
        vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
        if suffix == ".stl" and not len(faces):
            _require_whole_stl(path.read_bytes())
    except _FAULTS as error:
        raise InputError(
            f"{path.name} cannot be read as a mesh",
            wanted=f"a whole {suffix} file with triangles",
            found=(str(error) or type(error).__name__).splitlines()[0],
            remedy="export it again: it is empty, cut off, damaged, or of another format than its name says",
        ) from error
    if not len(faces):
        raise InputError(
            f"{path.name} is a mesh without faces",
            wanted="a closed surface of triangles",
            found=f"{len(vertices)} vertices, 0 faces",
            remedy="export the surface, not points or lines",
        )
    bad = int((~np.isfinite(vertices)).any(axis=1).sum())
    if bad:
        raise InputError(f"{path.name} has coordinates that are no numbers", found=f"{bad} of {len(vertices)} vertices")
    return vertices, faces


def _require_whole_stl(content: bytes) -> None:
    """A binary STL that is cut off is taken for a text without triangles where encodings are guessed."""
    if content[:5].lower() == b"solid" or len(content) < STL_HEADER:
        return
    (count,) = struct.unpack_from("<I", content, STL_HEADER - 4)
    if len(content) != STL_HEADER + STL_TRIANGLE * count:
        message = f"{len(content)} bytes, where {count} triangles take {STL_HEADER + STL_TRIANGLE * count}"
        raise ValueError(message)


def _chosen_body(mesh: TriMesh, spec: KitSpec, name: str) -> tuple[TriMesh, int, int]:
    """The body of the asked rank by volume (a body that is not closed counts with what it seems to enclose)."""
    if not len(mesh.faces):
        raise InputError(
            f"{name} has no face of any area", remedy="export it again, in other units or with more digits"
        )
    sizes = np.abs(signed_volumes(_oriented(mesh)))
    rank = (spec.component or 1) - 1
    if rank >= len(sizes):
        raise InputError(
            f"{name} has no component {rank + 1}", wanted=f"1 to {len(sizes)}", found=f"{len(sizes)} bodies"
        )
    body = int(np.argsort(-sizes, kind="stable")[rank])
    return mesh.submesh(mesh.face_component == body), rank, len(sizes)


def _oriented(mesh: TriMesh) -> TriMesh:
    """The faces of each component turned to agree, where that is possible."""
    if not mesh.misoriented_edges:
        return mesh
    faces, _ = igl.bfs_orient(np.array(mesh.faces))
    return TriMesh(mesh.vertices, np.asarray(faces, np.int64))


def _check(mesh: TriMesh, name: str) -> None:
    faces_at = np.bincount(mesh.face_edges.ravel())
    _refuse(int((faces_at > 2).sum()), "edges with more than two faces", name, "not manifold")
    _refuse(int((faces_at == 1).sum()), "open edges", name, "not closed")
    _refuse(mesh.misoriented_edges, "edges whose faces cannot agree on an outside", name, "not orientable")
    _refuse(mesh.pinched_vertices, "pinched vertices, at which parts touch in one point", name, "not manifold")
    altitude = 2 * mesh.areas / mesh.side_lengths.max(axis=1)
    _refuse(int((altitude < FLAT_DIAGONALS * mesh.diagonal).sum()), "faces without area", name, "degenerate")


def _closings(closed: tuple[ClosedHandle, ...], unit: str) -> list[str]:
    notes = [
        f"a handle closed (--max-genus): {'a tunnel filled' if one.way == 'filled' else 'a bridge cut'} at "
        f"({', '.join(f'{x:.4g}' for x in one.centre)}) {unit}, {one.around:.3g} {unit} around"
        for one in closed[:MOST_TOLD]
    ]
    if len(closed) > MOST_TOLD:
        left = closed[MOST_TOLD:]
        longest = max(one.around for one in left)
        notes.append(f"{len(left)} more handles closed, {longest:.3g} {unit} around at most")
    return notes


def _refuse(count: int, what: str, name: str, problem: str) -> None:
    if count:
        raise InputError(
            f"the surface in {name} is {problem}",
            wanted="a closed manifold surface",
            found=f"{count} {what}",
            remedy="repair it, for instance with Close Holes in MeshLab or the 3D Print Toolbox in Blender",
        )
