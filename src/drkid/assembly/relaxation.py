"""Relaxation: where rigid pieces come to lie when all their hinges pull at once.

Six unknowns for each piece, a turn and a shift; six equations for each hinge, of which one says that both sides are
of one length. The squares of the gaps are made least by Gauss and Newton's method with Levenberg's
damping, which also leaves out the six motions of the whole; steps by a sparse factorisation of the normal matrix. In
a soft shell the curvature of the gaps, which Gauss and Newton leave out, matters as much as what they keep: it is
block-diagonal, so it is added wherever the matrix stays positive definite with it (Newton's method). Such a shell's
gaps are small along a narrow, curved valley: steps are bent along it (geodesic acceleration; Transtrum and Sethna
2012).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_array, csc_array, eye_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from drkid.assembly.hinge_framework import HingeFramework
from drkid.mesh import Floats

MOST_ITERATIONS = 200
START_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e-10, 1e6  # of the normal matrix's mean diagonal
EASED, TIGHTENED = 0.2, 4.0
STILL = 1e-9  # of the arm: a step that moves no piece by more is rest
SETTLED = 1e-7  # of the sum of squares: a step that lowers it by less is rest


@dataclass(frozen=True, eq=False)
class Relaxation:
    """Placements (P, 4, 4) and gaps (J, 2, 3) at rest, or where `settled` is False, after the last iteration."""

    placements: Floats
    gaps: Floats
    iterations: int
    settled: bool


def relaxed(framework: HingeFramework, placements: Floats) -> Relaxation:
    """The framework's pieces at rest, starting from `placements` (P, 4, 4)."""
    arm = arm_length(framework)
    gaps = framework.gaps(placements)
    damping, settled, iteration = START_DAMPING, False, 0
    while not settled and iteration < MOST_ITERATIONS and damping < MOST_DAMPING:
        iteration += 1
        step = _step(framework, placements, gaps, damping)
        moved = _moved(placements, step, arm)
        found = framework.gaps(moved)
        before, after = float((gaps**2).sum()), float((found**2).sum())
        settled = bool(np.abs(step).max() <= STILL * arm)
        if after <= before:
            settled |= before - after <= SETTLED * before
            placements, gaps = moved, found
            damping = max(damping * EASED, LEAST_DAMPING)
        else:
            damping *= TIGHTENED
    return Relaxation(placements, gaps, iteration, settled)


def _step(framework: HingeFramework, placements: Floats, gaps: Floats, damping: float) -> Floats:
    """(P, 6): a damped step of Newton's method, or where that may lead uphill of Gauss and Newton's."""
    arm = arm_length(framework)
    matrix = jacobian(framework, placements, arm)
    normal = csc_array(matrix.T @ matrix)
    pull = np.asarray(-(matrix.T @ gaps.ravel()), np.float64)
    factors = factorised(normal + curvature(framework, placements, gaps, arm), damping)
    if (factors.U.diagonal() <= 0).any():  # pivots on the diagonal: as many negative ones as negative eigenvalues
        factors = factorised(normal, damping)
    straight = factors.solve(pull)
    bent = matrix.T @ bending(framework, placements, straight.reshape(-1, 6), arm).ravel()
    bend = factors.solve(np.asarray(-bent, np.float64))
    return (straight + bend / 2).reshape(-1, 6)


def bending(framework: HingeFramework, placements: Floats, step: Floats, arm: float) -> Floats:
    """(J, 2, 3): second derivative of the gaps along a step (P, 6): an arm p turning by ω bends by ω × (ω × p)."""
    placed, turn = placements[framework.pieces], step[framework.pieces][:, :, None, :3] / arm
    arms = np.einsum("jsab,jseb->jsea", placed[..., :3, :3], framework.ends)
    bent = np.asarray(np.cross(turn, np.cross(turn, arms)), np.float64)
    return bent[:, 0] - bent[:, 1]


def curvature(framework: HingeFramework, placements: Floats, gaps: Floats, arm: float) -> csc_array:
    """(6P, 6P): second derivative of the gaps, each times the gap itself, summed.

    An arm p that turns by ω moves by ω × p + ½ ω × (ω × p); against a gap g that curves by ½ (g pᵀ + p gᵀ) − (g · p) 1.
    """
    placed = placements[framework.pieces]
    arms = np.einsum("jsab,jseb->jsea", placed[..., :3, :3], framework.ends)
    pull = np.stack([gaps, -gaps], axis=1)
    outer = np.einsum("jsea,jseb->jsab", pull, arms)
    inner = np.trace(outer, axis1=-2, axis2=-1)
    blocks = (outer + np.swapaxes(outer, -1, -2)) / 2 - inner[..., None, None] * np.eye(3)
    turns = np.zeros((framework.count, 3, 3))
    np.add.at(turns, framework.pieces.ravel(), blocks.reshape(-1, 3, 3) / arm**2)
    total = np.zeros((framework.count, 6, 6))
    total[:, :3, :3] = turns
    places = np.arange(framework.count + 1)
    return csc_array(bsr_array((total, places[:-1], places), shape=(6 * framework.count, 6 * framework.count)))


def arm_length(framework: HingeFramework) -> float:
    """Root mean square distance of the axes' ends from their pieces' origins: a turn times it is a length."""
    return float(np.sqrt((framework.ends**2).sum(axis=-1).mean()))


def jacobian(framework: HingeFramework, placements: Floats, arm: float) -> bsr_array:
    """(6J, 6P): derivative of the gaps by each piece's turn times `arm` (3) and shift (3), in world axes.

    A point p of a piece at R p + t moves by ω × R p + v as the piece turns by ω about its origin and shifts by v.
    """
    placed = placements[framework.pieces]
    arms = np.einsum("jsab,jseb->jesa", placed[..., :3, :3], framework.ends)
    blocks = np.zeros((*arms.shape[:-1], 3, 6))
    x, y, z = np.moveaxis(arms, -1, 0) / arm
    blocks[..., 0, 1], blocks[..., 0, 2] = z, -y
    blocks[..., 1, 0], blocks[..., 1, 2] = -z, x
    blocks[..., 2, 0], blocks[..., 2, 1] = y, -x
    blocks[..., :, 3:] = np.eye(3)
    blocks[:, :, 1] *= -1.0
    rows = 2 * len(framework.pieces)
    columns = np.repeat(framework.pieces[:, None, :], 2, axis=1).ravel()
    return bsr_array(
        (blocks.reshape(-1, 3, 6), columns, 2 * np.arange(rows + 1)), shape=(3 * rows, 6 * framework.count)
    )


def factorised(matrix: csc_array, damping: float) -> SuperLU:
    """Factors of a symmetric matrix, `damping` times its mean diagonal added, without pivoting off the diagonal."""
    shift = damping * float(matrix.diagonal().mean())
    damped = csc_array(matrix + shift * eye_array(matrix.shape[0]))
    return splu(damped, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _moved(placements: Floats, step: Floats, arm: float) -> Floats:
    moved = placements.copy()
    moved[:, :3, :3] = Rotation.from_rotvec(step[:, :3] / arm).as_matrix() @ placements[:, :3, :3]
    moved[:, :3, 3] += step[:, 3:]
    return moved
