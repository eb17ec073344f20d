"""Scripts run in the process of the tests."""

from types import ModuleType

from slurrycast.runtime.command_line import parse


def call(script: ModuleType, *words: object) -> None:
    """Run `main` of a script with these words of a command line; errors come out as they are raised."""
    script.main(parse(script.add_options, script.__doc__, [*map(str, words)]))
