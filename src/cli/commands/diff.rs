//! `crease diff`: whether two results are the same, and where they are not.
//!
//! In: two PLY files. Out: text, and an exit code as that of `cmp`.

use crate::cli::args::DiffArgs;
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use crate::cli::records::{Column, Differences, Records, compare, header_differences};
use crate::cli::text::{counted, exact, grouped, table};

/// Does what `args` ask for.
///
/// # Errors
/// If one of the files cannot be read.
pub(in crate::cli) fn diff(args: &DiffArgs) -> Result<Exit, Failure> {
    let (a, b) = (Records::open(&args.a)?, Records::open(&args.b)?);
    let headers = header_differences(&a, &b);
    if !headers.is_empty() {
        let lines: String = headers.iter().map(|line| format!("  {line}\n")).collect();
        console::print(&format!("the headers differ\n{lines}"))?;
        return Ok(Exit::Different);
    }
    let found = compare(&a, &b)?;
    match &found.first {
        None => {
            console::print("identical\n")?;
            Ok(Exit::Done)
        }
        Some(first) => {
            console::print(&report(first, &found))?;
            Ok(Exit::Different)
        }
    }
}

fn report(first: &str, found: &Differences) -> String {
    let mut out = format!("the files differ, first in {first}\n");
    if !found.columns.is_empty() {
        let head =
            ["property", "records that differ", "of", "largest difference"].map(str::to_owned).to_vec();
        let rows: Vec<Vec<String>> = std::iter::once(head).chain(found.columns.iter().map(row)).collect();
        out.push('\n');
        out.push_str(&table(2, &rows));
    }
    if found.bytes > 0 {
        out.push_str(&format!(
            "\n  {} outside the tables\n",
            counted(found.bytes, "byte differs", "bytes differ")
        ));
    }
    out
}

fn row(column: &Column) -> Vec<String> {
    let name = format!("{}.{}", column.element, column.property);
    let largest = match column.undefined {
        0 => exact(column.largest),
        n => format!("{} ({} not a number)", exact(column.largest), grouped(n)),
    };
    vec![name, grouped(column.differing), grouped(column.records), largest]
}
