//! A USD file as a list of prims with fields, whether it is binary or text.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Cursor;
use std::sync::Arc;

use openusd::sdf::{self, AbstractData, SpecType, Value};
use openusd::usdc::CrateFile;

use super::File;
use super::sizes::{self, Layout};
use super::text;
use super::values::Reference;
use crate::util::error::{Error, Result};

/// Words of an error about the fields of a file.
const UNREADABLE: &str = "is no value of curves, or leads out of the file";

/// Prims of a file, and their attributes.
pub(super) struct Layer {
    /// Paths of all prims outside variants, in the order of their letters.
    pub prims: Vec<String>,
    /// Number of prims inside variants, which are not in `prims`.
    pub in_variants: usize,
    content: Content,
}

enum Content {
    Text(sdf::Data),
    Crate(Box<Crate>),
}

/// Binary file.
struct Crate {
    file: CrateFile<Cursor<Shared>>,
    bytes: Shared,
    layout: Layout,
    /// First field of each path.
    fields: HashMap<String, usize>,
}

/// Bytes of a file, which the crate and the checks look at.
#[derive(Clone)]
struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Layer {
    /// Reads text.
    ///
    /// # Errors
    /// [`Error::Input`] for text that is no USD, [`Error::Memory`] for text that is too large.
    pub fn of_text(bytes: Vec<u8>, file: &mut File) -> Result<Layer> {
        let text = String::from_utf8(bytes).map_err(|_| file.broken("it is not UTF-8"))?;
        let counts = text::count(&text);
        if counts.depth > text::MOST_DEPTH {
            let depth = counts.depth;
            return Err(file.broken(format!("{depth} brackets are open at once")));
        }
        if let Some((bracket, line)) = counts.unclosed {
            return Err(file.broken(format!("line {line}: nothing closes the bracket {bracket}")));
        }
        if counts.is_nested {
            return Err(file.broken("an array begins inside an array"));
        }
        file.take(counts.memory)?;
        let data = openusd::usda::parse(&text).map_err(|error| file.broken(format!("{error:#}")))?;
        let specs: Vec<(String, SpecType)> = data
            .spec_paths()
            .into_iter()
            .filter_map(|path| Some((path.as_str().to_owned(), data.spec_type(&path)?)))
            .collect();
        Ok(Layer::new(specs, Content::Text(data)))
    }

    /// Reads a binary file.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that is broken, [`Error::Memory`] for one that is too large.
    pub fn of_crate(bytes: Vec<u8>, file: &mut File) -> Result<Layer> {
        let what = file.what();
        let layout = sizes::check(&bytes, &what, &mut file.budget).map_err(|fault| match fault {
            sizes::Fault::Memory(error) => error,
            sizes::Fault::Broken("version") => file.broken("it is of a version that is not known"),
            sizes::Fault::Broken("old version") => Error::input(
                format!("{}: it is older than version 0.4 of the binary format", file.name()),
                "write it again with a newer program, for example with `usdcat -o new.usdc old.usdc`",
            ),
            sizes::Fault::Broken(part) => file.broken(format!("its {part} is damaged")),
        })?;
        let bytes = Shared(Arc::new(bytes));
        let read = CrateFile::open(Cursor::new(bytes.clone()));
        let read = read.map_err(|error| file.broken(format!("{error:#}")))?;
        let (mut specs, mut fields) = (Vec::new(), HashMap::new());
        for spec in &read.specs {
            let path = read.paths.get(spec.path_index).ok_or_else(|| file.broken("a path is missing"))?;
            specs.push((path.as_str().to_owned(), spec.spec_type));
            fields.insert(path.as_str().to_owned(), spec.fieldset_index);
        }
        Ok(Layer::new(specs, Content::Crate(Box::new(Crate { file: read, bytes, layout, fields }))))
    }

    fn new(specs: Vec<(String, SpecType)>, content: Content) -> Layer {
        let mut prims: Vec<String> =
            specs.into_iter().filter_map(|(path, kind)| (kind == SpecType::Prim).then_some(path)).collect();
        prims.sort_unstable();
        prims.dedup();
        let all = prims.len();
        prims.retain(|path| !path.contains('{'));
        Layer { in_variants: all - prims.len(), prims, content }
    }

    /// Whether a field stands at a path.
    pub fn has(&self, path: &str, field: &str) -> bool {
        match &self.content {
            Content::Text(data) => sdf::path(path).is_ok_and(|path| data.has_field(&path, field)),
            Content::Crate(own) => own.reference(path, field).is_some(),
        }
    }

    /// Value of a field that does not change with time.
    ///
    /// # Errors
    /// [`Error::Input`] for a value that is broken, [`Error::Memory`] for one that is too large.
    pub fn field(&mut self, path: &str, field: &str, file: &mut File) -> Result<Option<Cow<'_, Value>>> {
        match &mut self.content {
            Content::Text(data) => {
                let Ok(path) = sdf::path(path) else { return Ok(None) };
                data.try_field(&path, field).map_err(|error| file.broken(error))
            }
            Content::Crate(own) => match own.reference(path, field) {
                None => Ok(None),
                Some(reference) => own.value(reference, path, file).map(|value| Some(Cow::Owned(value))),
            },
        }
    }

    /// Value of an attribute: of its samples the last one that is not behind `time`, or the first; without
    /// samples its default.
    ///
    /// # Errors
    /// Those of [`Layer::field`].
    pub fn attribute(
        &mut self,
        prim: &str,
        name: &str,
        time: Option<f64>,
        file: &mut File,
    ) -> Result<Option<Cow<'_, Value>>> {
        let path = format!("{prim}.{name}");
        if !self.has(&path, TIME_SAMPLES) {
            return self.field(&path, "default", file);
        }
        match &mut self.content {
            Content::Text(_) => {
                let Some(Cow::Borrowed(Value::TimeSamples(samples))) =
                    self.field(&path, TIME_SAMPLES, file)?
                else {
                    return Ok(None);
                };
                let times: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
                Ok(at(&times, time).map(|number| Cow::Borrowed(&samples[number].1)))
            }
            Content::Crate(own) => {
                let fault = |file: &File| file.broken(format!("{path}: the samples are damaged"));
                let Some(samples) = own.reference(&path, TIME_SAMPLES) else { return Ok(None) };
                let (times, values) = samples.samples(&own.bytes.0).ok_or_else(|| fault(file))?;
                let Value::DoubleVec(times) = own.value(times, &path, file)? else {
                    return Err(fault(file));
                };
                let value = at(&times, time).map(|number| values.get(number).ok_or_else(|| fault(file)));
                match value.transpose()? {
                    None => Ok(None),
                    Some(value) => own.value(*value, &path, file).map(|value| Some(Cow::Owned(value))),
                }
            }
        }
    }
}

