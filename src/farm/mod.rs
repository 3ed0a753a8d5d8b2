//! Job files that split a `taki batch` over the machines of a farm, for the job engine that a site already
//! has.
//!
//! The functions are pure: options in, text of the job file out. `taki farm` is their command line. A shard
//! is one task of the job engine and runs `taki batch --shard I/N`. All shards write to one output folder,
//! and a batch keeps finished pictures. Running a shard again is therefore always safe, and repeats only
//! lost work.

pub mod kubernetes;
pub mod openjd;
pub mod slurm;
mod yaml;

use std::ffi::{OsStr, OsString};

use crate::util::error::{Error, Result};

/// Exit codes after which a shard is run again: 74 (I/O error; network file systems have short outages), 75
/// (device lost), 124 (driver hang), 137 and 143 (SIGKILL and SIGTERM from outside: the node ran out of
/// memory, the time limit, preemption).
///
/// Any other code would occur again. Three of them could be argued about:
/// - 33 (out of memory): the work exceeds its `--memory` budget, or the device is too small even for the
///   smaller tiles that the batch tried by itself.
/// - 101 (a bug): as deterministic as the renderer. Users should see it; a later success must not hide it.
/// - 130 (SIGINT): the user stopped the work.
pub const RETRIED: [u8; 5] = [74, 75, 124, 137, 143];

/// Exit codes that every shard of the job would end with: 2 (usage), 65 (bad input), 73 (an output cannot be
/// created). 69 (no adapter) is not one of them, because another shard's node may have a GPU.
pub const HOPELESS: [u8; 3] = [2, 65, 73];

/// Seconds between SIGTERM and SIGKILL. A batch stops after the current tile, in well under a second.
pub const GRACE_SECONDS: u32 = 30;

/// Options of a job file that all job engines share.
#[derive(Clone, Debug)]
pub struct Job {
    /// Name of the job; see [`check_name`].
    pub name: String,
    /// Path of taki on the nodes.
    pub taki: OsString,
    /// Number of shards, at least 1.
    pub shards: u32,
    /// Number of times that one shard may be run again.
    pub retries: u32,
    /// Time limit of one run of a shard, minutes. `None`: the site's default.
    pub minutes: Option<u32>,
    /// CPU cores of a shard. `None`: the site's default.
    pub cpus: Option<u32>,
    /// Memory of a shard, MiB. `None`: the site's default.
    pub memory: Option<u32>,
    /// GPUs of a shard. `None`: the site's default.
    pub gpus: Option<u32>,
    /// Arguments of `taki batch`, without `--shard`.
    pub batch: Vec<OsString>,
}

impl Job {
    /// Checks what all job engines require.
    ///
    /// # Errors
    /// [`Error::Usage`] for an invalid name, for no shards, or if the batch's arguments contain `--shard`.
    pub fn check(&self) -> Result<()> {
        check_name(&self.name).map_err(Error::Usage)?;
        if self.shards == 0 {
            return Err(Error::Usage("a job without shards does nothing; give --shards 1 or more".into()));
        }
        let shard = |word: &OsString| word == "--shard" || word.as_encoded_bytes().starts_with(b"--shard=");
        if self.batch.iter().any(shard) {
            let why = "the job file numbers the shards itself; remove --shard after --, and give --shards N \
                       before it";
            return Err(Error::Usage(why.into()));
        }
        Ok(())
    }
}

/// Checks that `name` is a name that every job engine accepts without quotes: 1 to 50 ASCII letters, digits,
/// `.`, `_` or `-`, of which the first is a letter or digit.
///
/// # Errors
/// The rule as a sentence.
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

/// Quotes `word` as one word of bash. The result is printable UTF-8 without `{{` and `}}`, so it can stand
/// in a script, in a YAML block and in a format string of Open Job Description.
///
/// # Errors
/// [`Error::Usage`] if `word` contains a NUL character.
pub fn bash_word(word: &OsStr) -> Result<String> {
    let bytes = word.as_encoded_bytes();
    if bytes.contains(&0) {
        return Err(Error::Usage(
            "an argument contains a NUL character, which cannot be passed to a program".into(),
        ));
    }
    match word.to_str() {
        Some(text) if text.chars().all(printable) && !text.contains("{{") && !text.contains("}}") => {
            let quoted = shlex::try_quote(text).map_err(|e| Error::Usage(format!("{text}: {e}")))?;
            Ok(quoted.into_owned())
        }
        // sbatch refuses carriage returns, line separators end lines in YAML, and bytes that are not UTF-8
        // fit neither format.
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

/// Whether `c` may stand unescaped in YAML without ending the line.
fn printable(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}')
}

/// Quotes all `words` for bash, each after a space.
fn bash_words(words: &[OsString]) -> Result<String> {
    words.iter().map(|word| Ok(format!(" {}", bash_word(word)?))).collect()
}

/// Returns `word` as text, for a `format` that can hold only UTF-8.
///
/// # Errors
/// [`Error::Usage`] if `word` is not UTF-8 or contains a NUL character.
fn utf8<'a>(word: &'a OsStr, format: &str) -> Result<&'a str> {
    match word.to_str() {
        Some(text) if !text.contains('\0') => Ok(text),
        _ => Err(Error::Usage(format!(
            "{} is not UTF-8, but {format} can hold only UTF-8; rename it, or use a link with a plain name",
            word.display()
        ))),
    }
}

/// Joins `codes` to alternatives of a bash pattern, such as `74 | 75`.
fn pattern(codes: &[u8]) -> String {
    codes.iter().map(u8::to_string).collect::<Vec<_>>().join(" | ")
}
