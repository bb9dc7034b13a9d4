//! The files of deploy: manifests are what Kubernetes reads, and their commands are what the evaluator reads.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use serde::Deserialize;
use serde_json::Value;

/// Those fields of `batch/v1 Job` that the manifests use. A name that is not here, or has another type, is refused.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Job {
    api_version: String,
    kind: String,
    metadata: Metadata,
    spec: JobSpec,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata {
    name: Option<String>,
    #[serde(default)]
    labels: BTreeMap<String, String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct JobSpec {
    completion_mode: Option<String>,
    completions: Option<u32>,
    parallelism: Option<u32>,
    backoff_limit: u32,
    template: Template,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Template {
    metadata: Metadata,
    spec: PodSpec,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct PodSpec {
    restart_policy: String,
    containers: Vec<Container>,
    volumes: Vec<Volume>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Container {
    name: String,
    image: String,
    #[serde(default)]
    command: Vec<String>,
    args: Vec<String>,
    #[serde(default)]
    env: Vec<Variable>,
    resources: BTreeMap<String, BTreeMap<String, String>>,
    volume_mounts: Vec<Mount>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Variable {
    name: String,
    value: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Mount {
    name: String,
    mount_path: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Volume {
    name: String,
    persistent_volume_claim: Value,
}

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy").join(path)).unwrap()
}

fn job(file: &str) -> Job {
    let text = read(&format!("kubernetes/{file}"));
    let job: Job = serde_saphyr::from_str(&text).unwrap_or_else(|error| panic!("{file}: {error}"));
    assert_eq!((job.api_version.as_str(), job.kind.as_str()), ("batch/v1", "Job"), "{file}");
    let pod = &job.spec.template.spec;
    let [volume] = &pod.volumes[..] else { panic!("{file}: one volume") };
    assert_eq!(volume.persistent_volume_claim["claimName"], "halflight");
    for container in &pod.containers {
        assert_eq!((container.name.as_str(), container.image.as_str()), ("evaluator", "halflight:latest"));
        assert!(container.resources.contains_key("requests") && container.resources["limits"].contains_key("memory"));
        assert!(container.volume_mounts.iter().all(|mount| mount.name == volume.name && mount.mount_path == "/data"));
    }
    assert_eq!(job.spec.template.metadata.labels["app"], "halflight");
    job
}

/// Runs the evaluator with these arguments and returns what it says and its exit code.
fn evaluator(arguments: &[String], variables: &[(&str, &str)]) -> (String, Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_evaluator"));
    let output = command.args(arguments).envs(variables.iter().copied()).output().unwrap();
    (String::from_utf8_lossy(&output.stderr).into_owned(), output.status.code())
}

#[test]
fn the_jobs_of_kubernetes_are_jobs_and_run_the_evaluator() {
    let cells = job("cells.yaml");
    let JobSpec { completion_mode, completions, parallelism, backoff_limit, template } = &cells.spec;
    assert_eq!((completion_mode.as_deref(), completions), (Some("Indexed"), parallelism));
    assert!(*backoff_limit >= 100 && template.spec.restart_policy == "OnFailure");
    let [container] = &template.spec.containers[..] else { panic!("one container") };
    assert!(container.command.is_empty(), "the image's entry point is the evaluator");
    assert_eq!((container.env[0].name.as_str(), container.env[0].value.as_str()), ("HALFLIGHT_CACHE", "/data/cache"));
    let arguments: Vec<String> =
        container.args.iter().map(|argument| argument.replace("$(JOB_COMPLETION_INDEX)", "99")).collect();
    assert!(container.args.contains(&format!("--shards={}", completions.unwrap())));
    // All arguments are right, and then there is no such grid here.
    let (said, code) = evaluator(&arguments, &[("JOB_COMPLETION_INDEX", "99")]);
    assert!(said.contains("cannot read /data/grid.toml") && code == Some(2), "{said}");
    let (said, _) = evaluator(&arguments, &[("JOB_COMPLETION_INDEX", "100")]);
    assert!(said.contains("JOB_COMPLETION_INDEX is 100"), "{said}");

    let merge = job("merge.yaml");
    assert_eq!((merge.metadata.name.as_deref(), merge.spec.completion_mode), (Some("halflight-merge"), None));
    let container = &merge.spec.template.spec.containers[0];
    assert_eq!(container.command, ["/bin/sh", "-c"]);
    let words: Vec<String> = container.args[0].split_whitespace().map(str::to_owned).collect();
    let (said, code) = evaluator(&words[1..], &[]);
    assert!(said.contains("cannot read /data/parts/part-*/run.json") && code == Some(2), "{said}");
}

#[test]
fn the_container_and_slurm_name_files_and_options_that_are_there() {
    let container = read("container/Containerfile");
    for script in ["build.sh", "install.sh"] {
        assert!(container.contains(&format!("deploy/container/{script}")), "{script}");
        assert!(read(&format!("container/{script}")).starts_with("#!/bin/sh\n"));
    }
    let last = container.lines().rfind(|line| !line.is_empty()).unwrap();
    assert_eq!(last, r#"ENTRYPOINT ["evaluator"]"#);
    let cells = read("slurm/cells.sbatch");
    let options = ["run", "--grid", "none.toml", "--out", "out", "--shard", "auto", "--resume"];
    assert!(options[3..].iter().filter(|word| **word != "out").all(|word| cells.contains(word)));
    let variables = [("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_ARRAY_TASK_COUNT", "2"), ("SLURM_ARRAY_TASK_MAX", "1")];
    let (said, code) = evaluator(&options.map(str::to_owned), &variables);
    assert!(said.contains("cannot read none.toml") && code == Some(2), "{said}");
    for script in ["cells.sbatch", "merge.sbatch"] {
        assert!(read("slurm/submit.sh").contains(script) && read("slurm/test.sh").contains(script));
    }
}
