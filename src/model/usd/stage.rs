//! Walk over the prims of a USD file: which curves are shown, where, and what is left out.

use glam::DAffine3;
use openusd::sdf::{Specifier, Value};

use super::File;
use super::layer::Layer;
use super::transform;
use crate::util::error::Result;

/// Kinds of prims that hold curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Basis,
    Nurbs,
}

/// A prim of curves that is shown.
pub(super) struct Shown {
    pub path: String,
    pub kind: Kind,
    pub stage_from_own: DAffine3,
}

/// What a file has and the strands lack: numbers, and the first path of each.
#[derive(Default)]
pub(super) struct LeftOut {
    hidden: Tally,
    hermite: Tally,
    instancers: Tally,
    references: Tally,
    variants: usize,
    layers: bool,
}

#[derive(Default)]
struct Tally {
    count: usize,
    first: String,
}

impl Tally {
    fn add(&mut self, path: &str) {
        if self.count == 0 {
            path.clone_into(&mut self.first);
        }
        self.count += 1;
    }

    /// A sentence that begins with the number.
    fn words(&self, one: &str, more: &str, what: &str) -> Option<String> {
        match self.count {
            0 => None,
            1 => Some(format!("{} is {one}, and {what}", self.first)),
            n => Some(format!("{n} prims are {more}, the first {}, and {what}", self.first)),
        }
    }
}

impl LeftOut {
    /// A sentence for each.
    pub fn notes(&self) -> Vec<String> {
        let flatten =
            "these are not followed: write the file again as one, for example with `usdcat --flatten`";
        let mut notes: Vec<String> = [
            self.hidden.words("hidden or a guide", "hidden or guides", "left out"),
            self.hermite.words(
                "of Hermite curves",
                "of Hermite curves",
                "left out: export them as cubic curves",
            ),
            self.instancers.words("a point instancer", "point instancers", "left out with what they place"),
            self.references.words("made of references", "made of references", flatten),
        ]
        .into_iter()
        .flatten()
        .collect();
        if self.layers {
            notes.push(format!("the file has layers under it, and {flatten}"));
        }
        if self.variants > 0 {
            notes.push(format!("{} prims in variants are left out", self.variants));
        }
        notes
    }
}

/// What a prim hands on to its children.
#[derive(Clone)]
struct State {
    path: String,
    stage_from_own: DAffine3,
    is_hidden: bool,
    is_guide: bool,
}

/// Finds the curves of a file at a time.
///
/// # Errors
/// [`Error::Input`](crate::util::error::Error::Input) for values that are broken;
/// [`Error::Memory`](crate::util::error::Error::Memory) for those that are too large.
pub(super) fn walk(layer: &mut Layer, time: Option<f64>, file: &mut File) -> Result<(Vec<Shown>, LeftOut)> {
    let mut out =
        LeftOut { variants: layer.in_variants, layers: layer.has("/", "subLayers"), ..LeftOut::default() };
    let root =
        State { path: String::new(), stage_from_own: DAffine3::IDENTITY, is_hidden: false, is_guide: false };
    let mut shown = Vec::new();
    let mut above = vec![root];
    for path in std::mem::take(&mut layer.prims) {
        let Some((parent, _)) = path.rsplit_once('/') else { continue };
        // Prims stand behind their parents. Without a parent here, an ancestor is left out.
        while above.len() > 1 && above.last().is_some_and(|state| state.path != parent) {
            above.pop();
        }
        let Some(parent) = above.last().filter(|state| state.path == parent).cloned() else { continue };
        let kind = layer.field(&path, "typeName", file)?.as_deref().and_then(transform::word);
        let kind = kind.unwrap_or_default();
        if kind == "PointInstancer" {
            out.instancers.add(&path);
            continue;
        }
        if ["references", "payload", "inheritPaths", "specializes"].iter().any(|own| layer.has(&path, own)) {
            out.references.add(&path);
        }
        let Some(state) = state(layer, path, &parent, time, file)? else { continue };
        let kind = match kind.as_str() {
            "BasisCurves" => Some(Kind::Basis),
            "NurbsCurves" => Some(Kind::Nurbs),
            "HermiteCurves" => {
                out.hermite.add(&state.path);
                None
            }
            _ => None,
        };
        match kind {
            Some(_) if state.is_hidden || state.is_guide => out.hidden.add(&state.path),
            Some(kind) => {
                shown.push(Shown { path: state.path.clone(), kind, stage_from_own: state.stage_from_own });
            }
            None => {}
        }
        above.push(state);
    }
    Ok((shown, out))
}

/// State of a prim; `None` for one that is not defined, or not active.
fn state(
    layer: &mut Layer,
    path: String,
    parent: &State,
    time: Option<f64>,
    file: &mut File,
) -> Result<Option<State>> {
    let is_defined =
        matches!(layer.field(&path, "specifier", file)?.as_deref(), Some(Value::Specifier(Specifier::Def)));
    let is_off = matches!(layer.field(&path, "active", file)?.as_deref(), Some(Value::Bool(false)));
    if !is_defined || is_off {
        return Ok(None);
    }
    let mut word = |name: &str| -> Result<Option<String>> {
        Ok(layer.attribute(&path, name, time, file)?.as_deref().and_then(transform::word))
    };
    let is_invisible = word("visibility")?.as_deref() == Some("invisible");
    // Guides and proxies are for the screen of the program that made the file. The nearest purpose counts.
    let purpose = word("purpose")?;
    let own = purpose.map(|purpose| purpose == "guide" || purpose == "proxy");
    let local = transform::local(layer, &path, time, file)?;
    let from = if local.is_reset { DAffine3::IDENTITY } else { parent.stage_from_own };
    Ok(Some(State {
        stage_from_own: from * local.parent_from_own,
        is_hidden: parent.is_hidden || is_invisible,
        is_guide: own.unwrap_or(parent.is_guide),
        path,
    }))
}
