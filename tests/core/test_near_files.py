"""Which file was meant."""

from pathlib import Path

import pytest

from compgen.core.near_files import near_file


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "paths").mkdir()
    for name in ("paths/mirror.toml", "paths/lens.toml", "PART.LS", "notes.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "paths" / "mirrors.toml").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("paths/miror.toml", "paths/mirror.toml"),
        ("mirror.toml", "paths/mirror.toml"),
        ("mirror", "paths/mirror.toml"),
        ("paths/Mirror.TOML", "paths/mirror.toml"),
        ("paths/mirror.tom", "paths/mirror.toml"),
        ("part.ls", "PART.LS"),
        ("PART.L", "PART.LS"),
        ("nowhere/lens.toml", "paths/lens.toml"),
        ("paths/window.toml", None),
        ("a\0b.toml", None),
    ],
)
def test_the_nearest_file_of_the_kind(folder, name, near):
    assert near_file(Path(name), "paths") == near
