"""Settings from a file, the environment and options, and labels from a CSV."""

import pytest

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.readers.library import Source
from motionary.workflows.labels_file import LabelsError, supplied_labels
from motionary.workflows.settings import PAPER, SettingsError, load_settings


def test_defaults_are_the_stages_own():
    assert load_settings(None, {}) == PipelineConfig()


def test_later_sources_win(tmp_path, monkeypatch):
    file = tmp_path / "motionary.toml"
    file.write_text("[features]\nepsilon = 0.2\ntravel_time = 0.3\ncriterion = 'mean'\n")
    monkeypatch.setenv("MOTIONARY_FEATURES__TRAVEL_TIME", "0.4")
    monkeypatch.setenv("MOTIONARY_FEATURES__CRITERION", "sum")
    features = load_settings(file, {"features": {"criterion": "mean"}}).features
    assert (features.epsilon, features.travel_time, features.criterion) == (0.2, 0.4, "mean")


def test_the_papers_settings():
    config = load_settings(None, PAPER)
    assert (config.features.kind, config.clusters.primary, config.clusters.cut) == (
        "paper",
        "complete",
        "strip",
    )


def test_a_users_convention(tmp_path):
    file = tmp_path / "motionary.toml"
    joints = "\n".join(f'{joint} = "bone_{n}"' for n, joint in enumerate(CANONICAL_JOINTS))
    file.write_text(f"[conventions.robot]\n{joints}\n")
    (convention,) = load_settings(file, {}).features.conventions
    assert (convention.name, convention.joints["left_toe"]) == ("robot", "bone_14")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[features]\nepsilom = 1\n", "there is no setting features.epsilom"),
        ("[features]\nepsilon = -1\n", "epsilon is -1.0; it must be at least 0"),
        ("[features]\nkind = 'pose'\n", "features.kind"),
        ("[colours]\nred = 1\n", "colours"),
        ("[alignment]\nsegment_length = 20\nslack = 17\n", "at most segment_length - 4 = 16"),
        ("[conventions.robot]\npelvis = 'hip'\n", "'robot'.*missing"),
        ("[features\n", "motionary.toml"),
    ],
)
def test_a_wrong_setting_is_named(tmp_path, text, message):
    file = tmp_path / "motionary.toml"
    file.write_text(text)
    with pytest.raises(SettingsError, match=message):
        load_settings(file, {})


@pytest.fixture
def library(tmp_path) -> list[Source]:
    (tmp_path / "takes" / "sub").mkdir(parents=True)
    names = ["a.bvh", "sub/b.bvh"]
    return [Source(n, n, str(tmp_path / "takes"), (str(tmp_path / "takes" / n),), n, "bvh") for n in names]


def labels(tmp_path, text: str, library: list[Source]):
    file = tmp_path / "labels.csv"
    file.write_text(text, encoding="utf-8-sig")
    return supplied_labels(file, None, library, "action")


def test_labels_by_path_or_clip_id(tmp_path, library):
    made = labels(
        tmp_path,
        "clip_id,path,action,mood\nb.bvh,takes/a.bvh,walk,NA\nsub/b.bvh,,run,\nx,gone.bvh,fly,\ny,,fly,\n",
        library,
    )
    assert made.table.to_pylist() == [
        {"clip_id": "a.bvh", "action": "walk", "mood": "NA"},
        {"clip_id": "sub/b.bvh", "action": "run", "mood": None},
    ]
    assert made.outside == ["gone.bvh", "y"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("action\nwalk\n", "no column path or clip_id"),
        (
            "path,style\ntakes/a.bvh,sad\n",
            "no column 'action'; name one of its columns with --label-column: style",
        ),
        ("path,action\ntakes/a.bvh,x\ntakes/./a.bvh,y\n", "labels clip 'a.bvh' more than once, in rows 2, 3"),
        ("", "cannot be read as CSV"),
        ("path;action\ntakes/a.bvh;x\n", "separated by semicolons"),
        ("clip_id,action\na,x\n", "none of its 1 rows names a clip.*'a'.* is like 'a.bvh'"),
        ('path,action\n"takes/a.bvh,x\n', "cannot be read as CSV"),
    ],
)
def test_a_wrong_labels_file_is_explained(tmp_path, library, text, message):
    with pytest.raises(LabelsError, match=message):
        labels(tmp_path, text, library)
