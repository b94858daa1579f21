"""How stiff the assembled shell is: the softest mode of its framework, and the nearest fold along the softest modes.

Pieces are panels on hinges, not bars at joints; but a closed triangulated surface of panels hinged along all its edges
has exactly the flexes of the framework of its edges, since a triangle is held by its three sides (Dehn 1916; Gluck
1975). So the rigidity matrix J (E, 3V) speaks for the shell. With v its right singular vector of singular value σ
(unit length, mean edge 1) and y = J v / σ, the lengths change along x + t v, all other modes giving way, by

    c(t) = (σ t + S t²) y + t² q,    b_e = (|v_ab|² − (d_e · v_ab)²) / (2 length_e),   S = y · b,

q being b's part that no movement takes up: its projection on the self-stresses, 0 in genus 0 (second-order rigidity;
Connelly and Whiteley 1996). Where S² > 8 |q|², |c|² rises to a barrier and falls to a second state again, at

    t = −sign(S) σ (3 |S| ∓ √(S² − 8 |q|²)) / (4 (S² + |q|²)),     −σ / (2 S) and −σ / S where q = 0.

Joints with play let every length give by some p in either sense. Pushed along v they all give in the sense that helps,
so that strains c are passed as soon as p = |c|² / |c|₁: the least p for which p · sign(c) has c's share along c.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from drkid.congruence.rigidity import edge_vectors
from drkid.congruence.sparse_solve import factorised
from drkid.kit import Firmness, Rigidity
from drkid.mesh import Floats, Ints, TriMesh

MODES = 8  # the softest ones, along which folds are looked for
PLAY = 0.005  # of the mean edge: a rod's radial clearance of 0.15 mm on a side of 30 mm
VISIBLE = 0.1  # of the mean edge, 3 mm on 30 mm: a second state that is nearer is felt as play, not as a snap
SOFT_PERCENT = 10.0  # of the round shell's stiffness: it gives ten times as much as that
REACH = 1.0  # mean edges that a vertex moves at the most: beyond, two terms say nothing
LAMB = 9 / 16 * (8 - np.sqrt(448) / 3)  # Ω² of the slowest stretching mode (n = 2) of a sphere, Poisson's ratio 1/3
ROUND = float(np.sqrt(16 * np.pi / np.sqrt(3) * LAMB))  # σ √F of a round shell of even triangles
FLEX = 1e-7  # singular values below it are rounding: the mode is a flex
SHIFT = 1e-10  # makes JᵀJ positive definite, far below the squares of singular values that matter
MOST_DENSE = 50  # vertices up to which Lanczos has too little room
STEPS, STILL = 12, 1e-9  # of Newton's method towards a second state; the step, in mean edges, at which it stands


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode: σ, flex v (V, 3), tension y (E,) or 0 where σ is, S, and what no movement takes up, q (E,)."""

    value: float
    flex: Floats
    tension: Floats
    curvature: float
    rest: Floats

    @property
    def swing(self) -> float:
        """Movement of the most moved vertex as t becomes 1."""
        return float(np.linalg.norm(self.flex, axis=1).max())

    def play(self, shift: float) -> float:
        """The play, in mean edges, that t = `shift` needs."""
        along = self.value * shift + self.curvature * shift**2
        strain = along * self.tension + shift**2 * self.rest
        total = float(np.abs(strain).sum())
        return float(strain @ strain) / total if total > 0 else 0.0

    def sway(self, play: float) -> float:
        """Movement of the most moved vertex, away from the fold, that a play allows; `REACH` at the most."""
        side = (1.0 if self.curvature >= 0 else -1.0) * REACH / self.swing
        if self.play(side) <= play:
            return REACH
        return REACH * float(brentq(lambda share: self.play(share * side) - play, 0.0, 1.0))

    def fold(self) -> "Fold | None":
        """The barrier and the second state, if there are any within `REACH`."""
        slope, rest = abs(self.curvature), float(self.rest @ self.rest)
        room = slope**2 - 8 * rest
        if room <= 0 or self.value < FLEX:
            return None
        scale = -float(np.sign(self.curvature)) * self.value / (4 * (slope**2 + rest))
        root = float(np.sqrt(room))
        barrier, second = scale * (3 * slope - root), scale * (3 * slope + root)
        if abs(barrier) * self.swing > REACH:
            return None
        return Fold(self, barrier, second, self.play(barrier))


