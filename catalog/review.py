"""What a person should look at first: a list of clips, the likeliest mistakes on top.

The list is ordered by *urgency*, how likely a clip's name is wrong, from 0 to 1. What it lists, and why:

`moved`
    Labels lie under the names of files that are gone, and the clip has their bytes: which is meant? 1.
`contradiction`
    The same motion, or almost, has another label elsewhere: one of the two is wrong. 1.
`mislabelled`
    Supplied was another label than the cluster is called by. With a the distance to the nearest clip of the
    clip's own label, and b to the nearest of the cluster's, a / (a + b): over .5 the cluster's is the nearer,
    and a label that nobody shares is 1. Of the ways that were tried (the cluster's purity, votes of 5 or 10
    neighbours, mean distances, distances to references) this found most mistakes among planted ones.
`uncertain`
    The name came from the cluster, with little confidence. 1 - confidence.
`unassigned`
    It has no name. .5; of nameless clusters the clip furthest from the reference first: a name reaches from
    there to all the others.
`duplicate`
    An earlier clip is the same motion, or almost: nearer than `near` times what is usual between nearest
    neighbours. 0: the name is not in doubt.

A clip that a person has labelled is not asked about again, save where the same bytes have two such labels.

Where the run did not compare all pairs, a and b are computed here. Clips that are almost the same motion are
found among the pairs that there are: all of them where far pairs were left out, else those of landmarks.
"""

from __future__ import annotations

import pyarrow as pa

from motionary.catalog.labelled_neighbours import DOUBTFUL, labelled_neighbours
from motionary.catalog.landmarks import approximation, route_of
from motionary.catalog.query import Catalog
from motionary.pipeline.tables import table_field

REVIEW = pa.schema(
    [
        table_field("clip_id", pa.string(), "the clip in question"),
        table_field("label", pa.string(), "empty: for a person to fill in", nullable=True),
        table_field("reason", pa.string(), "why it is listed: see `motionary.catalog.review`"),
        table_field("urgency", pa.float64(), "how likely its name is wrong, 0 to 1"),
        table_field("current", pa.string(), "what it is called now", nullable=True),
        table_field("suggested", pa.string(), "what it may be instead", nullable=True),
        table_field("cluster_id", pa.int32(), "its cluster"),
        table_field("confidence", pa.float64(), "in its name"),
        table_field("other", pa.string(), "clip that speaks for the suggestion", nullable=True),
        table_field("distance", pa.float64(), "to that clip", "feature", nullable=True),
        table_field("duplicate_of", pa.string(), "earlier clip that is the same motion", nullable=True),
    ]
)

REASONS = {
    "moved": "a file with its bytes had a label and is gone, and it is not clear which is meant",
    "contradiction": "the same motion, or almost, has another label elsewhere",
    "mislabelled": "its label is not that of its cluster",
    "uncertain": "its name came from the cluster, with little confidence",
    "unassigned": "it has no name",
    "duplicate": "an earlier clip is the same motion, or almost",
}
"""What a clip is listed for, in a few words; the first of those of equal urgency is told."""

_SIDES = """select clip_a as clip_id, clip_b as other, {metric}::double as distance from pairs
    union all select clip_b, clip_a, {metric}::double from pairs"""
_COMPUTED = "select unnest($neighbours, recursive := true)"
_NONE = "select null::varchar as clip_id, null::varchar as other, null::double as distance where false"

_USUAL = """
select coalesce(median(nearest), 0) as distance
from (select min(distance) as nearest from ({sides}) where distance > 0 group by clip_id)
"""

