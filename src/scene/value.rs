//! Parameter values: they are checked against the table, merged and printed.

use std::collections::{BTreeMap, BTreeSet};

use super::meshes;
use super::names::{in_table_of_water, unknown_key_in_file};
use super::param::{COLOR_MAX, Kind, MAX_FRAME, MAX_KEYFRAMES, POINT_MAX, Param};
use super::slips::{advice, cut, not_allowed};
use super::typed::{fraction, hex_color};
use crate::util::error::{Error, Result};

/// A checked value. A number is the shortest decimal of the float32 that the renderer uses.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Float(f64),
    /// A whole number.
    Int(i64),
    /// On or off.
    Switch(bool),
    /// A word, path or name.
    Text(String),
    /// A colour, point or direction.
    Triple([f64; 3]),
    /// Four corners.
    Corners([[f64; 3]; 4]),
    /// Frame numbers.
    Frames(Vec<i64>),
    /// Values of one kind, each as 1, 3 or 12 components.
    Series(Vec<Vec<f64>>),
}

/// A value as its syntax gives it, not yet checked against the table.
#[derive(Clone, Debug)]
pub enum Raw {
    /// A float.
    Float(f64),
    /// A whole number.
    Int(i64),
    /// A boolean.
    Switch(bool),
    /// A string.
    Text(String),
    /// A list.
    List(Vec<Raw>),
    /// Anything else, by the name of its type.
    Other(&'static str),
}

/// Origin of a value, for messages: `file:line` or `--set`.
#[derive(Clone, Debug)]
pub struct Place(pub String);

/// Dotted concrete keys and their values. Keys that are absent have their defaults.
#[derive(Clone, Debug, Default)]
pub struct Values(
    /// The values.
    pub BTreeMap<Key, Value>,
    /// Keys whose values come from a preset or picture, and were not set by the user.
    BTreeSet<Key>,
);

/// The origin of a value does not matter.
impl PartialEq for Values {
    fn eq(&self, other: &Values) -> bool {
        self.0 == other.0
    }
}

/// A dotted key. Numeric parts (quads, tracks) sort by value, names by letters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(Vec<Part>);

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Number(u32),
    Name(String),
}

impl Key {
    /// Parses the dotted form.
    pub fn new(dotted: &str) -> Self {
        Key(dotted
            .split('.')
            .map(|part| match part.parse::<u32>() {
                // "007" stays a name: as a number it would print as "7".
                Ok(n) if n.to_string() == part => Part::Number(n),
                _ => Part::Name(part.into()),
            })
            .collect())
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, part) in self.0.iter().enumerate() {
            let dot = if i == 0 { "" } else { "." };
            match part {
                Part::Number(n) => write!(f, "{dot}{n}")?,
                Part::Name(name) => write!(f, "{dot}{name}")?,
            }
        }
        Ok(())
    }
}

impl Values {
    /// Checks `raw` against the table and stores it.
    ///
    /// # Errors
    /// [`Error::Input`](crate::util::error::Error::Input) where the table has no such key or does not allow
    /// the value. The message begins with `place`.
    pub fn set(&mut self, key: &str, raw: &Raw, place: &Place) -> Result<()> {
        if let Some((what, fix)) = in_table_of_water(key) {
            return Err(Error::input(format!("{}: {what}", place.0), fix));
        }
        let Some(param) = Param::find(key) else {
            return Err(unknown_key_in_file(key, raw, self, place));
        };
        let value =
            check(param, raw).map_err(|got| not_allowed(place, key, &got, param, advice(param, raw)))?;
        for other in meshes::other_spellings(self, key) {
            self.0.remove(&Key::new(&other));
        }
        let key = Key::new(key);
        self.1.remove(&key);
        self.0.insert(key, value);
        Ok(())
    }

    /// Marks all values so far as those of a preset or picture.
    pub(super) fn come_from_base(&mut self) {
        self.1 = self.0.keys().cloned().collect();
    }

