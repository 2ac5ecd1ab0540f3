"""`tubefoot report`: one self-contained page about any runs, side by side."""

from __future__ import annotations

from pathlib import Path


def report(*run: Path, out: Path = Path("out/report"), title: str | None = None) -> None:
    """Write one self-contained HTML report about runs, compared side by side.

    The page needs no network; print it from the browser for a PDF. Figures also lie beside it as PNG and SVG.

    Example: tubefoot report out/reference-3 out/reference-6 --out out/report

    Parameters
    ----------
    run
        Run directories, in the order in which they are shown; a directory of runs stands for all of them.
    out
        Directory for report.html, figures/ and run.toml.
    title
        Heading of the page; made of the runs' names if not given.
    """
    from tubefoot.errors import ConfigError
    from tubefoot.records import Run
    from tubefoot.report.build import write_report

    if not run:
        raise ConfigError("no run named; give the directories that `tubefoot solve --out DIR` wrote")
    record = Run(out, "report", {"runs": [str(path) for path in run], "title": title})
    written = write_report(run, record.directory, title, say=lambda step: print(f"  {step}", flush=True))
    for reason in written.missing:
        print(f"not drawn: {reason}")
    record.finish(figures=len(written.pictures))
    print(f"report: {written.page}")
