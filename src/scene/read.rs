//! Scene files: strict TOML with the line of every fault, bases, and `--set`.

use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::param::{Kind, PARAMS, Param};
use super::value::{Key, Place, Raw, Values};
use super::{Limits, build, presets};
use crate::util::error::{Error, Result};

/// Scene files larger than this are refused: four million numbers are no scene, but a mistake.
const MAX_BYTES: u64 = 16 << 20;
/// More quads than this would not fit the quad buffer of a small GPU.
pub const MAX_QUADS: usize = 65_536;
/// The version of the scene format this program writes and reads.
pub const VERSION: i64 = 1;

/// The list of keyframed parameters.
const TRACKS: &str = "animate.tracks";

/// The sections whose second key part is a name the scene chooses.
const NAMED: [&str; 6] = ["lights", "materials", "pools", "rocks", "sheets", "splashes"];

/// A scene as text, with its name and the folder its references resolve in.
pub struct Source {
    /// Name for messages and for the default output.
    pub name: String,
    /// Where the text comes from, for messages.
    pub origin: String,
    /// The folder of a scene file; the current folder for a preset.
    pub folder: PathBuf,
    /// The TOML.
    pub text: String,
}

impl Source {
    /// A preset by its name, else a scene file.
    pub fn find(scene: &Path) -> Result<Source> {
        if let Some(name) = scene.to_str()
            && let Some(text) = presets::text(name)
        {
            return Ok(Source {
                name: name.into(),
                origin: format!("preset {name}"),
                folder: PathBuf::from("."),
                text: text.into(),
            });
        }
        let meta = std::fs::metadata(scene).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                let given = scene.display().to_string();
                let near = presets::names().max_by(|a, b| {
                    strsim::jaro_winkler(a, &given).total_cmp(&strsim::jaro_winkler(b, &given))
                });
                let near = near.filter(|n| strsim::jaro_winkler(n, &given) > 0.7);
                Error::input(
                    format!("no preset and no file is named {given}"),
                    match near {
                        Some(n) => format!("did you mean {n}?"),
                        None => format!("presets: {}", presets::names().collect::<Vec<_>>().join(", ")),
                    },
                )
            }
            _ => Error::read(scene, e),
        })?;
        if !meta.is_file() {
            return Err(Error::input(
                format!("{} is not a regular file", scene.display()),
                "give a scene file or a preset",
            ));
        }
        if meta.len() > MAX_BYTES {
            return Err(Error::input(
                format!("{} has {} bytes", scene.display(), meta.len()),
                format!("a scene file has at most {MAX_BYTES}"),
            ));
        }
        let bytes = std::fs::read(scene).map_err(|e| Error::read(scene, e))?;
        let text = String::from_utf8(bytes).map_err(|e| {
            Error::input(
                format!("{}: byte {} is not UTF-8", scene.display(), e.utf8_error().valid_up_to()),
                "a scene file is UTF-8 text",
            )
        })?;
        Ok(Source {
            name: scene.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            origin: scene.display().to_string(),
            folder: scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned(),
            text,
        })
    }

    /// Parses the text over its bases.
    pub fn values(&self) -> Result<Values> {
        self.values_at_depth(0)
    }

    fn values_at_depth(&self, depth: u32) -> Result<Values> {
        let file = File { source: self, newlines: self.text.match_indices('\n').map(|(i, _)| i).collect() };
        let root = DeTable::parse(&self.text).map_err(|e| {
            let at = e.span().map_or(0, |s| s.start);
            let message = e.message().lines().collect::<Vec<_>>().join(", ");
            Error::input(
                format!("{}: {message}", file.place(at).0),
                "a scene file is TOML, see docs/scenes-and-files.md",
            )
        })?;
        let root = root.into_inner();
        file.version(&root)?;
        let mut values = match root.get("base") {
            None => Values::default(),
            Some(base) => {
                let at = file.place(base.span().start);
                let text = base.get_ref().as_str().and_then(|name| Some((name, presets::text(name)?)));
                let Some((name, text)) = text else {
                    return Err(Error::input(
                        format!("{}: base is no preset", at.0),
                        format!("presets: {}", presets::names().collect::<Vec<_>>().join(", ")),
                    ));
                };
                if depth > 8 {
                    return Err(Error::input(format!("{}: bases go round in a circle", at.0), "remove one"));
                }
                let base = Source {
                    name: name.into(),
                    origin: format!("preset {name}"),
                    folder: self.folder.clone(),
                    text: text.into(),
                };
                base.values_at_depth(depth + 1)?
            }
        };
        for (key, value) in root.iter() {
            match key.get_ref().as_ref() {
                "version" | "base" => {}
                name => file.section(name, value, &mut values)?,
            }
        }
        Ok(values)
    }
}

