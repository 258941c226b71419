"""Words of anyone's in, the same as they may stand in a page or a picture out: HTML and SVG."""

from __future__ import annotations

import html
import re
from typing import Final

#: Characters that XML cannot hold, however written; a parser refuses the whole file for one of them.
_NO_CHARACTERS: Final = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def escape(words: str) -> str:
    r"""Words fit for HTML and XML, as text or as an attribute's value; characters that have no place there as ``\x01``.

    Examples
    --------
    >>> from femprep.model.markup import escape
    >>> escape("a < b")
    'a &lt; b'
    """
    return html.escape(_NO_CHARACTERS.sub(lambda found: found[0].encode("unicode_escape").decode(), words))
