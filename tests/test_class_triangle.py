import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.class_triangle import (
    equal_sides,
    inward_normals,
    is_mirror_symmetric,
    laid_down,
    symmetries,
)

triangles = st.tuples(st.floats(1, 1.4), st.floats(1, 1.4), st.floats(1, 1.4)).map(lambda t: np.array(sorted(t)))


@given(triangles)
def test_laid_down_in_the_part_frame(lengths) -> None:
    corners = laid_down(lengths)
    along = np.roll(corners, -1, axis=0) - corners
    assert np.linalg.norm(along, axis=1) == pytest.approx(lengths)
    assert corners.mean(axis=0) == pytest.approx(np.zeros(2), abs=1e-12)
    assert along[0] == pytest.approx([lengths[0], 0])
    assert along[0, 0] * along[1, 1] - along[0, 1] * along[1, 0] > 0


@given(triangles)
def test_inward_normals_look_at_the_opposite_corner(lengths) -> None:
    corners = laid_down(lengths)
    normals = inward_normals(corners)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(3))
    assert (np.einsum("ij,ij->i", np.roll(corners, -2, axis=0) - corners, normals) > 0).all()


@pytest.mark.parametrize(
    ("lengths", "groups", "motions"),
    [
        ([1, 1, 1], [0, 0, 0], 6),
        ([1, 1, 1.2], [0, 0, 1], 2),
        ([1, 1.2, 1.2], [0, 1, 1], 2),
        ([1, 1.1, 1.2], [0, 1, 2], 1),
    ],
)
def test_symmetries_carry_the_triangle_onto_itself(lengths, groups, motions) -> None:
    lengths = np.array(lengths, float)
    assert equal_sides(lengths).tolist() == groups
    assert is_mirror_symmetric(lengths) == (motions > 1)
    corners, found = laid_down(lengths), symmetries(lengths)
    assert len(found) == motions
    for image, matrix in found:
        assert matrix @ matrix.T == pytest.approx(np.eye(2), abs=1e-12)
        assert corners @ matrix.T == pytest.approx(corners[list(image)], abs=1e-12)
