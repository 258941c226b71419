"""Damage by numbers, words and lines: the same for a seed, most of a file left well formed, and met by the readers."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fuzz.mutate import Damage
from fuzz.sources import Sources

import femprep as fp
from femprep.errors import FemprepError

XML = b"<?xml version='1.0'?>\n<a>\n" + b"".join(b"<b n='%d'>1.5,2.5,%d</b>\n" % (n, n) for n in range(40)) + b"</a>\n"


def damage(data: bytes, seed: int, most: int = 1 << 20) -> bytes:
    return Damage([data], lambda given, _: given)(b"what libFuzzer kept", most, seed)


def test_the_same_for_a_seed() -> None:
    made = [damage(XML, seed) for seed in range(200)]
    assert made == [damage(XML, seed) for seed in range(200)]
    assert len(set(made)) > 100
    assert max(len(damage(XML, seed, 50)) for seed in range(200)) == 50


def test_most_xml_stays_some() -> None:
    parsed = 0
    made = [other for seed in range(300) if (other := damage(XML, seed))[:1] == b"<" and other != XML]
    for other in made:
        try:
            ElementTree.fromstring(other)
        except (ElementTree.ParseError, LookupError, ValueError):
            continue
        parsed += 1
    assert len(made) > 100
    assert 0.6 * len(made) < parsed < len(made)


def test_what_is_compressed_is_packed_again() -> None:
    packed = gzip.compress(XML)
    made = {gzip.decompress(other) for seed in range(100) if (other := damage(packed, seed)).startswith(b"\x1f\x8b")}
    assert len(made) > 30
    assert XML in made  # libFuzzer's own way leaves it here


@pytest.mark.slow
def test_damaged_meshes_are_read_or_refused(tmp_path: Path) -> None:
    sources = Sources(tmp_path / "sources")
    read, refused = 0, []
    for number, sound in enumerate([*sources.meshes, *sources.foreign]):
        if sound.is_dir() or sound.suffix == ".vtk":  # each of which takes a process of its own
            continue
        path = shutil.copytree(sound.parent, tmp_path / f"in{number}") / sound.name
        for seed in range(20):
            path.write_bytes(damage(sound.read_bytes(), seed))
            try:
                fp.read_mesh(path)
                read += 1
            except FemprepError as error:
                refused.append(str(error))
    assert read > 100
    assert len(refused) > 100
    assert [words for words in refused if "\n" in words] == []
