"""The tables that the stages make: columns, types and units.

`ingested`, `groups`, `members`, `represented`, `centres` and `reference_features` pass from stage to stage,
and by landmarks `sampled`, `standing`, `assigned`, `refined` and `regrouped`; the others are a catalog's.

A column's unit and meaning stand in its field metadata (`unit`, `meaning`), so that they travel with the
table wherever it is kept.
"""

from __future__ import annotations

import pyarrow as pa

from motionary.pipeline.style.rig import REGIONS

LABEL_COLUMNS = ("action", "style", "subject", "take", "description", "licence")
"""Label columns that `clips` always has; a labels file may bring more."""


def table_field(
    name: str, type_: pa.DataType, meaning: str, unit: str = "", nullable: bool = False
) -> pa.Field:
    """Describe a column, with its meaning and unit."""
    metadata = {"meaning": meaning} | ({"unit": unit} if unit else {})
    return pa.field(name, type_, nullable=nullable, metadata=metadata)


_CLIP = table_field("clip_id", pa.string(), "path of the clip in the library, with /")
_CLUSTER = table_field("cluster_id", pa.int32(), "number that the cluster keeps from run to run")
_GROUP = table_field("group", pa.int32(), "from 0, by falling size")
_COMPARED = table_field("compared", pa.int64(), "pairs that were compared for it, each counted once")
_FLOATS = pa.list_(pa.float32())

_SKELETON = pa.struct(
    [
        pa.field("joints", pa.list_(pa.string())),
        pa.field("parents", pa.list_(pa.int32())),
        pa.field("offsets", pa.list_(pa.float64())),
    ]
)

_INGESTED = [
    _CLIP,
    table_field("path", pa.string(), "path in the library folder"),
    table_field("digest", pa.string(), "BLAKE2b of the bytes of every file the clip is read from"),
    table_field("format", pa.string(), "bvh, asf/amc, amass or c3d"),
    table_field("fps", pa.float64(), "frame rate of the source", "1/s"),
    table_field("frames", pa.int32(), "frames kept of the source"),
    table_field("seconds", pa.float64(), "from the first frame to the last", "s"),
    table_field("convention", pa.string(), "joint-name convention that fits the skeleton"),
    table_field("leg_length", pa.float64(), "thigh and shank, the unit of the features", "source units"),
    table_field("unit", pa.float64(), "metres in one source unit, if known", "m", nullable=True),
    table_field("skeleton", _SKELETON, "joint names, parents, offsets (J x 3)", "source units"),
    table_field("notes", pa.list_(pa.string()), "what the reader changed or assumed"),
]

_RESAMPLED = [
    _CLIP,
    table_field("frame", pa.int32(), "merged frame, from 0"),
    table_field("first_frame", pa.int32(), "first frame it stands for, at the common rate"),
    table_field("last_frame", pa.int32(), "last frame it stands for, at the common rate"),
    table_field("feature", _FLOATS, "the vector that distances compare"),
]

_POSE = [
    table_field("root_position", pa.list_(pa.float32(), 3), "root joint in the world", "source units"),
    table_field(
        "rotations",
        _FLOATS,
        "local unit quaternions x y z w, joint by joint; of markers the joints' places from the root, x y z",
    ),
]

_REFERENCE = [
    table_field("clip_id", pa.string(), "the clip that represents the cluster"),
    table_field("digest", pa.string(), "of that clip's bytes"),
    table_field("size", pa.int32(), "clips in the cluster"),
    table_field("frames", pa.int32(), "frames of the reference at the common rate"),
    table_field("similarity_index", pa.float64(), "ln of [CoTW eq. 9]; null where it is 0", nullable=True),
]

