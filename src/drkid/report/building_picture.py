"""Pictures of the guide: what stands, the new pieces in their classes' colours, numbers, letters, ticks or sides."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drkid.export.colour import class_colour
from drkid.mesh import Bools, Floats, Ints
from drkid.report.colouring import channels
from drkid.report.drawing import Drawing, Shape, Word
from drkid.report.guide import Guide, Instruction
from drkid.report.hidden_surface import Painted, painted, triangulated
from drkid.report.outline import creases, outline
from drkid.report.picture import camera
from drkid.report.rasteriser import rasterise

SAMPLES = 500  # along a picture, at which depth is compared: a third of a mm on paper
COARSE = 120  # pixels along a picture by which a direction to look from is chosen
FAIRLY_SEEN = 0.4  # of a piece's outer face: less, and the piece needs another picture
MOST_VIEWS = 4  # of one group
LEAST_FACING = 0.3  # cosine to the eye below which a face is too oblique for words
STANDING, STANDING_LINE, NEW_LINE = "#E4E6EA", "#8A8F99", "#000000"
OUTER_COSINE = 0.99  # to the piece's normal: faces that are more oblique are its sides
BESIDE_SIDE = 0.45  # of the way from a side to the middle of its triangle: where its number stands
ON_SIDE = 1e-6  # of a face's size: points that are nearer to one of its sides lie on it
STEEPEST = 80.0  # degrees of elevation
DIRECTIONS = [(float(a), float(e)) for e in (-60, -20, 20, 60) for a in range(0, 360, 45)]


@dataclass(frozen=True, eq=False)
class _Face:
    """A polygon (n, 3) of a piece in view coordinates, which of its sides are drawn (n,), and its brightness."""

    piece: int
    polygon: Floats
    drawn: Bools
    tone: float

    def draws(self, part: Floats) -> list[bool]:
        """For each side of a part of the polygon, into which it may be cut, whether it lies on a side that is drawn."""
        start, along = self.polygon[self.drawn], (np.roll(self.polygon, -1, axis=0) - self.polygon)[self.drawn]
        if not len(start):
            return [False] * len(part)
        ends = part[:, None] - start
        across = np.linalg.norm(np.cross(ends, along), axis=-1) / np.linalg.norm(along, axis=-1)
        near = across < ON_SIDE * float(np.ptp(self.polygon, axis=0).max())
        return (near & np.roll(near, -1, axis=0)).any(axis=1).tolist()


@dataclass(frozen=True, eq=False)
class Builder:
    """Draws the kit of a guide, whole or in part."""

    guide: Guide

    @cached_property
    def _bodies(self) -> dict[str, tuple[Floats, ...]]:
        return {file: outline(mesh) for file, mesh in self.guide.scene.parts.items()}

    @cached_property
    def _creases(self) -> dict[str, tuple[Bools, ...]]:
        return {file: creases(polygons) for file, polygons in self._bodies.items()}

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

    @cached_property
    def _faces(self) -> tuple[list[Floats], Ints, Floats]:
        """The polygons of all pieces in world coordinates, whose they are, and their unit normals (n, 3)."""
        polygons = [p for polygons in self._placed for p in polygons]
        owner = np.repeat(np.arange(len(self._placed)), [len(polygons) for polygons in self._placed])
        return polygons, owner, np.array([_normal(p) for p in polygons])

    @cached_property
    def _drawn(self) -> list[Bools]:
        """Of each polygon of `_faces`, which of its sides are drawn (n,)."""
        return [drawn for piece in self.guide.scene.document.pieces for drawn in self._creases[piece.part]]

    @cached_property
    def _fans(self) -> tuple[Floats, Ints, Bools]:
        """(n, 3, 3): every piece's triangles in world coordinates, whose they are, and which are of an outer face."""
        polygons, owner, _ = self._faces
        corners, polygon = triangulated(polygons)
        piece = owner[polygon]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        outwards = np.einsum("nwk,nk->nw", self._outwards[piece], normal).max(axis=1)
        cosine = np.divide(outwards, length, out=np.full(len(length), -1.0), where=length > 0)
        most = np.full(len(self._placed), -1.0)
        np.maximum.at(most, piece, cosine)  # of a strongly curved piece no face may be within the limit
        return corners, piece, cosine >= np.minimum(OUTER_COSINE, most[piece])

    @cached_property
    def _outwards(self) -> Floats:
        """(P, w, 3): the outward normals of each piece: its own, or those of the faces that are merged in it."""
        scene = self.guide.scene
        covered = [piece.covered for piece in scene.document.pieces]
        out = np.repeat(scene.transforms[:, None, :3, 2], max(map(len, covered)), axis=1)
        for own, faces in zip(out, covered, strict=True):
            if len(faces) > 1:
                own[:] = scene.assembled.face_normals[np.resize(faces, len(own))]
        return out

    @cached_property
    def _outer_area(self) -> Floats:
        """(P,): area of each piece's outer face."""
        corners, piece, outer = self._fans
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        return np.bincount(piece[outer], weights=area[outer], minlength=len(self._placed)).astype(np.float64)

    # ---- where to look from

    def views(self, group: tuple[Instruction, ...]) -> list[Floats]:
        """Cameras from which every new piece of the group is fairly seen, most of them in the first.

        Greedy set cover; a piece that no direction shows well is left to the others' pictures.
        """
        new = [one.piece for one in group]
        standing = np.array([one.piece for one in self.guide.instructions[: group[-1].step]])
        candidates = [*_towards(self.guide.scene.transforms[new][:, :3, 2].mean(axis=0)), *DIRECTIONS]
        shares = np.array([self._seen(standing, new, camera(*one)) for one in candidates])
        left, found = set(range(len(new))), list[Floats]()
        while left and len(found) < MOST_VIEWS:
            rest = sorted(left)
            gains = (shares[:, rest] > FAIRLY_SEEN).sum(axis=1) + np.minimum(shares[:, rest], 1).mean(axis=1)
            best = int(gains.argmax())
            shown = {i for i in rest if shares[best, i] > FAIRLY_SEEN}
            if not shown and found:
                break
            found.append(camera(*candidates[best]))
            left -= shown
        return found

    def _seen(self, standing: Ints, new: list[int], view: Floats) -> Floats:
        """(n,): the visible area of each new piece's outer face over the whole of it."""
        corners, piece, outer = self._fans
        scale = COARSE / (2.2 * self._size)
        used = np.flatnonzero(np.isin(piece, standing))
        flat = (corners[used] - self.guide.scene.middle) @ view.T * [scale, -scale, scale]
        faces = used[_seen_faces(flat, COARSE)]
        count = np.bincount(piece[faces[outer[faces]]], minlength=len(self._placed))
        return count[new] / (self._outer_area[new] * scale**2)

    # ---- drawing

    def extents(self, group: tuple[Instruction, ...], view: Floats) -> Floats:
        """(2,): width and height of what stands after the group's steps, as a camera sees it."""
        low, high = self._box([one.piece for one in self.guide.instructions[: group[-1].step]], view)
        return high - low

    def _box(self, standing: list[int], view: Floats) -> tuple[Floats, Floats]:
        corners, owner, _ = self._fans
        flat = (corners[np.isin(owner, standing)].reshape(-1, 3) - self.guide.scene.middle) @ view[:2].T
        return flat.min(axis=0), flat.max(axis=0)

    def drawing(self, group: tuple[Instruction, ...], view: Floats, width: float, height: float) -> Drawing:
        """What stands after the group's steps, `width` × `height` mm at most, new pieces coloured and numbered."""
        standing = [one.piece for one in self.guide.instructions[: group[-1].step]]
        new = {one.piece: one for one in group}
        asked = {join.other_step for one in group for join in one.joins}
        polygons, owner, normals = self._faces
        facing = np.flatnonzero(np.isin(owner, standing) & (normals @ view[2] > 0)).tolist()
        tones = _tones(normals[facing] @ view.T).tolist()
        middle = self.guide.scene.middle
        faces = [
            _Face(int(owner[i]), (polygons[i] - middle) @ view.T, self._drawn[i], tone)
            for i, tone in zip(facing, tones, strict=True)
        ]
        found = painted([face.polygon for face in faces], SAMPLES)
        low, high = self._box(standing, view)
        scale = min(width / (high - low)[0], height / (high - low)[1]) * 0.97
        size = (high - low) * scale
        sheet = np.array([size[0], size[1]]) * 1.02
        shift = sheet / 2 - (low + high) / 2 * scale
        items = self._shapes(found, faces, set(new), scale, shift)
        words = self._words(standing, new, asked, view, (scale, shift))
        title = f"Steps {group[0].step} to {group[-1].step}: what stands, the new pieces coloured"
        return Drawing(float(sheet[0]), float(sheet[1]), (*items, *words), title)

    def _shapes(self, found: Painted, faces: list[_Face], new: set[int], scale: float, shift: Floats) -> list[Shape]:
        """Faces and their creases; those without a crease are closed by a line of their own colour."""
        shapes: list[Shape] = []
        for polygon, source in zip(found.polygons, found.source.tolist(), strict=True):
            face = faces[source]
            own = face.piece in new
            code = class_colour(int(self.guide.scene.piece_class[face.piece])) if own else STANDING
            fill = _shaded(code, 0.55 + 0.45 * face.tone if own else face.tone)
            line, width = (NEW_LINE, 0.35) if own else (STANDING_LINE, 0.15)
            flat = polygon[:, :2] * scale + shift
            if face.drawn.all() and len(polygon) == len(face.polygon):
                shapes.append(Shape(flat, fill, line, width))
                continue
            shapes.append(Shape(flat, fill, fill, 0.15))
            sides = zip(flat, np.roll(flat, -1, axis=0), face.draws(polygon), strict=True)
            shapes += [Shape(np.stack([a, b]), None, line, width) for a, b, drawn in sides if drawn]
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
        corners, owner, _ = self._fans
        used = np.flatnonzero(np.isin(owner, standing))
        samples = SAMPLES / (2.2 * self._size)
        middle = np.array([SAMPLES / 2, SAMPLES / 2, 0])
        screen = (corners[used] - scene.middle) @ view.T * [samples, -samples, samples] + middle
        faces, _, _ = rasterise(screen, SAMPLES, SAMPLES)

        def shown(piece: int, point: Floats, normal: Floats) -> Floats | None:
            """(2,): where a point of a piece, in world coordinates, is on paper; None where the picture hides it."""
            at = (point - scene.middle) @ view.T
            x, y = (at * [samples, -samples, 1] + middle)[:2].astype(int)
            seen = float(normal @ view[2]) >= LEAST_FACING and faces[y, x] >= 0
            return at[:2] * scale + shift if seen and owner[used[faces[y, x]]] == piece else None

        items: list[Shape | Word] = []
        for piece in standing:
            step = int(scene.piece_step[piece])
            if piece not in new and step not in asked:
                continue
            top = self._outer_corners(piece)
            on_paper = ((top - scene.middle) @ view.T)[:, :2] * scale + shift
            if piece in new and self.guide.is_merged:
                size = 0.7 * _letter_size(on_paper)
                sides = [(shown(piece, *side), number) for number, side in enumerate(self._sides(piece), 1)]
                items += [_side_number(at, number, size) for at, number in sides if at is not None]
            if shown(piece, top.mean(axis=0), scene.transforms[piece][:3, 2]) is not None:
                items += self._label(piece, new.get(piece), on_paper)
        return items

    def _sides(self, piece: int) -> list[tuple[Floats, Floats]]:
        """Beside each side of a merged piece a point of its outer face, in world coordinates, and the normal there."""
        scene = self.guide.scene
        one, mesh = scene.document.pieces[piece], scene.assembled
        thickness, found = float(scene.document.spec["thickness_mm"]), list[tuple[Floats, Floats]]()
        for a, b in zip(one.corners, [*one.corners[1:], one.corners[0]], strict=True):
            face = next(f for f in one.covered if {a, b} <= set(mesh.faces[f].tolist()))
            side = (mesh.vertices[a] + mesh.vertices[b]) / 2
            normal = mesh.face_normals[face]
            found.append((side + BESIDE_SIDE * (mesh.middles[face] - side) + thickness / 2 * normal, normal))
        return found

    def _outer_corners(self, piece: int) -> Floats:
        """(n, 3): the part's corners on its outer face, in world coordinates."""
        scene = self.guide.scene
        one = scene.document.pieces[piece]
        part = next(p for c in scene.document.classes for p in c.parts if p.file == one.part)
        corners = np.array(part.corners) + np.array([0, 0, scene.parts[one.part].vertices[:, 2].max()])
        return corners @ scene.transforms[piece][:3, :3].T + scene.transforms[piece][:3, 3]

    def _label(self, piece: int, instruction: Instruction | None, corners: Floats) -> list[Shape | Word]:
        middle, step = corners.mean(axis=0), str(int(self.guide.scene.piece_step[piece]))
        size = _letter_size(corners)
        if instruction is None:
            return [Word(middle[0], middle[1], step, 0.85 * size, colour="#333333")]
        letter, part = _short(instruction.part), self.guide.scene.document.pieces[piece].part
        return [
            *([] if self.guide.is_merged else ticks(corners, self.guide.part_sides[part], 0.75 * size)),
            Word(middle[0], middle[1] + 0.45 * size, step, size, True, "#000000", "#FFFFFF"),
            Word(middle[0], middle[1] - 0.5 * size, letter, 0.75 * size, False, "#000000", "#FFFFFF"),
        ]

    def part_drawing(self, file: str, width: float) -> Drawing:
        """A part's outer face with its letter and its ticks, or the numbers of its sides."""
        classes = self.guide.scene.document.classes
        number, part = next((i, p) for i, c in enumerate(classes) for p in c.parts if p.file == file)
        corners = np.array(part.corners)[:, :2]
        low, extents = corners.min(axis=0), np.ptp(corners, axis=0)
        flat = (corners - low) * ((width - 2) / extents.max()) + 1
        middle, size = flat.mean(axis=0), width / 6
        sides = self.guide.part_sides[file]
        ends = zip(flat, np.roll(flat, -1, axis=0), sides, strict=True)
        numbers = [_side_number((0.8 * (a + b) / 2 + 0.2 * middle), number, width / 10) for a, b, number in ends]
        items = (
            Shape(flat, class_colour(number), NEW_LINE, 0.35),
            Word(middle[0], middle[1], _short(self.guide.part_names[file]), size, True, "#000000", "#FFFFFF"),
            *(numbers if self.guide.is_merged else ticks(flat, sides, width / 9)),
        )
        name = self.guide.part_names[file]
        return Drawing(width, float(flat[:, 1].max()) + 1, items, f"Outer face of a piece {name}")


