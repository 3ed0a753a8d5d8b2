//! Movies decode to the frames that they were made from. An interrupted movie leaves no file.

use std::fs::{self, File};
use std::io::BufReader;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use taki::output::movie::{Codec, Movie, MovieKind, MovieOptions, Video, mark_of};
use taki::util::error::{Error, Result};
use taki::util::monitor::Monitor;
use tempfile::{TempDir, tempdir};

const KINDS: [(MovieKind, &str); 4] = [
    (MovieKind::Gif, "m.gif"),
    (MovieKind::Apng, "m.apng"),
    (MovieKind::Mp4, "m.mp4"),
    (MovieKind::Webm, "m.webm"),
];

/// Videos in all codecs and depths: file, codec, depth, and what ffprobe calls codec, profile, tag and
/// samples.
const VIDEOS: [(&str, Codec, u8, &str); 9] = [
    ("m.mp4", Codec::H264, 8, "h264 High avc1 yuv420p"),
    ("m.mp4", Codec::H264, 10, "h264 High 10 avc1 yuv420p10le"),
    ("m.mp4", Codec::H265, 8, "hevc Main hvc1 yuv420p"),
    ("m.mp4", Codec::H265, 10, "hevc Main 10 hvc1 yuv420p10le"),
    ("m.mov", Codec::Prores, 10, "prores HQ apch yuv422p10le"),
    ("m.mov", Codec::H264, 8, "h264 High avc1 yuv420p"),
    ("m.mov", Codec::H265, 10, "hevc Main 10 hvc1 yuv420p10le"),
    ("m.webm", Codec::Vp9, 8, "vp9 Profile 0 [0][0][0][0] yuv420p"),
    ("m.webm", Codec::Vp9, 10, "vp9 Profile 2 [0][0][0][0] yuv420p10le"),
];

/// Largest mean absolute error of a channel of a video, in 255ths, from 4:2:0 and the encoder's quantiser.
/// With the matrix of BT.601, or with full range taken for limited range, these frames would be off by 5 to
/// 15.
const VIDEO_ERROR: f64 = 2.5;

/// Largest mean absolute error of a GIF: a smooth picture in 255 colours, with the grain of the dither.
const GIF_ERROR: f64 = 4.0;

fn options(size: [u32; 2], fps: f64, frames: u64) -> MovieOptions {
    MovieOptions { size, fps, frames, repeat: true, mark: 7, video: None }
}

/// Frame `i`: smooth and coloured, with a bright bar that moves down and a part that never changes.
fn frame([width, height]: [u32; 2], i: u64) -> Vec<u8> {
    let pixel = |x: u32, y: u32| {
        let (u, v) = (x as f64 / width as f64, y as f64 / height as f64);
        let bar = if u > 0.5 && ((v * 4.0 - i as f64 * 0.25).rem_euclid(4.0)) < 0.6 { 60.0 } else { 0.0 };
        [40.0 + 110.0 * u + bar, 60.0 + 90.0 * v + bar, 150.0 - 80.0 * u * v + bar].map(|c| c as u8)
    };
    (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect()
}

fn write(path: &Path, kind: MovieKind, options: &MovieOptions) -> Result<()> {
    let mut movie = Movie::create(path, kind, options)?;
    (0..options.frames).try_for_each(|i| movie.push(&frame(options.size, i)))?;
    movie.finish()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn mean_error(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b) as f64).sum::<f64>() / a.len() as f64
}

/// Plays a GIF. Returns its canvases (R, G, B), delays in hundredths of a second, and repetition.
fn play_gif(path: &Path) -> (Vec<Vec<u8>>, Vec<u16>, gif::Repeat) {
    let mut decoder = gif::Decoder::new(BufReader::new(File::open(path).unwrap())).unwrap();
    let width = decoder.width() as usize;
    let palette = decoder.global_palette().unwrap().to_vec();
    let mut canvas = vec![0; width * decoder.height() as usize * 3];
    let (mut canvases, mut delays) = (Vec::new(), Vec::new());
    while let Some(f) = decoder.read_next_frame().unwrap() {
        assert!(f.palette.is_none(), "one palette for all frames");
        for (i, index) in f.buffer.iter().enumerate() {
            let (x, y) = (f.left as usize + i % f.width as usize, f.top as usize + i / f.width as usize);
            if Some(*index) != f.transparent {
                canvas[(y * width + x) * 3..][..3].copy_from_slice(&palette[*index as usize * 3..][..3]);
            }
        }
        delays.push(f.delay);
        canvases.push(canvas.clone());
    }
    (canvases, delays, decoder.repeat())
}

