from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from drkid.errors import RemeshError
from drkid.measure import sample
from drkid.mesh import TriMesh
from drkid.remesh.centroidal_voronoi import CHUNK, energy_and_gradient, lloyd, quasi_newton, tessellate
from drkid.remesh.midpoint_subdivision import subdivided


def seeds_on(mesh, count, seed=0):
    return sample(mesh, count, np.random.default_rng(seed))


@pytest.mark.parametrize("count", [2, 3, 30, 700])
@pytest.mark.parametrize("name", ["blob", "box", "thin_ring"])
def test_cells_share_the_surface_out(request, name, count):
    mesh = request.getfixturevalue(name)
    cells = tessellate(mesh, seeds_on(mesh, count))
    assert cells.mass.sum() == pytest.approx(mesh.areas.sum(), rel=1e-12)
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    moment = (mesh.areas[:, None] * (a + b + c) / 3).sum(axis=0)
    assert np.allclose(cells.moment.sum(axis=0), moment, atol=1e-10 * mesh.areas.sum())


def test_area_and_energy_agree_with_a_sample_of_nearest_seeds(blob):
    seeds = seeds_on(blob, 25)
    cells = tessellate(blob, seeds)
    away, cell = cKDTree(seeds).query(sample(blob, 200_000, np.random.default_rng(1)))
    share = np.bincount(cell, minlength=25) / 200_000
    assert np.allclose(cells.mass / blob.areas.sum(), share, atol=2e-3)
    assert cells.energy.sum() == pytest.approx((away**2).mean() * blob.areas.sum(), rel=0.01)


def test_a_seed_far_away_has_no_cell_and_stays(blob):
    seeds = np.concatenate([seeds_on(blob, 20), [[50.0, 0.0, 0.0]]])
    cells = tessellate(blob, seeds)
    assert cells.mass.sum() == pytest.approx(blob.areas.sum())
    assert cells.mass[-1] == 0
    moved, _ = lloyd(blob, seeds, 1)
    assert np.array_equal(moved[-1], seeds[-1])


def test_many_seeds_at_one_spot_need_more_neighbours_than_usual(blob):
    crowd = blob.vertices[7] + 1e-3 * np.random.default_rng(0).normal(size=(60, 3))
    cells = tessellate(blob, np.concatenate([crowd, seeds_on(blob, 10)]))
    assert cells.mass.sum() == pytest.approx(blob.areas.sum(), rel=1e-12)


def test_a_cell_of_too_many_corners_is_refused(box):
    angle = np.arange(100) * 2 * np.pi / 100
    top = box.vertices[:, 2].max()
    ring = np.column_stack([0.3 + 0.1 * np.cos(angle), 0.6 + 0.1 * np.sin(angle), np.full(100, top)])
    with pytest.raises(RemeshError, match="too unevenly"):
        tessellate(box, np.concatenate([ring, [[0.3, 0.6, top]]]))


@pytest.mark.parametrize("guess", [True, False])
def test_threads_change_no_bit_of_the_cells(blob, guess):
    fine = subdivided(blob, 2 * CHUNK)
    seeds = seeds_on(fine, 300)
    first = tessellate(fine, seeds).first if guess else None
    one, two, four = (tessellate(fine, seeds + 1e-3, first, threads=threads) for threads in (1, 2, 4))
    assert len(fine.faces) > 2 * CHUNK
    for other in (two, four):
        assert all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


def test_chunks_change_the_sums_by_rounding_alone(blob):
    fine = subdivided(blob, 2 * CHUNK)
    seeds = seeds_on(fine, 300)
    parts = [tessellate(fine.submesh(part), seeds) for part in np.array_split(np.arange(len(fine.faces)), 7)]
    cells = tessellate(fine, seeds)
    assert np.allclose(sum(part.mass for part in parts), cells.mass, rtol=1e-12)
    assert np.allclose(sum(part.energy for part in parts), cells.energy, rtol=1e-12)
    assert np.array_equal(cells.first, cKDTree(seeds).query(fine.middles)[1])


@given(st.integers(0, 1000))
def test_the_gradient_is_that_of_finite_differences(potato, seed):
    rng = np.random.default_rng(seed)
    seeds = sample(potato, 12, rng)
    direction = rng.normal(size=seeds.shape)
    step = 1e-5
    ahead, behind = (energy_and_gradient(potato, seeds + s * direction)[0] for s in (step, -step))
    slope = (energy_and_gradient(potato, seeds)[1] * direction).sum()
    assert (ahead - behind) / (2 * step) == pytest.approx(slope, rel=1e-3, abs=1e-5)


@given(st.integers(0, 1000))
def test_lloyd_never_raises_the_energy(potato, seed):
    seeds, history = lloyd(potato, seeds_on(potato, 20, seed), 8)
    history.append(energy_and_gradient(potato, seeds)[0])
    assert all(after <= before * (1 + 1e-12) for before, after in pairwise(history))


def test_the_quasi_newton_steps_go_below_lloyds(blob):
    heard = []
    start, _ = lloyd(blob, seeds_on(blob, 60), 5)
    _, slow = lloyd(blob, start, 31)
    seeds, fast = quasi_newton(blob, start, 30, heard.append)
    assert fast[0] == pytest.approx(slow[0])
    assert fast[-1] < slow[-1]
    assert all(after <= before for before, after in pairwise(fast))
    assert energy_and_gradient(blob, seeds)[0] == pytest.approx(fast[-1])
    assert heard == list(range(1, 31))


def test_no_quasi_newton_step_changes_nothing(blob):
    start = seeds_on(blob, 10)
    seeds, history = quasi_newton(blob, start, 0, lambda _: None)
    assert np.array_equal(seeds, start)
    assert history == [energy_and_gradient(blob, start)[0]]


@given(st.floats(1e-6, 1e6), st.integers(0, 99))
def test_motion_and_scale_carry_the_cells_with_them(potato, scale, seed):
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    seeds = seeds_on(potato, 15)
    before = tessellate(potato, seeds)
    after = tessellate(TriMesh(potato.vertices @ turn.T * scale, potato.faces), seeds @ turn.T * scale)
    assert np.allclose(after.mass, before.mass * scale**2, rtol=1e-9)
    assert np.allclose(after.energy, before.energy * scale**4, rtol=1e-9)
    assert np.allclose(after.moment, before.moment @ turn.T * scale**3, rtol=0, atol=1e-9 * scale**3)
