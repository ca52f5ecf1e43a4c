//! Files with random headers, read here and by the full reader of `ply-rs-bw`, which must agree.

use super::*;
use crate::input::ply::ScalarType::{self, *};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Ply, Property};

const INTEGERS: [ScalarType; 6] = [I8, U8, I16, U16, I32, U32];
const ALL: [ScalarType; 8] = [I8, U8, I16, U16, I32, U32, F32, F64];

#[derive(Clone, Copy)]
enum Role {
    Coordinate,
    Indices,
    Other,
}

#[derive(Clone)]
struct Column {
    name: String,
    role: Role,
    /// Type of the length, for lists.
    count: Option<ScalarType>,
    item: ScalarType,
}

struct Table {
    name: &'static str,
    records: u64,
    columns: Vec<Column>,
}

fn push(value: i64, kind: ScalarType, out: &mut Vec<u8>) {
    match kind {
        F32 => out.extend((value as f32 / 7.0).to_le_bytes()),
        F64 => out.extend((value as f64 / 7.0).to_le_bytes()),
        integer => out.extend(&value.to_le_bytes()[..integer.size() as usize]),
    }
}

/// Scalars and lists nobody asked for.
fn clutter(random: &mut Random, lists: bool) -> Vec<Column> {
    let mut columns = Vec::new();
    for index in 0..random.below(4) {
        let count = (lists && random.below(3) == 0).then(|| random.pick(&INTEGERS));
        let column =
            Column { name: format!("extra{index}"), role: Role::Other, count, item: random.pick(&ALL) };
        columns.push(column);
    }
    columns
}

/// A random file; also where each vertex record starts in it.
fn generate(random: &mut Random) -> (Vec<u8>, Vec<u64>) {
    let vertices = 1 + random.pick(&[3, 100, 900]);
    let faces = 1 + random.pick(&[5, 200, 9000]);
    let leading = random.pick(&[0, 1, faces / 2, 4096, faces, faces]);
    let narrow = if vertices > 100 { 2 } else { 0 };

    let with_lists = random.below(3) == 0;
    let mut columns = clutter(random, with_lists);
    let packed = random.pick(&[Some(F32), Some(F64), None]);
    for name in ["x", "y", "z"] {
        let item = packed.unwrap_or_else(|| random.pick(&ALL));
        columns.push(Column { name: name.to_owned(), role: Role::Coordinate, count: None, item });
    }
    if packed.is_none() || random.below(2) == 0 {
        random.shuffle(&mut columns);
    }
    let vertex = Table { name: "vertex", records: vertices, columns };

    let with_lists = random.below(2) == 0;
    let mut columns = clutter(random, with_lists);
    columns.push(Column {
        name: random.pick(&["vertex_index", "vertex_indices"]).to_owned(),
        role: Role::Indices,
        count: Some(random.pick(&INTEGERS)),
        item: random.pick(&INTEGERS[narrow..]),
    });
    random.shuffle(&mut columns);
    let face = Table { name: "face", records: faces, columns };

    let mut tables = vec![vertex, face];
    for name in ["edge", "material", "camera"] {
        if random.below(3) == 0 {
            let mut columns = clutter(random, true);
            columns.push(Column { name: "last".to_owned(), role: Role::Other, count: None, item: U8 });
            tables.push(Table { name, records: random.below(40), columns });
        }
    }
    random.shuffle(&mut tables);
    write(random, &tables, vertices, leading)
}

