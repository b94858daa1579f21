"""Annealing block by block: patches that cover the mesh, each with frozen surroundings, between sparse true solves.

The time grows with the number of patches, so about linearly with the faces; one dense model would need their cube.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import Freedom
from drkid.congruence.palette import Palette
from drkid.congruence.patch import LocalModel, Patch, annealed_patch, local_model, packing, put_back
from drkid.congruence.sparse_solve import (
    SparseLinearisation,
    sparse_exact,
    sparse_linearised,
    sparse_smoothness,
    sparse_solve,
)
from drkid.congruence.target import Target

START_WEIGHTS = (1.0, 0.6, 0.4, 0.25)
COLD_WEIGHTS, COLD_HEAT, COLD_STEPS = (0.18, 0.13), 1.0, 400  # after the start; going colder raised the errors again
EXACT_WEIGHTS, EXACT_ITERATIONS = (0.1, 0.03, 0.01), 6


@dataclass(frozen=True)
class Blocks:
    """How to anneal: damping μ, heat (first temperature, in typical prices), steps per edge of a patch's core.

    `core` and `moving` are a patch's numbers of vertices; every vertex is visited about `visits` times at a weight.
    """

    damping: float = 0.05
    heat: float = 3.0
    steps_per_edge: int = 800
    core: int = 50
    moving: int = 100
    visits: int = 2


def anneal_by_patches(  # noqa: PLR0913 — what is solved, how softly, and with what means
    frame: Framework,
    target: Target,
    palette: Palette,
    *,
    weight: float,
    freedom: Freedom,
    rng: np.random.Generator,
    blocks: Blocks | None = None,
    workers: int = 1,
) -> Framework:
    """One weight of the shape: rounds of disjoint patches until each vertex was in enough cores, then a true solve.

    The result depends on the generator's state alone, not on the number of workers.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    blocks = blocks or Blocks()
    visits = np.zeros(len(frame.mesh.vertices), np.int64)
    with ThreadPoolExecutor(workers) as pool:
        while visits.min() < blocks.visits:
            at = sparse_linearised(frame, target, weight, sparse_smoothness(frame.mesh))
            patches = packing(frame.mesh, blocks.core, blocks.moving, visits, rng)

            def work(
                patch: Patch, own: np.random.Generator, frame: Framework = frame, at: SparseLinearisation = at
            ) -> LocalModel:
                local = local_model(frame, at, patch, blocks.damping)
                return annealed_patch(
                    local, frame.lengths, palette.allowed.copy(), blocks.heat, blocks.steps_per_edge, own
                )

            frame = put_back(frame, list(pool.map(work, patches, rng.spawn(len(patches)))))
            for patch in patches:
                visits[patch.moving[: patch.core]] += 1
            frame, _ = sparse_solve(frame, target, weight, freedom, 1)
    return sparse_solve(frame, target, weight, freedom, 3)[0]


def sparse_start(
    frame: Framework,
    target: Target,
    palette: Palette,
    freedom: Freedom,
    rng: np.random.Generator,
    blocks: Blocks | None = None,
    workers: int = 1,
) -> Framework:
    """From first labels to a soft framework, at falling weights of the shape, the ratio of the lengths held.

    A last cold phase lowers the edge errors that the true solve then leaves, at some cost of closeness.
    """
    held: Freedom = "none" if freedom == "none" else "scale"
    warm = blocks or Blocks()
    cold = replace(warm, heat=COLD_HEAT, steps_per_edge=min(COLD_STEPS, warm.steps_per_edge))
    for weight in START_WEIGHTS + COLD_WEIGHTS:
        how = cold if weight in COLD_WEIGHTS else warm
        frame = anneal_by_patches(
            frame, target, palette, weight=weight, freedom=held, rng=rng, blocks=how, workers=workers
        )
    return frame


def sparse_exactly(frame: Framework, target: Target, freedom: Freedom, *, square: bool = True) -> Framework:
    """Levenberg–Marquardt at falling weights, then Newton where the system is square (genus 0)."""
    for weight in EXACT_WEIGHTS:
        frame, _ = sparse_solve(frame, target, weight, freedom, EXACT_ITERATIONS)
    return sparse_exact(frame, freedom) if square else frame
