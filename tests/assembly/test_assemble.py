import numpy as np
import pytest
import trimesh
from exact_shapes import decomposed, geodesic, icosahedron, potato, sixths, tetrahedron
from scipy.spatial.transform import Rotation

from drkid.assembly import assemble
from drkid.kit import Assembly, Decomposition, PartSet
from drkid.mesh import TriMesh
from drkid.parts import make_parts
from drkid.solid import Solid
from drkid.spec import KitSpec

OVERLAP = 1e-3  # of a piece's volume, at which pieces can still be put together
EXACT = {"icosahedron": icosahedron(), "geodesic": geodesic(), "sixths": sixths()}


def built(d: Decomposition, **spec: object) -> tuple[TriMesh, PartSet, Assembly]:
    parts = make_parts(d, KitSpec(**spec))
    mesh = d.mesh.scaled(parts.scale_mm_per_unit)
    return mesh, parts, assemble(mesh, parts)


def bodies(parts: PartSet, assembly: Assembly) -> list[Solid]:
    return [parts.parts[p.part].solid.moved(p.transform) for p in assembly.pieces]


def at_one_vertex(mesh: TriMesh) -> list[tuple[int, int]]:
    sets = [set(face) for face in mesh.faces.tolist()]
    return [(i, j) for i in range(len(sets)) for j in range(i) if sets[i] & sets[j]]


@pytest.fixture(scope="module", params=EXACT)
def kit(request) -> tuple[TriMesh, PartSet, Assembly]:
    return built(decomposed(EXACT[request.param]))


def test_parts_lie_on_their_faces(kit) -> None:
    mesh, parts, assembly = kit
    for piece in assembly.pieces:
        corners = parts.parts[piece.part].corners @ piece.transform[:3, :3].T + piece.transform[:3, 3]
        assert corners == pytest.approx(mesh.vertices[list(piece.vertices)], abs=1e-3)
        assert piece.transform[:3, 2] == pytest.approx(mesh.face_normals[piece.face], abs=1e-4)
        assert sorted(piece.vertices) == sorted(mesh.faces[piece.face])


def test_no_two_pieces_overlap(kit) -> None:
    mesh, parts, assembly = kit
    placed = bodies(parts, assembly)
    assert max((placed[i] & placed[j]).volume / placed[i].volume for i, j in at_one_vertex(mesh)) < 1e-6


@pytest.mark.parametrize("classes", [80, 5])
def test_not_even_where_faces_differ_from_their_class_or_joints_are_concave(classes) -> None:
    d = decomposed(potato(7), classes)
    mesh, parts, assembly = built(d, connector="none", marks=False)
    assert min(j.dihedral_degrees for j in assembly.joints) < 180 < max(j.dihedral_degrees for j in assembly.joints)
    assert not any("reach into" in note for note in parts.notes)
    placed = bodies(parts, assembly)
    shares = [(placed[i] & placed[j]).volume / placed[i].volume for i, j in at_one_vertex(mesh)]
    assert max(shares) < OVERLAP


def test_straight_sides_do_overlap() -> None:
    mesh, parts, assembly = built(decomposed(icosahedron()), thickening="perpendicular")
    placed = bodies(parts, assembly)
    assert max((placed[i] & placed[j]).volume / placed[i].volume for i, j in at_one_vertex(mesh)) > OVERLAP


def test_hinged_neighbours_swing_freely_with_their_halves(kit) -> None:
    mesh, parts, assembly = kit
    half, placed = parts.connectors[0].solid, bodies(parts, assembly)
    for joint in assembly.joints[::7]:
        a, b = joint.faces
        ends = [_held(assembly, parts, face, joint.edge) for face in joint.faces]
        start, end = mesh.vertices[list(joint.edge)]
        for degrees in (-5.0, 0.0, 5.0):
            turn = _about(start, end, degrees)
            moving = [placed[b].moved(turn), half.moved(turn @ ends[1])]
            for still in (placed[a], half.moved(ends[0])):
                assert max((still & m).volume for m in moving) < OVERLAP * placed[a].volume / 10


def _held(assembly: Assembly, parts: PartSet, face: int, edge: tuple[int, int]) -> np.ndarray:
    piece = assembly.pieces[face]
    sides = [{piece.vertices[i], piece.vertices[(i + 1) % 3]} for i in range(3)]
    return piece.transform @ parts.parts[piece.part].side_frames[sides.index(set(edge))]


