//! Id spaces.
//!
//! A *global* id is the position of an element in the input file; it is 64 bits wide, because more than 2^32 faces
//! is a normal input, and it is what results are ordered, joined and tie-broken by. Inside a tile elements are
//! addressed by `u32` *local* indices, which follow the global ids or a curve through space: they say what is near, and
//! nothing else. Ties are broken by global ids, never by them.

use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $repr:ty, $word:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub $repr);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($word, " {}"), self.0)
            }
        }
    };
}

id!(
    /// A vertex of the input, counted from 0 in file order.
    VertexId, u64, "vertex"
);
id!(
    /// A triangle of the input, counted from 0 in file order *after* polygons were cut into fans.
    FaceId, u64, "face"
);
id!(
    /// A tile of the plan, counted from 0 in the order of the cells.
    TileId, u32, "tile"
);
