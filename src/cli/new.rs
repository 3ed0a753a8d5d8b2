//! `taki new`: writes a scene file to start from.

use std::path::{Path, PathBuf};

use clap::Args;

use super::terminal::{Terminal, say};
use crate::output::frame::Output;
use crate::util::error::{Error, Result};

/// The scene, with comments that explain it.
const SCENE: &str = include_str!("../../assets/new.toml");

#[derive(Args)]
pub struct NewArgs {
    /// Scene file to write, such as my.toml, or - to print the scene.
    file: PathBuf,
    /// Replaces an existing file.
    #[arg(long)]
    overwrite: bool,
}

pub fn run(args: &NewArgs, terminal: &Terminal) -> Result<()> {
    let path = &args.file;
    if path == Path::new("-") {
        return say(SCENE.trim_end());
    }
    let name = path.display();
    // A folder is refused where the file is opened.
    let is_folder = path.is_dir() || name.to_string().ends_with(std::path::is_separator);
    if !is_folder && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        // A version such as v1.2 has no extension that could be replaced.
        let replaced = path.extension().is_some_and(|e| e.to_string_lossy().chars().any(char::is_alphabetic));
        let toml = if replaced { path.with_extension("toml") } else { format!("{name}.toml").into() };
        let toml = toml.display();
        let what = format!("{name}: the name of a scene file ends with .toml; write taki new {toml}");
        return Err(Error::Usage(what));
    }
    if path.symlink_metadata().is_ok() && !is_folder && !args.overwrite {
        return Err(Error::CannotCreate {
            path: path.clone(),
            why: "the file exists".into(),
            fix: "choose another name, or replace the file with --overwrite".into(),
        });
    }
    Output::create(path)?.finish_with(SCENE.as_bytes())?;
    terminal.note(&format!("taki: wrote {name}; to render it: taki render {name}"));
    Ok(())
}
