"""What the process that writes a log is told before it begins.

The module imports neither Arrow nor anything of a robot, since both sides have it: the loop tells, the writer
reads.
"""

import json
from typing import Any, NamedTuple

from taskopt.log.slots import Column, Field


class Instructions(NamedTuple):
    """What a writer is told on its standard input, as one line of JSON.

    Attributes:
        path: The file to write.
        fields: Fields of a slot.
        columns: Columns of the file.
        metadata: Text by key for the schema of the file.
    """

    path: str
    fields: list[Field]
    columns: list[Column]
    metadata: dict[str, str]

    @staticmethod
    def read(text: str) -> "Instructions":
        """Read the line.

        Args:
            text: JSON that `line` wrote.

        Returns:
            The instructions.
        """
        path, fields, columns, metadata = json.loads(text)
        return Instructions(
            path, [Field(*field) for field in fields], [_column(*each) for each in columns], metadata
        )

    def line(self) -> str:
        """Return the instructions as one line of JSON."""
        return json.dumps(self) + "\n"


def _column(*parts: Any) -> Column:
    """Return a column of its parts, in which JSON has made lists of tuples."""
    column = Column(*parts)
    return column._replace(words=tuple(column.words), names=tuple(column.names))
