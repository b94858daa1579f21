"""Plates are read back by lib3mf, whose reader is strict, and measured by the solids themselves."""

import csv
import io
import re
from dataclasses import replace
from itertools import combinations

import lib3mf
import numpy as np
import pytest

from drkid.errors import FitError
from drkid.export.bill_of_materials import bom_csv
from drkid.export.kit_document import bom_rows, printed_meshes
from drkid.export.plates import plate_files, plates
from drkid.export.three_mf import read_three_mf
from drkid.kit import BRIDGE
from drkid.mesh import TriMesh
from drkid.print_orientation import print_orientation, widest_bridge_mm
from drkid.solid import Solid


@pytest.fixture(scope="module")
def spared(kit):
    return replace(kit, spec=kit.spec.model_copy(update={"spares": "5%"}))


@pytest.fixture(scope="module")
def written(spared):
    return plate_files(spared)


def read(content: bytes) -> lib3mf.Model:
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromBuffer(content)
    assert reader.GetWarningCount() == 0
    return model


def every(iterator):
    while iterator.MoveNext():
        yield iterator.GetCurrent()


def items(model: lib3mf.Model) -> list[tuple[str, Solid]]:
    found = []
    for item in every(model.GetBuildItems()):
        stored = model.GetMeshObjectByID(item.GetObjectResource().GetResourceID())
        vertices = np.array([list(p.Coordinates) for p in stored.GetVertices()])
        faces = np.array([list(t.Indices) for t in stored.GetTriangleIndices()])
        matrix = np.array([list(row) for row in item.GetObjectTransform().Fields], float)
        assert np.linalg.det(matrix[:3]) == pytest.approx(1, abs=1e-5)
        found.append((stored.GetName(), Solid.of(TriMesh(vertices @ matrix[:3] + matrix[3], faces))))
    return found


def test_plates_hold_count_and_spares_of_every_part(spared, written):
    volumes = {name: mesh.volume for name, mesh in printed_meshes(spared).items()}
    rows = csv.DictReader(io.StringIO(bom_csv(bom_rows(spared, volumes))))
    wanted = {f"{r['file']}": int(r["count"]) + int(r["spare"]) for r in rows if r["file"]}
    found = dict.fromkeys(wanted, 0)
    for content in written.values():
        for name, solid in items(read(content)):
            found[f"parts/{name}.stl"] += 1
            assert solid.volume == pytest.approx(volumes[f"parts/{name}.stl"], rel=1e-5)
    assert found == wanted
    assert any(int(value) for value in found.values())


def test_items_lie_on_the_bed_inside_it_and_apart(spared, written):
    for content in written.values():
        solids = [solid for _, solid in items(read(content))]
        bounds = np.array([solid.bounds for solid in solids])
        assert bounds[:, 0, 2] == pytest.approx(0, abs=1e-4)
        assert (bounds[:, 0, :2] > 4.99).all()
        assert (bounds[:, 1] < np.array(spared.spec.bed_mm) - [4.99, 4.99, 0]).all()
        for i, j in combinations(range(len(solids)), 2):
            if (bounds[i, 0] < bounds[j, 1] + 2).all() and (bounds[j, 0] < bounds[i, 1] + 2).all():
                assert solids[i].gap(solids[j], 3.0) > 1.99


def test_meshes_are_stored_once_manifold_named_and_coloured(written):
    for content in written.values():
        model = read(content)
        stored = list(every(model.GetMeshObjects()))
        assert len({one.GetName() for one in stored}) == len(stored) > 0
        assert all(one.IsManifoldAndOriented() for one in stored)
        groups = list(every(model.GetBaseMaterialGroups()))
        assert len(groups) == 1
        assert len({(c := groups[0].GetDisplayColor(i)).Red * 65536 + c.Green * 256 + c.Blue
                    for i in groups[0].GetAllPropertyIDs()}) == 1  # fmt: skip


def test_the_same_kit_makes_the_same_bytes(spared, written):
    assert plate_files(spared) == written


def test_nothing_needs_support(kit):
    for mesh in printed_meshes(kit).values():
        turn = print_orientation(mesh)
        assert np.linalg.det(turn) == pytest.approx(1)
        assert widest_bridge_mm(mesh.moved(mesh.vertices @ turn.T)) < 3


def test_findings_tell_the_bridges_of_all_that_lies_on_the_plates(kit, written):
    told = {f.subject.removeprefix("class "): f.available for f in kit.part_set.findings if f.what == BRIDGE}
    for content in written.values():
        for one in read_three_mf(content):
            name = re.sub("_(left|right)$", r" (\1)", one.name).replace("_", " ")
            for matrix in one.transforms:
                lying = one.mesh.moved(one.mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])
                assert widest_bridge_mm(lying) == pytest.approx(told[name], abs=0.02)
    assert len(told) == len(kit.part_set.parts) + 1


@pytest.mark.parametrize("bed", [(25.0, 25.0, 250.0), (220.0, 220.0, 4.0)])
def test_a_bed_that_is_too_small_is_refused(kit, bed):
    small = replace(kit, spec=kit.spec.model_copy(update={"bed_mm": bed}))
    with pytest.raises(FitError, match="larger than the bed"):
        plates(small)
