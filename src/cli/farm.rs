//! `taki farm`: writes job files.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use super::grammar;
use super::parse::{minutes, shard_memory, within};
use super::terminal::Terminal;
use crate::farm::{Job, check_name, kubernetes, openjd, slurm};
use crate::job::batch::{NUMBER_IT, Pattern};
use crate::job::check_kind;
use crate::output::frame::{Format, Output};
use crate::scene::STDIN;
use crate::util::error::{Error, Result};

#[derive(Args)]
pub struct FarmArgs {
    #[command(subcommand)]
    engine: Engine,
}

const SLURM_HELP: &str = "\
Example. Run it in the folder where relative paths start, on a disk that all nodes share:

  taki farm slurm --shards 8 --time 60 --cpus 4 -- fall.toml --frames 0-239 -o 'out/fall.####.exr' | sbatch

A task that ends with code 74 (I/O error), 75 (device lost), 124 (driver hang), 137 or 143 (killed, time \
limit, preemption) is requeued; scontrol show job and sacct show any other code. Finished frames are kept.";

const OPENJD_HELP: &str = "\
Example. Relative paths start in the template's folder, which its parameter Folder can change:

  taki farm openjd --shards 8 -o fall.yaml -- fall.toml --frames 0-239 -o 'out/fall.####.exr'
  openjd check fall.yaml && openjd run fall.yaml

The specification has no retry by exit code, so the task itself runs its shard again after code 74 (I/O \
error), 75 (device lost), 124 (driver hang) or 137 (killed). Finished frames are kept.";

const KUBERNETES_HELP: &str = "\
Example. Relative paths start at the root of the volume claim:

  taki farm kubernetes --shards 8 --image IMAGE --claim scenes -- \\
    fall.toml --frames 0-239 -o 'out/fall.####.exr' | kubectl apply -f -

A shard that ends with code 74 (I/O error), 75 (device lost), 124 (driver hang), 137 or 143 (killed) is run \
again. Codes 2, 65 and 73 end the job; any other code ends its shard. Finished frames are kept. Needs \
Kubernetes 1.29 or newer.";

#[derive(Subcommand)]
enum Engine {
    /// Writes the script of a Slurm array job, for sbatch.
    #[command(after_help = SLURM_HELP)]
    Slurm {
        #[command(flatten)]
        job: JobArgs,
        /// Partitions to run in, separated by commas. Default: the site's default partition.
        #[arg(long, value_name = "NAMES")]
        partition: Option<String>,
    },
    /// Writes an Open Job Description template (2023-09), for openjd, Deadline Cloud and others.
    #[command(after_help = OPENJD_HELP)]
    Openjd {
        #[command(flatten)]
        job: JobArgs,
    },
    /// Writes the manifest of a Kubernetes Indexed Job, for kubectl.
    #[command(after_help = KUBERNETES_HELP)]
    Kubernetes {
        #[command(flatten)]
        job: JobArgs,
        /// Container image that contains taki.
        #[arg(long)]
        image: String,
        /// Persistent volume claim that holds the scenes and receives the frames. All shards write to it.
        #[arg(long, value_name = "NAME")]
        claim: String,
        /// Folder where the claim is mounted in the container. Relative paths start there.
        #[arg(long, value_name = "DIR", default_value = "/work")]
        mount: String,
    },
}

#[derive(Args)]
struct JobArgs {
    /// Number of shards that the batch is split into. Each shard is one task of the farm.
    #[arg(long, value_name = "N", default_value_t = 8)]
    #[arg(value_parser = within::<1, 10_000>)]
    shards: u32,
    /// Job file to write; a job file of this name is replaced. Default: stdout.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replaces an existing file even if it is no job file that taki wrote.
    #[arg(long, requires = "output")]
    overwrite: bool,
    /// Name of the job.
    #[arg(long, default_value = "taki", value_parser = name)]
    name: String,
    /// Path of taki on the nodes.
    #[arg(long, value_name = "PATH", default_value = "taki")]
    taki: OsString,
    /// Number of times that one shard may be run again after a temporary fault.
    #[arg(long, value_name = "N", default_value_t = 3)]
    #[arg(value_parser = within::<0, 1000>)]
    retries: u32,
    /// Time limit of one run of a shard, in minutes. Default: the site's limit.
    #[arg(long, value_name = "MINUTES", value_parser = minutes)]
    time: Option<u32>,
    /// CPU cores for each shard. Default: the site's default.
    #[arg(long, value_name = "N", value_parser = within::<1, 100_000>)]
    cpus: Option<u32>,
    /// Memory for each shard, such as 8GiB, 8GB or 512MiB, rounded up to whole MiB. A number alone counts
    /// MiB. Default: the site's default. The budget of taki batch is another option, --memory after --.
    #[arg(long, value_name = "SIZE", value_parser = shard_memory)]
    memory: Option<u32>,
    /// GPUs for each shard. Default: the site's default.
    #[arg(long, value_name = "N", value_parser = within::<1, 1000>)]
    gpus: Option<u32>,
    /// Scene and options of `taki batch`. They are passed on unchanged, and --shard is added.
    #[arg(last = true, required = true, value_name = "BATCH ARGUMENTS")]
    batch: Vec<OsString>,
}

