//! Numbers as a person reads them: thousands separated, units attached, no more figures than mean something.

use std::time::Duration;

/// `1234567` as `1,234,567`.
pub(super) fn grouped(n: u64) -> String {
    grouped_digits(&n.to_string())
}

fn grouped_digits(digits: &str) -> String {
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A count with the noun it needs: `1 face`, `2 faces`.
pub(super) fn counted(n: u64, one: &str, many: &str) -> String {
    format!("{} {}", grouped(n), if n == 1 { one } else { many })
}

/// A measure with at least four significant figures: `0.01234`, `12.35`, `12,345`.
pub(super) fn measure(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs();
    if !(1e-4..1e15).contains(&magnitude) {
        return format!("{x:.3e}");
    }
    with_decimals(x, decimals_for(x, 4))
}

/// Decimals that show so many significant figures of a number of the size of `x`.
pub(super) fn decimals_for(x: f64, figures: i32) -> usize {
    let exponent = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    (figures - 1 - exponent).clamp(0, 9) as usize
}

/// A number with all the figures it takes to read it back, and no more.
pub(super) fn exact(x: f64) -> String {
    // Whole numbers come without a point, very small and very large ones with an exponent.
    if x.fract() == 0.0 && x.abs() < 1e15 { x.to_string() } else { format!("{x:?}") }
}

/// A number with thousands separated and so many decimals.
pub(super) fn with_decimals(x: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", x.abs());
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let sign = if x < 0.0 { "-" } else { "" };
    let point = if fraction.is_empty() { "" } else { "." };
    format!("{sign}{}{point}{fraction}", grouped_digits(whole))
}

/// A share of a whole in percent; of nothing it is nothing.
pub(super) fn percent(part: f64, whole: f64) -> String {
    if whole > 0.0 { format!("{:.1} %", 100.0 * part / whole) } else { "-".to_owned() }
}

/// A size in bytes, in the decimal units that disks are sold in.
pub(super) fn bytes(n: u64) -> String {
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    match units.iter().find(|(size, _)| n as f64 >= *size) {
        Some((size, unit)) => {
            let x = n as f64 / size;
            format!("{x:.*} {unit}", if x < 10.0 { 1 } else { 0 })
        }
        None => counted(n, "byte", "bytes"),
    }
}

/// A time span: `0.42 s`, `12 s`, `3 min 05 s`, `2 h 07 min`.
pub(super) fn span(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..10 => format!("{:.2} s", time.as_secs_f64()),
        10..60 => format!("{:.1} s", time.as_secs_f64()),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// A time span that is a guess, in seconds: `15 s`, `25 min`, `3.5 h`, with no more figures than a guess deserves.
pub(super) fn rough_span(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "a second".to_owned(),
        s if s < 90.0 => format!("{} s", two_figures(s)),
        s if s < 90.0 * 60.0 => format!("{} min", two_figures(s / 60.0)),
        s => format!("{} h", two_figures(s / 3600.0)),
    }
}

/// Two significant figures, none of them behind the point from ten on.
fn two_figures(x: f64) -> String {
    if x < 9.95 { format!("{x:.1}") } else { grouped(x.round() as u64) }
}

/// Rows in columns: the first to the left, the others to the right, two blanks in between, `indent` before all.
pub(super) fn table(indent: usize, rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|r| r.get(column)).map(|c| c.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for row in rows {
        let mut line = " ".repeat(indent);
        for (column, cell) in row.iter().enumerate() {
            let width = widths[column];
            if column == 0 {
                line.push_str(&format!("{cell:<width$}"));
            } else {
                line.push_str(&format!("  {cell:>width$}"));
            }
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}

/// A label and what belongs to it, in the columns that all sections share.
pub(super) fn entry(label: &str, value: &str) -> String {
    format!("  {label:<16}  {value}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped_and_inflected() {
        let cases = [(0, "0 faces"), (1, "1 face"), (999, "999 faces"), (1000, "1,000 faces")];
        for (n, expected) in cases {
            assert_eq!(counted(n, "face", "faces"), expected);
        }
        assert_eq!(grouped(u64::MAX), "18,446,744,073,709,551,615");
    }

    #[test]
    fn measures_keep_four_figures() {
        let cases = [
            (0.0, "0"),
            (1.0, "1.000"),
            (0.012345, "0.01235"),
            (-12.3456, "-12.35"),
            (12345.6, "12,346"),
            (5e-9, "5.000e-9"),
            (3e20, "3.000e20"),
        ];
        for (x, expected) in cases {
            assert_eq!(measure(x), expected);
        }
    }

    #[test]
    fn exact_numbers_are_short_where_they_can_be() {
        let cases = [(3.0, "3"), (-0.0, "-0"), (0.1, "0.1"), (6.5e-21, "6.5e-21"), (f64::NAN, "NaN")];
        for (x, expected) in cases {
            assert_eq!(exact(x), expected);
        }
    }

    #[test]
    fn sizes_and_spans_have_fitting_units() {
        assert_eq!(
            [1, 999, 1500, 124_321, 8_000_000_000].map(bytes),
            ["1 byte", "999 bytes", "1.5 kB", "124 kB", "8.0 GB"]
        );
        let spans = [0.421, 12.34, 185.0, 7620.0].map(|s| span(Duration::from_secs_f64(s)));
        assert_eq!(spans, ["0.42 s", "12.3 s", "3 min 05 s", "2 h 07 min"]);
        assert_eq!([percent(1.0, 4.0), percent(0.0, 0.0)], ["25.0 %", "-"]);
    }

    #[test]
    fn guesses_are_rough() {
        let guesses = [0.2, 3.21, 42.4, 1500.0, 12_000.0, 360_000.0].map(rough_span);
        assert_eq!(guesses, ["a second", "3.2 s", "42 s", "25 min", "3.3 h", "100 h"]);
    }

    #[test]
    fn tables_align() {
        let rows = [["a", "1"], ["bcd", "234"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(table(1, &rows), " a      1\n bcd  234\n");
    }
}
