"""One word, one thing: no two classes of the package share a name, but those that no other file sees."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import femprep


def test_every_class_has_a_name_of_its_own() -> None:
    homes = defaultdict(list)
    package = Path(femprep.__file__).parent
    for file in sorted(package.rglob("*.py")):
        for name in re.findall(r"^class ([A-Z]\w*)", file.read_text(), flags=re.MULTILINE):
            homes[name].append(str(file.relative_to(package)))
    assert len(homes) > 100
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}
