//! Reading of scene files, their bases and `--set`. The TOML is checked strictly, and every error names its
//! line.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::names::NAMED;
use super::names::{check_names, full_key, in_table_of_water, likeliest, unknown_key};
use super::param::{Kind, PARAMS, Param, key_of_volume};
use super::print::quoted;
use super::remove::{self, REMOVE};
use super::slips::{foreign_signs_at, given_twice, not_allowed, slip_at};
use super::typed::{parse_for, parse_value};
use super::value::{Key, Place, Raw, Values};
use super::{Limits, build, meshes, presets, quads, volumes};
use crate::model::{folded_name, is_model};
use crate::output::frame::{folder_of, scene_in};
use crate::util::error::{Error, Result};

/// Largest scene file, bytes. A larger one holds millions of numbers and is a mistake.
const MAX_BYTES: u64 = 16 << 20;
/// Largest number of quads in a scene. More would not fit into the quad buffer of a small GPU.
pub const MAX_QUADS: usize = 65_536;
/// Version of the scene format in which a file that names no base leaves the paper's values as they are.
/// Printed scenes have it, because they leave nothing out.
pub const VERSION: i64 = 1;
/// Newest version that this program reads: a file that names no base begins with [`LOOK`].
const NEWEST: i64 = 2;
/// Base of files of the newest version.
const LOOK: &str = "water";

/// A scene to which a mesh is added.
const AROUND_MESH: &str = "version = 1
[environment]
kind = \"sky\"
[image]
width = 960
height = 540
samples = 4
";

/// Name that stands for a scene on stdin.
pub const STDIN: &str = "-";

/// Key of the list of keyframed parameters.
const TRACKS: &str = "animate.tracks";

/// The text of a scene, with its name and the folder in which its references resolve.
pub struct Source {
    /// Name for messages and for the default output.
    pub name: String,
    /// Origin of the text, for messages.
    pub origin: String,
    /// Folder of the scene file; the current folder for a preset.
    pub folder: PathBuf,
    /// TOML of the scene.
    pub text: String,
}

