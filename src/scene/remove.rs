//! Removal of what a scene has from its base: rocks, lights and all else that has a name, or values that
//! then are the defaults.

use super::param::Param;
use super::value::{Place, Raw, Values};
use crate::util::error::{Error, Result};

/// Key of the list of removed parts, in scene files and for `--set`.
pub const REMOVE: &str = "remove";

/// Lists whose items have numbers instead of names.
pub(super) const NUMBERED: [&str; 2] = ["quads", "animate.tracks"];

/// Returns the texts that the value of [`REMOVE`] holds: one, or a list.
pub(super) fn texts(raw: &Raw) -> Option<Vec<String>> {
    match raw {
        Raw::Text(text) => Some(vec![text.clone()]),
        Raw::List(items) => {
            items.iter().map(|item| if let Raw::Text(t) = item { Some(t.clone()) } else { None }).collect()
        }
        _ => None,
    }
}

impl Values {
    /// Removes the part that `text` names, or several that commas separate.
    ///
    /// # Errors
    /// The errors of [`Values::remove`].
    pub(super) fn remove_all(&mut self, text: &str, place: &Place) -> Result<()> {
        // A name may contain a comma itself.
        if self.has_under(text.trim()) {
            return self.remove(text.trim(), place);
        }
        text.split(',').try_for_each(|name| self.remove(name.trim(), place))
    }

    /// Removes the part `name`: a section such as `rocks`, a part with a name such as `rocks.wall`, or a
    /// value, which then is the default.
    ///
    /// # Errors
    /// [`Error::Input`] where the scene has no such part, or it is an item of a list.
    fn remove(&mut self, name: &str, place: &Place) -> Result<()> {
        for list in NUMBERED {
            if name.strip_prefix(list).is_some_and(|rest| rest.starts_with('.')) {
                return Err(Error::input(
                    format!(
                        "{}: {name} cannot be removed alone, because the items after it are numbered",
                        place.0
                    ),
                    format!("remove {list}, and write those that stay"),
                ));
            }
        }
        if !self.has_under(name) {
            let fix = match Param::find(name) {
                Some(_) => "it has its default; leave it out".into(),
                None => self.removable(name),
            };
            return Err(Error::input(format!("{}: the scene has no {name:?} to remove", place.0), fix));
        }
        self.clear_under(name);
        Ok(())
    }

    /// Returns advice on a misspelt part.
    fn removable(&self, name: &str) -> String {
        let mut parts: Vec<String> = Vec::new();
        for key in self.0.keys().map(ToString::to_string) {
            parts.extend(key.match_indices('.').map(|(end, _)| key[..end].to_owned()));
            parts.push(key);
        }
        parts.sort_unstable();
        parts.dedup();
        let (low, last) =
            (name.to_lowercase(), |part: &str| part.rsplit('.').next().unwrap_or("").to_lowercase());
        let alike = |part: &str| {
            strsim::jaro_winkler(&low, &part.to_lowercase()).max(strsim::jaro_winkler(&low, &last(part)))
        };
        let near = parts.iter().max_by(|a, b| alike(a).total_cmp(&alike(b)));
        match near.filter(|part| alike(part) > 0.8) {
            Some(near) => format!("did you mean {near}?"),
            None => {
                let sections: Vec<&str> =
                    parts.iter().map(String::as_str).filter(|part| !part.contains('.')).collect();
                format!("there are {}", sections.join(", "))
            }
        }
    }
}
