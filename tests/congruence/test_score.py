import numpy as np
import pytest

from drkid.congruence.score import Quality, Yardstick
from drkid.measure import dihedral, hausdorff
from drkid.mesh import TriMesh
from drkid.spec import KitSpec


def test_the_reference_itself_has_no_distance_and_no_excess(potato):
    quality = Yardstick(potato, KitSpec()).quality(potato)
    assert quality.mean_percent == pytest.approx(0, abs=1e-9)
    assert quality.max_percent == pytest.approx(0, abs=1e-9)
    assert quality.excess_p95_degrees == quality.excess_concave_percent == 0
    assert quality.p95_degrees == pytest.approx(dihedral(potato).p95_degrees)


def test_distances_agree_with_dense_sampling(potato):
    rng = np.random.default_rng(0)
    other = potato.moved(potato.vertices + 0.02 * rng.normal(size=potato.vertices.shape))
    quality = Yardstick(potato, KitSpec()).quality(other)
    dense = hausdorff(potato, other, rng, 20_000)
    assert quality.mean_percent == pytest.approx(100 * dense.mean / potato.diagonal, rel=0.08)
    assert quality.max_percent == pytest.approx(100 * dense.max / potato.diagonal, rel=0.1)
    assert quality.excess_p95_degrees > 0


def test_a_dent_counts_as_concave(potato):
    dent = potato.vertices.copy()
    dent[::5] *= 0.9
    assert Yardstick(potato, KitSpec()).quality(potato.moved(dent)).excess_concave_percent > 5


def test_the_farthest_place_is_where_a_vertex_was_pulled_out(potato):
    spike = potato.vertices.copy()
    spike[7] += 0.8 * potato.mean_edge * potato.vertex_normals[7]
    quality = Yardstick(potato, KitSpec()).quality(potato.moved(spike))
    assert quality.farthest == pytest.approx(tuple(spike[7]))


def test_weights_choose_what_counts():
    quality = Quality(1.0, 5.0, 40.0, 8.0, 10.0, (0.0, 0.0, 0.0))

    def score(**weights: float) -> float:
        zero = dict.fromkeys(("weight_mean", "weight_max", "weight_dihedral", "weight_concave"), 0.0)
        return Yardstick(TriMesh(np.zeros((3, 3)), np.array([[0, 1, 2]])), KitSpec(**(zero | weights))).score(quality)

    assert score(weight_mean=1) == pytest.approx(2)
    assert score(weight_max=1) == pytest.approx(2)
    assert score(weight_dihedral=1) == pytest.approx(2)
    assert score(weight_concave=1) == pytest.approx(2)
    assert score(weight_mean=1, weight_concave=0.5) == pytest.approx(3)
