"""One run on a small file system, in a mount namespace of its own; started by `tests.torture.disk`.

Prints `refused MESSAGE` or, where there was room enough, `finished`; exits with 1 where something is wrong.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from tests.torture.disk import Disk, _judge
from tests.torture.world import contents, differences, motionary, run_arguments


def main(free_kib: int, mount: Path, before: Path, library: Path) -> int:
    """Fill a disk but for `free_kib`, run, make room, run again."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64m", "none", str(mount)], check=True)
    catalog, log = mount / "catalog", before.parent / "small-disk.txt"
    shutil.copytree(before, catalog)
    _fill(mount, free_kib)
    old = contents(before)
    arguments = run_arguments(library, catalog)
    done = motionary(*arguments)
    log.write_text(done.stdout + done.stderr)
    if done.returncode == 0:
        print("finished")
        return 0
    found = Disk()
    _judge(f"disk with {free_kib} KiB free", done.returncode, log, catalog, found)
    found.faults += differences(old, contents(catalog))
    (mount / "filling").unlink()
    again = motionary(*arguments)
    if again.returncode:
        found.faults.append(f"the next run ends with {again.returncode}: {again.stderr[-1000:]}")
    print("refused", *found.messages, *found.faults)
    return 1 if found.faults else 0


def _fill(mount: Path, free_kib: int) -> None:
    free = shutil.disk_usage(mount).free
    (mount / "filling").write_bytes(bytes(max(free - free_kib * 1024, 0)))


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), *map(Path, sys.argv[2:])))
