"""Who is told when a nightly run has ended: a web address, a command.

The run is over and its report written, so that a failure here is logged and changes nothing of it.
"""

from __future__ import annotations

import os
import subprocess
import urllib.request
from collections.abc import Sequence
from http.client import HTTPException
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from motionary.workflows.run_log import RunLog

REPORT_VARIABLE = "MOTIONARY_REPORT"
"""In the command's environment: the path of the report."""

_LAST_WORDS = 2000


def post_report(url: str, report: str, timeout: float, log: RunLog) -> None:
    """POST a report as JSON.

    Parameters
    ----------
    url : str
        http or https; only its host is logged, since many carry a secret in their path.
    report : str
        JSON.
    timeout : float
        Seconds that all of it may take, from looking the host up to the end of the answer's head.
    log : RunLog
        Takes the event `webhook`.
    """
    became: SimpleQueue[dict[str, Any]] = SimpleQueue()
    # A socket's timeout is for each read: a server that drips bytes would hold the job for ever.
    Thread(target=lambda: became.put(_posted(url, report, timeout)), daemon=True).start()
    try:
        fields = became.get(timeout=timeout)
    except Empty:
        fields = {"ok": False, "error": f"no answer within {timeout:g} s"}
    log("webhook", host=urlsplit(url).hostname, **fields)


def run_command(command: Sequence[str], report: Path, folder: Path, timeout: float, log: RunLog) -> None:
    """Run a command with the report's path in its environment, as `MOTIONARY_REPORT`.

    Parameters
    ----------
    command : sequence of str
        Program and arguments; no shell reads them.
    report : Path
        Its path is the variable's value.
    folder : Path
        Where it runs: the configuration file's folder.
    timeout : float
        Seconds until it is ended.
    log : RunLog
        Takes the event `command`, with the end of what it printed.
    """
    try:
        ended = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, REPORT_VARIABLE: str(report)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=timeout,
            check=False,
        )
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        log("command", ok=False, program=command[0], error=str(error))
        return
    printed = ended.stdout.decode(errors="replace")[-_LAST_WORDS:]
    if ended.returncode:
        log("command", ok=False, program=command[0], error=f"exit code {ended.returncode}", printed=printed)
    else:
        log("command", ok=True, program=command[0], printed=printed)


def _posted(url: str, report: str, timeout: float) -> dict[str, Any]:
    headers = {"Content-Type": "application/json", "User-Agent": "motionary"}
    try:
        request = urllib.request.Request(url, report.encode(), headers, method="POST")
        with urllib.request.urlopen(request, timeout=timeout) as answer:
            return {"ok": True, "answer": answer.status}
    except (OSError, HTTPException, ValueError) as error:  # ValueError: an address with a port that is none
        return {"ok": False, "error": str(error) or type(error).__name__}
