"""`drkid check`: re-read a kit folder and recompute its numbers from the files."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drkid.assembly.structure import Structure
from drkid.congruence.softest_mode import rigidity
from drkid.export import KitDocument
from drkid.export.document import FindingDocument
from drkid.export.layout import ASSEMBLED, BOM_CSV, BOM_JSON, PIECE_CLASS, SIMPLIFIED, SURFACE, part_label
from drkid.export.read_back import broken_file, read_document, read_mesh
from drkid.intersection import self_intersections
from drkid.kit import BRIDGE, WALL, Building, Closure, Overlapping, Swing
from drkid.measure import bend_radians, dihedral
from drkid.mesh import Floats, Ints, TriMesh
from drkid.metrics import surface_distances
from drkid.printed import structure_of
from drkid.printed_plates import lying
from drkid.printed_pockets import PocketRoom, pocket_figures, wall_between_pockets_mm
from drkid.process import ProcessPreset
from drkid.solid import Solid
from drkid.spec import KitSpec
from drkid.wall_thickness import thinnest_wall_mm

RELATIVE = 1e-6  # of a recomputed length: PLY and JSON keep full double precision
DISTANCE_PERCENT = 0.02  # of the diagonal: what two samplings of a surface may differ by
PLACEMENT_OF_ERROR = 1.5  # a corner may miss its vertex by so many times the largest class error
PLACEMENT_MM = 0.02
PRINTED_MM = 1e-4  # between corners and stated lengths: single precision in the STL files is no better
ASSEMBLED_MM, ASSEMBLED_SHARE = 1e-3, 0.01  # what a relaxation that is begun from rounded figures may differ by
SWING_DEGREES = 0.1  # a corner in single precision, seen from an axis a fraction of a mm away
POCKET_SHARE = 1e-4  # of a pocket's volume: by how much two may differ, in volume or shape
FACET_MM = 0.02  # what facets of round shapes may take from a wall
CLEARANCE_MM = 1e-3  # what the facets of round connectors may take from a clearance
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
    kit = read_document(folder)
    surface, simplified, (assembled, face_class) = (
        _surface(folder / SURFACE)[0],
        _surface(folder / SIMPLIFIED)[0],
        _surface(folder / ASSEMBLED),
    )
    if face_class is None:
        raise broken_file(folder / ASSEMBLED, f"a face property {PIECE_CLASS}", "none")
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
        *_corners_and_lengths(kit),
        _parts(folder, kit),
        *_together(folder, assembled, kit),
        _parts_list(folder, kit),
        *_plates(folder, kit),
    )
    return Verification(folder, checks)


# ---- reading


def _surface(path: Path) -> tuple[TriMesh, Ints | None]:
    mesh = read_mesh(path)
    data = mesh.metadata.get("_ply_raw", {}).get("face", {}).get("data", {})
    names = getattr(getattr(data, "dtype", None), "names", None) or ()
    values = np.asarray(data[PIECE_CLASS], np.int64).reshape(-1) if PIECE_CLASS in names else None
    return TriMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)), values


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


def _owner(kit: KitDocument) -> dict[int, int]:
    """The piece of every face."""
    return {face: number for number, piece in enumerate(kit.pieces) for face in piece.covered}


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
    covered = sorted(face for piece in kit.pieces for face in piece.covered)
    right = (
        covered == list(range(len(face_class)))
        and all(order.get(piece.class_) == face_class[face] for piece in kit.pieces for face in piece.covered)
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
    right = proper and worst <= limit * (1 + RELATIVE)
    return Check("placement", right, f"corners within {worst:.4g} mm (limit {limit:.3g})")


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
        mesh = read_mesh(folder / name)
        corners, index = np.unique(np.asarray(mesh.triangles).reshape(-1, 3), axis=0, return_inverse=True)
        surface = TriMesh(corners, index.reshape(-1, 3))
        try:
            solid = Solid.of(surface)
        except ValueError as error:
            bad.append(f"{name}: {error}")
            continue
        bad += [] if solid.volume > 0 else [f"{name} has no volume"]
        cuts = len(self_intersections(surface))
        bad += [f"{name}: {cuts} pairs of faces cut each other"] if cuts else []
    return Check("parts are solids", not bad, "; ".join(bad) or f"{len(files)} files")


def _corners_and_lengths(kit: KitDocument) -> list[Check]:
    """A part's corners are as far apart as its class says."""
    off = 0.0
    for one in kit.classes:
        for part in one.parts:
            corners = np.array(part.corners)
            sides = np.sort(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))
            same = len(sides) == len(one.edge_lengths)
            off = max(off, float(np.abs(sides - one.edge_lengths).max()) if same else np.inf)
    right = off <= PRINTED_MM
    return [Check("corners of the parts", right, f"sides within {off:.2g} mm of their classes' lengths")]


