"""Pictures of the guide: what stands, the new pieces in their classes' colours, numbers, letters and ticks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drkid.export.colour import class_colour
from drkid.mesh import Floats, Ints
from drkid.report.colouring import channels
from drkid.report.drawing import Drawing, Shape, Word
from drkid.report.guide import Guide, Instruction
from drkid.report.hidden_surface import Painted, painted
from drkid.report.outline import outline
from drkid.report.picture import camera
from drkid.report.rasteriser import rasterise

SAMPLES = 500  # along a picture, at which depth is compared: a third of a mm on paper
COARSE = 160  # pixels along a picture by which a direction to look from is chosen
FAIRLY_SEEN = 0.3  # of a piece's own largest face: less, and the piece needs another picture
MOST_VIEWS = 3  # of one group
LEAST_FACING = 0.3  # cosine to the eye below which a face is too oblique for words
STANDING, STANDING_LINE, NEW_LINE = "#E4E6EA", "#8A8F99", "#000000"
DIRECTIONS = [(a, e) for e in (-65, -30, 0, 30, 65) for a in range(0, 360, 36)]


@dataclass(frozen=True, eq=False)
class Builder:
    """Draws the kit of a guide, whole or in part."""

    guide: Guide

    @cached_property
    def _bodies(self) -> dict[str, tuple[Floats, ...]]:
        return {file: outline(mesh) for file, mesh in self.guide.scene.parts.items()}

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(self.guide.scene.assembled.vertices - self.guide.scene.middle, axis=1).max())

    def _polygons(self, piece: int) -> list[Floats]:
        scene = self.guide.scene
        matrix = scene.transforms[piece]
        return [p @ matrix[:3, :3].T + matrix[:3, 3] for p in self._bodies[scene.document.pieces[piece].part]]

    @cached_property
    def _placed(self) -> list[list[Floats]]:
        return [self._polygons(i) for i in range(len(self.guide.scene.document.pieces))]

    # ---- where to look from

    def views(self, group: tuple[Instruction, ...]) -> list[tuple[Floats, set[int]]]:
        """Cameras from which every new piece of the group is fairly seen, most of them in the first; what each shows.

        Greedy set cover; a piece that no direction shows well is left to the first picture.
        """
        new = [one.piece for one in group]
        standing = [one.piece for one in self.guide.instructions[: group[-1].step]]
        normals = self.guide.scene.transforms[new][:, :3, 2]
        mean = normals.mean(axis=0)
        candidates = [camera(a, e) for a, e in DIRECTIONS]
        if np.linalg.norm(mean) > 0.1:
            eye = mean / np.linalg.norm(mean)
            angles = np.degrees([np.arctan2(eye[1], eye[0]), np.arcsin(np.clip(eye[2], -1, 1))])
            candidates.insert(0, camera(float(angles[0]), float(np.clip(angles[1], -80, 80))))
        shares = np.array([self._seen(standing, new, view) for view in candidates])
        left, found = set(range(len(new))), list[tuple[Floats, set[int]]]()
        while left and len(found) < MOST_VIEWS:
            rest = sorted(left)
            gains = (shares[:, rest] > FAIRLY_SEEN).sum(axis=1) + np.minimum(shares[:, rest], 1).mean(axis=1)
            best = int(gains.argmax())
            shown = {i for i in rest if shares[best, i] > FAIRLY_SEEN}
            if not shown and found:
                break
            found.append((candidates[best], {new[i] for i in shown}))
            left -= shown
        return found

    def _seen(self, standing: list[int], new: list[int], view: Floats) -> Floats:
        """(n,): the visible area of each new piece over that of its largest face."""
        scale = COARSE / (2.2 * self._size)
        corners, owner = self._triangles(standing)
        flat = (corners - self.guide.scene.middle) @ view.T * [scale, -scale, scale] + [COARSE / 2, COARSE / 2, 0]
        faces, _, _ = rasterise(flat, COARSE, COARSE)
        count = np.bincount(owner[faces[faces >= 0]], minlength=len(self._placed))
        areas = np.array([self._largest_face(i) for i in new]) * scale**2
        return count[new] / areas

    def _triangles(self, pieces: list[int]) -> tuple[Floats, Ints]:
        fans = [[p[[0, k, k + 1]] for p in self._placed[i] for k in range(1, len(p) - 1)] for i in pieces]
        return np.array([t for fan in fans for t in fan]), np.repeat(pieces, [len(fan) for fan in fans])

    def _largest_face(self, piece: int) -> float:
        return max(_area(p) for p in self._placed[piece])

    # ---- drawing

    def drawing(self, group: tuple[Instruction, ...], view: Floats, width: float, height: float) -> Drawing:
        """What stands after the group's steps, `width` × `height` mm at most, new pieces coloured and numbered."""
        standing = [one.piece for one in self.guide.instructions[: group[-1].step]]
        new = {one.piece: one for one in group}
        asked = {join.other_step for one in group for join in one.joins}
        flat = [(i, (p - self.guide.scene.middle) @ view.T) for i in standing for p in self._placed[i]]
        flat = [(i, p) for i, p in flat if _signed_area(p) > 0]
        found = painted([p for _, p in flat], SAMPLES)
        owner = np.array([i for i, _ in flat])[found.source]
        points = np.concatenate([p for _, p in flat])
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        scale = min(width / (high - low)[0], height / (high - low)[1]) * 0.97
        size = (high - low) * scale
        sheet = np.array([size[0], size[1]]) * 1.02
        shift = sheet / 2 - (low + high) / 2 * scale
        items = self._shapes(found, owner, set(new), scale, shift)
        words = self._words(standing, new, asked, view, (scale, shift))
        title = f"Steps {group[0].step} to {group[-1].step}: what stands, the new pieces coloured"
        return Drawing(float(sheet[0]), float(sheet[1]), (*items, *words), title)

    def _shapes(self, found: Painted, owner: Ints, new: set[int], scale: float, shift: Floats) -> list[Shape]:
        shapes: list[Shape] = []
        for polygon, piece in zip(found.polygons, owner.tolist(), strict=True):
            tone = _tone(polygon)
            code = class_colour(int(self.guide.scene.piece_class[piece])) if piece in new else STANDING
            fill = _shaded(code, tone if piece not in new else 0.55 + 0.45 * tone)
            line = NEW_LINE if piece in new else STANDING_LINE
            shapes.append(Shape(polygon[:, :2] * scale + shift, fill, line, 0.35 if piece in new else 0.15))
        return shapes

    def _words(
        self,
        standing: list[int],
        new: dict[int, Instruction],
        asked: set[int],
        view: Floats,
        placing: tuple[float, Floats],
    ) -> list[Shape | Word]:
        scene, (scale, shift) = self.guide.scene, placing
        corners, owner = self._triangles(standing)
        samples = SAMPLES / (2.2 * self._size)
        middle = np.array([SAMPLES / 2, SAMPLES / 2, 0])
        screen = (corners - scene.middle) @ view.T * [samples, -samples, samples] + middle
        faces, _, _ = rasterise(screen, SAMPLES, SAMPLES)
        items: list[Shape | Word] = []
        for piece in standing:
            step = int(scene.piece_step[piece])
            if piece not in new and step not in asked:
                continue
            top = self._outer_corners(piece)
            flat = (top - scene.middle) @ view.T
            x, y = (flat.mean(axis=0) * [samples, -samples, 1] + middle)[:2].astype(int)
            facing = float(scene.transforms[piece][:3, 2] @ view[2])
            if facing < LEAST_FACING or faces[y, x] < 0 or owner[faces[y, x]] != piece:
                continue
            on_paper = flat[:, :2] * scale + shift
            items += self._label(piece, new.get(piece), on_paper)
        return items

    def _outer_corners(self, piece: int) -> Floats:
        """(n, 3): the part's corners on its outer face, in world coordinates."""
        scene = self.guide.scene
        one = scene.document.pieces[piece]
        part = next(p for c in scene.document.classes for p in c.parts if p.file == one.part)
        corners = np.array(part.corners) + [0, 0, float(scene.parts[one.part].vertices[:, 2].max())]
        return corners @ scene.transforms[piece][:3, :3].T + scene.transforms[piece][:3, 3]

    def _label(self, piece: int, instruction: Instruction | None, corners: Floats) -> list[Shape | Word]:
        middle, step = corners.mean(axis=0), str(int(self.guide.scene.piece_step[piece]))
        radius = float(np.linalg.norm(corners - middle, axis=1).min())
        size = float(np.clip(0.42 * radius, 1.6, 4.2))
        if instruction is None:
            return [Word(middle[0], middle[1], step, 0.85 * size, colour="#333333")]
        letter = instruction.part.replace(" left", " L").replace(" right", " R")
        return [
            Word(middle[0], middle[1] + 0.5 * size, step, size, True, "#000000", "#FFFFFF"),
            Word(middle[0], middle[1] - 0.6 * size, letter, 0.8 * size, False, "#000000", "#FFFFFF"),
            *ticks(corners, self.guide.part_ticks[self.guide.scene.document.pieces[piece].part], size / 3),
        ]

    def part_drawing(self, file: str, width: float) -> Drawing:
        """A part's outer face with its letter and its ticks."""
        classes = self.guide.scene.document.classes
        number, part = next((i, p) for i, c in enumerate(classes) for p in c.parts if p.file == file)
        corners = np.array(part.corners)[:, :2]
        low, extents = corners.min(axis=0), np.ptp(corners, axis=0)
        flat = (corners - low) * ((width - 2) / extents.max()) + 1
        middle, size = flat.mean(axis=0), width / 6
        items = (
            Shape(flat, class_colour(number), NEW_LINE, 0.35),
            Word(middle[0], middle[1], classes[number].id, size, True, "#000000", "#FFFFFF"),
            *ticks(flat, self.guide.part_ticks[file], width / 22),
        )
        name = self.guide.part_names[file]
        return Drawing(width, float(flat[:, 1].max()) + 1, items, f"Outer face of a piece {name}")


