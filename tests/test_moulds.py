"""Moulds that exist already: what is read from a kit, how many pieces make a size, and kits made of given lengths."""

import json
import shutil

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits

from drkid.cli import run
from drkid.errors import FitError, KitFolderError, SpecError
from drkid.kit import Kit
from drkid.moulds import corrected_faces, faces_at_size, require_agreement, size_notes, with_moulds_of
from drkid.pipeline import make_kit
from drkid.spec import UNIVERSAL, UNIVERSAL_BEVEL, KitSpec

FEW = KitSpec(palette=UNIVERSAL, faces=40, rounds=1, tolerance_percent=30)


@pytest.fixture(scope="module", autouse=True)
def one_blas_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="module")
def pair_kit(potato_file) -> Kit:
    return make_kit(potato_file, FEW)


@pytest.fixture(scope="module")
def pair_folder(pair_kit, tmp_path_factory):
    return pair_kit.write(tmp_path_factory.mktemp("pair") / "potato")


def printed_lengths(kit: Kit) -> set[float]:
    return set(np.unique(kit.decomposition.class_lengths.round(9)).tolist())


# ---- kits


def test_printed_lengths_are_exactly_those_given(pair_kit):
    assert printed_lengths(pair_kit) == set(UNIVERSAL)
    for part in pair_kit.part_set.parts:
        sides = np.linalg.norm(np.roll(part.corners, -1, axis=0) - part.corners, axis=1)
        assert np.abs(sides[:, None] - UNIVERSAL).min(axis=1).max() < 1e-9


def test_the_spec_of_a_kit_makes_the_same_kit_again(pair_kit, potato_file):
    assert pair_kit.spec.palette == UNIVERSAL
    assert pair_kit.spec.size_mm is None
    again = make_kit(potato_file, KitSpec.parse(pair_kit.spec.model_dump(mode="json")))
    assert again.spec == pair_kit.spec
    assert again.notes == pair_kit.notes
    assert (again.decomposition.mesh.vertices == pair_kit.decomposition.mesh.vertices).all()


def test_the_note_tells_what_size_the_lengths_make(pair_kit):
    size = float(pair_kit.decomposition.mesh.extents.max())
    notes = size_notes(FEW, pair_kit.decomposition.mesh)
    assert set(notes) <= set(pair_kit.notes)
    assert f"40 pieces are {size:.1f} mm long" in notes[0]
    assert "35 and 41 mm" in notes[0]
    assert size_notes(KitSpec(), pair_kit.decomposition.mesh) == ()


def test_two_shapes_of_one_palette_have_the_same_parts(pair_kit, pebble, tmp_path):
    path = tmp_path / "pebble.stl"
    trimesh.Trimesh(pebble.vertices * [1, 1.3, 1], pebble.faces, process=False).export(path)
    other = make_kit(path, FEW.model_copy(update={"faces": 44}))
    named = ((pair_kit, "one"), (other, "two"))
    for one, two in zip(pair_kit.part_set.parts, other.part_set.parts, strict=True):
        assert one.solid.volume == pytest.approx(two.solid.volume, abs=1e-6)
        assert (one.solid & two.solid).volume == pytest.approx(one.solid.volume, abs=1e-4)
    files = [{f.name: f.read_bytes() for f in (k.write(tmp_path / n) / "parts").iterdir()} for k, n in named]
    assert files[0] == files[1]
    one, two = (kit.part_set.connectors[0].solid for kit in (pair_kit, other))
    assert (one & two).volume == pytest.approx(one.volume, abs=1e-6)


def test_a_size_chooses_the_number_of_pieces(potato_file, pair_kit):
    size = 1.25 * float(pair_kit.decomposition.mesh.extents.max())
    kit = make_kit(potato_file, FEW.model_copy(update={"faces": None, "size_mm": size}))
    assert kit.decomposition.mesh.extents.max() == pytest.approx(size, rel=0.06)
    assert len(kit.decomposition.mesh.faces) == pytest.approx(1.25**2 * 40, rel=0.15)
    assert kit.spec.faces == len(kit.decomposition.mesh.faces)
    assert printed_lengths(kit) == set(UNIVERSAL)