def _together(folder: Path, mesh: TriMesh, kit: KitDocument) -> list[Check]:
    """The virtual assembly from the files, against what the kit states; unstated, it must go together."""
    try:
        structure = structure_of(folder, mesh, kit)
    except ValueError as error:
        return [Check("virtual assembly", passed=False, detail=str(error))]
    closure = structure.joining().closure
    swing = structure.swinging(float(kit.spec["swing_degrees"]))
    order = [structure.faces.index(step.face) for step in kit.assembly if step.face in structure.faces]
    if sorted(order) != list(range(len(structure.parts))):
        return [_closes(closure, kit), Check("building", passed=False, detail="the order is not one of all pieces")]
    last = structure.insertion(float(kit.spec["thickness_mm"]), order[-1:])
    return [
        *_pockets(structure, kit),
        _walls(structure, kit),
        _closes(closure, kit),
        *_closure(closure, kit),
        _swings(swing, kit),
        _overlaps(structure.overlapping(float(kit.spec["swing_degrees"])), kit),
        _builds(structure.building(order, last), kit),
    ]


def _pockets(structure: Structure, kit: KitDocument) -> list[Check]:
    """All pockets are one, with the stated clearance; nothing to ask of a kit without, or of curved pieces.

    Around a curved piece's pocket neither its faces nor its bevels are plane, so that they cannot be told from it.
    """
    if not structure.connectors or kit.metrics.curved is not None:
        return []
    room, clearance = _room(kit), float(kit.spec["clearance_mm"])
    try:
        found = pocket_figures(structure.shapes, _part_names(kit), structure.connectors, room)
    except ValueError as error:
        return [Check("pockets are alike", passed=False, detail=str(error))]
    crowded = f", but {found.crowded} with another within their walls" if found.crowded else ""
    told = (
        f"{found.pockets}{crowded} of {found.volume_mm3:.4g} mm³: volumes within {found.volume_share:.1g}, shapes "
        f"within {found.shape_share:.1g} of that (limit {POCKET_SHARE:g}); farthest apart {' and '.join(found.between)}"
    )
    alike = max(found.volume_share, found.shape_share) <= POCKET_SHARE
    least = f"connectors {found.clearance_mm:.4g} mm clear of their pockets, stated {clearance:g}"
    return [
        Check("pockets are alike", alike, told),
        Check("clearance of the pockets", abs(found.clearance_mm - clearance) <= CLEARANCE_MM, least),
    ]


def _room(kit: KitDocument) -> PocketRoom:
    clearance, wall, thickness = (float(kit.spec[f"{name}_mm"]) for name in ("clearance", "min_wall", "thickness"))
    return PocketRoom(clearance, wall, thickness, _preset(kit).draft_degrees, kit.metrics.merged is not None)


def _part_names(kit: KitDocument) -> list[str]:
    return [part_label(part.file) for one in kit.classes for part in one.parts]


