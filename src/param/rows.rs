//! How the rows of a product's table are written, one a line or in terms of a sister's, and how the compiler complains
//! of them.

use super::{Parameter, Storage};

/// The rows of a table, written one a line: number, function, name, unit, ranges, access, storage with its slot,
/// default, note.
#[macro_export]
macro_rules! parameter_rows {
    (
        $functions:ident;
        $($number:literal $function:ident $name:literal $unit:ident $ranges:expr, $access:ident $storage:ident $(($slot:literal))? $default:literal $note:literal,)*
    ) => {
        &[$($crate::param::Parameter {
            function: $functions::$function,
            row: $crate::param::Row {
                number: $number,
                #[cfg(not(target_os = "none"))]
                name: $name,
                unit: $crate::param::Unit::$unit,
                ranges: $ranges,
                access: $crate::param::Access::$access,
                storage: $crate::param::Storage::$storage $(($slot))?,
                default: $default,
                #[cfg(not(target_os = "none"))]
                note: $note,
            },
        }),*]
    };
}
pub(crate) use crate::parameter_rows as rows;

/// The rows of a product in terms of those of a sister, `of`. They are without the numbers in `without`, and with the
/// rows that follow, which also take the place of rows with the same number. All of them are in the order of their
/// numbers.
macro_rules! derived {
    ($functions:ident; of $of:expr, without $without:expr; $($with:tt)*) => {{
        use $crate::param::{count, merge, rows};
        const OF: &[$crate::param::Parameter<$functions>] = $of;
        const WITHOUT: &[u8] = $without;
        const WITH: &[$crate::param::Parameter<$functions>] = rows! { $functions; $($with)* };
        const ROWS: [$crate::param::Parameter<$functions>; count(OF, WITHOUT, WITH)] = merge(OF, WITHOUT, WITH);
        &ROWS
    }};
}
pub(crate) use derived;

/// Number of the rows that [`derived!`] makes.
#[track_caller]
pub(crate) const fn count<F>(of: &[Parameter<F>], without: &[u8], with: &[Parameter<F>]) -> usize {
    let (mut i, mut kept) = (0, 0);
    while i < of.len() {
        kept += stays(of[i].row.number, without, with) as usize;
        i += 1;
    }
    i = 0;
    while i < without.len() {
        demand(has(of, without[i]), without[i], "is left out, but the sister does not have it");
        i += 1;
    }
    kept + with.len()
}

/// The rows that [`derived!`] makes: `N` is their [`count`].
pub(crate) const fn merge<F: Copy, const N: usize>(
    of: &[Parameter<F>],
    without: &[u8],
    with: &[Parameter<F>],
) -> [Parameter<F>; N] {
    let mut rows = [of[0]; N];
    let (mut n, mut i, mut added) = (0, 0, 0);
    while n < N {
        if i < of.len() && !stays(of[i].row.number, without, with) {
            i += 1;
        } else if i == of.len() || added < with.len() && with[added].row.number < of[i].row.number {
            rows[n] = with[added];
            added += 1;
            n += 1;
        } else {
            rows[n] = of[i];
            i += 1;
            n += 1;
        }
    }
    rows
}

/// True if a sister's row of this number is neither left out nor replaced.
const fn stays<F>(number: u8, without: &[u8], with: &[Parameter<F>]) -> bool {
    let mut i = 0;
    while i < without.len() {
        if without[i] == number {
            return false;
        }
        i += 1;
    }
    !has(with, number)
}

/// True if one of the rows has this number.
const fn has<F>(rows: &[Parameter<F>], number: u8) -> bool {
    let mut i = 0;
    while i < rows.len() {
        if rows[i].row.number == number {
            return true;
        }
        i += 1;
    }
    false
}

/// The rows of a sister, for a product that does not store them.
pub(crate) const fn unstored<F: Copy, const N: usize>(of: &[Parameter<F>]) -> [Parameter<F>; N] {
    let mut rows = [of[0]; N];
    let mut i = 0;
    while i < N {
        rows[i] = of[i];
        rows[i].row.storage = Storage::Volatile;
        i += 1;
    }
    rows
}

