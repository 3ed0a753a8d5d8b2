//! Values to try: `alpha=0.25:1:0.25`, `h=0.6,1,1.4`.

use crate::scene::{PARAMS, Param, Raw, Values, check_names, parse_value};
use crate::util::error::{Error, Result};

/// Most values of one sweep.
const MAX_VALUES: usize = 1000;

/// A parameter and the values it takes.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Dotted key.
    pub key: String,
    /// As the user called it: the key or its last part.
    pub name: String,
    /// The values, and each in words.
    pub values: Vec<(Raw, String)>,
}

impl Sweep {
    /// Reads `KEY=VALUES`. The key may be short where its last part is one parameter's alone; `keys` are all
    /// the keys of the scene.
    pub fn parse(text: &str, keys: &[String], values: &Values) -> Result<Sweep> {
        let usage = |why: String| Error::Usage(format!("--sweep {text}: {why}"));
        let how = "write KEY=FIRST:LAST:STEP or KEY=VALUE,VALUE,…, such as alpha=0.25:1:0.25";
        let (name, list) = text.split_once('=').ok_or_else(|| usage(format!("it has no values; {how}")))?;
        let (name, list) = (name.trim(), list.trim());
        let key = full_key(name, keys).map_err(&usage)?;
        let Some(param) = Param::find(&key) else {
            // Setting it says what is wrong with it.
            let place = crate::scene::Place("--sweep".into());
            return Err(match values.clone().set(&key, &Raw::Int(0), &place) {
                Err(e) => e,
                Ok(()) => usage("unknown key".into()),
            });
        };
        check_names(values, &key)
            .map_err(|(what, fix)| Error::input(format!("--sweep {key}: {what}"), fix))?;
        if key.starts_with("animate.") || key == "image.width" || key == "image.height" || param.is_list() {
            return Err(usage(format!("{key} cannot be swept: all pictures share it")));
        }
        let values = match range(list) {
            Some(range) => range.map_err(&usage)?,
            None => listed(list),
        };
        if values.is_empty() || values.len() > MAX_VALUES {
            return Err(usage(format!("{} values; a sweep has 1 to {MAX_VALUES}; {how}", values.len())));
        }
        for (i, (_, word)) in values.iter().enumerate() {
            if values[..i].iter().any(|(_, other)| other == word) {
                return Err(usage(format!("{word} is given twice")));
            }
        }
        Ok(Sweep { key, name: name.into(), values })
    }

    /// All it may be called in the name of a file.
    pub fn names(&self) -> Vec<String> {
        let last = self.key.rsplit('.').next().unwrap_or(&self.key);
        vec![self.name.clone(), self.key.clone(), last.into()]
    }

    /// Symbol or key, and unit: for an axis.
    pub fn axis(&self) -> String {
        let param = Param::find(&self.key);
        let name = match param {
            Some(p) if !p.symbol.is_empty() => format!("{} ({})", p.symbol, self.key),
            _ => self.key.clone(),
        };
        match param {
            Some(p) if !p.unit.is_empty() => format!("{name}, {}", p.unit),
            _ => name,
        }
    }
}

/// The key that `name` stands for: itself, or the one key that ends with it. Parameters that are there once
/// go before those of lights, rocks and materials.
fn full_key(name: &str, keys: &[String]) -> std::result::Result<String, String> {
    if name.contains('.') {
        return Ok(name.into());
    }
    let ends = |key: &&String| key.rsplit('.').next() == Some(name) && !key.starts_with("animate.");
    let single = |key: &&String| PARAMS.iter().any(|p| p.key == key.as_str());
    let all: Vec<&String> = keys.iter().filter(ends).collect();
    let once: Vec<&String> = all.iter().copied().filter(single).collect();
    match (once.as_slice(), all.as_slice()) {
        ([key], _) | ([], [key]) => Ok((*key).clone()),
        // Setting it will say what it may have meant.
        ([], []) => Ok(name.into()),
        (_, several) => {
            let several: Vec<&str> = several.iter().map(|k| k.as_str()).collect();
            Err(format!("{name} may be {}; write one in full", several.join(", ")))
        }
    }
}

/// `FIRST:LAST:STEP`, if it is that.
fn range(text: &str) -> Option<std::result::Result<Vec<(Raw, String)>, String>> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let [first, last, step] = parts.as_slice() else { return None };
    let numbers = [first, last, step].map(|n| n.parse::<f64>().ok().filter(|x| x.is_finite()));
    let [Some(a), Some(b), Some(step_size)] = numbers else { return None };
    if step_size == 0.0 || (b - a) / step_size < 0.0 {
        return Some(Err(format!("no steps of {step} lead from {first} to {last}")));
    }
    // A last step that rounding has put a little past the end still counts.
    let count = ((b - a) / step_size + 1e-9).floor() + 1.0;
    if count > MAX_VALUES as f64 {
        return Some(Err(format!("{count} values; at most {MAX_VALUES}")));
    }
    let exact = [first, last, step].map(|n| n.parse::<i128>().ok());
    let value = |i: usize| {
        if let [Some(a), _, Some(step)] = exact {
            let x = i64::try_from(a + step * i as i128).unwrap_or(i64::MAX);
            return (Raw::Int(x), x.to_string());
        }
        let x = a + step_size * i as f64;
        // Twelve digits: 0.1 + 0.2 is 0.3.
        let x: f64 = format!("{x:.12e}").parse().unwrap_or(x);
        (Raw::Float(x), format!("{x}"))
    };
    Some(Ok((0..count as usize).map(value).collect()))
}

/// Values between commas, each as `--set` takes it. Commas in brackets and quotes are the value's own.
fn listed(text: &str) -> Vec<(Raw, String)> {
    let mut words = vec![String::new()];
    let (mut depth, mut quote) = (0, None);
    for c in text.chars() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), c) if c == q => quote = None,
            (None, '[') => depth += 1,
            (None, ']') => depth -= 1,
            _ => {}
        }
        match (c, words.last_mut()) {
            (',', _) if depth == 0 && quote.is_none() => words.push(String::new()),
            (c, Some(word)) => word.push(c),
            _ => {}
        }
    }
    let words = words.iter().map(|w| w.trim()).filter(|w| !w.is_empty());
    words.map(|word| (parse_value(word), word.to_owned())).collect()
}