impl Source {
    /// Finds a preset of this name, otherwise a scene file at this path, or the scene of the picture there.
    /// `-` stands for stdin.
    ///
    /// # Errors
    /// [`Error::Input`] where there is neither, or the file is no regular file, too large or not UTF-8;
    /// [`Error::Io`] where it cannot be read.
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
        if scene == Path::new(STDIN) {
            return Source::stdin();
        }
        let meta = std::fs::metadata(scene).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => {
                let given = scene.display().to_string();
                let near = presets::nearest(&given).map(str::to_owned).or_else(|| nearest_file(scene));
                let near = near.map(|near| format!("did you mean {near}?"));
                let what = format!("no preset and no file is named {given}");
                Error::input(what, near.unwrap_or_else(presets::listed))
            }
            _ => Error::read(scene, e),
        })?;
        if !meta.is_file() {
            return Err(Error::input(
                format!("{} is not a regular file", scene.display()),
                "give a scene file or a preset",
            ));
        }
        if is_model(scene) {
            let file = scene.display();
            return Err(Error::input(
                format!("{file} is a mesh, not a scene"),
                format!(
                    "a scene shows it with the lines [meshes.NAME] and file = {:?}, a path from the scene's \
                     folder; {}drop it on the viewer",
                    scene.file_name().unwrap_or_default().to_string_lossy(),
                    if cfg!(feature = "viewer") {
                        format!("or open it with taki view {file}, or ")
                    } else {
                        "or ".into()
                    }
                ),
            ));
        }
        if let Some(text) = scene_in(scene) {
            return Source::picture(scene, text);
        }
        if meta.len() > MAX_BYTES {
            return Err(Error::input(
                format!("{} has {} bytes", scene.display(), meta.len()),
                format!("a scene file has at most {MAX_BYTES}"),
            ));
        }
        let bytes = std::fs::read(scene).map_err(|e| Error::read(scene, e))?;
        let text = utf8(bytes, &scene.display().to_string())?;
        Ok(Source::file(scene, text))
    }

    /// Makes a scene around the mesh of a file: its text shows the mesh under a clear sky.
    ///
    /// # Errors
    /// [`Error::Input`] where the file's name is not UTF-8.
    pub fn around_mesh(path: &Path, name: &str) -> Result<Source> {
        let Some(file) = path.file_name().and_then(|name| name.to_str()) else {
            return Err(Error::input(format!("{} is not UTF-8", path.display()), "rename the file"));
        };
        let mesh = format!("[meshes.{}]\nfile = {}\n", quoted(name), serde_json::json!(file));
        Ok(Source::file(path, AROUND_MESH.to_owned() + &mesh))
    }

    fn file(path: &Path, text: String) -> Source {
        Source {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            origin: path.display().to_string(),
            folder: folder_of(path).to_owned(),
            text,
        }
    }

    /// Returns the scene of a picture, whose `text` was read.
    fn picture(path: &Path, text: Result<Option<String>>) -> Result<Source> {
        let fix = "a picture in place of a scene is one that taki wrote";
        match text {
            Ok(Some(text)) => Ok(Source::file(path, text)),
            Ok(None) => Err(Error::input(format!("{} holds no scene", path.display()), fix)),
            Err(Error::Input { what, .. }) => Err(Error::input(what, fix)),
            Err(e) => Err(e),
        }
    }

    /// Returns the scene on stdin. Its references resolve in the current folder.
    fn stdin() -> Result<Source> {
        let name = "stdin";
        let bytes = read_stdin().as_ref().map_err(|e| Error::read(Path::new(name), e))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(Error::input(
                format!("{name} has more than {MAX_BYTES} bytes"),
                "a scene file has no more",
            ));
        }
        let text = utf8(bytes.clone(), name)?;
        Ok(Source { name: name.into(), origin: name.into(), folder: PathBuf::from("."), text })
    }

    /// Parses the text. Its values override those of its base.
    ///
    /// # Errors
    /// [`Error::Input`] with the line of the fault.
    pub fn values(&self) -> Result<Values> {
        let mut values = self.values_at_depth(0)?;
        if self.origin == format!("preset {}", self.name) {
            values.come_from_base();
        }
        Ok(values)
    }

    fn values_at_depth(&self, depth: u32) -> Result<Values> {
        let newlines = self.text.match_indices('\n').map(|(i, _)| i).collect();
        let mut file = File { source: self, newlines, base: "" };
        let root = DeTable::parse(&self.text).map_err(|e| {
            let at = e.span().map_or(0, |s| s.start);
            if let Some((start, line, advice)) = foreign_signs_at(&self.text, at) {
                return Error::input(format!("{}: {line}", file.place(start).0), advice);
            }
            if let Some((key, value, advice)) = slip_at(&self.text, at)
                && let Some(param) = Param::find(&key)
            {
                return not_allowed(&file.place(at), &key, &value, param, Some(advice));
            }
            let message = e.message().lines().collect::<Vec<_>>().join(", ");
            let fix = given_twice(&self.text, at, &message, |byte| file.line(byte))
                .unwrap_or_else(|| "a scene file is TOML, see docs/scenes-and-files.md".into());
            Error::input(format!("{}: {message}", file.place(at).0), fix)
        })?;
        let root = root.into_inner();
        let version = file.version(&root)?;
        let own = root.get("base").map(|base| (base.get_ref().as_str().unwrap_or_default(), base.span()));
        let base = own.or((version == NEWEST).then_some((LOOK, 0..0)));
        let mut values = match base {
            None => Values::default(),
            Some((given, span)) => {
                let at = file.place(span.start);
                let Some((name, text)) = presets::base(given).map(|text| (given, text)) else {
                    return Err(Error::input(
                        format!("{}: base is no preset", at.0),
                        match presets::nearest(given) {
                            _ if given.contains(['.', '/']) => {
                                format!("a base is no file; {}", presets::listed_bases())
                            }
                            Some(near) => format!("did you mean {near}?"),
                            None => presets::listed_bases(),
                        },
                    ));
                };
                if depth > 8 {
                    return Err(Error::input(format!("{}: the bases form a circle", at.0), "remove one"));
                }
                let base = Source {
                    name: name.into(),
                    origin: format!("preset {name}"),
                    folder: self.folder.clone(),
                    text: text.into(),
                };
                file.base = name;
                let mut values = base.values_at_depth(depth + 1)?;
                values.come_from_base();
                values
            }
        };
        if let Some(list) = root.get(REMOVE) {
            file.remove(list, &mut values)?;
        }
        for (key, value) in root.iter() {
            match key.get_ref().as_ref() {
                "version" | "base" | REMOVE => {}
                name => file.section(name, value, &mut values)?,
            }
        }
        file.check_parts(&root, &values)?;
        Ok(values)
    }
}

