"""From the simplified mesh to classes: choose the solver, run it, tidy its answer."""

import numpy as np

from drkid.congruence.palette_solver import PaletteSolver
from drkid.congruence.pressure import PressureSolver
from drkid.congruence.softest_mode import rigidity
from drkid.congruence.solver import Solution, run
from drkid.congruence.triangle_space import ascending_lengths
from drkid.errors import SpecError
from drkid.kit import Decomposition, Rigidity
from drkid.mesh import Floats, TriMesh, read_only
from drkid.progress import Progress, silent
from drkid.spec import KitSpec

ISOSCELES_PERCENT = 0.1  # of the mean edge: below it no process prints two sides as different


def decompose(
    mesh: TriMesh, spec: KitSpec, progress: Progress = silent, surface: TriMesh | None = None
) -> Decomposition:
    """Decompose a closed mesh M_s into `spec.classes` classes of alike triangles.

    `spec.method` chooses the solver: the paper's `pressure` (algorithm 1), or the exact `palette`, which stays near
    `surface` (M_i; M_s where None). Classes come out without empty ones, ordered by their edge lengths; two lengths
    nearer than `ISOSCELES_PERCENT` are made equal, unless the tolerance would break. Where `spec.palette` gives lengths
    in mm, `scale_mm_per_unit` of the result makes the edges those, exactly.

    Raises:
        SpecError: more classes than faces, or classes that the solver cannot make of this mesh.
    """
    if spec.classes > len(mesh.faces):
        raise SpecError(
            f"{spec.classes} classes cannot be made of {len(mesh.faces)} faces",
            wanted="at most as many classes as faces",
            found=f"{spec.classes} classes, {len(mesh.faces)} faces",
            remedy="fewer --classes or more --faces",
        )
    if spec.method == "palette":
        solution = run(PaletteSolver(spec, mesh if surface is None else surface), mesh, progress)
    else:
        solution = run(PressureSolver(spec), mesh, progress)
    return _tidied(solution, spec)


def _tidied(solution: Solution, spec: KitSpec) -> Decomposition:
    best = solution.best
    points = ascending_lengths(best.mesh)
    used, labels = np.unique(best.face_class, return_inverse=True)
    exact = best.class_lengths[used]
    order = np.lexsort(exact.T[::-1])  # by the shortest side, then the middle one
    face_class = np.argsort(order)[labels.ravel()].astype(np.int64)
    lengths = _isosceles(exact[order], best.mesh.mean_edge)
    errors = np.linalg.norm(points - lengths[face_class], axis=1)
    tolerance_percent = spec.tolerance_for(len(best.mesh.faces))
    if 100 * errors.max() / best.mesh.mean_edge > tolerance_percent and solution.outcome.status == "converged":
        lengths = exact[order]
        errors = np.linalg.norm(points - lengths[face_class], axis=1)
    return Decomposition(
        mesh=best.mesh,
        face_class=read_only(face_class),
        class_lengths=read_only(lengths),
        face_errors=read_only(errors),
        iterations=solution.iterations,
        convergence=solution.convergence,
        outcome=solution.outcome,
        scale_mm_per_unit=_scale_mm_per_unit(solution, spec),
        rigidity=rigidity_of(best.mesh),
    )


def rigidity_of(mesh: TriMesh) -> Rigidity | None:
    """How stiff the shell is; None where the mesh is degenerate: its other figures stand without."""
    try:
        return rigidity(mesh)
    except np.linalg.LinAlgError:
        return None


def _scale_mm_per_unit(solution: Solution, spec: KitSpec) -> float | None:
    """The scale at which the solved lengths are those given; their ratios agree, for they were held."""
    solved = solution.best.palette_lengths
    return None if spec.palette is None or solved is None else spec.palette[0] / float(solved[0])


def _isosceles(lengths: Floats, mean_edge: float) -> Floats:
    """Class lengths (k, 3) in which two sides that nearly agree are equal: one mould then serves both hands."""
    snapped = lengths.copy()
    close = np.diff(lengths, axis=1) <= ISOSCELES_PERCENT / 100 * mean_edge
    for first in range(2):
        rows = close[:, first]
        snapped[rows, first : first + 2] = snapped[rows, first : first + 2].mean(axis=1, keepdims=True)
    rows = close.all(axis=1)
    snapped[rows] = lengths[rows].mean(axis=1, keepdims=True)
    return snapped
