//! Values as users type them: forms besides those of TOML that are understood.

use toml::de::DeValue;

use super::param::{Kind, Param};
use super::read::raw;
use super::value::Raw;

/// Parses a value of `--set` for a parameter: TOML, otherwise a word. A point, a colour or a list of numbers
/// needs no brackets, and a number no digit before or after its point.
pub fn parse_for(param: &Param, text: &str) -> Raw {
    match (param.kind, parse_value(text)) {
        (Kind::Color(_) | Kind::Point(_), word @ Raw::Text(_)) => in_brackets(text).unwrap_or(word),
        (Kind::Series | Kind::Frames, one @ (Raw::Int(_) | Raw::Float(_))) => Raw::List(vec![one]),
        (Kind::Series | Kind::Frames, word @ Raw::Text(_)) => in_brackets(text).unwrap_or(word),
        (Kind::Float(..), word @ Raw::Text(_)) => {
            let digits = text.chars().any(|c| c.is_ascii_digit());
            text.parse().ok().filter(|_| digits).map_or(word, Raw::Float)
        }
        (_, value) => value,
    }
}

/// Parses a value of `--set`: TOML, otherwise a word.
pub fn parse_value(text: &str) -> Raw {
    DeValue::parse(text).map_or_else(|_| Raw::Text(text.into()), |v| raw(v.get_ref()))
}

/// Returns the list that `text` is once it has brackets; `None` where it is none, or has one value only.
pub fn in_brackets(text: &str) -> Option<Raw> {
    let list = DeValue::parse(&format!("[{text}]")).map(|v| raw(v.get_ref())).ok()?;
    matches!(&list, Raw::List(items) if items.len() > 1).then_some(list)
}

/// Returns the value of a fraction of two numbers, such as `24000/1001`.
pub fn fraction(text: &str) -> Option<f64> {
    let (above, below) = text.split_once('/')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let value = number(above)? / number(below)?;
    value.is_finite().then_some(value)
}

/// Returns the linear RGB of a colour that is written `#rrggbb`, whose digits are sRGB (IEC 61966-2-1).
pub fn hex_color(text: &str) -> Option<[f64; 3]> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.chars().all(|c| c.is_ascii_hexdigit()))?;
    let code = u32::from_str_radix(digits, 16).ok()?;
    Some([code >> 16, code >> 8, code].map(|c| linear(f64::from(c & 0xff) / 255.0)))
}

/// Decodes sRGB, 0 to 1.
fn linear(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}
