"""Many subjects in, a folder of each and a table over all out, on dask.distributed."""

from __future__ import annotations

from femprep.cohort.run import Cohort, run_cohort
from femprep.cohort.subjects import Subject, read_subjects

__all__ = ["Cohort", "Subject", "read_subjects", "run_cohort"]