    /// Whether the user has set this key, in a scene file or with `--set`.
    pub fn is_set_by_user(&self, key: &str) -> bool {
        let key = Key::new(key);
        self.0.contains_key(&key) && !self.1.contains(&key)
    }

    /// Whether any key under `prefix` has the value of a preset or picture.
    pub(super) fn has_base_under(&self, prefix: &str) -> bool {
        let prefix = Key::new(prefix);
        self.1.range(&prefix..).next().is_some_and(|key| key.0.starts_with(&prefix.0))
    }

    /// Removes every key under `prefix`.
    pub fn clear_under(&mut self, prefix: &str) {
        let prefix = Key::new(prefix);
        self.0.retain(|key, _| !key.0.starts_with(&prefix.0));
    }

    /// Gives `key` the value that it has in `other`, or removes it if it has none there.
    pub fn copy_from(&mut self, other: &Values, key: &str) {
        let key = Key::new(key);
        match other.0.get(&key) {
            Some(value) => self.0.insert(key, value.clone()),
            None => self.0.remove(&key),
        };
    }

    /// Whether any key lies under `prefix`.
    pub fn has_under(&self, prefix: &str) -> bool {
        let prefix = Key::new(prefix);
        self.0.range(&prefix..).next().is_some_and(|(key, _)| key.0.starts_with(&prefix.0))
    }

    /// Copies every key of `other` under `from` to the same key under `to`.
    pub fn copy_under(&mut self, other: &Values, from: &str, to: &str) {
        let (from, to) = (Key::new(from), Key::new(to));
        for (key, value) in &other.0 {
            if let Some(rest) = key.0.strip_prefix(from.0.as_slice()) {
                self.0.insert(Key([&to.0, rest].concat()), value.clone());
            }
        }
    }

    /// Returns the names (or numbers) below `section`, in order.
    pub fn names(&self, section: &str) -> Vec<String> {
        let section = Key::new(section);
        let mut names: Vec<String> = Vec::new();
        for key in self.0.keys() {
            if let Some(rest) = key.0.strip_prefix(section.0.as_slice())
                && let Some(first) = rest.first()
            {
                let name = Key(vec![first.clone()]).to_string();
                if names.last() != Some(&name) {
                    names.push(name);
                }
            }
        }
        names
    }

    /// Returns the value of a concrete key, or the table's default.
    ///
    /// # Panics
    /// If the table has no such key, or a required value is absent. Callers check first.
    pub fn get(&self, key: &str) -> Value {
        if let Some(value) = self.0.get(&Key::new(key)) {
            return value.clone();
        }
        let param = Param::find(key).unwrap_or_else(|| panic!("no parameter {key}"));
        match param.kind {
            Kind::Float(.., d) => Value::Float(round_f32(d)),
            Kind::Int(.., d) => Value::Int(d),
            Kind::Choice(words) => Value::Text(words[0].into()),
            Kind::Switch(on) => Value::Switch(on),
            Kind::Text(t) => Value::Text(t.into()),
            Kind::Color(c) | Kind::Point(c) => Value::Triple(c),
            Kind::Frames => Value::Frames(Vec::new()),
            Kind::Series => Value::Series(Vec::new()),
            Kind::Corners => panic!("{key} has no default"),
        }
    }

    /// Whether the scene itself sets this key.
    pub fn is_set(&self, key: &str) -> bool {
        self.0.contains_key(&Key::new(key))
    }

    /// Returns the number of a place along an axis of the world, metres.
    pub fn coordinate(&self, key: &str) -> f64 {
        match self.get(key) {
            Value::Float(x) => x,
            other => panic!("{key} is no number: {other:?}"),
        }
    }

    /// Returns a float32 parameter.
    pub fn float(&self, key: &str) -> f32 {
        match self.get(key) {
            Value::Float(x) => x as f32,
            other => panic!("{key} is no number: {other:?}"),
        }
    }

