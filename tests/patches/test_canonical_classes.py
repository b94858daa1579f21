from dataclasses import replace

import numpy as np
import pytest
import trimesh

from drkid.kit import Decomposition, Outcome
from drkid.mesh import TriMesh
from drkid.patches.assignment import PatchClasses, curves_agreed, improved, side_neighbours
from drkid.patches.canonical_classes import canonical_classes
from drkid.patches.canonical_fit import canonical_fit, gaps, joint_curves, target_of
from drkid.patches.laid_faces import laid_faces
from drkid.patches.smoothness import joints

GAP = 0.02  # of the mean edge
SMOOTHNESS = 0.002
SIDES, BANDS, SHORT, LONG = 6, 5, 1.0, 1.2


def tube() -> Decomposition:
    """Antiprisms in a stack, a pyramid at either end: 72 triangles with one short side and two long ones."""
    radius = SHORT / (2 * np.sin(np.pi / SIDES))
    band = np.sqrt(LONG**2 - (2 * radius * np.sin(np.pi / (2 * SIDES))) ** 2)
    ring = np.arange(SIDES)
    points, faces = [], []
    for level in range(BANDS + 1):
        angle = 2 * np.pi * (ring + level / 2) / SIDES
        points += [(radius * np.cos(a), radius * np.sin(a), level * band) for a in angle]
    for level in range(BANDS):
        here, above = level * SIDES + ring, (level + 1) * SIDES + ring
        faces += np.column_stack([here, np.roll(here, -1), above]).tolist()
        faces += np.column_stack([np.roll(here, -1), np.roll(above, -1), above]).tolist()
    top, peak = BANDS * SIDES + ring, np.sqrt(LONG**2 - radius**2)
    points += [(0, 0, -peak), (0, 0, BANDS * band + peak)]
    faces += np.column_stack([np.roll(ring, -1), ring, np.full(SIDES, len(points) - 2)]).tolist()
    faces += np.column_stack([top, np.roll(top, -1), np.full(SIDES, len(points) - 1)]).tolist()
    mesh = TriMesh(np.array(points), np.array(faces))
    lengths = np.array([[SHORT, LONG, LONG]])
    errors = np.linalg.norm(np.sort(mesh.side_lengths, axis=1) - lengths, axis=1)
    return Decomposition(mesh, np.zeros(len(faces), np.int64), lengths, errors, 0, (), Outcome("converged", ""))


def dented(mesh: TriMesh) -> TriMesh:
    """The same, finer, and with waves."""
    vertices, faces = trimesh.remesh.subdivide_loop(mesh.vertices, mesh.faces, iterations=3)
    x, y, z = vertices.T
    wave = 1 + 0.08 * np.sin(3 * z + 2 * np.arctan2(y, x))
    return TriMesh(np.column_stack([1.1 * wave * x, 1.1 * wave * y, z]), np.asarray(faces))


@pytest.fixture(scope="module")
def shape():
    made = tube()
    assert made.mesh.volume > 0
    assert made.face_errors.max() < 1e-12
    laid, surface = laid_faces(made), dented(made.mesh)
    return made, laid, surface, target_of(laid, surface, SMOOTHNESS, GAP * made.mesh.mean_edge)


def two_curves(laid) -> PatchClasses:
    """Two curves for the long sides: all four combinations in one triangle, faces spread as joints alternate."""
    curve = np.array([[0, a, b] for a in (1, 2) for b in (1, 2)])
    label = np.where(laid.bend_radians > np.median(laid.bend_radians), 2, 1)
    own = label[side_neighbours(laid)[0]]
    choice = 2 * (own[:, 1] - 1) + own[:, 2] - 1
    return PatchClasses(np.zeros(4, np.int64), curve, np.array([0, 1, 1]), choice)


def ends(laid, classes, choice):
    return classes.curve[choice[laid.joint_face], laid.joint_side]


