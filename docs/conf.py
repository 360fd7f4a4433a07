"""Sphinx's settings for the manual: ``make docs``.

The source folder is the repository itself, so that every link between pages, notebooks and the
files beside them is the same here and on a code host.
"""

import os
import shutil
import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
# pages that are run call the command and the interpreter of this environment
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
# and nothing of what a user has set for notebooks
profile = Path(__file__).parents[1] / "build" / "ipython" / "profile_default"
profile.mkdir(parents=True, exist_ok=True)
shutil.copy(Path(__file__).parent / "_ext" / "ipython_kernel_config.py", profile)
os.environ["IPYTHONDIR"] = str(profile.parent)
os.environ.setdefault("MPLBACKEND", "module://matplotlib_inline.backend_inline")

project = "mocapdb"
author = "the mocapdb developers"
release = metadata.version("mocapdb")

extensions = ["sphinx.ext.autodoc", "numpydoc", "myst_nb", "manual"]
root_doc = "docs/index"
include_patterns = ["docs/**.md", "notebooks/*.ipynb", "CHANGELOG.md", "CONTRIBUTING.md"]
exclude_patterns = [
    ".*", "benchmarks", "blender", "build", "data", "demo", "dist", "mocapdb", "scripts", "tests",
    "docs/tables/peers.md",
]  # fmt: skip
nitpicky = False
smartquotes = False  # options begin with two hyphens
suppress_warnings = ["mystnb.unknown_mime_type"]  # what plays in a notebook says its type by itself

# -- pages -----------------------------------------------------------------------------------------
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = os.environ.get("MANUAL_EXECUTION", "cache")
if nb_execution_mode == "off":  # then nobody says that lines for a shell are IPython's
    suppress_warnings += ["misc.highlighting_failure"]
nb_execution_cache_path = str(Path(__file__).parents[1] / "build" / "manual-cells")
nb_execution_in_temp = True
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True
nb_ipywidgets_js = {}  # they would come from outside
nb_mime_priority_overrides = [("html", "image/gif", 5)]

# -- the reference ---------------------------------------------------------------------------------
default_role = "py:obj"  # a name in single backticks: a link where there is one, else code
autodoc_typehints = "none"  # the docstrings say types, shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# -- the looks -------------------------------------------------------------------------------------
html_theme = "furo"
html_title = f"mocapdb {release}"
html_static_path = ["_static"]
html_css_files = ["manual.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
html_show_sphinx = False
pygments_style = "friendly"
