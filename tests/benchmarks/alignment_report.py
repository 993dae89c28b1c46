"""The figures of the alignment: the record's rows, and the table for a terminal."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Figure:
    """One figure of the report.

    Parameters
    ----------
    what : str
        With its unit.
    measured : float
    form : str
        How it is printed.
    required : float, optional
        At most, or `at_least`.
    binding : bool
        Whether the program fails where it is missed.
    samples : list of float
        What a median was taken of, in seconds.
    """

    what: str
    measured: float
    form: str = ".2f"
    required: float | None = None
    at_least: bool = False
    binding: bool = False
    samples: list[float] = field(default_factory=list)

    @property
    def met(self) -> bool | None:
        """Whether it is as required; None where nothing is. What is no number is not."""
        if self.required is None:
            return None
        return self.measured >= self.required if self.at_least else self.measured <= self.required


def as_row(figure: Figure) -> dict:
    """Return a figure and whether it is met, as values that JSON can hold."""
    return asdict(figure) | {"met": figure.met}


def print_figures(
    record: dict, console: Console, how: str = "one thread but where more are named; medians"
) -> None:
    """Print a record and how it was taken; a quick run gives no verdict but on what is binding."""
    machine = record["machine"]
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    if record["quick"]:
        console.print("A quick run, to see that it runs: its figures mean nothing.", highlight=False)
    console.print(
        f"{machine['processor']}, {machine['cores']} cores, Python {machine['python']}", highlight=False
    )
    console.print(f"{packages}; {how}", highlight=False)
    table = Table()
    for column in ("figure", "measured", "required", ""):
        table.add_column(column, justify="right" if column == "measured" else "left")
    verdicts = {None: "", True: "met", False: "MISSED"}
    for row in record["figures"]:
        sign = ">=" if row["at_least"] else "<="
        asked = "" if row["required"] is None else f"{sign} {row['required']:g}"
        verdict = "" if record["quick"] and not row["binding"] else verdicts[row["met"]]
        table.add_row(row["what"], format(row["measured"], row["form"]), asked, verdict)
    console.print(table)
