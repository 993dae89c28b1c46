"""How well new motions are assigned to clusters: takes of a catalog are held out and assigned to the others.

Every fold makes the clusters anew without the takes that it holds out: by the run's linkage and cut, with the
labels of the others alone, their references chosen again by the similarity index. Held out are

    takes      a fifth of the clips at a time; clips of equal bytes go together
    subjects   a fifth of the subjects at a time, where the subject of every clip is known
    classes    one class at a time, all of it: nothing of it ought to be assigned

`assign_trial.py` has the rules that choose a cluster. A take may be refused for its distance from the
cluster's reference, beyond `reach` times that of the furthest clip; or from its nearest clip, beyond `reach`
times what 95% of the clips are from theirs; `motionary assign` wants it within both.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog import Catalog
from motionary.catalog.own_pairs import refuse_without_all_pairs
from motionary.pipeline.tables import table_field
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce.assign_trial import (
    FROM_REFERENCE,
    KnownClips,
    Outcome,
    Places,
    assign_held_out,
    read_known_clips,
)
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.labelled import labelled_clips

FOLDS = 5
MOST_CLIPS = 1500
"""Of a set; among more, these are drawn first, since every fold clusters them all."""

TAKES, SUBJECTS, CLASSES = "takes", "subjects", "classes"
ALL = "all"

_ROWS = pa.schema(
    [
        table_field("clips", pa.string(), "of which dataset, or all"),
        table_field("held_out", pa.string(), "takes, subjects or classes"),
        table_field("rule", pa.string(), "how a cluster was chosen"),
        table_field("reach", pa.string(), "where the distance is measured that may refuse a take"),
        table_field("tested", pa.int32(), "takes that were assigned, each draw counted"),
        table_field("right", pa.float64(), "share given their class's name, reach aside", nullable=True),
        table_field("assigned", pa.float64(), "share within reach"),
        table_field("confidence", pa.float64(), "mean confidence in the names"),
    ]
)


@dataclass(frozen=True, eq=False)
class AssignStudy:
    """Shares of held-out takes that were named rightly, and that were assigned at all."""

    rows: pa.Table

    def to_arrow(self) -> pa.Table:
        """Return a row for every set of clips, way of holding out, rule and reach."""
        return self.rows

    def share(self, column: str, clips: str, held_out: str, rule: str, reach: str = FROM_REFERENCE) -> float:
        """Return one figure; NaN where there is none."""
        asked = (clips, held_out, rule, reach)
        for row in self.rows.to_pylist():
            if (row["clips"], row["held_out"], row["rule"], row["reach"]) == asked:
                return float("nan") if row[column] is None else row[column]
        return float("nan")


@dataclass(frozen=True, eq=False)
class _Set:
    """Some labelled clips: their names, classes, and subjects where all are known."""

    name: str
    clip_ids: list[str]
    classes: NDArray[np.object_]
    subjects: NDArray[np.object_] | None


def study_assign(
    catalog: Catalog, label_column: str, draws: int, seed: int, show: Show
) -> Conducted[AssignStudy]:
    """Hold takes of a labelled catalog out, all of its clips and each dataset's alone.

    Parameters
    ----------
    catalog : Catalog
        Its distances are read, and none computed.
    label_column : str
        The column that holds the classes.
    draws : int
        How often clips, and subjects, are parted into folds.
    seed : int
        Of the folds. The same seed gives the same result.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    CatalogError
        The run compared some pairs alone.
    UserError
        The catalog has no such labels, or too few.
    """
    refuse_without_all_pairs(catalog, "an experiment on naming")
    sets = _sets(catalog, label_column, seed)
    rows: list[dict] = []
    with show({"assign": len(sets)}) as advance:
        for one in sets:
            known = read_known_clips(catalog, one.clip_ids, one.classes)
            for held_out, folds in _ways(one, known.digests, draws, seed).items():
                rows += _scored(one.name, held_out, known, folds)
            advance("assign")
    notes = [
        f"{len(sets[0].clip_ids)} clips of {len(set(sets[0].classes))} classes ({label_column}); "
        f"{draws} times parted into {FOLDS} folds, seed {seed}. In every fold the clusters are made, cut, "
        "named and given their references anew, without what it holds out."
    ]
    return Conducted(AssignStudy(pa.Table.from_pylist(rows, schema=_ROWS)), notes)


def _sets(catalog: Catalog, label_column: str, seed: int) -> list[_Set]:
    """List all labelled clips, then those of each dataset where there are several."""
    clips = labelled_clips(catalog, label_column)
    known = catalog.clips.to_pandas().set_index("clip_id")
    dataset = known.loc[clips.clip_ids, "dataset"].to_numpy(object) if "dataset" in known else None
    parts = {ALL: np.arange(len(clips.clip_ids))}
    if dataset is not None:
        names = sorted({one for one in dataset if isinstance(one, str) and one})
        parts |= {name: np.flatnonzero(dataset == name) for name in names if len(names) > 1}
    rng = np.random.default_rng(seed)
    subject = known.loc[clips.clip_ids, "subject"]
    sets = []
    for name, places in parts.items():
        some = np.sort(rng.permutation(places)[:MOST_CLIPS])
        if len(set(clips.classes[some])) < 2 or len(some) < 2 * FOLDS:
            continue
        of_some = subject.iloc[some]
        told = bool(of_some.notna().all() and of_some.nunique() > 1)
        ids = [clips.clip_ids[one] for one in some]
        sets.append(_Set(name, ids, clips.classes[some], of_some.to_numpy(object) if told else None))
    if not sets:
        raise UserError(
            f"{len(clips.clip_ids)} labelled clips of {catalog.store.url} are too few: a study parts "
            f"{2 * FOLDS} or more of two classes; label more clips"
        )
    return sets


def _ways(one: _Set, digests: NDArray[np.object_], draws: int, seed: int) -> dict[str, list[Places]]:
    """List what each fold of each way of holding out holds out."""
    ways = {TAKES: list(_folds(digests, draws, seed))}
    if one.subjects is not None:
        ways[SUBJECTS] = list(_folds(one.subjects, draws, seed))
    ways[CLASSES] = [np.flatnonzero(one.classes == name) for name in sorted(set(one.classes))]
    return ways


def _folds(groups: NDArray[np.object_], draws: int, seed: int) -> Iterator[Places]:
    """Part clips into folds that no group is in two of, several times over."""
    names, group_of = np.unique(groups.astype(str), return_inverse=True)
    for draw in range(draws):
        fold_of = np.random.default_rng([seed, draw]).permutation(len(names)) % FOLDS
        folds = [np.flatnonzero(fold_of[group_of] == fold) for fold in range(FOLDS)]
        yield from (fold for fold in folds if len(fold))


def _scored(name: str, held_out: str, known: KnownClips, folds: list[Places]) -> list[dict]:
    """Assign what every fold holds out, and average over all takes."""
    every = np.arange(len(known.classes))
    found: dict[tuple[str, str], list[Outcome]] = {}
    for fold in folds:
        kept = np.setdiff1d(every, fold)
        if len(kept) > 1:
            for outcome in assign_held_out(known, kept, fold):
                found.setdefault((outcome.rule, outcome.reach), []).append(outcome)
    rows = []
    for (rule, reach), outcomes in found.items():
        # Of a class that nobody has shown, no name can be right: only what became of the others is told.
        wanted = [~one.known if held_out == CLASSES else one.known for one in outcomes]
        of = {
            field: np.concatenate(
                [getattr(one, field)[some] for one, some in zip(outcomes, wanted, strict=True)]
            )
            for field in ("right", "within", "confidence")
        }
        tested = len(of["within"])
        if tested:
            rows.append(
                {
                    "clips": name,
                    "held_out": held_out,
                    "rule": rule,
                    "reach": reach,
                    "tested": tested,
                    "right": None if held_out == CLASSES else float(of["right"].mean()),
                    "assigned": float(of["within"].mean()),
                    "confidence": float(of["confidence"].mean()),
                }
            )
    return rows
