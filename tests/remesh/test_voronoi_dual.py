import numpy as np
import pytest

from drkid.measure import distance_to_surface, sample
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.midpoint_subdivision import subdivided
from drkid.remesh.voronoi_dual import dual, is_twin, nerve, refined_dual


@pytest.mark.parametrize("name", ["blob", "ring"])
def test_the_dual_of_enough_seeds_is_the_surfaces_twin(request, name):
    mesh = request.getfixturevalue(name)
    seeds = sample(mesh, 400, np.random.default_rng(0))
    found = dual(ClosestPoint(mesh), seeds)
    assert found is not None
    assert len(found.vertices) == 400
    assert is_twin(found, mesh)
    assert distance_to_surface(mesh, found.vertices).max() < 1e-12


def test_the_dual_of_too_few_seeds_is_refused(thin_ring):
    assert dual(ClosestPoint(thin_ring), sample(thin_ring, 40, np.random.default_rng(0))) is None


def test_a_seed_without_a_cell_is_refused(blob):
    seeds = np.concatenate([sample(blob, 100, np.random.default_rng(0)), [[9.0, 9.0, 9.0]]])
    assert dual(ClosestPoint(blob), seeds[:-1]) is not None
    assert dual(ClosestPoint(blob), seeds) is None


def test_single_vertices_have_the_mesh_itself_as_nerve(ring):
    found = nerve(ring, np.arange(len(ring.vertices)))
    assert not len(found.broken)
    assert np.array_equal(found.triangles, ring.faces)


def test_bands_of_a_ring_are_broken(ring):
    angle = np.arctan2(ring.vertices[:, 1], ring.vertices[:, 0])
    found = nerve(ring, np.minimum(((angle + np.pi) / (2 * np.pi) * 4).astype(np.int64), 3))
    assert found.broken.tolist() == [0, 1, 2, 3]


def test_a_cell_in_two_pieces_is_broken(blob):
    cell = (blob.vertices[:, 0] > 0).astype(np.int64)
    cell[np.argmax(blob.vertices[:, 0])] = 0
    assert 0 in nerve(blob, cell).broken


def test_cells_that_meet_twice_are_broken(blob):
    # Two halves and a cap at each end of their border: each a disk, but the halves meet on both sides.
    x, y = blob.vertices[:, 0], blob.vertices[:, 1]
    cell = np.where(x > 0.9, 2, np.where(x < -0.9, 3, (y > 0).astype(np.int64)))
    assert {0, 1} <= set(nerve(blob, cell).broken.tolist())


@pytest.mark.parametrize("name", ["thin_ring", "cup", "fine_box"])
def test_seeds_are_added_until_the_dual_is_right(request, name):
    mesh = request.getfixturevalue(name)
    fine = subdivided(mesh, 1500)
    found = refined_dual(fine, sample(mesh, 8, np.random.default_rng(0)))
    assert is_twin(found, mesh)
    assert 8 < len(found.vertices) < len(fine.vertices)
    assert np.isin(found.vertices, fine.vertices).all()


def test_a_surface_too_coarse_for_its_cells_is_its_own_dual(box):
    assert len(refined_dual(box, box.vertices[:2]).vertices) <= len(box.vertices)
    assert is_twin(refined_dual(box, box.vertices[:2]), box)
