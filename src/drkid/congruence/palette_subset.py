"""A palette for any number of classes: between those with a fixed one, the best subset of three lengths' multisets.

Which triangles serve a mesh best depends on the mesh; they are searched for: from all ten the one whose loss harms
least is taken away until k are left, then exchanges are tried (stepwise selection; Miller 2002, chapter 3).
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from drkid.congruence.framework import Framework
from drkid.congruence.hop import Anneal, Problem, annealed
from drkid.congruence.labelling import first_labels
from drkid.congruence.levenberg_marquardt import solve
from drkid.congruence.palette import FIXED_CLASSES, MOST_CLASSES, Multiset, Palette, palette_of_classes
from drkid.congruence.target import Target
from drkid.errors import SpecError
from drkid.mesh import Ints, TriMesh

TRIAL_WEIGHT, TRIAL_DAMPING, TRIAL_HEAT, TRIAL_STEPS_PER_FACE = 0.4, 0.05, 1.0, 60
TRIALS, TRIAL_ITERATIONS = 3, 2
DROPPED, EXCHANGED = 4, 3  # so many of the least used multisets are tried to leave, and of the others to come in


def palette_for(mesh: TriMesh, classes: int, rng: np.random.Generator) -> Palette:
    """The palette of k classes: fixed for k = 1, 2, 3, 4 and 10, searched for this mesh between.

    Raises:
        SpecError: less than 1 or more than 10 classes, or no labelling of this mesh has only allowed triangles.
    """
    if classes in FIXED_CLASSES:
        return palette_of_classes(classes)
    if not 1 <= classes <= MOST_CLASSES:
        raise SpecError(
            f"the palette solver has no palette of {classes} classes",
            wanted=f"1 to {MOST_CLASSES} classes",
            found=str(classes),
            remedy="fewer --classes, or --method pressure",
        )
    return best_subset(mesh, palette_of_classes(MOST_CLASSES), classes, rng)


def best_subset(mesh: TriMesh, palette: Palette, classes: int, rng: np.random.Generator) -> Palette:
    """The palette with only k of its multisets, those with which a short annealing misses this mesh least.

    Args:
        mesh: closed, in any unit.
        palette: what to choose from.
        classes: how many multisets to keep.
        rng: every random choice comes from it.

    Raises:
        SpecError: the palette has fewer multisets, or no labelling of this mesh has only allowed triangles.
    """
    if not 1 <= classes <= len(palette.multisets):
        raise SpecError(
            f"{classes} classes cannot be chosen",
            wanted=f"1 to {len(palette.multisets)} classes",
            found=str(classes),
            remedy="another number of --classes",
        )
    unit = mesh.scaled(1 / mesh.mean_edge)
    trials = Trials(unit, Target(unit), palette, int(rng.integers(2**32)))
    kept = palette.multisets
    while len(kept) > classes:
        kept = trials.best(_without(kept, m) for m in trials.least_used(kept)[:DROPPED])
    if classes < len(palette.multisets):
        kept = trials.best([kept, *_exchanges(kept, trials)])
    return replace(palette, multisets=kept)


@dataclass(frozen=True, eq=False)
class Trials:
    """Sets of multisets tried on a mesh whose mean edge is 1, and what each of them came to: misfit and uses."""

    mesh: TriMesh
    target: Target
    palette: Palette
    seed: int
    known: dict[tuple[Multiset, ...], tuple[float, tuple[int, ...]]] = field(default_factory=dict)

    def of(self, multisets: tuple[Multiset, ...]) -> tuple[float, tuple[int, ...]]:
        """Mean merit after short annealings (infinite where no labels were found), and faces of each multiset in all.

        The same random numbers serve every set, so that their misfits compare.
        """
        if multisets not in self.known:
            palette = replace(self.palette, multisets=multisets)
            tried = [self._tried(palette, np.random.default_rng([self.seed, number])) for number in range(TRIALS)]
            uses = np.bincount(np.concatenate([used for _, used in tried]), minlength=len(multisets))
            self.known[multisets] = float(np.mean([merit for merit, _ in tried])), tuple(uses.tolist())
        return self.known[multisets]

    def _tried(self, palette: Palette, rng: np.random.Generator) -> tuple[float, Ints]:
        """Merit, and each face's multiset (F,); infinite, and no face, where no labels are found."""
        lengths = np.array(palette.ratios) / np.mean(palette.ratios)
        try:
            labels = first_labels(self.mesh, palette, lengths, rng)
        except SpecError:  # this set is no candidate; the search goes on with the others
            return np.inf, np.zeros(0, np.int64)
        frame = Framework(self.mesh, labels, palette.lengths(1.0, labels))
        how = Anneal(TRIAL_WEIGHT, TRIAL_DAMPING, TRIAL_HEAT, TRIAL_STEPS_PER_FACE * len(self.mesh.faces))
        frame = annealed(frame, Problem(self.target, palette, "scale", square=False), how, rng)
        frame, merit = solve(frame, self.target, TRIAL_WEIGHT, "scale", TRIAL_ITERATIONS)
        return merit, palette.class_of(frame.labels[frame.mesh.face_edges])

    def best(self, candidates: Iterable[tuple[Multiset, ...]]) -> tuple[Multiset, ...]:
        """The candidate of the least misfit."""
        return min(candidates, key=lambda multisets: self.of(multisets)[0])

    def least_used(self, multisets: tuple[Multiset, ...]) -> list[Multiset]:
        """The multisets in the order of their uses."""
        uses = self.of(multisets)[1]
        return [multisets[i] for i in np.argsort(uses, kind="stable").tolist()]


def _without(multisets: tuple[Multiset, ...], gone: Multiset) -> tuple[Multiset, ...]:
    return tuple(m for m in multisets if m != gone)


def _exchanges(kept: tuple[Multiset, ...], trials: Trials) -> list[tuple[Multiset, ...]]:
    """Sets in which one of the least used gives way to one of those left out that were used most at the outset."""
    outside = [m for m in reversed(trials.least_used(trials.palette.multisets)) if m not in kept]
    return [
        tuple(sorted((*_without(kept, gone), come)))
        for gone in trials.least_used(kept)[:EXCHANGED]
        for come in outside[:EXCHANGED]
    ]
