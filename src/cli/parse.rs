//! Values of options as users write them.

use crate::scene::{Kind, Param, fraction};

/// Result of a parser; the error tells how to write the value.
type Parsed<T> = std::result::Result<T, String>;

/// Parses a number of seconds, up to one day.
pub fn seconds(text: &str) -> Parsed<f64> {
    match text.parse::<f64>() {
        Ok(s) if (0.0..=86_400.0).contains(&s) => Ok(s),
        _ => Err("give a number of seconds from 0 to 86400".into()),
    }
}

/// Frame with the largest number; the smallest has the opposite sign.
pub const LAST_FRAME: i32 = 999_999_999;

/// Parses the number of a frame.
pub fn frame(text: &str) -> Parsed<i32> {
    let given = text.trim().parse().ok().filter(|n| (-LAST_FRAME..=LAST_FRAME).contains(n));
    given.ok_or_else(|| format!("give a whole number from -{LAST_FRAME} to {LAST_FRAME}"))
}

/// Parses a whole number from MIN to MAX.
pub fn within<const MIN: u32, const MAX: u32>(text: &str) -> Parsed<u32> {
    let given = text.trim().parse().ok().filter(|n| (MIN..=MAX).contains(n));
    given.ok_or_else(|| format!("give a whole number from {MIN} to {MAX}"))
}

/// Parses a time in whole minutes.
pub fn minutes(text: &str) -> Parsed<u32> {
    const MOST: u32 = 1_000_000;
    within::<1, MOST>(text)
        .map_err(|_| format!("give a whole number of minutes from 1 to {MOST}, such as 90"))
}

/// Parses a whole number in the range of a parameter, which an option is short for.
fn of_parameter(key: &str, text: &str) -> Parsed<u32> {
    let param = Param::find(key).ok_or("unknown parameter")?;
    let fits = |n: &u32| matches!(param.kind, Kind::Int(min, max, _) if (min..=max).contains(&i64::from(*n)));
    let given = text.trim().parse().ok().filter(fits);
    given.ok_or_else(|| format!("give a whole number from {}", param.range()))
}

/// Parses a number of samples.
pub fn samples(text: &str) -> Parsed<u32> {
    of_parameter("image.samples", text)
}

/// Parses the length of a loop.
pub fn period(text: &str) -> Parsed<u32> {
    of_parameter("animate.loop", text)
}

/// Parses a frame rate, and returns it as `--set` takes it.
pub fn fps(text: &str) -> Parsed<String> {
    let (text, param) = (text.trim(), Param::find("animate.fps").ok_or("unknown parameter")?);
    let fits = |rate: f64| matches!(param.kind, Kind::Float(min, max, _) if (min..=max).contains(&rate));
    match text.parse::<f64>() {
        Ok(rate) if fits(rate) => return Ok(rate.to_string()),
        Err(_) if fraction(text).is_some_and(fits) => return Ok(text.to_owned()),
        _ => {}
    }
    let point = text.replace(',', ".");
    Err(match point.parse::<f64>() {
        Ok(rate) if point != text && fits(rate) => format!("the decimal mark is a point: write {point}"),
        _ => format!("give a rate from {}, such as 25, 23.976 or 24000/1001", param.range()),
    })
}

/// Parses `WIDTHxHEIGHT`; the sign between them may also be `X` or `×`.
pub fn size(text: &str) -> Parsed<[u32; 2]> {
    let parts = text.split_once(['x', 'X', '×']);
    let sides = parts.and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    let [w, h]: [u32; 2] = sides.ok_or("give WIDTHxHEIGHT in pixels, such as 1280x720")?;
    let side = |key: &str, side: u32| {
        of_parameter(key, &side.to_string()).map_err(|how| format!("{how} for each side, such as 1280x720"))
    };
    Ok([side("image.width", w)?, side("image.height", h)?])
}

/// Parses `X,Y,W,H`.
pub fn crop(text: &str) -> Parsed<[u32; 4]> {
    let numbers = text.split(',').map(|n| n.trim().parse().ok()).collect::<Option<Vec<u32>>>();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| "give column, row, width and height in pixels, such as 0,0,640,360".into())
}

/// Parses an amount of memory, and returns bytes. A number alone counts MiB. `KiB`, `MiB`, `GiB` and `TiB`
/// are powers of 1024, and so are the letters alone; `KB`, `MB`, `GB` and `TB` are powers of 1000.
pub fn memory(text: &str) -> Parsed<u64> {
    let how = || "give an amount such as 4GiB, 4GB or 512MiB; a number alone counts MiB".to_owned();
    let text = text.trim();
    let unit_at = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = (text[..unit_at].trim_end(), text[unit_at..].to_lowercase());
    let bytes: u64 = match unit.as_str() {
        "b" => 1,
        "k" | "kib" => 1 << 10,
        "" | "m" | "mib" => 1 << 20,
        "g" | "gib" => 1 << 30,
        "t" | "tib" => 1 << 40,
        "kb" => 1_000,
        "mb" => 1_000_000,
        "gb" => 1_000_000_000,
        "tb" => 1_000_000_000_000,
        _ => return Err(how()),
    };
    if let Ok(whole) = number.parse::<u64>() {
        return Ok(whole.saturating_mul(bytes));
    }
    let amount = number.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0).ok_or_else(how)?;
    // A float that is too large becomes the largest number.
    Ok((amount * bytes as f64) as u64)
}

/// Parses the memory of a farm's shard as [`memory`] does, and returns whole MiB, rounded up.
pub fn shard_memory(text: &str) -> Parsed<u32> {
    let mib = memory(text)?.div_ceil(1 << 20);
    let given = u32::try_from(mib).ok().filter(|mib| (1..=1_000_000_000).contains(mib));
    given.ok_or_else(|| "give from 1 to 1000000000 MiB".into())
}

/// Parses a whole number.
pub fn whole<T: std::str::FromStr>(text: &str) -> Parsed<T> {
    text.trim().parse().map_err(|_| "give a whole number, 0 or more, in digits".into())
}

/// Parses the longest wait for a piece of work, more than no time.
pub fn wait(text: &str) -> Parsed<f64> {
    let given = seconds(text).ok().filter(|&s| s > 0.0);
    given.ok_or_else(|| "give a number of seconds above 0, up to 86400".into())
}

/// Parses a tolerance or error.
pub fn tolerance<T: std::str::FromStr + PartialOrd + Default>(text: &str) -> Parsed<T> {
    let given = text.parse::<T>().ok().filter(|x| *x >= T::default());
    given.ok_or_else(|| "give a number, 0 or more".into())
}

/// Parses a share.
pub fn share(text: &str) -> Parsed<f64> {
    let given = tolerance(text).ok().filter(|&x: &f64| x <= 1.0);
    given.ok_or_else(|| "give a share from 0 to 1, such as 0.001".into())
}
