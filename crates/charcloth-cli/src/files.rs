//! Reads the meshes and pictures that a scene names.

use charcloth::mesh::SurfaceMesh;
use charcloth::scene::LengthUnit;
use charcloth::simulation::GreyImage;
use charcloth_io::scene_file::Loader;
use charcloth_io::{images, importers};
use std::path::Path;

/// Reads from the disk with the importers.
#[derive(Debug, Clone, Copy)]
pub struct Files;

impl Loader for Files {
    fn mesh(&self, path: &Path, unit: LengthUnit) -> Result<SurfaceMesh, String> {
        importers::read_mesh(path, unit).map_err(|error| error.to_string())
    }

    fn image(&self, path: &Path) -> Result<GreyImage, String> {
        images::read_grey(path).map_err(|error| error.to_string())
    }
}
