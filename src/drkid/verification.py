"""`drkid check`: re-read a kit folder and recompute its numbers from the files."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from pydantic import ValidationError

from drkid.congruence.softest_mode import rigidity
from drkid.errors import KitFolderError
from drkid.export import KitDocument
from drkid.export.document import PieceDocument
from drkid.export.layout import ASSEMBLED, BOM_CSV, BOM_JSON, KIT_JSON, PIECE_CLASS, SIMPLIFIED, SURFACE
from drkid.intersection import self_intersections
from drkid.measure import bend_radians, dihedral
from drkid.mesh import Floats, Ints, TriMesh
from drkid.metrics import surface_distances
from drkid.solid import Solid

RELATIVE = 1e-6  # of a recomputed length: PLY and JSON keep full double precision
DISTANCE_PERCENT = 0.02  # of the diagonal: what two samplings of a surface may differ by
PLACEMENT_OF_ERROR = 1.5  # a corner may miss its vertex by so many times the largest class error
PLACEMENT_MM = 0.02
SINGULAR_VALUE = 1e-6  # of the rigidity matrix: below it is rounding, a square root of it


@dataclass(frozen=True)
class Check:
    """One question put to the kit, and its answer."""

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True)
class Verification:
    """All answers; `passed` where every one is."""

    folder: Path
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """True where every check passed."""
        return all(check.passed for check in self.checks)


def verify_kit(folder: str | Path) -> Verification:
    """Recompute what a kit states about itself.

    Raises:
        KitFolderError: the folder is no kit, or one of its files is missing or cannot be read.
    """
    folder = Path(folder)
    kit = _document(folder)
    surface, simplified, (assembled, face_class) = (
        _surface(folder / SURFACE)[0],
        _surface(folder / SIMPLIFIED)[0],
        _surface(folder / ASSEMBLED),
    )
    if face_class is None:
        raise _broken(folder / ASSEMBLED, f"a face property {PIECE_CLASS}", "none")
    checks = (
        *_topology({SURFACE: surface, SIMPLIFIED: simplified, ASSEMBLED: assembled}, kit),
        _crossing(assembled),
        *_congruence(assembled, kit),
        *_distances(surface, simplified, assembled, kit),
        *_angles(assembled, kit),
        *_rigidity(assembled, kit),
        _counts(face_class, kit),
        _placement(assembled, kit),
        _order(assembled, kit),
        _parts(folder, kit),
        _parts_list(folder, kit),
    )
    return Verification(folder, checks)


# ---- reading


def _document(folder: Path) -> KitDocument:
    path = folder / KIT_JSON
    try:
        return KitDocument.model_validate_json(path.read_bytes())
    except OSError as error:
        raise KitFolderError(
            f"{folder} is no kit", wanted=f"a folder with a {KIT_JSON}", found=str(error.strerror or error)
        ) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise _broken(path, "what `drkid schema` prints", f"{where}: {first['msg']}") from error


def _surface(path: Path) -> tuple[TriMesh, Ints | None]:
    mesh = _loaded(path)
    data = mesh.metadata.get("_ply_raw", {}).get("face", {}).get("data", {})
    names = getattr(getattr(data, "dtype", None), "names", None) or ()
    values = np.asarray(data[PIECE_CLASS], np.int64).reshape(-1) if PIECE_CLASS in names else None
    return TriMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)), values


def _loaded(path: Path) -> trimesh.Trimesh:
    try:
        return trimesh.load_mesh(path, process=False)
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise _broken(path, "a mesh", f"{type(error).__name__}: {error}") from error


def _broken(path: Path, wanted: str, found: str) -> KitFolderError:
    return KitFolderError(f"{path} cannot be used", wanted=wanted, found=found, remedy="make the kit again")


# ---- checking


def _agree(name: str, stated: float, found: float, absolute: float = 1e-9) -> Check:
    near = bool(abs(stated - found) <= max(absolute, RELATIVE * abs(found)))
    return Check(name, near, f"stated {stated:.6g}, recomputed {found:.6g}")


def _topology(meshes: dict[str, TriMesh], kit: KitDocument) -> list[Check]:
    checks: list[Check] = []
    for name, mesh in meshes.items():
        right = mesh.is_closed_manifold and mesh.component_count == 1 and mesh.volume > 0
        found = f"{mesh.open_edges} open edges, {mesh.component_count} components, volume {mesh.volume:.4g} mm³"
        checks.append(Check(f"{name} is one closed surface", right, found))
    genera = {name: mesh.genus for name, mesh in meshes.items()}
    same = set(genera.values()) == {kit.metrics.genus}
    return [*checks, Check("genus", same, f"stated {kit.metrics.genus}, found {genera}")]


def _crossing(mesh: TriMesh) -> Check:
    pairs = len(self_intersections(mesh))
    return Check(f"{ASSEMBLED} does not cut itself", pairs == 0, f"{pairs} pairs of faces")


def _faces(piece: PieceDocument) -> list[int]:
    """The faces that a piece covers; none where it names none."""
    if piece.faces is not None:
        return piece.faces
    return [] if piece.face is None else [piece.face]


def _owner(kit: KitDocument) -> dict[int, int]:
    """The piece of every face."""
    return {face: number for number, piece in enumerate(kit.pieces) for face in _faces(piece)}


def _piece_errors(mesh: TriMesh, kit: KitDocument) -> Floats:
    """(P,): distance of each piece's ascending outline lengths to its class's; infinite where the sides differ."""
    lengths = {c.id: np.array(c.edge_lengths) for c in kit.classes}
    errors = np.full(len(kit.pieces), np.inf)
    for number, piece in enumerate(kit.pieces):
        corners = mesh.vertices[piece.corners]
        own = np.sort(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))
        stated = lengths.get(piece.class_, np.empty(0))
        if len(own) == len(stated):
            errors[number] = np.linalg.norm(own - stated)
    return errors


def _congruence(mesh: TriMesh, kit: KitDocument) -> list[Check]:
    errors = _piece_errors(mesh, kit)
    metrics, percent = kit.metrics, 100 / mesh.mean_edge
    tolerance = float(kit.spec["tolerance_percent"])
    reached = "converged" if errors.max() * percent <= tolerance else "stalled"
    return [
        _agree("mean edge, mm", metrics.mean_edge, mesh.mean_edge),
        _agree("largest error, mm", metrics.error_max, float(errors.max())),
        _agree("largest error, %", metrics.error_max_percent, float(errors.max()) * percent),
        _agree("mean error, mm", metrics.error_mean, float(errors.mean())),
        _agree("mean error, %", metrics.error_mean_percent, float(errors.mean()) * percent),
        Check("outcome", kit.outcome.status == reached, f"stated {kit.outcome.status}, recomputed {reached}"),
    ]


def _distances(surface: TriMesh, simplified: TriMesh, assembled: TriMesh, kit: KitDocument) -> list[Check]:
    names = ("surface_simplified", "simplified_assembled", "surface_assembled")
    checks: list[Check] = []
    for name, found in zip(names, surface_distances(surface, simplified, assembled), strict=True):
        stated = getattr(kit.metrics.hausdorff, name)
        checks += [
            _agree(f"d_H {name} mean, %", stated.mean_percent, found.mean_percent, DISTANCE_PERCENT),
            _agree(f"d_H {name} max, %", stated.max_percent, found.max_percent, DISTANCE_PERCENT),
        ]
    return checks


def _angles(mesh: TriMesh, kit: KitDocument) -> list[Check]:
    owner = _owner(kit)
    outer = np.array([owner.get(a, -1) != owner.get(b, -1) for a, b in mesh.edge_faces.tolist()])
    found, stated = dihedral(mesh, outer), kit.metrics.dihedral
    edges = {tuple(edge): i for i, edge in enumerate(mesh.edges.tolist()) if outer[i]}
    inner = 180 - np.degrees(bend_radians(mesh))
    named = {tuple(sorted(joint.edge)): joint.dihedral_degrees for joint in kit.joints}
    complete = set(named) == set(edges) and len(kit.joints) == len(edges)
    off = max((abs(angle - inner[edges[edge]]) for edge, angle in named.items() if edge in edges), default=np.inf)
    return [
        Check("joints", complete and bool(off < 1e-6), f"{len(kit.joints)} for {len(edges)} edges, off by {off:.2g}°"),
        _agree("dihedral mean, °", stated.mean_degrees, found.mean_degrees, 1e-6),
        _agree("dihedral p95, °", stated.p95_degrees, found.p95_degrees, 1e-6),
        _agree("concave, %", stated.concave_percent, found.concave_percent, 1e-6),
    ]


def _rigidity(mesh: TriMesh, kit: KitDocument) -> list[Check]:
    """Of a kit that states it. Movements are left out: where symmetry makes modes alike, they are of any one."""
    stated = kit.metrics.rigidity
    if stated is None:
        return []
    try:
        found = rigidity(mesh)
    except np.linalg.LinAlgError as error:
        return [Check("rigidity", passed=False, detail=str(error))]
    return [
        _agree("softest mode", stated.softest, found.softest, SINGULAR_VALUE),
        _agree("stiffness, %", stated.stiffness_percent, found.stiffness_percent, 100 * SINGULAR_VALUE),
    ]


def _counts(face_class: Ints, kit: KitDocument) -> Check:
    order = {c.id: i for i, c in enumerate(kit.classes)}
    by_part = Counter(piece.part for piece in kit.pieces)
    covered = sorted(face for piece in kit.pieces for face in _faces(piece))
    right = (
        covered == list(range(len(face_class)))
        and all(order.get(piece.class_) == face_class[face] for piece in kit.pieces for face in _faces(piece))
        and all(part.count == by_part[part.file] for c in kit.classes for part in c.parts)
        and kit.metrics.pieces == len(kit.pieces)
        and kit.metrics.unique_piece_parts == len(by_part)
    )
    return Check("counts", right, f"{len(face_class)} faces, {len(kit.pieces)} pieces, {len(by_part)} part files")


def _corners(kit: KitDocument) -> dict[str, Floats]:
    return {part.file: np.array(part.corners) for c in kit.classes for part in c.parts}


def _placement(mesh: TriMesh, kit: KitDocument) -> Check:
    corners, worst, proper = _corners(kit), 0.0, True
    for piece in kit.pieces:
        matrix = np.array(piece.transform).reshape(4, 4)
        turn = matrix[:3, :3]
        proper &= bool(np.abs(turn @ turn.T - np.eye(3)).max() < 1e-9 and np.linalg.det(turn) > 0)
        placed = corners[piece.part] @ turn.T + matrix[:3, 3]
        worst = max(worst, float(np.linalg.norm(placed - mesh.vertices[piece.corners], axis=1).max()))
    misfit = 0.0 if kit.metrics.merged is None else kit.metrics.merged.misfit_max_mm
    limit = max(PLACEMENT_MM, PLACEMENT_OF_ERROR * kit.metrics.error_max, misfit)
    return Check("placement", proper and worst <= limit, f"corners within {worst:.4g} mm (limit {limit:.3g})")


def _order(mesh: TriMesh, kit: KitDocument) -> Check:
    owner = _owner(kit)
    pairs = [tuple(owner.get(face, -1) for face in pair) for pair in mesh.edge_faces.tolist()]
    beside = {(a, b) for one, other in pairs for a, b in ((one, other), (other, one)) if a != b}
    done: set[int] = set()
    right = True
    for step in kit.assembly:
        own = owner.get(step.face, -1)
        standing = {piece for piece in done if (own, piece) in beside}
        right &= {owner.get(face, -1) for face in step.joins} == standing and len(step.joins) == len(standing)
        right &= (bool(standing) or not done) and own not in done
        done.add(own)
    whole = right and done == set(range(len(kit.pieces)))
    return Check("assembly order", whole, f"{len(done)} of {len(kit.pieces)} placed")


def _parts(folder: Path, kit: KitDocument) -> Check:
    files = sorted({p.file for c in kit.classes for p in c.parts} | {h.file for h in kit.hardware if h.file})
    bad: list[str] = []
    for name in files:
        mesh = _loaded(folder / name)
        corners, index = np.unique(np.asarray(mesh.triangles).reshape(-1, 3), axis=0, return_inverse=True)
        try:
            solid = Solid.of(TriMesh(corners, index.reshape(-1, 3)))
        except ValueError as error:
            bad.append(f"{name}: {error}")
            continue
        bad += [] if solid.volume > 0 else [f"{name} has no volume"]
    return Check("parts are solids", not bad, "; ".join(bad) or f"{len(files)} files")


def _parts_list(folder: Path, kit: KitDocument) -> Check:
    try:
        rows = json.loads((folder / BOM_JSON).read_text())
        lines = (folder / BOM_CSV).read_text().splitlines()
    except (OSError, ValueError) as error:
        raise _broken(folder / BOM_JSON, "the parts list", str(error)) from error
    stated = Counter({row["file"] or row["part"]: row["count"] for row in rows})
    wanted = Counter(piece.part for piece in kit.pieces)
    wanted.update({item.file or item.name or "": item.count for item in kit.hardware})
    agree = stated == wanted and len(lines) == len(rows) + 1
    return Check("parts list", agree, f"{sum(stated.values())} parts listed, {sum(wanted.values())} used")
