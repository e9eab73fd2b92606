"""Compute a sweep with processes on this machine or a Dask cluster, and keep each case when it is done.

The file `sweep.jsonl` has the conditions on its first line, and one case with its figures on each other line.
A repeated sweep computes only the cases that are missing in it.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError

from taskopt.arrays import positive
from taskopt.bench.rows_file import append, differences, whole_entries
from taskopt.bench.sweep.case import Figure, run_case
from taskopt.bench.sweep.grid import Case, Grid
from taskopt.errors import InvalidValue, NotInstalled, NotSolved
from taskopt.log.provenance import versions
from taskopt.loop.scenario import DEMO, load_scenario
from taskopt.loop.variation import varied
from taskopt.resolver.registry import resolver

FILE = "sweep.jsonl"
_DEATHS = 5  # of local workers, after which a sweep gives up; what is done is kept


@dataclass(frozen=True)
class Sweep:
    """What is to be swept.

    Attributes:
        file: The scenario file, which is executed, or "demo".
        grid: The cases.
        duration: Length of each run [s]; None for the scenario's own.
        dt: Time between ticks [s]; None for the scenario's own.
        spread: Largest distance of a joint from the start of the scenario, for seeds other than 0 [rad, m].
        judged: Number of ticks of each run that are judged.

    Raises:
        MissingFile: There is no such scenario.
        UnknownName: There is no parameter or resolver of a name.
        InvalidValue: A parameter does not take one of its values, or a number is not positive.
    """

    file: str
    grid: Grid
    duration: float | None = None
    dt: float | None = None
    spread: float = 0.1
    judged: int = 20

    def __post_init__(self) -> None:
        positive("spread", self.spread)
        for name in self.grid.resolvers:
            resolver(name)
        scenario, first = load_scenario(self.file), next(self.grid.cases()).settings
        for place, one in enumerate(self.grid.axes):
            for value in one.values:
                settings = (*first[:place], f"{one.address}={value}", *first[place + 1 :])
                varied(scenario, settings, self.duration, self.dt)

    def conditions(self) -> dict[str, Any]:
        """Return what the figures depend on besides the case, as plain data."""
        text = (DEMO if self.file == "demo" else Path(self.file)).read_bytes()
        return {
            "scenario": self.file,
            "sha256": hashlib.sha256(text).hexdigest(),
            "duration": self.duration,
            "dt": self.dt,
            "spread": self.spread,
            "judged": self.judged,
            "versions": versions(),
        }

    def arguments(self, case: Case) -> tuple[Any, ...]:
        """Return the arguments of `run_case`.

        Args:
            case: The case.

        Returns:
            The arguments.
        """
        return self.file, case, self.duration, self.dt, self.spread, self.judged


def carry_out(
    sweep: Sweep, folder: Path, jobs: int = -1, scheduler: str | None = None
) -> Iterator[tuple[int, int]]:
    """Compute the cases that are missing, and keep each when it is done.

    Args:
        sweep: The sweep.
        folder: Folder of the file; it is made if it is not there.
        jobs: Number of processes on this machine; −1 for one on each core.
        scheduler: Address of the scheduler of a Dask cluster, such as "tcp://10.0.0.1:8786", to use that
            instead; its workers must have the same packages and find the scenario file under the same path.

    Yields:
        Number of cases that are done, and number of all.

    Raises:
        InvalidValue: The number of processes is 0, or the folder has cases of other conditions.
        NotInstalled: Dask is to be used, and dask.distributed is not there.
        NotSolved: Workers died several times; what is done is kept.
    """
    if jobs == 0:
        raise InvalidValue("the number of processes must be at least 1, or −1 for one on each core; got 0")
    folder.mkdir(parents=True, exist_ok=True)
    file, wanted, here = folder / FILE, dict.fromkeys(sweep.grid.cases()), sweep.conditions()
    done = _known(file, here)
    missing = [case for case in wanted if case not in done]
    if not done:
        append(file, {"conditions": here})
    count, total = len(wanted) - len(missing), len(wanted)
    yield count, total
    results = _by_dask(sweep, missing, scheduler) if scheduler else _by_processes(sweep, missing, jobs)
    for case, figures in results:
        append(file, {"case": case._asdict(), "figures": figures})
        count += 1
        yield count, total


def read_sweep(folder: Path, grid: Grid | None = None) -> dict[Case, dict[str, Figure]]:
    """Read the cases that are done.

    Args:
        folder: Folder of a sweep.
        grid: The cases to return, in its order; None for all, in the order in which they were done.

    Returns:
        Figures by case.

    Raises:
        InvalidValue: The file is not that of a sweep.
    """
    done = _known(folder / FILE, None)
    return done if grid is None else {case: done[case] for case in grid.cases() if case in done}


def _known(file: Path, here: dict[str, Any] | None) -> dict[Case, dict[str, Figure]]:
    """Return the cases of a file, whose conditions must be the given ones; None for any."""
    done: dict[Case, dict[str, Figure]] = {}
    try:
        for entry in whole_entries(file, repair=here is not None):
            if "conditions" in entry:
                _refuse_others(file, entry["conditions"], here)
                continue
            case = Case(**(entry["case"] | {"settings": tuple(entry["case"]["settings"])}))
            done[case] = entry["figures"]
    except (KeyError, TypeError) as error:
        raise InvalidValue(f"{file} is not the file of a sweep: {error!r}") from error
    return done


def _refuse_others(file: Path, then: dict[str, Any], here: dict[str, Any] | None) -> None:
    """Raise `InvalidValue` if the cases of a file were computed under other conditions."""
    changed = [] if here is None else differences(then, here)
    if changed:
        raise InvalidValue(
            f"{file} is a sweep under other conditions ({'; '.join(changed)}); take another --out"
        )


def _by_processes(sweep: Sweep, cases: Sequence[Case], jobs: int) -> Iterator[tuple[Case, dict[str, Figure]]]:
    """Compute cases in processes on this machine; if one dies, those that are missing are begun anew."""
    done: set[Case] = set()
    # Cases are handed out one by one, since a batch that a worker leaves unfinished is lost as a whole.
    options: dict[str, Any] = {"n_jobs": jobs, "return_as": "generator_unordered", "batch_size": 1}
    for _ in range(_DEATHS):
        missing = [case for case in cases if case not in done]
        try:
            with parallel_config(backend="loky", inner_max_num_threads=1):
                work = delayed(_with_case)
                calls = (work(case, sweep.arguments(case)) for case in missing)
                results: Any = Parallel(**options)(calls)  # a generator, which joblib's types do not say
                for case, figures in results:
                    yield case, figures
                    done.add(case)
            return
        except TerminatedWorkerError:
            continue
    missing = [case for case in cases if case not in done]
    raise NotSolved(
        f"workers died {_DEATHS} times, and {len(missing)} of {len(cases)} cases are missing, among them "
        f"{missing[0]}; the same command goes on with what is missing"
    )


def _with_case(case: Case, arguments: tuple[Any, ...]) -> tuple[Case, dict[str, Figure]]:
    """Run a case, and return it with its figures, since results come in any order."""
    return case, run_case(*arguments)


def _by_dask(sweep: Sweep, cases: Sequence[Case], address: str) -> Iterator[tuple[Case, dict[str, Figure]]]:
    """Compute cases on a Dask cluster, which gives those of a worker that dies to another one."""
    try:
        distributed = import_module("distributed")
    except ImportError as error:
        raise NotInstalled("dask.distributed, which --scheduler uses,", "'taskopt[dask]'") from error
    with distributed.Client(address) as client:
        futures = [client.submit(_with_case, case, sweep.arguments(case), pure=False) for case in cases]
        for future in distributed.as_completed(futures):
            yield future.result()
            future.release()
