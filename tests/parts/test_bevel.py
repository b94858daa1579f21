from dataclasses import replace

import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, potato, sixths
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.parts.bevel import (
    bevel_groups,
    bevel_insets,
    bisector_insets,
    demanded,
    flippable_insets,
    limited,
    ridged,
    ridges,
)
from drkid.parts.members import members_of


@pytest.mark.parametrize("mesh", [geodesic(), sixths()])
def test_congruent_members_get_the_closed_formula(mesh) -> None:
    d = decomposed(mesh)
    members, t = members_of(d), 6.0
    insets = bisector_insets(demanded(members, 1.0, t, 5.5), members, d.class_lengths)
    for k, lengths in enumerate(d.class_lengths):
        group = bevel_groups(lengths)
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
        own, group = insets[k] - demand[members.face_class == k], bevel_groups(lengths)
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


@given(st.lists(st.floats(-20, 20), min_size=6, max_size=6), st.floats(0, 1), st.floats(0.5, 1.5))
def test_a_bevel_leaves_the_connector_its_hold(values, ridge, share) -> None:
    asked, ridge_mm = np.reshape(values, (1, 2, 3)), np.full((1, 3), ridge)
    cut = limited(asked, ridge_mm, 4.0, share)
    assert (cut <= asked + 1e-12).all()
    assert (ridge + (cut - ridge) * share).max() <= 4.0 + 1e-9
    kept = ridge + (asked - ridge) * share <= 4.0
    assert (cut[kept] == asked[kept]).all()


@settings(max_examples=25)
@given(st.integers(0, 20), st.integers(1, 20), st.floats(2, 12), st.floats(0.1, 15), st.floats(0, 0.4))
def test_a_ridged_bevel_stays_on_its_side_of_the_bisector_at_every_height(seed, classes, t, swing, clearance) -> None:
    d = decomposed(potato(seed), classes)
    members = members_of(d)
    insets = bisector_insets(demanded(members, 20.0, t, swing), members, d.class_lengths)
    inner, middle, outer = np.moveaxis(ridged(insets, ridges(members, d.class_lengths, 20.0, clearance)), 1, 0)
    assert (middle <= insets.mean(axis=1) + 1e-12).all()  # convex
    for height in np.linspace(-1, 1, 9):
        share = abs(height)
        inset = (middle + share * ((inner if height < 0 else outer) - middle))[members.face_class]
        for bend in (members.bend_radians - np.radians(swing), members.bend_radians + np.radians(swing)):
            assert (inset >= 20.0 * members.far - height * t / 2 * np.tan(bend / 2) - 1e-9).all()


def test_a_flippable_piece_has_the_larger_inset_at_both_faces() -> None:
    insets = flippable_insets(np.array([[[3.0, 1.0, 0.5], [1.0, 2.0, 0.5]]]))
    assert insets.tolist() == [[[3.0, 2.0, 0.5], [3.0, 2.0, 0.5]]]


def test_an_equilateral_piece_has_one_side_of_its_own_and_an_isosceles_one_two_alike() -> None:
    assert bevel_groups(np.array([1.0, 1.0, 1.0])).tolist() == [0, 0, 1]
    assert bevel_groups(np.array([1.0, 1.0, 1.2])).tolist() == [0, 0, 1]
    assert bevel_groups(np.array([1.0, 1.2, 1.2])).tolist() == [0, 1, 1]
    assert bevel_groups(np.array([1.0, 1.1, 1.2])).tolist() == [0, 1, 2]
