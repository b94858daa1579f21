"""Kit → KitDocument and the rows of its parts list."""

from collections import Counter
from dataclasses import asdict
from math import isnan
from typing import Any

import numpy as np

from drkid import __version__
from drkid.curved_patch import barycentric_grid
from drkid.export import document as doc
from drkid.export.bill_of_materials import Moulding, Row, connector_row, moulding, piece_row, rod_row
from drkid.export.layout import connector_file, part_file
from drkid.kit import Distance, Kit, Metrics, Part
from drkid.mesh import Floats, TriMesh, rounded

MOST_RECORDS = 500  # of the convergence history; a plot shows no more


def part_name(part: Part) -> str:
    """The file of a part."""
    return part_file(part.name, part.handedness)


def connector_names(kit: Kit) -> list[str]:
    """The files that a joint of this kit names: both halves of a hinge, one key, or none."""
    files = [connector_file(c.name) for c in kit.part_set.connectors]
    return files * 2 if kit.spec.connector in {"hinge", "snap"} and len(files) == 1 else files


def kit_document(kit: Kit) -> doc.KitDocument:
    """The whole of kit.json."""
    counts = Counter(piece.part for piece in kit.assembly.pieces)
    connectors, merged = connector_names(kit), bool(kit.part_set.merged)
    return doc.KitDocument(
        drkid_version=__version__,
        source=doc.SourceDocument(**asdict(kit.source), scale_mm_per_unit=kit.part_set.scale_mm_per_unit),
        spec=kit.spec.model_dump(mode="json"),
        classes=_classes(kit, counts),
        pieces=[
            doc.PieceDocument(
                face=None if merged else piece.face,
                faces=list(piece.faces) if merged else None,
                class_=kit.part_set.parts[piece.part].name,
                part=part_name(kit.part_set.parts[piece.part]),
                corners=list(piece.vertices),
                transform=_flat(piece.transform),
            )
            for piece in kit.assembly.pieces
        ],
        joints=[
            doc.JointDocument(
                faces=j.faces,
                edge=j.edge,
                dihedral_degrees=j.dihedral_degrees,
                connector=connectors,
                groove_mm=groove,
            )
            for j, groove in zip(kit.assembly.joints, kit.part_set.groove_mm.tolist(), strict=True)
        ],
        hardware=_hardware(kit),
        assembly=[
            doc.StepDocument(step=n, face=step.face, joins=list(step.joins))
            for n, step in enumerate(kit.assembly.steps, 1)
        ],
        metrics=_metrics(kit.metrics),
        convergence=_convergence(kit),
        outcome=doc.OutcomeDocument(**asdict(kit.decomposition.outcome)),
        notes=list(kit.notes),
        findings=[doc.FindingDocument(**asdict(finding)) for finding in kit.part_set.findings],
        patches=_patches(kit),
    )


def _patches(kit: Kit) -> list[doc.PatchDocument] | None:
    """The curved patches in millimetres; None of a kit of flat pieces."""
    if kit.patches is None or not kit.patches.curved:
        return None
    grid = barycentric_grid(kit.spec.subdivision_levels)
    scale = kit.part_set.scale_mm_per_unit
    names = {part.class_index: part.name for part in kit.part_set.parts}
    owners = kit.part_set.split_class or range(len(kit.patches.curved))
    return [
        doc.PatchDocument(
            class_=names[k],
            vertices=kit.patches.curved[owner].scaled(scale).points(grid.points).tolist(),
            faces=grid.faces.tolist(),
        )
        for k, owner in enumerate(owners)
    ]


def kit_summary(kit: Kit) -> dict[str, Any]:
    """What `make --json` prints of a kit: source, parameters, metrics, outcome and notes, as in kit.json; the costs."""
    document = kit_document(kit).model_dump(mode="json", by_alias=True, exclude_none=True)
    summary = {name: document[name] for name in ("source", "spec", "metrics", "outcome", "notes")}
    cost, compared = kit_costs(kit)
    if cost is not None:
        summary["cost"] = {"printed": cost, "moulding": None if compared is None else asdict(compared)}
    return summary


def bom_rows(kit: Kit, volumes_mm3: dict[str, float]) -> list[Row]:
    """The parts list; `volumes_mm3` are those of the written files."""
    counts, spec = Counter(piece.part for piece in kit.assembly.pieces), kit.spec
    rows = [
        piece_row(part_name(part), part.class_index, counts[i], volumes_mm3[part_name(part)], spec)
        for i, part in enumerate(kit.part_set.parts)
    ]
    for item in _hardware(kit):
        if item.file is not None:
            rows.append(connector_row(item.name or item.file, item.file, item.count, volumes_mm3[item.file], spec))
        else:
            rows.append(rod_row(item.diameter or 0.0, item.length or 0.0, item.count, spec))
    return rows


