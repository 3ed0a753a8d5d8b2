//! The parameter table: every number, choice, colour and file that a scene can set.
//!
//! The reader of scene files, `--set`, the printed scene, docs/parameters.md and the viewer's sliders all use
//! it. `src/scene/build.rs` puts the values into the types that need them.
//!
//! A `*` in a key stands for a name that the scene chooses, or for the number of a quad or track. The words
//! of a choice stand at its enum (see `src/util/words.rs`).

mod boxes;
mod ground;
mod light;
mod matter;
mod meshes;
mod picture;
mod place;
mod sheet;
mod skin;
mod splash;
mod trace;
mod volume;
mod volumes;

use std::collections::HashMap;
use std::sync::LazyLock;

use Cost::*;
use Kind::*;
pub use light::HAIR_COLOR;
pub(super) use meshes::MATERIAL as MESH_MATERIAL;
pub use volume::COLORS;
pub use volumes::{WATER, key_of_volume, split_volume_key};

/// Work that a change of a parameter causes in an interactive renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// The volume texture is built again from its curves.
    Volume,
    /// Existing data is packed or uploaded again.
    Upload,
    /// A few bytes of uniforms are written.
    Uniform,
}

impl Cost {
    /// Returns the word in tables and files.
    pub fn word(self) -> &'static str {
        match self {
            Volume => "volume",
            Upload => "upload",
            Uniform => "uniform",
        }
    }
}

/// Type, range and default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A float32: smallest, largest, default.
    Float(f64, f64, f64),
    /// A whole number: smallest, largest, default.
    Int(i64, i64, i64),
    /// One of the words; the first is the default.
    Choice(&'static [&'static str]),
    /// On or off: the default.
    Switch(bool),
    /// Linear RGB, each 0 to 10000.
    Color([f64; 3]),
    /// A point or direction, each component −1e7 to 1e7.
    Point([f64; 3]),
    /// A path or name; empty for none. The text is the default.
    Text(&'static str),
    /// Four points A, B, C, D, without a default.
    Corners,
    /// Frame numbers, each larger than the one before; empty by default.
    Frames,
    /// A list of numbers, of triples or of four corners, all of one kind; empty by default.
    Series,
}

/// One parameter.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Dotted key in the scene file and for `--set`.
    pub key: &'static str,
    /// Symbol in the paper, or empty.
    pub symbol: &'static str,
    /// Unit, or empty.
    pub unit: &'static str,
    /// Type, range and default.
    pub kind: Kind,
    /// Cost of a change.
    pub cost: Cost,
    /// Meaning; begins with a noun. Markdown, of which only backticks are used.
    pub doc: &'static str,
    /// Advice on when to change it, and in which direction; begins with a verb. Markdown as in `doc`.
    pub when: &'static str,
    /// Range of the slider, if it is not the whole allowed range.
    pub slider: Option<(f64, f64)>,
}

/// A part of the table with its own heading.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Heading.
    pub title: &'static str,
    /// Introduction of a few sentences. Markdown, of which only backticks are used.
    pub about: &'static str,
    /// Parameters of the group.
    pub params: &'static [Param],
}

/// Largest colour component.
pub const COLOR_MAX: f64 = 1.0e4;
/// Largest coordinate, metres.
pub const POINT_MAX: f64 = 1.0e7;
/// Largest number of keyframes in a track.
pub const MAX_KEYFRAMES: usize = 10_000;
/// Largest frame number.
pub const MAX_FRAME: i64 = 999_999_999;
/// Parameters that no scene has of itself, besides lists.
const OPTIONAL: [&str; 15] = [
    boxes::POSITION,
    boxes::SIZE,
    HAIR_COLOR,
    meshes::COLOR,
    meshes::MATERIAL,
    volume::ORIGIN,
    volume::ORIGIN_OF_OTHERS,
    COLORS[0],
    COLORS[1],
    COLORS[2],
    COLORS[3],
    "volumes.*.color",
    "volumes.*.color_2",
    "volumes.*.color_3",
    "volumes.*.color_4",
];
/// Longest line of text in docs/parameters.md, characters.
const COLUMNS: usize = 110;

/// Makes a parameter that still lacks its [`Param::doc`] and [`Param::when`].
const fn p(key: &'static str, symbol: &'static str, unit: &'static str, kind: Kind, cost: Cost) -> Param {
    Param { key, symbol, unit, kind, cost, doc: "", when: "", slider: None }
}

/// Groups of the table, in the order of the method.
pub const GROUPS: &[Group] = &[
    volume::CURVES,
    volume::VOLUME,
    matter::FUR,
    matter::CLOTH,
    matter::HAIR,
    matter::IMPORT,
    ground::MOUNTAIN,
    ground::GRAINS,
    skin::SKIN,
    volumes::VOLUMES,
    sheet::SHEETS,
    splash::SPLASHES,
    trace::MATERIALS_AND_QUADS,
    meshes::MESHES,
    boxes::BOXES,
    trace::TRACE,
    light::LIGHT,
    light::STRAND,
    light::HAIR,
    light::LIGHTS,
    place::ROCKS,
    place::POOLS,
    place::CAMERA,
    place::BACKGROUND_AND_HAZE,
    place::ENVIRONMENT_AND_SKY,
    picture::IMAGE,
    picture::ANIMATION,
];

/// All parameters, group by group.
pub const PARAMS: &[Param] = &joined();

const fn count() -> usize {
    let (mut sum, mut group) = (0, 0);
    while group < GROUPS.len() {
        sum += GROUPS[group].params.len();
        group += 1;
    }
    sum
}

