"""The one function of this stage."""

from collections.abc import Iterator

import numpy as np

from drkid.assembly.closure import Play
from drkid.assembly.order import steps
from drkid.assembly.piece_graph import piece_graph
from drkid.assembly.structure import Shape, Structure
from drkid.kit import (
    Assembly,
    AssemblyFigures,
    Building,
    Closure,
    Dimensions,
    Joint,
    Overlapping,
    PartSet,
    Piece,
    Swing,
    piece_of_face,
)
from drkid.measure import bend_radians
from drkid.mesh import Ints, TriMesh, read_only
from drkid.progress import Progress, silent
from drkid.rigid_fit import rigid_fit
from drkid.spec import ConnectorKind, KitSpec

RIGID: ConnectorKind = "box"  # nothing turns about a key
PLAIN = KitSpec()


def assemble(mesh_mm: TriMesh, part_set: PartSet, progress: Progress = silent, spec: KitSpec = PLAIN) -> Assembly:
    """Every part at its face of the connected closed mesh M_f in mm, the joints, a building order, and the proofs.

    A piece's transform is the rigid motion that carries its part's corners nearest to their vertices: what remains is
    the difference between the piece and its class. Joints are in the order of `mesh_mm.edges`, without those inside
    of a merged piece; their angle is the inner dihedral, 180° less the bend. Process and swing are the `spec`'s.
    """
    progress("placing pieces", 0.0)
    pieces = _merged(mesh_mm, part_set) if part_set.merged else _triangles(mesh_mm, part_set)
    bend, between = bend_radians(mesh_mm), _between_pieces(mesh_mm, part_set)
    edges = mesh_mm.edges[between].tolist()
    joints = tuple(
        Joint((a, b), (v, w), float(180 - degrees))
        for (a, b), (v, w), degrees in zip(
            mesh_mm.edge_faces[between].tolist(), edges, np.degrees(bend[between]), strict=True
        )
    )
    structure = Structure(
        graph=piece_graph([piece.vertices for piece in pieces], edges),
        shapes=[Shape(part.corners, part.side_frames, part.solid) for part in part_set.parts],
        parts=[piece.part for piece in pieces],
        faces=[piece.face for piece in pieces],
        placements=np.stack([piece.transform for piece in pieces]),
        targets=[mesh_mm.vertices[list(piece.vertices)] for piece in pieces],
        bend_radians=bend[between],
        connector=part_set.dimensions.connector,
        connectors=[connector.solid for connector in part_set.connectors],
        play=_play(part_set.dimensions, spec),
    )
    return _proven(structure, pieces, joints, part_set.dimensions, spec, progress)


def _triangles(mesh_mm: TriMesh, part_set: PartSet) -> tuple[Piece, ...]:
    turned = (np.arange(3) + part_set.face_turn[:, None]) % 3
    vertices = np.take_along_axis(mesh_mm.faces, turned, 1)
    corners = np.stack([part.corners for part in part_set.parts])[part_set.face_part]
    transforms = read_only(rigid_fit(corners, mesh_mm.vertices[vertices]))
    return tuple(
        Piece((face,), int(part_set.face_part[face]), (a, b, c), transforms[face])
        for face, (a, b, c) in enumerate(vertices.tolist())
    )


def _merged(mesh_mm: TriMesh, part_set: PartSet) -> tuple[Piece, ...]:
    pieces: list[Piece] = []
    for piece in part_set.merged:
        corners = part_set.parts[piece.class_index].corners
        transform = read_only(rigid_fit(corners, mesh_mm.vertices[list(piece.vertices)]))
        pieces.append(Piece(piece.faces, piece.class_index, piece.vertices, transform))
    return tuple(pieces)


def _between_pieces(mesh_mm: TriMesh, part_set: PartSet) -> Ints:
    """The edges that are joints: all but those inside of a merged piece."""
    if not part_set.merged:
        return np.arange(len(mesh_mm.edges))
    owner = piece_of_face(part_set.merged, len(mesh_mm.faces))[mesh_mm.edge_faces]
    return np.flatnonzero(owner[:, 0] != owner[:, 1])


