"""What examples/README.md says of the examples is there."""

from __future__ import annotations

import re
from pathlib import Path

EXAMPLES = Path(__file__).parent.parent / "examples"
TEXT = (EXAMPLES / "README.md").read_text()


def test_every_example_has_a_section_and_a_test() -> None:
    scripts = sorted(EXAMPLES.glob("[0-9]*.py"))
    assert [script.name[:2] for script in scripts] == re.findall(r"^## (\d\d) ", TEXT, flags=re.MULTILINE)
    tests = "".join(path.read_text() for path in Path(__file__).parent.glob("test_examples_*.py"))
    for script in scripts:
        assert f"python examples/{script.name}" in TEXT
        assert script.name in tests


def test_every_link_leads_somewhere_and_every_picture_is_shown() -> None:
    links = [link for link in re.findall(r"\]\(([^)]+)\)", TEXT) if not link.startswith("http")]
    assert len(links) >= 8
    for link in links:
        assert (EXAMPLES / link).is_file(), link
    assert {link for link in links if link.endswith(".png")} == {
        f"pictures/{path.name}" for path in (EXAMPLES / "pictures").glob("*.png")
    }