@dataclass(frozen=True, eq=False)
class Fold:
    """A fold that a mode meets at t = `barrier`; a second state at t = `second`; `play` in mean edges passes it."""

    mode: Mode
    barrier: float
    second: float
    play: float

    @property
    def moved(self) -> float:
        """Movement of the most moved vertex to the foretold second state."""
        return abs(self.second) * self.mode.swing


def rigidity(mesh: TriMesh) -> Rigidity:
    """How stiff a closed mesh is as a shell of hinged pieces, and whether it may snap into a second state.

    Nothing depends on the mesh's place or scale. σ² is a share of the trace of JᵀJ, which is 2E whatever the shape, so
    σ needs no normalisation; a smooth shell's falls as 1/√F. `stiffness_percent` compares it with a round shell of as
    many faces, whose σ √F = `ROUND` follows from Lamb's frequencies of a thin sphere (Lamb 1882), the even triangles
    being a sheet of Young's modulus 2/√3 and one unit of mass at a vertex. The second state that makes a shell `may
    snap through` has been found by Newton's method, not only foretold.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate, or its modes cannot be computed.
    """
    points = mesh.vertices / mesh.mean_edge
    modes = softest_modes(points, mesh.edges)
    folds = sorted((f for f in (m.fold() for m in modes) if f is not None), key=lambda f: f.play)
    stiffness = 100 * modes[0].value * np.sqrt(len(mesh.faces)) / ROUND
    firmness: Firmness = "soft" if stiffness < SOFT_PERCENT else "stiff"
    fold, moved = folds[0] if folds else None, None
    for one in [f for f in folds if f.play <= PLAY and 2 * f.moved >= VISIBLE]:
        state = second_state(points, mesh.edges, one)
        if state is not None and (distance := _largest(state - points)) >= VISIBLE:
            firmness, fold, moved = "may snap through", one, distance
            break
    return Rigidity(
        firmness=firmness,
        softest=modes[0].value,
        stiffness_percent=float(stiffness),
        sway_percent=100 * modes[0].sway(PLAY),
        fold_percent=None if fold is None else 100 * abs(fold.barrier) * fold.mode.swing,
        barrier_percent=None if fold is None else 100 * fold.play,
        second_state_percent=None if moved is None else 100 * moved,
    )


def softest_modes(points: Floats, edges: Ints) -> tuple[Mode, ...]:
    """At most `MODES` modes of a framework of mean edge 1, softest first; rigid motions are none.

    Where several modes are equally soft, as symmetry makes them, these are some basis of them.

    Raises:
        numpy.linalg.LinAlgError: an edge has no length, or Lanczos' method does not converge.
    """
    jacobian = _sparse_rigidity_matrix(points, edges)
    normal = (jacobian.T @ jacobian + SHIFT * eye_array(points.size)).tocsc()
    solve = factorised(normal).solve
    count = min(MODES, points.size - 6)
    dense = len(points) <= MOST_DENSE
    flexes = _dense_modes(jacobian, points)[:, :count] if dense else _lanczos(solve, points, count)
    order = np.argsort(np.linalg.norm(jacobian @ flexes, axis=0))
    return tuple(_mode(jacobian, solve, points, edges, flexes[:, i]) for i in order)


def second_state(points: Floats, edges: Ints, fold: Fold) -> Floats | None:
    """(V, 3): where Newton's method ends from the foretold second state; None if that is not near, or none at all.

    It must stand nearer to what was foretold than that is to the first state, with all lengths right within `PLAY` (in
    genus 0 they are exact).
    """
    _, wanted = edge_vectors(points, edges)
    foretold = points + fold.second * fold.mode.flex
    at = foretold
    for _ in range(STEPS):
        try:
            shift, missing = _newton_step(at, edges, wanted)
        except np.linalg.LinAlgError:  # two vertices meet: this is not the way
            return None
        if _largest(shift) < STILL:
            return at if missing <= PLAY else None
        at = at + shift
        if float(np.linalg.norm(at - foretold)) > abs(fold.second):
            return None
    return None


