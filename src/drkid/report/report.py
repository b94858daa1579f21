"""The report: one HTML page without a network, with the kit in 3D, its plots and its tables."""

import base64
import json
from collections.abc import Mapping
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np

from drkid.export.bill_of_materials import Row, moulding
from drkid.export.colour import class_colour
from drkid.mesh import Floats, TriMesh
from drkid.report import plot
from drkid.report.colouring import RAMP, UNITS
from drkid.report.decimation import clustered
from drkid.report.kit_picture import view_named
from drkid.report.parts_list import moulding_section, parts_table
from drkid.report.scene import Scene
from drkid.report.tables import classes_table, metrics_table, paper_table, summary_table
from drkid.spec import KitSpec

GHOST_FACES = 8000  # of M_i in the page
MATRIX_DIGITS = 6  # after the point, of mm and of direction cosines: far below a pixel


def report_html(scene: Scene, spec: KitSpec, rows: list[Row], pictures: Mapping[str, bytes]) -> str:
    """The page, self-contained: data, styles, scripts and the licence of three.js are in it.

    `rows` are the parts list, `pictures` those of the parts, PNG by the part's file.
    """
    document = scene.document
    metrics, pieces = document.metrics, len(document.pieces)
    moulds = f"{metrics.unique_piece_parts} mould{'s' if metrics.unique_piece_parts > 1 else ''}"
    summary = (
        f"{pieces} pieces in {metrics.classes} classes from {moulds}, made of {document.source.name}; "
        f"{' × '.join(f'{x:.0f}' for x in scene.assembled.extents)} mm. "
        f"Solver: {document.outcome.message}."
    )
    return Template(_page("report.html")).substitute(
        title=escape(f"Kit of {document.source.name}"),
        summary=escape(summary),
        style=_page("report.css"),
        script=_page("report.js"),
        three=_vendored("three.iife.min.js"),
        licence=_vendored("three.LICENSE"),
        data=json_in_html(_data(scene)),
        pieces=str(pieces),
        classes=classes_table(document),
        short=summary_table(document),
        parts=parts_table(rows, pictures, spec),
        moulding=moulding_section(moulding(rows, spec), rows, spec),
        histogram=_histogram(scene),
        convergence=_convergence(scene),
        table=paper_table(document),
        metrics=metrics_table(document),
        notes="".join(f"<p>Note: {escape(note)}</p>" for note in document.notes),
        version=escape(document.drkid_version),
    )


def json_in_html(data: object) -> str:
    """JSON that no HTML parser takes for markup, whatever names are in it."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _page(name: str) -> str:
    return (files("drkid.report") / "page" / name).read_text(encoding="utf-8")


@cache
def _vendored(name: str) -> str:
    return (files("drkid.report") / "vendor" / name).read_text(encoding="utf-8")


# ---- the data of the 3D part


def _data(scene: Scene) -> dict[str, Any]:
    document = scene.document
    part_number = {file: i for i, file in enumerate(scene.parts)}
    figures = {"error": scene.error_percent, "bend": scene.bend_degrees, "distance": scene.distance_percent}
    return {
        "classes": [{"id": one.id, "colour": class_colour(i)} for i, one in enumerate(document.classes)],
        "parts": [{"file": file, **_packed(mesh)} for file, mesh in scene.parts.items()],
        "pieces": _pieces(scene, part_number, figures),
        "surface": _packed(clustered(scene.surface, GHOST_FACES)),
        "ramp": RAMP,
        "units": {"error": UNITS["error"], "bend": UNITS["dihedral"], "distance": UNITS["distance"]},
        "most": {name: float(values.max()) for name, values in figures.items()},
        "middle": scene.middle.tolist(),
        "radius": float(np.linalg.norm(scene.assembled.vertices - scene.middle, axis=1).max()),
        "eye": view_named(scene, "broad")[2].tolist(),
    }


def _pieces(scene: Scene, part_number: dict[str, int], figures: dict[str, Floats]) -> list[dict[str, Any]]:
    document = scene.document
    hands = {part.file: part.handedness for one in document.classes for part in one.parts}
    joints: list[list[tuple[int, float]]] = [[] for _ in document.pieces]
    for (a, b), joint in zip(scene.joint_pieces.tolist(), document.joints, strict=True):
        joints[a].append((b, round(joint.dihedral_degrees, 2)))
        joints[b].append((a, round(joint.dihedral_degrees, 2)))
    return [
        {
            "face": piece.first_face,
            "step": int(scene.piece_step[i]),
            "class": int(scene.piece_class[i]),
            "part": part_number[piece.part],
            "hand": hands[piece.part],
            "matrix": [round(x, MATRIX_DIGITS) for x in piece.transform[:12]],
            "joints": joints[i],
            **{name: float(f"{values[i]:.4g}") for name, values in figures.items()},
        }
        for i, piece in enumerate(document.pieces)
    ]


def _packed(mesh: TriMesh) -> dict[str, str]:
    """Vertices as base64 of float32, corners of faces as base64 of uint16, or of uint32 where these are too few."""
    index = "<u2" if len(mesh.vertices) < 2**16 else "<u4"
    arrays = {"vertices": mesh.vertices.astype("<f4"), "faces": mesh.faces.astype(index)}
    return {name: base64.b64encode(array.tobytes()).decode("ascii") for name, array in arrays.items()}


# ---- plots


def _histogram(scene: Scene) -> str:
    colours = [class_colour(int(index)) for index in scene.piece_class]
    names = [
        f"piece {step}: {error:.3g} %"
        for step, error in zip(scene.piece_step.tolist(), scene.error_percent.tolist(), strict=True)
    ]
    return plot.bars(scene.error_percent, colours, names, ("face", "error, % of the mean edge"))


def _convergence(scene: Scene) -> str:
    records = scene.document.convergence
    if len(records) < 2:
        return "<p>The solver kept no history.</p>"
    series = {
        "largest": np.array([record.error_max_percent for record in records]),
        "mean": np.array([record.error_mean_percent for record in records]),
    }
    tolerance = scene.document.spec.get("tolerance_percent")
    limit = None if tolerance is None else (f"tolerance {tolerance:g} %", float(tolerance))
    steps = np.array([record.iteration for record in records], np.float64)
    return plot.lines(steps, series, ("iteration", "error, % of the mean edge"), limit)
