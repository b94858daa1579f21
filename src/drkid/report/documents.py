"""The documents of a kit: files by name, each made by one function of the kit."""

from collections.abc import Callable

from drkid.export.coupon import coupon_files
from drkid.export.plates import plate_files
from drkid.kit import Kit
from drkid.progress import Progress, silent
from drkid.report.net import net_files

_MAKERS: tuple[tuple[str, Callable[[Kit], dict[str, bytes]]], ...] = (
    ("plates", plate_files),
    ("net", net_files),
    ("fit coupon", coupon_files),
)
"""What the progress line says, and the function that makes the files, by their names in the kit folder."""


def make_documents(kit: Kit, progress: Progress = silent) -> dict[str, bytes]:
    """Every document of the kit by its file's name; the same kit makes the same bytes."""
    files: dict[str, bytes] = {}
    for i, (what, make) in enumerate(_MAKERS):
        progress(what, i / len(_MAKERS))
        files |= make(kit)
    return files
