import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato, sixths
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.class_triangle import is_equilateral
from drkid.parts.bevel import bevel_groups, bisector_insets, demanded
from drkid.parts.bevel_variants import bevel_variants, moulds
from drkid.parts.members import members_of
from drkid.spec import KitSpec

EQUAL = np.array([[1.0, 1.0, 1.0]])
TRIANGLES = [EQUAL, np.array([[1.0, 1.0, 1.2]]), np.array([[1.0, 1.1, 1.2]])]


def spent(demand, lengths, variant, turned) -> float:
    """Members × insets, summed over variants, sides and faces."""
    asked = np.stack([np.roll(one, -turn, axis=1) for one, turn in zip(demand, turned, strict=True)])
    group = bevel_groups(lengths)
    together = group[:, None] == group
    total = 0.0
    for one in np.unique(variant):
        highest = asked[variant == one].max(axis=0)
        total += (variant == one).sum() * np.where(together, highest[:, None], -np.inf).max(axis=2).sum()
    return total


def random_demand(seed: int, size: int) -> np.ndarray:
    bend = np.random.default_rng(seed).normal(15, 25, (size, 3))
    return np.stack([np.tan(np.radians(bend + 5) / 2), -np.tan(np.radians(bend - 5) / 2)], axis=1)


@pytest.mark.parametrize("lengths", TRIANGLES)
@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 40))
def test_further_variants_and_turns_never_cost(lengths, seed, size) -> None:
    demand, one_class = random_demand(seed, size), np.zeros(size, np.int64)
    still = spent(demand, lengths[0], one_class, one_class)
    for count in (1, 2, 4):
        found = bevel_variants(demand, one_class, lengths, count)
        now = spent(demand, lengths[0], found.variant, found.turned)
        assert now <= still + 1e-9
        assert len(np.unique(found.variant)) <= count
        assert found.turned.any() <= is_equilateral(lengths[0])
        # no single move saves anything
        for i in range(min(size, 5)):
            for v in range(count):
                for turn in range(3 if is_equilateral(lengths[0]) else 1):
                    variant, turned = found.variant.copy(), found.turned.copy()
                    variant[i], turned[i] = v, turn
                    assert spent(demand, lengths[0], variant, turned) >= now - 1e-6


def test_two_kinds_of_faces_are_told_apart_exactly() -> None:
    demand = np.concatenate([np.full((6, 2, 3), 0.1), np.full((4, 2, 3), 0.7)])[
        np.argsort([3, 1, 4, 1, 5, 9, 2, 6, 5, 3])
    ]
    found = bevel_variants(demand, np.zeros(10, np.int64), TRIANGLES[1], 3)
    assert len(np.unique(found.variant)) == 2
    assert len(np.unique(found.variant[demand[:, 0, 0] > 0.5])) == 1


def test_equilateral_pieces_turn_their_sharp_side_to_the_same_place() -> None:
    demand = np.full((9, 2, 3), 0.1)
    demand[np.arange(9), 0, np.arange(9) % 3] = 0.8
    found = bevel_variants(demand, np.zeros(9, np.int64), EQUAL, 1)
    sides = np.array(
        [np.roll(one, -turn, axis=1).argmax() for one, turn in zip(demand[:, :1], found.turned, strict=True)]
    )
    assert (sides == 2).all()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_moulds_are_classes_that_serve_all_their_members(count) -> None:
    d = decomposed(potato(4), 5)
    found = moulds(d, KitSpec(bevel_variants=count), count)
    assert len(found.class_index) <= 5 * count
    assert (found.class_index[found.members.face_class] == d.face_class).all()
    assert (found.decomposition.class_lengths == d.class_lengths[found.class_index]).all()
    demand = demanded(found.members, 20.0, 6.0, 5.5)
    insets = bisector_insets(demand, found.members, found.decomposition.class_lengths)
    assert (insets[found.members.face_class] >= demand - 1e-9).all()
    names = [found.name(m) for m in range(len(found.class_index))]
    assert len(set(names)) == len(names)
    sizes = np.bincount(found.members.face_class)
    for index in range(5):
        own = found.class_index == index
        assert found.variant[own].tolist() == ([0] if own.sum() == 1 else list(range(1, own.sum() + 1)))
        assert (np.diff(sizes[own]) <= 0).all()


@pytest.mark.parametrize("spec", [{"thickening": "perpendicular"}, {"bevel_degrees": (60, 90)}])
def test_bevels_that_follow_no_bend_need_no_variants(spec) -> None:
    d = decomposed(geodesic())
    found = moulds(d, KitSpec(**spec), 4)
    assert (found.variant == 0).all()
    assert (found.members.turn == members_of(d).turn).all()


def test_left_and_right_count_apart() -> None:
    assert moulds(decomposed(sixths()), KitSpec(), 1).count == 2
    assert moulds(decomposed(icosahedron()), KitSpec(), 3).count == 1
