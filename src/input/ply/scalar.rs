//! The eight scalar types of PLY and how their little-endian bytes become numbers.
//!
//! In: bytes whose length was checked before. Out: `f64` coordinates and `i64` indices, both exact, since every
//! PLY integer has at most 32 bits.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Type of a property, of a list's length or of a list's items.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ScalarType {
    /// `char`, `int8`
    I8,
    /// `uchar`, `uint8`
    U8,
    /// `short`, `int16`
    I16,
    /// `ushort`, `uint16`
    U16,
    /// `int`, `int32`
    I32,
    /// `uint`, `uint32`
    U32,
    /// `float`, `float32`
    F32,
    /// `double`, `float64`
    F64,
}

impl ScalarType {
    /// Bytes in the file.
    pub fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether it can count or index.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The number at the start of `bytes`.
    pub(super) fn to_f64(self, bytes: &[u8]) -> f64 {
        match self {
            Self::F32 => f64::from(f32::read(bytes)),
            Self::F64 => f64::read(bytes),
            // At most 32 bits, so the conversion is exact.
            integer => integer.to_i64(bytes) as f64,
        }
    }

    /// The integer at the start of `bytes`; for the two float types, which never count or index, its bits.
    pub(super) fn to_i64(self, bytes: &[u8]) -> i64 {
        match self {
            Self::I8 => i8::read(bytes).into(),
            Self::U8 => u8::read(bytes).into(),
            Self::I16 => i16::read(bytes).into(),
            Self::U16 => u16::read(bytes).into(),
            Self::I32 => i32::read(bytes).into(),
            Self::U32 | Self::F32 => u32::read(bytes).into(),
            Self::F64 => f64::read(bytes).to_bits().cast_signed(),
        }
    }
}

impl fmt::Display for ScalarType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        })
    }
}

/// A Rust number with the layout of a scalar type, for loops that are compiled once per type.
pub(super) trait Scalar: Copy {
    /// Bytes in the file.
    const SIZE: usize;

    /// The number at the start of `bytes`, which must hold at least `SIZE`.
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! scalar {
    ($($number:ty),*) => {$(
        impl Scalar for $number {
            const SIZE: usize = size_of::<$number>();

            #[inline]
            fn read(bytes: &[u8]) -> Self {
                let mut raw = [0; Self::SIZE];
                raw.copy_from_slice(&bytes[..Self::SIZE]);
                Self::from_le_bytes(raw)
            }
        }
    )*};
}

scalar!(i8, u8, i16, u16, i32, u32, f32, f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_exact_at_the_ends_of_their_range() {
        use ScalarType::*;
        let cases: [(ScalarType, &[u8], f64); 10] = [
            (I8, &[0x80], -128.0),
            (U8, &[0xff], 255.0),
            (I16, &[0x00, 0x80], -32768.0),
            (U16, &[0xff, 0xff], 65535.0),
            (I32, &[0x00, 0x00, 0x00, 0x80], -2_147_483_648.0),
            (I32, &[0x01, 0x00, 0x00, 0x00], 1.0),
            (U32, &[0xff, 0xff, 0xff, 0xff], 4_294_967_295.0),
            (U32, &[0x00, 0x00, 0x00, 0x80], 2_147_483_648.0),
            (F32, &0.1f32.to_le_bytes(), 0.1f32 as f64),
            (F64, &0.1f64.to_le_bytes(), 0.1),
        ];
        for (kind, bytes, value) in cases {
            assert_eq!(kind.size(), bytes.len() as u64);
            assert_eq!(kind.to_f64(bytes), value, "{kind}");
            if kind.is_integer() {
                assert_eq!(kind.to_i64(bytes), value as i64, "{kind}");
            }
        }
    }
}
