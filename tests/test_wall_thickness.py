"""Walls: how thick, and whether pieces are small enough for them."""

import re
from functools import cache

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.errors import InputError
from drkid.kit import Source, Surface
from drkid.mesh import TriMesh
from drkid.pipeline import make_kit, read_surface
from drkid.remesh import simplify
from drkid.solid import Solid
from drkid.spec import KitSpec
from drkid.wall_thickness import even_edge, faces_that_resolve, require_walls, thinnest_wall_mm, wall_thickness


@cache
def plate(thickness: float, bend: float = 0.0) -> TriMesh:
    """20 × 20 and thin, finely meshed; bent to a wave of an amplitude."""
    box = trimesh.creation.box((20, 20, thickness)).subdivide_to_size(2.0)
    vertices = np.array(box.vertices)
    vertices[:, 2] += bend * np.sin(vertices[:, 0] / 3)
    mesh = trimesh.Trimesh(vertices, box.faces)
    return TriMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def test_a_plate_is_as_thick_as_it_is(potato):
    found = wall_thickness(plate(3.0))
    assert np.median(found) == pytest.approx(3.0)
    assert np.isfinite(wall_thickness(potato)).mean() > 0.5


@settings(max_examples=4)
@given(st.floats(0.01, 100))
def test_the_verdict_does_not_depend_on_the_unit(scale):
    for mesh, fits in ((plate(3.0), True), (plate(0.5), False)):
        if fits:
            assert require_walls(mesh.scaled(scale), 172) == require_walls(mesh, 172)
        else:
            with pytest.raises(InputError, match="too thin for 172 pieces"):
                require_walls(mesh.scaled(scale), 172)


def test_the_faces_that_are_named_resolve_it():
    sheet = plate(0.6, bend=2.0)
    with pytest.raises(InputError) as caught:
        require_walls(sheet, 100)
    named = re.search(r"--faces (\d+) or more", str(caught.value))
    assert named is not None
    require_walls(sheet, int(named[1]))
    with pytest.raises(InputError):
        require_walls(sheet, int(named[1]) - 20)
    spec = KitSpec(faces=int(named[1]), lloyd_iterations=1, newton_iterations=1)
    simplified = simplify(Surface(sheet, Source("sheet", "0" * 64)), spec).mesh
    assert simplified.is_closed_manifold


def test_absurdly_many_faces_are_called_a_sheet():
    with pytest.raises(InputError, match=r"a sheet, not a body"):
        require_walls(plate(0.1), 172)


def test_what_is_thin_in_places_is_told_with_the_faces_that_help():
    (note,) = require_walls(plate(1.6), 172)
    found = re.match(r"(\d+) % of the surface .* (\d+) faces would resolve", note)
    assert found is not None
    assert int(found[1]) > 50
    assert require_walls(plate(1.6), int(found[2])) == ()


def test_faces_and_edges_are_inverse():
    for thickness in (0.1, 2.0, 8.0):
        faces = faces_that_resolve(500.0, thickness, 0.5)
        assert even_edge(500.0, faces) * 0.5 <= thickness < even_edge(500.0, faces - 2) * 0.5


def test_make_refuses_a_sheet_before_it_works(tmp_path):
    mesh = plate(0.5)
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / "sheet.stl")
    with pytest.raises(InputError, match="too thin for 172 pieces"):
        make_kit(tmp_path / "sheet.stl", KitSpec())


# ---- real shapes


@pytest.mark.parametrize(
    "name",
    [
        "urocell_mito_bean.nii.gz",
        "urocell_mito_elongated.nii.gz",
        "golgi_vesicle.mrc",
        "emdb_soft_mask.map",
        "celegans_embryo_cell.ply",
        "asteroid_itokawa.obj",
        "spot_uv_seams.obj",
        "urocell_mito_branched.nii.gz",
        "urocell_mito_genus3.nii.gz",
        "emd_1832_density.map",
        "torus_genus1.stl",
    ],
)
def test_bodies_are_not_refused(name, shared_data):
    mesh = read_surface(shared_data / name, KitSpec(smooth=False)).mesh
    for faces in (120, 172, 500):
        require_walls(mesh, faces)


def test_the_sheet_is_refused_with_the_faces_that_would_resolve_it(shared_data):
    mesh = read_surface(shared_data / "er_thin_sheet.mrc.gz", KitSpec(smooth=False)).mesh
    with pytest.raises(InputError, match=r"too thin for 172 pieces.*found: 9\d % .*faces"):
        require_walls(mesh, 172)


def block() -> Solid:
    return Solid.box((0, 0, 0), (30, 20, 6))


@pytest.mark.parametrize(
    ("boxes", "thinnest"),
    [
        ([((5, 5, 1), (9, 9, 7))], 1.0),
        ([((5, -1, -1), (6, 19, 7)), ((7, 1, -1), (8, 21, 7))], 1.0),
        ([((0.7, 5, 5), (40, 9, 7))], 0.7),
    ],
    ids=["floor", "between", "a millimetre high"],
)
def test_the_thinnest_wall_of_a_part_is_found_wherever_it_is(boxes, thinnest):
    mesh = block().minus_all([Solid.box(*box) for box in boxes]).mesh()
    assert thinnest_wall_mm(mesh) == pytest.approx(thinnest, abs=1e-4)


def test_an_edge_is_no_wall():
    wedge = Solid.hull([(0, 0, 0), (0, 0, 9), (12, 0, 0), (0, 30, 0), (0, 30, 9), (12, 30, 0)])
    assert thinnest_wall_mm(wedge.mesh()) == pytest.approx(30.0, abs=1e-3)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_ribs_between_strokes_are_no_walls_where_they_are_no_higher_than_marks_are_deep(tilt):
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    strokes = [Solid.box((x, 5, 5.6), (x + 0.8, 15, 7)) for x in (5, 6.2)]
    mesh = block().minus_all(strokes).moved(turn).mesh()
    assert thinnest_wall_mm(mesh) == pytest.approx(0.4, abs=1e-4)
    assert thinnest_wall_mm(mesh, rib_mm=0.3) == pytest.approx(0.4, abs=1e-4)
    assert thinnest_wall_mm(mesh, rib_mm=0.4) == pytest.approx(5.6, abs=1e-4)