def test_faces_and_size_that_disagree_are_refused_before_the_search(potato_file):
    seen: list[str] = []
    spec = FEW.model_copy(update={"size_mm": 300.0})
    with pytest.raises(SpecError, match="40 pieces with edges of 35 and 41") as caught:
        make_kit(potato_file, spec, lambda stage, *_: seen.append(stage))
    assert "congruence" not in seen
    assert "40 faces" in caught.value.found
    fitting = int(caught.value.remedy.split("--faces ")[1].split(",")[0])
    assert fitting % 2 == 0
    make_kit(potato_file, spec.model_copy(update={"faces": fitting, "connector": "none"}))


def test_lengths_too_short_for_the_connector_are_refused_with_those_that_are_not(potato_file):
    with pytest.raises(FitError, match=r"wall between two pockets.*20, 23\.4|20, 20, 23\.4") as caught:
        make_kit(potato_file, FEW.model_copy(update={"palette": (20.0, 23.4)}))
    assert float(caught.value.wanted.split()[0]) > float(caught.value.found.split()[0])
    longer = caught.value.remedy.split("--palette ")[1].split(")")[0]
    kit = make_kit(potato_file, KitSpec.parse(FEW.model_dump(exclude_unset=True) | {"palette": longer}))
    assert printed_lengths(kit) == {float(word) for word in longer.split(",")}


# ---- like another kit


def test_a_kit_like_another_has_its_lengths_triangles_and_pieces(pair_folder):
    for path in (pair_folder, pair_folder / "kit.json"):
        spec = with_moulds_of(KitSpec(like=path, faces=60))
        assert spec.like is None
        assert (spec.palette, spec.multisets, spec.classes) == (UNIVERSAL, "ssl,sll", 2)
        assert spec.bevel_degrees == UNIVERSAL_BEVEL
        assert (spec.faces, spec.thickness_mm, spec.rod_diameter_mm) == (60, 6.9, 1.75)


def test_a_kit_like_one_with_bevel_variants_has_one_bevel(pair_folder, tmp_path):
    document = json.loads((pair_folder / "kit.json").read_text())
    document["spec"] |= {"bevel_variants": 2, "bevel_degrees": None}
    document["classes"] = [one | {"id": one["id"] + n} for one in document["classes"] for n in "12"]
    (tmp_path / "kit.json").write_text(json.dumps(document))
    spec = with_moulds_of(KitSpec(like=tmp_path))
    assert (spec.multisets, spec.classes, spec.bevel_variants) == ("ssl,sll", 2, 1)


def test_what_is_given_goes_before_the_other_kit(pair_folder):
    spec = with_moulds_of(KitSpec(like=pair_folder, thickness_mm=8, classes=2))
    assert (spec.thickness_mm, spec.process) == (8, "fdm")


def test_without_a_kit_the_spec_stays_as_it_is():
    assert with_moulds_of(FEW) is FEW


def test_a_kit_of_many_lengths_is_refused(kit_folder):
    with pytest.raises(SpecError, match="cannot be taken over") as caught:
        with_moulds_of(KitSpec(like=kit_folder))
    assert int(caught.value.found.split()[0]) > 3


def test_other_classes_than_the_kits_are_refused(pair_folder):
    with pytest.raises(SpecError, match="not of 3 classes") as caught:
        with_moulds_of(KitSpec(like=pair_folder, classes=3))
    assert "ssl" in caught.value.wanted


def test_what_is_no_kit_is_refused(pair_folder, tmp_path):
    with pytest.raises(KitFolderError, match="nowhere is no kit"):
        with_moulds_of(KitSpec(like=tmp_path / "nowhere"))
    folder = tmp_path / "broken"
    shutil.copytree(pair_folder, folder)
    document = json.loads((folder / "kit.json").read_text())
    del document["classes"]
    (folder / "kit.json").write_text(json.dumps(document))
    with pytest.raises(KitFolderError, match="cannot be used") as caught:
        with_moulds_of(KitSpec(like=folder))
    assert "classes" in caught.value.found


