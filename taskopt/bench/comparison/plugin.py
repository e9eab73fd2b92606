"""Files of users that register solvers and resolvers of their own for a comparison."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from taskopt.errors import InvalidValue, MissingFile


def load_plugin(path: str | Path) -> None:
    """Execute a Python file, which calls `register_solver` or `register_resolver`.

    Load only files that you trust.

    Args:
        path: The file.

    Raises:
        MissingFile: There is no such file.
        InvalidValue: It is not a Python file.
    """
    file = Path(path)
    if not file.is_file():
        raise MissingFile(f"no file '{file}' that registers solvers or resolvers")
    spec = spec_from_file_location(f"taskopt_plugin_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise InvalidValue(f"{file} is not a Python file; a file with register_solver(…) ends in .py")
    spec.loader.exec_module(module_from_spec(spec))