/// Joins the groups. A group or parameter without its texts does not compile.
const fn joined() -> [Param; count()] {
    let mut all = [GROUPS[0].params[0]; count()];
    let (mut at, mut group) = (0, 0);
    while group < GROUPS.len() {
        let Group { title, about, params } = GROUPS[group];
        assert!(!title.is_empty() && !about.is_empty(), "a group without a title or an introduction");
        let mut i = 0;
        while i < params.len() {
            if params[i].doc.is_empty() || params[i].when.is_empty() {
                // The compiler shows the key; the panic of a constant cannot format more.
                panic!("{}", params[i].key);
            }
            all[at] = params[i];
            (at, i) = (at + 1, i + 1);
        }
        group += 1;
    }
    all
}

/// Whether a concrete key fits a pattern in which `*` stands for any part that is not empty.
pub(super) fn matches(pattern: &str, key: &str) -> bool {
    let mut parts = key.split('.');
    pattern
        .split('.')
        .all(|want| parts.next().is_some_and(|got| if want == "*" { !got.is_empty() } else { want == got }))
        && parts.next().is_none()
}

/// The part of a key after its last dot. In one pattern alone, that of materials of meshes, it is `*`.
pub fn last_part(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

impl Param {
    const fn slider(self, low: f64, high: f64) -> Self {
        Param { slider: Some((low, high)), ..self }
    }

    const fn doc(self, doc: &'static str) -> Self {
        Param { doc, ..self }
    }

    const fn when(self, when: &'static str) -> Self {
        Param { when, ..self }
    }

    /// Whether the value is a list, which only a scene file or `--set` can give.
    pub fn is_list(&self) -> bool {
        matches!(self.kind, Frames | Series)
    }

    /// Returns the parameter of a concrete key such as `lights.sun.color`.
    pub fn find(key: &str) -> Option<&'static Param> {
        // Every row of the viewer asks in every frame, and the last part alone leaves few to compare.
        static BY_LAST_PART: LazyLock<HashMap<&str, Vec<&Param>>> = LazyLock::new(|| {
            let mut params: HashMap<&str, Vec<&Param>> = HashMap::new();
            for param in PARAMS {
                params.entry(last_part(param.key)).or_default().push(param);
            }
            params
        });
        let find = |last: &str| BY_LAST_PART.get(last)?.iter().find(|param| matches(param.key, key)).copied();
        find(last_part(key)).or_else(|| find("*"))
    }

    /// Whether the parameter has no value unless the scene gives one. A printed scene leaves it out then.
    pub fn is_optional(&self) -> bool {
        self.is_list() || OPTIONAL.contains(&self.key)
    }

    /// Formats the range for messages and tables.
    pub fn range(&self) -> String {
        match self.kind {
            Float(min, max, _) => format!("{} to {}", number(min), number(max)),
            Int(min, i64::MAX, _) => format!("{min} to 2^63−1"),
            Int(min, max, _) => format!("{min} to {max}"),
            Choice(words) => words.join(", "),
            Switch(_) => "true, false".into(),
            Color(_) => format!("three numbers, 0 to {}", number(COLOR_MAX)),
            Point(_) => format!("three numbers, ±{}", number(POINT_MAX)),
            Text(_) => "text".into(),
            Corners => format!("four points of three numbers, ±{}", number(POINT_MAX)),
            Frames => format!(
                "at most {MAX_KEYFRAMES} whole numbers, -{MAX_FRAME} to {MAX_FRAME}, each larger than the \
                 one before"
            ),
            Series => format!("at most {MAX_KEYFRAMES} values of one kind: numbers, triples or corners"),
        }
    }

    /// Formats the default for tables.
    pub fn default_words(&self) -> String {
        match self.kind {
            _ if OPTIONAL.contains(&self.key) => "none".into(),
            Float(.., d) => number(d),
            Int(.., d) => d.to_string(),
            Choice(words) => words[0].into(),
            Switch(on) => on.to_string(),
            Color(c) | Point(c) => format!("[{}, {}, {}]", number(c[0]), number(c[1]), number(c[2])),
            Text("") => "none".into(),
            Text(t) => t.into(),
            Corners => "required".into(),
            Frames | Series => "none".into(),
        }
    }

    /// Formats the parameter's row in [`parameters_markdown`].
    fn markdown_row(&self) -> String {
        let Param { key, symbol, unit, doc, when, .. } = self;
        let (default, range, cost) = (self.default_words(), self.range(), self.cost.word());
        format!("| `{key}` | {symbol} | {unit} | {default} | {range} | {cost} | {doc} | {when} |\n")
    }
}

/// Formats a number, with an exponent if it is very large or very small.
fn number(x: f64) -> String {
    if x != 0.0 && (x.abs() >= 1e5 || x.abs() < 1e-3) { format!("{x:e}") } else { format!("{x}") }
}

/// Formats the table as the Markdown of docs/parameters.md: links to the groups, then each group with its
/// parameters.
pub fn parameters_markdown() -> String {
    let anchor = |title: &str| title.to_lowercase().replace(' ', "-");
    let links: Vec<String> = GROUPS.iter().map(|g| format!("[{}](#{})", g.title, anchor(g.title))).collect();
    let mut text = links.join(" ·\n") + "\n";
    for Group { title, about, params } in GROUPS {
        text += &format!(
            "\n### {title}\n\n{}\n\n\
             | key | symbol | unit | default | allowed | a change costs | what | when to turn it |\n\
             |---|---|---|---|---|---|---|---|\n",
            wrapped(about)
        );
        params.iter().for_each(|param| text += &param.markdown_row());
    }
    text
}

/// Breaks a paragraph into lines of at most [`COLUMNS`].
fn wrapped(paragraph: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in paragraph.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= COLUMNS => {
                *line += " ";
                *line += word;
            }
            _ => lines.push(word.into()),
        }
    }
    lines.join("\n")
}