/// Decodes a video to R, G, B with ffmpeg.
fn play_video(path: &Path) -> Vec<u8> {
    let mut ffmpeg = Command::new("ffmpeg");
    // ffmpeg takes the matrix from the file's own tags, so a wrong tag shows.
    ffmpeg.args(["-loglevel", "error", "-nostdin", "-i"]).arg(path);
    let convert = "scale=flags=bicubic+accurate_rnd+full_chroma_int";
    ffmpeg.args(["-vf", convert, "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]);
    let out = ffmpeg.output().expect("tests/run installs ffmpeg");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

/// Output of ffprobe for fields of the stream.
fn probe(path: &Path, fields: &str) -> String {
    let mut ffprobe = Command::new("ffprobe");
    ffprobe.args(["-v", "error", "-count_frames", "-of", "default=nw=1", "-show_entries"]);
    let out = ffprobe.arg(fields).arg(path).output().expect("tests/run installs ffmpeg");
    assert!(out.status.success());
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn kinds_are_told_by_the_extension() {
    for (kind, name) in KINDS {
        assert_eq!(MovieKind::of(Path::new(name)), Some(kind));
        assert_eq!(MovieKind::of(Path::new(&name.to_uppercase())), Some(kind));
    }
    for name in ["m.png", "m", ".gif", "m.gif.txt", "gif"] {
        assert_eq!(MovieKind::of(Path::new(name)), None, "{name}");
    }
}

#[test]
fn a_gif_shows_its_frames_for_the_right_time() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("m.gif");
    let options = options([67, 45], 24.0, 13);
    write(&path, MovieKind::Gif, &options).unwrap();
    let (canvases, delays, repeat) = play_gif(&path);
    assert_eq!((canvases.len(), repeat), (13, gif::Repeat::Infinite));
    let seconds = delays.iter().map(|d| *d as f64).sum::<f64>() / 100.0;
    assert!((seconds - 13.0 / 24.0).abs() <= 0.01, "{seconds}");
    let mut grain = Vec::new();
    for (i, canvas) in canvases.iter().enumerate() {
        let true_frame = frame(options.size, i as u64);
        let error = mean_error(canvas, &true_frame);
        assert!(error < GIF_ERROR, "frame {i}: {error}");
        assert!(mean_error(canvas, &frame(options.size, i as u64 + 1)) > error + 1.0, "it is this frame");
        // The left half never changes, so none of its pixels may flicker.
        grain.push(canvas.chunks(67 * 3).flat_map(|row| row[..33 * 3].to_vec()).collect::<Vec<u8>>());
    }
    assert!(grain.iter().all(|g| *g == grain[0]));
    assert_eq!(names(dir.path()), ["m.gif"]);
}

#[test]
fn a_video_has_the_exact_rate_of_film() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("m.mp4");
    // The float32 that a scene keeps of 24000/1001 is 23.976025; 23.976 is another rate.
    for (fps, rate) in
        [(23.976025, "24000/1001"), (29.97003, "30000/1001"), (25.0, "25/1"), (23.976, "2997/125")]
    {
        write(&path, MovieKind::Mp4, &options([16, 16], fps, 2)).unwrap();
        let told = probe(&path, "stream=r_frame_rate");
        assert_eq!(told.trim(), format!("r_frame_rate={rate}"), "{fps}");
    }
}

#[test]
fn a_gif_of_few_colours_is_exact() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("m.gif");
    let options = MovieOptions { size: [16, 16], fps: 10.0, frames: 3, repeat: false, mark: 7, video: None };
    let mut movie = Movie::create(&path, MovieKind::Gif, &options).unwrap();
    let shades = |i: u8| (0..=255).flat_map(|k: u8| [k / 4, k / 4 + i, 7]).collect::<Vec<u8>>();
    let frames = [shades(0), shades(1), shades(1)];
    frames.iter().for_each(|f| movie.push(f).unwrap());
    movie.finish().unwrap();
    let (canvases, delays, repeat) = play_gif(&path);
    assert_eq!((canvases.as_slice(), delays.as_slice()), (&frames[..], &[10, 10, 10][..]));
    assert_eq!(repeat, gif::Repeat::Finite(0));
}

#[test]
fn an_animated_png_keeps_every_bit() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("m.apng");
    for (repeat, frames) in [(true, 5), (false, 2), (true, 1)] {
        let options = MovieOptions { size: [19, 7], fps: 23.976, frames, repeat, mark: 7, video: None };
        write(&path, MovieKind::Apng, &options).unwrap();
        let decoder = png::Decoder::new(BufReader::new(File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let control = reader.info().animation_control;
        assert_eq!(
            control.map(|c| (c.num_frames, c.num_plays)),
            (frames > 1).then_some((frames as u32, !repeat as u32))
        );
        let mut seconds = 0.0;
        for i in 0..frames {
            let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut rgb).unwrap();
            assert_eq!(rgb, frame(options.size, i));
            let control = reader.info().frame_control;
            seconds += control.map_or(0.0, |c| c.delay_num as f64 / c.delay_den as f64);
        }
        assert!(frames == 1 || (seconds - frames as f64 / 23.976).abs() < 1e-9, "{seconds}");
    }
}

#[test]
fn videos_decode_to_their_frames_by_their_own_tags() {
    let dir = tempdir().unwrap();
    for (kind, name) in &KINDS[2..] {
        for size in [[96, 64], [67, 45]] {
            let path = dir.path().join(name);
            let options = options(size, 24.0, 9);
            write(&path, *kind, &options).unwrap();
            let even = size.map(|side| side.next_multiple_of(2));
            let fields = "stream=width,height,avg_frame_rate,nb_read_frames,pix_fmt,color_range,color_space,\
                          color_transfer,color_primaries";
            let words = probe(&path, fields);
            let [width, height] = even;
            let expected = format!(
                "width={width}\nheight={height}\npix_fmt=yuv420p\ncolor_range=tv\ncolor_space=bt709\n\
                 color_transfer=bt709\ncolor_primaries=bt709\navg_frame_rate=24/1\nnb_read_frames=9\n"
            );
            assert_eq!(words, expected, "{name} {size:?}");
            let played = play_video(&path);
            let bytes = (width * height * 3) as usize;
            assert_eq!(played.len(), 9 * bytes);
            for (i, picture) in played.chunks(bytes).enumerate() {
                // The column and row that are added to odd sides repeat the last ones. Only the given part is
                // compared.
                let rows = picture.chunks(width as usize * 3).take(size[1] as usize);
                let given: Vec<u8> = rows.flat_map(|row| row[..size[0] as usize * 3].to_vec()).collect();
                let true_frame = frame(size, i as u64);
                let error = mean_error(&given, &true_frame);
                assert!(error < VIDEO_ERROR, "{name} {size:?} frame {i}: {error}");
                assert!(mean_error(&given, &frame(size, i as u64 + 1)) > error + 1.0, "it is this frame");
                let [mut sum, mut edge] = [[0i64; 3]; 2];
                for (a, b) in given.as_chunks::<3>().0.iter().zip(true_frame.as_chunks::<3>().0) {
                    (0..3).for_each(|c| sum[c] += a[c] as i64 - b[c] as i64);
                }
                for row in picture.chunks(width as usize * 3) {
                    let n = row.len();
                    (0..3).for_each(|c| edge[c] += row[n - 6 + c].abs_diff(row[n - 3 + c]) as i64);
                }
                let pixels = given.len() as f64 / 3.0;
                assert!(sum.iter().all(|s| (*s as f64 / pixels).abs() < 1.0), "a tint: {sum:?} of {pixels}");
                assert!(edge.iter().all(|e| (*e as f64) < 12.0 * height as f64), "{edge:?}");
            }
        }
    }
}

/// Eight saturated colours in fields of 32×32, with the samples of a movie's depth.
fn fields(options: &MovieOptions) -> (Vec<u16>, Vec<u8>) {
    let colours: [[u16; 3]; 8] = [
        [65_535, 0, 0],
        [0, 65_535, 0],
        [0, 0, 65_535],
        [65_535, 65_535, 0],
        [0, 60_000, 60_000],
        [50_000, 0, 50_000],
        [65_535, 65_535, 65_535],
        [20_000, 40_000, 10_000],
    ];
    let samples: Vec<u16> = (0..32).flat_map(|_| colours.iter().flat_map(|c| c.repeat(32))).collect();
    let deep = options.encoding().bits == 16;
    let bytes =
        samples.iter().flat_map(|x| if deep { x.to_be_bytes().to_vec() } else { vec![(x >> 8) as u8] });
    let bytes = bytes.collect();
    (samples, bytes)
}

#[test]
fn every_codec_and_depth_says_what_it_holds_and_holds_it() {
    let dir = tempdir().unwrap();
    for (name, codec, bits, words) in VIDEOS {
        let path = dir.path().join(name);
        let kind = MovieKind::of(&path).unwrap();
        let video = Some(Video { codec, bits });
        assert!(kind.video(Some(codec), Some(bits)) == video);
        let options = MovieOptions { video, ..options([256, 32], 24.0, 3) };
        let (samples, bytes) = fields(&options);
        let mut movie = Movie::create(&path, kind, &options).unwrap();
        (0..3).for_each(|_| movie.push(&bytes).unwrap());
        movie.finish().unwrap();
        assert_eq!(mark_of(&path), Some(7), "{name} {codec:?}");
        let fields = "stream=codec_name,profile,codec_tag_string,pix_fmt,color_range,color_space,\
                      color_transfer,color_primaries";
        let told = probe(&path, fields);
        let value =
            |key: &str| told.lines().find_map(|line| line.strip_prefix(&format!("{key}="))).unwrap_or("");
        let got = ["codec_name", "profile", "codec_tag_string", "pix_fmt"].map(value).join(" ");
        assert_eq!(got, words);
        let colours = ["color_range", "color_space", "color_transfer", "color_primaries"].map(value);
        assert_eq!(colours, ["tv", "bt709", "bt709", "bt709"], "{name} {codec:?} {bits}");
        // Decoded by the stated matrix, whatever the player would guess.
        let mut ffmpeg = Command::new("ffmpeg");
        ffmpeg.args(["-loglevel", "error", "-nostdin", "-i"]).arg(&path);
        let convert =
            "scale=in_color_matrix=bt709:in_range=limited:out_range=full:flags=accurate_rnd+full_chroma_int";
        ffmpeg.args(["-vf", convert, "-f", "rawvideo", "-pix_fmt", "rgb48be", "pipe:1"]);
        let out = ffmpeg.output().expect("tests/run installs ffmpeg");
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        assert_eq!(out.stdout.len(), 3 * samples.len() * 2);
        let played: Vec<u16> = out.stdout.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
        for field in 0..8 {
            // The middle of the field, away from the edges of chroma.
            let at = 3 * (16 * 256 + 32 * field + 16);
            for c in 0..3 {
                let error = f64::from(played[at + c].abs_diff(samples[at + c])) / 257.0;
                // BT.601 would be off by 20 to 50.
                assert!(error <= 4.0, "{name} {codec:?} {bits}: field {field} channel {c} is off by {error}");
            }
        }
    }
}

#[test]
fn a_movie_of_ten_bits_has_more_steps_than_eight_can_hold() {
    let dir = tempdir().unwrap();
    for (name, codec, bits, _) in VIDEOS {
        let path = dir.path().join(name);
        let options = MovieOptions { video: Some(Video { codec, bits }), ..options([1024, 32], 24.0, 2) };
        let deep = options.encoding().bits == 16;
        assert_eq!(deep, bits == 10);
        let row = (0..1024u32).map(|x| (x * 64) as u16);
        let row: Vec<u8> = match deep {
            true => row.flat_map(|x| x.to_be_bytes().repeat(3)).collect(),
            false => row.flat_map(|x| [(x >> 8) as u8; 3]).collect(),
        };
        let mut movie = Movie::create(&path, MovieKind::of(&path).unwrap(), &options).unwrap();
        (0..2).for_each(|_| movie.push(&row.repeat(32)).unwrap());
        movie.finish().unwrap();
        let mut ffmpeg = Command::new("ffmpeg");
        ffmpeg.args(["-loglevel", "error", "-nostdin", "-i"]).arg(&path);
        let out = ffmpeg.args(["-vf", "extractplanes=y", "-f", "rawvideo", "pipe:1"]).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let size = if bits == 8 { 1 } else { 2 };
        let luma: std::collections::BTreeSet<&[u8]> = out.stdout[..1024 * size].chunks(size).collect();
        // 8 bits of limited range have 220 steps.
        assert_eq!(luma.len() > 400, deep, "{name} {codec:?} {bits}: {} steps", luma.len());
    }
}

#[test]
fn an_mp4_starts_with_its_index_and_holds_no_time() {
    let dir = tempdir().unwrap();
    let (a, b) = (dir.path().join("a.mp4"), dir.path().join("b.mp4"));
    let options = options([64, 64], 30.0, 4);
    for (_, codec, bits, _) in VIDEOS.into_iter().filter(|(name, ..)| *name != "m.webm") {
        let kind = if codec == Codec::Prores { MovieKind::Mov } else { MovieKind::Mp4 };
        let options = MovieOptions { video: Some(Video { codec, bits }), ..options };
        for path in [&a, &b] {
            let mut movie = Movie::create(path, kind, &options).unwrap();
            let deep = options.encoding().pixel_bytes() / 3;
            (0..4).for_each(|i| movie.push(&frame(options.size, i).repeat(deep)).unwrap());
            movie.finish().unwrap();
        }
        let bytes = fs::read(&a).unwrap();
        let find = |word: &[u8]| bytes.windows(word.len()).position(|w| w == word).unwrap();
        assert!(find(b"moov") < find(b"mdat"), "{codec:?}");
        assert!(bytes == fs::read(&b).unwrap(), "equal frames are equal files: {codec:?} {bits}");
    }
}

#[test]
fn what_a_format_cannot_hold_is_known_before_work() {
    let dir = tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let cases = [
        (MovieKind::Gif, at("m.gif"), options([65_536, 1], 24.0, 2), "65535 pixels a side"),
        (MovieKind::Mp4, at("m.mp4"), options([16_385, 2], 24.0, 2), "16384 pixels a side"),
        (MovieKind::Gif, at("m.gif"), options([8, 8], 60.0, 2), "60 frames a second; choose 0.01 to 50"),
        (MovieKind::Apng, at("m.apng"), options([8, 8], f64::NAN, 2), "NaN frames a second"),
        (MovieKind::Webm, at("m.webm"), options([8, 8], 0.0, 2), "0 frames a second"),
        (MovieKind::Apng, at("m.apng"), options([8, 8], 24.0, 1 << 32), "4294967296 frames"),
        (MovieKind::Gif, at("m.gif"), options([8, 8], 24.0, 0), "0 frames of 8x8"),
        (MovieKind::Gif, at("m.gif"), options([0, 8], 24.0, 1), "1 frames of 0x8"),
        (MovieKind::Gif, at("absent/m.gif"), options([8, 8], 24.0, 1), "make the folder"),
        (MovieKind::Mp4, at("absent/m.mp4"), options([8, 8], 24.0, 1), "make the folder"),
    ];
    let video =
        |codec, bits| MovieOptions { video: Some(Video { codec, bits }), ..options([32, 15], 24.0, 1) };
    let videos = [
        (MovieKind::Mp4, at("m.mp4"), video(Codec::H265, 8), "32x15 is less than the 16 pixels a side"),
        (MovieKind::Mp4, at("m.mp4"), video(Codec::Prores, 10), "MP4 cannot hold prores with 10 bits"),
        (MovieKind::Mov, at("m.mov"), video(Codec::Prores, 8), "MOV cannot hold prores with 8 bits"),
        (MovieKind::Gif, at("m.gif"), video(Codec::H264, 8), "GIF cannot hold h264"),
    ];
    for (kind, path, options, words) in cases.into_iter().chain(videos) {
        let e = Movie::create(&path, kind, &options).err().expect(words);
        assert_eq!(e.exit_code(), 73, "{e}");
        assert!(e.to_string().contains(words), "{e}");
    }
    assert!(names(dir.path()).is_empty());
}

#[test]
fn frames_that_are_not_as_announced_are_refused() {
    let dir = tempdir().unwrap();
    for (kind, name) in KINDS {
        let path = dir.path().join(name);
        let options = options([8, 6], 10.0, 2);
        let mut movie = Movie::create(&path, kind, &options).unwrap();
        assert_eq!(movie.push(&[0; 5]).unwrap_err().exit_code(), 74);
        movie.push(&frame(options.size, 0)).unwrap();
        let e = movie.finish().unwrap_err();
        assert!(e.to_string().contains("1 of 2 frames"), "{e}");
        let mut movie = Movie::create(&path, kind, &options).unwrap();
        (0..2).for_each(|i| movie.push(&frame(options.size, i)).unwrap());
        assert!(movie.push(&frame(options.size, 2)).is_err());
        drop(movie);
        assert!(names(dir.path()).is_empty(), "{name}");
    }
}

/// Number of running processes with a path below `dir` on their command line.
fn running(dir: &Path) -> usize {
    let lines =
        fs::read_dir("/proc").unwrap().flatten().filter_map(|e| fs::read(e.path().join("cmdline")).ok());
    let word = dir.as_os_str().as_encoded_bytes();
    lines.filter(|line| line.windows(word.len()).any(|w| w == word)).count()
}

#[test]
fn a_movie_given_up_leaves_nothing() {
    let dir = tempdir().unwrap();
    for (kind, name) in KINDS {
        let path = dir.path().join(name);
        fs::write(&path, "an older movie").unwrap();
        let options = options([64, 48], 24.0, 1000);
        let mut movie = Movie::create(&path, kind, &options).unwrap();
        for i in 0..30 {
            movie.push(&frame(options.size, i)).unwrap();
        }
        assert_eq!(names(dir.path()).len(), 2, "the old movie and the one being made");
        drop(movie);
        assert_eq!(names(dir.path()), [name]);
        assert_eq!(fs::read(&path).unwrap(), b"an older movie");
        fs::remove_file(path).unwrap();
    }
}

/// A program that claims that it can encode, and then does `what`.
fn fake(dir: &TempDir, what: &str) -> PathBuf {
    let path = dir.path().join("ffmpeg-fake");
    let script = format!(
        "#!/bin/sh\ncase \"$*\" in *-encoders*) echo ' V....D libx264 H.264'; exit 0;; esac\n{what}\n"
    );
    fs::write(&path, script).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

#[test]
fn an_ffmpeg_that_fails_tells_why_and_leaves_nothing() {
    let (dir, tools) = (tempdir().unwrap(), tempdir().unwrap());
    let path = dir.path().join("m.mp4");
    let options = options([128, 128], 24.0, 40);
    let cases = [
        (
            "head -c 100000 >/dev/null; echo 'first' >&2; echo 'the encoder ran hot' >&2; exit 1",
            "ffmpeg: the encoder ran hot",
        ),
        ("cat >/dev/null; exit 3", "exit status: 3"),
        ("head -c 10 >/dev/null; kill -9 $$", "ffmpeg:"),
        ("yes 'much to say' | head -c 3000000 >&2; echo end >&2; exit 1", "ffmpeg: end"),
    ];
    for (what, words) in cases {
        let program = fake(&tools, what);
        let mut movie = Movie::create_with(&path, MovieKind::Mp4, &options, &program).unwrap();
        let pushed = (0..40).try_for_each(|i| movie.push(&frame(options.size, i)));
        let e = match pushed {
            Ok(()) => movie.finish().unwrap_err(),
            Err(e) => {
                assert!(movie.push(&frame(options.size, 0)).is_err());
                drop(movie);
                e
            }
        };
        assert_eq!(e.exit_code(), 74, "{e}");
        assert!(e.to_string().contains(words) && !e.to_string().contains('\n'), "{what}: {e}");
        assert!(names(dir.path()).is_empty());
    }
    // An encoder that hangs is ended with its movie and does not delay the drop.
    let program = fake(&tools, "exec tail -f /dev/null \"$0\"");
    let movie = Movie::create_with(&path, MovieKind::Mp4, &options, &program).unwrap();
    while running(tools.path()) == 0 {}
    drop(movie);
    assert_eq!(running(tools.path()), 0);
    assert!(names(dir.path()).is_empty());
}

/// A monitor that stops the work at its first report.
struct Stop;

impl Monitor for Stop {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        Err(Error::Interrupted { code: 130 })
    }
    fn warn(&self, _: &str) {}
}

#[test]
fn the_last_stage_can_be_stopped() {
    let (dir, tools) = (tempdir().unwrap(), tempdir().unwrap());
    let program = fake(&tools, "exec tail -f /dev/null \"$0\"");
    for (kind, name) in [KINDS[0], KINDS[2]] {
        let options = options([8, 8], 10.0, 1);
        let mut movie = Movie::create_with(&dir.path().join(name), kind, &options, &program).unwrap();
        movie.push(&frame(options.size, 0)).unwrap();
        assert_eq!(movie.finish_watched(&Stop).unwrap_err().exit_code(), 130);
        assert!(names(dir.path()).is_empty());
        assert_eq!(running(tools.path()), 0);
    }
}

#[test]
fn a_missing_ffmpeg_is_known_before_work() {
    let (dir, tools) = (tempdir().unwrap(), tempdir().unwrap());
    let options = options([8, 8], 10.0, 1);
    let without_vp9 = fake(&tools, "exit 1");
    let not_a_program = tools.path().join("text");
    fs::write(&not_a_program, "no program").unwrap();
    let cases = [
        (PathBuf::from("/nowhere/ffmpeg"), "there is no program /nowhere/ffmpeg"),
        (PathBuf::from("taki-no-such-program"), "there is no program taki-no-such-program"),
        (without_vp9, "no encoder libvpx-vp9"),
        (not_a_program, "does not start"),
    ];
    for (program, words) in cases {
        let e = Movie::create_with(&dir.path().join("m.webm"), MovieKind::Webm, &options, &program)
            .err()
            .unwrap();
        assert!(matches!(e, Error::NoFfmpeg(_)) && e.exit_code() == 69, "{e}");
        let text = e.to_string();
        assert!(text.contains(words) && text.contains("Debian: ffmpeg") && text.contains(".gif"), "{text}");
        assert!(names(dir.path()).is_empty());
    }
}

/// Runs `test` on a mounted file system of `size` bytes, or skips it without the right to mount one.
fn on_a_small_disk(size: u64, test: impl FnOnce(&Path)) {
    let dir = tempdir().unwrap();
    let mount = |args: &[&str]| Command::new(args[0]).args(&args[1..]).arg(dir.path()).status();
    let option = format!("size={size}");
    if !mount(&["mount", "-t", "tmpfs", "-o", &option, "none"]).is_ok_and(|s| s.success()) {
        eprintln!("not run: mounting a small disk needs root");
        return;
    }
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(dir.path())));
    mount(&["umount"]).unwrap();
    if let Err(e) = result {
        std::panic::resume_unwind(e);
    }
}