def test_pieces_at_a_joint_have_one_curve(shape) -> None:
    _, laid, _, target = shape
    classes = two_curves(laid)
    fit = canonical_fit(classes.laid(laid), classes.curve, target)
    choice = curves_agreed(laid, classes, fit, target)
    found = ends(laid, classes, choice)
    assert (found[:, 0] == found[:, 1]).all()
    gap = gaps(laid, fit.sagittas, fit.leans)[np.arange(len(found)), found[:, 0]]
    assert (gap > (1 + 1e-6) * target.most_gap).mean() <= 0.05


def test_an_agreed_choice_leaves_no_more_in_its_own_measure(shape) -> None:
    """Against the choice it began with, where smoothness does not count and the measure is the residual."""
    made, laid, surface, _ = shape
    target = target_of(laid, surface, 0.0, GAP * made.mesh.mean_edge)
    classes = two_curves(laid)
    fit = canonical_fit(classes.laid(laid), classes.curve, target)
    chosen = replace(classes, choice=curves_agreed(laid, classes, fit, target))
    again = canonical_fit(chosen.laid(laid), chosen.curve, replace(target, most_gap=np.inf))
    assert again.residual <= fit.residual * (1 + 1e-3)


def test_faces_change_for_the_better_and_keep_their_curves(shape) -> None:
    made, laid, _, target = shape
    rng = np.random.default_rng(3)
    classes = PatchClasses(
        np.zeros(3, np.int64), np.array([[0, 1, 1]] * 3), np.array([0, 1]), rng.integers(0, 3, len(made.mesh.faces))
    )
    fit = canonical_fit(classes.laid(laid), classes.curve, target)
    better = replace(classes, choice=improved(laid, classes.kind, classes.choice, fit, target))
    assert (better.choice != classes.choice).any()
    assert canonical_fit(better.laid(laid), better.curve, target).residual < fit.residual


def test_more_classes_lie_nearer_and_keep_to_the_gap(shape) -> None:
    made, _, surface, target = shape
    left = []
    for count in (1, 2, 4, 8):
        divided, laid, patches = canonical_classes(made, surface, count, SMOOTHNESS, target.most_gap)
        assert len(patches) == len(divided.class_lengths) == len(np.unique(divided.face_class)) <= count
        assert (divided.class_lengths == made.class_lengths).all()
        gap = joints(laid, tuple(patch.surface for patch in patches)).gap
        assert np.percentile(gap, 95) <= 1.05 * target.most_gap
        curve = np.unique([p.sagittas for p in patches], return_inverse=True)[1].reshape(-1, 3)
        assert len(joint_curves(laid, curve)) == len(gap)
        left.append(canonical_fit(laid, curve, target).residual)
    assert left == sorted(left, reverse=True)
    assert left[-1] < 0.7 * left[0]


def test_eight_classes_use_the_curves_of_the_sides(shape) -> None:
    made, _, surface, target = shape
    patches = canonical_classes(made, surface, 8, SMOOTHNESS, target.most_gap)[2]
    assert len(np.unique(np.round([p.sagittas for p in patches], 9))) > 2


def test_a_mesh_that_is_not_exact_has_one_curve_a_length(pebble, potato) -> None:
    lengths = np.array([[0.9, 1.0, 1.0], [0.9, 0.9, 1.0]]) * pebble.mean_edge
    apart = np.linalg.norm(np.sort(pebble.side_lengths, axis=1)[:, None] - lengths, axis=2)
    made = Decomposition(pebble, apart.argmin(axis=1), lengths, apart.min(axis=1), 0, (), Outcome("stalled", ""))
    few, many = (canonical_classes(made, potato, n, SMOOTHNESS, GAP * pebble.mean_edge) for n in (2, 9))
    assert len(few[2]) == 2 < len(many[2]) <= 9
    assert len(np.unique(np.round([p.sagittas for p in many[2]], 9))) <= 2
    assert (many[0].class_lengths[many[0].face_class] == lengths[made.face_class]).all()