/// Returns the scene file whose name is most like that of a path that does not exist, in the same folder.
fn nearest_file(path: &Path) -> Option<String> {
    let files = std::fs::read_dir(folder_of(path)).ok()?.flatten().map(|entry| entry.file_name());
    let names: Vec<String> = files.filter_map(|name| name.into_string().ok()).collect();
    let scenes = names.iter().map(String::as_str).filter(|name| name.ends_with(".toml"));
    let near = likeliest(path.file_name()?.to_str()?, scenes)?;
    Some(path.with_file_name(near).display().to_string())
}

/// Reads stdin to its end, or to the size of the largest scene. Some commands read their scene twice, but
/// stdin can be read only once, so its bytes are kept.
pub fn read_stdin() -> &'static std::result::Result<Vec<u8>, String> {
    static BYTES: OnceLock<std::result::Result<Vec<u8>, String>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let mut bytes = Vec::new();
        let read = std::io::stdin().lock().take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map(|_| bytes).map_err(|e| e.to_string())
    })
}

/// Decodes the text of a scene.
fn utf8(bytes: Vec<u8>, origin: &str) -> Result<String> {
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::input(format!("{origin}: byte {at} is not UTF-8"), "a scene file is UTF-8 text")
    })
}

struct File<'a> {
    source: &'a Source,
    /// Offsets of the line ends. Every value needs its line number; a search avoids reading the text again
    /// for each.
    newlines: Vec<usize>,
    /// Name of the base; empty without one.
    base: &'a str,
}

