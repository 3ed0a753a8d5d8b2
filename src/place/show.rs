//! What a picture shows of a part of the surroundings.

use crate::util::words::words;

/// Choice of what a picture shows of a rock or a pool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// The thing itself.
    #[default]
    Visible,
    /// A hole in its shape, where the picture has an alpha channel; otherwise the thing itself.
    Holdout,
    /// Nothing: the thing is left out of the scene.
    Hidden,
}

words! { Show { Visible => "visible", Holdout => "holdout", Hidden => "hidden" } }
