//! The mesh as one binary little-endian PLY file.
//!
//! In: vertices and polygons of all files, perhaps new numbers for the vertices. Out: a temporary file with the elements
//! `vertex` (x, y, z: `float` if that holds all of them exactly, else `double`) and `face` (lists of the corners, polygons
//! not cut), so that ids and triangles are those of the same mesh given as PLY.

use super::gather::Gathered;
use super::names::{Names, NamesWriter};
use super::polygons::Polygons;
use super::weld::Renumbered;
use super::{Context, Progress};
use crate::input::InputError;
use crate::spill::{PlainFile, PlainWriter, ScratchDir};

/// Bytes written at a time.
const BUFFER: usize = 256 << 10;
/// Share of the memory for the corners that are looked up at a time, 12 bytes each, and for the numbers they are looked up
/// in.
const CORNER_SHARE: u64 = 64;
const NAME_SHARE: u64 = 4;
/// Vertices or polygons between two reports.
const REPORT: u64 = 1 << 16;

/// Writes what was gathered.
pub fn write(
    gathered: &Gathered,
    renumbered: Option<Renumbered>,
    scratch: &ScratchDir,
    context: &Context<'_>,
) -> Result<PlainFile, InputError> {
    let vertices = renumbered.as_ref().map_or_else(|| gathered.vertex_count(), |new| new.vertices);
    if vertices > 1 << 32 {
        let path = gathered.parts.first().map(|part| part.path.clone()).unwrap_or_default();
        let reason = format!(
            "the mesh has {vertices} vertices, and faces can name 2^32; work on fewer files at a time"
        );
        return Err(InputError::Format { path, reason });
    }
    let mut out = PlainWriter::create(scratch, "mesh", BUFFER)?;
    let (real, count) = (
        if gathered.floats { "float" } else { "double" },
        if gathered.widest <= 255 { "uchar" } else { "uint" },
    );
    let polygons = gathered.polygon_count();
    out.write(
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty {real} x\nproperty {real} y\n\
             property {real} z\nelement face {polygons}\nproperty list {count} uint vertex_indices\nend_header\n"
        )
        .as_bytes(),
    )?;
    let names = match renumbered {
        None => {
            let mut report = Report::new(context.progress, 24);
            gathered.for_each_vertex(|position| {
                report.one();
                vertex(&mut out, gathered.floats, position)
            })?;
            None
        }
        Some(new) => Some(kept_vertices(gathered, new, scratch, &mut out, context)?),
    };
    faces(gathered, names, &mut out, context)?;
    Ok(out.finish()?)
}

/// Writes the vertices that stay; returns the new numbers.
fn kept_vertices(
    gathered: &Gathered,
    new: Renumbered,
    scratch: &ScratchDir,
    out: &mut PlainWriter,
    context: &Context<'_>,
) -> Result<Names, InputError> {
    let mut report = Report::new(context.progress, 24);
    let mut names = NamesWriter::new(scratch);
    let mut renamed = new.names.iter()?;
    gathered.for_each_vertex(|position| {
        report.one();
        // There is one for each vertex.
        let Some(name) = renamed.next().transpose()? else { return Ok(()) };
        names.push(name.new as u32)?;
        if name.stays { vertex(out, gathered.floats, position) } else { Ok(()) }
    })?;
    drop(renamed);
    drop(new);
    names.finish(context.memory / NAME_SHARE)
}

fn vertex(out: &mut PlainWriter, floats: bool, position: [f64; 3]) -> Result<(), InputError> {
    let mut bytes = [0; 24];
    for (axis, x) in position.into_iter().enumerate() {
        if floats {
            bytes[4 * axis..][..4].copy_from_slice(&(x as f32).to_le_bytes());
        } else {
            bytes[8 * axis..][..8].copy_from_slice(&x.to_le_bytes());
        }
    }
    Ok(out.write(if floats { &bytes[..12] } else { &bytes })?)
}

/// Writes all polygons, some at a time.
fn faces(
    gathered: &Gathered,
    mut names: Option<Names>,
    out: &mut PlainWriter,
    context: &Context<'_>,
) -> Result<(), InputError> {
    let most = (context.memory / CORNER_SHARE).max(1 << 10) as usize;
    let mut polygons = Polygons::new(gathered)?;
    let (mut counts, mut corners) = (Vec::new(), Vec::new());
    let mut report = Report::new(context.progress, 16);
    loop {
        let more = polygons.next(&mut corners)?;
        counts.extend(more);
        if more.is_some() && corners.len() < most {
            continue;
        }
        if let Some(names) = &mut names {
            names.look_up(&mut corners)?;
        }
        let mut rest = corners.as_slice();
        for &count in &counts {
            let (polygon, others) = rest.split_at(count);
            rest = others;
            report.one();
            match gathered.widest {
                ..=255 => out.write(&[count as u8])?,
                _ => out.write(&(count as u32).to_le_bytes())?,
            }
            for corner in polygon {
                out.write(&(*corner as u32).to_le_bytes())?;
            }
        }
        counts.clear();
        corners.clear();
        if more.is_none() {
            return Ok(());
        }
    }
}

/// Sums progress up.
struct Report<'a> {
    progress: &'a dyn Progress,
    each: u64,
    count: u64,
}

impl<'a> Report<'a> {
    fn new(progress: &'a dyn Progress, each: u64) -> Report<'a> {
        Report { progress, each, count: 0 }
    }

    fn one(&mut self) {
        self.count += 1;
        if self.count == REPORT {
            self.progress.advanced(self.each * std::mem::take(&mut self.count));
        }
    }
}

impl Drop for Report<'_> {
    fn drop(&mut self) {
        self.progress.advanced(self.each * self.count);
    }
}

/// Bytes that [`write`] will report.
pub fn reported_bytes(gathered: &Gathered) -> u64 {
    24 * gathered.vertex_count() + 16 * gathered.polygon_count()
}