def ticks(corners: Floats, counts: tuple[int, ...], length: float) -> list[Shape]:
    """Short lines across the middle of each side of a polygon (n, 2), as many as its count; white under black."""
    middle, found = corners.mean(axis=0), list[Shape]()
    for a, b, count in zip(corners, np.roll(corners, -1, axis=0), counts, strict=True):
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
        at = 0.86 * (a + b) / 2 + 0.14 * middle
        inward = (middle - (a + b) / 2) / max(float(np.linalg.norm(middle - (a + b) / 2)), 1e-9)
        for k in range(count):
            foot = at + along * (k - (count - 1) / 2) * 0.7 * length
            line = np.stack([foot - inward * length / 2, foot + inward * length / 2])
            found += [Shape(line, None, "#FFFFFF", 0.3 * length), Shape(line, None, "#000000", 0.16 * length)]
    return found


def _area(polygon: Floats) -> float:
    following = np.roll(polygon, -1, axis=0)
    return float(np.linalg.norm(np.cross(polygon, following).sum(axis=0)) / 2)


def _signed_area(polygon: Floats) -> float:
    """Of a polygon in view coordinates: positive where it looks at the viewer."""
    x, y = polygon[:, 0], polygon[:, 1]
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def _tone(polygon: Floats) -> float:
    """Brightness in [0.45, 1] by how a polygon looks at the light, which comes from the left above the viewer."""
    normal = np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
    return float(0.45 + 0.55 * max(0.0, normal @ np.array([-0.35, 0.5, 0.79])))


def _shaded(code: str, tone: float) -> str:
    return "#" + "".join(f"{round(255 * c * tone):02X}" for c in channels(code))