/// Name of the field of samples.
const TIME_SAMPLES: &str = "timeSamples";

/// Number of the sample for a time.
fn at(times: &[f64], time: Option<f64>) -> Option<usize> {
    let time = time.unwrap_or(f64::NEG_INFINITY);
    let earliest = (0..times.len()).min_by(|a, b| times[*a].total_cmp(&times[*b]));
    let before = (0..times.len()).filter(|number| times[*number] <= time);
    before.max_by(|a, b| times[*a].total_cmp(&times[*b])).or(earliest)
}

impl Crate {
    /// Reference of a field's value.
    fn reference(&self, path: &str, field: &str) -> Option<Reference> {
        let start = *self.fields.get(path)?;
        let numbers = self.file.fieldsets.get(start..)?.iter().map_while(|number| *number);
        let own = numbers.filter_map(|number| self.file.fields.get(number));
        let mut named = own.filter(|own| self.file.tokens.get(own.token_index).is_some_and(|t| t == field));
        named.next().map(|own| Reference(own.value_rep.0))
    }

    /// Reads a value after a check.
    fn value(&mut self, reference: Reference, path: &str, file: &mut File) -> Result<Value> {
        let size = reference.size(&self.bytes.0, self.layout);
        file.take(size.ok_or_else(|| file.broken(format!("{path} {UNREADABLE}")))?)?;
        if reference.is_timed() || !reference.is_sound(&self.bytes.0, self.layout) {
            return Err(file.broken(format!("{path} {UNREADABLE}")));
        }
        // The type of references has no public name. A field lends its own.
        let mut own = self.file.fields.first().ok_or_else(|| file.broken("it has no fields"))?.value_rep;
        own.0 = reference.0;
        self.file.value(own).map_err(|error| file.broken(format!("{path}: {error:#}")))
    }
}
