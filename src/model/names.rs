//! Names of materials and nodes, as the user writes them.

/// Least likeness of a name to one of the file that makes it worth a suggestion.
const ALIKE: f64 = 0.7;

/// Returns a name with underscores in place of blanks and dots. A key of a scene has neither.
pub fn folded_name(name: &str) -> String {
    name.replace(|c: char| c.is_whitespace() || c == '.', "_")
}

/// Finds `wanted` among names of a file. Where no name is equal, a blank, a dot and an underscore count as
/// the same: Blender writes the material "Wet stone" to OBJ as `Wet_stone`.
///
/// # Errors
/// The name that may be meant, or `None` where none is like it.
pub fn find_name<'a>(
    wanted: &str,
    names: impl IntoIterator<Item = &'a str>,
) -> Result<usize, Option<&'a str>> {
    let names: Vec<&str> = names.into_iter().collect();
    if let Some(found) = names.iter().position(|name| *name == wanted) {
        return Ok(found);
    }
    let low = folded_name(wanted);
    if let Some(found) = names.iter().position(|name| folded_name(name) == low) {
        return Ok(found);
    }
    let low = low.to_lowercase();
    let scores =
        names.iter().map(|name| (strsim::jaro_winkler(&low, &folded_name(name).to_lowercase()), *name));
    let best = scores.max_by(|a, b| a.0.total_cmp(&b.0));
    Err(best.filter(|(score, _)| *score >= ALIKE).map(|(_, name)| name))
}
