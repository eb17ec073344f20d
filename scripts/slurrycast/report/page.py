"""Pages of tables, figures and sentences: what they are made of, numbers in words, and one HTML file of it all."""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from slurrycast.evaluation.speedup import time_unit
from slurrycast.report import reference_article

TEMPLATE = Path(__file__).with_name("report.html.jinja")
# Figures have 150 pixels an inch and text of 9 to 10 points; this shows it at 13 to 15 CSS pixels.
CSS_PIXELS_PER_PIXEL = 0.7


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str
    kind: str = "text"


@dataclass(frozen=True)
class Points:
    """Sentences, one a line."""

    sentences: Sequence[str]
    kind: str = "points"


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str
    kind: str = "heading"


@dataclass(frozen=True)
class Listing:
    """Text as it is, folded away."""

    title: str
    text: str
    kind: str = "listing"


@dataclass(frozen=True)
class FigureBlock:
    """An embedded picture (data URI), its caption and the width in CSS pixels at which its text is as large as ours."""

    label: str
    caption: str
    image: str
    width_px: int
    kind: str = "figure"


@dataclass(frozen=True)
class Table:
    """Cells are text already; columns whose number is in `texts` are set to the left, those in `article` marked."""

    label: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: Sequence[int] = (0,)
    article: Sequence[int] = ()
    groups: Sequence[tuple[str, int]] = ()
    kind: str = "table"

    def style(self, column: int) -> str:
        """CSS classes of a column."""
        return " ".join(name for name, those in (("text", self.texts), ("article", self.article)) if column in those)


@dataclass(frozen=True)
class Notices:
    """The box at the head of a page: sentences under a title, or what is said where there are none."""

    title: str
    sentences: Sequence[str]
    otherwise: str


@dataclass
class Section:
    """A part of the report."""

    title: str
    blocks: list = field(default_factory=list)


# ---- numbers and words


def number(value: float | None, form: str = ".3g") -> str:
    """Text of a number; a dash where there is none."""
    return "–" if value is None or pd.isna(value) else format(value, form)


def duration(seconds: float | None) -> str:
    """Text of a time span in the unit that fits it."""
    if seconds is None or pd.isna(seconds):
        return "–"
    length_s, unit = time_unit(seconds)
    return f"{seconds / length_s:.3g} {unit}"


def span(values: pd.Series, form: str = ".3g", unit: str = "") -> str:
    """Text of a range: "a to b unit", or the one value."""
    low, high = format(values.min(), form), format(values.max(), form)
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


def listed(words: Sequence[str]) -> str:
    """Text of a list: "a, b and c"."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else list(words))


def named(slurries: Sequence[str]) -> str:
    """Text of some slurries: "slurry 1", "slurries 1 and 2"."""
    return f"{'slurry' if len(slurries) == 1 else 'slurries'} {listed(list(slurries))}"


def pair_name(pair: str) -> str:
    """Name of an RDF's pair in sentences and tables."""
    return "all particles" if pair == "all" else pair


def figure_block(figures: Mapping[str, Path], stem: str, label: str, caption: str) -> list[FigureBlock]:
    """Block of the figure with file name `stem`; none where this run does not make it (3D pictures can be off)."""
    from PIL import Image

    if stem not in figures:
        return []
    path = figures[stem]
    content, kind = path.read_bytes(), "png"
    with Image.open(path) as image:
        width_px = round(image.width * CSS_PIXELS_PER_PIXEL)
        if stem.startswith("slurry_"):  # 3D pictures are several times smaller as WebP
            buffer = io.BytesIO()
            image.convert("RGB").save(buffer, "WEBP", quality=88)
            content, kind = buffer.getvalue(), "webp"
    uri = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    return [FigureBlock(label, caption, uri, width_px)]


def page_html(title: str, lead: str, notices: Notices, sections: Sequence[Section]) -> str:
    """One HTML text that loads nothing from elsewhere."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATE.parent), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template(TEMPLATE.name).render(
        title=title, lead=lead, notices=notices, sections=sections, article=reference_article
    )
