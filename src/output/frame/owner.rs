//! Who writes a file: which process on which machine, and whether it still lives.

use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

/// A process, told from every other on any machine that shares a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// The machine's name, for people.
    pub host: String,
    /// Tells machines, their starts and containers apart where names do not: CRC-32 of name, boot and
    /// process namespace, in hex.
    pub machine: String,
    /// Number of the process on that machine.
    pub pid: u32,
    /// When it started, in the system's clock ticks since the machine's start; 0 where that is not known.
    pub started: u64,
}

/// What is known of another process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Life {
    /// It runs.
    Alive,
    /// It has ended.
    Dead,
    /// It is, or was, on another machine.
    Elsewhere,
}

impl Owner {
    /// This process.
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

    /// Whether the process still runs.
    pub fn life(&self) -> Life {
        match life_of(&self.machine, self.pid) {
            // Another process may have the number by now.
            Life::Alive if self.started != 0 && started(self.pid).is_some_and(|s| s != self.started) => {
                Life::Dead
            }
            life => life,
        }
    }
}

/// Whether process `pid` of a machine runs. When in doubt it does.
pub fn life_of(machine: &str, pid: u32) -> Life {
    let proc = Path::new("/proc");
    if machine != Owner::me().machine {
        Life::Elsewhere
    } else if !proc.join("self").exists() {
        Life::Alive
    } else {
        match std::fs::read_to_string(proc.join(format!("{pid}/stat"))) {
            // A zombie has ended; nobody has asked for its exit code yet.
            Ok(stat) if matches!(fields(&stat).next(), Some("Z" | "X")) => Life::Dead,
            Ok(_) => Life::Alive,
            Err(_) if proc.join(pid.to_string()).exists() => Life::Alive,
            Err(_) => Life::Dead,
        }
    }
}

/// The fields of a process's `stat` after its name, which stands in parentheses and may hold any character.
fn fields(stat: &str) -> std::str::SplitWhitespace<'_> {
    stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace()
}

/// When a process started, by field 22 of its `stat`.
fn started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    fields(&stat).nth(19)?.parse().ok()
}