def _walls(structure: Structure, kit: KitDocument) -> Check:
    """No wall is thinner than the process makes it, or than a finding says of its part."""
    room, depth, knuckle = _room(kit), float(kit.spec["mark_depth_mm"]), float(kit.spec["knuckle_wall_mm"])
    told = {_part_of(finding): finding.available for finding in kit.findings if finding.what == WALL}
    found, wanted = dict[str, float](), dict[str, float]()
    for name, shape in zip(_part_names(kit), structure.shapes, strict=True):
        wanted[name] = min(room.wall_mm, told.get(name, np.inf))
        found[name] = thinnest_wall_mm(shape.solid.mesh(), depth)
        if structure.connectors:
            found[name] = min(found[name], wall_between_pockets_mm(shape, structure.connectors, room))
    for number, solid in enumerate(structure.connectors):
        name = f"connector {number + 1}"
        found[name], wanted[name] = thinnest_wall_mm(solid.mesh()), min(room.wall_mm, knuckle)
    bad = "; ".join(f"{n}: {w:.2f} mm is not told" for n, w in found.items() if w < wanted[n] - FACET_MM)
    thinnest = min(found, key=found.__getitem__)
    return Check("walls of the parts", not bad, bad or f"thinnest {found[thinnest]:.2f} mm, of {thinnest}")


def _part_of(finding: FindingDocument) -> str:
    """The part that a finding is of, as parts are labelled."""
    return finding.subject.removeprefix("class ").replace("(", "").replace(")", "")


def _closes(closure: Closure, kit: KitDocument) -> Check:
    stated = kit.metrics.assembly
    agrees = closure.verdict == stated.closure.verdict if stated else closure.verdict != "does not close"
    return Check(
        "virtual assembly",
        agrees,
        f"{closure.verdict}: gaps {closure.gaps.mean_mm:.2g} mm mean, {closure.gaps.p95_mm:.2g} p95, "
        f"{closure.gaps.max_mm:.2g} max, play {closure.play_mm:.2g}; before relaxation {closure.chain.max_mm:.2g}",
    )


def _closure(closure: Closure, kit: KitDocument) -> list[Check]:
    budget, drift = closure.budget, closure.drift
    told = (
        f"joint {budget.joint[0]}–{budget.joint[1]} most at risk: {budget.slip_mm:.2g} mm slip + {budget.rod_mm:.2g} "
        f"rod − {budget.gap_mm:.2g} class error − {budget.scatter_mm:.2g} manufacturing = {budget.reserve_mm:.2g} mm"
    )
    shape = f"{drift.mean_mm:.2g} mm mean, {drift.max_mm:.2g} max: {drift.max_percent:.2g} % of the box"
    if kit.metrics.assembly is None:
        return [Check("drift", passed=True, detail=shape), Check("tolerance budget", passed=True, detail=told)]
    stated = kit.metrics.assembly.closure
    return [
        Check("drift", _near(stated.drift.max_mm, drift.max_mm), f"{shape}, stated {stated.drift.max_mm:.2g} mm"),
        Check("tolerance budget", _near(stated.budget.reserve_mm, budget.reserve_mm), told),
    ]


def _swings(swing: Swing, kit: KitDocument) -> Check:
    told = (
        f"{swing.inward_degrees:.2f}° inwards, {swing.outward_degrees:.2f}° outwards at the tightest joints, "
        f"{swing.blocked} have less than {swing.wanted_degrees:g}°"
    )
    stated = kit.metrics.assembly
    right = stated is None or (
        abs(stated.swing.inward_degrees - swing.inward_degrees) < SWING_DEGREES
        and abs(stated.swing.outward_degrees - swing.outward_degrees) < SWING_DEGREES
    )
    return Check("swing of the joints", right, told)


