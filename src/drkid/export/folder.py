"""The kit folder: written to a temporary sibling and renamed when complete, so that what exists is whole."""

import json
import shutil
import tempfile
from pathlib import Path

from drkid.errors import KitFolderError
from drkid.export.bill_of_materials import bom_csv, bom_json
from drkid.export.kit_document import kit_document, parts_list, printed_meshes
from drkid.export.layout import (
    ASSEMBLED,
    BOM_CSV,
    BOM_JSON,
    KIT_JSON,
    PIECE_CLASS,
    SIMPLIFIED,
    SURFACE,
)
from drkid.export.ply import ply_bytes
from drkid.export.stl import stl_bytes
from drkid.kit import Kit
from drkid.progress import StageProgress, nobody


def require_writable(folder: Path, force: bool) -> None:
    """Refuse early, before anything is computed, a folder that could not be written at the end.

    Raises:
        KitFolderError: it exists and `force` is not given, it is no kit folder, or its parent cannot be written.
    """
    if folder.exists():
        _require_replaceable(folder, force)
    parent = next(p for p in folder.absolute().parents if p.exists())
    try:
        with tempfile.TemporaryDirectory(dir=parent, prefix=".drkid-"):
            pass
    except OSError as error:
        raise _unwritable(folder, error) from error


def _require_replaceable(folder: Path, force: bool) -> None:
    if not force:
        raise KitFolderError(
            f"{folder} exists",
            wanted="a new folder",
            found="a folder" if folder.is_dir() else "a file",
            remedy="another --out, or --force to replace it",
        )
    empty = folder.is_dir() and not any(folder.iterdir())
    if not (empty or (folder / KIT_JSON).is_file()):
        raise KitFolderError(
            f"{folder} is not a kit and will not be replaced",
            wanted=f"an empty folder, or one that holds a {KIT_JSON}",
            found="a folder of other things" if folder.is_dir() else "a file",
            remedy="another --out",
        )


def write_kit(kit: Kit, folder: Path, force: bool = False, progress: StageProgress = nobody) -> Path:
    """Write the whole kit folder (kit-format, version 1) or nothing; returns its path.

    Raises:
        KitFolderError: as `require_writable`, or the disk refuses.
    """
    require_writable(folder, force)
    documents = _documents(kit, progress)
    progress("export", "", 0.0)
    folder = folder.absolute()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        for name, content in (kit_files(kit) | documents).items():
            path = staging / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
        staging.chmod(0o755)
        _swap(staging, folder)
    except OSError as error:
        raise _unwritable(folder, error) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    progress("export", "", 1.0)
    return folder


def _documents(kit: Kit, progress: StageProgress) -> dict[str, bytes]:
    if not kit.spec.documents:
        return {}
    progress("documents", "", 0.0)
    made = kit.documents(kit, lambda what, fraction: progress("documents", what, fraction))
    progress("documents", "", 1.0)
    return made


def _swap(staging: Path, folder: Path) -> None:
    """Put the new folder in the old one's place; the old one is deleted only after that."""
    if not folder.exists():
        staging.rename(folder)
        return
    retired = staging.with_name(staging.name + "-replaced")
    folder.rename(retired)
    try:
        staging.rename(folder)
    except OSError:
        retired.rename(folder)
        raise
    shutil.rmtree(retired)


def kit_files(kit: Kit) -> dict[str, bytes]:
    """Every file of the kit folder but its documents, by its name."""
    meshes = printed_meshes(kit)
    rows = parts_list(kit, meshes)
    document = kit_document(kit).model_dump(mode="json", by_alias=True, exclude_none=True)
    document["spec"] = kit.spec.model_dump(mode="json")
    return {
        SURFACE: ply_bytes(kit.surface),
        SIMPLIFIED: ply_bytes(kit.simplified),
        ASSEMBLED: ply_bytes(kit.decomposition.mesh, **{PIECE_CLASS: kit.decomposition.face_class}),
        **{name: stl_bytes(mesh) for name, mesh in meshes.items()},
        BOM_CSV: bom_csv(rows).encode(),
        BOM_JSON: bom_json(rows).encode(),
        KIT_JSON: (json.dumps(document, indent=1) + "\n").encode(),
    }


def _unwritable(folder: Path, error: OSError) -> KitFolderError:
    return KitFolderError(
        f"{folder} cannot be written",
        wanted="a place where a folder can be made",
        found=error.strerror or str(error),
        remedy="another --out, or its permissions and free space",
    )
