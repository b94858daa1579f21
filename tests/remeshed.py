"""What is asked of every simplified mesh."""

from drkid.intersection import self_intersections
from drkid.kit import Source, Surface
from drkid.measure import distance_to_surface
from drkid.mesh import TriMesh


def surface_of(mesh: TriMesh) -> Surface:
    return Surface(mesh, Source("made", ""))


def check(mesh: TriMesh, source: TriMesh, count: int) -> None:
    """Of exactly so many vertices, closed, in one piece, of the source's genus, near it, without cuts."""
    assert len(mesh.vertices) == count
    assert mesh.is_closed_manifold
    assert mesh.component_count == 1
    assert mesh.genus == source.genus
    assert mesh.volume > 0
    assert distance_to_surface(source, mesh.vertices).max() < 0.5 * mesh.mean_edge
    assert len(self_intersections(mesh)) == 0