impl JobArgs {
    fn job(&self) -> Result<Job> {
        let job = Job {
            name: self.name.clone(),
            taki: self.taki.clone(),
            shards: self.shards,
            retries: self.retries,
            minutes: self.time,
            cpus: self.cpus,
            memory: self.memory,
            gpus: self.gpus,
            batch: self.batch.clone(),
        };
        job.check()?;
        check_batch(&job)?;
        Ok(job)
    }
}

fn name(text: &str) -> std::result::Result<String, String> {
    check_name(text).map(|()| text.to_string())
}

/// Parses the arguments as `taki batch` will, so that a typing error is found here and not on every node.
/// Does not read the scene, which may exist only on the nodes.
fn check_batch(job: &Job) -> Result<()> {
    check_words(&job.batch)?;
    let shard = format!("0/{}", job.shards);
    let start = ["taki", "batch", "--shard", &shard].map(OsString::from);
    let matches = grammar().try_get_matches_from(start.iter().chain(&job.batch)).map_err(|e| {
        let text = e.render().to_string();
        let line = match e.use_stderr() {
            true => text.lines().next().unwrap_or("").trim_start_matches("error: "),
            false => "they ask for help or the version",
        };
        Error::Usage(format!("taki batch would refuse the arguments after --: {line}; see taki batch --help"))
    })?;
    let Some((_, batch)) = matches.subcommand() else { return Ok(()) };
    if batch.get_one::<PathBuf>("scene").is_some_and(|scene| scene == Path::new(STDIN)) {
        let what = "the shards of a job cannot read their scene from stdin; give a preset or a scene file";
        return Err(Error::Usage(what.into()));
    }
    if batch.get_flag("overwrite") {
        let what =
            "--overwrite after -- renders every picture anew whenever a shard is run again; leave it out";
        return Err(Error::Usage(what.into()));
    }
    let swept = batch.contains_id("sweeps");
    for path in batch.get_many::<PathBuf>("outputs").into_iter().flatten() {
        let pattern = Pattern::new(path, &[])?;
        if !swept {
            pattern.check_placeholders()?;
        }
        Pattern::check_kind(path)?;
        // A .png is one movie then.
        let alone = !swept && !pattern.has_frame();
        if alone && Format::of(path).is_some_and(|format| format != Format::Png) {
            return Err(Error::Usage(format!(
                "{}: all frames would share one name; {NUMBER_IT}",
                path.display()
            )));
        }
    }
    let whole = |path: &&PathBuf| {
        let sweeps = path.file_name().unwrap_or_default().to_string_lossy().contains('{');
        let frames = || Pattern::new(path, &[]).is_ok_and(|pattern| pattern.has_frame());
        Format::of(path).is_none() || !sweeps && !frames()
    };
    let given = |id| batch.get_many::<PathBuf>(id).into_iter().flatten();
    let (mut outputs, mut wholes) = (given("outputs"), given("sheet").chain(given("manifests")));
    match outputs.find(whole).or_else(|| wholes.next()) {
        None => Ok(()),
        Some(path) => Err(Error::Usage(format!(
            "{} needs all pictures, but a shard renders only some; leave it out of the job, and when the job \
             is done, run the whole taki batch without --shard: it keeps the pictures and adds this file",
            path.display()
        ))),
    }
}

/// Refuses the name of the program or of a command before the scene.
fn check_words(batch: &[OsString]) -> Result<()> {
    let mut words: Vec<String> =
        batch.iter().take(2).map(|word| word.to_string_lossy().into_owned()).collect();
    let program = batch.first().is_some_and(|word| Path::new(word).file_stem() == Some("taki".as_ref()));
    let is_command = |word: &String| ["batch", "render"].contains(&word.as_str());
    let surplus = usize::from(program);
    let surplus = surplus + usize::from(words.get(surplus).is_some_and(is_command));
    words.truncate(surplus);
    if words.is_empty() {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "leave out {} after --: only the scene and the options of taki batch stand there, such as \
         -- fall.toml --frames 0-239",
        words.join(" ")
    )))
}

/// Words at the start of every job file that taki writes.
const MARK: &[u8] = b"written by taki farm";

pub fn run(args: &FarmArgs, terminal: &Terminal) -> Result<()> {
    let (job, text) = match &args.engine {
        Engine::Slurm { job, partition } => {
            (job, slurm::script(&job.job()?, &slurm::Options { partition: partition.clone() })?)
        }
        Engine::Openjd { job } => (job, openjd::template(&job.job()?)?),
        Engine::Kubernetes { job, image, claim, mount } => {
            let options =
                kubernetes::Options { image: image.clone(), claim: claim.clone(), mount: mount.clone() };
            (job, kubernetes::manifest(&job.job()?, &options)?)
        }
    };
    match &job.output {
        Some(path) => {
            if !job.overwrite {
                let marked = |start: &[u8]| start.windows(MARK.len()).any(|w| w == MARK);
                check_kind(path, "job file of taki", marked)?;
            }
            Output::create(path)?.finish_with(text.as_bytes())?;
            terminal.note(&format!("taki: wrote {}", path.display()));
            Ok(())
        }
        // Half a job file in a pipe is useless, so unlike with other output a broken pipe is an error too.
        None => {
            let mut out = std::io::stdout();
            let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
            written.map_err(Error::stdout)
        }
    }
}
