"""A small cohort that nothing disturbs, made once: what every other has to end as."""

from __future__ import annotations

import cohorts
import pytest
from cohorts import Quiet


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Quiet:
    pytest.importorskip("distributed", reason="a cohort runs on dask.distributed")
    folder = tmp_path_factory.mktemp("cohort")
    source = cohorts.phantoms(folder / "in")
    done = cohorts.run(source, folder / "out")
    return Quiet(source, folder / "out", done.returncode, done.stderr)
