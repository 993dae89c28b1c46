"""The deployment files: each passes its own linter, and starts the nightly job as it can be started.

A linter that is not installed is skipped by name; `pip install ".[lint]"` brings all but systemd's.
"""

import configparser
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typer
import yaml
from distributed.cli.dask_worker import main as dask_worker

from motionary.workflows.cli import app
from motionary.workflows.nightly_settings import load_nightly

ROOT = Path(__file__).resolve().parents[1]
DEPLOY = ROOT / "workflows" / "deploy"
PROGRAM, HOME, CONFIG = "/opt/motionary/bin/motionary", "/srv/motionary", "/srv/motionary/nightly.toml"


def linted(tool: str, *arguments: object) -> str:
    """Run a linter of this environment or of the machine; it must find nothing."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    program = shutil.which(tool, path=path)
    if program is None:
        pytest.skip(f"{tool} is not installed")
    ended = subprocess.run(
        [program, *map(str, arguments)], capture_output=True, text=True, check=False, cwd=DEPLOY
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stderr


def service() -> dict[str, str]:
    text = configparser.ConfigParser(strict=False, interpolation=None)
    text.optionxform = str  # type: ignore[assignment]
    text.read(DEPLOY / "motionary-nightly.service")
    return dict(text["Service"])


def cron_line() -> list[str]:
    (line,) = re.findall(r"^[\d*].*", (DEPLOY / "motionary-nightly.cron").read_text(), flags=re.MULTILINE)
    return line.split(maxsplit=6)


def kubernetes(kind: str) -> dict[str, Any]:
    return next(
        one for one in yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text()) if one["kind"] == kind
    )


def pod() -> dict[str, Any]:
    return kubernetes("CronJob")["spec"]["jobTemplate"]["spec"]["template"]["spec"]


def workflow() -> dict[str, Any]:
    return yaml.safe_load((DEPLOY / "github-actions.yml").read_text())


def started() -> dict[str, list[str]]:
    """What each file starts."""
    dockerfile = (DEPLOY / "Dockerfile").read_text()
    assert 'ENTRYPOINT ["motionary"]' in dockerfile
    script, (step, *_) = (DEPLOY / "nightly.sbatch").read_text(), workflow()["jobs"]["nightly"]["steps"]
    return {
        "systemd": shlex.split(service()["ExecStart"]),
        "cron": shlex.split(cron_line()[-1].replace(">/dev/null", "")),
        "kubernetes": [PROGRAM, *pod()["containers"][0]["args"]],
        "slurm": shlex.split(re.findall(r"^exec (.*)$", script, flags=re.MULTILINE)[-1]),
        "github": shlex.split(re.findall(r"^(.*) \|\| code=\$\?$", step["run"], flags=re.MULTILINE)[0]),
    }


@pytest.mark.parametrize("where", ["systemd", "cron", "kubernetes", "slurm", "github"])
def test_it_starts_the_nightly_job_by_arguments_that_exist(where):
    program, *arguments = started()[where]
    assert program == PROGRAM
    command = typer.main.get_command(app).commands[arguments[0]]  # type: ignore[attr-defined]
    assert command.name == "nightly"
    assert str(command.make_context("nightly", arguments[1:]).params["config"]) == CONFIG


def test_they_all_start_at_the_same_time():
    timer = (DEPLOY / "motionary-nightly.timer").read_text()
    assert "OnCalendar=*-*-* 02:30:00" in timer
    ((_, events),) = [(name, one) for name, one in workflow().items() if name in (True, "on")]  # YAML's yes
    (trigger,) = events["schedule"]
    assert {
        kubernetes("CronJob")["spec"]["schedule"], " ".join(cron_line()[:5]), trigger["cron"]
    } == {"30 2 * * *"}  # fmt: skip


def test_they_never_run_two_at_a_time_and_give_time_to_end():
    assert kubernetes("CronJob")["spec"]["concurrencyPolicy"] == "Forbid"
    assert pod()["terminationGracePeriodSeconds"] >= 60
    assert workflow()["concurrency"]["cancel-in-progress"] is False
    script = (DEPLOY / "nightly.sbatch").read_text()
    assert "#SBATCH --dependency=singleton" in script
    assert "#SBATCH --signal=B:TERM@120" in script
    assert service()["KillMode"] == "mixed"


def test_the_paths_agree(tmp_path):
    writable = service()["ReadWritePaths"]
    assert writable == HOME
    mounts = {one["name"]: one for one in pod()["containers"][0]["volumeMounts"]}
    assert mounts["motionary"]["mountPath"] == HOME
    assert mounts["library"]["mountPath"] == service()["ReadOnlyPaths"] == f"{HOME}/library"
    assert mounts["configuration"]["mountPath"] == CONFIG
    assert mounts["configuration"]["subPath"] in kubernetes("ConfigMap")["data"]
    assert {one["name"] for one in pod()["volumes"]} == mounts.keys()
    (_, keep) = workflow()["jobs"]["nightly"]["steps"]
    assert keep["with"]["path"] == f"{HOME}/reports/*.json"
    assert f"WORKDIR {HOME}\n" in (DEPLOY / "Dockerfile").read_text()

    for text in (kubernetes("ConfigMap")["data"]["nightly.toml"], example()):
        (tmp_path / "nightly.toml").write_text(text)
        settings = load_nightly(tmp_path / "nightly.toml")
        assert settings.job.libraries == [str(tmp_path / "library")]
        assert settings.job.catalog == str(tmp_path / "catalog")
        assert settings.reports == tmp_path / "reports"


def example() -> str:
    return (ROOT / "workflows" / "nightly.toml").read_text()


def test_the_variables_that_are_set_are_settings(tmp_path, monkeypatch):
    texts = [file.read_text() for file in DEPLOY.iterdir() if file.suffix != ".md"]
    found = {name for text in texts for name in re.findall(r"\bMOTIONARY_[A-Z_]+", text)}
    values = {"MOTIONARY_JOB__WORKERS": "3", "MOTIONARY_LOG__FILE": "/srv/motionary/nightly.jsonl"}
    assert found == values.keys()
    for name, value in values.items():
        monkeypatch.setenv(name, value)
    (tmp_path / "nightly.toml").write_text(example())
    settings = load_nightly(tmp_path / "nightly.toml")
    assert (settings.job.workers, settings.log) == (3, Path("/srv/motionary/nightly.jsonl"))


def test_quarantined_clips_are_no_failure_where_that_can_be_said():
    assert service()["SuccessExitStatus"] == "3"
    (step, _) = workflow()["jobs"]["nightly"]["steps"]
    for code, expected in ((0, 0), (3, 0), (1, 1), (2, 2)):
        run = step["run"].replace(shlex.join(started()["github"]), f"(exit {code})")
        assert (
            subprocess.run(["bash", "-e", "-c", run], capture_output=True, check=False).returncode == expected
        )


def test_the_script_passes_everything_on_to_the_job(tmp_path):
    script = (DEPLOY / "nightly.sbatch").read_text().replace(PROGRAM, str(tmp_path / "motionary"))
    (tmp_path / "nightly.sbatch").write_text(script)
    (tmp_path / "motionary").write_text('#!/bin/sh\necho "$PPID $MOTIONARY_JOB__WORKERS $*"; exit 3\n')
    (tmp_path / "motionary").chmod(0o755)
    ended = subprocess.run(
        ["bash", tmp_path / "nightly.sbatch"], capture_output=True, text=True, check=False,
        env={**os.environ, "SLURM_CPUS_PER_TASK": "7"},
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (3, "")
    assert ended.stdout == f"{os.getpid()} 7 nightly {CONFIG}\n"  # our child: no shell is left in between


def test_the_image_takes_what_the_installation_needs():
    text = (DEPLOY / "Dockerfile").read_text()
    copied = [
        name for line in re.findall(r"^COPY (.*) \S+$", text, flags=re.MULTILINE) for name in line.split()
    ]
    assert all((ROOT / name).exists() for name in copied)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    folders = set(project["tool"]["setuptools"]["package-dir"].values())
    needed = {"pyproject.toml", "constraints.txt", project["project"]["readme"], *folders}
    assert needed | set(project["project"]["license-files"]) == set(copied)
    ignored = (DEPLOY / "Dockerfile.dockerignore").read_text().splitlines()
    assert {line[1:] for line in ignored if line.startswith("!")} == set(copied)
    user = str(pod()["securityContext"]["runAsUser"])
    assert f"USER {user}:{user}\n" in text
    assert f"docker build -f workflows/deploy/Dockerfile -t {pod()['containers'][0]['image']} ." in text


def test_the_readme_names_every_file_and_no_other():
    text = (DEPLOY / "README.md").read_text()
    present = {file.name for file in DEPLOY.iterdir() if file.name != "README.md"}
    named = set(re.findall(r"^\| (.*) \|", text, flags=re.MULTILINE)[1:])
    assert {name for row in named for name in re.findall(r"`([^`]+)`", row)} == present
    for path in re.findall(r"workflows/deploy/[\w.-]*\w", text):
        assert (ROOT / path).exists(), path


# More than one machine


def dask_job() -> dict[str, Any]:
    return yaml.safe_load((DEPLOY / "dask-cluster.yaml").read_text())


def dask_pods() -> dict[str, dict[str, Any]]:
    spec = dask_job()["spec"]
    cluster = spec["cluster"]["spec"]
    return {"job": spec["job"]["spec"]} | {name: cluster[name]["spec"] for name in ("worker", "scheduler")}


def cloud_files() -> dict[str, str]:
    text = (DEPLOY / "cloud-machine.yaml").read_text()
    assert text.startswith("#cloud-config\n")
    return {one["path"]: one["content"] for one in yaml.safe_load(text)["write_files"]}


def cloud_service() -> str:
    return cloud_files()["/etc/systemd/system/motionary-run.service"]


def run_options(arguments: list[str]) -> dict[str, Any]:
    """Parse the arguments of the main job; one that does not exist ends the test."""
    command = typer.main.get_command(app).commands["run"]  # type: ignore[attr-defined]
    return command.make_context("run", arguments).params


def slurm_script() -> Any:
    pytest.importorskip("dask_jobqueue")
    module = ModuleType("slurm_cluster")
    exec((DEPLOY / "slurm-cluster.sbatch").read_text(), vars(module))
    return module


def test_the_operators_job_is_of_the_fields_that_its_resource_has():
    job = dask_job()
    assert (job["apiVersion"], job["kind"]) == ("kubernetes.dask.org/v1", "DaskJob")
    assert set(job["spec"]) == {"job", "cluster"}
    assert set(job["spec"]["job"]) == {"spec"}
    cluster = job["spec"]["cluster"]["spec"]
    assert set(cluster) == {"worker", "scheduler"}
    assert set(cluster["worker"]) == {"replicas", "spec"}
    assert set(cluster["scheduler"]) == {"spec", "service"}
    selector = cluster["scheduler"]["service"]["selector"]
    assert selector == {"dask.org/cluster-name": job["metadata"]["name"], "dask.org/component": "scheduler"}
    named = {one["name"] for one in dask_pods()["scheduler"]["containers"][0]["ports"]}
    assert {port["targetPort"] for port in cluster["scheduler"]["service"]["ports"]} == named


def test_its_pods_and_service_are_what_kubernetes_knows(tmp_path):
    service = dask_job()["spec"]["cluster"]["spec"]["scheduler"]["service"]
    objects = [
        {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": name}, "spec": spec}
        for name, spec in dask_pods().items()
    ]
    objects.append({"apiVersion": "v1", "kind": "Service", "metadata": {"name": "one"}, "spec": service})
    (tmp_path / "objects.yaml").write_text(yaml.safe_dump_all(objects))
    linted("kubernetes-validate", "--strict", tmp_path / "objects.yaml")


def test_its_pods_see_the_same_paths_and_run_the_same_image():
    pods = dask_pods()
    containers = {name: one["containers"][0] for name, one in pods.items()}
    assert {one["image"] for one in containers.values()} == {pod()["containers"][0]["image"]}
    assert containers["job"]["volumeMounts"] == containers["worker"]["volumeMounts"]
    assert pods["job"]["volumes"] == pods["worker"]["volumes"]
    claims = [one["persistentVolumeClaim"] for one in pods["job"]["volumes"] if "emptyDir" not in one]
    assert claims == [one["persistentVolumeClaim"] for one in pod()["volumes"][:2]]
    program, *arguments = containers["job"]["args"]
    assert program == "run"
    options = run_options(arguments)
    assert (str(options["library"]), options["catalog"]) == (f"{HOME}/library", f"{HOME}/catalog")
    assert options["scheduler"] == "$(DASK_SCHEDULER_ADDRESS)"
    worker = [*containers["worker"]["command"], *containers["worker"]["args"]]
    assert dask_worker_options(worker[1:]) == {"nthreads": 1, "memory_limit": "0"}


def dask_worker_options(command: list[str]) -> dict[str, Any]:
    assert command[0] == "worker"
    given = dask_worker.make_context("worker", command[1:]).params
    return {name: given[name] for name in ("nthreads", "memory_limit")}


def test_slurms_workers_are_a_process_a_core_without_a_limit_of_dasks():
    script = slurm_script()
    assert str(script.PROGRAM) == PROGRAM
    assert str(script.HOME) == HOME
    with script.cluster() as cluster:
        lines = cluster.job_script().splitlines()
        address = cluster.scheduler_address
    assert f"export NUMBA_CACHE_DIR={HOME}/kernels" in lines
    assert "#SBATCH --cpus-per-task=16" in lines
    python, *command = shlex.split(lines[-1])
    assert python == PROGRAM.replace("motionary/bin/motionary", "motionary/bin/python")
    assert command[:2] == ["-m", "distributed.cli.dask_worker"]
    assert command[2] == address
    assert "--nworkers 16" in lines[-1]
    assert dask_worker_options(["worker", *command[2:]]) == {"nthreads": 1, "memory_limit": "0"}


def test_slurms_script_runs_the_job_on_its_scheduler(tmp_path, monkeypatch, capfd):
    script = slurm_script()

    class Cluster:
        scheduler_address = "tcp://node:1234"

        def __enter__(self):
            return self

        def __exit__(self, *raised):
            pass

        def adapt(self, minimum_jobs, maximum_jobs):
            assert minimum_jobs == maximum_jobs == script.JOBS

    program = tmp_path / "motionary"
    program.write_text('#!/bin/sh\necho "$*"; exit 3\n')
    program.chmod(0o755)
    monkeypatch.setattr(script, "PROGRAM", program)
    monkeypatch.setattr(script, "cluster", Cluster)
    assert script.main(["LIBRARY", "CATALOG", "--paper"]) == 3
    assert capfd.readouterr().out == "run LIBRARY CATALOG --paper --scheduler tcp://node:1234\n"


def test_the_cloud_machine_runs_the_main_job_and_switches_itself_off():
    parsed = yaml.safe_load((DEPLOY / "cloud-machine.yaml").read_text())
    assert parsed["users"][0]["homedir"] == HOME
    assert parsed["mounts"][0][1] == f"{HOME}/library"
    lines = dict(
        line.split("=", 1) for line in cloud_service().splitlines() if "=" in line and line[0] != "#"
    )
    program, command, *arguments = shlex.split(lines["ExecStart"])
    assert (program, command) == (PROGRAM, "run")
    options = run_options(arguments)
    assert str(options["library"]) == f"{HOME}/library"
    assert options["catalog"].startswith("s3://")
    assert lines["SuccessAction"] == lines["FailureAction"] == "poweroff"
    assert lines["SuccessExitStatus"] == "3"
    assert parsed["runcmd"][-1] == "systemctl start --no-block motionary-run.service"


# Linters


def test_systemd_accepts_the_cloud_machines_unit(tmp_path):
    file = tmp_path / "motionary-run.service"
    file.write_text(cloud_service().replace(PROGRAM, "/bin/true").replace("User=motionary", "User=root"))
    assert linted("systemd-analyze", "verify", "--man=no", file) == ""


def test_systemd_accepts_the_units(tmp_path):
    for file in DEPLOY.glob("motionary-nightly.[st]*"):
        # The program is not installed on the machine that tests.
        (tmp_path / file.name).write_text(file.read_text().replace(PROGRAM, "/bin/true"))
    units = sorted(tmp_path.iterdir())
    assert len(units) == 2
    assert linted("systemd-analyze", "verify", "--man=no", *units) == ""


def test_cron_reads_its_line():
    croniter = pytest.importorskip("croniter").croniter
    *_, user, command = cron_line()
    assert croniter.is_valid(" ".join(cron_line()[:5]))
    assert (user, command.split()[0]) == (service()["User"], PROGRAM)
    lines = (DEPLOY / "motionary-nightly.cron").read_text().splitlines()
    settings = [line for line in lines if not line.startswith(("#", "30 "))]
    assert all(re.fullmatch(r"[A-Z_]+=\S+", line) for line in settings)
    assert "%" not in command  # cron would read a line's end


def test_kubernetes_schemas_accept_the_objects():
    linted("kubernetes-validate", "--strict", "kubernetes.yaml")


def test_bash_and_shellcheck_accept_the_script():
    linted("bash", "-n", "nightly.sbatch")
    linted("shellcheck", "nightly.sbatch")


def test_ruff_accepts_the_clusters_script():
    linted("ruff", "check", "--extension", "sbatch:python", "slurm-cluster.sbatch")


def test_the_workflows_schema_accepts_it():
    linted("check-jsonschema", "--builtin-schema", "vendor.github-workflows", "github-actions.yml")


def test_shellcheck_accepts_the_workflows_step(tmp_path):
    (step, _) = workflow()["jobs"]["nightly"]["steps"]
    (tmp_path / "step.sh").write_text("#!/bin/bash\n" + step["run"])
    linted("shellcheck", tmp_path / "step.sh")


def test_hadolint_accepts_the_dockerfile():
    linted("hadolint", "Dockerfile")
