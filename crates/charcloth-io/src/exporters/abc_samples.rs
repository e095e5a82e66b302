//! Properties of an object of Alembic, frame by frame.

use super::ogawa::{Item, Object, OgawaWriter, Pod, Property};
use std::io::{self, Seek, Write};

/// Where a property stands in the tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place {
    Geometry,
    Arbitrary,
    /// In a compound of this name and metadata, which has values and the number of the one that each element has.
    Indexed(&'static str, String),
    /// The same among the arbitrary ones.
    ArbitraryIndexed(&'static str, String),
}

/// Name, place, metadata, type, numbers an element, and bytes of a property in a frame.
#[derive(Debug)]
pub(super) struct Sample(pub &'static str, pub Place, pub String, pub Pod, pub u32, pub Vec<u8>);

/// The properties of an object, with the frames so far.
#[derive(Debug, Default)]
pub(super) struct Columns(Vec<(Place, Property)>);

impl Columns {
    /// Writes the properties of the next frame: the same in each, in the same order.
    pub fn add<W: Write + Seek>(&mut self, file: &mut OgawaWriter<W>, samples: Vec<Sample>) -> io::Result<()> {
        for (k, Sample(name, place, metadata, pod, extent, bytes)) in samples.into_iter().enumerate() {
            if k == self.0.len() {
                let is_scalar = name == ".selfBnds";
                self.0.push((place, file.property(name, &metadata, pod, extent, is_scalar)));
            }
            file.add_sample(&mut self.0[k].1, bytes)?;
        }
        Ok(())
    }

    /// The object of a schema that has them.
    pub fn object<W: Write + Seek>(self, file: &mut OgawaWriter<W>, name: &'static str, schema: &str) -> Object {
        let (mut geometry, mut arbitrary) = (Vec::new(), Vec::new());
        for (place, property) in self.0 {
            match place {
                Place::Geometry => geometry.push(Item::Property(property)),
                Place::Arbitrary => arbitrary.push(Item::Property(property)),
                Place::Indexed(name, metadata) => add_to(&mut geometry, name, file.metadata(&metadata), property),
                Place::ArbitraryIndexed(name, metadata) => {
                    add_to(&mut arbitrary, name, file.metadata(&metadata), property);
                }
            }
        }
        geometry.push(Item::Compound { name: ".arbGeomParams", metadata: 0, items: arbitrary });
        let about = format!("schema={schema};schemaBaseType=AbcGeom_GeomBase_v1");
        let metadata = file.metadata(&about);
        let items = vec![Item::Compound { name: ".geom", metadata, items: geometry }];
        Object { name, metadata: file.metadata(&format!("{about};schemaObjTitle={schema}:.geom")), items }
    }
}

/// Adds a property to a compound, which is made with the first.
fn add_to(items: &mut Vec<Item>, name: &'static str, metadata: u32, property: Property) {
    let there = items.iter_mut().find_map(|item| match item {
        Item::Compound { name: there, items, .. } if *there == name => Some(items),
        _ => None,
    });
    match there {
        Some(items) => items.push(Item::Property(property)),
        None => items.push(Item::Compound { name, metadata, items: vec![Item::Property(property)] }),
    }
}