def _letter_size(corners: Floats) -> float:
    """Of a piece's number in mm, as its corners (n, 2) on paper have room for it."""
    radius = float(np.linalg.norm(corners - corners.mean(axis=0), axis=1).min())
    return float(np.clip(0.42 * radius, 1.6, 4.2))


def _side_number(at: Floats, number: int, size: float) -> Word:
    return Word(float(at[0]), float(at[1]), str(number), size, False, "#000000", "#FFFFFF")


def ticks(corners: Floats, counts: tuple[int, ...], length: float) -> list[Shape]:
    """Short lines across the middle of each side of a polygon (n, 2), as many as its count; white under black."""
    middle, found = corners.mean(axis=0), list[Shape]()
    for a, b, count in zip(corners, np.roll(corners, -1, axis=0), counts, strict=True):
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
        at = 0.82 * (a + b) / 2 + 0.18 * middle
        inward = (middle - (a + b) / 2) / max(float(np.linalg.norm(middle - (a + b) / 2)), 1e-9)
        for k in range(count):
            foot = at + along * (k - (count - 1) / 2) * 0.45 * length
            line = np.stack([foot - inward * length / 2, foot + inward * length / 2])
            found += [Shape(line, None, "#FFFFFF", 0.34 * length), Shape(line, None, "#000000", 0.17 * length)]
    return found


