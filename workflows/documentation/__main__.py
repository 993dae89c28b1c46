"""Build the site: `python -m motionary.workflows.documentation FOLDER`, in the repository's root."""

from __future__ import annotations

import sys
from pathlib import Path

from motionary.workflows.commands.options import fail
from motionary.workflows.documentation.site import build_site
from motionary.workflows.errors import UserError

if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "motionary-docs")
    try:
        build_site(Path.cwd(), folder)
    except UserError as error:
        fail(str(error))
    print(f"open {folder / 'index.html'} in a browser")
