"""The bundled nucleus is what its README says."""

from drkid.data import nucleus_path
from drkid.spec import KitSpec
from drkid.surface import extract_surface
from drkid.volume import read_volume


def test_the_nucleus_is_small_clean_and_measured():
    path = nucleus_path()
    volume = read_volume(path, KitSpec())
    assert path.stat().st_size < 20_000
    assert (volume.spacing, volume.unit, volume.kind, volume.notes) == ((0.26, 0.26, 0.29), "um", "mask", ())
    assert int(volume.values.sum()) == 47191
    surface = extract_surface(volume, KitSpec())
    assert (surface.mesh.genus, surface.components, surface.cavities_filled, surface.touches_border) == (0, 1, 0, False)


def test_its_licence_travels_with_it():
    text = (nucleus_path().parent / "README.md").read_text()
    assert "BSD 3-Clause" in text
    assert "Chi-Li Chiu" in text
    assert "unconfirmed" in text
