"""OME-Zarr 0.4 and 0.5 (ngff), and plain Zarr arrays: the finest level, axes as `multiscales` names them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from drkid.errors import InputError
from drkid.volume.physical_unit import in_known_unit
from drkid.volume.stored import Spacing, Stored

FAULTS: tuple[type[Exception], ...] = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    RuntimeError,
    MemoryError,
    json.JSONDecodeError,
)


def read(path: Path) -> Stored:
    """The first dataset of the first multiscale image, or the array itself.

    Raises:
        InputError: zarr is not installed.
    """
    try:
        import zarr  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InputError(
            "Zarr folders need the zarr package", found="it is not installed", remedy='pip install "drkid[zarr]"'
        ) from error
    node: Any = zarr.open(path, mode="r")
    if isinstance(node, zarr.Array):
        return Stored(np.asarray(node[...]), "", None, None)
    attributes: dict[str, Any] = dict(node.attrs)
    image: dict[str, Any] = attributes.get("ome", attributes)["multiscales"][0]
    level: dict[str, Any] = image["datasets"][0]
    array = node[level["path"]]
    axes: list[dict[str, str]] = [a if isinstance(a, dict) else {"name": a} for a in image.get("axes", "tczyx")]
    spacing, unit = in_known_unit(_scale(image, level, axes), [_unit(axes, name) for name in "xyz"])
    return Stored(np.asarray(array[...]), "".join(axis["name"].lower() for axis in axes), spacing, unit)


def _scale(image: dict[str, Any], level: dict[str, Any], axes: list[dict[str, str]]) -> Spacing:
    """Product of the level's and the image's `scale` transformations along x, y, z."""
    total = np.ones(len(axes))
    for holder in (level, image):
        for step in holder.get("coordinateTransformations", []):
            total *= np.asarray(step.get("scale", 1.0), float)
    size = {axis["name"].lower(): float(scale) for axis, scale in zip(axes, total, strict=True)}
    return size.get("x", 1.0), size.get("y", 1.0), size.get("z", 1.0)


def _unit(axes: list[dict[str, str]], name: str) -> str:
    return next((axis.get("unit", "") for axis in axes if axis["name"].lower() == name), "")
