//! Advice for values that were written by slip: what was meant, and how to write it.

use toml::de::DeValue;

use super::param::{Kind, Param};
use super::typed::{hex_color, in_brackets, parse_value};
use super::value::{Place, Raw, check};
use crate::util::error::Error;

/// Least likeness of a word to one of a choice that makes it worth a suggestion.
const ALIKE: f64 = 0.8;

/// The error for a value that a parameter does not allow.
pub fn not_allowed(place: &Place, key: &str, got: &str, param: &Param, advice: Option<String>) -> Error {
    let advice = advice.map_or(String::new(), |advice| advice + "; ");
    let hex = if let Kind::Color(_) = param.kind { " or \"#rrggbb\"" } else { "" };
    Error::input(
        format!("{}: {key} = {}", place.0, cut(got)),
        format!("{advice}allowed: {}{hex}", param.range()),
    )
}

/// Cuts a text to 60 characters.
pub fn cut(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// Returns advice on a value that the parameter does not allow.
pub fn advice(param: &Param, raw: &Raw) -> Option<String> {
    match (param.kind, raw) {
        (Kind::Int(least, most, _), Raw::Float(x))
            if x.fract() == 0.0 && (least as f64..=most as f64).contains(x) =>
        {
            Some(format!("write a whole number: {x:.0}"))
        }
        (Kind::Int(..), Raw::Float(_)) => Some("write a whole number".into()),
        (Kind::Switch(_), Raw::Int(number @ 0..=1)) => Some(format!("write {}", *number == 1)),
        (Kind::Series | Kind::Frames, Raw::Int(_) | Raw::Float(_)) => {
            Some(format!("write the list in brackets: [{}]", raw.words()))
        }
        (_, Raw::Text(text)) => advice_on_text(param, text.trim()),
        (_, Raw::List(items)) => advice_on_list(param.kind, items),
        _ => None,
    }
}

/// Returns advice on a list whose points or colour do not have three numbers.
fn advice_on_list(kind: Kind, items: &[Raw]) -> Option<String> {
    let point = |items: &[Raw]| three("a point", "x, y and z", items);
    let points =
        || items.iter().find_map(|item| if let Raw::List(parts) = item { point(parts) } else { None });
    match kind {
        Kind::Point(_) => point(items),
        Kind::Color(_) => three("a colour", "red, green and blue", items),
        Kind::Series => points(),
        Kind::Corners => points().or_else(|| {
            let whole = items.iter().all(|item| matches!(item, Raw::List(_)));
            (whole && items.len() != 4).then(|| format!("{} points: give four", items.len()))
        }),
        _ => None,
    }
}

/// Returns advice on a list of numbers that are not three. A decimal comma makes two numbers from one.
fn three(what: &str, parts: &str, items: &[Raw]) -> Option<String> {
    let numbers = items.iter().all(|item| matches!(item, Raw::Int(_) | Raw::Float(_)));
    if !numbers || items.is_empty() || items.len() == 3 {
        return None;
    }
    let list = items.iter().map(Raw::words).collect::<Vec<_>>().join(", ");
    let has = format!("[{}] has {} numbers, and {what} has 3", cut(&list), items.len());
    let comma = items.len() <= 6 && items.windows(2).any(|pair| matches!(pair, [_, Raw::Int(0..)]));
    Some(match items.len() {
        4.. if comma => format!("{has}; write decimals with a point: 6.3, not 6,3"),
        _ => format!("{has}: {parts}"),
    })
}

/// Returns the place of the line of a scene file that holds byte `at`, or of the line before, its text, and
/// advice on signs in it that TOML does not know. Within a list the fault shows only in the next line.
pub fn foreign_signs_at(text: &str, at: usize) -> Option<(usize, String, String)> {
    let start = |end: usize| text.as_bytes()[..end].iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
    let own = start(at.min(text.len()));
    [own, start(own.saturating_sub(1))].into_iter().find_map(|start| {
        let line = text.get(start..)?.lines().next()?.trim();
        Some((start, cut(line), foreign_signs(line)?))
    })
}

/// Returns advice on signs that word processors and other languages use in place of those of TOML. What
/// stands in quotes may hold any.
fn foreign_signs(line: &str) -> Option<String> {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '#') => return None,
            (None, '−' | '–') => return Some(format!("write a plain - in place of {c}")),
            (None, '“' | '”' | '„' | '‘' | '’' | '«' | '»') => {
                return Some(format!("write plain quotes, \", in place of {c}"));
            }
            (None, '/') if line[at..].starts_with("//") => {
                return Some("a comment begins with #, not with //".into());
            }
            _ => {}
        }
    }
    None
}

