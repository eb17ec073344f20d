"""What a page of HTML says and loads, for tests of the report and of the evaluation."""

from html.parser import HTMLParser

VOID_TAGS = {"meta", "img", "br", "hr", "link", "input"}
BLOCKS = {"p", "li", "td", "th", "h1", "h2", "h3", "figcaption"}


class Page(HTMLParser):
    """Text, blocks by tag, rows of tables, addresses and number of images; tags that are not closed fail."""

    def __init__(self, html: str):
        super().__init__()
        self.open, self.pieces, self.blocks, self.rows, self.addresses, self.images = [], [], [], [], [], 0
        self.feed(html)
        self.close()
        assert self.open == []
        self.text = " ".join("".join(self.pieces).split())

    def handle_starttag(self, tag, attrs):
        if tag not in VOID_TAGS:
            self.open.append(tag)
        if tag in BLOCKS:
            self.blocks.append((tag, ""))
            self.pieces.append(" ")
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        self.images += tag == "img"
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("style", "title"):
            return
        self.pieces.append(data)
        if BLOCKS & set(self.open):
            tag, text = self.blocks[-1]
            self.blocks[-1] = (tag, f"{text}{data}")
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data

    def all(self, tag: str) -> list[str]:
        """Texts of all elements of one tag."""
        return [" ".join(text.split()) for name, text in self.blocks if name == tag]

    @property
    def loads_nothing(self) -> bool:
        """Whether all that it refers to is in the page itself."""
        return all(address.startswith(("#", "data:image/")) for address in self.addresses)
