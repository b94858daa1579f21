"""Every format, written and read again; every broken file, refused in words."""

import gzip
import sys
from collections.abc import Callable
from pathlib import Path

import mrcfile
import nibabel as nib
import nrrd
import numpy as np
import pytest
import tifffile
import zarr

from drkid.errors import InputError
from drkid.spec import KitSpec
from drkid.volume import read, read_volume, tiff

XYZ = np.zeros((6, 7, 9), np.uint8)  # three sizes and no symmetry: a swapped or mirrored axis shows
XYZ[1:3, 2:6, 3] = 1
XYZ[1, 2, 3:8] = 1
ZYX = np.ascontiguousarray(XYZ.T)
SPACING = (0.2, 0.3, 0.5)


def write_mrc(path: Path, values=ZYX, spacing=SPACING, **kwargs) -> None:
    with mrcfile.new(path, compression="gzip" if path.suffix == ".gz" else None) as file:
        file.set_data(values.view(np.int8) if values.dtype == np.uint8 else values)
        file.voxel_size = spacing
        for name, value in kwargs.items():
            file.header[name] = value


def write_nifti(path: Path, values=XYZ, spacing=SPACING, unit="micron", mirrored: bool = False) -> None:
    image = nib.Nifti1Image(values, np.diag([-spacing[0] if mirrored else spacing[0], *spacing[1:], 1.0]))
    image.header.set_xyzt_units(unit)
    nib.save(image, path)


def write_ome(path: Path, values=ZYX, unit="µm", axes="ZYX", **kwargs) -> None:
    sizes = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", SPACING, strict=True)}
    units = {f"PhysicalSize{axis}Unit": unit for axis in "XYZ"}
    tifffile.imwrite(path, values, ome=True, metadata={"axes": axes, **sizes, **units}, **kwargs)


def write_imagej(path: Path, unit: str = "um") -> None:
    x, y, z = SPACING
    metadata = {"axes": "ZYX", "spacing": z, "unit": unit}
    tifffile.imwrite(path, ZYX, imagej=True, resolution=(1 / x, 1 / y), metadata=metadata)


def write_nrrd(path: Path, **header) -> None:
    nrrd.write(
        str(path), XYZ, header or {"space directions": np.diag(SPACING), "space units": ["um"] * 3, "space": "LPS"}
    )


def write_zarr(path: Path, version: str = "0.5", values=ZYX[None], axes: str = "czyx") -> None:
    group = zarr.create_group(path, zarr_format=3 if version == "0.5" else 2)
    group.create_array("s0", data=values)
    scale = {"c": 1.0, "x": SPACING[0] / 2, "y": SPACING[1] / 2, "z": SPACING[2] / 2}
    image = {
        "axes": [{"name": a, "unit": "micrometer"} if a in "xyz" else {"name": a} for a in axes],
        "datasets": [
            {"path": "s0", "coordinateTransformations": [{"type": "scale", "scale": [scale[a] for a in axes]}]}
        ],
        "coordinateTransformations": [{"type": "scale", "scale": [2.0] * len(axes)}],
    }
    group.attrs.update({"ome": {"multiscales": [image]}} if version == "0.5" else {"multiscales": [image]})


FORMATS: dict[str, tuple[Callable[[Path], None], str]] = {
    "a.mrc": (write_mrc, "angstrom"),
    "a.MAP": (write_mrc, "angstrom"),
    "a.mrc.gz": (write_mrc, "angstrom"),
    "a.map.gz": (write_mrc, "angstrom"),
    "a.nii": (write_nifti, "um"),
    "a.nii.gz": (write_nifti, "um"),
    "a.ome.tif": (write_ome, "um"),
    "big.tiff": (lambda path: write_ome(path, ZYX.astype(">u2"), byteorder=">"), "um"),
    "imagej.tif": (write_imagej, "um"),
    "micro.tif": (lambda path: write_imagej(path, "micron"), "um"),
    "a.nrrd": (write_nrrd, "um"),
    "spacings.nrrd": (lambda path: write_nrrd(path, spacings=SPACING, units=["um"] * 3), "um"),
    "five.ome.zarr": (write_zarr, "um"),
    "four.zarr": (lambda path: write_zarr(path, "0.4"), "um"),
}