/// Returns advice on a key or table that a scene file has twice; `message` is what the reader of TOML says of
/// byte `at`, and `line_of` gives the number of the line of a byte.
pub fn given_twice(text: &str, at: usize, message: &str, line_of: impl Fn(usize) -> usize) -> Option<String> {
    if !message.contains("duplicate") {
        return None;
    }
    let start = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let own = text.get(start..)?.lines().next()?;
    let header = |line: &str| {
        section(line).map(|section| match section {
            Section::Table(name) => format!("[{name}]"),
            Section::List(name) => format!("[[{name}]]"),
        })
    };
    let key = |line: &str| line.split_once('=').map(|(key, _)| key.trim().to_owned());
    let lines: Vec<(usize, &str)> = text[..start]
        .split_inclusive('\n')
        .scan(0, |at, line| {
            let begin = *at;
            *at += line.len();
            Some((begin, line))
        })
        .collect();
    let (twice, first) = match header(own) {
        Some(own) => {
            let same = |(_, line): &&(usize, &str)| header(line).as_ref() == Some(&own);
            let first = lines.iter().find(same)?.0;
            (own, first)
        }
        None => {
            let own = key(own)?;
            // The table that the key stands in begins with the last header above.
            let table = lines.iter().rposition(|(_, line)| header(line).is_some()).unwrap_or(0);
            let same = |(_, line): &&(usize, &str)| key(line).as_ref() == Some(&own);
            let first = lines[table..].iter().find(same)?.0;
            (own, first)
        }
    };
    Some(format!("{twice} stands already in line {}; join the two", line_of(first)))
}

/// Returns the key and value on the line of a scene file that holds byte `at`, and advice on that value.
/// `None` where the line is no key and value, or the slip is none that is known.
pub fn slip_at(text: &str, at: usize) -> Option<(String, String, String)> {
    let line = text.bytes().take(at).filter(|&b| b == b'\n').count();
    let sections: Vec<Section> = text.lines().take(line).filter_map(section).collect();
    let section = sections.last().map_or(String::new(), |last| match last {
        Section::Table(name) => format!("{name}."),
        Section::List(name) => {
            let before = sections.iter().filter(|s| *s == last).count() - 1;
            format!("{name}.{before}.")
        }
    });
    let (name, value) = text.lines().nth(line)?.split_once('=')?;
    let value = value.trim();
    // A # begins a comment, unless it begins a colour without quotes.
    let value = match value.split_once('#') {
        Some(("", rest)) if rest.starts_with(char::is_whitespace) => "",
        Some(("", _)) => value.split_whitespace().next()?,
        Some((before, _)) => before.trim_end(),
        None => value,
    };
    // The fault is another one where the value is good TOML, as that of a key that is given twice.
    if DeValue::parse(value).is_ok() {
        return None;
    }
    let key = format!("{section}{}", name.trim());
    let advice = advice_on_unquoted(Param::find(&key)?, value)?;
    Some((key, value.into(), advice))
}

/// The table that the keys below a line belong to.
#[derive(PartialEq)]
enum Section<'a> {
    /// `[lights.sun]`
    Table(&'a str),
    /// `[[quads]]`: the next item of the list.
    List(&'a str),
}

fn section(line: &str) -> Option<Section<'_>> {
    let line = line.split('#').next()?.trim();
    let name = line.strip_prefix('[')?.strip_suffix(']')?;
    let is_name = |name: &str| name.chars().all(|c| c.is_alphanumeric() || "._-".contains(c));
    match name.strip_prefix('[').and_then(|name| name.strip_suffix(']')) {
        Some(list) => is_name(list).then_some(Section::List(list)),
        None => is_name(name).then_some(Section::Table(name)),
    }
}

/// Returns advice on a value that stands in a scene file without quotes, and is no TOML.
fn advice_on_unquoted(param: &Param, text: &str) -> Option<String> {
    match param.kind {
        Kind::Color(_) if hex_color(text).is_some() => Some(format!("write the colour in quotes: {text:?}")),
        Kind::Choice(words) if words.contains(&text) => Some(format!("write the word in quotes: {text:?}")),
        Kind::Text(_) if !text.contains(['"', '\'']) => Some(format!("write the text in quotes: {text:?}")),
        _ => advice_on_text(param, text),
    }
}