# ---- how many pieces


@given(st.floats(100, 2000), st.floats(0.1, 10))
@settings(max_examples=20)
def test_pieces_go_with_the_square_of_the_size_whatever_the_unit(potato, size, factor):
    spec = KitSpec(palette=(30, 35), size_mm=size)
    faces = faces_at_size(potato, spec)
    assert faces % 2 == 0
    assert faces_at_size(potato.scaled(factor), spec) == pytest.approx(faces, abs=2)
    assert faces_at_size(potato, spec.model_copy(update={"size_mm": 2 * size})) == pytest.approx(4 * faces, abs=8)


@given(st.floats(0.5, 3))
@settings(max_examples=20)
def test_the_mean_edge_decides_whether_faces_fit(pebble, factor):
    mean = 33.0
    fitting = mean / pebble.mean_edge * float(pebble.extents.max())
    spec = KitSpec(palette=(30, 36), size_mm=factor * fitting)
    faces = corrected_faces(pebble, spec)
    assert faces == pytest.approx(100 * factor**2, abs=2.1)
    if abs(factor - 1) < 0.05:
        require_agreement(pebble, spec)
    elif abs(factor - 1) > 0.051:
        with pytest.raises(SpecError, match="100 pieces"):
            require_agreement(pebble, spec)


def test_the_mean_counts_each_length_as_often_as_the_triangles_have_it(pebble):
    def faces(**values) -> int:
        return corrected_faces(pebble, KitSpec(size_mm=1000, **values))

    mostly_short, alike, mostly_long = (faces(palette=(30, 36), multisets=m) for m in ("ssl", "ssl,sll", "sll"))
    assert mostly_short == pytest.approx(alike * (33 / 32) ** 2, abs=2)
    assert mostly_long == pytest.approx(alike * (33 / 34) ** 2, abs=2)
    assert faces(palette=(30, 36)) == alike
    assert faces(palette=(30, 33, 36)) == pytest.approx(alike, abs=2)


def test_a_print_smaller_than_its_pieces_is_refused(potato):
    with pytest.raises(SpecError, match="20 mm is too small for edges of 30 and 36 mm") as caught:
        faces_at_size(potato, KitSpec(palette=(30, 36), size_mm=20))
    assert "--size-mm" in caught.value.remedy


# ---- the command line


def test_flags_take_the_place_of_what_a_file_says(pair_folder, potato_file, tmp_path, capsys):
    file = ["--spec", str(pair_folder / "kit.json"), "--rounds", "1", "--connector", "none", "--no-documents", "--json"]
    expected = {
        "--palette=40,46": ([40.0, 46.0], 40, "palette"),
        "--like=" + str(pair_folder): (list(UNIVERSAL), 40, "palette"),
        "--multisets=sll": (list(UNIVERSAL), 40, "palette"),
        "--size-mm=200": (list(UNIVERSAL), None, "palette"),
        "--method=pressure": (None, 40, "pressure"),
    }
    for number, (flag, (palette, faces, method)) in enumerate(expected.items()):
        status = run(["make", str(potato_file), "--out", str(tmp_path / str(number)), flag, *file])
        shown = capsys.readouterr()
        assert status in (0, 3), shown.err
        spec = json.loads(shown.out)["spec"]
        assert (spec["palette"], spec["method"]) == (palette, method)
        assert (spec["faces"] == faces) if faces else spec["faces"] > 40


def test_lengths_and_another_solver_are_refused_on_the_command_line(potato_file, capsys):
    assert run(["make", str(potato_file), "--palette", "30,35", "--method", "pressure"]) == 2
    assert "--method palette" in " ".join(capsys.readouterr().err.split())
