"""One HTML file of a page's templates: a base, one template for each section, and pictures inside the file.

A section is a template in templates/<page>/ that sets its `title`; an editor can change all words there. It gets
numbers by name from slurrycast.report.sections and formats them by the filters of slurrycast.report.formats.
"""

import base64
import io
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import jinja2
from markupsafe import Markup

from slurrycast.evaluation import verdicts
from slurrycast.report import formats, reference_article

TEMPLATES = Path(__file__).with_name("templates")
# Figures have 150 pixels an inch and text of 9 to 10 points; this shows it at 13 to 15 CSS pixels.
CSS_PIXELS_PER_PIXEL = 0.7


class Picture(NamedTuple):
    """A picture as a data URI, and the width in CSS pixels at which its text is as large as the page's."""

    uri: str
    width_px: int


def picture(path: Path) -> Picture:
    """Read the picture of a figure; 3D pictures become WebP, which is several times smaller."""
    from PIL import Image

    content, kind = path.read_bytes(), "png"
    with Image.open(path) as image:
        width_px = round(image.width * CSS_PIXELS_PER_PIXEL)
        if path.name.startswith(("slurry_", "render_tape_")):
            buffer = io.BytesIO()
            image.convert("RGB").save(buffer, "WEBP", quality=88)
            content, kind = buffer.getvalue(), "webp"
    return Picture(f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}", width_px)


def environment() -> jinja2.Environment:
    """The templates with their filters; a name that a template does not get is an error."""
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        extensions=["jinja2.ext.do"],
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = (formats.number, formats.numbers, formats.span, formats.listed, formats.named, formats.columns, picture)
    templates.filters |= {function.__name__: function for function in filters}
    templates.globals |= {"separator": formats.separator, "article": reference_article, "judgement": verdicts}
    return templates


def page_html(page: str, sections: Mapping[str, Mapping | None], shared: Mapping) -> str:
    """Render a page that loads nothing from elsewhere.

    Parameters
    ----------
    page
        "report", "evaluation" or "explore": the folder of the templates.
    sections
        Names that each section's template gets, by its stem and in the order of the page; None leaves it out.
    shared
        Names that all templates of the page get.
    """
    templates = environment()
    rendered = []
    for name, values in sections.items():
        if values is not None:
            module = templates.get_template(f"{page}/{name}.html.jinja").make_module({**shared, **values})
            rendered.append({"title": module.title, "body": Markup(module)})
    return templates.get_template(f"{page}/page.html.jinja").render({**shared, "sections": rendered})
