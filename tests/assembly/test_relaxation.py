import numpy as np
import pytest
import trimesh
from exact_shapes import geodesic, icosahedron, potato, sixths, tetrahedron
from hinged import framework_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.assembly.breadth_first import chained
from drkid.assembly.relaxation import _moved, arm_length, bending, curvature, jacobian, relaxed
from drkid.mesh import TriMesh

solid = trimesh.convex.convex_hull(np.vstack([np.eye(3), -np.eye(3)]))
OCTAHEDRON = TriMesh(solid.vertices, solid.faces)
EXACT = {
    "tetrahedron": tetrahedron(),
    "octahedron": OCTAHEDRON,
    "icosahedron": icosahedron(),
    "geodesic": geodesic(),
    "sixths": sixths(),
    "potato": potato(3),
}


def largest(gaps) -> float:
    return float(np.linalg.norm(gaps, axis=-1).max())


@pytest.mark.parametrize("name", EXACT)
def test_exact_triangles_close_at_once(name) -> None:
    framework = framework_of(EXACT[name])
    start = chained(framework)
    assert largest(framework.gaps(start)) < 1e-9
    assert relaxed(framework, start).settled


@pytest.mark.parametrize("name", ["octahedron", "icosahedron", "geodesic", "potato"])
def test_exact_triangles_close_from_disturbed_places(name) -> None:
    framework = framework_of(EXACT[name])
    rng = np.random.default_rng(0)
    disturbed = _moved(chained(framework), 0.03 * rng.standard_normal((framework.count, 6)), 1.0)
    assert largest(framework.gaps(disturbed)) > 0.03
    found = relaxed(framework, disturbed)
    assert found.settled
    assert largest(found.gaps) < 1e-7


def test_what_is_left_is_a_minimum() -> None:
    mesh = potato(2)
    change = 0.02 * np.random.default_rng(1).standard_normal((len(mesh.faces), 3))
    framework = framework_of(mesh, change)
    found = relaxed(framework, chained(framework))
    assert found.settled
    total = (found.gaps**2).sum()
    assert 0 < total < (framework.gaps(chained(framework)) ** 2).sum()
    rng = np.random.default_rng(2)
    for _ in range(20):
        beside = _moved(found.placements, 1e-3 * rng.standard_normal((framework.count, 6)), 1.0)
        assert (framework.gaps(beside) ** 2).sum() > total


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 20))
def test_derivatives_agree_with_finite_differences(seed) -> None:
    rng = np.random.default_rng(seed)
    framework = framework_of(potato(seed))
    places = _moved(chained(framework), 0.1 * rng.standard_normal((framework.count, 6)), 1.0)
    arm, step, small = arm_length(framework), rng.standard_normal((framework.count, 6)), 1e-4
    ahead, here, behind = (framework.gaps(_moved(places, h * step, arm)) for h in (small, 0.0, -small))
    slope = (jacobian(framework, places, arm) @ step.ravel()).reshape(here.shape)
    assert slope == pytest.approx((ahead - behind) / (2 * small), abs=1e-5)
    bend = bending(framework, places, step, arm)
    assert bend == pytest.approx((ahead - 2 * here + behind) / small**2, abs=1e-5)
    second = step.ravel() @ (curvature(framework, places, here, arm) @ step.ravel())
    assert second == pytest.approx((here * bend).sum(), rel=1e-9)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 20))
def test_a_rigid_motion_changes_nothing(seed) -> None:
    rng = np.random.default_rng(seed)
    mesh = potato(seed)
    framework = framework_of(mesh, 0.01 * rng.standard_normal((len(mesh.faces), 3)))
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.standard_normal(3)
    still, moved = relaxed(framework, chained(framework)), relaxed(framework, motion @ chained(framework))
    one, other = (np.linalg.norm(f.gaps, axis=-1) for f in (still, moved))
    assert other == pytest.approx(one, abs=1e-5)


@pytest.mark.parametrize("first", [0, 5, 19])
def test_the_chain_may_begin_anywhere(first) -> None:
    framework = framework_of(icosahedron())
    assert largest(framework.gaps(chained(framework, first))) < 1e-9


def test_pieces_that_hang_on_nothing_are_named() -> None:
    two = TriMesh(
        np.vstack([tetrahedron().vertices, tetrahedron().vertices + 9]),
        np.vstack([tetrahedron().faces, tetrahedron().faces + 4]),
    )
    with pytest.raises(ValueError, match="4 of 8 pieces"):
        chained(framework_of(two))
