"""The nightly job: what a timer starts, and nobody watches.

It runs the main job, refuses to publish what exceeds a limit, deletes snapshots by the retention, and leaves
a log and a report, whatever happens: a fault, a limit, or SIGTERM, which systemd, Kubernetes and SLURM send
before they kill. Until the run publishes, in one step, the catalog is as it was. Where it did, the report
has a page beside it.
"""

from __future__ import annotations

import os
import signal
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import Any, Literal, NoReturn

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.history import diff
from motionary.catalog.landmarks import route_note
from motionary.catalog.snapshot import current_snapshot
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum
from motionary.catalog.writer_lock import the_only_writer
from motionary.pipeline.readers.library import FORMATS
from motionary.workflows.announce import post_report, run_command
from motionary.workflows.errors import UserError
from motionary.workflows.limits import LimitExceeded, measure, refuse_if_exceeded
from motionary.workflows.main_job import RunResult, run
from motionary.workflows.nightly_settings import NightlySettings
from motionary.workflows.plan import Plan
from motionary.workflows.preparation import absolute
from motionary.workflows.report_page import write_report_page
from motionary.workflows.run_log import RunLog, logged_stages
from motionary.workflows.run_report import RunReport, rows
from motionary.workflows.sigterm import on_sigterm

DONE, FAILED, QUARANTINED = 0, 1, 3


class Stopped(BaseException):
    """SIGTERM has come; no code that catches faults is to take it for one."""


def run_nightly(settings: NightlySettings, log: RunLog) -> RunReport:
    """Run the job, write its report and tell whoever is to be told.

    Parameters
    ----------
    settings : NightlySettings
        Of `load_nightly`.
    log : RunLog
        Takes every event.

    Returns
    -------
    RunReport
        Its `exit_code`: 0 published, 3 published with quarantined clips, 1 failed, or refused by a limit.
    """
    job, begun = settings.job, monotonic()
    report = RunReport(str(settings.file), job.catalog, list(job.libraries), _described(settings))
    with on_sigterm(_passed_over):
        try:
            with on_sigterm(_stop):
                _publish_and_vacuum(settings, log, report)
        except LimitExceeded as error:
            _failed(log, report, str(error), status="refused")
        except (Stopped, KeyboardInterrupt) as error:
            _failed(log, report, "stopped by SIGTERM" if isinstance(error, Stopped) else "interrupted")
        except (UserError, CatalogError, OSError) as error:
            _failed(log, report, str(error))
        except Exception as error:  # a fault of ours: nobody sees the terminal of a timer
            _failed(log, report, f"{type(error).__name__}: {error}", traceback=traceback.format_exc())
        _tell(settings, log, report)
    log("finished", status=report.status, exit_code=report.exit_code, seconds=round(monotonic() - begun, 3))
    return report


def _publish_and_vacuum(settings: NightlySettings, log: RunLog, report: RunReport) -> None:
    log(
        "started", config=report.config, catalog=report.catalog, libraries=report.libraries,
        version=version("motionary"),
    )  # fmt: skip
    refuse_empty_libraries(settings.job.libraries)
    store = Store(absolute(settings.job.catalog))
    before = current_snapshot(store)
    report.snapshot_before = before.snapshot_id if before else None
    result = _run(settings, log, report, store)
    _published(result, log, report)
    kept = settings.retention
    if kept.keep is not None or kept.days is not None:
        with the_only_writer(store, lambda dead: None):
            vacuumed = vacuum(store, **kept.model_dump(exclude_none=True))
        report.vacuumed = asdict(vacuumed)
        log("vacuumed", **report.vacuumed)


def _run(settings: NightlySettings, log: RunLog, report: RunReport, store: Store) -> RunResult:
    try:
        return run(
            settings.job,
            partial(logged_stages, log),
            compiling=partial(log, "compiling"),
            take_over=lambda dead: log("took_over", process=str(dead)),
            planned=partial(_planned, log, report),
            check=partial(_check, settings, log, report),
            remark=lambda text: log("remark", text=text),
        )
    except BaseException:
        # What comes right after publishing, such as SIGTERM, leaves the catalog new all the same.
        made, report.snapshot_after = report.snapshot_after, None
        now = current_snapshot(store) if made is not None else None
        if now is not None and now.snapshot_id == made:
            report.status, report.snapshot_after = "published", made
        raise


