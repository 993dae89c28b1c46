"""From the repository to a site: the embedded library is catalogued, sources are staged, Sphinx writes HTML.

Any warning of Sphinx fails the build: a link that leads nowhere, a name that is not there, a page that no
other names.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from motionary.pipeline.synthetic import write_library
from motionary.workflows.documentation.rendered_notebooks import render_notebooks
from motionary.workflows.documentation.staging import stage
from motionary.workflows.errors import UserError
from motionary.workflows.notebook_catalog import DEMO, make_catalog


def build_site(repository: Path, out: Path) -> None:
    """Build the whole site.

    Parameters
    ----------
    repository : Path
        The root of a clone.
    out : Path
        Folder of the site; what was there is replaced once the build has succeeded.

    Raises
    ------
    UserError
        `repository` is no clone of this one, `out` is a folder of something else, or Sphinx warns.
    """
    if not (repository / "workflows" / "documentation" / "pages").is_dir():
        raise UserError(f"{repository} holds no documentation; run this in the root of the repository")
    if out.exists() and not (out / "objects.inv").exists():
        raise UserError(f"{out} is there and is no site that was built before; name another folder")
    with TemporaryDirectory(prefix="motionary-docs-") as made:
        sources, site = Path(made, "sources"), Path(made, "site")
        demo = Path(made, DEMO)
        library = demo / "library"
        write_library(library)
        with make_catalog([library], demo / "catalog", labels=library / "labels.csv") as catalog:
            stage(repository, sources, catalog)
        render_notebooks(repository / "notebooks", sources / "notebooks", demo.parent)
        write_html(sources, site, Path(made, "doctrees"))
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(site, out)


def write_html(sources: Path, site: Path, doctrees: Path) -> None:
    """Have Sphinx write a staged site.

    Raises
    ------
    UserError
        Sphinx warned of something: it has said on stderr of what.
    """
    from sphinx.cmd.build import build_main

    options = ["-b", "html", "-n", "-W", "--keep-going", "-q", "-d", str(doctrees)]
    if build_main([*options, str(sources), str(site)]):
        raise UserError("the site was not built: mend what Sphinx told of above")
