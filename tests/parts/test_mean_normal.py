import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato, sixths

from drkid.class_triangle import laid_down, symmetries
from drkid.kit import Decomposition
from drkid.parts.mean_normal import leaning, mean_normal_slopes
from drkid.parts.members import members_of


def test_normals_of_a_sphere_meet_at_its_centre() -> None:
    d = decomposed(icosahedron())
    slopes = mean_normal_slopes(members_of(d), d.class_lengths)[0]
    triangle = laid_down(d.class_lengths[0])
    distance = np.linalg.norm(d.mesh.corners.mean(axis=1), axis=1).mean()
    assert triangle - distance * slopes == pytest.approx(np.zeros((3, 2)), abs=1e-6)


@pytest.mark.parametrize("mesh", [geodesic(), icosahedron(), sixths()])
def test_slopes_have_the_symmetries_of_the_class(mesh) -> None:
    d = decomposed(mesh)
    slopes = mean_normal_slopes(members_of(d), d.class_lengths)
    for row, lengths in zip(slopes, d.class_lengths, strict=True):
        for image, matrix in symmetries(lengths):
            assert row @ matrix.T == pytest.approx(row[list(image)], abs=1e-5)


@pytest.mark.parametrize("ratio", [(1, 1, 1), (1, 1, 1.2), (1, 1.2, 1.2)])
def test_symmetric_classes_stay_so_among_unlike_members(ratio) -> None:
    d = decomposed(potato(), 1)
    lengths = d.mesh.mean_edge * np.array([ratio], float)
    members = members_of(Decomposition(d.mesh, d.face_class, lengths, d.face_errors, 0, (), d.outcome))
    slopes = mean_normal_slopes(members, lengths)[0]
    assert not members.left.any()
    assert np.abs(slopes).max() > 0.05
    for image, matrix in symmetries(lengths[0]):
        assert slopes @ matrix.T == pytest.approx(slopes[list(image)], abs=1e-9)


def test_leaning_piece_is_half_way_at_the_class_triangle_and_obeys_its_limit() -> None:
    d = decomposed(sixths())
    slopes = mean_normal_slopes(members_of(d), d.class_lengths)[0]
    lengths = d.class_lengths[0] * 40
    free, cut = leaning(lengths, slopes, np.inf, 8.0), leaning(lengths, slopes, 0.1, 8.0)
    assert free.outline(0.0) == pytest.approx(laid_down(lengths))
    assert free.faces[1] - free.faces[0] == pytest.approx(8.0 * slopes)
    assert cut.insets(laid_down(lengths)).max() == pytest.approx(0.1)
    assert np.ptp(free.solid.bounds[:, 2]) == pytest.approx(8.0)
