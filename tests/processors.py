"""The processors whose code this one can run, by their names for numba: ``python tests/processors.py`` prints them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

#: What each needs; code for AVX-512 ends in an illegal instruction where there is none.
_NEEDS: Final = {
    "generic": set(),
    "haswell": {"avx2", "fma", "bmi2"},
    "skylake-avx512": {"avx512f", "avx512dq", "avx512bw", "avx512vl", "avx512cd"},
}


def processors() -> list[str]:
    """Names of processors whose code this one can run, the least demanding first."""
    try:
        told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return ["generic"]
    flags = set(next((line for line in told.splitlines() if line.startswith("flags")), "").split())
    return [name for name, needed in _NEEDS.items() if needed <= flags]


if __name__ == "__main__":
    print(*processors())
