//! The command line that renders the picture of a document.

use super::{Document, changed_keys};
use crate::scene::NAMED;
use crate::util::error::{Error, Result};

impl Document {
    /// Returns the command that renders this picture: the file or preset, one `--remove` per part that is
    /// gone, and one `--set` per change.
    ///
    /// # Errors
    /// If lights or other parts were added or renamed, because no option does that, or the scene has no
    /// file, as one from stdin or around a mesh.
    pub fn command_line(&self) -> Result<String> {
        let removed = self.removed()?;
        let Some(source) = &self.source else {
            return Err(Error::input(
                "a command line cannot name a scene that has no file",
                "save the scene, then copy the command line",
            ));
        };
        let scene = source.display().to_string();
        let mut words = vec!["taki".to_owned(), "render".into(), scene];
        for folder in self.folders_to_allow() {
            words.extend(["--allow-path".to_owned(), folder.display().to_string()]);
        }
        words.extend(removed.iter().flat_map(|name| ["--remove".to_owned(), name.clone()]));
        let mut left = self.saved.clone();
        removed.iter().for_each(|name| left.clear_under(name));
        for key in changed_keys(&left, &self.values) {
            words.push("--set".into());
            words.push(format!("{key}={}", self.values.get(&key).to_toml()));
        }
        let quoted = |word: &String| match shlex::try_quote(word) {
            Ok(word) => word.into_owned(),
            // Only NUL cannot be quoted, and no path or value contains one.
            Err(_) => String::new(),
        };
        Ok(words.iter().map(quoted).collect::<Vec<_>>().join(" "))
    }
    /// Returns the parts that were removed since the scene was opened or saved.
    fn removed(&self) -> Result<Vec<String>> {
        let mut removed = Vec::new();
        for section in NAMED {
            let (before, now) = (self.saved.names(section), self.values.names(section));
            if now.iter().any(|name| !before.contains(name)) {
                return Err(Error::input(
                    format!("a command line cannot add or rename {section}"),
                    "save the scene, then copy the command line",
                ));
            }
            if now.is_empty() && !before.is_empty() {
                removed.push(section.into());
                continue;
            }
            let gone = before.iter().filter(|name| !now.contains(name));
            removed.extend(gone.map(|name| format!("{section}.{name}")));
        }
        for list in ["quads", "animate.tracks"] {
            match (self.saved.names(list).len(), self.values.names(list).len()) {
                (before, now) if before == now => {}
                (_, 0) => removed.push(list.into()),
                _ => {
                    return Err(Error::input(
                        format!("a command line cannot change the number of {list}"),
                        "save the scene, then copy the command line",
                    ));
                }
            }
        }
        Ok(removed)
    }
}