fn advice_on_text(param: &Param, text: &str) -> Option<String> {
    if text.is_empty() {
        return (!matches!(param.kind, Kind::Text(_))).then(|| "write a value behind the =".into());
    }
    if let Some(advice) = foreign_signs(text) {
        return Some(advice);
    }
    match param.kind {
        Kind::Float(..) | Kind::Int(..) => advice_on_number(param, text),
        Kind::Choice(words) => {
            let alike = |word: &&str| strsim::jaro_winkler(&text.to_lowercase(), word);
            let near = words.iter().copied().max_by(|a, b| alike(a).total_cmp(&alike(b)))?;
            (alike(&near) > ALIKE).then(|| format!("did you mean {near}?"))
        }
        Kind::Switch(_) => match text.to_lowercase().as_str() {
            "true" | "yes" | "on" | "1" => Some("write true, without quotes".into()),
            "false" | "no" | "off" | "0" => Some("write false, without quotes".into()),
            _ => None,
        },
        Kind::Text(_) => None,
        Kind::Color(_) if text.starts_with('#') => Some("give six hexadecimal digits".into()),
        Kind::Color(_) if hex_color(&format!("#{text}")).is_some() => Some(format!("write \"#{text}\"")),
        Kind::Color(_) | Kind::Point(_) => {
            let between = |c: char| c.is_whitespace() || ",;()[]{}".contains(c);
            let parts: Vec<&str> = text.split(between).filter(|part| !part.is_empty()).collect();
            let list = parts.join(", ");
            let good = in_brackets(&list).is_some_and(|list| check(param, &list).is_ok());
            good.then(|| format!("write the list in brackets: [{list}]"))
        }
        Kind::Corners | Kind::Frames | Kind::Series => {
            let good = in_brackets(text).is_some_and(|list| check(param, &list).is_ok());
            good.then(|| format!("write the list in brackets: [{text}]"))
        }
    }
}

fn advice_on_number(param: &Param, text: &str) -> Option<String> {
    let (number, unit) = split(text)?;
    let whole = number.fract() == 0.0;
    if matches!(param.kind, Kind::Int(..)) && !whole {
        return Some("write a whole number".into());
    }
    if unit.is_empty() {
        return match parse_value(text) {
            _ if text.contains(',') => Some(format!("use a decimal point: {number}")),
            Raw::Text(_) => Some(format!("write {number}")),
            _ => Some(format!("write the number without quotes: {number}")),
        };
    }
    let is_unit = |c: char| c.is_alphabetic() || "°%".contains(c);
    if !unit.starts_with(is_unit) {
        return None;
    }
    let (words, same) = units(param.unit);
    Some(match param.unit {
        "" => format!("no unit: {number}"),
        own if own == unit || same.contains(&unit.to_lowercase().as_str()) => {
            format!("no unit: {number} (in {words})")
        }
        _ => format!("no unit: the number is in {words}"),
    })
}

/// Splits text into the number it begins with, which may have a decimal comma, and the rest.
fn split(text: &str) -> Option<(f64, &str)> {
    let number = |text: &str| {
        let begins =
            text.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let one = text.matches(',').count() + text.matches('.').count() <= 1;
        text.replace(',', ".").parse::<f64>().ok().filter(|x| begins && one && x.is_finite())
    };
    // No number has more characters; a longer text would take long.
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8()).take(40);
    let ends: Vec<usize> = ends.collect();
    ends.into_iter().rev().find_map(|end| Some((number(text[..end].trim_end())?, text[end..].trim())))
}

/// Returns the name of a parameter's unit in a sentence, and its other spellings in small letters.
fn units(unit: &str) -> (&str, &'static [&'static str]) {
    match unit {
        "m" => ("metres", &["m", "metre", "metres", "meter", "meters"]),
        "°" => ("degrees", &["deg", "degs", "degree", "degrees"]),
        "s" => ("seconds", &["s", "sec", "second", "seconds"]),
        "m/s" => ("metres per second", &["m/s", "mps"]),
        "1/s" => ("1/s", &["fps", "hz", "/s"]),
        "1/m" => ("1/m", &["/m"]),
        "K" => ("kelvins", &["k", "kelvin", "kelvins"]),
        "pixels" => ("pixels", &["px", "pixel", "pixels"]),
        "frames" => ("frames", &["f", "frame", "frames"]),
        "MiB" => ("MiB", &["mib"]),
        other => (other, &[]),
    }
}
