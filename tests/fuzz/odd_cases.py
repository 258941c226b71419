"""Cases that are no damage by chance: each has a name, and is the same for every seed; the number chooses."""

from __future__ import annotations

from pathlib import Path

from fuzz import odd_files, odd_images, odd_meshes, odd_options, odd_paths
from fuzz.common import Made
from fuzz.damage import Random
from fuzz.sources import Sources

ODD = {
    **odd_images.FILES,
    **odd_paths.PATHS,
    **odd_options.CONFIGURATIONS,
    **odd_options.VALUES,
    **odd_meshes.MESHES,
    **odd_files.FILES,
    **odd_images.MAPS,
}
NAMES = list(ODD)


def odd(number: int, random: Random, sources: Sources, folder: Path) -> Made:
    """The case of a number, from the first again behind the last."""
    name = NAMES[number % len(NAMES)]
    return ODD[name](sources, folder)._replace(what=name)
