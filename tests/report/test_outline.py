import numpy as np
import pytest
import trimesh

from drkid.mesh import TriMesh
from drkid.report.outline import creases, outline


def mesh_of(solid: trimesh.Trimesh) -> TriMesh:
    return TriMesh(np.asarray(solid.vertices), np.asarray(solid.faces))


def test_all_edges_of_a_box_are_drawn() -> None:
    polygons = outline(mesh_of(trimesh.creation.box((2, 3, 4))))
    assert sorted(map(len, polygons)) == [4] * 6
    assert all(drawn.all() for drawn in creases(polygons))


@pytest.mark.parametrize("subdivisions", [2, 4])
def test_a_smooth_body_is_few_polygons_without_creases(subdivisions) -> None:
    polygons = outline(mesh_of(trimesh.creation.icosphere(subdivisions)))
    assert len(polygons) < 500
    assert not any(drawn.any() for drawn in creases(polygons) if subdivisions == 2)


def test_the_rims_of_a_cylinder_are_drawn_and_its_facets_not() -> None:
    polygons = outline(mesh_of(trimesh.creation.cylinder(1.0, 2.0, sections=18)))
    drawn = [int(d.sum()) for d in creases(polygons)]
    assert sorted(map(len, polygons)) == [4] * 18 + [18] * 2
    assert sorted(drawn) == [2] * 18 + [18] * 2
