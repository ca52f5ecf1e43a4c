//! The tables of a GeoPackage, as the specification (OGC 12-128r17) defines them.

use super::geometry::Box3;
use crate::output::Crs;
use rusqlite::{Connection, Error, params};

/// A row of the features.
pub(super) const INSERT: &str = "INSERT INTO creases (fid, geom, id, class, length, strength, angle, bend, closed) \
     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)";
/// An entry of the spatial index.
pub(super) const INSERT_BOX: &str = "INSERT INTO rtree_creases_geom VALUES (?1, ?2, ?3, ?4, ?5)";

/// `GPKG`, and version 1.3.0: what tells a GeoPackage from other databases.
const MARKS: &str = "PRAGMA application_id = 0x47504B47; PRAGMA user_version = 10300;";

const TABLES: &str = "
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL PRIMARY KEY,
  organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL,
  definition TEXT NOT NULL,
  description TEXT
);
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY,
  data_type TEXT NOT NULL,
  identifier TEXT UNIQUE,
  description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE,
  min_y DOUBLE,
  max_x DOUBLE,
  max_y DOUBLE,
  srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
);
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL,
  z TINYINT NOT NULL,
  m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id)
);
CREATE TABLE gpkg_extensions (
  table_name TEXT,
  column_name TEXT,
  extension_name TEXT NOT NULL,
  definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name)
);
CREATE TABLE creases (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom LINESTRING,
  id INTEGER NOT NULL,
  class TEXT NOT NULL,
  length DOUBLE NOT NULL,
  strength DOUBLE NOT NULL,
  angle DOUBLE NOT NULL,
  bend TEXT,
  closed BOOLEAN NOT NULL
);
CREATE VIRTUAL TABLE rtree_creases_geom USING rtree(id, minx, maxx, miny, maxy);
";

/// What keeps the index right when somebody changes the features: the conditions of the specification, of which each is
/// one case of what may happen to a geometry and to the number of its row. The functions are those of the program that does
/// it.
const TRIGGERS: &str = "
CREATE TRIGGER rtree_creases_geom_insert AFTER INSERT ON creases
  WHEN (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  INSERT OR REPLACE INTO rtree_creases_geom VALUES (NEW.fid,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;
CREATE TRIGGER rtree_creases_geom_update1 AFTER UPDATE OF geom ON creases
  WHEN OLD.fid = NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  INSERT OR REPLACE INTO rtree_creases_geom VALUES (NEW.fid,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;
CREATE TRIGGER rtree_creases_geom_update2 AFTER UPDATE OF geom ON creases
  WHEN OLD.fid = NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_creases_geom WHERE id = OLD.fid;
END;
CREATE TRIGGER rtree_creases_geom_update3 AFTER UPDATE ON creases
  WHEN OLD.fid != NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_creases_geom WHERE id = OLD.fid;
  INSERT OR REPLACE INTO rtree_creases_geom VALUES (NEW.fid,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;
CREATE TRIGGER rtree_creases_geom_update4 AFTER UPDATE ON creases
  WHEN OLD.fid != NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_creases_geom WHERE id IN (OLD.fid, NEW.fid);
END;
CREATE TRIGGER rtree_creases_geom_delete AFTER DELETE ON creases
  WHEN OLD.geom NOTNULL
BEGIN
  DELETE FROM rtree_creases_geom WHERE id = OLD.fid;
END;
";

/// Makes the tables, and names the systems of coordinates: the three that must be there, and `crs`.
pub(super) fn create(database: &Connection, crs: Option<Crs>) -> Result<(), Error> {
    database.execute_batch(MARKS)?;
    database.execute_batch(TABLES)?;
    let mut insert = database.prepare("INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, ?3, ?4, ?5, ?6)")?;
    for (id, kind) in [(-1, "Cartesian"), (0, "geographic")] {
        let name = format!("Undefined {kind} SRS");
        let description = format!("undefined {} coordinate reference system", kind.to_lowercase());
        insert.execute(params![name, id, "NONE", id, "undefined", description])?;
    }
    let wgs84 = Crs::wgs84();
    for crs in [Some(wgs84), crs.filter(|crs| *crs != wgs84)].into_iter().flatten() {
        let none: Option<&str> = None;
        insert.execute(params![crs.name(), crs.code(), "EPSG", crs.code(), crs.definition(), none])?;
    }
    Ok(())
}

/// Says what the features are and where they lie, and has the index looked after.
pub(super) fn describe(database: &Connection, srs: i32, bounds: Option<Box3>) -> Result<(), Error> {
    let corners = bounds.map(|bounds| bounds.corners());
    let [low, high] = [0, 1].map(|i| corners.map(|corners| corners[i]));
    database.execute(
        "INSERT INTO gpkg_contents VALUES ('creases', 'features', 'creases', 'feature lines found by crease', \
         '1970-01-01T00:00:00.000Z', ?1, ?2, ?3, ?4, ?5)",
        params![low.map(|p| p.x), low.map(|p| p.y), high.map(|p| p.x), high.map(|p| p.y), srs],
    )?;
    database.execute(
        "INSERT INTO gpkg_geometry_columns VALUES ('creases', 'geom', 'LINESTRING', ?1, 1, 0)",
        params![srs],
    )?;
    database.execute(
        "INSERT INTO gpkg_extensions VALUES ('creases', 'geom', 'gpkg_rtree_index', \
         'http://www.geopackage.org/spec/#extension_rtree', 'write-only')",
        params![],
    )?;
    database.execute_batch(TRIGGERS)
}
