from dataclasses import replace

import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, potato, sixths
from hypothesis import given
from hypothesis import strategies as st

from drkid.class_triangle import equal_sides
from drkid.parts.bevel import MOST_MIDDLE_INSET, bevel_insets, bisector_insets, demanded, limited
from drkid.parts.members import members_of


@pytest.mark.parametrize("mesh", [geodesic(), sixths()])
def test_congruent_members_get_the_closed_formula(mesh) -> None:
    d = decomposed(mesh)
    members, t = members_of(d), 6.0
    insets = bisector_insets(demanded(members, 1.0, t, 5.5), members, d.class_lengths)
    for k, lengths in enumerate(d.class_lengths):
        group = equal_sides(lengths)
        for side in range(3):
            bends = members.bend_radians[members.face_class == k][:, group == group[side]]
            tangents = np.tan((bends.min() - np.radians(5.5)) / 2), np.tan((bends.max() + np.radians(5.5)) / 2)
            slope, middle = sum(tangents) / 2, t / 4 * (tangents[1] - tangents[0])
            assert insets[k, :, side] == pytest.approx([middle + t / 2 * slope, middle - t / 2 * slope], abs=1e-4)


@given(st.integers(0, 50), st.integers(1, 20), st.floats(2, 12), st.floats(0, 15))
def test_insets_serve_every_member_and_are_shared_by_equal_sides(seed, classes, thickness, swing) -> None:
    d = decomposed(potato(seed), classes)
    members = members_of(d)
    demand = demanded(members, 20.0, thickness, swing)
    insets = bisector_insets(demand, members, d.class_lengths)
    assert (insets[members.face_class] >= demand - 1e-9).all()
    assert (insets.mean(axis=1) >= -1e-9).all()
    for k, lengths in enumerate(d.class_lengths):
        own, group = insets[k] - demand[members.face_class == k], equal_sides(lengths)
        for g in range(group[-1] + 1):
            assert np.ptp(insets[k][:, group == g], axis=1) == pytest.approx([0, 0])
            spare = own[:, :, group == g].min(axis=(0, 2))
            # no more than needed at either face, unless the side would stand out over the hinge axis
            assert spare[0] == pytest.approx(spare[1], abs=1e-9)
            assert spare[0] < 1e-9 or insets[k][:, group == g].mean() == pytest.approx(0, abs=1e-9)


@given(st.integers(0, 20), st.floats(2, 12), st.floats(0, 15))
def test_a_bevel_for_any_shape_serves_every_joint_within_its_bends(seed, thickness, swing) -> None:
    members = members_of(decomposed(potato(seed), 60))
    bends = np.degrees(members.bend_radians)
    exact = replace(members, far=np.zeros_like(members.far))
    insets = bevel_insets((max(0.0, -bends.min()), bends.max()), thickness, swing)
    demand = demanded(exact, 20.0, thickness, swing)
    assert (insets >= demand - 1e-9).all()
    assert (insets[0] - demand[:, 0]).min() == pytest.approx(0, abs=1e-9)


def test_a_bevel_that_serves_as_much_inwards_as_outwards_is_the_same_on_both_faces() -> None:
    inner, outer = bevel_insets((40.0, 40.0), 7.0, 5.0).ravel()
    assert inner == outer == pytest.approx(3.5 * np.tan(np.radians(22.5)))


def test_a_class_without_members_gets_no_bevel() -> None:
    d = decomposed(geodesic())
    lengths = np.vstack([d.class_lengths, [[1.0, 1.0, 1.0]]])
    members = members_of(d)
    insets = bisector_insets(demanded(members, 1.0, 5.0, 0.0), members, lengths)
    assert (insets[-1] == 0).all()
    assert insets[0].any()


@given(st.lists(st.floats(-20, 20), min_size=6, max_size=6))
def test_limits_are_kept(values) -> None:
    cut = limited(np.reshape(values, (2, 3)), 4.0, 7.0)
    assert cut.max() <= 4.0
    assert cut.mean(axis=0).max() <= MOST_MIDDLE_INSET * 7.0 + 1e-9
    assert (cut <= np.reshape(values, (2, 3)) + 1e-12).all()
