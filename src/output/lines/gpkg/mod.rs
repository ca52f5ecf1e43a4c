//! Lines as GeoPackage 1.3: a database of SQLite with a table of features, its system of coordinates, and a spatial index.
//!
//! Everything is written in one transaction without a journal, because the database is the part of an output: if something
//! fails it is thrown away, and its bytes are synced before it gets its name. The pages that SQLite holds are bounded, so the
//! memory does not grow with the number of lines. The bytes are a function of the lines: rows come in canonical order, and the
//! time of the last change, which the format wants, is the epoch.

mod geometry;
mod schema;

use super::text::bend_word;
use crate::output::{Crs, OutputError, PartFile};
use crate::stitch::LineSource;
use geometry::{Box3, blob};
use rusqlite::{Connection, Error, ErrorCode, OpenFlags, params};
use schema::{INSERT, INSERT_BOX};
use std::io;

/// The identifier of coordinates in a plane of which nothing is known.
const UNKNOWN_PLANE: i32 = -1;
/// Most bytes of a value that SQLite takes, with room for the other columns.
const LARGEST_VALUE: u64 = 999_999_000;
/// Bytes of a point in a geometry.
const POINT: u64 = 24;

pub(super) fn write(part: &PartFile, lines: &dyn LineSource, crs: Option<Crs>) -> Result<(), OutputError> {
    let refused = |error| refused(part, error);
    let database = open(part)?;
    schema::create(&database, crs).map_err(refused)?;
    let srs = crs.map_or(UNKNOWN_PLANE, |crs| i32::from(crs.code()));
    let bounds = fill(&database, part, lines, srs)?;
    schema::describe(&database, srs, bounds).map_err(refused)?;
    database.execute_batch("COMMIT").map_err(refused)?;
    database.close().map_err(|(_, error)| refused(error))
}

/// Opens the part as a database, and begins the transaction.
fn open(part: &PartFile) -> Result<Connection, OutputError> {
    let refused = |error| refused(part, error);
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    // The part is locked already, in the way that all parts are; SQLite need not try in its own, which network drives may
    // not know.
    let database = Connection::open_with_flags_and_vfs(part.path(), flags, c"unix-none").map_err(refused)?;
    if database.is_readonly("main").map_err(refused)? {
        // SQLite makes do with reading where it may not write, and says so only later.
        return Err(OutputError::io(part.target(), "cannot write")(io::Error::last_os_error()));
    }
    // The size of pages and the encoding are defaults, and part of the bytes: they are not left to the library.
    let options = "PRAGMA page_size = 4096; PRAGMA encoding = 'UTF-8'; PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; \
         PRAGMA auto_vacuum = NONE; PRAGMA cache_size = -2000; PRAGMA foreign_keys = OFF; BEGIN";
    database.execute_batch(options).map_err(refused)?;
    Ok(database)
}

/// Writes a feature for each line, and an entry of the index for each. Returns what contains all of them.
fn fill(
    database: &Connection,
    part: &PartFile,
    lines: &dyn LineSource,
    srs: i32,
) -> Result<Option<Box3>, OutputError> {
    let refused = |error| refused(part, error);
    let mut insert = database.prepare(INSERT).map_err(refused)?;
    let mut insert_box = database.prepare(INSERT_BOX).map_err(refused)?;
    let (mut bytes, mut all) = (Vec::new(), None);
    for (id, line) in (0i64..).zip(lines.lines()) {
        let line = line?;
        let count = line.points.len() as u64;
        if count > LARGEST_VALUE / POINT {
            return Err(OutputError::TooLarge {
                path: part.target().to_owned(),
                count,
                what: "vertices of a line",
            });
        }
        // A line has two points at least.
        let Some(bounds) = Box3::of(&line.points) else { continue };
        all = Some(all.map_or(bounds, |all: Box3| all.join(bounds)));
        blob(&line.points, &bounds, srs, &mut bytes);
        let m = &line.measures;
        let fid = id + 1;
        let (class, bend) = (m.class.name(), bend_word(m.bend));
        insert
            .execute(params![fid, bytes, id, class, m.length, m.strength, m.angle, bend, m.closed])
            .map_err(refused)?;
        let [low, high] = bounds.corners();
        insert_box.execute(params![fid, low.x, high.x, low.y, high.y]).map_err(refused)?;
    }
    Ok(all)
}

/// What SQLite says, as what the system says of a file. SQLite has words of its own for a disk that is full or broken; what the
/// system said is what this thread was told last, because nothing else was asked of it since.
fn refused(part: &PartFile, error: Error) -> OutputError {
    use ErrorCode::{CannotOpen, DiskFull, ReadOnly, SystemIoFailure};
    let system = io::Error::last_os_error();
    let said = match error.sqlite_error_code() {
        Some(DiskFull | CannotOpen | ReadOnly | SystemIoFailure) if system.raw_os_error() != Some(0) => {
            system
        }
        Some(DiskFull) => io::Error::new(io::ErrorKind::StorageFull, error),
        _ => io::Error::other(error),
    };
    OutputError::io(part.target(), "cannot write")(said)
}
