//! How the work is done: nothing here changes the result.

use super::HOW;
use super::values::memory;
use crate::cli::memory_limit::default_memory;
use crate::config::{Limits, Order, Tiling};
use crate::input::IoMode;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// How the work is cut up.
#[derive(Debug, Args)]
pub(in crate::cli) struct WorkArgs {
    /// Threads that compute, at most 1024. 0, the default, is one for each processor.
    #[arg(long, value_name = "N", help_heading = HOW, default_value_t = 0, hide_default_value = true,
          value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,

    /// Memory that may be allocated at a time: a number of bytes, or with a unit as in 512MiB, 2GiB, 2GB. Tiles are made to
    /// fit. Default: three quarters of what the machine or the control group of the process has.
    #[arg(long, value_name = "SIZE", help_heading = HOW, value_parser = memory)]
    memory: Option<u64>,

    /// Faces of a tile, the piece of the mesh that is worked on at a time. Default: as many as the memory allows, and no more
    /// than 16000000.
    #[arg(long, value_name = "N", help_heading = HOW, value_parser = clap::value_parser!(u64).range(1..))]
    tile_faces: Option<u64>,

    /// Work on the whole mesh at once: fastest if it fits into memory (about 320 bytes for each face).
    #[arg(long, help_heading = HOW, conflicts_with = "tile_faces")]
    in_core: bool,

    /// How the file is read. `map` lets the system keep what fits into memory; `read` asks for each piece, which suits
    /// network drives; `auto` maps if the system can.
    #[arg(long, value_enum, value_name = "MODE", help_heading = HOW, default_value = "auto", hide_possible_values = true)]
    pub io: Io,

    /// Whether a mesh without spatial order is rewritten, for those who measure: `auto`, `keep`, `rewrite`.
    #[arg(long, value_enum, value_name = "ORDER", help_heading = HOW, default_value = "auto", hide = true)]
    order: OrderArg,

    /// Do all work, whether anything in the result depends on it or not, for those who measure.
    #[arg(long, help_heading = HOW, hide = true)]
    no_shortcuts: bool,

    /// The directory for what is done, so that an interrupted run goes on where it stopped, and for temporary files, which
    /// are needed to convert the input, and if faces that are neighbours in space are far apart in the file: up to three times
    /// its size. Made when it is needed, and removed when the outputs are there. Default: the name of the output with
    /// `.crease-work` for its extension, beside it.
    #[arg(long, value_name = "DIR", help_heading = HOW)]
    pub workspace: Option<PathBuf>,
}

impl WorkArgs {
    /// Has what a machine says in the place of what was said before.
    pub fn set(&mut self, threads: Option<u16>, memory: Option<u64>, io: Option<Io>) {
        self.threads = threads.unwrap_or(self.threads);
        self.memory = memory.or(self.memory);
        self.io = io.unwrap_or(self.io);
    }

    /// Whether somebody has said how much memory there is.
    pub fn has_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// The limits of the run. The number of threads is resolved here, so that the summary can name it.
    pub fn limits(&self) -> Limits {
        let processors = || std::thread::available_parallelism().map_or(1, usize::from);
        let tiling = match (self.in_core, self.tile_faces) {
            (true, _) => Tiling::InCore,
            (false, Some(faces)) => Tiling::Faces(faces),
            (false, None) => Tiling::Auto,
        };
        let memory = self.memory.unwrap_or_else(default_memory);
        let threads = if self.threads == 0 { processors() } else { self.threads.into() };
        let shortcuts = !self.no_shortcuts;
        Limits { threads, tiling, io: self.io.into(), memory, order: self.order.into(), shortcuts }
    }
}

/// How the input is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Io {
    Auto,
    Map,
    Read,
}

impl Io {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Io::Auto => "auto",
            Io::Map => "map",
            Io::Read => "read",
        }
    }
}

impl From<Io> for IoMode {
    fn from(io: Io) -> IoMode {
        match io {
            Io::Auto => IoMode::Auto,
            Io::Map => IoMode::Map,
            Io::Read => IoMode::Read,
        }
    }
}

/// What is done about a file without spatial order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OrderArg {
    Auto,
    Keep,
    Rewrite,
}

impl From<OrderArg> for Order {
    fn from(order: OrderArg) -> Order {
        match order {
            OrderArg::Auto => Order::Auto,
            OrderArg::Keep => Order::Keep,
            OrderArg::Rewrite => Order::Rewrite,
        }
    }
}