#[test]
fn a_full_disk_is_an_error_and_leaves_nothing() {
    on_a_small_disk(64 << 10, |folder| {
        let size = [160, 120];
        // Noise cannot be compressed.
        let mut state = 1u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for (kind, name) in KINDS {
            let options = options(size, 24.0, 60);
            let mut movie = Movie::create(&folder.join(name), kind, &options).unwrap();
            let pushed = (0..60).try_for_each(|_| {
                let rgb: Vec<u8> = (0..size[0] * size[1] * 3).map(|_| noise()).collect();
                movie.push(&rgb)
            });
            let e = pushed.and_then(|()| movie.finish()).expect_err(name);
            assert_eq!(e.exit_code(), 74, "{e}");
            assert!(e.to_string().contains("No space left"), "{name}: {e}");
            assert!(names(folder).is_empty(), "{name}");
        }
    });
}

#[test]
fn handles_and_threads_stay_flat_over_movies_and_frames() {
    let dir = tempdir().unwrap();
    let own = |movie: &Movie| {
        // Other tests open files at the same time, so only files of this folder are counted.
        let _ = movie;
        let links =
            fs::read_dir("/proc/self/fd").unwrap().flatten().filter_map(|e| fs::read_link(e.path()).ok());
        links.filter(|link| link.starts_with(dir.path())).count()
    };
    for (kind, name) in KINDS {
        let options = options([32, 32], 50.0, 400);
        let mut movie = Movie::create(&dir.path().join(name), kind, &options).unwrap();
        movie.push(&frame(options.size, 0)).unwrap();
        let before = own(&movie);
        (1..400).for_each(|i| movie.push(&frame(options.size, i)).unwrap());
        assert_eq!(own(&movie), before, "{name}");
        assert!(before <= 3);
        movie.finish().unwrap();
    }
    assert_eq!(names(dir.path()).len(), 4);
}
