"""Which files are volumes, which are meshes, and what is asked of any of them before it is opened."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from drkid.errors import InputError

MESH_SUFFIXES = (".stl", ".ply", ".obj", ".off", ".glb", ".3mf")
VOLUME_SUFFIXES = (
    ".mrc",
    ".mrc.gz",
    ".map",
    ".map.gz",
    ".nii",
    ".nii.gz",
    ".tif",
    ".tiff",
    ".nrrd",
    ".npy",
    ".zarr",
)
FOLDER_SUFFIXES = (".zarr",)


def suffix_of(path: Path, suffixes: Sequence[str] = VOLUME_SUFFIXES + MESH_SUFFIXES) -> str | None:
    """The longest of the suffixes that the file's name ends with, in any case; None where there is none."""
    fitting = [suffix for suffix in suffixes if path.name.lower().endswith(suffix)]
    return max(fitting, key=len, default=None)


def is_mesh_path(path: Path) -> bool:
    """True where the file's name says that it is a mesh."""
    return suffix_of(path, MESH_SUFFIXES) is not None


def checked_suffix(path: Path, suffixes: Sequence[str]) -> str:
    """The file's suffix, once it is sure that there is something to read.

    Raises:
        InputError: the suffix is none of `suffixes`, or the file is missing, a folder or empty.
    """
    suffix = suffix_of(path, suffixes)
    if not path.exists():
        raise InputError(f"{path} does not exist", remedy="check the path")
    if suffix is None:
        raise InputError(
            f"{path.name} is of no format that can be read here",
            wanted=f"a name that ends in one of {' '.join(suffixes)}",
            found=path.suffix or "no suffix",
            remedy="save it in one of these formats",
        )
    folder = suffix in FOLDER_SUFFIXES
    if path.is_dir() != folder:
        kinds = ("a file", "a folder")
        raise InputError(f"{path.name} is {kinds[not folder]}", wanted=f"{kinds[folder]} for {suffix}")
    if not folder and path.stat().st_size == 0:
        raise InputError(f"{path.name} is empty (0 bytes)", remedy="export or download it again")
    return suffix


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes; of a folder: of its files' relative names and bytes, in sorted order.

    Raises:
        InputError: it cannot be read.
    """
    total = hashlib.sha256()
    try:
        if path.is_file():
            with path.open("rb") as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
        for name in sorted(file.relative_to(path).as_posix() for file in path.rglob("*") if file.is_file()):
            total.update(name.encode() + b"\0" + (path / name).read_bytes())
    except OSError as error:
        raise InputError(f"{path.name} cannot be read", found=str(error), remedy="check its permissions") from error
    return total.hexdigest()
