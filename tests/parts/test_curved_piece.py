"""Curved pieces of any patch, however deep: as large as flat ones, solid, bounded, with room behind every bevel."""

from functools import cache

import numpy as np
import pytest
from exact_shapes import decomposed, icosahedron, potato
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from drkid.class_triangle import SAME_LENGTH, equal_sides
from drkid.curved_patch import barycentric_grid, monomials, side_points
from drkid.kit import Decomposition, PartSet, Patches
from drkid.measure import distance_to_surface
from drkid.parts import make_parts
from drkid.parts.curved_piece import is_own_mirror_image
from drkid.patches.canonical_patch import BUBBLES, CanonicalPatch, symmetric_bubbles
from drkid.spec import KitSpec

SPEC = KitSpec(patch="curved", subdivision_levels=2)
INSIDE = barycentric_grid(3).points


@cache
def shape(name: str) -> Decomposition:
    return decomposed(icosahedron()) if name == "icosahedron" else decomposed(potato(1, 0.05), 3)


@cache
def flat(name: str) -> PartSet:
    return make_parts(shape(name), KitSpec())


def patches(d: Decomposition, sagitta: float, bubble: float, lean: float, seed: int) -> Patches:
    """A patch a class, its sides' sagittas and its depth in shares of a side; members of a class may differ at will."""
    rng = np.random.default_rng(seed)
    found = []
    for lengths in d.class_lengths:
        basis = symmetric_bubbles(lengths, equal_sides(lengths))
        inside = basis @ rng.uniform(-1, 1, basis.shape[1])
        inside *= bubble * lengths.mean() / np.abs(monomials(BUBBLES, INSIDE) @ inside).max()
        found.append(CanonicalPatch(lengths, sagitta * lengths, np.full(3, lean), inside).surface)
    return Patches(d, curved=tuple(found))


@settings(max_examples=8, phases=[Phase.generate])
@given(
    st.sampled_from(["icosahedron", "potato"]),
    st.floats(0, 0.25),
    st.floats(0, 0.1),
    st.floats(-0.6, 0.6),
    st.integers(0, 99),
)
def test_curved_pieces_of_any_patch_are_as_large_as_flat_ones(name, sagitta, bubble, lean, seed) -> None:
    d, plain = shape(name), flat(name)
    given_patches = patches(d, sagitta, bubble, lean, seed)
    parts = make_parts(d, SPEC, patches=given_patches)
    assert parts.scale_mm_per_unit == plain.scale_mm_per_unit
    assert parts.dimensions == plain.dimensions
    half = parts.dimensions.thickness_mm / 2
    for part in parts.parts:
        mesh = part.solid.mesh()
        assert mesh.is_closed_manifold
        assert mesh.component_count == 1
        own = given_patches.curved[part.class_index].scaled(parts.scale_mm_per_unit)
        heights = own.flattened(parts.patch_share).points(INSIDE)[:, 2]
        low, high = part.solid.bounds
        assert low[2] == pytest.approx(-half)
        others = [
            p.scaled(parts.scale_mm_per_unit).flattened(parts.patch_share).points(INSIDE)[:, 2].min()
            for p in given_patches.curved
        ]
        sides = np.linalg.norm(np.roll(part.corners, -1, axis=0) - part.corners, axis=1)
        assert high[2] <= 2 * (half - min(0.0, *others)) + max(heights.max(), 0.0) + sides.max() / 4
        assert (np.ptp(part.solid.bounds, axis=0)[:2] < 2 * sides.max()).all()


@settings(max_examples=5, phases=[Phase.generate])
@given(st.floats(0, 0.2), st.floats(-0.6, 0.6), st.integers(0, 99))
def test_every_pocket_keeps_its_roof(sagitta, lean, seed) -> None:
    """Straight over the middle of each pocket's roof lies as much as the thinnest wall."""
    d = shape("icosahedron")
    parts = make_parts(d, SPEC, patches=patches(d, sagitta, 0.15, lean, seed))
    dimensions, solid = parts.dimensions, parts.parts[0].solid
    for frame in parts.parts[0].side_frames:
        inside = frame @ np.array([0.0, dimensions.pocket_depth_mm / 2, 0.0, 1.0])
        section = solid.cross_section(dimensions.pocket_height_mm / 2 + 1e-6)
        again = solid.cross_section(dimensions.pocket_height_mm / 2 + dimensions.min_wall_mm - 0.02)
        assert _covers(section, inside[:2])
        assert _covers(again, inside[:2])