struct File<'a> {
    source: &'a Source,
    /// Where the lines end: every value has its place, so finding one must not read the text again.
    newlines: Vec<usize>,
}

impl File<'_> {
    fn place(&self, byte: usize) -> Place {
        let line = 1 + self.newlines.partition_point(|&end| end < byte);
        Place(format!("{}:{line}", self.source.origin))
    }

    fn version(&self, root: &DeTable) -> Result<()> {
        let Some(value) = root.get("version") else {
            return Err(Error::input(
                format!("{}: the scene has no version", self.source.origin),
                format!("add the line `version = {VERSION}` at the top"),
            ));
        };
        let at = self.place(value.span().start);
        match raw(value.get_ref()) {
            Raw::Int(VERSION) => Ok(()),
            Raw::Int(newer) if newer > VERSION => Err(Error::input(
                format!(
                    "{}: scene version {newer} is newer than {VERSION}, the newest this taki knows",
                    at.0
                ),
                format!("it needs taki ≥ {newer}.0, this is {}", env!("CARGO_PKG_VERSION")),
            )),
            _ => Err(Error::input(
                format!("{}: not a scene version", at.0),
                format!("write `version = {VERSION}`"),
            )),
        }
    }

    fn section(&self, name: &str, value: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        match value.get_ref() {
            // A scene's own quads replace all of its base's.
            DeValue::Array(quads) if name == "quads" => {
                if quads.len() > MAX_QUADS {
                    return Err(Error::input(
                        format!("{}: {} quads", self.place(value.span().start).0, quads.len()),
                        format!("a scene has at most {MAX_QUADS}"),
                    ));
                }
                values.clear_under("quads");
                quads
                    .iter()
                    .enumerate()
                    .try_for_each(|(i, quad)| self.keys(&format!("quads.{i}"), quad, values))
            }
            _ if name == "quads" => Err(Error::input(
                format!("{}: quads is a list", self.place(value.span().start).0),
                "write [[quads]] before each",
            )),
            _ => self.keys(name, value, values),
        }
    }

    fn keys(&self, path: &str, value: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        match value.get_ref() {
            DeValue::Table(table) => {
                if table.is_empty() {
                    return self.empty(path, value, values);
                }
                table.iter().try_for_each(|(key, value)| {
                    self.keys(&format!("{path}.{}", key.get_ref()), value, values)
                })
            }
            // A scene's own tracks replace its base's, as its quads do.
            DeValue::Array(tracks) if path == TRACKS => {
                values.clear_under(TRACKS);
                tracks
                    .iter()
                    .enumerate()
                    .try_for_each(|(i, track)| self.keys(&format!("{TRACKS}.{i}"), track, values))
            }
            leaf => values.set(path, &raw(leaf), &self.place(value.span().start)),
        }
    }

    /// A table without keys: a light or material with every default, or a mistake.
    fn empty(&self, path: &str, value: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        let section = path.split('.').next().unwrap_or(path);
        let key = match section {
            "lights" => format!("{path}.kind"),
            "materials" => format!("{path}.thickness"),
            "sheets" => format!("{path}.points"),
            "splashes" => format!("{path}.from"),
            _ => format!("{path}.corners"),
        };
        let place = self.place(value.span().start);
        match Param::find(&key).map(|param| param.kind) {
            Some(_) if values.is_set(&key) => Ok(()),
            Some(Kind::Corners) => Err(Error::input(
                format!("{}: {path} has no corners", place.0),
                format!("give {key} four points A, B, C, D"),
            )),
            Some(_) => {
                let default = values.get(&key);
                values.0.insert(Key::new(&key), default);
                Ok(())
            }
            None if PARAMS.iter().any(|param| param.key.split('.').next() == Some(path)) => Ok(()),
            None => values.set(path, &Raw::Other("a table"), &place),
        }
    }
}

