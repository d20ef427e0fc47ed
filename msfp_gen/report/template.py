"""Pages from templates: one file each, with style, pictures and data inside, which loads no other file."""

from __future__ import annotations

import base64
import json
import re
from importlib.resources import files
from io import BytesIO
from typing import TYPE_CHECKING, Any

from msfp_gen.version import __version__

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure

RESOLUTION = 110  # dots per inch of the figures


def render(template: str, **values: Any) -> str:
    """The page of a template in assets/, as text. An undefined name is an error; text is escaped."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True, loader=FunctionLoader(asset)
    )
    return environment.get_template(template).render(version=__version__, style=Markup(asset("page.css")), **values)


def picture(title: str, figure: Figure) -> dict[str, str]:
    """A figure as the templates show it: its title and its PNG data."""
    data = BytesIO()
    figure.savefig(data, format="png", dpi=RESOLUTION)
    return {"title": title, "png": base64.b64encode(data.getvalue()).decode("ascii")}


def asset(name: str) -> str:
    """A file of assets/ as text."""
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")


def script_data(data: Any) -> Markup:
    """Data as JSON inside a script element, which no text in it can end: <, > and & are escaped."""
    from markupsafe import Markup

    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(re.sub(r"[<>&]", lambda match: f"\\u{ord(match[0]):04x}", text))
