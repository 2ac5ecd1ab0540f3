"""Workers on a SLURM cluster for `tubefoot screen` and `tubefoot optimise`.

Run it on the login node, in tmux or as a job of its own, and leave it running:

    python examples/cluster/slurm.py --jobs 20 --partition cpu --scheduler-file $HOME/tubefoot-scheduler.json

then, anywhere on the same file system:

    tubefoot screen study.toml --scheduler-file $HOME/tubefoot-scheduler.json --out /shared/study
"""

from __future__ import annotations

import argparse
import signal

from dask_jobqueue import SLURMCluster


def slurm_cluster(options: argparse.Namespace) -> SLURMCluster:
    """A cluster whose SLURM jobs hold as many one-threaded workers as they have cores."""
    return SLURMCluster(
        queue=options.partition,
        account=options.account,
        walltime=options.walltime,
        cores=options.cores,
        processes=options.cores,
        memory=f"{options.memory_gb * options.cores}GB",
        interface=options.interface,
        worker_extra_args=["--lifetime", options.lifetime, "--lifetime-stagger", "5m", "--nthreads", "1"],
        job_script_prologue=[
            f"export {name}=1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        ],
        scheduler_options={"dashboard_address": ":0"},
    )


def options() -> argparse.Namespace:
    """What a lab adapts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=4, help="SLURM jobs to keep running")
    parser.add_argument("--cores", type=int, default=16, help="cores, and workers, of one SLURM job")
    parser.add_argument("--memory-gb", type=float, default=1.5, help="memory of one worker")
    parser.add_argument("--walltime", default="04:00:00")
    parser.add_argument("--lifetime", default="225m", help="a worker retires before the wall time ends")
    parser.add_argument("--partition")
    parser.add_argument("--account")
    parser.add_argument("--interface", help="network card that all nodes reach each other by, such as ib0")
    parser.add_argument(
        "--scheduler-file", required=True, help="where the address goes; on the shared file system"
    )
    parser.add_argument("--show", action="store_true", help="print the job script and end")
    return parser.parse_args()


def main() -> None:
    """Start the scheduler, write its address, keep the jobs running until interrupted."""
    chosen = options()
    with slurm_cluster(chosen) as cluster:
        if chosen.show:
            print(cluster.job_script())
            return
        cluster.adapt(minimum_jobs=0, maximum_jobs=chosen.jobs)
        write_address(cluster, chosen.scheduler_file)
        print(f"scheduler at {cluster.scheduler_address}; interrupt to end it and its jobs")
        signal.pause()


def write_address(cluster: SLURMCluster, path: str) -> None:
    """The file that `--scheduler-file` reads."""
    import json
    from pathlib import Path

    Path(path).write_text(json.dumps({"address": cluster.scheduler_address}))


if __name__ == "__main__":
    main()
