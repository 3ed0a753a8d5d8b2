//! Job files for farms: a `taki batch` command split over shards, on the engine that a site already has.
//!
//! Pure functions from options to text; `taki farm` is their command line. A shard is one task of the
//! engine: `taki batch --shard I/N`. Shards share one output folder, and a batch keeps the frames that are
//! finished, so to run a shard again is always right and costs only what was lost.

pub mod kubernetes;
pub mod openjd;
pub mod slurm;
mod yaml;

use std::ffi::{OsStr, OsString};

use crate::util::error::{Error, Result};

/// Exit codes after which a shard is run again: I/O error (network file systems have bad minutes), device
/// lost, driver hang, and SIGKILL or SIGTERM from outside (memory of the node, time limit, preemption).
///
/// All others would come again. Of those that could be argued about: 33 (out of memory) says that the work
/// is over its `--memory` budget or that the device is too small, after the batch tried smaller tiles by
/// itself; 101 (a bug) is as deterministic as the renderer and is to be seen, not hidden by a later success;
/// 130 is the user's own hand.
pub const RETRIED: [u8; 5] = [74, 75, 124, 137, 143];

/// Exit codes that every shard of the job would end with: usage, bad input, output that cannot be created.
/// 69 (no adapter) is not among them: another shard's node may have a GPU.
pub const HOPELESS: [u8; 3] = [2, 65, 73];

/// Seconds between SIGTERM and the end: a batch stops after the tile in hand, in well under a second.
pub const GRACE_SECONDS: u32 = 30;

/// What a job file is made of, whatever the engine.
#[derive(Clone, Debug)]
pub struct Job {
    /// The job's name: see [`check_name`].
    pub name: String,
    /// The program on the nodes.
    pub taki: OsString,
    /// Number of shards, at least 1.
    pub shards: u32,
    /// How often one shard may be run again.
    pub retries: u32,
    /// Longest time of one run of a shard, minutes.
    pub minutes: Option<u32>,
    /// Cores of a shard.
    pub cpus: Option<u32>,
    /// Memory of a shard, MiB.
    pub memory: Option<u32>,
    /// GPUs of a shard.
    pub gpus: Option<u32>,
    /// Arguments of `taki batch`, without `--shard`.
    pub batch: Vec<OsString>,
}

impl Job {
    /// Refuses what no engine could run: exit code 2.
    pub fn check(&self) -> Result<()> {
        check_name(&self.name).map_err(Error::Usage)?;
        if self.shards == 0 {
            return Err(Error::Usage("a job of no shards does nothing; give --shards 1 or more".into()));
        }
        let shard = |word: &OsString| word == "--shard" || word.as_encoded_bytes().starts_with(b"--shard=");
        if self.batch.iter().any(shard) {
            let why = "the job file numbers the shards itself; leave --shard out after --, and give --shards N before it";
            return Err(Error::Usage(why.into()));
        }
        Ok(())
    }
}

/// A name that every engine takes where it stands unquoted: 1 to 50 ASCII letters, digits, `.`, `_` or `-`,
/// the first a letter or digit.
pub fn check_name(name: &str) -> std::result::Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    if (1..=50).contains(&name.len())
        && name.chars().all(plain)
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
    {
        Ok(())
    } else {
        Err("a name has 1 to 50 letters, digits, '.', '_' or '-', and starts with a letter or digit".into())
    }
}

/// `word` as one word of bash, in printable UTF-8 without `{{` and `}}`: fit for a script, for a block of
/// YAML and for a format string of Open Job Description.
pub fn bash_word(word: &OsStr) -> Result<String> {
    let bytes = word.as_encoded_bytes();
    if bytes.contains(&0) {
        return Err(Error::Usage("an argument holds a NUL character, which no program can be given".into()));
    }
    match word.to_str() {
        Some(text) if text.chars().all(printable) && !text.contains("{{") && !text.contains("}}") => {
            let quoted = shlex::try_quote(text).map_err(|e| Error::Usage(format!("{text}: {e}")))?;
            Ok(quoted.into_owned())
        }
        // Carriage returns stop sbatch, line separators end lines of YAML, and stray bytes are neither.
        _ => {
            let escape = |&byte: &u8| match byte {
                b'\'' | b'\\' | b'{' | b'}' => format!("\\x{byte:02x}"),
                b' '..=b'~' => char::from(byte).to_string(),
                _ => format!("\\x{byte:02x}"),
            };
            Ok(format!("$'{}'", bytes.iter().map(escape).collect::<String>()))
        }
    }
}

/// Whether YAML may hold `c` as it is, and a line stays one line.
fn printable(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}')
}

/// All words of `batch`, quoted for bash, each after a space.
fn bash_words(words: &[OsString]) -> Result<String> {
    words.iter().map(|word| Ok(format!(" {}", bash_word(word)?))).collect()
}

/// The text of `word`, for files that can hold nothing else.
fn utf8<'a>(word: &'a OsStr, format: &str) -> Result<&'a str> {
    match word.to_str() {
        Some(text) if !text.contains('\0') => Ok(text),
        _ => Err(Error::Usage(format!(
            "{} is not UTF-8, and {format} can hold nothing else; rename it, or use a link with a plain name",
            word.display()
        ))),
    }
}

/// `codes` as alternatives of a bash pattern: `74 | 75`.
fn pattern(codes: &[u8]) -> String {
    codes.iter().map(u8::to_string).collect::<Vec<_>>().join(" | ")
}
