"""Clips: every file of the library is accounted for, and every clip has its frames."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np

from motionary.catalog.checks.found import Found, has, not_finite, parts, wrong_rows
from motionary.catalog.query import Catalog


def clip_ids(catalog: Catalog) -> list[str]:
    """List the clips in the order of their table."""
    return [clip_id for _, rows in parts(catalog, "clips", ["clip_id"]) for clip_id in rows[0].to_pylist()]


def clips_are_unique_and_sorted(catalog: Catalog) -> Found:
    """Every clip is one row of `clips`, in clip_id order: dendrograms tell clips by their place."""
    ids = clip_ids(catalog)
    wrong = [f"clip {clip_id} has {rows} rows" for clip_id, rows in Counter(ids).items() if rows > 1]
    wrong += [f"{after} stands after {before}" for before, after in pairwise(ids) if before > after]
    return Found(f"{len(ids)} clips", wrong)


def clips_are_accounted_for(catalog: Catalog) -> Found:
    """Every file that the run saw is in `clips` or in `quarantine`, in one of them and once."""
    queries = [
        "select 'clip ' || clip_id || ' is quarantined as well' from clips "
        "join quarantine q on q.path = clip_id",
        "select path || ' is quarantined ' || count(*) || ' times' from quarantine group by path "
        "having count(*) > 1",
    ]
    if has(catalog, "inputs"):
        queries += [
            "select clip_id || ' was seen and is in neither clips nor quarantine' from inputs "
            "where clip_id not in (select clip_id from clips union select path from quarantine)",
            "select clip_id || ' is not among the inputs' from "
            "(select clip_id from clips union select path from quarantine) "
            "where clip_id not in (select clip_id from inputs)",
            "select clip_id || ' is ' || count(*) || ' inputs' from inputs group by clip_id "
            "having count(*) > 1",
            "select 'clip ' || clip_id || ' was made from other bytes than its input has' "
            "from clips join inputs using (clip_id) where clips.digest <> inputs.digest",
        ]
    seen = catalog.sql("select (select count(*) from clips), (select count(*) from quarantine)")
    clips, quarantined = (column[0].as_py() for column in seen.columns)
    note = "" if has(catalog, "inputs") else "; the snapshot has no table inputs to compare them with"
    return Found(f"{clips} clips, {quarantined} quarantined{note}", wrong_rows(catalog, *queries))


def clips_have_their_frames(catalog: Catalog, table: str) -> Found:
    """Every clip has its frames in a table, numbered from 0, in order, in one place, their values finite."""
    lengths, wrong = count_frames(catalog, table)
    expected = {
        clip_id: frames
        for _, rows in parts(catalog, "clips", ["clip_id", "frames"])
        for clip_id, frames in zip(*(column.to_pylist() for column in rows.columns), strict=True)
    }
    wrong += [f"clip {clip_id} has no frames" for clip_id in sorted(expected.keys() - lengths.keys())]
    wrong += [f"{clip_id} has frames and is no clip" for clip_id in sorted(lengths.keys() - expected.keys())]
    if table == "frames":
        wrong += [
            f"clip {clip_id} has {lengths[clip_id]} frames, clips says {expected[clip_id]}"
            for clip_id in sorted(lengths.keys() & expected.keys())
            if lengths[clip_id] != expected[clip_id]
        ]
    wrong += not_finite(catalog, table)
    return Found(f"{sum(lengths.values())} frames of {len(lengths)} clips", wrong)


def merged_frames_cover_every_frame(catalog: Catalog) -> Found:
    """Every frame at the common rate is in one merged frame, and these stand in order."""
    wrong = wrong_rows(
        catalog,
        """select concat_ws(' ', 'merged frame', frame, 'of', clip_id, 'runs from', first_frame, 'to',
                            last_frame, 'after', before)
           from (select *, coalesce(lag(last_frame) over (partition by clip_id order by frame), -1) as before
                 from resampled)
           where first_frame > last_frame or first_frame <> before + 1""",
        """select concat_ws(' ', 'the merged frames of', clip_id, 'end at', ends, 'its frames at', last)
           from (select clip_id, max(last_frame) as ends from resampled group by clip_id)
           join (select clip_id, max(frame) as last from features group by clip_id) using (clip_id)
           where ends <> last""",
    )
    return Found(f"{len(catalog.resampled)} merged frames", wrong)


def the_run_counted_them(catalog: Catalog) -> Found:
    """Every count of the last run's record, of clips, quarantine and clusters, is that of the tables."""
    run = catalog.last_run
    counts = catalog.sql(
        """select (select count(distinct clip_id) from clips) as clips,
                  (select count(distinct path) from quarantine) as quarantined,
                  (select count(distinct cluster_id) from "references") as clusters"""
    ).to_pylist()[0]
    wrong = [
        f"run {run['run_id']} counted {run[name]} {name}, there are {there}"
        for name, there in counts.items()
        if run[name] != there
    ]
    return Found(f"run {run['run_id']}", wrong)


def count_frames(catalog: Catalog, table: str) -> tuple[dict[str, int], list[str]]:
    """Count every clip's frames, and tell which clips' are not 0, 1, 2, ... in one place.

    Returns
    -------
    dict of str to int
        Rows of each clip.
    list of str
        What is wrong.
    """
    lengths: dict[str, int] = {}
    wrong = []
    for file, rows in parts(catalog, table, ["clip_id", "frame"]):
        names = rows["clip_id"].combine_chunks().dictionary_encode()
        codes, frame = names.indices.to_numpy(), rows["frame"].to_numpy()
        bounds = np.append(np.flatnonzero(np.diff(codes, prepend=-1)), len(codes))
        for start, end in pairwise(bounds.tolist()):
            clip_id = names.dictionary[codes[start]].as_py()
            if clip_id in lengths:
                wrong.append(f"clip {clip_id} stands in two places, the second in {file}")
            elif not np.array_equal(frame[start:end], np.arange(end - start)):
                wrong.append(
                    f"the frames of clip {clip_id} are not numbered 0 to {end - start - 1} in {file}"
                )
            lengths[clip_id] = lengths.get(clip_id, 0) + end - start
    return lengths, wrong