    /// Returns a whole number.
    pub fn int(&self, key: &str) -> i64 {
        match self.get(key) {
            Value::Int(x) => x,
            other => panic!("{key} is no whole number: {other:?}"),
        }
    }

    /// Returns a whole number whose range fits 32 bits.
    pub fn count(&self, key: &str) -> u32 {
        u32::try_from(self.int(key)).unwrap_or_else(|_| panic!("{key} does not fit 32 bits"))
    }

    /// Whether a switch is on.
    pub fn is_on(&self, key: &str) -> bool {
        match self.get(key) {
            Value::Switch(on) => on,
            other => panic!("{key} is no switch: {other:?}"),
        }
    }

    /// Returns a word, path or name.
    pub fn text(&self, key: &str) -> String {
        match self.get(key) {
            Value::Text(t) => t,
            other => panic!("{key} is no text: {other:?}"),
        }
    }

    /// Returns the variant that the value of a choice names. `from_word` is that of the enum whose words the
    /// table lists.
    ///
    /// # Panics
    /// If `from_word` does not know the word.
    pub fn choice<T>(&self, key: &str, from_word: impl Fn(&str) -> Option<T>) -> T {
        let word = self.text(key);
        from_word(&word).unwrap_or_else(|| panic!("{key} has no choice {word}"))
    }

    /// Returns a point, direction or colour.
    pub fn triple(&self, key: &str) -> glam::Vec3 {
        match self.get(key) {
            Value::Triple(t) => glam::Vec3::from_array(t.map(|x| x as f32)),
            other => panic!("{key} is no triple: {other:?}"),
        }
    }

    /// Returns a point, in float64: far from the world's origin, float32 would lose its digits.
    pub fn point(&self, key: &str) -> glam::DVec3 {
        match self.get(key) {
            Value::Triple(t) => glam::DVec3::from_array(t),
            other => panic!("{key} is no point: {other:?}"),
        }
    }

    /// Returns a point relative to `origin`.
    pub fn local_point(&self, key: &str, origin: glam::DVec3) -> glam::Vec3 {
        (self.point(key) - origin).as_vec3()
    }

    /// Returns frame numbers.
    pub fn frames(&self, key: &str) -> Vec<i64> {
        match self.get(key) {
            Value::Frames(frames) => frames,
            other => panic!("{key} is no list of frames: {other:?}"),
        }
    }

    /// Returns a list of values, each by its components.
    pub fn series(&self, key: &str) -> Vec<Vec<f64>> {
        match self.get(key) {
            Value::Series(values) => values,
            other => panic!("{key} is no list of values: {other:?}"),
        }
    }

    /// Returns four corners relative to `origin`.
    pub fn local_corners(&self, key: &str, origin: glam::DVec3) -> [glam::Vec3; 4] {
        self.corners(key).map(|corner| (corner - origin).as_vec3())
    }

    /// Returns four corners.
    pub fn corners(&self, key: &str) -> [glam::DVec3; 4] {
        match self.get(key) {
            Value::Corners(c) => c.map(glam::DVec3::from_array),
            other => panic!("{key} is no quad: {other:?}"),
        }
    }
}

/// Rounds to the renderer's float32, as its shortest decimal.
fn round_f32(x: f64) -> f64 {
    (x as f32).to_string().parse().unwrap_or(f64::NAN)
}

/// Rounds a coordinate to 13 digits, a micrometre at [`POINT_MAX`], so that computed ones stay short.
fn round_point(x: f64) -> f64 {
    format!("{x:.12e}").parse().unwrap_or(f64::NAN)
}

