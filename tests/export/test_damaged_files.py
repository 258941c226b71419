"""Files with random damage: read, or refused in one line; never another error, never a crash."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid, with_fibres

from femprep.errors import FileError
from femprep.export import read_mesh, write_mesh
from femprep.model import VolumeMesh

NAMES = {"lv.vtu": "vtu", "lv.inp": "abaqus", "lv.msh": "gmsh", "lv4.msh": "gmsh41", "lv.mesh": "medit"}
NAMES |= {"lv.feb": "febio", "lv.k": "ls-dyna", "lv.pts": "opencarp", "lv.belem": "opencarp-binary"}


@pytest.mark.parametrize("name", NAMES)
def test_random_damage(name: str, tmp_path: Path) -> None:
    write_mesh(with_fibres(truncated_ellipsoid("tetra")), tmp_path / name, format=NAMES[name])
    whole = (tmp_path / name).read_bytes()
    dice = random.Random(name)
    refused = []
    for _ in range(40):
        damaged = bytearray(whole)
        for _ in range(dice.randint(1, 4)):
            start = dice.randrange(len(damaged))
            length = dice.choice([1, 1, 5, 200, 5000])
            change = dice.choice(["cut", "noise", "digits", "repeat"])
            piece = damaged[start : start + length]
            if change == "cut":
                piece = bytearray()
            elif change == "noise":
                piece = bytearray(dice.randrange(256) for _ in piece)
            elif change == "digits":
                piece = bytearray(dice.choice(b"0123456789-.,e \n") for _ in piece)
            else:
                piece = piece * 2
            damaged[start : start + length] = piece
        (tmp_path / name).write_bytes(bytes(damaged))
        try:
            assert isinstance(read_mesh(tmp_path / name), VolumeMesh)
        except FileError as error:
            refused.append(str(error))
    assert len(refused) > 5  # the damage is real
    assert all("\n" not in line and str(tmp_path / name) in line for line in refused)
