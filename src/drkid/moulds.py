"""Moulds that exist already: lengths taken from another kit, and the number of pieces at which they make a size."""

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from drkid.errors import KitFolderError, SpecError
from drkid.export import KitDocument
from drkid.export.layout import KIT_JSON
from drkid.mesh import TriMesh
from drkid.spec import MULTISETS, KitSpec, letters_of, multiset_words

SAME_LENGTH = 1e-6  # relative: lengths of a kit that differ by less are one length
DECIMALS = 9  # of a length in mm that is taken from a kit
NEAR = 0.01  # relative: a mean edge this near to the palette's is left as it is
AGREEING = 0.05  # relative: the search moves the size by some per mille, labels by a little more
LETTERS = {2: "sl", 3: "abc"}


def with_moulds_of(spec: KitSpec) -> KitSpec:
    """The spec with the lengths and triangles of the kit that `spec.like` names; the same spec where it names none.

    Raises:
        KitFolderError: there is no kit at that path.
        SpecError: the kit has other than two or three lengths, or another number of classes than asked for.
    """
    if spec.like is None:
        return spec
    document = _kit_at(spec.like)
    sides = [one.edge_lengths for one in document.classes]
    lengths = _distinct(sorted(x for three in sides for x in three))
    if len(lengths) not in LETTERS:
        raise SpecError(
            f"the pieces of {spec.like} cannot be taken over",
            wanted="a kit whose edges have two or three lengths, made by --method palette",
            found=f"{len(lengths)} lengths",
            remedy="another kit, or --palette",
        )
    letters = LETTERS[len(lengths)]
    words = {"".join(letters[np.abs(np.subtract(lengths, x)).argmin()] for x in three) for three in sides}
    if "classes" in spec.model_fields_set and spec.classes != len(words):
        raise SpecError(
            f"the pieces of {spec.like} are not of {spec.classes} classes",
            wanted=f"its {len(words)} classes ({', '.join(sorted(words))})",
            found=f"classes {spec.classes}",
            remedy="leave --classes out",
        )
    own = {"like": None, "palette": lengths, "multisets": ",".join(words), "classes": len(words)}
    return KitSpec.parse(_mould_values(document) | spec.model_dump(exclude_unset=True) | own)


def _mould_values(document: KitDocument) -> dict[str, Any]:
    """What shapes a kit's pieces besides their sides: process, thickness, bevel, connector and clearances."""
    groups = {name: field.json_schema_extra for name, field in KitSpec.model_fields.items()}
    shaping = {name for name, group in groups.items() if group == {"group": "Pieces"}} - {
        "size_mm",
        "mean_edge_mm",
        "fit",
        "bed_mm",
        "bevel_variants",  # pieces of given lengths have one bevel
    }
    return {name: value for name, value in document.spec.items() if name in shaping and value is not None}


def faces_at_size(surface: TriMesh, spec: KitSpec) -> int:
    """Even number of faces at which equilateral triangles of the palette's mean edge cover M_i, printed `size_mm` long.

    Raises:
        SpecError: that print is smaller than any closed surface of such triangles.
    """
    size, mean = _size_and_mean_mm(spec)
    area = float(surface.areas.sum()) * (size / float(surface.extents.max())) ** 2
    return _even(area / (np.sqrt(3) / 4 * mean**2), spec)


def corrected_faces(simplified: TriMesh, spec: KitSpec) -> int:
    """The faces of M_s, or, where its mean edge misses the palette's at this size, the even number at which it fits.

    Raises:
        SpecError: that print is smaller than any closed surface of such triangles.
    """
    faces, miss = len(simplified.faces), _times_too_long(simplified, spec)
    return faces if abs(miss - 1) <= NEAR else _even(faces * miss**2, spec)


def require_agreement(simplified: TriMesh, spec: KitSpec) -> None:
    """Check that M_s, made of the palette's edges, is about as long as `spec.size_mm`.

    Raises:
        SpecError: it is not; says which faces have that size, and which size those faces have.
    """
    miss = _times_too_long(simplified, spec)
    if abs(miss - 1) <= AGREEING:
        return
    size, _ = _size_and_mean_mm(spec)
    faces, fitting = len(simplified.faces), _even(len(simplified.faces) * miss**2, spec)
    raise SpecError(
        f"{faces} pieces with edges of {lengths_text(spec)} do not make a print of {size:g} mm",
        wanted=f"about {size / miss:.0f} mm with {faces} faces, or about {fitting} faces at {size:g} mm",
        found=f"{size:g} mm and {faces} faces",
        remedy=f"--faces {fitting}, or --size-mm {size / miss:.0f}; either may be left out and follows from the other",
    )


def size_notes(spec: KitSpec, printed: TriMesh) -> tuple[str, ...]:
    """What given lengths make of the size, in a sentence; none where there are none. `printed` in mm."""
    if spec.palette is None:
        return ()
    size = float(printed.extents.max())
    return (f"Edges of {lengths_text(spec)}, as given: {len(printed.faces)} pieces are {size:.1f} mm long.",)


def lengths_text(spec: KitSpec) -> str:
    """The palette as people read it: '30 and 35.1 mm'."""
    words = [f"{x:g}" for x in spec.palette or ()]
    return f"{', '.join(words[:-1])} and {words[-1]} mm"


def _times_too_long(simplified: TriMesh, spec: KitSpec) -> float:
    """How many times too long `spec.size_mm` is for M_s with the palette's mean edge; less than 1 where too short."""
    size, mean = _size_and_mean_mm(spec)
    return size / (mean / simplified.mean_edge * float(simplified.extents.max()))


def _size_and_mean_mm(spec: KitSpec) -> tuple[float, float]:
    """The size asked for, and the mean of the palette's lengths over its triangles, each as often as another."""
    if spec.size_mm is None or spec.palette is None:
        message = "size_mm and palette are needed"
        raise ValueError(message)
    words = multiset_words(spec.multisets or (MULTISETS[spec.classes] if len(spec.palette) == 2 else "abc"))
    letters = letters_of(words)
    return spec.size_mm, float(np.mean([spec.palette[letters.index(c)] for c in "".join(words)]))


def _even(faces: float, spec: KitSpec) -> int:
    even = 2 * round(faces / 2)
    if even >= 4:
        return even
    raise SpecError(
        f"a print of {spec.size_mm:g} mm is too small for edges of {lengths_text(spec)}",
        wanted="room for four pieces at least",
        found=f"room for {faces:.1f}",
        remedy="a larger --size-mm, or shorter lengths",
    )


def _distinct(ascending: list[float]) -> tuple[float, ...]:
    found: list[float] = []
    for x in ascending:
        if not found or x > found[-1] * (1 + SAME_LENGTH):
            found.append(x)
    return tuple(round(x, DECIMALS) for x in found)


def _kit_at(path: Path) -> KitDocument:
    file = path / KIT_JSON if path.is_dir() else path
    try:
        return KitDocument.model_validate_json(file.read_bytes())
    except OSError as error:
        raise KitFolderError(
            f"{path} is no kit",
            wanted=f"a kit folder or its {KIT_JSON}",
            found=str(error.strerror or error),
            remedy="--like with the folder that `drkid make` wrote",
        ) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise KitFolderError(
            f"{file} cannot be used",
            wanted="what `drkid schema` prints",
            found=f"{where}: {first['msg']}",
            remedy="make the kit again",
        ) from error
