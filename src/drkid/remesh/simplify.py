"""From the surface to the simplified mesh: Voronoi cells, their dual, and what mends it where cells are no disks."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drkid.errors import RemeshError, SpecError
from drkid.intersection import self_intersections
from drkid.kit import Simplified, Surface
from drkid.measure import edge_spread
from drkid.mesh import Floats, TriMesh
from drkid.progress import Progress, silent
from drkid.remesh.centroidal_voronoi import lloyd, quasi_newton
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.edge_collapse import collapse_to
from drkid.remesh.edge_flip import flip_towards_valence_six
from drkid.remesh.farthest_point import farthest_points
from drkid.remesh.midpoint_subdivision import subdivided
from drkid.remesh.tangential_relaxation import relax
from drkid.remesh.voronoi_dual import dual, is_twin, refined_dual
from drkid.spec import KitSpec

MOST_VERTICES = 50_000  # a hundred thousand pieces: nobody assembles more, and memory stays below a few GB
FINENESS = 10  # vertices of the surface for each one wanted: cells of its vertices then have shapes
EVENING_ROUNDS = 6  # of flips and relaxation in turn; later ones find no flip to make
RELAXATIONS = 3  # in each of these rounds
UNEVEN = 0.2  # standard deviation of the edges over their mean, above which the user should hear of it


def simplify(surface: Surface, spec: KitSpec, progress: Progress = silent) -> Simplified:
    """M_s: a closed manifold mesh of exactly `spec.vertex_count(genus)` vertices, which lie on the surface M_i.

    A centroidal Voronoi tessellation places the vertices and its dual joins them (Yan et al. 2009); flips and
    relaxation even edges and valences out (Botsch and Kobbelt 2004). Where cells are no disks, as on parts thinner than
    an edge, seeds are added until the dual is right, and edges collapsed down to the number again. The mesh has the
    surface's genus, looks outward and is in one piece; the same seed gives the same mesh.

    Raises:
        SpecError: there are too few vertices for the genus, or too many for a kit.
        RemeshError: the surface is not closed, or no such mesh was found.
    """
    _check_surface(surface.mesh)
    count = _checked_count(surface.mesh, spec)
    progress("spreading seeds", 0.0)
    seeds = farthest_points(surface.mesh, count, np.random.default_rng(spec.seed))
    seeds, before = lloyd(surface.mesh, seeds, spec.lloyd_iterations)
    seeds, after = quasi_newton(
        surface.mesh,
        seeds,
        spec.newton_iterations,
        lambda done: progress("evening out cells", 0.1 + 0.7 * done / spec.newton_iterations),
    )
    progress("joining cells", 0.8)
    found = _best(surface.mesh, seeds, count, spec)
    progress("done", 1.0)
    return replace(found, energy=tuple(before + after))


def _check_surface(mesh: TriMesh) -> None:
    if mesh.is_closed_manifold and mesh.component_count == 1 and mesh.volume > 0:
        return
    raise RemeshError(
        "the surface cannot be remeshed",
        wanted="one closed manifold that looks outward",
        found=f"{mesh.open_edges} open edges, {mesh.pinched_vertices} pinched vertices, "
        f"{mesh.component_count} components, volume {mesh.volume:.3g}",
        remedy="repair the mesh first",
    )


def _checked_count(mesh: TriMesh, spec: KitSpec) -> int:
    count, genus = spec.vertex_count(mesh.genus), mesh.genus
    least = fewest_vertices(genus)
    if count < least:
        raise SpecError(
            f"{count} vertices cannot make a surface with {genus} handles",
            wanted=f"at least {least} vertices, {_faces(least, genus)} faces",
            found=f"{count} vertices, {_faces(count, genus)} faces",
            remedy=f"--faces {_faces(4 * least, genus)} or more: each handle needs room for a ring of pieces",
        )
    if count > MOST_VERTICES:
        raise SpecError(
            f"{count} vertices are too many",
            wanted=f"at most {MOST_VERTICES} vertices, {_faces(MOST_VERTICES, genus)} faces",
            found=f"{count} vertices, {_faces(count, genus)} faces",
            remedy="fewer --faces",
        )
    return count


def fewest_vertices(genus: int) -> int:
    """The least number of vertices of any triangulated closed surface of this genus (Jungerman and Ringel 1980)."""
    return 10 if genus == 2 else int(np.ceil((7 + np.sqrt(1 + 48 * genus)) / 2))


def _faces(vertices: int, genus: int) -> int:
    return 2 * vertices - 4 + 4 * genus


def _best(surface: TriMesh, seeds: Floats, count: int, spec: KitSpec) -> Simplified:
    """The first mesh that does not cut itself, or else the one that does so least."""
    closest, fewest = ClosestPoint(surface), None
    stuck = []
    for draft, notes in _drafts(closest, seeds, count, spec):
        if len(draft.vertices) != count or not is_twin(draft, surface):
            stuck.append(len(draft.vertices))
            continue
        for mesh in (_evened(draft, closest), draft):
            cuts = len(self_intersections(mesh))
            if cuts == 0:
                return Simplified(mesh, (), notes + _unevenness(mesh))
            if fewest is None or cuts < fewest[0]:
                fewest = cuts, mesh, notes
    if fewest is None:
        raise _hopeless(count, stuck, surface)
    cuts, mesh, notes = fewest
    cut = f"the simplified mesh cuts itself at {cuts} pairs of faces: more --faces, or a smoother surface, help"
    return Simplified(mesh, (), (*notes, cut, *_unevenness(mesh)))


def _drafts(
    closest: ClosestPoint, seeds: Floats, count: int, spec: KitSpec
) -> Iterator[tuple[TriMesh, tuple[str, ...]]]:
    """Meshes of `count` vertices on the surface, if it can be done at all, the most even first, and what to say."""
    plain = dual(closest, seeds)
    if plain is not None:
        yield plain, ()
    fine = subdivided(closest.surface, FINENESS * count)
    refined = refined_dual(fine, seeds)
    note = (
        f"parts of the surface are thinner than an edge: {_faces(len(refined.vertices), refined.genus)} faces "
        f"would follow it, edges were collapsed to reach {_faces(count, refined.genus)}",
    )
    yield collapse_to(refined, count), note
    rng = np.random.default_rng(spec.seed)
    for factor in (2, 4):
        yield collapse_to(refined_dual(fine, farthest_points(fine, factor * count, rng)), count), note
    yield collapse_to(fine, count), note


def _evened(mesh: TriMesh, closest: ClosestPoint) -> TriMesh:
    for _ in range(EVENING_ROUNDS):
        mesh, _ = flip_towards_valence_six(mesh)
        mesh = relax(mesh, closest, RELAXATIONS)
    return mesh


def _unevenness(mesh: TriMesh) -> tuple[str, ...]:
    spread = edge_spread(mesh)
    if spread <= UNEVEN:
        return ()
    return (f"edges are uneven (standard deviation {100 * spread:.0f} % of the mean); more faces help",)


def _hopeless(count: int, stuck: list[int], surface: TriMesh) -> RemeshError:
    smallest = min(stuck)
    return RemeshError(
        f"no closed mesh of {count} vertices follows this surface",
        wanted=f"{count} vertices, {_faces(count, surface.genus)} faces, {surface.genus} handles",
        found=f"{smallest} vertices, {_faces(smallest, surface.genus)} faces at least",
        remedy=f"--faces {_faces(smallest, surface.genus)} or more, or a smoother surface",
    )
