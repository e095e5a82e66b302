//! Files of Charcloth: meshes and pictures in, frames, caches and checkpoints out.
//!
//! Meshes come in through [`importers::read_mesh`], pictures through [`images::read_grey`]. A run is written by
//! [`cache::CacheWriter`], which is a [`charcloth::frame::Sink`], and read back by [`cache::CacheReader`];
//! [`exporters::export`] turns its frames into files for other programs. Whatever can be chosen by name is a row of
//! [`importers::IMPORTERS`] or [`exporters::EXPORTERS`].
pub mod cache;
pub mod error;
pub mod exporters;
mod files;
pub mod fuzz;
pub mod images;
pub mod importers;
pub mod material_file;
pub mod mesh_sequence;
pub mod scene_file;

pub use error::IoError;
