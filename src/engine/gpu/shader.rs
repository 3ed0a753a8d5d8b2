//! The text of the shaders. Each file names the files it needs with `#import folder::file`.

use std::collections::HashSet;

macro_rules! files {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))),*]
    };
}

/// Name (without extension) and text of every file in `shaders/`.
pub const FILES: &[(&str, &str)] = files! {
    "layout" "mapping" "mapping/shell" "mapping/shell_path" "walk" "volume/cells"
    "trace/billow" "trace/levels" "trace/lines" "trace/lookup" "trace/matter" "trace/noise" "trace/tear"
    "light/environment" "light/fibre" "light/haze" "light/optical_depth" "light/optics" "light/ramp"
    "light/scatter"
    "light/strand" "light/visibility" "light/shell_depth" "light/shell_light"
    "engine/bare" "engine/gbuffer" "engine/gloss" "engine/integrate" "engine/integrate_light"
    "engine/integrate_shell" "engine/integrate_strands" "engine/opaque" "engine/paint" "engine/pool"
    "engine/pool_field" "engine/sheets_many" "engine/sheets_one" "engine/shell_scatter"
    "engine/shell_visibility" "engine/stone"
    "picture/resolve"
};

/// Iterates over the files that the `#import` lines of a text name, written as in [`FILES`].
pub fn imports(text: &str) -> impl Iterator<Item = String> {
    text.lines().filter_map(|line| line.strip_prefix("#import ")).map(|path| path.trim().replace("::", "/"))
}

/// Returns the text of a stage with everything it imports, directly or indirectly. Each file appears once,
/// before the first file that imports it. Files may import one another, because WGSL ignores the order of
/// declarations.
///
/// # Panics
/// If an import names no file. The shaders are part of the program, and tests resolve each of them.
pub fn resolve(stage: &str) -> String {
    fn add(text: &str, known: &mut HashSet<String>, whole: &mut String) {
        for name in imports(text) {
            let file = FILES.iter().find(|(file, _)| **file == *name);
            let (_, imported) = file.unwrap_or_else(|| panic!("no shader {name} to import"));
            if known.insert(name) {
                add(imported, known, whole);
            }
        }
        let own = text.lines().filter(|line| !line.starts_with("#import "));
        own.for_each(|line| whole.extend([line, "\n"]));
    }
    let mut whole = String::new();
    add(stage, &mut HashSet::new(), &mut whole);
    whole
}