def _covers(loops, point) -> bool:
    """Whether a point lies in a section, by the even-odd rule."""
    crossings = 0
    for loop in loops:
        a, b = loop, np.roll(loop, -1, axis=0)
        spans = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
        x = a[:, 0] + (point[1] - a[:, 1]) / np.where(spans, b[:, 1] - a[:, 1], 1) * (b[:, 0] - a[:, 0])
        crossings += int((spans & (x > point[0])).sum())
    return crossings % 2 == 1


def test_a_patch_without_room_is_flattened_and_the_class_named() -> None:
    d = shape("icosahedron")
    any_bend = KitSpec(patch="curved", subdivision_levels=2, bevel_degrees=(100, 117))
    parts = make_parts(d, any_bend, patches=patches(d, 0.25, 0.0, 0.0, 0))
    assert 0 <= parts.patch_share < 1
    told = [note for note in parts.notes if "of their height" in note]
    assert len(told) == 1
    assert "inscribed radius of the curved face of class" in told[0]


@given(st.floats(0, 1), st.integers(0, 99))
def test_flattening_keeps_the_corners_and_goes_straight_to_the_triangle(share, seed) -> None:
    lengths = np.array([1.0, 1.1, 1.25])
    basis = symmetric_bubbles(lengths, equal_sides(lengths))
    patch = CanonicalPatch(
        lengths, 0.1 * lengths, np.full(3, 0.2), basis @ np.random.default_rng(seed).normal(size=basis.shape[1])
    ).surface
    less, corners = patch.flattened(share), patch.points(np.eye(3))
    plane = INSIDE @ corners
    assert less.points(INSIDE) == pytest.approx(plane + share * (patch.points(INSIDE) - plane), abs=1e-12)
    assert less.points(np.eye(3)) == pytest.approx(corners)
    if share == 0:
        assert less.normals(side_points(0, np.array([0.5]))) == pytest.approx(np.array([[0, 0, 1]]), abs=SAME_LENGTH)


@settings(max_examples=3, phases=[Phase.generate])
@given(st.floats(-0.05, 0.1), st.floats(0.05, 0.15), st.integers(0, 99))
def test_the_piece_of_a_symmetric_patch_is_its_own_mirror_image(sagitta, bubble, seed) -> None:
    d = shape("icosahedron")
    part = make_parts(d, SPEC, patches=patches(d, sagitta, bubble, 0.2, seed)).parts[0]
    assert part.handedness == "any"
    mirrored = part.solid.mirrored().mesh()
    apart = distance_to_surface(mirrored, part.solid.mesh().vertices)
    turned = np.array([[-0.5, -np.sqrt(0.75), 0], [np.sqrt(0.75), -0.5, 0], [0, 0, 1]])
    for motion in (turned, turned.T):
        moved = mirrored.moved(mirrored.vertices @ motion.T)
        apart = np.minimum(apart, distance_to_surface(moved, part.solid.mesh().vertices))
    assert apart.max() < 0.005


def test_the_piece_of_a_lopsided_patch_is_not() -> None:
    d = shape("icosahedron")
    inside = np.zeros(len(BUBBLES))
    inside[0] = 3 * d.mesh.mean_edge
    lengths = d.class_lengths[0]
    patch = CanonicalPatch(lengths, 0.02 * lengths, np.zeros(3), inside).surface
    assert is_own_mirror_image(lengths, patch), "one corner's term is symmetric about the bisector there"
    inside[1] = d.mesh.mean_edge
    patch = CanonicalPatch(lengths, 0.02 * lengths, np.zeros(3), inside).surface
    assert not is_own_mirror_image(lengths, patch)
    parts = make_parts(d, SPEC, patches=Patches(d, curved=(patch,))).parts
    assert [part.handedness for part in parts] == ["right"]
