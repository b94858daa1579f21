"""Suffixes and hashes."""

import hashlib
from pathlib import Path

import pytest

from drkid.errors import InputError
from drkid.formats import MESH_SUFFIXES, VOLUME_SUFFIXES, is_mesh_path, sha256_of, suffix_of


def test_every_suffix_is_of_one_kind_only():
    assert not set(MESH_SUFFIXES) & set(VOLUME_SUFFIXES)
    assert all(is_mesh_path(Path(f"a{suffix.upper()}")) for suffix in MESH_SUFFIXES)
    assert not any(is_mesh_path(Path(f"a.stl{suffix}")) for suffix in VOLUME_SUFFIXES)


@pytest.mark.parametrize(
    ("name", "suffix"), [("a.nii.gz", ".nii.gz"), ("A.OME.TIF", ".tif"), ("a.gz", None), ("nii", None)]
)
def test_the_longest_suffix_counts(name, suffix):
    assert suffix_of(Path(name)) == suffix


def test_the_hash_is_the_usual_one(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"hello")
    assert sha256_of(tmp_path / "a.bin") == hashlib.sha256(b"hello").hexdigest()


def test_a_file_that_goes_away_is_refused(tmp_path, monkeypatch):
    (tmp_path / "a.bin").write_bytes(b"hello")

    def fail(*_args):
        raise PermissionError("not for you")

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(InputError, match="not for you"):
        sha256_of(tmp_path / "a.bin")