def kit_costs(kit: Kit) -> tuple[float | None, Moulding | None]:
    """What printing everything costs, spares included, and the comparison with moulding; None without prices."""
    rows = bom_rows(kit, {name: mesh.volume for name, mesh in printed_meshes(kit).items()})
    costs = [row.total_cost for row in rows if row.total_cost is not None]
    return (sum(costs) if costs else None), moulding(rows, kit.spec)


def printed_meshes(kit: Kit) -> dict[str, TriMesh]:
    """The mesh of each printed part as its file holds it, by the file's name."""
    solids = {part_name(part): part.solid for part in kit.part_set.parts}
    solids |= {connector_file(c.name): c.solid for c in kit.part_set.connectors}
    return {name: rounded(solid.mesh()) for name, solid in solids.items()}


def parts_list(kit: Kit, meshes: dict[str, TriMesh]) -> list[Row]:
    """The rows of the parts list; `meshes` are those of `printed_meshes`."""
    return bom_rows(kit, {name: mesh.volume for name, mesh in meshes.items()})


def _classes(kit: Kit, counts: Counter[int]) -> list[doc.ClassDocument]:
    classes: list[doc.ClassDocument] = []
    for index, lengths in enumerate(kit.decomposition.class_lengths.tolist()):
        numbers = [i for i, part in enumerate(kit.part_set.parts) if part.class_index == index]
        parts = [kit.part_set.parts[i] for i in numbers]
        classes.append(
            doc.ClassDocument(
                id=parts[0].name,
                count=sum(counts[i] for i in numbers),
                edge_lengths=[x for x in lengths if not isnan(x)],
                mirror_symmetric=parts[0].handedness == "any",
                parts=[
                    doc.PartDocument(
                        file=part_name(part),
                        handedness=part.handedness,
                        count=counts[i],
                        corners=part.corners.tolist(),
                        sides=[doc.SideDocument(connector_frame=_flat(frame)) for frame in part.side_frames],
                    )
                    for i, part in zip(numbers, parts, strict=True)
                ],
            )
        )
    return classes


def _hardware(kit: Kit) -> list[doc.HardwareDocument]:
    joints, dimensions = len(kit.assembly.joints), kit.part_set.dimensions
    names = connector_names(kit)
    items = [
        doc.HardwareDocument(
            name=c.name, file=connector_file(c.name), count=joints * names.count(connector_file(c.name))
        )
        for c in kit.part_set.connectors
    ]
    if kit.spec.connector == "hinge":
        items.append(
            doc.HardwareDocument(
                name="rod", diameter=dimensions.rod_diameter_mm, length=dimensions.rod_length_mm, count=joints
            )
        )
    return items


def _metrics(metrics: Metrics) -> doc.MetricsDocument:
    def distance(d: Distance) -> doc.DistanceDocument:
        return doc.DistanceDocument(mean_percent=d.mean_percent, max_percent=d.max_percent)

    plain = asdict(metrics)
    names = set(doc.MetricsDocument.model_fields) & set(plain)
    curved, merged = plain.pop("curved"), plain.pop("merged")
    return doc.MetricsDocument(
        **{name: plain[name] for name in names - {"curved", "merged"}},
        curved=None if curved is None else doc.CurvedDocument(**curved),
        merged=None if merged is None else doc.MergedDocument(**merged),
        hausdorff=doc.HausdorffDocument(
            surface_simplified=distance(metrics.surface_simplified),
            simplified_assembled=distance(metrics.simplified_assembled),
            surface_assembled=distance(metrics.surface_assembled),
        ),
        dihedral=doc.DihedralDocument(
            mean_degrees=metrics.dihedral_mean_degrees,
            p95_degrees=metrics.dihedral_p95_degrees,
            concave_percent=metrics.concave_percent,
        ),
        groove=doc.GrooveDocument(
            mean_mm=metrics.groove_mean_mm,
            max_mm=metrics.groove_max_mm,
            choices=[doc.GrooveChoiceDocument(**asdict(choice)) for choice in metrics.groove_choices],
        ),
    )


def _convergence(kit: Kit) -> list[doc.ConvergenceDocument]:
    """Evenly thinned, the first and the last record kept."""
    records = kit.decomposition.convergence
    chosen = np.unique(np.linspace(0, len(records) - 1, min(len(records), MOST_RECORDS)).round().astype(int))
    return [doc.ConvergenceDocument(**asdict(records[i])) for i in chosen.tolist()]


def _flat(matrix: Floats) -> list[float]:
    return matrix.ravel().tolist()
