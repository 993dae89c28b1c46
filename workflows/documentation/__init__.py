"""The documentation site: its pages, what of them is made from the code, and the build by `make docs`.

In reading order: `__main__` (the command), `site` (from the repository to HTML), `staging` (the sources that
Sphinx gets), `links` (paths in the repository become pages), `making` (what a page may ask to be made),
`table_text`, `command_text` and `python_text` (reference from schemas, the command line and docstrings, put
together by `markdown`), `pictures` (charts and players of the embedded library), `contact_sheet` (the
README's), `rendered_notebooks`, `conf` and `sphinx_parts` (how Sphinx is set up).
"""
