//! The thread that encodes and writes pictures while the next ones are rendered.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::report::{Event, Name, Watcher, word, words};
use crate::job::still::StillWriter;
use crate::job::{Claim, Still};
use crate::output::frame::rgb_rows;
use crate::output::movie::{Movie, MovieKind, MovieOptions};
use crate::picture::{Frame, Layer, Seconds};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// A picture to write, once its first strip is there.
pub struct Start {
    pub number: usize,
    pub name: Name,
    pub files: Vec<PathBuf>,
    /// Taken when it is begun.
    pub still: Option<Still>,
    pub claim: Option<Claim>,
    pub scene: Scene,
    pub volume: Arc<VolumeTexture>,
    pub window: Window,
    pub layers: Vec<Layer>,
    /// Movies that begin with it.
    pub movies: Vec<(PathBuf, MovieKind, MovieOptions)>,
    /// Whether movies end with it.
    pub last: bool,
    /// When its rendering began.
    pub began: Instant,
}

enum Message {
    Start(Box<Start>),
    Strip(Box<Frame>),
    End,
    /// Nothing: it is taken when all before it is written.
    Settle,
    /// What has been started is not wanted any more.
    Drop,
}

/// What became of pictures: their numbers, and the error of those that failed.
pub type Outcomes = Vec<(usize, Name, Result<Seconds>)>;

/// The renderer's end of the thread.
pub struct Writer {
    send: SyncSender<Message>,
    outcomes: Arc<Mutex<Outcomes>>,
}

impl Writer {
    /// Starts the thread in `scope`. It ends when the writer is dropped and all is written.
    pub fn start<'scope>(
        scope: &'scope std::thread::Scope<'scope, '_>,
        watcher: &'scope dyn Watcher,
    ) -> Writer {
        // No queue: while one strip is encoded the next is rendered, and no third takes memory.
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

    /// The next rows of the picture.
    pub fn strip(&self, frame: Frame) {
        self.tell(Message::Strip(Box::new(frame)));
    }

    /// Waits until all strips are written.
    pub fn settle(&self) {
        self.tell(Message::Settle);
    }

    /// The picture is complete.
    pub fn end(&self) {
        self.tell(Message::End);
    }

    /// The picture will not be complete.
    pub fn drop_picture(&self) {
        self.tell(Message::Drop);
    }

    /// What has become of pictures since this was last asked.
    pub fn outcomes(&self) -> Outcomes {
        std::mem::take(&mut *self.outcomes.lock().unwrap_or_else(|e| e.into_inner()))
    }

    /// Waits until all is written; what has become of it.
    pub fn finish(self) -> Arc<Mutex<Outcomes>> {
        self.outcomes
    }

    fn tell(&self, message: Message) {
        // The thread only ends before this end is dropped if it panics, and then the scope does.
        let _ = self.send.send(message);
    }
}

/// A picture being written.
struct Open {
    start: Start,
    /// None once writing has failed.
    writer: Option<StillWriter>,
    error: Option<Error>,
    seconds: Seconds,
    /// R, G, B of the rows so far, for movies.
    rgb: Vec<u8>,
}

fn write(receive: &Receiver<Message>, outcomes: &Mutex<Outcomes>, watcher: &dyn Watcher) {
    let mut open: Option<Open> = None;
    let mut movies: Vec<(PathBuf, Movie)> = Vec::new();
    while let Ok(message) = receive.recv() {
        match message {
            Message::Start(start) => open = Some(begin(*start, &mut movies)),
            Message::Strip(strip) => {
                if let Some(open) = &mut open {
                    push(open, &strip, !movies.is_empty());
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
        start.still.take().map(|still| still.begin(&start.scene, &start.volume, start.window, &start.layers));
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
    Open { start, writer, error, seconds: Seconds::default(), rgb: Vec::new() }
}

fn push(open: &mut Open, strip: &Frame, movies: bool) {
    let clock = Instant::now();
    if movies {
        open.rgb.extend(rgb_rows(strip));
    }
    if let Some(writer) = &mut open.writer
        && let Err(e) = writer.push(strip)
    {
        // What is written of it goes at once: a full disk needs the room.
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
    let Open { start, writer, error, mut seconds, rgb } = open;
    let clock = Instant::now();
    let finished = match error {
        Some(e) => Err(e),
        None => writer.map_or(Ok(()), |writer| writer.finish().map(drop)).and_then(|()| {
            movies.iter_mut().try_for_each(|(_, movie)| movie.push(&rgb))?;
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
            // A movie that misses a frame is none.
            movies.clear();
            (start.number, start.name, Err(e))
        }
    }
}
