"""The documentation site: `make docs`."""

import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))

project = "Sightfield"
release = tomllib.loads((HERE.parent / "pyproject.toml").read_text())["project"]["version"]
version = release

extensions = ["myst_parser", "api_pages", "commands_page", "drake_systems", "indexed_names"]
exclude_patterns = ["pictures", "extensions"]
myst_heading_anchors = 3
# Dashes alone: y' is a derivative, not a quotation.
smartquotes_action = "D"
highlight_language = "text"

default_role = "quoted"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = False
toc_object_entries = False

# References to ours must lead somewhere; what others document is not on this site.
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!sightfield\.).*")]

# Beginnings of addresses, and one that stands for yours.
linkcheck_ignore = [r"https?://$", r"https://matrix\.example\.org"]

html_theme = "furo"
html_title = f"Sightfield {release}"
html_static_path = ["assets"]
html_css_files = ["systems.css"]
html_show_copyright = False
html_copy_source = False
