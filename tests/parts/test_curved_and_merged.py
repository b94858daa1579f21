"""Curved and merged pieces as solids: thickness, bevels that keep apart, pockets, one mould per class."""

import numpy as np
import pytest
from exact_shapes import decomposed, icosahedron

from drkid.assembly import assemble
from drkid.curved_patch import barycentric_grid
from drkid.kit import Decomposition, PartSet
from drkid.mesh import TriMesh
from drkid.parts import make_parts
from drkid.patches import make_patches
from drkid.spec import KitSpec

SPECS = {
    "curved": KitSpec(patch="curved", curved_classes=1),
    "published": KitSpec(patch="curved", curved="published", curved_classes=1),
    "pairs": KitSpec(merge=2),
    "stars": KitSpec(merge=5),
}


def sphere_like(mesh: TriMesh) -> TriMesh:
    """The mesh's circumscribed ball, finely."""
    fine = mesh
    for _ in range(4):
        middle = np.concatenate([fine.vertices, fine.vertices[fine.edges].mean(axis=1)])
        a, b, c = fine.faces.T
        x, y, z = (len(fine.vertices) + fine.face_edges).T
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, x, z), (x, b, y), (z, y, c), (x, y, z))])
        fine = TriMesh(middle / np.linalg.norm(middle, axis=1, keepdims=True), faces)
    return fine.scaled(float(np.linalg.norm(mesh.vertices[0])))


@pytest.fixture(scope="module", params=SPECS)
def made(request) -> tuple[Decomposition, PartSet]:
    d, spec = decomposed(icosahedron()), SPECS[request.param]
    patches = make_patches(d, sphere_like(d.mesh), spec)
    assert patches is not None
    d = d if spec.merge else patches.decomposition
    return d, make_parts(d, spec, patches=patches)


def test_pieces_are_solids_with_equal_pockets_that_hold_the_connector(made) -> None:
    _, parts = made
    half = parts.connectors[0].solid
    for part in parts.parts:
        mesh = part.solid.mesh()
        assert mesh.is_closed_manifold
        assert mesh.component_count == 1
        assert len(part.side_frames) == len(part.corners)
        for frame in part.side_frames:
            held = half.moved(frame)
            assert (held & part.solid).volume < 1e-9
            assert part.solid.gap(held, 1.0) == pytest.approx(parts.dimensions.clearance_mm, abs=1e-6)


def test_hinge_axes_meet_and_no_two_pieces_overlap(made) -> None:
    d, parts = made
    mesh = d.mesh.scaled(parts.scale_mm_per_unit)
    assembly = assemble(mesh, parts)
    covered = sorted(f for piece in assembly.pieces for f in piece.faces)
    assert covered == list(range(len(mesh.faces)))
    solids = [parts.parts[p.part].solid.moved(p.transform) for p in assembly.pieces]
    owner = {f: i for i, p in enumerate(assembly.pieces) for f in p.faces}
    axes: dict[tuple[int, ...], list[np.ndarray]] = {}
    for piece in assembly.pieces:
        ends = [*piece.vertices, piece.vertices[0]]
        for i, frame in enumerate(parts.parts[piece.part].side_frames):
            placed = piece.transform @ frame
            axes.setdefault(tuple(sorted(ends[i : i + 2])), []).append(placed[:3, 3])
    for joint in assembly.joints:
        one, other = axes[tuple(sorted(joint.edge))]
        assert one == pytest.approx(other, abs=1e-6)
        a, b = (owner[f] for f in joint.faces)
        assert (solids[a] & solids[b]).volume < 1e-6 * solids[a].volume
    assert len(axes) == len(assembly.joints)


def test_steps_place_every_piece_beside_one_that_stands(made) -> None:
    d, parts = made
    assembly = assemble(d.mesh.scaled(parts.scale_mm_per_unit), parts)
    done: set[int] = set()
    for step in assembly.steps:
        assert set(step.joins) <= done
        assert step.joins or not done
        done.add(step.face)
    assert done == {piece.face for piece in assembly.pieces}


@pytest.mark.parametrize(("levels", "flattened"), [(1, 0.05), (2, 0.02), (3, 0.01), (4, 0.01)])
def test_curved_shell_is_as_thick_as_stated_along_its_normal(levels, flattened) -> None:
    d = decomposed(icosahedron())
    spec = KitSpec(patch="curved", curved_classes=1, subdivision_levels=levels, connector="none")
    patches = make_patches(d, sphere_like(d.mesh), spec)
    assert patches is not None
    parts = make_parts(patches.decomposition, spec, patches=patches)
    scale, thickness = parts.scale_mm_per_unit, parts.dimensions.thickness_mm
    patch = patches.curved[0].scaled(scale)
    middle = patch.points(np.full((1, 3), 1 / 3))[0]
    heights = parts.parts[0].solid.cross_section(float(middle[2]))
    assert heights, "the middle surface runs inside the piece"
    top = parts.parts[0].solid.bounds[1, 2]
    highest = float(patch.points(barycentric_grid(levels).points)[:, 2].max())
    assert top == pytest.approx(highest + thickness / 2, abs=flattened * thickness)
    assert levels < 3 or highest == pytest.approx(middle[2], abs=0.02 * thickness)
    assert patch.points(np.eye(3))[:, 2] == pytest.approx(np.zeros(3), abs=1e-9)


def test_every_joint_turns_as_far_as_asked(made) -> None:
    d, parts = made
    swing = assemble(d.mesh.scaled(parts.scale_mm_per_unit), parts).figures.swing
    assert swing.blocked == 0
    assert min(swing.inward_degrees, swing.outward_degrees) >= swing.wanted_degrees - 1e-6


def test_merged_pieces_bear_marks_only_where_a_depth_is_given() -> None:
    d = decomposed(icosahedron())
    patches = make_patches(d, sphere_like(d.mesh), SPECS["pairs"])
    plain = make_parts(d, SPECS["pairs"], patches=patches)
    marked = make_parts(d, KitSpec(merge=2, mark_depth_mm=0.4), patches=patches)
    assert [note for note in plain.notes if "Merged pieces bear no marks" in note and "--mark-depth-mm" in note]
    assert not [note for note in marked.notes if "marks" in note]
    assert [f.available for f in marked.findings if f.subject == "marks"] == [0.4]
    assert not [f for f in plain.findings if f.subject == "marks"]
    for before, after in zip(plain.parts, marked.parts, strict=True):
        assert after.solid.volume < before.solid.volume
    for off in (KitSpec(merge=2, mark_depth_mm=0.0), KitSpec(merge=2, mark_depth_mm=0.4, marks=False)):
        bare = make_parts(d, off, patches=patches)
        assert [p.solid.volume for p in bare.parts] == [p.solid.volume for p in plain.parts]
        assert not [note for note in bare.notes if "marks" in note]
