//! A thread that encodes and writes pictures while the next ones are rendered.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::report::{Event, Name, Watcher, word, words};
use crate::job::still::StillWriter;
use crate::job::{Claim, Still};
use crate::output::frame::{Exr, samples_of};
use crate::output::movie::{Movie, MovieKind, MovieOptions};
use crate::picture::{Frame, Seconds};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// A picture to write. It is sent when its first strip has been rendered.
pub struct Start {
    pub number: usize,
    pub name: Name,
    pub files: Vec<PathBuf>,
    /// The open files; taken when the picture begins.
    pub still: Option<Still>,
    pub claim: Option<Claim>,
    pub scene: Scene,
    pub volumes: Arc<Vec<VolumeTexture>>,
    pub window: Window,
    pub exr: Exr,
    /// Movies whose first frame this is.
    pub movies: Vec<(PathBuf, MovieKind, MovieOptions)>,
    /// Whether this is the last frame of the open movies.
    pub last: bool,
    /// Start of its rendering.
    pub began: Instant,
}

enum Message {
    Start(Box<Start>),
    Strip(Box<Frame>),
    End,
    /// Does nothing. It is received once all earlier messages have been handled.
    Settle,
    /// Discards the picture in progress.
    Drop,
}

/// Outcomes of pictures: number, name, and the time of each stage in seconds or the error.
pub type Outcomes = Vec<(usize, Name, Result<Seconds>)>;

/// The renderer's handle of the thread.
pub struct Writer {
    send: SyncSender<Message>,
    outcomes: Arc<Mutex<Outcomes>>,
}

impl Writer {
    /// Starts the thread in `scope`. It ends when the writer has been dropped and everything is written.
    pub fn start<'scope>(
        scope: &'scope std::thread::Scope<'scope, '_>,
        watcher: &'scope dyn Watcher,
    ) -> Writer {
        // No queue: one strip is encoded while the next is rendered, and no third strip takes memory.
        let (send, receive) = sync_channel(0);
        let outcomes: Arc<Mutex<Outcomes>> = Arc::default();
        let tell = outcomes.clone();
        scope.spawn(move || write(&receive, &tell, watcher));
        Writer { send, outcomes }
    }

    /// Begins a picture.
    pub fn begin(&self, start: Start) {
        self.tell(Message::Start(Box::new(start)));
    }

    /// Writes the next rows of the picture.
    pub fn strip(&self, frame: Frame) {
        self.tell(Message::Strip(Box::new(frame)));
    }

    /// Waits until all strips so far are written.
    pub fn settle(&self) {
        self.tell(Message::Settle);
    }

    /// Completes the picture.
    pub fn end(&self) {
        self.tell(Message::End);
    }

    /// Discards the picture; it will not be completed.
    pub fn drop_picture(&self) {
        self.tell(Message::Drop);
    }

    /// Takes the outcomes of pictures since the last call.
    pub fn outcomes(&self) -> Outcomes {
        std::mem::take(&mut *self.outcomes.lock().unwrap_or_else(|e| e.into_inner()))
    }

    /// Closes the channel, which lets the thread end, and returns the list of outcomes. The list is complete
    /// once the scope has ended.
    pub fn finish(self) -> Arc<Mutex<Outcomes>> {
        self.outcomes
    }

    fn tell(&self, message: Message) {
        // Sending fails only after the thread has panicked, and then the scope panics too.
        let _ = self.send.send(message);
    }
}

/// A picture being written.
struct Open {
    start: Start,
    /// `None` once writing has failed.
    writer: Option<StillWriter>,
    error: Option<Error>,
    seconds: Seconds,
    /// Samples of the rows so far, for movies: 8 bits, and 16 bits.
    rgb: [Vec<u8>; 2],
    /// Number of those rows.
    rows: u32,
}