/// Checks a raw value against a parameter's kind. The error is the value as text.
pub fn check(param: &Param, raw: &Raw) -> std::result::Result<Value, String> {
    let words = || raw.words();
    match param.kind {
        // The rates of film and television are fractions.
        Kind::Float(min, max, _) if param.key == "animate.fps" => {
            let rate = match raw {
                Raw::Text(text) => fraction(text).and_then(|rate| float(&Raw::Float(rate), min, max)),
                number => float(number, min, max),
            };
            Ok(Value::Float(rate.ok_or_else(words)?))
        }
        // A height of the world, which float32 would move as it would a point.
        Kind::Float(min, max, _) if param.key == "haze.level" => {
            Ok(Value::Float(number(raw, min, max, round_point).ok_or_else(words)?))
        }
        Kind::Float(min, max, _) => Ok(Value::Float(float(raw, min, max).ok_or_else(words)?)),
        Kind::Int(min, max, _) => match raw {
            Raw::Int(x) if (min..=max).contains(x) => Ok(Value::Int(*x)),
            _ => Err(words()),
        },
        Kind::Choice(options) => match raw {
            Raw::Text(t) if options.contains(&t.as_str()) => Ok(Value::Text(t.clone())),
            _ => Err(words()),
        },
        Kind::Switch(_) => match raw {
            Raw::Switch(on) => Ok(Value::Switch(*on)),
            _ => Err(words()),
        },
        Kind::Text(_) => match raw {
            Raw::Text(t) => Ok(Value::Text(t.clone())),
            _ => Err(words()),
        },
        Kind::Color(_) => {
            let color = match raw {
                Raw::Text(t) => hex_color(t).map(|c| c.map(round_f32)),
                list => triple(list, 0.0, COLOR_MAX, round_f32),
            };
            Ok(Value::Triple(color.ok_or_else(words)?))
        }
        Kind::Point(_) => {
            Ok(Value::Triple(triple(raw, -POINT_MAX, POINT_MAX, round_point).ok_or_else(words)?))
        }
        Kind::Corners => {
            let Raw::List(list) = raw else { return Err(words()) };
            let points: Option<Vec<[f64; 3]>> =
                list.iter().map(|p| triple(p, -POINT_MAX, POINT_MAX, round_point)).collect();
            let corners = points.and_then(|p| <[[f64; 3]; 4]>::try_from(p).ok());
            Ok(Value::Corners(corners.ok_or_else(words)?))
        }
        Kind::Frames => Ok(Value::Frames(frames(raw).ok_or_else(words)?)),
        Kind::Series => Ok(Value::Series(series(raw).ok_or_else(words)?)),
    }
}

fn frames(raw: &Raw) -> Option<Vec<i64>> {
    let Raw::List(list) = raw else { return None };
    let numbers = list.iter().map(|x| match x {
        Raw::Int(n) if (-MAX_FRAME..=MAX_FRAME).contains(n) => Some(*n),
        _ => None,
    });
    let numbers: Vec<i64> = numbers.collect::<Option<_>>()?;
    (numbers.len() <= MAX_KEYFRAMES && numbers.is_sorted_by(|a, b| a < b)).then_some(numbers)
}

/// Returns the components of each value. Their range depends on the key that they are meant for, and is
/// checked with it.
fn series(raw: &Raw) -> Option<Vec<Vec<f64>>> {
    let Raw::List(list) = raw else { return None };
    let number = |raw: &Raw| match *raw {
        Raw::Float(x) if x.is_finite() => Some(x),
        Raw::Int(x) => Some(x as f64),
        _ => None,
    };
    let triple = |raw: &Raw| match raw {
        Raw::List(parts) if parts.len() == 3 => parts.iter().map(number).collect::<Option<Vec<f64>>>(),
        _ => None,
    };
    let value = |raw: &Raw| match raw {
        Raw::List(points) if points.len() == 4 => {
            Some(points.iter().map(triple).collect::<Option<Vec<_>>>()?.concat())
        }
        Raw::List(_) => triple(raw),
        _ => Some(vec![number(raw)?]),
    };
    let values: Vec<Vec<f64>> = list.iter().map(value).collect::<Option<_>>()?;
    let alike = values.iter().all(|v| v.len() == values[0].len());
    (values.len() <= MAX_KEYFRAMES && alike).then_some(values)
}

