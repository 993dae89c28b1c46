"""How Sphinx is set up; it lies at the root of the staged sources."""

from importlib.metadata import version as installed

project = "motionary"
author = "the authors of motionary"
version = release = installed("motionary")
language = "en"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "motionary.workflows.documentation.sphinx_parts",
]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # they were executed when they were staged: see rendered_notebooks

add_module_names = False  # above the names stands where they are
autodoc_typehints = "none"  # a docstring says types with their shapes and units
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
default_role = "code"

nitpick_ignore_regex = [
    ("py:class", r"(?!motionary).*"),  # docstrings say types in words, such as array (T, 3)
    ("py:exc", "NotFittedError"),  # scikit-learn's
]

html_theme = "furo"
html_title = "motionary"
html_favicon = "static/icon.svg"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_search_summary = False  # it would fetch pages, which a browser refuses where they are files
html_show_sphinx = False
html_show_copyright = False
html_theme_options = {"navigation_with_keys": True}