def _about(start, end, degrees: float) -> np.ndarray:
    motion = np.eye(4)
    along = (end - start) / np.linalg.norm(end - start)
    motion[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * along).as_matrix()
    motion[:3, 3] = start - motion[:3, :3] @ start
    return motion


def test_joints_are_the_edges_with_their_inner_angles() -> None:
    mesh, _, assembly = built(decomposed(icosahedron()))
    assert [j.edge for j in assembly.joints] == [tuple(e) for e in mesh.edges.tolist()]
    assert [j.faces for j in assembly.joints] == [tuple(f) for f in mesh.edge_faces.tolist()]
    assert [j.dihedral_degrees for j in assembly.joints] == pytest.approx([138.1896851] * 30)


def test_the_last_piece_goes_in_from_outside(kit) -> None:
    _, parts, assembly = kit
    placed, last = bodies(parts, assembly), assembly.steps[-1]
    normal = assembly.pieces[last.face].transform[:3, 2]
    half = parts.connectors[0].solid
    edges = [j.edge for j in assembly.joints if last.face in j.faces]
    obstacles = [half.moved(_held(assembly, parts, n, e)) for n in last.joins for e in edges if _has(assembly, n, e)]
    obstacles += [placed[n] for n in last.joins]
    assert len(obstacles) == 6
    for distance in np.arange(1.0, 2 * parts.dimensions.thickness_mm):
        shift = np.eye(4)
        shift[:3, 3] = distance * normal
        moving = placed[last.face].moved(shift)
        assert sum((moving & o).volume for o in obstacles) < OVERLAP * moving.volume


def _has(assembly: Assembly, face: int, edge: tuple[int, int]) -> bool:
    return set(edge) <= set(assembly.pieces[face].vertices)


@pytest.mark.parametrize("seed", range(3))
def test_a_rigid_motion_changes_only_the_transforms(seed) -> None:
    rng = np.random.default_rng(seed)
    rotation, shift = Rotation.random(rng=rng).as_matrix(), rng.standard_normal(3)
    d = decomposed(sixths())
    mesh = d.mesh.moved(d.mesh.vertices @ rotation.T + shift)
    moved = Decomposition(mesh, d.face_class, d.class_lengths, d.face_errors, 0, (), d.outcome)
    size = 150.0
    _, one, still = built(d, size_mm=size)
    # the longest side of the bounding box turns with the mesh: the same scale, said for the turned one
    _, other, turned = built(moved, size_mm=size * mesh.extents.max() / d.mesh.extents.max())
    assert other.face_part.tolist() == one.face_part.tolist()
    assert other.face_turn.tolist() == one.face_turn.tolist()
    assert other.groove_mm == pytest.approx(one.groove_mm, abs=1e-6)
    assert turned.steps == still.steps
    for a, b in zip(still.pieces, turned.pieces, strict=True):
        assert b.transform[:3, :3] == pytest.approx(rotation @ a.transform[:3, :3], abs=1e-9)
        middle = rotation @ a.transform[:3, 3] + shift * one.scale_mm_per_unit
        assert b.transform[:3, 3] == pytest.approx(middle, abs=1e-6)


def test_concave_joints_open_to_more_than_180_degrees() -> None:
    star = geodesic(0)
    spiked = np.vstack([star.vertices, 1.6 * star.corners.mean(axis=1)])
    tips = len(star.vertices) + np.arange(len(star.faces))
    faces = np.concatenate([np.column_stack([star.faces[:, [i, (i + 1) % 3]], tips]) for i in range(3)])
    mesh = TriMesh(spiked, faces)
    _, _, assembly = built(decomposed(mesh), connector="none")
    on_star = [j.dihedral_degrees for j in assembly.joints if max(j.edge) < len(star.vertices)]
    assert len(on_star) == 30
    assert min(on_star) > 180


@pytest.mark.parametrize("mesh", [tetrahedron(), potato(1)])
def test_progress_ends_at_one(mesh) -> None:
    told: list[float] = []
    parts = make_parts(decomposed(mesh), KitSpec(connector="none"))
    assemble(mesh.scaled(parts.scale_mm_per_unit), parts, lambda _, fraction: told.append(fraction))
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_a_shell_with_a_hole_through_it_is_placed_too() -> None:
    torus = trimesh.creation.torus(2.0, 1.0, 12, 8)
    mesh = TriMesh(torus.vertices, torus.faces)
    _, parts, assembly = built(decomposed(mesh), connector="none")
    assert mesh.genus == 1
    assert len(assembly.steps) == len(mesh.faces)
    assert len(parts.parts) < 20
