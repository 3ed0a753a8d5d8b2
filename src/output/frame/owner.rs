//! Identity of the process that writes a file: its machine, its number, and whether it still runs.

use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

/// A process, distinguished from every other on all machines that share a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// Name of the machine, for messages.
    pub host: String,
    /// CRC-32 of machine name, boot and process namespace, in hex. It distinguishes machines of one name,
    /// restarts and containers.
    pub machine: String,
    /// Process number on that machine.
    pub pid: u32,
    /// Start of the process, in clock ticks since the machine's start; 0 where it is unknown.
    pub started: u64,
}

/// State of a process, as far as it can be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Life {
    /// The process runs.
    Alive,
    /// The process has ended.
    Dead,
    /// The process belongs to another machine, which cannot be asked.
    Elsewhere,
}

impl Owner {
    /// Returns this process.
    pub fn me() -> &'static Owner {
        static ME: OnceLock<Owner> = OnceLock::new();
        ME.get_or_init(|| {
            let host = gethostname::gethostname().to_string_lossy().into_owned();
            let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
            let namespace = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
            let machine = crc32fast::hash(format!("{host}\n{boot}\n{}", namespace.display()).as_bytes());
            let pid = std::process::id();
            Owner { host, machine: format!("{machine:08x}"), pid, started: started(pid).unwrap_or(0) }
        })
    }

    /// Returns whether the process still runs.
    pub fn life(&self) -> Life {
        match life_of(&self.machine, self.pid) {
            // Another process may have taken the number since.
            Life::Alive if self.started != 0 && started(self.pid).is_some_and(|s| s != self.started) => {
                Life::Dead
            }
            life => life,
        }
    }
}

/// Returns whether process `pid` of a machine runs. In doubt it counts as alive.
pub fn life_of(machine: &str, pid: u32) -> Life {
    let proc = Path::new("/proc");
    if machine != Owner::me().machine {
        Life::Elsewhere
    } else if !proc.join("self").exists() {
        Life::Alive
    } else {
        match std::fs::read_to_string(proc.join(format!("{pid}/stat"))) {
            // A zombie has ended; only its exit code has not been collected.
            Ok(stat) if matches!(fields(&stat).next(), Some("Z" | "X")) => Life::Dead,
            Ok(_) => Life::Alive,
            Err(_) if proc.join(pid.to_string()).exists() => Life::Alive,
            Err(_) => Life::Dead,
        }
    }
}

/// Returns the fields of a process's `stat` after its name. The name stands in parentheses and may contain
/// any character.
fn fields(stat: &str) -> std::str::SplitWhitespace<'_> {
    stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace()
}

/// Returns the start of a process in clock ticks, from field 22 of its `stat`.
fn started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    fields(&stat).nth(19)?.parse().ok()
}