/// Panics, which stops the compiler, unless the parameter of this number is as it has to be. `complaint` tells how it
/// is instead.
#[track_caller]
pub(super) const fn demand(holds: bool, number: u8, complaint: &str) {
    if holds {
        return;
    }
    let digits = [b'0' + number / 100, b'0' + number / 10 % 10, b'0' + number % 10];
    let (_, digits) = digits.split_at(if number < 10 { 2 } else { (number < 100) as usize });
    let parts: [&[u8]; 4] = [b"parameter ", digits, b" ", complaint.as_bytes()];
    let (mut text, mut length, mut part) = ([0; 128], 0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            text[length] = parts[part][i];
            length += 1;
            i += 1;
        }
        part += 1;
    }
    let (text, _) = text.split_at(length);
    assert!(holds, "{}", if let Ok(text) = str::from_utf8(text) { text } else { complaint });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::param::{AxisParameter, FLAG, Table};

    const FIVE: &[(i32, i32)] = &[(1, 5)];

    const SISTER: &[Parameter<AxisParameter>] = rows! { AxisParameter;
        7 StandbyCurrent "" Number FIVE, ReadWrite OnCommand(3) 1 "",
        80 SoftStop "" Flag FLAG, ReadWrite OnCommand(4) 0 "",
        255 GroupIndex "" Number FIVE, ReadWrite Volatile 5 "",
    };

    fn shown(rows: &[Parameter<AxisParameter>]) -> Vec<(u8, AxisParameter)> {
        rows.iter().map(|parameter| (parameter.row.number, parameter.function)).collect()
    }

    #[test]
    fn a_sister_has_the_rows_of_the_other_one_but_for_those_that_it_says() {
        use AxisParameter::{BoostCurrent, GroupIndex, MaximumSpeed, SoftStop, StandbyCurrent};
        let all = derived! { AxisParameter; of SISTER, without &[]; };
        assert_eq!(shown(all), [(7, StandbyCurrent), (80, SoftStop), (255, GroupIndex)]);
        let rows: &[_] = derived! { AxisParameter;
            of SISTER, without &[255, 7];
            6 BoostCurrent "" Number FIVE, ReadWrite Volatile 1 "",
            80 StandbyCurrent "" Number FIVE, ReadWrite Volatile 1 "",
            254 MaximumSpeed "" Number FIVE, ReadWrite Volatile 1 "",
        };
        assert_eq!(shown(rows), [(6, BoostCurrent), (80, StandbyCurrent), (254, MaximumSpeed)]);
        assert!(unstored::<_, 3>(SISTER).iter().all(|parameter| !parameter.row.stored()));
    }

    /// The complaint of the compiler about a table with these rows, if there is one.
    fn complaint(rows: &'static [Parameter<AxisParameter>]) -> Option<String> {
        let panic = std::panic::catch_unwind(|| Table::<AxisParameter>::new(rows)).err()?;
        panic.downcast_ref::<String>().cloned()
    }

    /// Tables that do not compile, and why.
    const REFUSED: &[(&[Parameter<AxisParameter>], &str)] = &[
        (
            rows! { AxisParameter;
                7 StandbyCurrent "" Number FIVE, ReadWrite Volatile 1 "",
                6 MaximumCurrent "" Number FIVE, ReadWrite Volatile 1 "",
            },
            "parameter 6 stands behind a number that is not lower",
        ),
        (
            rows! { AxisParameter; 77 SoftStop "" Number &[(0, 256)], ReadWrite Volatile 1 "", },
            "parameter 77 is not 0..=255, as its place among the bytes says",
        ),
        (
            rows! { AxisParameter;
                9 SoftStop "" Flag FLAG, ReadWrite Volatile 1 "",
                100 SoftStop "" Flag FLAG, ReadWrite Volatile 1 "",
            },
            "parameter 100 has the function of another one",
        ),
        (
            rows! { AxisParameter;
                9 SoftStop "" Flag FLAG, ReadWrite OnCommand(1) 1 "",
                209 DoubleStep "" Flag FLAG, ReadWrite Automatic(1) 1 "",
            },
            "parameter 209 has the slot of another one",
        ),
        (
            rows! { AxisParameter; 10 SoftStop "" Number FIVE, ReadWrite Volatile 0 "", },
            "parameter 10 has a default out of its range",
        ),
        (
            rows! { AxisParameter; 99 SoftStop "" Number &[(5, 1)], ReadWrite Volatile 5 "", },
            "parameter 99 has a range that ends before it begins",
        ),
        (
            rows! { AxisParameter; 255 SoftStop "" Number &[(1, 2), (2, 3)], ReadWrite Volatile 1 "", },
            "parameter 255 has ranges that overlap",
        ),
    ];

    #[test]
    fn a_complaint_of_the_compiler_names_the_parameter() {
        assert_eq!(complaint(SISTER), None);
        for (rows, expected) in REFUSED {
            assert_eq!(complaint(rows).as_deref(), Some(*expected));
        }
    }

    #[test]
    #[should_panic(expected = "parameter 81 is left out, but the sister does not have it")]
    fn only_rows_that_exist_can_be_left_out() {
        count(SISTER, &[80, 81], &[]);
    }
}
