"""The run behind a report: what took how long, with which settings, and the runs before it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from html import escape
from typing import Any

from motionary.catalog.history import run_history
from motionary.catalog.query import Catalog
from motionary.catalog.views.page import Cell, Html, details, facts, section, table
from motionary.pipeline.config import PipelineConfig

_MOST_RUNS = 10
_LONGEST_VALUE = 300


def timings_section(catalog: Catalog) -> str:
    """Tell what the run took, stage by stage, and what the runs before it did."""
    run = catalog.last_run
    stages = dict(run["stage_seconds"])
    most = max(stages.values(), default=0.0) or 1.0
    figures = facts(
        [
            ("from start to end", f"{(run['finished_at'] - run['started_at']).total_seconds():.1f} s"),
            ("work, summed over workers", f"{sum(stages.values()):.1f} s"),
            ("clips read", f"{run['clips_read']:,}"),
            ("pairs compared", f"{run['pairs_computed']:,}"),
        ]
    )
    bars: list[list[Cell]] = [[stage, seconds, _bar(seconds / most)] for stage, seconds in stages.items()]
    versions = ", ".join(f"{name} {version}" for name, version in catalog.snapshot.versions.items())
    return section(
        "Timings",
        "What is unchanged is not computed again: a run over a library that has hardly changed is short.",
        figures,
        table(["stage", "seconds of work", ""], bars),
        details(f"Runs, the last {_MOST_RUNS} of them", _runs(catalog)),
        details("Versions", f"<p>{escape(versions)}</p>") if versions else "",
        name="timings",
    )


def settings_section(catalog: Catalog) -> str:
    """List the run's settings by stage; what is not as this motionary has it by default is marked."""
    settings, usual = catalog.settings, json.loads(json.dumps(asdict(PipelineConfig())))
    changed = [
        f"{stage}.{name} = {_value(value)}"
        for stage, values in settings.items()
        for name, value in values.items()
        if value != usual.get(stage, {}).get(name)
    ]
    said = f"Not as by default: {'; '.join(changed)}." if changed else "All as by default."
    return section(
        "Settings",
        f"{said} motionary/pipeline/config.py describes each.",
        *(
            details(stage, _settings_table(values, usual.get(stage, {})))
            for stage, values in settings.items()
        ),
        name="settings",
    )


def _settings_table(values: Mapping[str, Any], usual: Mapping[str, Any]) -> str:
    rows: list[list[Cell]] = [
        [name, _value(value), "yes" if value == usual.get(name) else _value(usual.get(name))]
        for name, value in values.items()
    ]
    return table(["setting", "value", "by default"], rows)


def _runs(catalog: Catalog) -> str:
    rows: list[list[Cell]] = [
        [
            row["run_id"],
            f"{row['started_at']:%Y-%m-%d %H:%M}",
            f"{(row['finished_at'] - row['started_at']).total_seconds():.0f}",
            row["clips"],
            row["clusters"],
            row["quarantined"],
            row["clips_read"],
            row["pairs_computed"],
            row["pairs"],
            "yes" if row["kept"] else "vacuumed",
        ]
        for row in reversed(run_history(catalog)[-_MOST_RUNS:].to_pylist())
    ]
    columns = [
        "run",
        "began, UTC",
        "seconds",
        "clips",
        "clusters",
        "quarantined",
        "read",
        "compared",
        "of pairs",
        "kept",
    ]
    return table(columns, rows)


def _value(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"


def _bar(share: float) -> Html:
    return Html(f'<span class="bar" style="width:{8 * share:.2f}rem" aria-hidden="true"></span>')
