//! The header of a PLY file: any bytes are a header or an error, and a header says nothing that its bytes do not.
#![no_main]

mod place;

use crease::input::ply::Header;
use crease::input::{ByteSource, IoMode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = place::written("header.ply", bytes);
    let source = ByteSource::open(&path, IoMode::Read).expect("it was written");
    match Header::read(&source) {
        Ok(header) => {
            assert!(header.payload <= bytes.len() as u64);
            let properties: usize = header.elements.iter().map(|element| element.properties.len()).sum();
            assert!(properties + header.elements.len() <= bytes.len());
            // The same through the map.
            let mapped = ByteSource::open(&path, IoMode::Map).expect("it was written");
            assert_eq!(Header::read(&mapped).expect("it was read before"), header);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