def _proven(
    structure: Structure,
    pieces: tuple[Piece, ...],
    joints: tuple[Joint, ...],
    dimensions: Dimensions,
    spec: KitSpec,
    progress: Progress,
) -> Assembly:
    progress("joining pieces by their hinges", 0.2)
    closure = structure.joining().closure
    swing = structure.swinging(spec.swing_degrees)
    progress("looking for overlaps", 0.4)
    overlap = structure.overlapping(spec.swing_degrees)
    progress("choosing the last piece", 0.6)
    last = structure.insertion(dimensions.thickness_mm, structure.by_convexity())
    progress("ordering pieces", 0.8)
    order = structure.order(last.piece)
    building = structure.building(order, last)
    progress("ordering pieces", 1.0)
    return Assembly(
        pieces,
        joints,
        steps(structure.graph, order, structure.faces),
        AssemblyFigures(closure, swing, building, overlap),
        (
            *_closure_notes(closure),
            *_swing_notes(swing, structure.connector),
            *_overlap_notes(overlap, structure.connector),
            *_building_notes(building, structure.faces[last.piece]),
        ),
    )


def _play(dimensions: Dimensions, spec: KitSpec) -> Play:
    """Both halves slip in their pockets; what turns has play around its rod or pin too."""
    rod = 2 * dimensions.rod_clearance_mm if dimensions.connector in {"hinge", "snap"} else 0.0
    return Play(2 * dimensions.clearance_mm, rod, spec.preset.accuracy_mm)


def _closure_notes(closure: Closure) -> Iterator[str]:
    budget = closure.budget
    if closure.verdict != "closes":
        yield (
            f"Joined by their hinges alone the pieces leave gaps of up to {closure.gaps.max_mm:.2f} mm, where the "
            f"pockets give {closure.play_mm:.2f} mm: it {closure.verdict}. A smaller --tolerance-percent, the palette "
            "solver or a larger --clearance-mm helps."
        )
    if budget.reserve_mm < 0:
        yield (
            f"Manufacturing may open the joint of faces {budget.joint[0]} and {budget.joint[1]} by "
            f"{-budget.reserve_mm:.2f} mm more than its play: print more exactly, or take a larger --clearance-mm."
        )


def _swing_notes(swing: Swing, connector: ConnectorKind) -> Iterator[str]:
    if swing.blocked and connector != RIGID:
        tightest = min(swing.inward_degrees, swing.outward_degrees)
        yield (
            f"{swing.blocked} joints may turn by less than {swing.wanted_degrees:g}° both ways: what the pieces reach "
            f"round the axis, taken all along the joint, leaves {tightest:.1f}° at the tightest."
        )


def _overlap_notes(overlap: Overlapping, connector: ConnectorKind) -> Iterator[str]:
    if overlap.faces is not None:
        a, b = overlap.faces
        yield (
            f"{overlap.pairs} pairs of pieces reach into one another, most of all those of faces {a} and {b}, by "
            f"{overlap.largest_mm3:.2g} mm³ ({overlap.largest_percent:.2g} % of the smaller)."
        )
    if overlap.swung and connector != RIGID:
        yield (
            f"{overlap.swung} pairs of pieces meet, by {overlap.swung_mm3:.2g} mm³ at most, when one of them turns by "
            f"{overlap.swing_degrees:g}° about a hinge."
        )


def _building_notes(building: Building, face: int) -> Iterator[str]:
    if not building.last_goes_in:
        yield (
            f"No piece goes in last along its normal; the best of {building.last_candidates}, that of face {face}, "
            f"meets {building.last_overlap_percent:.2g} % of its volume: bend the open shell apart to let it in, or "
            "take a larger --swing-degrees, thinner pieces or more --faces."
        )
    if building.enclosed:
        yield f"{building.enclosed} pieces before the last go in between neighbours on all sides."