_QUERY = """
with own as (
    select clip_id, label, label_source = 'override' as said
    from clusters where label_source in ('override', 'supplied')
), close as materialized (
    select clip_a, clip_b, {metric}::double as distance from pairs where {metric} <= $close
), alike as materialized (
    select clip_a as clip_id, clip_b as other, distance from close
    union all select clip_b, clip_a, distance from close
), twins as materialized (  -- left joins, which are done in this order
    select t.*, a.label as label, b.label as other_label, coalesce(a.said, false) as said,
           coalesce(b.said, false) as other_said, ca.digest = cb.digest as same_bytes
    from alike t left join own a using (clip_id) left join own b on b.clip_id = t.other
    left join clips ca on ca.clip_id = t.clip_id left join clips cb on cb.clip_id = t.other
), doubtful as (
    {doubtful}
), sides as not materialized (
    {sides}
), weighed as (
    select d.clip_id, d.name,
           min(s.distance) filter (o.label = d.label) as to_own,
           min({{'distance': s.distance, 'clip': s.other}}) filter (o.label = d.name) as to_name
    from doubtful d join sides s on s.clip_id = d.clip_id join own o on o.clip_id = s.other
    group by all
), moved as (
    select i.clip_id, 'moved' as reason, 1.0 as urgency, min_by(l.label, l.clip_id) as suggested,
           min(l.clip_id) as other, null::double as distance
    from labels l anti join inputs gone on gone.clip_id = l.clip_id
    join inputs i on i.digest = l.digest and i.digest <> ''
    where i.clip_id not in (select clip_id from labels)
    group by i.clip_id
), contradiction as (
    select clip_id, 'contradiction', 1.0, other_label, other, distance
    from twins where label <> other_label and (not said or (other_said and same_bytes))
), mislabelled as (
    select clip_id, 'mislabelled',
           case when to_own is null then 1 when to_own + to_name.distance = 0 then .5
                else to_own / (to_own + to_name.distance) end,
           name, to_name.clip, to_name.distance
    from weighed
), unnamed as (
    select c.clip_id, case label_source when 'propagated' then 'uncertain' else 'unassigned' end,
           case label_source when 'propagated' then 1 - confidence else .5 end,
           r.label, nullif(r.clip_id, c.clip_id), if(c.is_reference, null, distance_to_reference)
    from clusters c join "references" r using (cluster_id)
    where label_source = 'unassigned' or (label_source = 'propagated' and confidence < $confidence)
), duplicate as (
    select clip_id, 'duplicate', 0.0, min_by(other_label, (distance, other)),
           min_by(other, (distance, other)) as other, min(distance)
    from twins where other < clip_id and not said
    group by clip_id
), furthest as (
    select cluster_id, max(distance_to_reference) as distance from clusters group by cluster_id
), every as (
    from moved union all from contradiction union all from mislabelled union all from unnamed
    union all from duplicate
)
select e.clip_id, null as label, e.reason, e.urgency, c.label as current, e.suggested, c.cluster_id,
       c.confidence, e.other, e.distance, d.other as duplicate_of
from every e left join duplicate d using (clip_id)
join clusters c using (clip_id) join "references" r on r.cluster_id = c.cluster_id
join furthest f on f.cluster_id = c.cluster_id
qualify row_number() over (
    partition by e.clip_id order by e.urgency desc, list_position($reasons, e.reason), e.distance, e.other
) = 1
order by e.urgency desc, list_position($reasons, e.reason),
         if(e.reason = 'unassigned', r.label is null and c.distance_to_reference = f.distance, null) desc,
         if(e.reason = 'unassigned', r.size, null) desc,
         e.distance, e.clip_id
"""


def review(catalog: Catalog, confidence: float = 0.8, near: float = 0.07) -> pa.Table:
    """List the clips whose names a person should look at, most urgent first.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.
    confidence : float
        A name that the cluster gave is uncertain under this; .8 is that of four labelled clips that agree.
    near : float
        Clips nearer than this times the median distance of nearest neighbours are the same motion. By our
        trial .07: copies without a frame, or written with two decimals, lie nearer (0 to .06), other takes of
        HDM05 and Bandai no nearer than .09.

    Returns
    -------
    pyarrow.Table
        `REVIEW`, a row a clip, with the most urgent reason; none where there is nothing to ask.

    Raises
    ------
    CatalogError
        The catalog was published by a motionary that did not keep labels yet.
    """
    for table in ("labels", "inputs"):
        catalog.files(table)
    metric = catalog.settings["clusters"]["metric"]
    stored = _SIDES.format(metric=metric)
    usual = catalog.sql(_USUAL.format(sides=stored))["distance"][0].as_py()
    asked = {"confidence": confidence, "close": near * usual, "reasons": list(REASONS)}
    sides = stored
    if route_of(catalog) != "all":
        neighbours = labelled_neighbours(catalog, metric)
        sides = _COMPUTED if neighbours else _NONE
        asked |= {"neighbours": neighbours} if neighbours else {}
    return catalog.sql(_QUERY.format(metric=metric, doubtful=DOUBTFUL, sides=sides), asked).cast(REVIEW)


def left_open(catalog: Catalog) -> str | None:
    """Say of what the list knows less than of the rest; None where it knows all."""
    found = approximation(catalog)
    if found is None:
        return None
    return (
        f"Contradictions and duplicates are looked for among the {len(found.landmarks):,} landmarks alone, "
        "whose pairs the run compared"
    )
