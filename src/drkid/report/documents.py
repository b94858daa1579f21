"""The documents of a kit: files by name, each made by one function of the kit."""

from collections.abc import Callable

from drkid.export.coupon import coupon_files
from drkid.export.kit_document import parts_list, printed_meshes
from drkid.export.layout import GUIDE_HTML, GUIDE_PDF, REPORT, picture_file
from drkid.export.plates import plate_files
from drkid.kit import Kit
from drkid.progress import Progress, silent
from drkid.report.guide import Guide
from drkid.report.guide_html import guide_html
from drkid.report.guide_pages import guide_pages
from drkid.report.guide_pdf import guide_pdf
from drkid.report.net import net_files
from drkid.report.part_picture import part_picture
from drkid.report.report import report_html
from drkid.report.scene import scene_of


def _guide(kit: Kit) -> dict[str, bytes]:
    guide = Guide(scene_of(kit))
    pages, closing = guide_pages(guide)
    return {
        GUIDE_HTML: guide_html(guide, pages, closing).encode(),
        GUIDE_PDF: guide_pdf(guide, pages, closing),
    }


def _report(kit: Kit) -> dict[str, bytes]:
    meshes = printed_meshes(kit)
    rows = parts_list(kit, meshes)
    pictures = {row.file: part_picture(meshes[row.file], row.colour) for row in rows if row.file and row.colour}
    page = report_html(scene_of(kit), kit.spec, rows, {file: small for file, (_, small) in pictures.items()})
    return {REPORT: page.encode(), **{picture_file(file): large for file, (large, _) in pictures.items()}}


_MAKERS: tuple[tuple[str, Callable[[Kit], dict[str, bytes]]], ...] = (
    ("plates", plate_files),
    ("net", net_files),
    ("guide", _guide),
    ("report", _report),
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