@pytest.mark.parametrize("name", FORMATS)
def test_what_was_written_is_read_in_xyz_with_spacing_and_unit(name, tmp_path):
    write, unit = FORMATS[name]
    write(tmp_path / name)
    volume = read_volume(tmp_path / name, KitSpec())
    np.testing.assert_array_equal(volume.values, XYZ)
    np.testing.assert_allclose(volume.spacing, SPACING, rtol=1e-6)
    assert (volume.unit, volume.kind, volume.name) == (unit, "mask", name)
    assert volume.values.dtype.isnative
    assert not volume.values.flags.writeable


def test_formats_without_voxel_size_say_so(tmp_path):
    np.save(tmp_path / "a.npy", ZYX[None])
    tifffile.imwrite(tmp_path / "a.tif", ZYX, resolution=(72, 72), resolutionunit="INCH", metadata=None)
    zarr.save_array(tmp_path / "a.zarr", ZYX)
    nrrd.write(str(tmp_path / "a.nrrd"), XYZ)
    for name in ("a.npy", "a.tif", "a.zarr", "a.nrrd"):
        volume = read_volume(tmp_path / name, KitSpec())
        np.testing.assert_array_equal(volume.values, XYZ)
        assert (volume.spacing, volume.unit) == ((1, 1, 1), None)
        assert any("--spacing" in note for note in volume.notes)


def test_tiff_metadata_without_sizes_is_no_size(tmp_path):
    tifffile.imwrite(tmp_path / "ome.tif", ZYX, ome=True, metadata={"axes": "ZYX"})
    tifffile.imwrite(tmp_path / "imagej.tif", ZYX, imagej=True, metadata={"axes": "ZYX"})
    write_imagej(tmp_path / "pixels.tif", "pixel")
    for name in ("ome.tif", "imagej.tif", "pixels.tif"):
        volume = read_volume(tmp_path / name, KitSpec())
        np.testing.assert_array_equal(volume.values, XYZ)
        assert (volume.spacing, volume.unit) == ((1, 1, 1), None)


def test_nrrd_kinds_tell_space_from_lists(tmp_path):
    nrrd.write(str(tmp_path / "a.nrrd"), XYZ[None], {"kinds": ["list", "domain", "domain", "domain"]})
    np.testing.assert_array_equal(read_volume(tmp_path / "a.nrrd", KitSpec()).values, XYZ)
    two = np.stack([XYZ, XYZ])
    nrrd.write(str(tmp_path / "b.nrrd"), two, {"kinds": ["list", "domain", "domain", "domain"]})
    assert "2 × 6 × 7 × 9" in refusal(tmp_path / "b.nrrd")


def test_the_spec_overrides_spacing_and_unit(tmp_path):
    write_nifti(tmp_path / "a.nii")
    volume = read_volume(tmp_path / "a.nii", KitSpec(spacing=(16, 16, 15), unit="nm"))
    assert (volume.spacing, volume.unit) == ((16, 16, 15), "nm")


@pytest.mark.parametrize(("name", "unit", "factor"), [("cm", "mm", 10), ("Å", "angstrom", 1), ("pm", "angstrom", 0.01)])
def test_units_are_converted_to_a_known_one(name, unit, factor, tmp_path):
    write_ome(tmp_path / "a.tif", unit=name)
    volume = read_volume(tmp_path / "a.tif", KitSpec())
    np.testing.assert_allclose(volume.spacing, np.array(SPACING) * factor)
    assert volume.unit == unit


def test_axes_in_different_units_come_in_that_of_x(tmp_path):
    write_ome(tmp_path / "a.tif")
    mixed = tifffile.tiffcomment(tmp_path / "a.tif").replace(
        'PhysicalSizeZ="0.5" PhysicalSizeZUnit="µm"', 'PhysicalSizeZ="500" PhysicalSizeZUnit="nm"'
    )
    tifffile.tiffcomment(tmp_path / "a.tif", comment=mixed.encode())
    volume = read_volume(tmp_path / "a.tif", KitSpec())
    np.testing.assert_allclose(volume.spacing, SPACING)
    assert volume.unit == "um"


def test_an_unknown_unit_stays_unknown(tmp_path):
    write_ome(tmp_path / "a.tif", unit="pixel")
    volume = read_volume(tmp_path / "a.tif", KitSpec())
    assert (volume.spacing, volume.unit) == (SPACING, None)


def test_nifti_without_unit_is_taken_as_millimetres_aloud(tmp_path):
    write_nifti(tmp_path / "a.nii", unit="unknown")
    volume = read_volume(tmp_path / "a.nii", KitSpec())
    assert volume.unit == "mm"
    assert any("millimetres" in note for note in volume.notes)


