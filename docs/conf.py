"""Sphinx's settings. ``python -m docs`` builds; it stages the sources first, so Sphinx alone is not enough."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "algorithms"))

from deadwood_algorithms.params.tool import VERSION

project = "Deadwood Toolbox"
author = "The Deadwood Toolbox authors"
version = release = VERSION
language = "en"

extensions = ["myst_nb", "sphinx_design", "sphinx_copybutton"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = os.environ.get("DEADWOOD_DOCS_NOTEBOOKS", "off")
nb_execution_timeout = 900
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_merge_streams = True
# There are no formulas, and MathJax would need the network.
myst_update_mathjax = False
highlight_language = "none"
nitpicky = True
# Pages that were written for the repository begin some sections at the third level.
suppress_warnings = ["myst.header"]
copybutton_exclude = ".linenos, .gp"

smartquotes = False  # options begin with two hyphens
html_theme = "pydata_sphinx_theme"
html_title = f"Deadwood Toolbox {VERSION}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["search.js"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": True,
    "navigation_with_keys": False,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
}
copyright = f"{author}, BSD 3-Clause"
