//! Sweeps: a parameter and the values to try, such as `alpha=0.25:1:0.25` or `h=0.6,1,1.4`.

use crate::scene::{Kind, Param, Place, Raw, Values, check_names, full_key, parse_value, unknown_key};
use crate::util::error::{Error, Result};

/// Most values in one sweep.
const MAX_VALUES: usize = 1000;

/// A parameter and the values it takes.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The parameter's full dotted key.
    pub key: String,
    /// The key as the user wrote it, in full or only its last part.
    pub name: String,
    /// The values, each with its text.
    pub values: Vec<(Raw, String)>,
}

impl Sweep {
    /// Parses `KEY=VALUES`. The last part of the key is enough if only one parameter has it. `values` are
    /// those of the scene.
    ///
    /// # Errors
    /// [`Error::Usage`] or [`Error::Input`] if the key is unknown or cannot be swept, or if the values are
    /// malformed, too many or given twice.
    pub fn parse(text: &str, values: &Values) -> Result<Sweep> {
        let usage = |why: String| Error::Usage(format!("--sweep {text}: {why}"));
        let how = "write KEY=FIRST:LAST:STEP or KEY=VALUE,VALUE,…, such as alpha=0.25:1:0.25";
        let (name, list) =
            text.split_once('=').ok_or_else(|| usage(format!("the values are missing; {how}")))?;
        let (name, list) = (name.trim(), list.trim());
        let key = full_key(name, values).map_err(&usage)?;
        let Some(param) = Param::find(&key) else {
            return Err(unknown_key(&key, values, &Place("--sweep".into())));
        };
        check_names(values, &key)
            .map_err(|(what, fix)| Error::input(format!("--sweep {key}: {what}"), fix))?;
        if key.starts_with("animate.") || key == "image.width" || key == "image.height" || param.is_list() {
            return Err(usage(format!("{key} cannot be swept, because all pictures share it")));
        }
        let values = match range(list) {
            Some(range) => range.map_err(&usage)?,
            None => match range(&list.replace(',', ".")) {
                Some(Ok(_)) => {
                    let point = list.replace(',', ".");
                    return Err(usage(format!("the decimal mark is a point: write {name}={point}")));
                }
                _ if is_range_without_step(list) => {
                    return Err(usage(format!("the step is missing: write {name}={list}:STEP")));
                }
                _ => listed(list),
            },
        };
        let is_number = |(raw, _): &(Raw, String)| matches!(raw, Raw::Int(_) | Raw::Float(_));
        if matches!(param.kind, Kind::Point(_) | Kind::Color(_)) && values.iter().all(is_number) {
            let each = "write each value in brackets";
            return Err(usage(format!("{each}: {name}=[{list}],[…], in quotes for the shell")));
        }
        if values.is_empty() || values.len() > MAX_VALUES {
            return Err(usage(format!("{} values, but a sweep has 1 to {MAX_VALUES}; {how}", values.len())));
        }
        for (i, (_, word)) in values.iter().enumerate() {
            if values[..i].iter().any(|(_, other)| other == word) {
                return Err(usage(format!("{word} is given twice")));
            }
        }
        Ok(Sweep { key, name: name.into(), values })
    }

    /// Every name that the sweep may have in a file's name.
    pub fn names(&self) -> Vec<String> {
        let last = self.key.rsplit('.').next().unwrap_or(&self.key);
        vec![self.name.clone(), self.key.clone(), last.into()]
    }

    /// Label of the sweep's axis: symbol, key and unit.
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

/// Whether a text is `FIRST:LAST`, which no value of a parameter is.
fn is_range_without_step(text: &str) -> bool {
    let is_number = |n: &str| n.trim().replace(',', ".").parse::<f64>().is_ok();
    text.split_once(':').is_some_and(|(first, last)| is_number(first) && is_number(last))
}

/// Parses `FIRST:LAST:STEP`. `None` if the text has another form.
fn range(text: &str) -> Option<std::result::Result<Vec<(Raw, String)>, String>> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let [first, last, step] = parts.as_slice() else { return None };
    let numbers = [first, last, step].map(|n| n.parse::<f64>().ok().filter(|x| x.is_finite()));
    let [Some(a), Some(b), Some(step_size)] = numbers else { return None };
    if step_size == 0.0 || (b - a) / step_size < 0.0 {
        return Some(Err(format!("steps of {step} do not lead from {first} to {last}")));
    }
    // Rounding may put the last step slightly past the end; it still counts.
    let count = ((b - a) / step_size + 1e-9).floor() + 1.0;
    if count > MAX_VALUES as f64 {
        return Some(Err(format!("{count} values, but a sweep has at most {MAX_VALUES}")));
    }
    let exact = [first, last, step].map(|n| n.parse::<i128>().ok());
    let value = |i: usize| {
        if let [Some(a), _, Some(step)] = exact {
            let x = i64::try_from(a + step * i as i128).unwrap_or(i64::MAX);
            return (Raw::Int(x), x.to_string());
        }
        let x = a + step_size * i as f64;
        // Rounding to twelve digits makes 0.1 + 0.2 equal 0.3.
        let x: f64 = format!("{x:.12e}").parse().unwrap_or(x);
        (Raw::Float(x), format!("{x}"))
    };
    Some(Ok((0..count as usize).map(value).collect()))
}

/// Splits a list at its commas, except those inside brackets or quotes. Each value is parsed as by `--set`.
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
