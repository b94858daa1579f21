"""What is foretold of the simplified mesh's distance comes true."""

import numpy as np
import pytest
from conftest import potato_of

from drkid import expected_distance
from drkid.errors import InputError
from drkid.expected_distance import ExpectedDistance, expected_distances, faces_for_distance
from drkid.kit import Source, Surface
from drkid.measure import hausdorff
from drkid.mesh import TriMesh
from drkid.remesh import simplify
from drkid.spec import KitSpec

MEAN_FACTOR, MAX_FACTOR = 1.25, 2.0  # between what is foretold and what a full remesh has


def body(mesh: TriMesh) -> Surface:
    return Surface(mesh, Source("made", "0" * 64))


def real(surface: Surface, faces: int):
    found = hausdorff(surface.mesh, simplify(surface, KitSpec(faces=faces)).mesh, np.random.default_rng(1))
    return 100 * found.mean / surface.mesh.diagonal, 100 * found.max / surface.mesh.diagonal


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.6)])
def test_the_table_is_borne_out_by_full_remeshes(stretch):
    surface = body(TriMesh(potato_of(4).vertices * stretch, potato_of(4).faces))
    table = {one.faces: one for one in expected_distances(surface, KitSpec())}
    means = [one.mean_percent for one in table.values()]
    assert means == sorted(means, reverse=True)
    for faces in (80, 260, 600):
        mean, most = real(surface, faces)
        assert mean / MEAN_FACTOR < table[faces].mean_percent < mean * MEAN_FACTOR
        assert most / MAX_FACTOR < table[faces].max_percent < most * MAX_FACTOR


@pytest.mark.parametrize("wanted", [0.4, 1.2])
def test_the_recommended_faces_keep_the_wanted_distance(wanted):
    surface = body(potato_of(4))
    found = faces_for_distance(surface, KitSpec(), wanted)
    assert found.faces % 2 == 0
    assert found.mean_percent <= wanted
    mean, _ = real(surface, found.faces)
    assert wanted / MEAN_FACTOR < mean < wanted * MEAN_FACTOR


def test_a_distance_out_of_reach_is_refused():
    with pytest.raises(InputError, match=r"within 1e-05 %.*about \d+ would be needed"):
        faces_for_distance(body(potato_of(3)), KitSpec(), 1e-5)


def test_what_cannot_be_remeshed_has_no_table(ring):
    two = TriMesh(np.concatenate([ring.vertices, ring.vertices + 9]), np.concatenate([ring.faces, ring.faces + 288]))
    assert expected_distances(body(two), KitSpec()) == ()


@pytest.mark.parametrize(("second", "rows"), [(0.4, 0), (0.3, 0), (0.2, 7)])
def test_a_distance_that_does_not_fall_with_the_faces_is_not_foretold(monkeypatch, ring, second, rows):
    means = {120: 0.3, 400: second}
    monkeypatch.setattr(
        expected_distance, "quick_distance", lambda _surface, _spec, faces: ExpectedDistance(faces, means[faces], 2.0)
    )
    assert len(expected_distances(body(ring), KitSpec())) == rows


@pytest.mark.parametrize("name", ["urocell_mito_bean.nii.gz", "asteroid_itokawa.obj"])
def test_it_comes_true_of_real_shapes(name, shared_data):
    from drkid.pipeline import read_surface  # noqa: PLC0415

    surface = read_surface(shared_data / name, KitSpec())
    table = {one.faces: one for one in expected_distances(surface, KitSpec())}
    for faces in (172, 600):
        mean, _ = real(surface, faces)
        assert mean / MEAN_FACTOR < table[faces].mean_percent < mean * MEAN_FACTOR