TABLES: dict[str, pa.Schema] = {
    "ingested": pa.schema(_INGESTED),
    "clips": pa.schema(
        [
            *_INGESTED,
            *(table_field(name, pa.string(), "supplied label", nullable=True) for name in LABEL_COLUMNS),
        ]
    ),
    "frames": pa.schema(
        [
            _CLIP,
            table_field("frame", pa.int32(), "frame of the source, from 0"),
            *_POSE,
        ]
    ),
    "features": pa.schema(
        [
            _CLIP,
            table_field("frame", pa.int32(), "frame at the common rate, from 0"),
            table_field("root_x", pa.float32(), "root on the ground plane", "leg lengths"),
            table_field("root_z", pa.float32(), "root on the ground plane", "leg lengths"),
            table_field("root_height", pa.float32(), "root over the clip's floor", "leg lengths"),
            table_field("heading", pa.float32(), "where the figure faces, from +Z towards +X", "rad"),
            table_field("feature", _FLOATS, "pose (57) and travel (2), before merging"),
        ]
    ),
    "resampled": pa.schema(_RESAMPLED),
    "sampled": pa.schema(_RESAMPLED),
    "pairs": pa.schema(
        [
            table_field("clip_a", pa.string(), "the earlier clip_id of the pair"),
            table_field("clip_b", pa.string(), "the later clip_id of the pair"),
            table_field("dtw", pa.float32(), "average cost along the best warping path", "feature"),
            table_field(
                "b_dtw", pa.float32(), "DTW, forwards or reversed, the smaller [DC eq. 1]", "feature"
            ),
            table_field("curve", pa.list_(pa.float32(), 8), "S-DTW at the eight thresholds", "feature"),
            table_field("weighted", pa.float32(), "weighted distance [DC eq. 7-8]", "feature"),
            table_field("fuzzy_low", pa.float32(), "least of the curve [DC eq. 10]", "feature"),
            table_field("fuzzy_high", pa.float32(), "greatest of the curve [DC eq. 10]", "feature"),
        ]
    ),
    "linkage": pa.schema(
        [
            table_field("method", pa.string(), "complete, ward, average or fuzzy"),
            table_field("metric", pa.string(), "dtw, b_dtw, weighted or fuzzy"),
            table_field("step", pa.int32(), "merge, from 0; makes cluster N + step"),
            table_field("left", pa.int32(), "merged cluster; below N a clip, by its place in clip_id order"),
            table_field("right", pa.int32(), "merged cluster"),
            table_field("height", pa.float64(), "merge key"),
            table_field("size", pa.int32(), "clips in the new cluster"),
        ]
    ),
    "partitions": pa.schema(
        [
            table_field("method", pa.string(), "linkage"),
            table_field("metric", pa.string(), "distance"),
            _CLIP,
            table_field("cluster", pa.int32(), "from 0, by falling size; the automatic cut, labels hidden"),
        ]
    ),
    "cuts": pa.schema(
        [
            table_field("method", pa.string(), "linkage"),
            table_field("metric", pa.string(), "distance"),
            table_field("primary", pa.bool_(), "whether the published clusters come from this dendrogram"),
            table_field("rule", pa.string(), "how the cut was found, labels hidden"),
            table_field("n_clusters", pa.int32(), "kappa of that cut"),
            table_field("threshold", pa.float64(), "mu of that cut", "merge key", nullable=True),
            table_field("published_rule", pa.string(), "how the published cut was found", nullable=True),
            table_field("published_clusters", pa.int32(), "kappa of the published cut", nullable=True),
            table_field("published_threshold", pa.float64(), "mu of it", "merge key", nullable=True),
            table_field("strip_clusters", pa.int32(), "kappa of the widest threshold strip", nullable=True),
            table_field("strip_low", pa.float64(), "where that strip begins", "merge key", nullable=True),
            table_field("strip_high", pa.float64(), "where it ends", "merge key", nullable=True),
            table_field("reward_punish", pa.int64(), "of that cut [DC eq. 12]", nullable=True),
            table_field("reward_punish_best", pa.int64(), "the best possible", nullable=True),
            table_field("ari", pa.float64(), "adjusted Rand index of that cut", nullable=True),
            table_field("classes", pa.int32(), "different supplied labels", nullable=True),
            table_field("reward_punish_true", pa.int64(), "cut at that many clusters", nullable=True),
            table_field("ari_true", pa.float64(), "cut at that many clusters", nullable=True),
        ]
    ),
    "groups": pa.schema([_CLIP, _GROUP]),
    "standing": pa.schema(
        [
            _GROUP,
            table_field("clip_id", pa.string(), "a landmark that stands for the group"),
            table_field("feature", _FLOATS, "its merged frames, one after the other"),
        ]
    ),
    "assigned": pa.schema([_CLIP, _GROUP, _COMPARED]),
    "refined": pa.schema([_CLIP, table_field("first", pa.string(), "first clip of its part"), _COMPARED]),
    "regrouped": pa.schema(
        [
            _CLIP,
            _GROUP,
            table_field("landmark", pa.bool_(), "whether it is compared with every other landmark"),
            _COMPARED,
        ]
    ),
    "members": pa.schema([_CLIP, _CLUSTER]),
    "lineage": pa.schema(
        [
            table_field("after", pa.string(), "snapshot that the clusters were compared with"),
            table_field(
                "event",
                pa.string(),
                "kept, moved (clips, between clusters that both stay), split, merged, new, gone",
            ),
            table_field("cluster_id", pa.int32(), "cluster that has the clips now", nullable=True),
            table_field("previous_id", pa.int32(), "cluster that had them", nullable=True),
            table_field("clips", pa.int32(), "how many"),
        ]
    ),
    "represented": pa.schema(
        [
            _CLIP,
            _CLUSTER,
            table_field("is_reference", pa.bool_(), "whether the cluster is aligned to this clip"),
            table_field("distance_to_reference", pa.float64(), "the primary distance", "feature"),
        ]
    ),
    "centres": pa.schema(
        [
            _CLUSTER,
            *_REFERENCE,
        ]
    ),
    "clusters": pa.schema(
        [
            _CLIP,
            _CLUSTER,
            table_field("label", pa.string(), "name", nullable=True),
            table_field("label_source", pa.string(), "override, supplied, propagated or unassigned"),
            table_field(
                "confidence", pa.float64(), "1 for an own label, n / (labelled + 1) for a propagated one"
            ),
            table_field("is_reference", pa.bool_(), "whether the cluster is aligned to this clip"),
            table_field("distance_to_reference", pa.float64(), "the primary distance", "feature"),
        ]
    ),
    "references": pa.schema(
        [
            _CLUSTER,
            _REFERENCE[0],
            table_field("label", pa.string(), "the cluster's name", nullable=True),
            *_REFERENCE[1:],
        ]
    ),
    "reference_features": pa.schema(
        [
            table_field("cluster_id", pa.int32(), "cluster"),
            _CLIP,
            table_field("feature", _FLOATS, "pose and travel of the cluster's reference, frame by frame"),
        ]
    ),
    "alignments": pa.schema(
        [
            _CLIP,
            table_field("cluster_id", pa.int32(), "cluster"),
            table_field("reference_id", pa.string(), "clip it is aligned to"),
            table_field("frame_rate", pa.float64(), "the common rate", "1/s"),
            table_field("segment_length", pa.int32(), "L of CoTW", "frames at the common rate"),
            table_field("slack", pa.int32(), "delta of CoTW", "frames at the common rate"),
            table_field("objective", pa.float64(), "sum over segments and columns [CoTW eq. 5]"),
            table_field(
                "correlation_before",
                pa.float64(),
                "correlation with the reference, weighted mean over 57 columns, still ones 0; length-matched",
            ),
            table_field("correlation", pa.float64(), "the same, aligned: rho of [CoTW eq. 8]"),
            table_field("distortion", pa.float64(), "|h| of [CoTW eq. 7-8]"),
            table_field(
                "nodes",
                pa.list_(pa.int32()),
                "ends of the segments, length-matched",
                "frames of the reference",
            ),
            table_field(
                "first_frame",
                pa.int32(),
                "where the first node came to lie; below 0 with open ends",
                "frames",
            ),
            table_field("eta", pa.list_(pa.int32()), "stretch of each segment", "frames at the common rate"),
            table_field(
                "source_time",
                pa.list_(pa.float64()),
                "for each reference frame the clip's time shown at it",
                "frames at the common rate",
            ),
        ]
    ),
    "aligned": pa.schema(
        [
            _CLIP,
            table_field("frame", pa.int32(), "frame of the reference at the common rate"),
            *_POSE,
        ]
    ),
    "styles": pa.schema(
        [
            _CLIP,
            table_field("cluster_id", pa.int32(), "cluster"),
            table_field("reference_id", pa.string(), "clip that was subtracted"),
            table_field("kind", pa.string(), "rotations (rad), or pose (leg lengths) where rigs differ"),
            table_field("energy", pa.float64(), "sum of the joints' energies", "rad^2 or leg lengths^2"),
            *(
                table_field(f"energy_{region}", pa.float64(), "sum over the region's joints", "as energy")
                for region in REGIONS
            ),
            table_field("joints", pa.list_(pa.string()), "joints of the residual"),
            table_field("joint_energy", _FLOATS, "mean square of each joint's residual", "as energy"),
            table_field(
                "travel_energy",
                _FLOATS,
                "mean square of the root's left, forward, turning and height",
                "(leg lengths/s)^2 twice, (rad/s)^2, leg lengths^2",
            ),
            table_field("scores", _FLOATS, "where the clip lies in its cluster's style space (PCA)"),
            table_field("explained", _FLOATS, "share of the cluster's variance along each axis"),
        ]
    ),
    "labels": pa.schema(
        [
            _CLIP,
            table_field("digest", pa.string(), "of the clip's bytes when a run last saw it"),
            table_field("label", pa.string(), "what a person calls it"),
            table_field("set_at", pa.timestamp("us", tz="UTC"), "when"),
            table_field("set_by", pa.string(), "who"),
        ]
    ),
    "quarantine": pa.schema(
        [
            table_field("path", pa.string(), "clip_id the file would have had"),
            table_field("line", pa.int64(), "line of the file, from 1", nullable=True),
            table_field("reason", pa.string(), "what is wrong"),
            table_field("mend", pa.string(), "what to do about it"),
            table_field("digest", pa.string(), "of its bytes; empty where they cannot be read"),
            table_field(
                "retry", pa.bool_(), "whether the next run reads it again though its bytes are the same"
            ),
        ]
    ),
}
