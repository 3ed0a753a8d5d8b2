//! Builders of a scene's rocks and pools. They take values that the table accepted and check them against one
//! another.

use glam::{DVec3, Vec3};

use super::Values;
use crate::mapping::QuadMap;
use crate::place::{MAX_POOLS, Pool, PoolWaves, Rock, Show, StoneKind, Vertex};
use crate::util::error::{Error, Result};

/// Returns the rocks, relative to `origin`.
pub(super) fn rocks(v: &Values, origin: DVec3, memory: u64) -> Result<Vec<Rock>> {
    let mut rocks = Vec::new();
    for name in v.names("rocks") {
        let key = |what: &str| format!("rocks.{name}.{what}");
        if !v.is_set(&key("corners")) {
            return Err(Error::input(
                format!("rock {name} has no corners"),
                format!("give {} four points", key("corners")),
            ));
        }
        let show = v.choice(&key("show"), Show::from_word);
        if show == Show::Hidden {
            continue;
        }
        let kind = v.choice(&key("kind"), StoneKind::from_word);
        let own = kind.albedo().filter(|_| !v.is_set(&key("color")));
        let color = own.unwrap_or_else(|| v.triple(&key("color")));
        if color.max_element() > 1.0 {
            return Err(Error::input(
                format!("{} = {color} reflects more light than it receives", key("color")),
                "an albedo is at most 1 in each component; write \"#rrggbb\" for numbers up to 255",
            ));
        }
        let corners = v.local_corners(&key("corners"), origin);
        if crosses_itself(corners) {
            return Err(Error::input(
                format!("rock {name} ({}): two of its edges cross", key("corners")),
                "list the corners in order around the edge",
            ));
        }
        rocks.push(Rock {
            holdout: show == Show::Holdout,
            kind,
            grain: v.float(&key("grain")),
            moss: v.float(&key("moss")),
            corners,
            levels: v.count(&key("levels")),
            h: v.float(&key("h")),
            amplitude: v.float(&key("amplitude")),
            bulge: v.float(&key("bulge")),
            seed: v.int(&key("seed")) as u64,
            color,
            color_noise: v.float(&key("color_noise")),
            cavity: v.float(&key("cavity")),
            ridges: v.float(&key("ridges")),
            strata: v.float(&key("strata")),
            strata_height: v.float(&key("strata_height")),
            strata_tilt: v.float(&key("strata_tilt")),
            strata_color: v.float(&key("strata_color")),
            round: v.float(&key("round")),
            border: v.float(&key("border")),
            wet: v.float(&key("wet")),
            wet_reach: v.float(&key("wet_reach")),
            occlusion: v.float(&key("occlusion")),
            shadow: v.float(&key("shadow")),
            name,
        });
    }
    // A vertex and six indices, in host memory and on the GPU.
    let need: u128 =
        rocks.iter().map(|r| r.vertex_count() as u128 * 2 * (size_of::<Vertex>() as u128 + 24)).sum();
    if need > memory as u128 {
        return Err(Error::memory(
            format!("{} rocks", rocks.len()),
            need,
            memory,
            "lower rocks.*.levels or raise --memory",
        ));
    }
    Ok(rocks)
}

/// Returns the pools, relative to `origin`.
pub(super) fn pools(v: &Values, origin: DVec3) -> Result<Vec<Pool>> {
    let mut pools = Vec::new();
    for name in v.names("pools") {
        let key = |what: &str| format!("pools.{name}.{what}");
        if !v.is_set(&key("corners")) {
            return Err(Error::input(
                format!("pool {name} has no corners"),
                format!("give {} four points at one height", key("corners")),
            ));
        }
        let corners = v.local_corners(&key("corners"), origin);
        let fault = |fault: &str| {
            Error::input(
                format!("pool {name} ({}) {fault}", key("corners")),
                "a pool needs four corners of one height, convex, counter-clockwise seen from above",
            )
        };
        let map = QuadMap::new(corners).map_err(|found| fault(found.words()))?;
        let size = corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f32::max);
        if corners.iter().any(|c| (c.y - corners[0].y).abs() > 1e-4 * size) {
            return Err(fault("is not level"));
        }
        if map.n_world.y < 0.0 {
            return Err(fault("faces down"));
        }
        let (color, bottom) = (v.triple(&key("color")), v.triple(&key("bottom")));
        for (what, albedo) in [("color", color), ("bottom", bottom)] {
            if albedo.max_element() > 1.0 {
                return Err(Error::input(
                    format!("{} = {albedo} reflects more light than it receives", key(what)),
                    "an albedo is at most 1 in each component",
                ));
            }
        }
        let show = v.choice(&key("show"), Show::from_word);
        if show == Show::Hidden {
            continue;
        }
        let float = |what: &str| v.float(&key(what));
        pools.push(Pool {
            holdout: show == Show::Holdout,
            corners,
            depth: float("depth"),
            color,
            bottom,
            absorption: v.triple(&key("absorption")),
            waves: v.choice(&key("waves"), PoolWaves::from_word),
            height: float("height"),
            wavelength: float("wavelength"),
            rings: float("rings"),
            period: float("period"),
            foam: float("foam"),
            foam_reach: float("foam_reach"),
            foam_life: float("foam_life"),
            current: float("current"),
            drift: float("drift"),
            seed: v.int(&key("seed")) as u64,
            name,
        });
    }
    if pools.len() > MAX_POOLS {
        return Err(Error::input(
            format!("the scene has {} pools", pools.len()),
            format!("at most {MAX_POOLS}"),
        ));
    }
    Ok(pools)
}

/// Whether the edges of a patch cross, because its corners are not in order around it.
fn crosses_itself(corners: [Vec3; 4]) -> bool {
    let normal = |i: usize| {
        let [before, own, next] = [i + 3, i, i + 1].map(|i| corners[i % 4]);
        (next - own).cross(before - own).normalize_or_zero()
    };
    // Edges that cross turn the patch over at two of its corners. A hollow edge turns one.
    let against = (1..4).filter(|&i| normal(0).dot(normal(i)) < -0.5).count();
    against == 2
}
