"""Words with any characters stand in XML that a parser takes."""

from __future__ import annotations

from xml.etree.ElementTree import fromstring

import pytest

import femprep as fp
from femprep.model.markup import escape


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("a<b & \"c\" 'd'", "a<b & \"c\" 'd'"),
        ("mm², ▁, \U0001f600", "mm², ▁, \U0001f600"),
        ("a\x01b\x1b\x00", "a\\x01b\\x1b\\x00"),
        ("name\udcff\ufffe", "name\\udcff\\ufffe"),
    ],
)
def test_words_come_back_from_text_and_attribute(words: str, shown: str) -> None:
    read = fromstring(f'<a b="{escape(words)}">{escape(words)}</a>'.encode())
    assert (read.text, read.get("b")) == (shown, shown)


def test_a_label_of_any_characters_makes_a_picture_that_is_read() -> None:
    picture = fromstring(fp.bulls_eye_svg(range(17), label="a\x01b <c> \udcff").encode())
    assert "a\\x01b <c> \\udcff" in "".join(picture.itertext())