def _newton_step(points: Floats, edges: Ints, wanted: Floats) -> tuple[Floats, float]:
    """(V, 3), the step towards the wanted lengths (E,), and what the worst of them misses before it.

    Raises:
        numpy.linalg.LinAlgError: the framework is degenerate.
    """
    jacobian = _sparse_rigidity_matrix(points, edges)
    missing = wanted - edge_vectors(points, edges)[1]
    normal = (jacobian.T @ jacobian + SHIFT * eye_array(points.size)).tocsc()
    shift = factorised(normal).solve(jacobian.T @ missing)
    return shift.reshape(-1, 3), float(np.abs(missing).max())


def rigid_motions(points: Floats) -> Floats:
    """(3V, 6): an orthonormal basis of the infinitesimal translations and rotations."""
    centred = points - points.mean(axis=0)
    turns = [np.cross(axis, centred).ravel() for axis in np.eye(3)]
    shifts = [np.tile(axis, len(points)) for axis in np.eye(3)]
    return np.linalg.qr(np.stack(shifts + turns, axis=1))[0]


def _dense_modes(jacobian: csr_array, points: Floats) -> Floats:
    """(3V, 3V): all modes, softest first, the six rigid motions last."""
    rigid = rigid_motions(points)
    normal = (jacobian.T @ jacobian).toarray() + 4 * len(points) * rigid @ rigid.T  # above every other mode
    return np.linalg.eigh(normal)[1]


def _lanczos(solve: Callable[[Floats], Floats], points: Floats, count: int) -> Floats:
    """(3V, count): softest modes by Lanczos' method on the inverse, rigid motions projected out; the same every time.

    Raises:
        numpy.linalg.LinAlgError: it does not converge.
    """
    rigid = rigid_motions(points)

    def without_rigid(vector: Floats) -> Floats:
        return vector - rigid @ (rigid.T @ vector)

    inverse = LinearOperator(
        (points.size, points.size),
        matvec=lambda vector: without_rigid(solve(without_rigid(vector.ravel()))),
        dtype=np.float64,
    )
    start = without_rigid(np.random.default_rng(0).standard_normal(points.size))
    try:
        return eigsh(inverse, count, which="LM", v0=start)[1]
    except ArpackNoConvergence as error:
        raise np.linalg.LinAlgError(str(error)) from error


def _mode(jacobian: csr_array, solve: Callable[[Floats], Floats], points: Floats, edges: Ints, flex: Floats) -> Mode:
    direction, length = edge_vectors(points, edges)
    apart = flex.reshape(-1, 3)[edges[:, 1]] - flex.reshape(-1, 3)[edges[:, 0]]
    along = np.einsum("ei,ei->e", direction, apart)
    bending = (np.einsum("ei,ei->e", apart, apart) - along**2) / (2 * length)
    value = float(np.linalg.norm(along))
    tension = along / value if value >= FLEX else np.zeros_like(along)
    curvature = float(tension @ bending)
    other = bending - curvature * tension
    rest = other - jacobian @ solve(jacobian.T @ other)
    return Mode(value, flex.reshape(-1, 3), tension, curvature, rest)


def _sparse_rigidity_matrix(points: Floats, edges: Ints) -> csr_array:
    """J (E, 3V) as in `rigidity.rigidity_matrix`."""
    direction, _ = edge_vectors(points, edges)
    rows = np.repeat(np.arange(len(edges)), 6)
    columns = (3 * edges[:, :, None] + np.arange(3)).ravel()
    values = np.stack([-direction, direction], axis=1).ravel()
    return csr_array((values, (rows, columns)), shape=(len(edges), points.size))


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