impl File<'_> {
    fn place(&self, byte: usize) -> Place {
        Place(format!("{}:{}", self.source.origin, self.line(byte)))
    }

    /// Returns the number of the line that holds a byte.
    fn line(&self, byte: usize) -> usize {
        1 + self.newlines.partition_point(|&end| end < byte)
    }

    /// Returns the version of the file.
    fn version(&self, root: &DeTable) -> Result<i64> {
        let Some(value) = root.get("version") else {
            return Err(Error::input(
                format!("{}: the scene has no version", self.source.origin),
                format!("add the line `version = {NEWEST}` at the top"),
            ));
        };
        let at = self.place(value.span().start);
        match raw(value.get_ref()) {
            Raw::Int(version @ VERSION..=NEWEST) => Ok(version),
            Raw::Int(newer) if newer > NEWEST => Err(Error::input(
                format!("{}: scene version {newer} is newer than {NEWEST}, the newest this taki knows", at.0),
                format!("it needs taki ≥ {newer}.0, this is {}", env!("CARGO_PKG_VERSION")),
            )),
            _ => Err(Error::input(
                format!("{}: not a scene version", at.0),
                format!("write `version = {NEWEST}`"),
            )),
        }
    }

    /// Removes the parts of the base that the file does without.
    fn remove(&self, list: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        let place = self.place(list.span().start);
        if self.base.is_empty() {
            return Err(Error::input(
                format!("{}: {REMOVE} without a base, from which it would remove", place.0),
                format!("add a line such as base = \"waterfall\", or leave {REMOVE} out"),
            ));
        }
        let texts = remove::texts(&raw(list.get_ref())).ok_or_else(|| {
            Error::input(
                format!("{}: {REMOVE} is a list of names", place.0),
                format!("write {REMOVE} = [\"rocks.wall\", \"pools\"]"),
            )
        })?;
        let items = match list.get_ref() {
            DeValue::Array(items) => items.iter().map(|item| self.place(item.span().start)).collect(),
            _ => vec![place],
        };
        texts.iter().zip(items).try_for_each(|(text, place)| values.remove_all(text, &place))
    }

    fn section(&self, name: &str, value: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        match value.get_ref() {
            // The scene's own quads replace all quads of its base.
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
                format!("{}: quads must be a list", self.place(value.span().start).0),
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
                if meshes::is_materials(path) {
                    return self.materials_of_mesh(path, table, values);
                }
                let mut keys = table.iter();
                keys.try_for_each(|(key, value)| {
                    self.keys(&format!("{path}.{}", key.get_ref()), value, values)
                })
            }
            // The scene's own tracks replace all tracks of its base, as its quads do.
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

    /// Reads what the materials of a mesh's file become. Names that have underscores in place of blanks and
    /// dots go first, as they take the place of the others.
    fn materials_of_mesh(&self, path: &str, table: &DeTable, values: &mut Values) -> Result<()> {
        let mut names: Vec<_> = table.iter().map(|(key, value)| (key.get_ref(), value)).collect();
        names.sort_by_key(|(name, _)| folded_name(name) != **name);
        names.into_iter().try_for_each(|(name, value)| {
            self.keys(&format!("{path}.{}", meshes::in_key(name)), value, values)
        })
    }

    /// Checks that the parts of this file have the corners or points that they need, and a material that
    /// exists. A part without may be one of the base, misspelt.
    fn check_parts(&self, root: &DeTable, values: &Values) -> Result<()> {
        let materials = values.names("materials");
        for (section, need) in [
            ("quads", "corners"),
            ("rocks", "corners"),
            ("pools", "corners"),
            ("sheets", "points"),
            ("splashes", ""),
            ("meshes", "file"),
            ("boxes", ""),
            ("materials", ""),
        ] {
            let parts: Vec<(String, usize, &Spanned<DeValue>)> = match root.get(section).map(Spanned::get_ref)
            {
                Some(DeValue::Table(parts)) => parts
                    .iter()
                    .map(|(name, part)| (name.get_ref().to_string(), name.span().start, part))
                    .collect(),
                Some(DeValue::Array(parts)) => parts
                    .iter()
                    .enumerate()
                    .map(|(i, part)| (i.to_string(), part.span().start, part))
                    .collect(),
                _ => Vec::new(),
            };
            for (name, at, part) in parts {
                let path = format!("{section}.{name}");
                let has = || match need {
                    "points" => !values.series(&format!("{path}.points")).is_empty(),
                    need => values.is_set(&format!("{path}.{need}")),
                };
                if !need.is_empty() && !has() {
                    return Err(without(&path, need, values, &self.place(at)));
                }
                let volume = part.get_ref().as_table().filter(|_| ["boxes", "materials"].contains(&section));
                if let Some(volume) = volume.and_then(|part| part.get("volume"))
                    && let Some(name) = volume.get_ref().as_str()
                    && let Some(fix) = volumes::unknown(values, name)
                {
                    let place = self.place(volume.span().start).0;
                    let what = format!("{place}: {path}.volume = {name:?}: the scene has no such volume");
                    return Err(Error::input(what, fix));
                }
                let material = part.get_ref().as_table().and_then(|part| part.get("material"));
                let mut named: Vec<_> =
                    material.into_iter().map(|m| (format!("{path}.material"), m)).collect();
                if section == "meshes"
                    && let Some(own) = part.get_ref().as_table().and_then(|part| part.get("materials"))
                    && let Some(own) = own.get_ref().as_table()
                {
                    let key = |name: &str| format!("{path}.materials.{name}");
                    named.extend(own.iter().map(|(name, material)| (key(name.get_ref()), material)));
                }
                for (key, material) in named {
                    if let Some(name) = material.get_ref().as_str()
                        && !(section == "meshes" && meshes::is_word(name))
                        && let Some(fix) = quads::unknown_material(name, &materials)
                    {
                        let place = self.place(material.span().start).0;
                        let what = format!("{place}: {key} = {name:?}: the scene has no such material");
                        let words =
                            if section == "meshes" { "; a part can also be opaque, or none" } else { "" };
                        return Err(Error::input(what, fix + words));
                    }
                }
            }
        }
        Ok(())
    }

    /// Reads a table without keys: a light or material with every default, or a mistake.
    fn empty(&self, path: &str, value: &Spanned<DeValue>, values: &mut Values) -> Result<()> {
        let section = path.split('.').next().unwrap_or(path);
        let key = match section {
            "lights" => format!("{path}.kind"),
            "materials" => format!("{path}.thickness"),
            "sheets" => format!("{path}.points"),
            "splashes" => format!("{path}.from"),
            "volumes" => format!("{path}.nx"),
            "meshes" => format!("{path}.file"),
            "boxes" => format!("{path}.volume"),
            _ => format!("{path}.corners"),
        };
        let place = self.place(value.span().start);
        if let Some((what, fix)) = in_table_of_water(path) {
            return Err(Error::input(format!("{}: {what}", place.0), fix));
        }
        // No key of this file can lie under an empty table, so what is there belongs to the base.
        if NAMED.contains(&path) && values.has_under(path) {
            return Err(Error::input(
                format!("{}: the empty {path} removes nothing of the base", place.0),
                format!("to remove all {path}, write {REMOVE} = [\"{path}\"] above the first table"),
            ));
        }
        match Param::find(&key).map(|param| param.kind) {
            Some(_) if values.is_set(&key) => Ok(()),
            Some(Kind::Corners) => Err(without(path, "corners", values, &place)),
            Some(_) if section == "meshes" => Err(without(path, "file", values, &place)),
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

/// The error for a part without the corners or points that it needs. A part of the base may be meant.
fn without(path: &str, need: &str, values: &Values, place: &Place) -> Error {
    let (section, name) = path.split_once('.').unwrap_or((path, ""));
    let others = values.names(section);
    let near = likeliest(name, others.iter().map(String::as_str).filter(|other| *other != name));
    let near = near.filter(|_| section != "quads");
    let points = match section {
        "sheets" => "points along the flow, two or more",
        "pools" => "four points at one height",
        "meshes" => "a file of glTF (.glb, .gltf) or OBJ",
        _ => "four points A, B, C, D",
    };
    let fix = match near {
        Some(near) => format!("did you mean [{section}.{near}]? Otherwise give {path}.{need} {points}"),
        None => format!("give {path}.{need} {points}"),
    };
    Error::input(format!("{}: {path} has no {need}", place.0), fix)
}

/// Converts a TOML value, without its positions.
pub fn raw(value: &DeValue) -> Raw {
    match value {
        DeValue::String(s) => Raw::Text(s.to_string()),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix())
            .map_or(Raw::Other("a whole number too large"), Raw::Int),
        DeValue::Float(f) => f.as_str().parse().map_or(Raw::Other("a number out of range"), Raw::Float),
        DeValue::Array(list) => Raw::List(list.iter().map(|v| raw(v.get_ref())).collect()),
        DeValue::Boolean(on) => Raw::Switch(*on),
        DeValue::Datetime(_) => Raw::Other("a date"),
        DeValue::Table(_) => Raw::Other("a table"),
    }
}

/// Returns the keys of a scene whose values are paths.
pub fn reference_keys(values: &Values) -> Vec<String> {
    let of_volume = |name: &String| ["volume.file", "volume.source"].map(|key| key_of_volume(name, key));
    let files = volumes::names(values).iter().flat_map(of_volume).collect::<Vec<_>>().into_iter();
    let meshes = values.names("meshes").into_iter().map(|name| format!("meshes.{name}.file"));
    files.chain(["environment.file".into()]).chain(meshes).collect()
}

/// Whether a `--set` gives this reference. Paths from the command line are trusted and relative to the
/// current folder.
fn set_by_hand(values: &Values, sets: &[String], reference: &str) -> bool {
    let full = |setting: &String| full_key(split(setting)?.0, values).ok();
    sets.iter().filter_map(full).any(|key| key == reference)
}

/// Whether a `--set` gives any reference of a scene.
pub fn has_reference_by_hand(values: &Values, sets: &[String]) -> bool {
    reference_keys(values).iter().any(|key| set_by_hand(values, sets, key))
}

/// Applies `--set`s in order. Returns the folder in which the scene's references resolve, or `None` if all of
/// them may be trusted: once a `--set` gives a reference, those of the scene itself are resolved here.
///
/// # Errors
/// The errors of [`apply_set`] and [`build::resolve`].
pub fn apply_sets(
    values: &mut Values,
    sets: &[String],
    source: &Source,
    limits: &Limits,
) -> Result<Option<PathBuf>> {
    if let Some(missing) = limits.allow_paths.iter().find(|path| !path.is_dir()) {
        return Err(Error::input(
            format!("--allow-path {}: there is no folder of this name", missing.display()),
            "check the path, which starts in the current folder",
        ));
    }
    sets.iter().try_for_each(|setting| apply_set(values, setting))?;
    if !has_reference_by_hand(values, sets) {
        return Ok(Some(source.folder.clone()));
    }
    for key in reference_keys(values) {
        if !set_by_hand(values, sets, &key) {
            build::resolve(values, &key, Some(&source.folder), &limits.allow_paths)?;
        }
    }
    Ok(None)
}

/// Applies one `--set key=value`. The last part of the key is enough where it means one parameter. The value
/// is TOML, in which a point or colour needs no brackets; text that is not TOML is taken as a word. The key
/// `remove` takes names of parts, which are removed.
///
/// # Errors
/// [`Error::Usage`] where there is no `=` or the last part of a key means several parameters,
/// [`Error::Input`] where the table has no such key or does not allow the value, or the scene has no such
/// name.
pub fn apply_set(values: &mut Values, setting: &str) -> Result<()> {
    let Some((key, text)) = split(setting) else {
        return Err(Error::Usage(format!("--set {setting} has no value; write --set KEY=VALUE")));
    };
    let key = &meshes::unquoted(key);
    if key == REMOVE {
        let place = Place(format!("--{REMOVE}"));
        let texts = remove::texts(&parse_value(text)).ok_or_else(|| {
            Error::Usage(format!("--set {setting}: give names, such as {REMOVE}=rocks.wall,pools"))
        })?;
        return texts.iter().try_for_each(|text| values.remove_all(text, &place));
    }
    let key = full_key(key, values).map_err(|why| Error::Usage(format!("--set {setting}: {why}")))?;
    let place = Place("--set".into());
    let Some(param) = Param::find(&key) else {
        return Err(unknown_key(&key, values, &place));
    };
    check_names(values, &key).map_err(|(what, fix)| Error::input(format!("--set {key}: {what}"), fix))?;
    values.set(&key, &parse_for(param, text), &place)
}

/// Splits a setting into its key and its value; `None` without a `=`.
pub(super) fn split(setting: &str) -> Option<(&str, &str)> {
    // A name in the key may contain an = itself. The key ends at the first = that makes it a known one.
    let splits = || setting.match_indices('=').map(|(at, _)| (&setting[..at], &setting[at + 1..]));
    let known = splits().find(|(key, _)| Param::find(key.trim()).is_some());
    known.or(splits().next()).map(|(key, text)| (key.trim(), text.trim()))
}
