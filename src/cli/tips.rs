//! Tips for an argument that the command line does not know.

use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::grammar;
use crate::output::frame::Format;
use crate::output::movie::MovieKind;

/// Most commands that a tip names.
const MOST_COMMANDS: usize = 3;

/// Replaces clap's tip to write an unknown option as a value, which only leads to the next refusal, by one
/// that leads to what works, if there is one.
pub fn with_tips(mut e: clap::Error) -> clap::Error {
    let unknown = match e.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(unknown)) if e.kind() == ErrorKind::UnknownArgument => unknown.clone(),
        _ => return e,
    };
    let mut tips = match e.remove(ContextKind::Suggested) {
        Some(ContextValue::StyledStrs(tips)) => tips,
        _ => Vec::new(),
    };
    tips.retain(|tip| !tip.to_string().contains(" as a value, use "));
    let given: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let own = match unknown.strip_prefix("--") {
        Some(option) => elsewhere(option).map(|tip| match given.get(1).map(String::as_str) {
            Some("farm") if tip.ends_with(" taki batch") => format!("{tip}: write it after --"),
            _ => tip,
        }),
        None => setting(&unknown, &given).or_else(|| output(&unknown, &given)),
    };
    if let Some(own) = own {
        // An option of the same name is better than one of a similar name.
        e.remove(ContextKind::SuggestedArg);
        tips.insert(0, own.into());
    }
    if !tips.is_empty() {
        e.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
    }
    e
}

/// Names the commands that have an option of this name.
fn elsewhere(option: &str) -> Option<String> {
    fn add(command: &clap::Command, name: &str, option: &str, names: &mut Vec<String>) {
        if command.get_arguments().any(|arg| arg.get_long() == Some(option)) {
            names.push(name.to_owned());
        }
        for own in command.get_subcommands() {
            add(own, &format!("{name} {}", own.get_name()), option, names);
        }
    }
    let mut names = Vec::new();
    add(&grammar(), "taki", option, &mut names);
    let few = (1..=MOST_COMMANDS).contains(&names.len());
    few.then(|| format!("--{option} belongs to {}", names.join(" and ")))
}

/// The setting that was written with a space, as in `--set h 1.2`.
fn setting(unknown: &str, given: &[String]) -> Option<String> {
    (3..given.len()).filter(|&at| given[at] == unknown).find_map(|at| {
        let option = Some(given[at - 2].as_str()).filter(|word| ["--set", "--sweep"].contains(word))?;
        let name = given[at - 1].trim_end_matches('=');
        let value = match unknown {
            "=" => given.get(at + 1)?,
            value => value.trim_start_matches('='),
        };
        (!name.contains('=')).then(|| format!("to set it, use {option} {name}={value}"))
    })
}

/// The output that was written without -o.
fn output(unknown: &str, given: &[String]) -> Option<String> {
    let path = std::path::Path::new(unknown);
    let written = match given.get(1)?.as_str() {
        "render" => Format::of(path).is_some(),
        "batch" => Format::of(path).is_some() || MovieKind::of(path).is_some(),
        "volume" => path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npz")),
        _ => false,
    };
    written.then(|| format!("to write it, use -o {unknown}"))
}
