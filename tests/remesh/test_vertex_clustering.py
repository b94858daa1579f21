import numpy as np
import pytest

from drkid.measure import distance_to_surface
from drkid.remesh.vertex_clustering import clustered


def test_few_triangles_stay_as_they_are(blob):
    assert clustered(blob, len(blob.faces)) is blob


@pytest.mark.parametrize("name", ["blob", "cup"])
def test_fewer_triangles_lie_where_many_did(request, name):
    mesh = request.getfixturevalue(name)
    count = len(mesh.faces) // 3
    found = clustered(mesh, count)
    assert 0.2 * count < len(found.faces) < 2 * count
    assert found.areas.sum() == pytest.approx(mesh.areas.sum(), rel=0.05)
    assert distance_to_surface(mesh, found.vertices).max() < np.sqrt(2 * mesh.areas.sum() / count)
