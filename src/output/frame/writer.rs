//! Writer of a developed picture, row by row. A thread of its own encodes them while the next rows are
//! computed. The bytes do not depend on how the rows are divided.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::{Encoding, Format, jpeg_file, png_file, tiff_file, webp_file};

/// Facts of a picture that are known before its rows.
#[derive(Clone, Debug)]
pub struct Head {
    /// Format of the file, one of those that hold developed pictures.
    pub format: Format,
    /// Encoding of the samples.
    pub encoding: Encoding,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Texts about the picture, with their keys.
    pub texts: Vec<(String, String)>,
}

impl Head {
    /// Bytes of a row of samples.
    pub(super) fn row_bytes(&self) -> usize {
        self.size[0] as usize * self.encoding.pixel_bytes()
    }
}

/// Writer of a developed picture.
pub struct RowWriter {
    rows: Option<SyncSender<Message>>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

enum Message {
    Rows(Vec<u8>),
    /// The end of the picture, with the texts that are known only then.
    Finish(Vec<(String, String)>),
}

impl RowWriter {
    /// Begins a picture.
    ///
    /// # Errors
    /// An error where the thread cannot be started.
    pub fn new(file: File, head: Head) -> io::Result<RowWriter> {
        // A queue of length 0: one piece is encoded while the next waits. A longer one would only take
        // memory.
        let (rows, queue) = sync_channel(0);
        let work = move || {
            let inner = BufWriter::with_capacity(1 << 16, file);
            let mut out = Checked { inner, error: None };
            let written = write(&mut out, &head, &mut Rows::new(Source::Queue(queue)));
            match out.error.take() {
                Some(e) => Err(e),
                None => written.and_then(|()| out.inner.flush()),
            }
        };
        let thread = std::thread::Builder::new().name("picture".into()).spawn(work)?;
        Ok(RowWriter { rows: Some(rows), thread: Some(thread) })
    }

    /// Writes the next rows: samples of any whole number of rows, see [`super::samples_of`].
    ///
    /// # Errors
    /// Errors of the encoder and the file, also from rows written earlier.
    pub fn push(&mut self, rows: Vec<u8>) -> io::Result<()> {
        self.send(Message::Rows(rows))
    }

    /// Writes `texts` and ends the file. All rows must have been written.
    ///
    /// # Errors
    /// Errors of the encoder and the file.
    pub fn finish(mut self, texts: Vec<(String, String)>) -> io::Result<()> {
        self.send(Message::Finish(texts))?;
        self.join()
    }

    fn send(&mut self, message: Message) -> io::Result<()> {
        match &self.rows {
            Some(rows) if rows.send(message).is_ok() => Ok(()),
            // The thread ended early and returns the reason.
            _ => self.join().and(Err(io::Error::other("the picture has ended"))),
        }
    }

    fn join(&mut self) -> io::Result<()> {
        self.rows = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(done)) => done,
            Some(Err(_)) => Err(io::Error::other("the encoder failed")),
            None => Ok(()),
        }
    }
}

fn write(out: impl Write + Seek, head: &Head, rows: &mut Rows) -> io::Result<()> {
    let written = match head.format {
        Format::Png => png_file::write(out, head, rows),
        Format::Jpeg => jpeg_file::write(out, head, rows),
        Format::Tiff => tiff_file::write(out, head, rows),
        Format::Webp => webp_file::write(out, head, rows),
        Format::Exr => Err(io::Error::other("an EXR has layers and is written line by line")),
    };
    match written {
        // The picture was abandoned, and its file is removed.
        Err(e) if e.kind() == ABANDONED => Ok(()),
        other => other,
    }
}

const ABANDONED: io::ErrorKind = io::ErrorKind::ConnectionAborted;

/// Rows on their way to an encoder.
pub(super) struct Rows {
    source: Source,
    /// Texts that came at the end.
    pub texts: Vec<(String, String)>,
}

enum Source {
    /// A thread that renders.
    Queue(Receiver<Message>),
    /// The whole picture, until it is taken.
    Whole(Option<Vec<u8>>),
}

impl Rows {
    fn new(source: Source) -> Rows {
        Rows { source, texts: Vec::new() }
    }

    /// Returns the next rows, or `None` after the last ones.
    ///
    /// # Errors
    /// An error where the picture was abandoned.
    pub fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let queue = match &mut self.source {
            Source::Queue(queue) => queue,
            Source::Whole(rows) => return Ok(rows.take()),
        };
        match queue.recv() {
            Ok(Message::Rows(rows)) => Ok(Some(rows)),
            Ok(Message::Finish(texts)) => {
                self.texts = texts;
                Ok(None)
            }
            Err(_) => Err(ABANDONED.into()),
        }
    }

    /// Returns all rows at once.
    ///
    /// # Errors
    /// An error where the picture was abandoned, or does not have the rows of its head.
    pub fn all(&mut self, head: &Head) -> io::Result<Vec<u8>> {
        let bytes = head.row_bytes() * head.size[1] as usize;
        let mut all = Vec::with_capacity(bytes);
        while let Some(rows) = self.next()? {
            all.extend(rows);
        }
        if all.len() == bytes { Ok(all) } else { Err(io::Error::other("some rows are missing")) }
    }
}

/// Encodes a small picture in memory.
///
/// # Errors
/// Errors of the encoder, such as a text that the format does not allow.
pub fn encode(head: &Head, samples: Vec<u8>) -> io::Result<Vec<u8>> {
    let mut out = io::Cursor::new(Vec::new());
    write(&mut out, head, &mut Rows::new(Source::Whole(Some(samples))))?;
    Ok(out.into_inner())
}

/// A writer that keeps its first error, because encoders drop those of their destructors.
pub(super) struct Checked<W> {
    inner: W,
    error: Option<io::Error>,
}

impl<W: Write> Write for Checked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(e) = &self.error {
            return Err(io::Error::new(e.kind(), e.to_string()));
        }
        match self.inner.write(bytes) {
            Err(e) if e.kind() != io::ErrorKind::Interrupted => {
                self.error = Some(io::Error::new(e.kind(), e.to_string()));
                Err(e)
            }
            other => other,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<W: Seek> Seek for Checked<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}