fn write(receive: &Receiver<Message>, outcomes: &Mutex<Outcomes>, watcher: &dyn Watcher) {
    let mut open: Option<Open> = None;
    let mut movies: Vec<(PathBuf, Movie)> = Vec::new();
    while let Ok(message) = receive.recv() {
        match message {
            Message::Start(start) => open = Some(begin(*start, &mut movies)),
            Message::Strip(strip) => {
                if let Some(open) = &mut open {
                    push(open, &strip, &movies);
                }
            }
            Message::Settle => {}
            Message::Drop => open = None,
            Message::End => {
                if let Some(open) = open.take() {
                    let outcome = end(open, &mut movies, watcher);
                    outcomes.lock().unwrap_or_else(|e| e.into_inner()).push(outcome);
                }
            }
        }
    }
}

fn begin(mut start: Start, movies: &mut Vec<(PathBuf, Movie)>) -> Open {
    let opened = start
        .movies
        .drain(..)
        .map(|(path, kind, options)| Ok((path.clone(), Movie::create(&path, kind, &options)?)));
    let opened = opened.collect::<Result<Vec<_>>>();
    let writer =
        start.still.take().map(|still| still.begin(&start.scene, &*start.volumes, start.window, &start.exr));
    let (writer, error) = match writer {
        Some(Ok(writer)) => (Some(writer), None),
        Some(Err(e)) => (None, Some(e)),
        None => (None, None),
    };
    let error = match opened {
        Ok(opened) => {
            movies.extend(opened);
            error
        }
        Err(e) => Some(e),
    };
    Open { start, writer, error, seconds: Seconds::default(), rgb: Default::default(), rows: 0 }
}

fn push(open: &mut Open, strip: &Frame, movies: &[(PathBuf, Movie)]) {
    let clock = Instant::now();
    let image = &open.start.scene.image;
    let strip_window =
        Window { y: open.start.window.y + open.rows, height: strip.height, ..open.start.window };
    open.rows += strip.height;
    for (rgb, bits) in open.rgb.iter_mut().zip([8, 16]) {
        if let Some((_, movie)) = movies.iter().find(|(_, movie)| movie.encoding().bits == bits) {
            rgb.extend(samples_of(
                strip,
                movie.encoding(),
                &image.look,
                strip_window,
                [image.width, image.height],
            ));
        }
    }
    if let Some(writer) = &mut open.writer
        && let Err(e) = writer.push(strip)
    {
        // Dropping the writer deletes the partial files at once: the disk may be full.
        open.writer = None;
        open.error = Some(e);
    }
    open.seconds += strip.seconds;
    open.seconds.output += clock.elapsed().as_secs_f64();
}

fn end(
    open: Open,
    movies: &mut Vec<(PathBuf, Movie)>,
    watcher: &dyn Watcher,
) -> (usize, Name, Result<Seconds>) {
    let Open { start, writer, error, mut seconds, rgb, rows: _ } = open;
    let clock = Instant::now();
    let finished = match error {
        Some(e) => Err(e),
        None => writer.map_or(Ok(()), |writer| writer.finish().map(drop)).and_then(|()| {
            movies.iter_mut().try_for_each(|(_, movie)| {
                let deep = movie.encoding().bits > 8;
                movie.push(&rgb[usize::from(deep)])
            })?;
            let ending = if start.last { movies.drain(..) } else { movies.drain(..0) };
            for (path, movie) in ending {
                movie.finish_watched(watcher)?;
                watcher.event(&Event::Assembled { file: word(&path) });
            }
            Ok(())
        }),
    };
    seconds.output += clock.elapsed().as_secs_f64();
    match finished {
        Ok(()) => {
            if let Some(claim) = start.claim {
                claim.done();
            }
            watcher.event(&Event::Saved {
                picture: &start.name,
                files: words(&start.files),
                elapsed: start.began.elapsed().as_secs_f64(),
                seconds,
            });
            (start.number, start.name, Ok(seconds))
        }
        Err(e) => {
            // A movie cannot go on without this frame.
            movies.clear();
            (start.number, start.name, Err(e))
        }
    }
}
