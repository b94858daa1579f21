"""From the surface to the simplified mesh: Voronoi cells, their dual, and what mends it where cells are no disks."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drkid.errors import RemeshError, SpecError
from drkid.intersection import self_intersections
from drkid.kit import Simplified, Surface
from drkid.measure import bend_radians, edge_spread, smallest_angle_degrees
from drkid.mesh import Floats, TriMesh
from drkid.progress import Progress, silent
from drkid.remesh.centroidal_voronoi import is_compiled, lloyd, quasi_newton
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.edge_collapse import collapse_to
from drkid.remesh.edge_flip import flip_towards_valence_six
from drkid.remesh.farthest_point import farthest_points
from drkid.remesh.midpoint_subdivision import subdivided
from drkid.remesh.offset_surface import offset_surface
from drkid.remesh.polish import polished
from drkid.remesh.sizing_field import SizingField, sizing_field
from drkid.remesh.surface_fit import surface_fit
from drkid.remesh.tangential_relaxation import relax
from drkid.remesh.vertex_clustering import clustered
from drkid.remesh.voronoi_dual import dual, is_twin, refined_dual
from drkid.spec import KitSpec

MOST_VERTICES = 50_000  # a hundred thousand pieces: nobody assembles more, and memory stays below a few GB
FINENESS = 10  # vertices of the surface for each one wanted: cells of its vertices then have shapes
CELL_TRIANGLES, FEWEST_TRIANGLES = 20, 6000  # for each cell and in all, that integrals over cells are taken on
EVENING = 6  # rounds of flips and relaxation after a collapse, which is uneven; later ones find no flip to make
RELAXATIONS = 3  # in each of these rounds
SLIVER_DEGREES = 12.0  # a face with a smaller angle is too narrow for a piece
FOLD_DEGREES = 130.0  # between the normals of neighbours: a little motion makes a sharper fold cut itself
FITTING, GLIDING = 1, 2  # which random numbers: those of the seeds are the first
UNEVEN = 0.2  # standard deviation of the edges over their mean, above which the user should hear of it


def simplify(surface: Surface, spec: KitSpec, progress: Progress = silent) -> Simplified:
    """M_s: a closed manifold mesh of exactly `spec.vertex_count(genus)` vertices, near the surface M_i.

    A centroidal Voronoi tessellation places the vertices and its dual joins them (Yan et al. 2009). Where cells are no
    disks, as on parts thinner than an edge, seeds are added until the dual is right, and edges collapsed down to the
    number again. Flips and least squares then make edges and valences even and halve the distance (`polish`): vertices
    lie outside where the surface is convex, so that faces do not cut off what is between. The mesh has the surface's
    genus, looks outward and is in one piece; the same seed gives the same mesh. `spec.adapt` makes edges shorter where
    the surface bends more, in every one of these steps.

    Raises:
        SpecError: there are too few vertices for the genus, or too many for a kit.
        RemeshError: the surface is not closed, or no such mesh was found.
    """
    _check_surface(surface.mesh)
    count = _checked_count(surface.mesh, spec)
    progress("spreading seeds" if is_compiled() else "compiling (once)", 0.0)
    domain = _domain(surface.mesh, count, spec.adapt)
    coarse, density, sizing = domain.triangles, domain.density, domain.sizing
    seeds = farthest_points(surface.mesh, count, np.random.default_rng(spec.seed), sizing)
    seeds, before = lloyd(coarse, seeds, spec.lloyd_iterations, density)
    seeds, after = quasi_newton(
        coarse,
        seeds,
        spec.newton_iterations,
        lambda done: progress("evening out cells", 0.1 + 0.5 * done / spec.newton_iterations),
        density,
    )
    progress("joining cells", 0.6)
    closest = ClosestPoint(surface.mesh)
    found = _best(closest, seeds, count, spec, sizing)
    progress("done", 1.0)
    return replace(found, energy=tuple(before + after), target=offset_surface(closest, found.mesh))


@dataclass(frozen=True, eq=False)
class _Domain:
    """What integrals over cells are taken on: `triangles`, their `density`; the lengths wanted. None: all the same."""

    triangles: TriMesh
    density: Floats | None = None
    sizing: SizingField | None = None


def _domain(surface: TriMesh, count: int, adapt: float) -> _Domain:
    triangles = max(FEWEST_TRIANGLES, CELL_TRIANGLES * count)
    if not adapt:
        return _Domain(clustered(surface, triangles))
    fine = subdivided(surface, FINENESS * count)
    sizing = sizing_field(fine, count, adapt)
    smallest = (sizing.length.mean() / sizing.length.min()) ** 2  # cells of the densest parts need their triangles too
    coarse = clustered(fine, int(smallest * triangles))
    return _Domain(coarse, sizing.density(coarse.corners.mean(axis=1)), sizing)


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


def _best(closest: ClosestPoint, seeds: Floats, count: int, spec: KitSpec, sizing: SizingField | None) -> Simplified:
    """The first mesh without flaws: cuts through itself, slivers and folds; or else the one that has least of them."""
    surface, reached = closest.surface, list[int]()
    fit = surface_fit(closest, count, np.random.default_rng([spec.seed, FITTING]), sizing)
    best: tuple[tuple[int, float], Simplified] | None = None
    for draft in _drafts(closest, seeds, count, spec, sizing):
        if len(draft.mesh.vertices) != count or not is_twin(draft.mesh, surface):
            reached.append(len(draft.mesh.vertices))
            continue
        evened = _evened(draft.mesh, closest, draft.rounds, sizing)
        for mesh in (polished(evened, fit, np.random.default_rng([spec.seed, GLIDING])), evened, draft.mesh):
            flaws = _flaws(mesh)
            if best is None or flaws < best[0]:
                best = flaws, Simplified(mesh, (), draft.notes + _unevenness(mesh, sizing, spec))
            if flaws == (0, 0):
                return best[1]
    if best is None:
        raise _hopeless(count, reached, surface)
    (cuts, _), found = best
    note = f"the simplified mesh cuts itself at {cuts} pairs of faces: more --faces, or a smoother surface, help"
    return replace(found, notes=(*found.notes, note)) if cuts else found


def _flaws(mesh: TriMesh) -> tuple[int, float]:
    """Pairs of faces that cut, and by how many degrees the narrowest corner or the sharpest fold is too sharp."""
    fold = float(np.degrees(np.abs(bend_radians(mesh)).max())) - FOLD_DEGREES
    return len(self_intersections(mesh)), max(0.0, SLIVER_DEGREES - smallest_angle_degrees(mesh), fold)


@dataclass(frozen=True, eq=False)
class _Draft:
    """A mesh on the surface, how many rounds of evening it deserves, and what the user should know of it."""

    mesh: TriMesh
    rounds: int
    notes: tuple[str, ...] = ()


def _drafts(
    closest: ClosestPoint, seeds: Floats, count: int, spec: KitSpec, sizing: SizingField | None
) -> Iterator[_Draft]:
    """Meshes of `count` vertices on the surface, or of more where it cannot be done; the most even first."""
    plain = dual(closest, seeds)
    if plain is not None:
        yield _Draft(plain, 0)
    fine = subdivided(closest.surface, FINENESS * count)
    refined = refined_dual(fine, seeds)
    needed = len(refined.vertices)
    note = (
        f"parts of the surface are thinner than an edge: {_faces(needed, refined.genus)} faces would follow it, "
        f"edges were collapsed to reach {_faces(count, refined.genus)}",
    )
    if needed >= count:  # two seeds may have gone to the same vertex
        yield _Draft(collapse_to(refined, count, sizing), EVENING, note if needed > count else ())
    rng = np.random.default_rng(spec.seed)
    for factor in (2, 4):
        denser = refined_dual(fine, farthest_points(fine, factor * count, rng, sizing))
        yield _Draft(collapse_to(denser, count, sizing), EVENING, note)
    yield _Draft(collapse_to(fine, count, sizing), EVENING, note)


def _evened(mesh: TriMesh, closest: ClosestPoint, rounds: int, sizing: SizingField | None) -> TriMesh:
    for _ in range(rounds):
        mesh, _ = flip_towards_valence_six(mesh)
        mesh = relax(mesh, closest, RELAXATIONS, sizing)
    return mesh


def _unevenness(mesh: TriMesh, sizing: SizingField | None, spec: KitSpec) -> tuple[str, ...]:
    spread = edge_spread(mesh)
    if sizing is not None:
        shortest, longest = mesh.edge_lengths.min() / mesh.mean_edge, mesh.edge_lengths.max() / mesh.mean_edge
        lost = "; the palette solver makes them two or three lengths again, --method pressure keeps more of it"
        return (
            f"edges of the simplified mesh are unequal on purpose (--adapt {spec.adapt:g}), shorter where the surface "
            f"bends more: {shortest:.2f} to {longest:.2f} of the mean, standard deviation {100 * spread:.0f} %"
            f"{lost if spec.method == 'palette' else ''}",
        )
    if spread <= UNEVEN:
        return ()
    return (f"edges are uneven (standard deviation {100 * spread:.0f} % of the mean); more faces help",)


def _hopeless(count: int, reached: list[int], surface: TriMesh) -> RemeshError:
    # A draft that has the vertices wanted, or fewer, was refused for its orientation: then just ask for some more.
    smallest = min((number for number in reached if number > count), default=2 * count)
    return RemeshError(
        f"no closed mesh of {count} vertices follows this surface",
        wanted=f"{count} vertices, {_faces(count, surface.genus)} faces, {surface.genus} handles",
        found=f"meshes of {', '.join(map(str, sorted(set(reached))))} vertices",
        remedy=f"--faces {_faces(smallest, surface.genus)} or more, or a smoother surface",
    )