/// A TOML value without its positions.
fn raw(value: &DeValue) -> Raw {
    match value {
        DeValue::String(s) => Raw::Text(s.to_string()),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix())
            .map_or(Raw::Other("a whole number too large"), Raw::Int),
        DeValue::Float(f) => f.as_str().parse().map_or(Raw::Other("a number out of range"), Raw::Float),
        DeValue::Array(list) => Raw::List(list.iter().map(|v| raw(v.get_ref())).collect()),
        DeValue::Boolean(_) => Raw::Other("a boolean"),
        DeValue::Datetime(_) => Raw::Other("a date"),
        DeValue::Table(_) => Raw::Other("a table"),
    }
}

/// The keys whose values are paths.
pub const REFERENCES: [&str; 2] = ["volume.file", "environment.file"];

/// Whether `--set`s name files: paths on the command line are the user's own word, relative to the current
/// folder.
pub fn set_by_hand(sets: &[String], reference: &str) -> bool {
    sets.iter().any(|s| s.split('=').next().is_some_and(|key| key.trim() == reference))
}

/// Applies `--set`s in order; the folder in which references of the scene resolve. None if all may be
/// trusted: then those of the scene's own were resolved.
pub fn apply_sets(
    values: &mut Values,
    sets: &[String],
    source: &Source,
    limits: &Limits,
) -> Result<Option<PathBuf>> {
    sets.iter().try_for_each(|setting| apply_set(values, setting))?;
    if !REFERENCES.iter().any(|key| set_by_hand(sets, key)) {
        return Ok(Some(source.folder.clone()));
    }
    let own = REFERENCES.iter().filter(|key| !set_by_hand(sets, key));
    own.into_iter()
        .try_for_each(|key| build::resolve(values, key, Some(&source.folder), &limits.allow_paths))?;
    Ok(None)
}

/// Applies one `--set key=value`. The value is TOML; what is not TOML is taken as a word.
pub fn apply_set(values: &mut Values, setting: &str) -> Result<()> {
    // A name in a key may hold an = of its own: the first one that ends a known key is meant.
    let splits = || setting.match_indices('=').map(|(at, _)| (&setting[..at], &setting[at + 1..]));
    let known = splits().find(|(key, _)| Param::find(key.trim()).is_some());
    let Some((key, text)) = known.or(splits().next()) else {
        return Err(Error::Usage(format!("--set {setting} has no value; write --set KEY=VALUE")));
    };
    let (key, text) = (key.trim(), text.trim());
    let parsed = parse_value(text);
    check_names(values, key).map_err(|(what, fix)| Error::input(format!("--set {key}: {what}"), fix))?;
    values.set(key, &parsed, &Place("--set".into()))
}

/// A value as `--set` takes it: TOML, else a word.
pub fn parse_value(text: &str) -> Raw {
    DeValue::parse(text).map_or_else(|_| Raw::Text(text.into()), |v| raw(v.get_ref()))
}

/// Names come from the scene: a misspelt one must not make a second light. The error is what is wrong and
/// what there is.
pub fn check_names(values: &Values, key: &str) -> std::result::Result<(), (String, String)> {
    let mut parts = key.split('.');
    let (Some(section), Some(name)) = (parts.next(), parts.next()) else { return Ok(()) };
    if !NAMED.contains(&section) && section != "quads" {
        return Ok(());
    }
    let mut names = values.names(section);
    if section == "materials" {
        for user in ["quads", "sheets", "splashes"] {
            names.extend(values.names(user).iter().map(|n| values.text(&format!("{user}.{n}.material"))));
        }
    }
    if names.iter().any(|n| n == name) {
        return Ok(());
    }
    names.sort_unstable();
    names.dedup();
    let known =
        if names.is_empty() { "there are none".into() } else { format!("there are: {}", names.join(", ")) };
    Err((format!("the scene has no {name} in {section}"), known))
}
