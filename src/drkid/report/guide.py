"""The guide: what to do at each step, in groups of steps that one picture shows; no layout."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from drkid.export.layout import part_label
from drkid.mesh import Floats
from drkid.report.scene import Scene

STEPS_A_PICTURE = 15  # a kit of 172 pieces then takes a dozen pages
SAME_LENGTH = 1e-4  # of the longest side: sides of a class that differ by less carry the same ticks


@dataclass(frozen=True)
class Join:
    """A side of the new piece and the side of a standing one that it meets, in words."""

    side: str
    other_step: int
    other_side: str


@dataclass(frozen=True)
class Instruction:
    """One step: which part goes where."""

    step: int
    piece: int
    part: str
    joins: tuple[Join, ...]


@dataclass(frozen=True, eq=False)
class Guide:
    """The steps of a kit, in groups."""

    scene: Scene

    @cached_property
    def is_merged(self) -> bool:
        """Whether pieces are merged: their sides then have numbers, because ticks do not tell equal ones apart."""
        return self.scene.document.is_merged

    @cached_property
    def ticks(self) -> tuple[tuple[int, ...], ...]:
        """For each class the ticks of its sides, ascending: 1 for the shortest length, 2 for the next."""
        return tuple(ranks(np.array(one.edge_lengths)) for one in self.scene.document.classes)

    @cached_property
    def part_sides(self) -> dict[str, tuple[int, ...]]:
        """For each part the ticks of its sides, or the numbers of a merged one's, in the order of its corners."""
        found: dict[str, tuple[int, ...]] = {}
        if self.is_merged:
            parts = [part for one in self.scene.document.classes for part in one.parts]
            return {part.file: tuple(range(1, 1 + len(part.corners))) for part in parts}
        for one, ticks in zip(self.scene.document.classes, self.ticks, strict=True):
            for part in one.parts:
                order = np.argsort(np.argsort(part.side_lengths, kind="stable"), kind="stable")
                found[part.file] = tuple(ticks[i] for i in order)
        return found

    @cached_property
    def part_names(self) -> dict[str, str]:
        """What each part is called: its class's letter, its bevel's number and its hand where these differ.

        Mirror images of merged pieces are classes of their own, which have letters enough.
        """
        return {
            part.file: one.id if self.is_merged else part_label(part.file)
            for one in self.scene.document.classes
            for part in one.parts
        }

    def side_word(self, side: int) -> str:
        """The ticks of a side, or its number, as they are written."""
        return f"side {side}" if self.is_merged else tick_word(side)

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """Every step of the assembly."""
        scene = self.scene
        joints: list[list[tuple[int, tuple[int, int]]]] = [[] for _ in scene.document.pieces]
        for (a, b), joint in zip(scene.joint_pieces.tolist(), scene.document.joints, strict=True):
            joints[a].append((b, joint.edge))
            joints[b].append((a, joint.edge))
        return tuple(
            Instruction(
                step, piece, self.part_names[scene.document.pieces[piece].part], self._joins(step, piece, joints[piece])
            )
            for step, piece in enumerate(np.argsort(scene.piece_step, kind="stable").tolist(), 1)
        )

    def _joins(self, step: int, piece: int, joints: list[tuple[int, tuple[int, int]]]) -> tuple[Join, ...]:
        steps = self.scene.piece_step
        found = [
            Join(self._side_at(piece, edge), int(steps[other]), self._side_at(other, edge))
            for other, edge in joints
            if steps[other] < step
        ]
        return tuple(sorted(found, key=lambda join: join.other_step))

    def _side_at(self, piece: int, edge: tuple[int, int]) -> str:
        one = self.scene.document.pieces[piece]
        corners = list(one.corners)
        following = corners[1:] + corners[:1]
        side = next(i for i, ends in enumerate(zip(corners, following, strict=True)) if set(ends) == set(edge))
        return self.side_word(self.part_sides[one.part][side])

    @cached_property
    def groups(self) -> tuple[tuple[Instruction, ...], ...]:
        """Steps that one picture shows, about equally many in each."""
        count = -(-len(self.instructions) // STEPS_A_PICTURE)
        ends = np.round(np.linspace(0, len(self.instructions), count + 1)).astype(int).tolist()
        return tuple(self.instructions[a:b] for a, b in pairwise(ends))


def ranks(ascending: Floats) -> tuple[int, ...]:
    """1 for the shortest length and one more for each that is really longer."""
    longer = np.diff(ascending) > SAME_LENGTH * ascending[-1]
    return (1, *(1 + np.cumsum(longer)).tolist())


def tick_word(count: int) -> str:
    """Ticks as they are written: |, ||, |||."""
    return "|" * count


def joined_text(instruction: Instruction) -> str:
    """Which side meets which, in words: '| to | of 3, || to || of 7', or 'side 2 to side 5 of 3' of merged pieces."""
    if not instruction.joins:
        return "stands alone"
    return ", ".join(f"{join.side} to {join.other_side} of {join.other_step}" for join in instruction.joins)


def closing_text(guide: Guide) -> str:
    """How the shell is closed."""
    last = guide.instructions[-1]
    connector = guide.scene.document.spec.get("connector")
    means = {
        "hinge": "press the hinge halves, with their rods, into the pockets of the standing pieces first, then push "
        "the last piece down over them until it is flush",
        "box": "press the keys into the pockets of the standing pieces first, then push the last piece down over them "
        "until it is flush",
    }.get(str(connector), "put glue on the sides of the gap and push the last piece down until it is flush")
    return (
        f"The last piece, number {last.step} ({last.part}), closes the shell. Its neighbours do not lean over it: it "
        f"goes in from outside, straight down. Join {joined_text(last)}: {means}."
    )


def joining_text(guide: Guide) -> str:
    """How any two pieces are joined."""
    connector = guide.scene.document.spec.get("connector")
    return {
        "hinge": "For each joint put two hinge halves together, push a rod through both, and press the hinge into "
        "both pockets from the inner side.",
        "box": "For each joint press a key into both pockets from the inner side.",
    }.get(str(connector), "Glue the sides together.")