def _short(name: str) -> str:
    """A part's name as pictures have room for it."""
    return name.replace(" left", " L").replace(" right", " R")


def _towards(normal: Floats) -> list[tuple[float, float]]:
    """Azimuth and elevation from which a normal is seen, not quite from above or below; none where it is zero."""
    length = float(np.linalg.norm(normal))
    if length < 0.1:
        return []
    azimuth, elevation = np.arctan2(normal[1], normal[0]), np.arcsin(np.clip(normal[2] / length, -1, 1))
    return [(float(np.degrees(azimuth)), float(np.clip(np.degrees(elevation), -STEEPEST, STEEPEST)))]


def _seen_faces(flat: Floats, size: int) -> Ints:
    """The triangle (n, 3, 3) that each pixel sees, on a square picture about the origin, where there is one."""
    faces, _, _ = rasterise(flat + np.array([size / 2, size / 2, 0]), size, size)
    return faces[faces >= 0]


def _normal(polygon: Floats) -> Floats:
    """(3,): the unit normal of a flat polygon (Newell)."""
    spokes = polygon[1:] - polygon[0]
    normal = np.cross(spokes[:-1], spokes[1:]).sum(axis=0)
    return normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)


def _tones(normals: Floats) -> Floats:
    """(n,): brightness in [0.45, 1] of faces with normals in view coordinates; the light is left above the viewer."""
    return np.asarray(0.45 + 0.55 * np.maximum(0.0, normals @ np.array([-0.35, 0.5, 0.79])), np.float64)


def _shaded(code: str, tone: float) -> str:
    return "#" + "".join(f"{round(255 * c * tone):02X}" for c in channels(code))
