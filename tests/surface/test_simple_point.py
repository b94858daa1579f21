"""Simple points and fronts that keep their topology."""

import numpy as np
import scipy.ndimage as ndi
from hypothesis import given
from hypothesis import strategies as st
from voxel_shapes import ball, ring

from drkid.surface.simple_point import deform, even_out, is_simple, order_of

ANY = np.ones((3, 3, 3))
WITHIN_18 = ndi.generate_binary_structure(3, 2)
FACES = ndi.generate_binary_structure(3, 1)
FACES[1, 1, 1] = WITHIN_18[1, 1, 1] = False


def simple_by_definition(near):
    """One 26-component of the object around the centre, one 6-component of the background that touches its faces."""
    inside = near.copy()
    inside[1, 1, 1] = False
    outside = ~near & WITHIN_18
    numbered, _ = ndi.label(outside)
    return ndi.label(inside, ANY)[1] == 1 and len(np.unique(numbered[FACES & outside])) == 1


@given(st.integers(0, 1_000_000), st.floats(0.05, 0.95))
def test_simple_is_what_the_definition_says(seed, share):
    near = np.random.default_rng(seed).random((3, 3, 3)) < share
    assert is_simple(near.astype(np.uint8), 1, 1, 1) == simple_by_definition(near)


def counts(mask):
    """Pieces of the object and of the background, and the Euler characteristic by its pieces of 2 × 2 × 2."""
    return ndi.label(mask, ANY)[1], ndi.label(~mask)[1]


@given(st.integers(0, 10_000), st.booleans())
def test_a_front_keeps_pieces_and_stops_at_sheets(seed, grows):
    noise = ndi.gaussian_filter(np.random.default_rng(seed).random((12, 11, 10)), 0.8)
    target = np.zeros((14, 13, 12), np.uint8)
    target[1:-1, 1:-1, 1:-1] = noise > np.median(noise)
    inside = np.zeros_like(target)
    if grows:
        inside[tuple(np.argwhere(target)[0])] = 1
    else:
        inside[1:-1, 1:-1, 1:-1] = 1
    deform(inside, target, order_of(ndi.distance_transform_edt(target == grows)))
    assert counts(inside > 0) == (1, 1)
    left = np.argwhere(inside != target)
    assert ((inside <= target) if grows else (inside >= target)).all()
    for x, y, z in left:
        inner = all(0 < at < size - 1 for at, size in zip((x, y, z), target.shape, strict=True))
        assert not (inner and is_simple(inside, x, y, z))


def test_a_front_reaches_what_has_its_topology_and_not_a_ring():
    for mask, left in ((ball(), 0), (np.pad(ring(), 1), 1)):
        target = mask.astype(np.uint8)
        inside = np.zeros_like(target)
        inside[1:-1, 1:-1, 1:-1] = 1
        deform(inside, target, order_of(ndi.distance_transform_edt(~mask)))
        assert ndi.label(inside != target, ANY)[1] == left


def test_evening_out_fills_a_dent_and_leaves_a_flat_side():
    block = np.zeros((12, 12, 12), np.uint8)
    block[2:10, 2:10, 2:10] = 1
    flat = block.copy()
    even_out(flat, 1, 5)
    assert (flat == block).all()
    block[5, 5, 9] = 0
    even_out(block, 1, 5)
    assert (flat == block).all()
