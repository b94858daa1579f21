"""Starts and hops: anneal softly, then solve exactly (basin hopping, Wales and Doye 1997).

A start anneals labels and flips at falling weights of the shape, briefly: many short starts, of which the best are
repaired and hop on, lead sooner to exact meshes than few thorough ones. A hop softens an exact mesh, anneals it gently
and solves it again; what comes out is another exact mesh nearby, or none.
"""

from dataclasses import dataclass

import numpy as np

from drkid.congruence import newton
from drkid.congruence.annealing import Schedule, anneal
from drkid.congruence.framework import Framework, framework_of
from drkid.congruence.levenberg_marquardt import Freedom, solve
from drkid.congruence.palette import Palette
from drkid.congruence.quadratic_model import connectivity, quadratic_model
from drkid.congruence.target import Target
from drkid.mesh import Ints

START_WEIGHTS, START_ITERATIONS = (0.6, 0.25, 0.15), 2
START_DAMPING, START_HEAT, START_STEPS_PER_FACE = 0.05, 0.5, 150
OF_ONE_WEIGHTS, OF_ONE_HEAT, OF_ONE_STEPS_PER_FACE = (1.0, 0.6, 0.4, 0.25), 3.0, 2400  # one class alone moves heavily
EXACT_WEIGHTS, EXACT_ITERATIONS = (0.03,), 4
HOP_EXACT_WEIGHT, SOFT_ITERATIONS, HOP_ITERATIONS = 0.03, 3, 4
FLIP_SHARE = 0.3
REHEATS, REHEAT = 6, 1.7  # where an anneal ends as it began: so often again, so much hotter each time


@dataclass(frozen=True)
class Problem:
    """What stays the same: the target in units of the mean edge, the palette, and what of its lengths is free."""

    target: Target
    palette: Palette
    freedom: Freedom
    square: bool
    """As many lengths as freedoms (genus 0): Newton applies; else only the least residual can be sought."""


@dataclass(frozen=True)
class Anneal:
    """How softly: weight w of the shape, damping μ, heat (first temperature in typical prices), steps."""

    weight: float
    damping: float
    heat: float
    steps: int


@dataclass(frozen=True)
class Ranges:
    """Between what a hop's anneal is drawn, evenly in the logarithm; see `Anneal`."""

    weight: tuple[float, float]
    heat: tuple[float, float]
    steps: tuple[float, float]
    damping: tuple[float, float] = (0.02, 0.1)

    def draw(self, rng: np.random.Generator) -> Anneal:
        """One anneal."""
        weight, damping, heat, steps = (
            float(np.exp(rng.uniform(*np.log(r)))) for r in (self.weight, self.damping, self.heat, self.steps)
        )
        return Anneal(weight, damping, heat, int(steps))


GLOBAL = Ranges((0.05, 0.2), (0.02, 0.4), (3_000, 15_000))
LOCAL = Ranges((0.05, 0.4), (0.05, 1.6), (3_000, 12_000))
OF_ONE = Ranges((0.15, 0.6), (2.0, 20.0), (15_000, 15_000))  # one class alone: gentler hops end where they began


def annealed(
    frame: Framework, problem: Problem, how: Anneal, rng: np.random.Generator, active: Ints | None = None
) -> Framework:
    """Labels and flips annealed in the quadratic model; only `active` edges change, or all.

    The vertices are those that the model takes for the best. Where nothing has changed it tries again, hotter.
    """
    model, net = quadratic_model(frame, problem.target, how.weight, how.damping), connectivity(frame.mesh)
    labels = frame.labels.copy()
    free = np.ones(len(labels), np.bool_)
    if active is not None:
        free[:] = False
        free[active] = True
    heat = how.heat * float((1 - np.diag(model.coupling)).mean() * (frame.lengths[-1] - frame.lengths[0]) ** 2)
    for _ in range(REHEATS):
        schedule = Schedule(heat, how.steps, FLIP_SHARE, np.flatnonzero(free), free)
        anneal(net, model, labels, frame.lengths, problem.palette.allowed.copy(), rng, schedule)
        if (labels != frame.labels).any() or (net.faces != frame.mesh.faces).any():
            break
        heat *= REHEAT
    vertices = frame.mesh.vertices + model.shift.reshape(-1, 3)
    return framework_of(vertices, net.faces, net.edges, labels, frame.lengths)


def start(frame: Framework, problem: Problem, rng: np.random.Generator) -> Framework:
    """From first labels to a soft framework: annealed at each weight, the ratio of lengths held."""
    held: Freedom = "none" if problem.freedom == "none" else "scale"
    weights, heat, steps = START_WEIGHTS, START_HEAT, START_STEPS_PER_FACE
    if len(problem.palette.multisets) == 1:
        weights, heat, steps = OF_ONE_WEIGHTS, OF_ONE_HEAT, OF_ONE_STEPS_PER_FACE
    for weight in weights:
        how = Anneal(weight, START_DAMPING, heat, steps * len(frame.mesh.faces))
        frame, _ = solve(annealed(frame, problem, how, rng), problem.target, weight, held, START_ITERATIONS)
    return frame


def exactly(frame: Framework, problem: Problem, weights: tuple[float, ...] = EXACT_WEIGHTS) -> Framework:
    """The true solve: Levenberg–Marquardt at falling weights, then Newton where the system is square."""
    for weight in weights:
        frame, _ = solve(frame, problem.target, weight, problem.freedom, EXACT_ITERATIONS)
    return newton.exact(frame, problem.freedom) if problem.square else frame


def hop(
    frame: Framework, problem: Problem, rng: np.random.Generator, active: Ints | None = None, ranges: Ranges = GLOBAL
) -> Framework:
    """Soften, anneal gently, solve again. `worst` of the result tells whether it is exact."""
    how = ranges.draw(rng)
    soft, _ = solve(frame, problem.target, how.weight, problem.freedom, SOFT_ITERATIONS)
    soft = annealed(soft, problem, how, rng, active)
    soft, _ = solve(soft, problem.target, HOP_EXACT_WEIGHT, problem.freedom, HOP_ITERATIONS)
    return newton.exact(soft, problem.freedom) if problem.square else soft


def edges_around(frame: Framework, centre: int, count: int) -> Ints:
    """Edges among the `count` vertices nearest to a vertex along edges, breadth first."""
    neighbours: list[list[int]] = [[] for _ in range(len(frame.mesh.vertices))]
    for a, b in frame.mesh.edges.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    seen, queue = {centre}, [centre]
    for v in queue:
        if len(queue) >= count:
            break
        for n in neighbours[v]:
            if n not in seen:
                seen.add(n)
                queue.append(n)
    inside = np.zeros(len(neighbours), np.bool_)
    inside[queue] = True
    return np.flatnonzero(inside[frame.mesh.edges].all(axis=1))
