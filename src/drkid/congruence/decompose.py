"""From the simplified mesh to classes: choose the solver, run it, tidy its answer."""

import numpy as np

from drkid.congruence.pressure import PressureSolver
from drkid.congruence.solver import Solution, run
from drkid.congruence.triangle_space import ascending_lengths, class_means
from drkid.errors import SpecError
from drkid.kit import Decomposition
from drkid.mesh import TriMesh, read_only
from drkid.progress import Progress, silent
from drkid.spec import KitSpec


def decompose(mesh: TriMesh, spec: KitSpec, progress: Progress = silent) -> Decomposition:
    """Decompose a closed mesh M_s into `spec.classes` classes of alike triangles (the paper, algorithm 1).

    Classes come out without empty ones, ordered by their edge lengths, and their lengths are their members' means.

    Raises:
        SpecError: more classes than faces, or a solver that this version does not have.
    """
    if spec.classes > len(mesh.faces):
        raise SpecError(
            f"{spec.classes} classes cannot be made of {len(mesh.faces)} faces",
            wanted="at most as many classes as faces",
            found=f"{spec.classes} classes, {len(mesh.faces)} faces",
            remedy="fewer --classes or more --faces",
        )
    if spec.method != "pressure":
        raise SpecError(
            f"the {spec.method} solver is not part of this version",
            wanted="a solver that is",
            found=spec.method,
            remedy="--method pressure",
        )
    solution = run(PressureSolver(spec), mesh, progress)
    return _tidied(solution)


def _tidied(solution: Solution) -> Decomposition:
    best = solution.best
    points = ascending_lengths(best.mesh)
    used, labels = np.unique(best.face_class, return_inverse=True)
    means = class_means(points, labels.ravel(), len(used))
    order = np.lexsort(means.T[::-1])  # by the shortest side, then the middle one
    rank = np.argsort(order)
    face_class = rank[labels.ravel()].astype(np.int64)
    lengths = means[order]
    return Decomposition(
        mesh=best.mesh,
        face_class=read_only(face_class),
        class_lengths=read_only(lengths),
        face_errors=read_only(np.linalg.norm(points - lengths[face_class], axis=1)),
        iterations=solution.iterations,
        convergence=solution.convergence,
        outcome=solution.outcome,
    )