fn write(random: &mut Random, tables: &[Table], vertices: u64, leading: u64) -> (Vec<u8>, Vec<u64>) {
    let (mut lines, mut payload, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for table in tables {
        lines.push(format!("element {} {}", table.name, table.records));
        for Column { name, count, item, .. } in &table.columns {
            lines.push(match count {
                Some(count) => format!("property list {count} {item} {name}"),
                None => format!("property {item} {name}"),
            });
        }
        for record in 0..table.records {
            if table.name == "vertex" {
                starts.push(payload.len() as u64);
            }
            for &Column { role, count, item, .. } in &table.columns {
                let length = match (role, count) {
                    (Role::Indices, _) if record < leading => 3,
                    (Role::Indices, _) => random.below(7) as i64,
                    (_, Some(_)) => random.below(4) as i64,
                    (_, None) => 1,
                };
                if let Some(count) = count {
                    push(length, count, &mut payload);
                }
                for _ in 0..length {
                    let value = match role {
                        Role::Indices => random.below(vertices) as i64,
                        _ => random.next() as i32 as i64,
                    };
                    push(value, item, &mut payload);
                }
            }
        }
    }
    let lines = lines.join("\n");
    let head = ply(&lines, &[]).len() as u64;
    (ply(&lines, &payload), starts.into_iter().map(|start| head + start).collect())
}

fn number(property: &Property) -> f64 {
    match *property {
        Property::Char(value) => value.into(),
        Property::UChar(value) => value.into(),
        Property::Short(value) => value.into(),
        Property::UShort(value) => value.into(),
        Property::Int(value) => value.into(),
        Property::UInt(value) => value.into(),
        Property::Float(value) => value.into(),
        Property::Double(value) => value,
        _ => panic!("a list where a number was written"),
    }
}

fn indices(property: &Property) -> Vec<u64> {
    match property {
        Property::ListChar(values) => values.iter().map(|&value| value as u64).collect(),
        Property::ListUChar(values) => values.iter().map(|&value| value.into()).collect(),
        Property::ListShort(values) => values.iter().map(|&value| value as u64).collect(),
        Property::ListUShort(values) => values.iter().map(|&value| value.into()).collect(),
        Property::ListInt(values) => values.iter().map(|&value| value as u64).collect(),
        Property::ListUInt(values) => values.iter().map(|&value| value.into()).collect(),
        _ => panic!("something else where indices were written"),
    }
}

fn fan(corners: &[u64]) -> Vec<[u64; 3]> {
    (1..corners.len().saturating_sub(1)).map(|i| [corners[0], corners[i], corners[i + 1]]).collect()
}

#[test]
fn random_files_read_as_by_a_full_reader() {
    for seed in 0..150 {
        let (bytes, starts) = generate(&mut Random(seed));
        let full: Ply<DefaultElement> = Parser::new().read_ply(&mut bytes.as_slice()).unwrap();
        let positions: Vec<DVec3> = full.payload["vertex"]
            .iter()
            .map(|vertex| ["x", "y", "z"].map(|name| number(&vertex[name])).into())
            .collect();
        let polygons: Vec<Vec<u64>> = full.payload["face"]
            .iter()
            .map(|face| indices(face.get("vertex_indices").unwrap_or_else(|| &face["vertex_index"])))
            .collect();
        let triangles: Vec<[u64; 3]> = polygons.iter().flat_map(|corners| fan(corners)).collect();
        let (_dir, path) = file(&bytes);
        for mode in MODES {
            let mesh = match PlySource::open(&path, mode) {
                Err(error) if triangles.is_empty() => {
                    assert!(error.to_string().contains("no triangles"), "seed {seed}: {error}");
                    continue;
                }
                mesh => mesh.unwrap(),
            };
            assert_eq!(everything(&mesh).unwrap(), (positions.clone(), triangles.clone()), "seed {seed}");
            assert_eq!(mesh.polygon_count(), polygons.len() as u64);
            let short = polygons.iter().filter(|corners| corners.len() < 3).count();
            assert_eq!(mesh.short_polygons(), short as u64);
            for (id, &start) in starts.iter().enumerate().step_by(13) {
                assert_eq!(mesh.vertex_offset(VertexId(id as u64)), Some(start), "seed {seed}");
            }
            assert_eq!(mesh.vertex_offset(VertexId(starts.len() as u64)), None);
        }
    }
}