def refuse_empty_libraries(libraries: Sequence[str]) -> None:
    """Refuse a library that is not there or holds nothing, as a share that is not mounted.

    Raises
    ------
    UserError
        Naming the folder. One empty folder of several is enough: its clips would vanish from the catalog.
    """
    for library in map(Path, libraries):
        if not library.is_dir():
            raise UserError(f"there is no library folder {library}; is the share mounted?")
        if not any(Path(name).suffix.lower() in FORMATS for name in _file_names(library)):
            raise UserError(f"library folder {library} holds no motion file; is the share mounted?")


def _check(
    settings: NightlySettings, log: RunLog, report: RunReport, before: Catalog | None, after: Catalog
) -> None:
    """Take down what would be published, and refuse it where a limit is exceeded."""
    report.describe(after)
    for row in report.quarantined:
        log("quarantined", **{name: row[name] for name in ("path", "line", "reason", "mend")})
    changes = diff(before, after) if before is not None else None
    if before is not None and changes is not None:
        report.snapshot_before = before.snapshot.snapshot_id
        report.removed, report.moved = rows(changes.removed), rows(changes.moved)
        report.relabelled = rows(changes.relabelled)
    report.limits = measure(settings.limits, before, after, changes)
    for one in report.limits:
        if one.exceeded:
            log("limit_exceeded", limit=one.name, value=one.limit, found=one.found, of=one.of)
    refuse_if_exceeded(report.limits, len(after.clips))
    report.snapshot_after = after.snapshot.snapshot_id


def _planned(log: RunLog, report: RunReport, plan: Plan) -> None:
    report.clips = asdict(plan)
    log("planned", **report.clips)


def _published(result: RunResult, log: RunLog, report: RunReport) -> None:
    report.status = "published"
    report.exit_code = QUARANTINED if report.quarantined else DONE
    if result.stale_labels:
        log("labels_stale", count=len(result.stale_labels), renamed=dict(result.stale_labels))
    if result.labels_outside:
        log("labels_outside", count=len(result.labels_outside), first=result.labels_outside[0])
    if note := route_note(result.catalog):
        log("remark", text=note)
    log(
        "published", snapshot=report.snapshot_after, run_id=report.run_id, clips=len(result.catalog.clips),
        quarantined=len(report.quarantined), clusters=len(report.clusters),
    )  # fmt: skip


def _failed(
    log: RunLog,
    report: RunReport,
    error: str,
    status: Literal["failed", "refused"] = "failed",
    **fields: str,
) -> None:
    """Take down a fault; what has been published before it stays published."""
    if report.status != "published":
        report.status = status
    report.exit_code, report.error = FAILED, error
    log("failed", error=error, **fields)


def _tell(settings: NightlySettings, log: RunLog, report: RunReport) -> None:
    """Write the report and announce it."""
    report.end()
    file = None
    try:
        file = report.write(settings.reports)
        log("report", file=str(file))
    except OSError as error:
        _failed(log, report, f"the report cannot be written: {error}")
    if settings.html and file and report.status == "published":
        _write_page(log, report, file.with_suffix(".html"))
    finish = settings.finish
    if finish.webhook:
        post_report(finish.webhook, report.to_json(), finish.timeout, log)
    if finish.command and file:
        run_command(finish.command, file, settings.file.parent, finish.command_timeout, log)


def _write_page(log: RunLog, report: RunReport, file: Path) -> None:
    """Show what was published; no fault of it, nor SIGTERM meanwhile, keeps the run from being announced."""
    try:
        with on_sigterm(_stop), Catalog.open(absolute(report.catalog), report.snapshot_after) as catalog:
            made = write_report_page(catalog, file)
    except (Exception, Stopped, KeyboardInterrupt) as error:
        log("page", ok=False, error="stopped by SIGTERM" if isinstance(error, Stopped) else str(error))
    else:
        log("page", ok=True, file=made.file, bytes=made.bytes)


def _described(settings: NightlySettings) -> dict[str, Any]:
    """Return what the report keeps of the settings: not the webhook, whose address may be secret."""
    job = settings.job
    return {
        "stages": asdict(job.config),
        "labels": {"csv": str(job.labels) if job.labels else None, "pattern": job.label_pattern},
        "retention": settings.retention.model_dump(),
        "limits": settings.limits.model_dump(),
    }


def _file_names(folder: Path) -> Iterator[str]:
    for _, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        yield from (name for name in names if not name.startswith("."))


def _stop(*_: object) -> NoReturn:
    signal.signal(signal.SIGTERM, _passed_over)  # a second one must not end the tidying up
    raise Stopped


def _passed_over(*_: object) -> None:
    """Let the announcement end, which has a deadline. Unlike SIG_IGN, no command inherits this."""
