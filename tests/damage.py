"""Damage of files for tests, and texts that differ from a good one."""

from pathlib import Path

from hypothesis import strategies as st

NUMBERS = ["nan", "-inf", "1e999", "9" * 5000, "-1", "0", "1_0", "٣", "²", "0x10", "", "\0"]


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def flip(path: Path) -> None:
    """Flip a bit in the middle."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def variants(text: str) -> st.SearchStrategy[bytes]:
    """A text, any text, and the text with one of its words, lines or characters replaced by something else."""
    words = text.split(" ")
    lines = text.splitlines(keepends=True)
    piece = st.one_of(st.sampled_from(NUMBERS), st.text(max_size=20))

    def replaced(parts, glue):
        places = st.integers(0, len(parts) - 1)
        return st.builds(lambda at, new: glue.join([*parts[:at], new, *parts[at + 1 :]]), places, piece)

    texts = st.one_of(st.text(), replaced(words, " "), replaced(lines, ""), replaced(list(text), ""))
    return texts.map(lambda text: text.encode("utf-8", errors="surrogatepass"))


def assert_names_its_file(error: Exception, path: Path) -> None:
    """The message is one line that starts with the path."""
    assert str(error).startswith(f"{path}: ")
    assert len(str(error).splitlines()) == 1
