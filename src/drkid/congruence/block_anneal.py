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
from drkid.congruence.penalty import within_tolerance
from drkid.congruence.sparse_solve import (
    SparseLinearisation,
    sparse_exact,
    sparse_linearised,
    sparse_smoothness,
    sparse_solve,
)
from drkid.congruence.target import Target

BETA_OF_LARGE = 3.0  # of K: small triangles lie flat on the surface, where smoothness is scarcer than closeness
START_WEIGHTS = (0.5, 0.3, 0.2, 0.125)
COLD_WEIGHTS, COLD_HEAT, COLD_STEPS = (0.09, 0.065), 1.0, 400  # after the start; going colder raised the errors again
EXACT_WEIGHTS, EXACT_ITERATIONS = (0.035, 0.015), 6
HOP_WEIGHT, HOP_HEAT = (0.05, 0.1), (0.02, 0.05)
PENALTY_WEIGHT = 0.05
TOLERANCE = 0.009  # of the mean length: the largest error then ends below one percent
EXACT = 1e-9  # largest edge error, of the mean length
ROUNDS = len(START_WEIGHTS) + len(COLD_WEIGHTS)


@dataclass(frozen=True)
class Blocks:
    """How to anneal: damping μ, heat (first temperature, in typical prices), steps per edge of a patch's core.

    `core` and `moving` are a patch's numbers of vertices; at a weight there are so many `packings` of disjoint patches,
    each of which visits about core / moving of the vertices; `workers` anneal them at the same time.
    """

    damping: float = 0.05
    heat: float = 3.0
    steps_per_edge: int = 800
    core: int = 60
    moving: int = 100
    packings: int = 6
    workers: int = 1


START_BLOCKS, HOP_BLOCKS = Blocks(), Blocks(steps_per_edge=200, packings=3)


def anneal_by_patches(
    frame: Framework,
    target: Target,
    palette: Palette,
    *,
    weight: float,
    freedom: Freedom,
    rng: np.random.Generator,
    blocks: Blocks = START_BLOCKS,
) -> Framework:
    """One weight of the shape: packings of disjoint patches, the least visited vertices first, each with a true solve.

    The result depends on the generator's state alone, not on the number of workers.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    visits = np.zeros(len(frame.mesh.vertices), np.int64)
    with ThreadPoolExecutor(blocks.workers) as pool:
        for _ in range(blocks.packings):
            at = sparse_linearised(frame, target, weight, sparse_smoothness(frame.mesh, BETA_OF_LARGE))
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
            frame, _ = sparse_solve(frame, target, weight, freedom, 1, beta=BETA_OF_LARGE)
    return sparse_solve(frame, target, weight, freedom, 3, beta=BETA_OF_LARGE)[0]


def sparse_round(
    frame: Framework,
    number: int,
    target: Target,
    palette: Palette,
    freedom: Freedom,
    rng: np.random.Generator,
    blocks: Blocks = START_BLOCKS,
) -> Framework:
    """Round `number` of `ROUNDS` of a start: one weight of the shape, the ratio of the lengths held.

    The last rounds are cold: they lower the edge errors that the true solve then leaves, at some cost of closeness.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    held: Freedom = "none" if freedom == "none" else "scale"
    how, weight = blocks, (START_WEIGHTS + COLD_WEIGHTS)[number]
    if number >= len(START_WEIGHTS):
        how = replace(how, heat=COLD_HEAT, steps_per_edge=min(COLD_STEPS, how.steps_per_edge))
    return anneal_by_patches(frame, target, palette, weight=weight, freedom=held, rng=rng, blocks=how)


def sparse_hop(
    frame: Framework,
    target: Target,
    palette: Palette,
    freedom: Freedom,
    rng: np.random.Generator,
    blocks: Blocks = HOP_BLOCKS,
) -> Framework:
    """Soften a solved framework and anneal it gently: `sparse_exactly` of it is another one nearby, often a smoother.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    weight, heat = (float(np.exp(rng.uniform(*np.log(limits)))) for limits in (HOP_WEIGHT, HOP_HEAT))
    soft, _ = sparse_solve(frame, target, weight, freedom, 2, beta=BETA_OF_LARGE)
    how = replace(blocks, heat=heat)
    return anneal_by_patches(soft, target, palette, weight=weight, freedom=freedom, rng=rng, blocks=how)


def sparse_exactly(
    frame: Framework, target: Target, freedom: Freedom, *, square: bool = True, tolerance: float = TOLERANCE
) -> Framework:
    """Exact where Newton's method gets there from a soft framework, else off by about `tolerance`, of the mean length.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    for weight in EXACT_WEIGHTS:
        frame, _ = sparse_solve(frame, target, weight, freedom, EXACT_ITERATIONS, beta=BETA_OF_LARGE)
    exact = sparse_exact(frame, freedom) if square else frame
    if exact.worst < EXACT:
        return exact
    return within_tolerance(frame, target, PENALTY_WEIGHT, freedom, tolerance, beta=BETA_OF_LARGE)
