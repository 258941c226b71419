"""What a reader reports of a file, beside the unit of its lengths."""

from __future__ import annotations

from femprep.model import VolumeMesh


def reported(mesh: VolumeMesh) -> list[str]:
    """Notices of a mesh in words, but for that on its unit."""
    notices = [one["what"] for one in mesh.info.get("notices", ())]
    return [what for what in notices if not what.startswith("lengths were taken")]
