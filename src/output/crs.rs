//! Systems of coordinates, by their EPSG number.
//!
//! In: a word such as `EPSG:28992`. Out: a number that is known, and the text that describes it (WKT 1, as PostGIS has it).
//! Nothing is transformed: the number says what the coordinates of the mesh are. x is east or longitude, y is north or
//! latitude, whatever the order of axes that the register gives, as GeoPackage and GeoJSON want it.

/// A system of coordinates on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crs {
    code: u16,
    definition: &'static str,
}

/// A word that names no system that can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CrsError {
    /// It is not of the form `EPSG:n`.
    #[error("it must be EPSG: and a number, as in EPSG:28992")]
    Form,
    /// No system has that number.
    #[error(
        "EPSG:{0} is not among the systems that are known; leave --crs out, and choose the system in the program that reads \
         the file"
    )]
    Unknown(u64),
    /// Its axes do not lie on the ground.
    #[error("EPSG:{0} is geocentric: its x and y are not east and north; transform the mesh first")]
    Geocentric(u16),
}

impl Crs {
    /// The system that is called `EPSG:n`.
    ///
    /// # Errors
    /// If there is none, or none whose x and y lie on the ground.
    pub fn parse(text: &str) -> Result<Crs, CrsError> {
        let number = match text.split_once(':') {
            Some((authority, number)) if authority.eq_ignore_ascii_case("epsg") => number,
            _ => return Err(CrsError::Form),
        };
        let digits = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        let number: u64 = number.parse().ok().filter(|_| digits).ok_or(CrsError::Form)?;
        let found = u16::try_from(number).ok().and_then(crs_definitions::from_code);
        let found = found.ok_or(CrsError::Unknown(number))?;
        match found.wkt.starts_with("GEOCCS") {
            true => Err(CrsError::Geocentric(found.code)),
            false => Ok(Crs { code: found.code, definition: found.wkt }),
        }
    }

    /// Longitude and latitude on WGS 84.
    pub fn wgs84() -> Crs {
        Crs { code: 4326, definition: crs_definitions::EPSG_4326.wkt }
    }

    /// The number.
    pub fn code(&self) -> u16 {
        self.code
    }

    /// What it is, as WKT 1.
    pub fn definition(&self) -> &'static str {
        self.definition
    }

    /// What people call it: the first name in the text.
    pub fn name(&self) -> &'static str {
        self.definition.split('"').nth(1).unwrap_or_default()
    }

    /// The name that GeoJSON readers know.
    pub fn urn(&self) -> String {
        match self.code {
            // The same with longitude first, which is what is written.
            4326 => "urn:ogc:def:crs:OGC:1.3:CRS84".to_owned(),
            code => format!("urn:ogc:def:crs:EPSG::{code}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_known_by_number() {
        let dutch = Crs::parse("EPSG:28992").expect("it is known");
        assert_eq!((dutch.code(), dutch.name()), (28992, "Amersfoort / RD New"));
        assert_eq!(dutch.urn(), "urn:ogc:def:crs:EPSG::28992");
        assert!(dutch.definition().ends_with(r#"AUTHORITY["EPSG","28992"]]"#), "{}", dutch.definition());
        let with_height = Crs::parse("epsg:7415").expect("it is known");
        assert_eq!(with_height.name(), "Amersfoort / RD New + NAP height");
        assert_eq!(Crs::parse("EPSG:4326"), Ok(Crs::wgs84()));
        assert_eq!(Crs::wgs84().urn(), "urn:ogc:def:crs:OGC:1.3:CRS84");
    }

    #[test]
    fn what_is_no_system_says_why() {
        for word in ["", "28992", "EPSG:", "EPSG:-1", "EPSG:+4326", "EPSG:x", "OGC:CRS84", "EPSG:1:2"] {
            assert_eq!(Crs::parse(word), Err(CrsError::Form), "{word}");
        }
        assert_eq!(Crs::parse("EPSG:1"), Err(CrsError::Unknown(1)));
        // Not 4326 after 16 bits were cut off.
        assert_eq!(Crs::parse("EPSG:69862"), Err(CrsError::Unknown(69862)));
        assert_eq!(Crs::parse("EPSG:4978"), Err(CrsError::Geocentric(4978)));
    }
}