def test_a_mirroring_affine_is_said_aloud(tmp_path):
    write_nifti(tmp_path / "a.nii", mirrored=True)
    assert any("mirror" in note for note in read_volume(tmp_path / "a.nii", KitSpec()).notes)


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan])
def test_senseless_spacing_becomes_one_with_a_note(wrong, tmp_path):
    write_mrc(tmp_path / "a.mrc", spacing=(0.2, 0.3, 0.5))
    with mrcfile.open(tmp_path / "a.mrc", "r+") as file:
        file.header.cella.z = wrong
    volume = read_volume(tmp_path / "a.mrc", KitSpec())
    np.testing.assert_allclose(volume.spacing, (0.2, 0.3, 1.0), rtol=1e-6)
    assert any("makes no sense" in note for note in volume.notes)


def test_needle_like_voxels_are_questioned(tmp_path):
    write_mrc(tmp_path / "a.mrc", spacing=(1, 1, 300))
    assert any("very long" in note for note in read_volume(tmp_path / "a.mrc", KitSpec()).notes)


def test_mrc_axis_order_of_the_header_is_followed(tmp_path):
    turned = np.ascontiguousarray(XYZ.transpose(0, 2, 1))  # sections along x, rows along z, columns along y
    write_mrc(tmp_path / "a.mrc", turned, mapc=2, mapr=3, maps=1)
    np.testing.assert_array_equal(read_volume(tmp_path / "a.mrc", KitSpec()).values, XYZ)


def test_an_odd_mrc_header_is_read_with_a_note(tmp_path):
    write_mrc(tmp_path / "a.mrc", map=b"XXX ")
    volume = read_volume(tmp_path / "a.mrc", KitSpec())
    np.testing.assert_array_equal(volume.values, XYZ)
    assert any("odd" in note for note in volume.notes)


def test_the_hash_is_of_the_bytes(tmp_path):
    np.save(tmp_path / "a.npy", ZYX)
    np.save(tmp_path / "b.npy", ZYX)
    np.save(tmp_path / "c.npy", 2 * ZYX)
    one, two, other = (read_volume(tmp_path / f"{name}.npy", KitSpec()).sha256 for name in "abc")
    assert one == two != other
    write_zarr(tmp_path / "a.zarr")
    before = read_volume(tmp_path / "a.zarr", KitSpec()).sha256
    zarr.open_group(tmp_path / "a.zarr", mode="r+").attrs["more"] = 1
    assert read_volume(tmp_path / "a.zarr", KitSpec()).sha256 != before


# ---- what is refused


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_volume(path, KitSpec())
    return str(caught.value)


@pytest.mark.parametrize("name", ["a.mrc", "a.map.gz", "a.nii", "a.nii.gz", "a.tif", "a.nrrd", "a.npy"])
def test_empty_files_and_noise_are_refused(name, tmp_path):
    (tmp_path / name).touch()
    assert "is empty" in refusal(tmp_path / name)
    (tmp_path / name).write_bytes(b"this is not what it is called " * 100)
    assert "cannot be read" in refusal(tmp_path / name)


@pytest.mark.parametrize("name", ["a.mrc", "a.mrc.gz", "a.nii", "a.nii.gz", "a.ome.tif", "a.nrrd"])
def test_cut_off_files_are_refused(name, tmp_path):
    noise = np.random.default_rng(0).integers(0, 2, (40, 40, 40)).astype(np.uint8)
    if name.endswith(".nrrd"):
        nrrd.write(str(tmp_path / name), noise)
    else:
        {"mrc": write_mrc, "nii": write_nifti, "ome": write_ome}[name.split(".")[1]](tmp_path / name, noise)
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: len(whole) * 6 // 10])
    assert "cannot be read" in refusal(tmp_path / name)


def test_a_header_of_another_image_type_is_refused(tmp_path):
    nib.save(nib.Spm99AnalyzeImage(XYZ.astype(np.int16), np.eye(4)), tmp_path / "a.img")
    (tmp_path / "a.hdr").rename(tmp_path / "b.nii")
    assert "cannot be read" in refusal(tmp_path / "b.nii")


