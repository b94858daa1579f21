"""A kit folder read back: its document and its meshes."""

from pathlib import Path

import trimesh
from pydantic import ValidationError

from drkid.errors import KitFolderError
from drkid.export.document import KitDocument
from drkid.export.layout import KIT_JSON


def read_document(folder: Path) -> KitDocument:
    """kit.json of a kit folder.

    Raises:
        KitFolderError: the folder is no kit, or its kit.json is not as the schema says.
    """
    path = folder / KIT_JSON
    try:
        return KitDocument.model_validate_json(path.read_bytes())
    except OSError as error:
        raise KitFolderError(
            f"{folder} is no kit", wanted=f"a folder with a {KIT_JSON}", found=str(error.strerror or error)
        ) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise broken_file(path, "what `drkid schema` prints", f"{where}: {first['msg']}") from error


def read_mesh(path: Path) -> trimesh.Trimesh:
    """A PLY or STL file as it is.

    Raises:
        KitFolderError: the file is missing or cannot be read.
    """
    try:
        return trimesh.load_mesh(path, process=False)
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise broken_file(path, "a mesh", f"{type(error).__name__}: {error}") from error


def broken_file(path: Path, wanted: str, found: str) -> KitFolderError:
    """The error for a file of a kit that is not as it was written."""
    return KitFolderError(f"{path} cannot be used", wanted=wanted, found=found, remedy="make the kit again")
