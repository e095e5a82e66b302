//! How frames, sizes and cameras are named on the command line.

use charcloth::scene::Camera;
use charcloth::units::Angle;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// `12`, `10..20`, `10..` or `..20`; the last frame is among them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// First frame, if named.
    pub first: Option<u32>,
    /// Last frame, if named.
    pub last: Option<u32>,
    /// Whether it was a single number.
    pub single: bool,
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| -> Result<Option<u32>, String> {
            let text = text.trim();
            if text.is_empty() {
                return Ok(None);
            }
            text.parse().map(Some).map_err(|_| format!("\"{text}\" is no frame number; write 48 or 0..48"))
        };
        let frames = match text.split_once("..") {
            Some((first, last)) => {
                Self { first: number(first)?, last: number(last.trim_start_matches('='))?, single: false }
            }
            None => {
                let only = number(text)?.ok_or("write a frame number, or two as in 0..48")?;
                Self { first: Some(only), last: Some(only), single: true }
            }
        };
        match (frames.first, frames.last) {
            (Some(first), Some(last)) if first > last => Err(format!("{first} is after {last}; write {last}..{first}")),
            _ => Ok(frames),
        }
    }
}

impl Frames {
    /// The frames as a range; open ends reach as far as there are numbers.
    pub fn range(self) -> RangeInclusive<u32> {
        self.first.unwrap_or(0)..=self.last.unwrap_or(u32::MAX)
    }
}

/// Reads a size such as `960x720`.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|side| (16..=16384).contains(side));
    let (width, height) = text.split_once(['x', 'X', '*']).ok_or("write width x height, such as 960x720")?;
    match (side(width), side(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err("width and height are from 16 to 16384 pixels".to_owned()),
    }
}

/// A camera from the command line: what is left out stays as the scene has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraChange {
    azimuth: Option<f64>,
    elevation: Option<f64>,
    zoom: Option<f64>,
}

impl FromStr for CameraChange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        if parts.len() > 3 {
            return Err("write azimuth,elevation,zoom, such as 30deg,10deg,1.5".to_owned());
        }
        let part = |index: usize| parts.get(index).copied().filter(|text| !text.is_empty());
        let angle = |index| part(index).map(|text| Angle::parse(text).map(|angle| angle.0)).transpose();
        let zoom = part(2).map(|text| text.parse::<f64>().map_err(|_| format!("\"{text}\" is no zoom, such as 1.5")));
        let change = Self { azimuth: angle(0)?, elevation: angle(1)?, zoom: zoom.transpose()? };
        let finite = [change.azimuth, change.elevation, change.zoom].into_iter().flatten().all(f64::is_finite);
        if !finite || change.zoom.is_some_and(|zoom| zoom <= 0.0) {
            return Err("angles are ordinary numbers, and the zoom is over 0".to_owned());
        }
        Ok(change)
    }
}

impl CameraChange {
    /// Changes a camera.
    pub fn apply(self, camera: &mut Camera) {
        camera.azimuth = self.azimuth.map_or(camera.azimuth, Angle);
        camera.elevation = self.elevation.map_or(camera.elevation, Angle);
        camera.zoom = self.zoom.unwrap_or(camera.zoom);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_number_or_a_range() {
        let read = |text: &str| text.parse::<Frames>().map(Frames::range);
        assert_eq!(read("12"), Ok(12..=12));
        assert_eq!(read("10..20"), Ok(10..=20));
        assert_eq!(read("10..=20"), Ok(10..=20));
        assert_eq!(read("..20"), Ok(0..=20));
        assert_eq!(read("10.."), Ok(10..=u32::MAX));
        for wrong in ["", "x", "20..10", "-1", "1.5", "1..x"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_and_cameras_are_checked() {
        assert_eq!(parse_size("960x720"), Ok([960, 720]));
        for wrong in ["960", "0x10", "x", "99999x20"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
        let mut camera = Camera::default();
        "90deg,,2".parse::<CameraChange>().unwrap().apply(&mut camera);
        assert_eq!((camera.azimuth.0, camera.zoom), (std::f64::consts::FRAC_PI_2, 2.0));
        assert_eq!(camera.elevation, Camera::default().elevation);
        for wrong in ["1 m", "0,0,0", "0,0,nan", "1,2,3,4"] {
            assert!(wrong.parse::<CameraChange>().is_err(), "{wrong}");
        }
    }
}
