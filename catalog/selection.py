"""Some clips of a catalog: chosen by what is known of them, looked at as a table, read one after another."""

from __future__ import annotations

import random
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pyarrow as pa

from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.motions import stream_features, stream_motions
from motionary.catalog.sql import TAKES, Parameters, quoted
from motionary.pipeline.motion import FloatArray, Motion

if TYPE_CHECKING:
    import pandas as pd

    from motionary.catalog.query import Catalog

Wanted = str | float | bool | Collection[str | float | None] | None


@dataclass(frozen=True, eq=False, repr=False)
class Selection:
    """Some clips of an opened catalog.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : sequence of str
        In clip_id order.
    """

    catalog: Catalog
    clip_ids: Sequence[str]

    def __len__(self) -> int:
        return len(self.clip_ids)

    def __repr__(self) -> str:
        return f"<{len(self)} of {len(self.catalog.clips)} clips of {self.catalog.store.url}>"

    def _repr_html_(self) -> str:
        from motionary.catalog.views.notebook import table_html

        return table_html(repr(self), self.to_arrow())

    def to_arrow(self) -> pa.Table:
        """Read what is known of the clips: the columns of `clips` and of `clusters`, a row a clip."""
        return self.catalog.sql(
            f"from {TAKES} where clip_id in (select unnest($chosen)) order by clip_id",
            {"chosen": self.clip_ids},
        )

    def to_pandas(self) -> pd.DataFrame:
        """Read what is known of the clips as a data frame."""
        return self.to_arrow().to_pandas()

    def filter(
        self, *, min_seconds: float | None = None, max_seconds: float | None = None, **columns: Wanted
    ) -> Selection:
        """Choose among them by what is known of them.

        Parameters
        ----------
        min_seconds, max_seconds : float, optional
            Bounds of the length, included.
        **columns
            Any column of `clips` or `clusters`, such as `label`, `cluster_id` or a supplied label: the value
            it has, one of several values, None where it has none.

        Raises
        ------
        CatalogError
            There is no such column.
        """
        known = self.catalog.sql(f"from {TAKES} limit 0").column_names
        conditions: list[str] = []
        parameters: dict[str, object] = {}
        for number, (name, value) in enumerate(columns.items()):
            if name not in known:
                raise CatalogError(
                    f"clips of {self.catalog.store.url} have no column {name!r}{nearest(name, known)}"
                )
            conditions.append(_condition(quoted(name), value, number, parameters))
        for name, sign, bound in (("min_seconds", ">=", min_seconds), ("max_seconds", "<=", max_seconds)):
            if bound is not None:
                conditions.append(f"seconds {sign} ${name}")
                parameters[name] = bound
        return self.where(" and ".join(conditions), parameters) if conditions else self

    def where(self, condition: str, parameters: Parameters | None = None) -> Selection:
        """Choose among them by a condition in SQL, such as `style = 'tired' and seconds > 3`.

        Parameters
        ----------
        condition : str
            Over the columns of view `takes`, those of `clips` and `clusters`; `?` or `$name` stand for
            parameters.
        parameters : sequence or mapping, optional
            Their values.

        Raises
        ------
        CatalogError
            It is no condition.
        """
        found = self.catalog.sql(f"select clip_id from {TAKES} where (\n{condition}\n)", parameters)
        matching = set(found["clip_id"].to_pylist())
        return Selection(self.catalog, [one for one in self.clip_ids if one in matching])

    def sample(self, n: int, seed: int = 0) -> Selection:
        """Draw some of them, the same ones for the same seed; all where there are fewer.

        Raises
        ------
        ValueError
            `n` is below 0.
        """
        if n < 0:
            raise ValueError(f"n is {n}; a sample has at least 0 clips")
        drawn = random.Random(seed).sample(self.clip_ids, min(n, len(self)))
        return Selection(self.catalog, sorted(drawn))

    def motions(self, aligned: bool = False) -> Iterator[Motion]:
        """Read their motions one after another, in the memory of one batch; see `stream_motions`."""
        return stream_motions(self.catalog, self.clip_ids, aligned)

    def features(self, merged: bool = False) -> Iterator[tuple[str, FloatArray]]:
        """Read their features one after another, in the memory of one batch; see `stream_features`."""
        return stream_features(self.catalog, self.clip_ids, merged)


def _condition(column: str, value: Wanted, number: int, parameters: dict[str, object]) -> str:
    if value is None:
        return f"{column} is null"
    if isinstance(value, Collection) and not isinstance(value, str):
        parameters[f"p{number}"] = [one for one in value if one is not None]
        among = f"{column} in (select unnest($p{number}))"
        return f"({among} or {column} is null)" if None in value else among
    parameters[f"p{number}"] = value
    return f"{column} = $p{number}"
