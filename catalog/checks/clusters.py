"""Published clusters: their members, references and names."""

from __future__ import annotations

from motionary.catalog.checks.found import Found, has, wrong_rows
from motionary.catalog.query import Catalog
from motionary.catalog.sql import quoted


def clusters_hold_every_clip(catalog: Catalog) -> Found:
    """Every clip is in one published cluster."""
    wrong = wrong_rows(
        catalog,
        "select 'clip ' || clip_id || ' is in ' || count(*) || ' clusters' from clusters group by clip_id "
        "having count(*) > 1",
        "select 'clip ' || clip_id || ' is in no cluster' from clips "
        "where clip_id not in (select clip_id from clusters)",
        "select clip_id || ' is in a cluster and is no clip' from clusters "
        "where clip_id not in (select clip_id from clips)",
    )
    return Found(f"{len(catalog.clusters)} clips", wrong)


def clusters_have_a_reference(catalog: Catalog) -> Found:
    """Every cluster has one reference, a member, and `references` says the same of it."""
    wrong = wrong_rows(
        catalog,
        """select concat_ws(' ', 'cluster', cluster_id, 'has', count(*) filter (is_reference), 'references')
           from clusters group by cluster_id having count(*) filter (is_reference) <> 1""",
        """select concat_ws(' ', 'cluster', cluster_id, 'has', count(*), 'rows of references')
           from "references" group by cluster_id having count(*) > 1""",
        """select concat_ws(' ', 'cluster', coalesce(c.cluster_id, r.cluster_id), 'of', coalesce(size, 0),
                            'clips by references and', coalesce(members, 0), 'by clusters')
           from (select cluster_id, count(*) as members from clusters group by cluster_id) c
           full join "references" r using (cluster_id)
           where coalesce(size, 0) <> coalesce(members, 0)""",
        """select concat_ws(' ', 'cluster', r.cluster_id, 'has the reference', r.clip_id,
                            'by references, and', c.clip_id, 'by clusters')
           from "references" r join clusters c on c.cluster_id = r.cluster_id and c.is_reference
           where c.clip_id <> r.clip_id""",
        """select concat_ws(' ', 'reference', clip_id, 'lies', distance_to_reference, 'from itself')
           from clusters where is_reference and distance_to_reference <> 0""",
        """select 'reference ' || r.clip_id || ' was made from other bytes than its clip'
           from "references" r join clips using (clip_id) where r.digest <> clips.digest""",
    )
    return Found(f"{len(catalog.references)} clusters", wrong)


def distances_to_references_are_the_pairs(catalog: Catalog) -> Found:
    """Every clip lies as far from its cluster's reference as the two do as a pair.

    Pairs that are missing, and distances that are none, have checks of their own.
    """
    metric = catalog.settings["clusters"]["metric"]
    known = f"""from clusters c join "references" r using (cluster_id)
                join pairs p on p.clip_a = least(c.clip_id, r.clip_id)
                            and p.clip_b = greatest(c.clip_id, r.clip_id)
                where not c.is_reference and isfinite(p.{metric})"""
    wrong = wrong_rows(
        catalog,
        f"""select concat_ws(' ', 'clip', c.clip_id, 'lies', distance_to_reference, 'from its reference',
                             r.clip_id, 'and', p.{metric}, 'as a pair')
            {known} and cast(distance_to_reference as float) <> p.{metric}""",
    )
    compared = catalog.sql(f"select count(*) as clips {known}")["clips"][0].as_py()
    return Found(f"{compared} clips and their references, by {metric}", wrong)


def labels_are_consistent(catalog: Catalog) -> Found:
    """Names come from a person, else from what was supplied, else from the cluster, and say from which."""
    supplied = f"nullif({_supplied(catalog)}, '')"
    said = "o.label" if has(catalog, "labels") else "cast(null as varchar)"
    join = "left join labels o using (clip_id)" if has(catalog, "labels") else ""
    source = f"""select c.*, {supplied} as supplied, {said} as override, r.label as name
                 from clusters c left join clips using (clip_id) {join}
                 left join "references" r on r.cluster_id = c.cluster_id"""
    rules = {
        "label_source not in ('override', 'supplied', 'propagated', 'unassigned')": "of an unknown source",
        "override is not null and label_source <> 'override'": "while a person said otherwise",
        "label_source = 'override' and label is distinct from override": "which no person said",
        "override is null and supplied is not null and label_source <> 'supplied'": "while one was supplied",
        "label_source = 'supplied' and label is distinct from supplied": "which was not supplied",
        "label_source = 'propagated' and (label is null or label is distinct from name)":
            "which its cluster is not called",
        "label_source = 'unassigned' and label is not null": "though it is unassigned",
        "not coalesce(case label_source when 'unassigned' then confidence = 0 when 'propagated' "
        "then confidence > 0 and confidence < 1 else confidence = 1 end, false)":
            "with a confidence that does not go with it",
    }  # fmt: skip
    queries = [
        f"""select concat_ws(' ', 'clip', clip_id, 'is called', coalesce(label, 'nothing'),
                             '(' || label_source || ',', confidence || ')', '{problem}')
            from ({source}) where {rule}"""
        for rule, problem in rules.items()
    ]
    if has(catalog, "labels"):
        queries.append(
            "select 'clip ' || clip_id || ' has ' || count(*) || ' names by persons' from labels "
            "group by clip_id having count(*) > 1"
        )
    counts = catalog.sql("select label_source, count(*) as clips from clusters group by all order by all")
    seen = ", ".join(f"{row['clips']} {row['label_source']}" for row in counts.to_pylist())
    return Found(seen or "no clips", wrong_rows(catalog, *queries))


def _supplied(catalog: Catalog) -> str:
    """Name the column of supplied labels in SQL, or nothing where none of that name were supplied."""
    column = catalog.settings["clusters"]["label_column"]
    known = catalog.sql("from clips limit 0").column_names
    return f"clips.{quoted(column)}" if column in known else "cast(null as varchar)"
