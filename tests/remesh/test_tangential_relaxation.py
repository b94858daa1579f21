import numpy as np
import pytest

from drkid.measure import bend_radians, distance_to_surface, edge_spread
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.edge_collapse import collapse_to
from drkid.remesh.tangential_relaxation import relax


@pytest.mark.parametrize("name", ["blob", "ring", "cup"])
def test_edges_come_out_more_even_and_vertices_stay_on_the_surface(request, name):
    mesh = request.getfixturevalue(name)
    rough = collapse_to(mesh, 150)
    found = relax(rough, ClosestPoint(mesh), 10)
    assert edge_spread(found) < 0.8 * edge_spread(rough)
    assert distance_to_surface(mesh, found.vertices).max() < 1e-9
    assert np.array_equal(found.faces, rough.faces)
    assert found.volume > 0


def test_thin_walls_do_not_swap_sides(fine_box):
    thin = fine_box.moved(fine_box.vertices * [1.0, 1.0, 0.05])
    rough = collapse_to(thin, 60)
    found = relax(rough, ClosestPoint(thin), 20)
    assert found.volume > 0.5 * rough.volume
    assert np.abs(bend_radians(found)).max() <= max(np.abs(bend_radians(rough)).max(), np.arccos(-0.3)) + 1e-9


def test_no_round_changes_nothing(blob):
    rough = collapse_to(blob, 50)
    assert np.array_equal(relax(rough, ClosestPoint(blob), 0).vertices, rough.vertices)
