"""Alignments: every clip in the time of its cluster's reference, and what sets it apart from that."""

from __future__ import annotations

from motionary.catalog.checks.clips import count_frames
from motionary.catalog.checks.found import Found, not_finite, wrong_rows
from motionary.catalog.query import Catalog


def clips_are_aligned(catalog: Catalog) -> Found:
    """Every clip has one alignment to the reference of its cluster, in time that never runs backwards.

    With closed ends the stretches of the segments add up to nothing.
    """
    queries = [
        *_one_a_clip("alignments"),
        """select concat_ws(' ', 'clip', a.clip_id, 'has', len(source_time), 'times, its reference', frames,
                            'frames')
           from alignments a join "references" using (cluster_id) where len(source_time) <> frames""",
        """select 'the time of clip ' || clip_id || ' runs backwards' from alignments
           where source_time is distinct from list_sort(source_time)""",
        """select 'clip ' || clip_id || ' has ' || len(eta) || ' stretches between ' || len(nodes) || ' nodes'
           from alignments where len(eta) <> len(nodes) - 1""",
    ]
    if not catalog.settings["alignment"]["open_ends"]:
        queries.append(
            "select 'clip ' || clip_id || ' is stretched by ' || list_sum(eta) || ' frames in all' "
            "from alignments where list_sum(eta) <> 0 or first_frame <> 0"
        )
    return Found(f"{len(catalog.alignments)} clips", wrong_rows(catalog, *queries))


def aligned_frames_are_the_references(catalog: Catalog) -> Found:
    """Every aligned clip has its reference's frames, numbered from 0; all values are finite."""
    lengths, wrong = count_frames(catalog, "aligned")
    rows = catalog.sql('select c.clip_id, frames from clusters c left join "references" r using (cluster_id)')
    expected = dict(zip(*(column.to_pylist() for column in rows.columns), strict=True))
    for clip_id in sorted(lengths.keys() | expected.keys()):
        there, wanted = lengths.get(clip_id, 0), expected.get(clip_id)
        if there != wanted:
            wrong.append(f"{clip_id} has {there} aligned frames, its reference {wanted or 'none'}")
    wrong += not_finite(catalog, "aligned")
    return Found(f"{sum(lengths.values())} frames of {len(lengths)} clips", wrong)


def clips_have_a_style(catalog: Catalog) -> Found:
    """Every clip has one row of `styles`, its residual against the reference of its cluster."""
    wrong = wrong_rows(
        catalog,
        *_one_a_clip("styles"),
        "select 'the energy of clip ' || clip_id || ' is ' || energy from styles "
        "where not (isfinite(energy) and energy >= 0)",
    )
    return Found(f"{len(catalog.styles)} clips", wrong)


def _one_a_clip(table: str) -> list[str]:
    """Ask for clips without a row or with several, and for rows of another cluster or reference."""
    return [
        f"select 'clip ' || clip_id || ' has ' || count(*) || ' rows' from {table} group by clip_id "
        "having count(*) > 1",
        f"select 'clip ' || clip_id || ' has no row' from clusters "
        f"where clip_id not in (select clip_id from {table})",
        f"select clip_id || ' has a row and is no clip' from {table} "
        "where clip_id not in (select clip_id from clusters)",
        f"""select concat_ws(' ', 'clip', t.clip_id, 'has cluster', t.cluster_id, 'and reference',
                             t.reference_id, 'but is in cluster', c.cluster_id, 'of', r.clip_id)
            from {table} t join clusters c using (clip_id)
            left join "references" r on r.cluster_id = c.cluster_id
            where t.cluster_id <> c.cluster_id or t.reference_id is distinct from r.clip_id""",
    ]
