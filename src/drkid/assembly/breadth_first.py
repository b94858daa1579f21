"""Breadth-first placement: every piece put to the one before it, at the joint's stated angle."""

from collections import deque

import numpy as np

from drkid.assembly.hinge_framework import HingeFramework
from drkid.mesh import Floats


def chained(framework: HingeFramework, first: int = 0) -> Floats:
    """(P, 4, 4): placements of pieces that hang on one another in a breadth-first tree from piece `first`.

    With F_a and F_b the two connector frames of a joint and B the turn by its bend δ, the second piece lies at
    T_b = T_a F_a B F_b⁻¹. Joints outside the tree do not matter: their gaps are the drift that has accumulated.

    Raises:
        ValueError: the pieces are not all connected.
    """
    steps = framework.frames[:, 0] @ _turns(framework.bend_radians) @ _inverse(framework.frames[:, 1])
    back = _inverse(steps)
    joints: list[list[tuple[int, int, bool]]] = [[] for _ in range(framework.count)]
    for j, (a, b) in enumerate(framework.pieces.tolist()):
        joints[a].append((j, b, True))
        joints[b].append((j, a, False))
    placements = np.tile(np.eye(4), (framework.count, 1, 1))
    seen, queue = {first}, deque([first])
    while queue:
        piece = queue.popleft()
        for j, other, forward in joints[piece]:
            if other not in seen:
                seen.add(other)
                queue.append(other)
                placements[other] = placements[piece] @ (steps if forward else back)[j]
    if len(seen) < framework.count:
        message = f"{framework.count - len(seen)} of {framework.count} pieces hang on no joint"
        raise ValueError(message)
    return placements


def _turns(bend: Floats) -> Floats:
    """(J, 4, 4): from the second piece's connector coordinates to the first's. Unbent it is half a turn about z."""
    cosine, sine = np.cos(bend), np.sin(bend)
    turn = np.zeros((len(bend), 4, 4))
    turn[:, 0, 0], turn[:, 3, 3] = -1.0, 1.0
    turn[:, 1, 1], turn[:, 2, 1] = -cosine, -sine
    turn[:, 1, 2], turn[:, 2, 2] = -sine, cosine
    return turn


def _inverse(motions: Floats) -> Floats:
    turned = np.swapaxes(motions[..., :3, :3], -1, -2)
    inverse = np.zeros_like(motions)
    inverse[..., :3, :3] = turned
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", turned, motions[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse
