"""What the nightly job is configured by: one TOML file, `nightly.toml` shows it.

`[job]`, `[labels]`, `[retention]`, `[limits]`, `[finish]`, `[log]` and `[report]` are the job's own; the
other tables are the stages', as in a run's configuration file. Any field can be overridden by the
environment, as `MOTIONARY_LIMITS__MAX_MOVED=0.1`. Relative paths are relative to the file's folder.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from dask.system import CPU_COUNT
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from motionary.workflows.costs.sizes import parse_size
from motionary.workflows.preparation import Job
from motionary.workflows.settings import (
    EnvironmentSettings,
    SettingsError,
    joined,
    read_toml,
    stage_settings,
)

_OWN = ("job", "labels", "retention", "limits", "finish", "log", "report")


def _limit(value: object) -> object:
    """Tell a count from a share, also in the environment, where both are text."""
    if isinstance(value, str):
        value = float(value) if "." in value else int(value)
    if isinstance(value, float) and not 0 <= value <= 1:
        raise ValueError(f"{value} has a decimal point and so is a share, from 0.0 to 1.0; a count has none")
    if isinstance(value, int) and (isinstance(value, bool) or value < 0):
        raise ValueError(f"{value} is no limit; give a count of clips (5) or a share of them (0.05)")
    return value


def _size(value: object) -> object:
    return parse_size(value) if isinstance(value, str) else value


def _pattern(value: str) -> str:
    try:
        groups = re.compile(value).groupindex
    except re.error as error:
        raise ValueError(f"{value!r} is no regular expression: {error}") from None
    if not groups:
        raise ValueError(f"{value!r} names no label; write a group as (?P<action>...)")
    return value


def _web_address(value: str) -> str:
    if not re.match(r"https?://[^/]", value):
        raise ValueError("give an address that begins with http:// or https://")
    return value


Limit = Annotated[int | float | None, BeforeValidator(_limit)]
Text = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class JobTable(_Table):
    """`[job]`: one folder of motion capture or several, the catalog, and who computes."""

    libraries: tuple[Text, ...] | Text
    catalog: Text
    workers: int | None = Field(default=None, ge=1)
    memory: Annotated[int, BeforeValidator(_size)] | None = None
    scheduler: Text | None = None

    @model_validator(mode="after")
    def _one_way_to_compute(self) -> JobTable:
        if self.workers is not None and self.scheduler is not None:
            raise ValueError("give workers or scheduler, not both")
        if not self.libraries:
            raise ValueError("libraries names no folder")
        return self


class LabelsTable(_Table):
    """`[labels]`: what clips are called, from a CSV, from a pattern on their paths, or both."""

    csv: Text | None = None
    pattern: Annotated[str, AfterValidator(_pattern)] | None = None
    column: Text | None = None


class Retention(_Table):
    """`[retention]`: which old snapshots stay; nothing is deleted where neither keep nor days is given."""

    keep: int | None = Field(default=None, ge=1)
    days: float | None = Field(default=None, ge=0)
    grace_hours: float | None = Field(default=None, ge=0)


class Limits(_Table):
    """`[limits]`: past them nothing is published. A count is whole, a share has a decimal point."""

    max_quarantined: Limit = None
    max_moved: Limit = None
    max_removed: Limit = 0.5
    max_relabelled: Limit = None


class Finish(_Table):
    """`[finish]`: who is told; a failure of it is logged and changes nothing of the run."""

    webhook: Annotated[str, AfterValidator(_web_address)] | None = None
    timeout: float = Field(default=10.0, gt=0)
    command: tuple[Text, ...] = ()
    command_timeout: float = Field(default=300.0, gt=0)


class LogTable(_Table):
    """`[log]`: a file that JSON lines are added to; stderr where none is given."""

    file: Text | None = None


class ReportTable(_Table):
    """`[report]`: the folder that takes `<run_id>.json`, and whether there is a page beside it."""

    folder: Text = "reports"
    html: bool = True


class _Nightly(EnvironmentSettings):
    job: JobTable
    labels: LabelsTable = Field(default_factory=LabelsTable)
    retention: Retention = Field(default_factory=Retention)
    limits: Limits = Field(default_factory=Limits)
    finish: Finish = Field(default_factory=Finish)
    log: LogTable = Field(default_factory=LogTable)
    report: ReportTable = Field(default_factory=ReportTable)


@dataclass(frozen=True)
class NightlySettings:
    """A nightly job, its paths absolute.

    Parameters
    ----------
    file : Path
        The configuration file.
    job : Job
        What the main job is asked to do.
    retention : Retention
    limits : Limits
    finish : Finish
    log : Path, optional
        File of the log; stderr where there is none.
    reports : Path
        Folder of the reports.
    html : bool
        Whether a run that publishes leaves a page there as well.
    """

    file: Path
    job: Job
    retention: Retention
    limits: Limits
    finish: Finish
    log: Path | None
    reports: Path
    html: bool


def load_nightly(file: Path) -> NightlySettings:
    """Read a nightly job's configuration file, and what the environment overrides.

    Raises
    ------
    SettingsError
        The file is missing or not TOML, or a setting is missing, unknown or out of range; the message names
        file and setting.
    """
    tables = read_toml(file)
    own = {name: tables.pop(name) for name in _OWN if name in tables}
    nightly = joined(_Nightly, own, {}, file)
    folder = file.absolute().parent
    labels = nightly.labels
    config = stage_settings(_with_column(tables, labels.column, file), {}, file)
    libraries = [nightly.job.libraries] if isinstance(nightly.job.libraries, str) else nightly.job.libraries
    return NightlySettings(
        file.absolute(),
        Job(
            [str(folder / one) for one in libraries],
            nightly.job.catalog if "://" in nightly.job.catalog else str(folder / nightly.job.catalog),
            config,
            labels=folder / labels.csv if labels.csv else None,
            label_pattern=labels.pattern,
            workers=nightly.job.workers or CPU_COUNT,
            scheduler=nightly.job.scheduler,
            memory=nightly.job.memory,
        ),
        nightly.retention,
        nightly.limits,
        nightly.finish,
        folder / nightly.log.file if nightly.log.file else None,
        folder / nightly.report.folder,
        nightly.report.html,
    )


def _with_column(tables: Mapping[str, Any], column: str | None, file: Path) -> dict[str, Any]:
    """Pass `[labels] column` on to the stage that names clusters."""
    clusters = tables.get("clusters", {})
    if column is None or not isinstance(clusters, dict):
        return dict(tables)
    if clusters.get("label_column", column) != column:
        raise SettingsError(
            f"{file}: labels.column is {column!r} and clusters.label_column is "
            f"{clusters['label_column']!r}; give one of them"
        )
    return {**tables, "clusters": {**clusters, "label_column": column}}