def test_pages_that_are_missing_are_noticed(tmp_path):
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        for plane in np.random.default_rng(0).integers(0, 2, (30, 20, 20)).astype(np.uint8):
            file.write(plane, contiguous=False, metadata=None)
    whole = (tmp_path / "a.tif").read_bytes()
    assert read_volume(tmp_path / "a.tif", KitSpec()).values.shape == (20, 20, 30)
    for share in (0.3, 0.6, 0.97):
        (tmp_path / "a.tif").write_bytes(whole[: int(len(whole) * share)])
        assert "cannot be read" in refusal(tmp_path / "a.tif")


def test_missing_folder_and_unknown_names_are_refused(tmp_path):
    assert "does not exist" in refusal(tmp_path / "no.nii")
    (tmp_path / "folder.tif").mkdir()
    assert "is a folder" in refusal(tmp_path / "folder.tif")
    (tmp_path / "file.zarr").write_text("x")
    assert "is a file" in refusal(tmp_path / "file.zarr")
    (tmp_path / "a.docx").write_text("x")
    message = refusal(tmp_path / "a.docx")
    assert ".docx" in message
    assert ".nii.gz" in message
    (tmp_path / "empty.zarr").mkdir()
    assert "cannot be read" in refusal(tmp_path / "empty.zarr")


def test_pickles_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}, []], object), allow_pickle=True)
    assert "cannot be read" in refusal(tmp_path / "a.npy")


@pytest.mark.parametrize(
    ("axes", "shape"), [("TZYX", (2, 4, 5, 6)), ("CZYX", (2, 4, 5, 6)), ("TYX", (3, 5, 6)), ("YX", (5, 6))]
)
def test_time_channels_and_flat_images_are_refused(axes, shape, tmp_path):
    write_ome(tmp_path / "a.ome.tif", np.ones(shape, np.uint8), axes=axes)
    assert " × ".join(map(str, shape)) in refusal(tmp_path / "a.ome.tif")


def test_colours_time_and_complex_numbers_are_refused(tmp_path):
    tifffile.imwrite(tmp_path / "rgb.tif", np.ones((8, 9, 3), np.uint8), photometric="rgb")
    write_nifti(tmp_path / "time.nii", np.ones((4, 5, 6, 2), np.uint8))
    write_zarr(tmp_path / "two.zarr", values=np.ones((2, 4, 5, 6), np.uint8))
    np.save(tmp_path / "complex.npy", np.ones((4, 5, 6), complex))
    np.save(tmp_path / "nothing.npy", np.ones((4, 0, 6)))
    for name, shape in {
        "rgb.tif": "8 × 9 × 3",
        "time.nii": "4 × 5 × 6 × 2",
        "two.zarr": "2 × 4 × 5 × 6",
        "complex.npy": "complex",
        "nothing.npy": "4 × 0 × 6",
    }.items():
        message = refusal(tmp_path / name)
        assert "not a three-dimensional volume" in message
        assert shape in message


def test_values_that_are_no_numbers_are_counted(tmp_path):
    values = ZYX.astype(np.float32)
    values[0, 0, :2] = np.nan
    values[1, 0, 0] = np.inf
    np.save(tmp_path / "a.npy", values)
    assert f"3 of {values.size} voxels" in refusal(tmp_path / "a.npy")


def test_a_codec_that_is_missing_is_named(tmp_path, monkeypatch):
    def fail(_path):
        message = "<COMPRESSION.LZW: 5> requires the 'imagecodecs' package"
        raise ValueError(message)

    monkeypatch.setitem(read._FORMATS, ".tif", read._Format(fail, tiff.FAULTS))
    write_imagej(tmp_path / "a.tif")
    assert 'pip install "drkid[codecs]"' in refusal(tmp_path / "a.tif")


def test_zarr_that_is_missing_is_named(tmp_path, monkeypatch):
    write_zarr(tmp_path / "a.zarr")
    monkeypatch.setitem(sys.modules, "zarr", None)
    assert 'pip install "drkid[zarr]"' in refusal(tmp_path / "a.zarr")


def test_gzip_of_something_else_is_refused(tmp_path):
    (tmp_path / "a.nii.gz").write_bytes(gzip.compress(b"hello" * 1000))
    assert "cannot be read" in refusal(tmp_path / "a.nii.gz")


@pytest.mark.parametrize("name", ["truncated.nii.gz", "corrupt_header.map"])
def test_bad_files_from_the_wild_are_refused(name, shared_data):
    assert "cannot be read" in refusal(shared_data / "bad" / name)
