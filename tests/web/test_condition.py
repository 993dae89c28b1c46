"""Conditions that anybody may ask: comparisons pass, and what takes long or reads elsewhere does not."""

import pytest

from motionary.catalog.errors import CatalogError
from motionary.catalog.web.condition import refuse_more_than_a_comparison


@pytest.mark.parametrize(
    "condition",
    [
        "label = 'walk' and seconds > 3",
        "clip_id like '%run%' or not (label is null)",
        "cluster_id in (1, 2) and seconds between 1 and 2.5",
        "lower(label) = 'x' and clip_id ~ 'w.*k' and clip_id not ilike '%a'",
        "fps::int = 30 and -seconds * 2 + 1 < 3",
        "case when label is null then false else length(label) > 3 end",
        "len(notes) > 0 -- a remark",
        "coalesce(style, '') = ''",
    ],
)
def test_comparisons_pass(condition):
    refuse_more_than_a_comparison(condition)


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("(select count(*) from range(1000000000000) t(i) where i % 7 = 3) > 1", "subquery"),
        ("exists (with recursive t as (select 1 union all select 1 from t) select * from t)", "subquery"),
        ("len(range(4000000000)) > 0", "function range"),
        ("md5(repeat('a', 4000000000)) = 'x'", "function"),
        ("lpad('a', 2000000000, 'b') = 'x'", "function lpad"),
        ("read_text('CURRENT') is null", "function read_text"),
        ("sum(seconds) over () > 1", "window"),
        ("label = $1", "parameter"),
        ("[one for one in [1, 2]] = [1]", "function"),
        ("true; select 1", "semicolon"),
        ("true union select 2", "as it stands after"),
        ("true limit 3", "as it stands after"),
        ("true group by label", "as it stands after"),
        ("true qualify true", "as it stands after"),
        ("true)) or ((true", "no condition"),
        ("", "no condition"),
        ("(" * 10_000, "1,000"),
        ("(" * 400 + "true" + ")" * 400, "parentheses"),
        ("[" * 400 + "]" * 400, "parentheses"),
    ],
)
def test_everything_else_is_refused(condition, told):
    with pytest.raises(CatalogError, match=told):
        refuse_more_than_a_comparison(condition)