/// Returns a float32 inside the range that is neither denormal nor infinite.
fn float(raw: &Raw, min: f64, max: f64) -> Option<f64> {
    number(raw, min, max, round_f32)
}

/// Returns a number inside the range whose float32 is neither denormal nor infinite, rounded by `round`.
fn number(raw: &Raw, min: f64, max: f64, round: fn(f64) -> f64) -> Option<f64> {
    let x = match *raw {
        Raw::Float(x) => x,
        Raw::Int(x) => x as f64,
        _ => return None,
    };
    let single = x as f32;
    let usable = single.is_normal() || x == 0.0;
    // −0 becomes 0: it would flip the signs of derived values.
    ((min..=max).contains(&x) && usable).then(|| if x == 0.0 { 0.0 } else { round(x) })
}

fn triple(raw: &Raw, min: f64, max: f64, round: fn(f64) -> f64) -> Option<[f64; 3]> {
    let Raw::List(list) = raw else { return None };
    let numbers: Option<Vec<f64>> = list.iter().map(|x| number(x, min, max, round)).collect();
    numbers.and_then(|n| n.try_into().ok())
}

impl Raw {
    /// Formats the value for a message, cut to 60 characters.
    pub(super) fn words(&self) -> String {
        let text = match self {
            Raw::Float(x) => format!("{x:?}"),
            Raw::Int(x) => x.to_string(),
            Raw::Switch(on) => on.to_string(),
            Raw::Text(t) => format!("{t:?}"),
            Raw::List(list) => {
                format!("[{}]", list.iter().take(5).map(Raw::words).collect::<Vec<_>>().join(", "))
            }
            Raw::Other(name) => (*name).into(),
        };
        cut(&text)
    }
}

impl Value {
    /// Formats the value as TOML.
    pub fn to_toml(&self) -> String {
        let list = |items: Vec<String>| format!("[{}]", items.join(", "));
        match self {
            Value::Frames(frames) => list(frames.iter().map(i64::to_string).collect()),
            Value::Series(values) => list(
                values
                    .iter()
                    .map(|value| match value.as_slice() {
                        [x] => Value::Float(*x).to_toml(),
                        [x, y, z] => Value::Triple([*x, *y, *z]).to_toml(),
                        corners => list(
                            corners
                                .chunks_exact(3)
                                .map(|p| Value::Triple([p[0], p[1], p[2]]).to_toml())
                                .collect(),
                        ),
                    })
                    .collect(),
            ),
            Value::Float(x) => toml::Value::Float(*x).to_string(),
            Value::Int(x) => x.to_string(),
            Value::Switch(on) => on.to_string(),
            Value::Text(t) => toml::Value::String(t.clone()).to_string(),
            Value::Triple(t) => format!("[{}, {}, {}]", t[0], t[1], t[2]),
            Value::Corners(c) => {
                format!("[{}]", c.iter().map(|p| Value::Triple(*p).to_toml()).collect::<Vec<_>>().join(", "))
            }
        }
    }

    /// Converts the value to JSON.
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Value::Float(x) => serde_json::json!(x),
            Value::Int(x) => serde_json::json!(x),
            Value::Switch(on) => serde_json::json!(on),
            Value::Text(t) => serde_json::json!(t),
            Value::Triple(t) => serde_json::json!(t),
            Value::Corners(c) => serde_json::json!(c),
            Value::Frames(frames) => serde_json::json!(frames),
            Value::Series(values) => values
                .iter()
                .map(|value| match value.as_slice() {
                    [x] => serde_json::json!(x),
                    [_, _, _] => serde_json::json!(value),
                    corners => corners.chunks_exact(3).map(|p| serde_json::json!(p)).collect(),
                })
                .collect(),
        }
    }
}
