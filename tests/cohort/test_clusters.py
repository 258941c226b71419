"""What the how-to of clusters shows: the job script for SLURM as it is rendered, a description for Kubernetes."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "clusters.md"


def block(file: str) -> str:
    found = re.search(rf"<!-- file: {re.escape(file)} -->\n```\w+\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def test_slurm_runs_a_worker_of_one_thread_for_each_subject(monkeypatch: pytest.MonkeyPatch) -> None:
    jobqueue = pytest.importorskip("dask_jobqueue", reason="renders the job script of SLURM")
    made: dict[str, Any] = {}

    class Cluster(jobqueue.SLURMCluster):
        def scale(self, n: int = 0, jobs: int = 0) -> None:  # no SLURM is here to take the jobs
            if jobs:
                made.update(jobs=jobs, script=self.job_script())

    def run(command: list[str]) -> SimpleNamespace:
        made["command"] = command
        return SimpleNamespace(returncode=0)

    monkeypatch.setattr(jobqueue, "SLURMCluster", Cluster)
    monkeypatch.setattr("subprocess.run", run)
    with pytest.raises(SystemExit) as ended:
        exec(compile(block("slurm.py"), "slurm.py", "exec"), {"__name__": "slurm"})
    assert ended.value.code == 0
    script, command = made["script"], made["command"]
    for line in ("#SBATCH -p standard", "#SBATCH --cpus-per-task=8", "#SBATCH --mem=60G", "#SBATCH -t 04:00:00"):
        assert line in script
    worker = script.splitlines()[-1]
    assert "distributed.cli.dask_worker" in worker or "dask worker" in worker
    assert "--nthreads 1" in worker
    assert "--nworkers 8" in worker
    assert worker.rindex("--memory-limit 0") > worker.index("--memory-limit")
    assert script.index("NUMBA_NUM_THREADS=1") < script.index(worker)
    assert made["jobs"] == 4
    assert re.fullmatch(r"tcp://[\d.]+:\d+", command[command.index("--scheduler") + 1])


def test_kubernetes_pods_mount_what_they_name_and_the_service_leads_to_the_scheduler() -> None:
    yaml = pytest.importorskip("yaml", reason="reads YAML")
    spec = yaml.safe_load(block("femprep-cohort.yaml"))["spec"]
    pod = spec["worker"]["spec"]
    (container,) = pod["containers"]
    assert {mount["name"] for mount in container["volumeMounts"]} == {volume["name"] for volume in pod["volumes"]}
    assert container["args"][container["args"].index("--nthreads") + 1] == "1"
    (scheduler,) = spec["scheduler"]["spec"]["containers"]
    named = {port["name"] for port in scheduler["ports"]}
    assert {port["targetPort"] for port in spec["scheduler"]["service"]["ports"]} <= named
    assert scheduler["image"] == container["image"]