def _overlaps(overlap: Overlapping, kit: KitDocument) -> Check:
    """As stated; unstated, no two pieces may overlap at their places.

    How many touch when they turn is told, not held against the kit's figure: single precision decides for some.
    """
    told = (
        f"{overlap.pairs} pairs of pieces overlap, by {overlap.largest_mm3:.2g} mm³ at most, {overlap.swung} more, by "
        f"{overlap.swung_mm3:.2g} mm³ at most, when one turns by {overlap.swing_degrees:g}° about a hinge"
    )
    stated = kit.metrics.assembly.overlap if kit.metrics.assembly else None
    if stated is None:
        return Check("overlaps", not overlap.pairs, told)
    same = stated.pairs == overlap.pairs and _near(stated.swung_mm3, overlap.swung_mm3)
    return Check("overlaps", same and _near(stated.largest_mm3, overlap.largest_mm3), told)


def _builds(building: Building, kit: KitDocument) -> Check:
    told = (
        f"open border {building.border_mean_mm:.0f} mm mean, {building.border_max_mm:.0f} max "
        f"(breadth-first {building.breadth_first_mean_mm:.0f} mean); {building.enclosed} pieces enclosed; last piece "
        f"{'goes in' if building.last_goes_in else 'does not go in'}, meets {building.last_overlap_percent:.2g} %"
    )
    stated = kit.metrics.assembly
    if stated is None:
        return Check("building", building.last_goes_in, told)
    same = stated.building.last_goes_in == building.last_goes_in and stated.building.enclosed == building.enclosed
    return Check("building", same and _near(stated.building.border_mean_mm, building.border_mean_mm), told)


def _plates(folder: Path, kit: KitDocument) -> list[Check]:
    """Everything lies on its bed, and bridges no more than the process can, unless a finding says so."""
    found = lying(folder)
    if not found:
        return []
    worst, preset = max(found, key=lambda one: one.bridge_mm), _preset(kit)
    told = {_part_of(finding) for finding in kit.findings if _is_too_wide(finding)}
    limit = np.inf if preset.longest_bridge_mm is None else preset.longest_bridge_mm + CLEARANCE_MM
    untold = [one for one in found if one.bridge_mm > limit and one.name.replace("_", " ") not in told]
    bad = "; ".join(f"{one.name}: {one.bridge_mm:.2f} mm is not told" for one in untold)
    needed = "any prints" if preset.longest_bridge_mm is None else f"at most {preset.longest_bridge_mm:g}"
    widest = f"widest {worst.bridge_mm:.2f} mm, of {worst.name}; {needed}"
    crossing = sum(one.crossing for one in found)
    met = f", {crossing} of them in one another" if crossing else ""
    off, items = max(one.above_bed_mm for one in found), sum(one.copies for one in found)
    return [
        Check("bridges on the plates", not untold, bad or widest),
        Check("plates", off <= CLEARANCE_MM and not crossing, f"{items} items, within {off:.1g} mm of the bed{met}"),
    ]


def _is_too_wide(finding: FindingDocument) -> bool:
    return finding.what == BRIDGE and finding.available > finding.needed


def _preset(kit: KitDocument) -> ProcessPreset:
    return KitSpec.parse({name: kit.spec.get(name) for name in ("process", "process_values")}).preset


def _near(stated_mm: float, found_mm: float) -> bool:
    return abs(stated_mm - found_mm) <= max(ASSEMBLED_MM, ASSEMBLED_SHARE * abs(found_mm))


def _parts_list(folder: Path, kit: KitDocument) -> Check:
    try:
        rows = json.loads((folder / BOM_JSON).read_text())
        lines = (folder / BOM_CSV).read_text().splitlines()
    except (OSError, ValueError) as error:
        raise broken_file(folder / BOM_JSON, "the parts list", str(error)) from error
    stated = Counter({row["file"] or row["part"]: row["count"] for row in rows})
    wanted = Counter(piece.part for piece in kit.pieces)
    wanted.update({item.file or item.name or "": item.count for item in kit.hardware})
    agree = stated == wanted and len(lines) == len(rows) + 1
    return Check("parts list", agree, f"{sum(stated.values())} parts listed, {sum(wanted.values())} used")
