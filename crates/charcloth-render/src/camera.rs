//! A perspective camera that fits the sheet as it lies at the start, and then stands still.

use crate::error::RenderError;
use crate::image::LARGEST_SIDE;
use charcloth::contact::scenery::Scenery;
use charcloth::scene::{Axis, Camera as CameraSettings};
use glam::DVec3;

/// Part of the half picture that the sheet may fill at zoom 1.
/// tuned: 0.7 to 0.95; leaves room for curling edges and for the first centimetres of a falling flake.
const FILL: f64 = 0.86;

/// What is looked at and how large the picture is: everything a look is built from.
#[derive(Debug, Clone)]
pub struct View {
    /// The camera, as the scene has it.
    pub settings: CameraSettings,
    /// Which way is up.
    pub up: Axis,
    /// Lowest and highest corner of the sheet at the start [m].
    pub bounds: (DVec3, DVec3),
    /// Width and height of the picture [pixels].
    pub size: [u32; 2],
    /// What the sheet meets.
    pub scenery: Scenery,
}

/// A perspective camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where it stands [m].
    pub eye: DVec3,
    /// The point it looks at [m]; single-precision copies of positions count from here.
    pub target: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub top: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector against gravity.
    pub up: DVec3,
    /// Pixels per unit of tangent.
    pub focal_length: f64,
    /// Width and height of the picture [pixels].
    pub size: [u32; 2],
    /// Radius of the sheet at the start, about its middle [m].
    pub radius: f64,
}

/// A point on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// Column, from the left [pixels].
    pub x: f64,
    /// Row, from the top [pixels].
    pub y: f64,
    /// One over the distance along the view direction [1/m]; not positive behind the camera.
    pub inverse_depth: f64,
}

impl Camera {
    /// Puts the camera where it sees the whole sheet.
    pub fn build(view: &View) -> Result<Self, RenderError> {
        let View { settings, up, bounds: (low, high), size, .. } = view;
        if size.iter().any(|side| *side == 0 || *side > LARGEST_SIDE) {
            return Err(RenderError::Size { width: size[0], height: size[1] });
        }
        let [azimuth, elevation, field_of_view] = [settings.azimuth.0, settings.elevation.0, settings.field_of_view.0];
        let shift = DVec3::from_array(settings.shift.map(|length| length.0));
        if !(low.is_finite() && high.is_finite() && low.cmple(*high).all()) {
            return Err(RenderError::Camera(format!("the sheet has no finite bounds (from {low} to {high} m)")));
        }
        if !(azimuth.is_finite() && elevation.is_finite() && shift.is_finite()) {
            return Err(RenderError::Camera("azimuth, elevation and shift must be finite numbers".into()));
        }
        if !(settings.zoom.is_finite() && settings.zoom > 0.0) {
            return Err(RenderError::Camera(format!("zoom is {}; it must be more than 0", settings.zoom)));
        }
        if !(field_of_view > 0.01 && field_of_view < 3.0) {
            return Err(RenderError::Camera(format!(
                "field_of_view is {field_of_view} rad; it must be between 0.01 and 3.0 rad"
            )));
        }
        // Straight up or down has no horizon to hold level; stop just short of it.
        let elevation = elevation.clamp(-1.5697, 1.5697);
        let up_axis = match up {
            Axis::Y => DVec3::Y,
            Axis::Z => DVec3::Z,
        };
        let level = match up {
            Axis::Y => DVec3::new(azimuth.sin(), 0.0, azimuth.cos()),
            Axis::Z => DVec3::new(azimuth.sin(), -azimuth.cos(), 0.0),
        };
        let backward = level * elevation.cos() + up_axis * elevation.sin();
        let right = up_axis.cross(backward).normalize();
        let top = backward.cross(right);

        // The least distance at which every corner of the box is inside the four sides of the picture.
        let tangent = (field_of_view / 2.0).tan();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let middle = (*low + *high) / 2.0;
        let half = ((*high - *low) / 2.0).max(DVec3::splat(1e-4));
        let mut distance: f64 = 0.0;
        for corner in 0..8 {
            let sign = |bit: i32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let offset = half * DVec3::new(sign(1), sign(2), sign(4));
            let across = offset.dot(right).abs() / (tangent * aspect * FILL);
            let along = offset.dot(top).abs() / (tangent * FILL);
            distance = distance.max(offset.dot(backward) + across.max(along));
        }
        let target = middle + shift;
        Ok(Self {
            eye: target + backward * (distance / settings.zoom),
            target,
            right,
            top,
            forward: -backward,
            up: up_axis,
            focal_length: f64::from(size[1]) / 2.0 / tangent,
            size: *size,
            radius: half.length(),
        })
    }

    /// Where a point [m] is on the picture.
    #[inline]
    pub fn project(&self, point: DVec3) -> Projected {
        let offset = point - self.eye;
        let inverse_depth = 1.0 / offset.dot(self.forward);
        let scale = self.focal_length * inverse_depth;
        Projected {
            x: f64::from(self.size[0]) / 2.0 + offset.dot(self.right) * scale,
            y: f64::from(self.size[1]) / 2.0 - offset.dot(self.top) * scale,
            inverse_depth,
        }
    }

    /// Width of a pixel at the distance of the target [m].
    pub fn pixel_width(&self) -> f64 {
        (self.target - self.eye).length() / self.focal_length
    }
}
