//! Transforms of prims: the operations that `xformOpOrder` lists.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use openusd::sdf::Value;

use super::File;
use super::layer::Layer;
use crate::util::error::Result;

/// Mark of an operation whose inverse counts.
const INVERSE: &str = "!invert!";
/// Entry that cuts a prim from its parents.
const RESET: &str = "!resetXformStack!";

/// Transform of a prim.
pub(super) struct Local {
    /// Transform to the parent's space, or to the stage's.
    pub parent_from_own: DAffine3,
    /// Whether the transforms of the parents do not count.
    pub is_reset: bool,
}

/// Reads the transform of a prim. USD writes vectors as rows; the first operation in the list is the
/// outermost.
///
/// # Errors
/// [`Error::Input`](crate::util::error::Error::Input) for values that are broken, and for operations that are
/// not known.
pub(super) fn local(layer: &mut Layer, prim: &str, time: Option<f64>, file: &mut File) -> Result<Local> {
    let mut all = Local { parent_from_own: DAffine3::IDENTITY, is_reset: false };
    let order = match layer.attribute(prim, "xformOpOrder", time, file)? {
        Some(value) => tokens(&value),
        None => return Ok(all),
    };
    for entry in &order {
        if entry == RESET {
            all = Local { parent_from_own: DAffine3::IDENTITY, is_reset: true };
            continue;
        }
        let name = entry.strip_prefix(INVERSE).unwrap_or(entry);
        let kind = name.strip_prefix("xformOp:").unwrap_or(name).split(':').next().unwrap_or_default();
        let Some(value) = layer.attribute(prim, name, time, file)? else { continue };
        let one = operation(kind, &value).ok_or_else(|| {
            file.broken(format!("{prim}: the transform {entry:?} is not known, or not of its type"))
        })?;
        let one = if name == entry { one } else { one.inverse() };
        all.parent_from_own *= one;
    }
    if all.parent_from_own.is_finite() {
        return Ok(all);
    }
    Err(file.broken(format!("{prim}: its transform is not finite")))
}

/// Texts of an array of tokens.
fn tokens(value: &Value) -> Vec<String> {
    match value {
        Value::TokenVec(tokens) => tokens.iter().map(|token| token.as_str().to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// Transform of one operation.
fn operation(kind: &str, value: &Value) -> Option<DAffine3> {
    let radians = |value: &Value| number(value).map(f64::to_radians);
    let axis = |letter: u8| [DVec3::X, DVec3::Y, DVec3::Z][usize::from(letter - b'X')];
    Some(match (kind, kind.as_bytes()) {
        ("translate", _) => DAffine3::from_translation(triple(value)?),
        ("scale", _) => DAffine3::from_scale(triple(value)?),
        ("orient", _) => DAffine3::from_quat(turn(value)?),
        ("transform", _) => match value {
            Value::Matrix4d(rows) => DAffine3::from_mat4(DMat4::from_cols_array(&rows.0)),
            _ => return None,
        },
        (_, [b't', b'r', b'a', b'n', b's', b'l', b'a', b't', b'e', letter @ b'X'..=b'Z']) => {
            DAffine3::from_translation(axis(*letter) * number(value)?)
        }
        (_, [b's', b'c', b'a', b'l', b'e', letter @ b'X'..=b'Z']) => {
            DAffine3::from_scale(DVec3::ONE + axis(*letter) * (number(value)? - 1.0))
        }
        (_, [b'r', b'o', b't', b'a', b't', b'e', letter @ b'X'..=b'Z']) => {
            DAffine3::from_axis_angle(axis(*letter), radians(value)?)
        }
        (_, [b'r', b'o', b't', b'a', b't', b'e', order @ ..]) if order.len() == 3 => {
            // The first letter turns first.
            let angles = triple(value)?.to_array().map(f64::to_radians);
            let mut all = DMat3::IDENTITY;
            for letter in order {
                let which = usize::from(letter.checked_sub(b'X').filter(|which| *which < 3)?);
                all = DMat3::from_axis_angle(axis(*letter), angles[which]) * all;
            }
            DAffine3::from_mat3(all)
        }
        _ => return None,
    })
}

/// A number of any precision.
pub(super) fn number(value: &Value) -> Option<f64> {
    Some(match value {
        Value::Half(x) => f64::from(x.to_f32()),
        Value::Float(x) => f64::from(*x),
        Value::Double(x) => *x,
        // Samples of text have no type.
        Value::Int(x) => f64::from(*x),
        Value::Int64(x) => *x as f64,
        _ => return None,
    })
}

/// A word. Samples of text have no type, so it may be a string.
pub(super) fn word(value: &Value) -> Option<String> {
    match value {
        Value::Token(word) => Some(word.as_str().to_owned()),
        Value::String(word) => Some(word.clone()),
        _ => None,
    }
}

fn triple(value: &Value) -> Option<DVec3> {
    Some(match value {
        Value::Vec3h(v) => DVec3::new(v.x.to_f64(), v.y.to_f64(), v.z.to_f64()),
        Value::Vec3f(v) => DVec3::new(v.x.into(), v.y.into(), v.z.into()),
        Value::Vec3d(v) => DVec3::new(v.x, v.y, v.z),
        _ => return None,
    })
}

fn turn(value: &Value) -> Option<DQuat> {
    let raw = match value {
        Value::Quath(q) => DQuat::from_xyzw(q.x.to_f64(), q.y.to_f64(), q.z.to_f64(), q.w.to_f64()),
        Value::Quatf(q) => DQuat::from_xyzw(q.x.into(), q.y.into(), q.z.into(), q.w.into()),
        Value::Quatd(q) => DQuat::from_xyzw(q.x, q.y, q.z, q.w),
        _ => return None,
    };
    let length = raw.length();
    (length > 0.0 && length.is_finite()).then(|| raw / length)
}
